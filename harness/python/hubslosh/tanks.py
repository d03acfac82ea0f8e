"""From a tank's drawing and a fill to modal parameters, by the program ``hubslosh tank``."""

import json
import os
import subprocess
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import temporary
from .fmu import FmuError, FmuWarning
from .program import find_program

if TYPE_CHECKING:
    import pandas as pd

    from .fmu import Value

_TEMPORARY = ".hubslosh-tank.toml"

SIX_AXES = ("Spacecraft", "SloshTank")
"""FMUs in six axes; their tanks differ in the beginning of a name alone."""


@dataclass(frozen=True, eq=False)
class Tank:
    """A tank at a fill, as `tank` gives it."""

    all: dict[str, Any]
    """Result that ``hubslosh tank --out`` writes: ``m_liq`` (kg), ``z_cg``, ``I_eff_cg``, …"""
    picture: str
    """Tank, free surface and mode shapes, SVG; a notebook shows it."""
    gravity: float
    """m/s² along the tank's axis."""
    _source: "dict[str, Any] | Path" = field(repr=False)
    _flags: list[str] = field(repr=False)
    _liquid: list[str] = field(repr=False)
    _program: Path = field(repr=False)

    @property
    def mass(self) -> float:
        """Mass of the liquid, kg."""
        return float(self.all["m_liq"])

    @cached_property
    def modes(self) -> "pd.DataFrame":
        """A row per mode.

        ``frequency`` (Hz), ``mass`` (kg), ``length``, heights of ``bob`` and ``hinge`` (m),
        ``wave`` at the wall per pendulum angle (m/rad).
        """
        import numpy as np
        import pandas as pd

        columns = {"m": "mass", "l": "length", "H": "bob", "hinge": "hinge", "wave": "wave"}
        table = pd.DataFrame(self.all["modes"]).reindex(columns=["lambda", *columns])
        table.insert(0, "frequency", np.sqrt(self.gravity * table.pop("lambda")) / (2 * np.pi))
        table = table.rename(columns=columns)
        if damping := self.all.get("damping"):
            found = damping["modes"]
            table["zeta"] = [mode["zeta"] for mode in found]
            for name, end in (("zeta_low", 0), ("zeta_high", 1)):
                table[name] = [mode["interval"][end] for mode in found]
        units = dict.fromkeys(("length", "bob", "hinge"), "m")
        table.attrs["units"] = {"frequency": "Hz", "mass": "kg", "wave": "m/rad"} | units
        return table

    def __repr__(self) -> str:
        """Return the liquid and its first modes."""
        from .short import rows

        what = f"{self.all['name']}: " if self.all.get("name") else ""
        full = f"Tank, {what}{self.mass:.6g} kg of liquid at a fill of {self.all['fill']:.4g} m"
        return f"{full}, {self.gravity:.4g} m/s² along the axis\n{rows(self.modes)}"

    def _repr_svg_(self) -> str:
        return self.picture

    def save(self, path: str | Path) -> None:
        """Write the picture, .svg."""
        if Path(path).suffix.lower() != ".svg":
            raise FmuError(f"{path}: the picture is SVG, its name ends in .svg")
        try:
            Path(path).write_text(self.picture, encoding="utf-8")
        except OSError as error:
            raise FmuError(f"{path} cannot be written: {error}") from None

    def parameters(
        self,
        model: str = "Spacecraft",
        number: int = 1,
        *,
        position: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
        rigid: bool = False,
    ) -> "dict[str, Value]":
        """Return it under the names of an FMU's parameters, for `simulate`, `Loop` and the others.

        * ``model``: Spacecraft, with the ``number`` of the tank, 1 to 4; SloshTank; or HubSlosh, a
          table of modes. Damping ratios and centring stiffnesses are there if `tank` was given
          viscosity and surface tension; what the program warns of is a `FmuWarning`.
        * ``position``: Position of the tank's zero (of a ``shape`` its lowest point), body axes, m.
        * ``axis``: Direction of the tank's axis, upwards, in body axes; by default z.
        * ``rigid``: The same liquid without slosh, at its centre, with the inertia that it has
          under a lid. Not of HubSlosh.
        """
        placed = {"position": position, "axis": axis}
        for name, value in placed.items():
            if value is None:
                continue
            if model not in SIX_AXES:
                raise FmuError(f"{name} is for {' and '.join(SIX_AXES)}, not for {model}")
            try:
                numbers = [float(x) for x in value]
            except (TypeError, ValueError):
                numbers = []
            if len(numbers) != 3 or (name == "axis" and not any(numbers)):
                raise FmuError(f"{name} must be three numbers, not {value!r}")
        if model == "Spacecraft":
            if number not in (1, 2, 3, 4):
                raise FmuError(f"the tank's number is 1 to 4, not {number!r}")
            prefix = f"tank[{number}]"
            found = {
                prefix + name.removeprefix("tank[1]"): value
                for name, value in self._of_spacecraft.items()
            }
        elif model == "SloshTank":
            prefix, found = "tank", self._files("SloshTank")
        elif model == "HubSlosh":
            if rigid:
                raise FmuError("HubSlosh has the rigid liquid as slosh.model = frozen")
            return self._files("HubSlosh")
        else:
            raise FmuError(f"there are no parameters of a tank for {model!r} (for: Spacecraft, "
                           "SloshTank, HubSlosh)")  # fmt: skip
        if rigid:
            whole = ("m_0", "H_0", "I_0", "dI_y", "I_z", "g_ref", "modes")
            kept = {f"{prefix}.{name}" for name in whole}
            found = {name: value for name, value in found.items() if name in kept}
            found |= {f"{prefix}.m_0": self.mass, f"{prefix}.H_0": float(self.all["z_cg"])}
            # of a box with two lengths that about y, along its first length
            about_x = float(self.all["I_eff_cg"]) - float(found.get(f"{prefix}.dI_y", 0.0))
            found |= {f"{prefix}.I_0": about_x, f"{prefix}.modes": 0}
        if position is not None:
            found |= {f"{prefix}.position[{i + 1}]": float(x) for i, x in enumerate(position)}
        if axis is not None:
            found |= {f"{prefix}.q[{i + 1}]": x for i, x in enumerate(_from_z(axis))}
        return found

    @cached_property
    def _of_spacecraft(self) -> "dict[str, Value]":
        return self._files("Spacecraft")

    def _files(self, model: str) -> "dict[str, Value]":
        from .tables import read_parameters

        with _folder(self._source) as (folder, file):
            out = folder / "parameters.toml"
            flags = ["--model", model, "--parameters", str(out), "--out", str(folder / "r.json")]
            said = _call(self._program, [str(file), *self._flags, *self._liquid, *flags])
            for warning in said:
                warnings.warn(warning, FmuWarning, stacklevel=3)
            return read_parameters(out)


def tank(
    source: str | Path | Mapping[str, Any],
    fill: float | str | None = None,
    *,
    fill_mass: float | None = None,
    modes: int = 3,
    gravity: float = 9.80665,
    nu: float | None = None,
    sigma: float | None = None,
    contact_angle: float | None = None,
    program: str | Path | None = None,
) -> Tank:
    """Return masses, lengths and hinges of a tank's slosh modes, by linear potential flow.

    * ``source``: A tank file (.toml), or what stands in one: ``{"density": 1010, "shape":
      {"sphere": {"radius": 0.4}}}``.
    * ``fill``: Height above the lowest point, m, or ``"60%"`` of the volume.
    * ``fill_mass``: Mass of the liquid instead of ``fill``, kg.
    * ``modes``: Number of modes.
    * ``gravity``: Specific force along the axis, m/s², for frequencies and damping.
    * ``nu``: Kinematic viscosity, m²/s, for damping ratios.
    * ``sigma``: Surface tension, N/m, for centring stiffnesses; they go into `Tank.parameters`.
    * ``contact_angle``: Contact angle of the liquid at the wall, degrees.

    Needs the program ``hubslosh``; see `campaign`. Its page on tanks has every shape.
    """
    found, said = solve(
        source, fill, fill_mass=fill_mass, modes=modes, gravity=gravity, nu=nu, sigma=sigma,
        contact_angle=contact_angle, program=program,
    )  # fmt: skip
    for warning in said:
        warnings.warn(warning, FmuWarning, stacklevel=2)
    return found


def solve(
    source: str | Path | Mapping[str, Any],
    fill: float | str | None = None,
    *,
    fill_mass: float | None = None,
    modes: int = 3,
    gravity: float = 9.80665,
    nu: float | None = None,
    sigma: float | None = None,
    contact_angle: float | None = None,
    program: str | Path | None = None,
    spacecraft: bool = False,
) -> tuple[Tank, list[str]]:
    """Return the result of `tank` and the program's warnings.

    * ``spacecraft``: Also compute the parameters of Spacecraft. A full tank has no modes, and only
      the parameters of rigid liquid.
    """
    from .tables import read_parameters

    if (fill is None) == (fill_mass is None):
        raise FmuError('give the fill: a height in m, "60%" of the volume, or fill_mass in kg')
    if isinstance(fill, str) and not fill.strip().endswith("%"):
        raise FmuError(f'fill is a height in m, or a text such as "60%", not {fill!r}')
    numbers = {
        "fill": None if isinstance(fill, str) else fill, "fill_mass": fill_mass, "modes": modes,
        "gravity": gravity, "nu": nu, "sigma": sigma, "contact_angle": contact_angle,
    }  # fmt: skip
    for name, value in numbers.items():
        if value is not None and (isinstance(value, bool) or not _is_number(value)):
            raise FmuError(f"{name} must be a number, not {value!r}")
    given = _given(source)
    amount = ["--fill", str(fill)] if fill is not None else ["--fill-mass", str(fill_mass)]
    flags = [*amount, "--modes", str(modes), "--gravity", repr(float(gravity))]
    liquid = _liquid_flags(nu, sigma, contact_angle)
    found = find_program(program)
    with _folder(given) as (folder, file):
        out, picture = folder / "result.json", folder / "picture.svg"
        written = ["--out", str(out), "--picture", str(picture)]
        parameters = folder / "parameters.toml"
        full = isinstance(fill, str) and fill.strip() == "100%"
        if spacecraft and not full:
            written += ["--model", "Spacecraft", "--parameters", str(parameters)]
        said = _call(found, [str(file), *flags, *liquid, *written])
        result = json.loads(out.read_text(encoding="utf-8"))
        drawing = picture.read_text(encoding="utf-8")
        solved = Tank(result, drawing, float(gravity), given, flags, liquid, found)
        if parameters.exists():
            solved.__dict__["_of_spacecraft"] = read_parameters(parameters)
        elif not result["modes"]:
            solved.__dict__["_of_spacecraft"] = {"tank[1].I_z": 0.0}
    return solved, said


def fill_table(
    source: str | Path | Mapping[str, Any],
    between: Sequence[float | str],
    *,
    modes: int = 3,
    gravity: float = 9.80665,
    nu: float | None = None,
    sigma: float | None = None,
    contact_angle: float | None = None,
    program: str | Path | None = None,
) -> "tuple[dict[str, Value], list[str]]":
    """Return the fill table of tank 1 of Spacecraft, which lets it drain, and warnings.

    * ``between``: Lowest and highest fill of the table, as ``fill`` of `tank`. The program places
      up to 12 points between them, in some 5 s of CPU time.

    The other arguments are those of `tank`.
    """
    from .tables import read_parameters

    ends = ",".join(str(end) for end in between)
    flags = ["--sweep", ends, "--modes", str(modes), "--gravity", repr(float(gravity))]
    flags += _liquid_flags(nu, sigma, contact_angle)
    with _folder(_given(source)) as (folder, file):
        out = folder / "parameters.toml"
        flags += ["--model", "Spacecraft", "--parameters", str(out)]
        flags += ["--out", str(folder / "sweep.csv")]
        said = _call(find_program(program), [str(file), *flags])
        return read_parameters(out), said


def _given(source: Any) -> "dict[str, Any] | Path":
    """Return a tank's file, or what would stand in one."""
    if isinstance(source, Mapping):
        given = dict(source)
        for key in ("points", "svg"):  # relative to the tank file
            if isinstance(given.get(key), str):
                given[key] = str(Path(given[key]).absolute())
        return given
    if isinstance(source, str | Path):
        return Path(source)
    raise FmuError(f"a tank is a file or a dict of what stands in one, not {source!r}")


def _liquid_flags(nu: float | None, sigma: float | None, contact_angle: float | None) -> list[str]:
    options = {"--nu": nu, "--sigma": sigma, "--contact-angle": contact_angle}
    given = {name: repr(float(value)) for name, value in options.items() if value is not None}
    return [text for pair in given.items() for text in pair]


def _is_number(value: Any) -> bool:
    try:
        return float(value) == float(value)
    except (TypeError, ValueError):
        return False


@contextmanager
def _folder(source: dict[str, Any] | Path) -> "Iterator[tuple[Path, Path]]":
    """Yield a folder for results, and the tank's file, which is there if it was a dict."""
    with temporary.folder() as name:
        folder = Path(name)
        if isinstance(source, Path):
            yield folder, source
            return
        file = folder / _TEMPORARY
        file.write_text(
            "".join(f"{_key(k)} = {_toml(v)}\n" for k, v in source.items()), encoding="utf-8"
        )
        yield folder, file


def _key(key: Any) -> str:
    return json.dumps(str(key))


def _toml(value: Any) -> str:
    """Return a value as TOML has it."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items())
        return f"{{ {inner} }}"
    if isinstance(value, str | os.PathLike):
        return json.dumps(str(value), ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if hasattr(value, "tolist"):  # of numpy
        return _toml(value.tolist())
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Sequence):
        return f"[{', '.join(_toml(v) for v in value)}]"
    raise FmuError(f"{value!r} cannot stand in a tank file")


def _call(program: Path, arguments: list[str]) -> list[str]:
    """Run ``hubslosh tank`` and return its warnings."""
    try:
        done = subprocess.run([program, "tank", *arguments], capture_output=True, check=False)
    except OSError as error:
        raise FmuError(f"{program} cannot be started: {error}") from None
    said = done.stderr.decode(errors="replace").strip()
    if done.returncode != 0:
        text = said.removeprefix("error: ")
        if Path(arguments[0]).name == _TEMPORARY:  # of a dict; where it was says nothing
            text = text.replace(f"{arguments[0]}: ", "").replace(arguments[0], "the tank")
        raise FmuError(f"hubslosh tank: {text}")
    lines = (line for line in said.splitlines() if line.startswith("warning: "))
    return [line.removeprefix("warning: ") for line in lines]


def _from_z(axis: Sequence[float]) -> list[float]:
    """Return the quaternion of the shortest turn that takes z to an axis."""
    import numpy as np

    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    if z < -1 + 1e-12:
        return [0.0, 1.0, 0.0, 0.0]
    q = np.array([1 + z, -y, x, 0.0])
    return [float(v) for v in q / np.linalg.norm(q)]
