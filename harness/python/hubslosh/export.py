"""A craft as files for other tools: an FMU that starts as the craft, SSP, .ssv and .mat.

The FMU has the binary of Spacecraft, and a description with the tanks and modes of the craft, whose
start values are those of the craft.
"""

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from .files import to_mat
from .fmu import Fmu, FmuError, Parameters, Value
from .linearization import LinearModel
from .temporary import output, write_file

# Beginnings of the names of outputs that the system and the script show.
SHOWN = ("q[", "omega[", "position[", "velocity[")

# Namespace of OMSimulator's annotations.
OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"

SCRIPT = """\
% The craft in Simulink (R2020b or newer): craft.fmu as a Co-Simulation block in a new model.
%
% Tried in Octave: everything up to "The model". UNTRIED: the rest, written from Simulink's
% documentation. The FMU starts with the values of the craft, so that no parameter has to be set.
% craft.mat has the linear model (A, B, C, D, states, inputs, outputs) from torque to q and omega at
% this fill, the parameters (parameter_names, parameter_values) and the inputs at the start
% (input_names, input_values), in SI units.
%
%   >> craft_simulink

folder = fileparts(mfilename('fullpath'));
load(fullfile(folder, 'craft.mat'));
if ~isempty(which('ss'))
    craft = ss(A, B, C, D);
end

% Ports have the order of the FMU's variables.
unpacked = tempname();
unzip(fullfile(folder, 'craft.fmu'), unpacked);
xml = fileread(fullfile(unpacked, 'modelDescription.xml'));
rmdir(unpacked, 's');
found = regexp(xml, '<PATTERN name="([^"]+)"[^>]*causality="(\\w+)"', 'tokens');
variables = cellfun(@(one) one{1}, found, 'UniformOutput', false);
causality = cellfun(@(one) one{2}, found, 'UniformOutput', false);
ports = variables(strcmp(causality, 'input'));
results = variables(strcmp(causality, 'output'));
assert(isequal(ports(:), input_names(:)), 'inputs: %s', strjoin(ports, ', '));
[known, places] = ismember({SHOWN}, results);
assert(all(known), 'outputs: %s', strjoin(results, ', '));
fprintf('inputs: %s\\n', strjoin(ports, ', '));
fprintf('output %d: %s\\n', [num2cell(places); results(places)]{:});
if isempty(which('new_system'))
    fprintf('Simulink is not here: no model is built\\n');
    return
end

% The model
model = 'craft_example';
if bdIsLoaded(model)
    close_system(model, 0);
end
new_system(model);
add_block('simulink_extras/FMU Import/FMU', [model '/craft'], 'FMUName', ...
    fullfile(folder, 'craft.fmu'));
% The FMU offers both interfaces. If your release has taken Model Exchange, choose Co-Simulation in
% the block's dialog.
for k = 1:numel(ports)
    name = regexprep(ports{k}, '\\W', '_');
    add_block('simulink/Sources/Constant', [model '/' name], 'Value', ...
        sprintf('%.17g', input_values(k)));
    add_line(model, [name '/1'], sprintf('craft/%d', k));
end
for k = 1:numel(places)
    name = regexprep(results{places(k)}, '\\W', '_');
    add_block('simulink/Sinks/To Workspace', [model '/' name], 'VariableName', name, ...
        'SaveFormat', 'Timeseries');
    add_line(model, sprintf('craft/%d', places(k)), [name '/1']);
end
open_system(model);
"""


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
    changed = dict(fmu.native.part(*sizes, [(n, _text(v)) for n, v in values.items()]))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FmuError(f"the folder {folder} cannot be made: {error}") from None
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
    to_mat(_Mat(linear, values, start), paths["mat"])
    pattern = "Float64" if part.native.is_fmi3 else "ScalarVariable"
    shown = ", ".join(f"'{name}'" for name in _shown(part))
    script = SCRIPT.replace("PATTERN", pattern).replace("{SHOWN}", f"{{{shown}}}")
    write_file(paths["script"], ".m", lambda: script)
    return paths


def _copy(path: Path, archive: zipfile.ZipFile, changed: Mapping[str, str]) -> None:
    """Copy an archive with other texts for some of its files."""
    left = dict(changed)
    with zipfile.ZipFile(path) as whole:
        for entry in whole.infolist():
            text = left.pop(entry.filename, None)
            archive.writestr(entry, whole.read(entry) if text is None else text)
    for name, text in left.items():
        archive.writestr(_entry(name), text)


def _entry(name: str) -> zipfile.ZipInfo:
    """Return an entry without a date, so that the same craft gives the same bytes."""
    entry = zipfile.ZipInfo(name)
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def _text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _ssv(fmu: Fmu, values: Mapping[str, Value]) -> str:
    """Return the parameter set of SSP 1.0."""
    rows = []
    for name, value in values.items():
        items = dict(map(reversed, fmu.variable(name).items))  # type: ignore[arg-type]
        kind = fmu.kind(name)
        text = str(items[value]) if kind == "Enumeration" else _text(value)
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
    """Return the SSP description of a system: the FMU, its inputs and its visible outputs."""
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
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<ssd:SystemStructureDescription name="craft" version="1.0"\n'
        '    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"\n'
        '    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription">\n'
        '  <ssd:System name="system">\n    <ssd:Elements>\n'
        '      <ssd:Component name="craft" type="application/x-fmu-sharedlibrary"\n'
        '          source="resources/craft.fmu" implementation="CoSimulation">\n'
        f"        <ssd:Connectors>\n{''.join(connectors)}        </ssd:Connectors>\n"
        "        <ssd:ParameterBindings>\n"
        '          <ssd:ParameterBinding source="resources/craft.ssv"/>\n'
        "        </ssd:ParameterBindings>\n      </ssd:Component>\n    </ssd:Elements>\n"
        "    <ssd:Annotations>\n"
        "      <!-- OMSimulator 2 does not load a system without. -->\n"
        '      <ssc:Annotation type="org.openmodelica"><oms:Annotations\n'
        f'        xmlns:oms="{OMS}">\n'
        '        <oms:SimulationInformation><oms:FixedStepMaster description="oms-ma"\n'
        '          stepSize="0.02" absoluteTolerance="1e-8" relativeTolerance="1e-8"/>\n'
        "        </oms:SimulationInformation>\n"
        "      </oms:Annotations></ssc:Annotation>\n    </ssd:Annotations>\n  </ssd:System>\n"
        f"  <ssd:Units>\n{''.join(defined)}  </ssd:Units>\n"
        '  <ssd:DefaultExperiment startTime="0" stopTime="60"/>\n'
        "</ssd:SystemStructureDescription>\n"
    )


@dataclass(frozen=True)
class _Mat:
    """Linear model, parameters and inputs of a craft in the form that `to_mat` writes."""

    linear: LinearModel
    values: Mapping[str, Value]
    inputs: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Return the content of the .mat file: the values by the names of the variables."""
        return {
            **{name: getattr(self.linear, name) for name in "ABCD"},
            **{name: list(getattr(self.linear, name)) for name in ("states", "inputs", "outputs")},
            "period": 0.0,
            "parameter_names": list(self.values),
            "parameter_values": [float(value) for value in self.values.values()],
            "input_names": list(self.inputs), "input_values": list(self.inputs.values()),
        }  # fmt: skip
