"""Export of a craft as files for other tools: FMU, SSP system, .ssv parameters and .mat.

The FMU has the binary of Spacecraft. Its model description has only the variables of the craft's
tanks and modes, and the craft's values as start values.
"""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from .files import to_mat
from .fmu import Fmu, FmuError, Parameters, Value, text_of
from .linearization import LinearModel
from .temporary import output, write_file

# Prefixes of the names of the outputs that the SSP system and the Simulink script connect.
SHOWN = ("q[", "omega[", "position[", "velocity[")

# Templates of the Simulink script and of the SSP description.
SCRIPT, SYSTEM = (
    Path(__file__).with_name(name).read_text(encoding="utf-8")
    for name in ("craft_simulink.m", "craft.ssd")
)


def export(
    folder: str | Path, model: str | Path, parameters: Parameters, linear: LinearModel
) -> dict[str, Path]:
    """Write a craft with these parameters as FMU, SSV, SSP, .mat and script; see `Craft.export`."""
    folder = Path(folder)
    fmu = Fmu.open(model)
    values = {name: fmu.convert(name, value) for name, value in parameters.items()}
    modes = [int(value) for name, value in values.items() if name.endswith("].modes")]
    named = [int(name[10]) for name in values if name.startswith("appendage[")]
    appendages = int(values.get("appendages", max([0, *named])))
    sizes = max(1, int(values["tanks"])), max([1, *modes]), appendages
    changed = dict(fmu.native.part(*sizes, [(n, text_of(v)) for n, v in values.items()]))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FmuError(f"the folder {folder} cannot be created: {error}") from None
    paths = {
        kind: folder / name
        for kind, name in {
            "fmu": "craft.fmu", "ssv": "craft.ssv", "ssp": "craft.ssp", "mat": "craft.mat",
            "script": "craft_simulink.m",
        }.items()
    }  # fmt: skip
    with output(paths["fmu"]) as new, zipfile.ZipFile(new, "w") as archive:
        _copy(fmu.path, archive, changed)
    part = Fmu(paths["fmu"])
    ssv = _ssv(part, values)
    write_file(paths["ssv"], ".ssv", lambda: ssv)
    with output(paths["ssp"]) as new, zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_entry("SystemStructure.ssd"), _ssd(part))
        archive.writestr(_entry("resources/craft.ssv"), ssv)
        archive.writestr(_entry("resources/craft.fmu"), paths["fmu"].read_bytes())
    start = {
        name: float(values.get(name, part.variable(name).start or 0))
        for name in part.names("input")
    }
    contents = {
        **{name: getattr(linear, name) for name in "ABCD"},
        **{name: list(getattr(linear, name)) for name in ("states", "inputs", "outputs")},
        "period": 0.0,
        "parameter_names": list(values), "parameter_values": [*map(float, values.values())],
        "input_names": list(start), "input_values": list(start.values()),
    }  # fmt: skip
    to_mat(contents, paths["mat"])
    pattern = "Float64" if part.native.is_fmi3 else "ScalarVariable"
    shown = ", ".join(f"'{name}'" for name in _shown(part))
    script = SCRIPT.replace("@pattern@", pattern).replace("@shown@", shown)
    write_file(paths["script"], ".m", lambda: script)
    return paths


def _copy(path: Path, archive: zipfile.ZipFile, changed: Mapping[str, str]) -> None:
    """Copy the entries of the ZIP file ``path`` into ``archive``.

    ``changed`` has new texts by the names of entries. Names that ``path`` lacks are added.
    """
    left = dict(changed)
    with zipfile.ZipFile(path) as whole:
        for entry in whole.infolist():
            text = left.pop(entry.filename, None)
            archive.writestr(entry, whole.read(entry) if text is None else text)
    for name, text in left.items():
        archive.writestr(_entry(name), text)


def _entry(name: str) -> zipfile.ZipInfo:
    """Return the header of the file ``name`` in a ZIP file, with a fixed date.

    Two exports of the same craft then have the same bytes.
    """
    entry = zipfile.ZipInfo(name)
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def _ssv(fmu: Fmu, values: Mapping[str, Value]) -> str:
    """Return ``values`` as the XML text of a parameter set of SSP 1.0 (.ssv).

    The types of the values are those of the variables in ``fmu``.
    """
    rows = []
    for name, value in values.items():
        items = dict(map(reversed, fmu.variable(name).items))  # type: ignore[arg-type]
        kind = fmu.kind(name)
        text = str(items[value]) if kind == "Enumeration" else text_of(value)
        rows.append(
            f"    <ssv:Parameter name={quoteattr(name)}>"
            f"<ssv:{kind} value={quoteattr(text)}/></ssv:Parameter>\n"
        )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<ssv:ParameterSet version="1.0" name="craft"\n'
        '    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">\n'
        f"  <ssv:Parameters>\n{''.join(rows)}  </ssv:Parameters>\n</ssv:ParameterSet>\n"
    )


def _shown(fmu: Fmu) -> list[str]:
    return [name for name in fmu.names("output") if name.startswith(SHOWN)]


def _ssd(fmu: Fmu) -> str:
    """Return the XML text of an SSP 1.0 system that contains the FMU.

    The system passes on the FMU's inputs and the outputs listed in `SHOWN`.
    """
    connectors, units = [], {}
    for kind, names in (("input", fmu.names("input")), ("output", _shown(fmu))):
        for name in names:
            variable = fmu.variable(name)
            unit = variable.unit
            if variable.base is not None:
                units[unit] = variable.base
            known = f" unit={quoteattr(unit)}" if unit in units else ""
            connectors.append(
                f'          <ssd:Connector name="{name}" kind="{kind}"><ssc:Real{known}/>'
                "</ssd:Connector>\n"
            )
    bases = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
    defined = []
    for unit, (exponents, factor, offset) in units.items():
        powers = "".join(f' {b}="{e}"' for b, e in zip(bases, exponents, strict=True) if e)
        powers += f' factor="{factor!r}"' * (factor != 1) + f' offset="{offset!r}"' * (offset != 0)
        defined.append(f"    <ssc:Unit name={quoteattr(unit)}><ssc:BaseUnit{powers}/></ssc:Unit>\n")
    return SYSTEM.replace("@connectors@", "".join(connectors)).replace("@units@", "".join(defined))
