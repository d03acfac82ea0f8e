"""Slosh modes of a tank from its drawing and a fill, by linear potential flow."""

import json
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import native
from .arguments import check_numbers, is_number, percent_of, vector
from .fmu import FmuError, FmuWarning
from .temporary import write_file

if TYPE_CHECKING:
    import pandas as pd

    from .fmu import Value

# FMUs with six degrees of freedom. Names of tank parameters differ only in their prefix.
SIX_AXES = ("Spacecraft", "SloshTank")


@dataclass(frozen=True, eq=False)
class Tank:
    """A tank at one fill with its slosh modes, as `tank` returns it.

    ``print`` shows the liquid and the first modes; a notebook shows the picture.

    Attributes
    ----------
    all : dict
        Content of the file that ``hubslosh tank --out`` writes: ``m_liq`` (kg), ``z_cg`` (m),
        ``I_eff_cg`` (kg·m²), ….
    gravity : float
        Specific force along the tank's axis, m/s².

    Examples
    --------
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> found = hubslosh.tank(sphere, "50%", gravity=0.5)
    >>> round(found.mass, 1), round(found.all["z_cg"], 3)
    (135.4, 0.25)
    """

    all: dict[str, Any]
    gravity: float
    _solved: Any = field(repr=False)
    _case: "TankCase" = field(repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return _solve_case, (self._case,)

    @cached_property
    def picture(self) -> str:
        """Drawing of the tank, its free surface and its mode shapes, as the text of an SVG file."""
        return str(self._solved.picture())

    @property
    def mass(self) -> float:
        """Mass of the liquid, kg."""
        return float(self.all["m_liq"])

    @cached_property
    def modes(self) -> "pd.DataFrame":
        """Slosh modes as pendulums, one in each row.

        Columns: ``frequency`` (Hz), slosh ``mass`` (kg), ``length`` of the pendulum (m), heights
        ``bob`` of the slosh mass and ``hinge`` of the hinge above the origin of the drawing (m),
        and ``wave``, the wave height at the wall per pendulum angle (m/rad). If the viscosity is
        known, also the damping ratio ``zeta`` and its interval from ``zeta_low`` to ``zeta_high``.
        """
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
        from .short import rows

        what = f"{self.all['name']}: " if self.all.get("name") else ""
        full = f"Tank, {what}{self.mass:.6g} kg of liquid at a fill of {self.all['fill']:.4g} m"
        return f"{full}, {self.gravity:.4g} m/s² along the axis\n{rows(self.modes)}"

    def _repr_svg_(self) -> str:
        return self.picture

    def save(self, path: str | Path) -> None:
        """Write the picture of the tank to a file.

        Parameters
        ----------
        path : str or Path
            File to write, .svg.

        Raises
        ------
        FmuError
            If the name does not end in .svg, or the file cannot be written.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> hubslosh.tank(sphere, "50%").save("sphere.svg")
        """
        write_file(path, ".svg", lambda: self.picture)

    def parameters(
        self,
        model: str = "Spacecraft",
        number: int = 1,
        *,
        position: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
        rigid: bool = False,
    ) -> "dict[str, Value]":
        """Return the parameters of an FMU for this tank, for example for `simulate`.

        Damping ratios and centring stiffnesses are included if `tank` was given viscosity and
        surface tension. Warns with FmuWarning if a formula is used outside its range.

        Parameters
        ----------
        model : str
            "Spacecraft", "SloshTank", or "HubSlosh", which has a table of modes.
        number : int
            Number of the tank on Spacecraft, 1 to 4.
        position : sequence of float, shape (3,), optional
            Position of the origin of the tank's drawing, body axes, m; for a tank given by
            ``shape`` this is its lowest point. Not for HubSlosh.
        axis : sequence of float, shape (3,), optional
            Upward direction of the tank's axis in body axes, of any length; by default z. Not
            for HubSlosh.
        rigid : bool
            Return the whole liquid as a rigid body without slosh, at its centre of mass, with the
            inertia of liquid under a rigid lid. Not for HubSlosh.

        Returns
        -------
        dict
            Values in SI units by the names of the FMU's parameters.

        Raises
        ------
        FmuError
            If an argument is not allowed.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> values = hubslosh.tank(sphere, "50%").parameters(number=2, position=(0, 0, 0.2))
        >>> values["tank[2].position[3]"], values["tank[2].modes"]
        (0.2, 3)
        """
        if model not in (*SIX_AXES, "HubSlosh"):
            raise FmuError(f"model must be Spacecraft, SloshTank or HubSlosh, not {model!r}")
        if model == "HubSlosh":
            for name, value in {"position": position, "axis": axis}.items():
                if value is not None:
                    raise FmuError(f"{name} is for {' and '.join(SIX_AXES)}, not for {model}")
            if rigid:
                raise FmuError("rigid= is not for HubSlosh: set slosh.model = frozen instead")
            return self._parameters(model)
        place = None if position is None else vector(position, 3, "position")
        prefix = prefix_of(model, number)
        is_known = model == "Spacecraft" and (rigid or self.all["modes"])
        of = self._spacecraft_parameters if is_known else self._parameters(model)
        found = {re.sub(r"^tank(\[1\])?", prefix, name): value for name, value in of.items()}
        if rigid:
            whole = ("m_0", "H_0", "I_0", "dI_y", "I_z", "g_ref", "modes")
            kept = {f"{prefix}.{name}" for name in whole}
            found = {name: value for name, value in found.items() if name in kept}
            found |= {f"{prefix}.m_0": self.mass, f"{prefix}.H_0": float(self.all["z_cg"])}
            # inertia of a box with different lengths about x; I_eff_cg is its inertia about y
            about_x = float(self.all["I_eff_cg"]) - float(found.get(f"{prefix}.dI_y", 0.0))
            found |= {f"{prefix}.I_0": about_x, f"{prefix}.modes": 0}
        if place is not None:
            found |= {f"{prefix}.position[{i + 1}]": float(x) for i, x in enumerate(place)}
        if axis is not None:
            found |= {f"{prefix}.q[{i + 1}]": x for i, x in enumerate(_from_z(axis))}
        return found

    @cached_property
    def _spacecraft_parameters(self) -> "dict[str, Value]":
        if not self.all["modes"]:  # a full tank has only the parameters of rigid liquid
            return {"tank[1].I_z": 0.0}
        return self._parameters("Spacecraft")

    def _prepare(self) -> list[str]:
        """Compute Spacecraft's parameters for this tank, and return the warnings."""
        if not self.all["modes"]:
            return list(self._solved.warnings())
        found, warned = self._solved.parameters("Spacecraft")
        self.__dict__["_spacecraft_parameters"] = found
        return list(warned)

    def _parameters(self, model: str) -> "dict[str, Value]":
        found, warned = self._solved.parameters(model)
        for warning in warned:
            warnings.warn(warning, FmuWarning, stacklevel=4)
        return dict(found)


def prefix_of(model: str, number: int) -> str:
    """Return the prefix of the names of a tank's parameters in Spacecraft or SloshTank."""
    if model == "SloshTank":
        return "tank"
    if number not in (1, 2, 3, 4):
        raise FmuError(f"number must be 1 to 4, the number of a tank, not {number!r}")
    return f"tank[{number}]"


@dataclass(frozen=True, eq=False)
class TankCase:
    """Input of the computation of a tank: drawing, fill and properties of the liquid."""

    source: "dict[str, Any] | Path"
    """Tank file, or a dict with the content of a tank file."""
    fill: Any
    """Height, m; share of the volume, ``"60%"``; or mass, (120, "kg")."""
    modes: int
    gravity: float
    """Specific force along the tank's axis, m/s²."""
    nu: float | None
    sigma: float | None
    contact_angle: float | None
    spin: float | None = None
    """Spin rate about the tank's axis, rad/s."""
    large_waves: bool = False


def read_drawing(source: "dict[str, Any] | Path") -> Any:
    """Read a tank file, or a dictionary with the content of a tank file."""
    if isinstance(source, Path):
        return native.Tank.read(source)
    return native.Tank.parse(toml_of(source))


def toml_of(source: Mapping[str, Any]) -> str:
    """Return the text of a TOML file with the content of ``source``, such as a tank file."""
    return "".join(f"{toml_key(key)} = {_toml(value)}\n" for key, value in source.items())


def solve(
    cases: Sequence[TankCase], drawings: Sequence[Any] | None = None
) -> "list[Tank | FmuError]":
    """Compute the modes of several tanks on all cores.

    Return for each tank its result or its error. ``drawings`` are the results of `read_drawing` for
    the cases, if these are known already.
    """
    drawings = drawings or [read_drawing(case.source) for case in cases]
    found = native.solve(
        [
            (tank, case.fill, case.modes, _liquid(case), case.large_waves)
            for case, tank in zip(cases, drawings, strict=True)
        ]
    )
    return [
        one if isinstance(one, FmuError) else Tank(one.result(), float(case.gravity), one, case)
        for case, one in zip(cases, found, strict=True)
    ]


def _liquid(case: TankCase) -> Any:
    return native.Liquid(case.gravity, case.nu, case.sigma, case.contact_angle, case.spin)


def _solve_case(case: TankCase) -> Tank:
    (found,) = solve([case])
    if isinstance(found, FmuError):
        raise found
    return found


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
    spin: float | None = None,
    large_waves: bool = False,
) -> Tank:
    """Compute the slosh modes of a tank that is a body of revolution or a box.

    The method is linear potential flow in the contour of the tank. For tanks of other shapes use
    `liquid_modes`.

    Parameters
    ----------
    source : str, Path or mapping
        A tank file (.toml), or a dict with its content, such as
        ``{"density": 1010, "shape": {"sphere": {"radius": 0.4}}}``. The book's page on tanks
        describes all shapes.
    fill : float or str, optional
        Height of the surface above the lowest point, m, or ``"60%"`` of the volume.
    fill_mass : float, optional
        Mass of the liquid, kg, instead of ``fill``.
    modes : int
        Number of modes.
    gravity : float
        Specific force along the tank's axis, m/s², for frequencies and damping.
    nu : float, optional
        Kinematic viscosity, m²/s, for damping ratios.
    sigma : float, optional
        Surface tension, N/m, for the centring stiffnesses in `Tank.parameters`.
    contact_angle : float, optional
        Contact angle of the liquid at the wall, deg.
    spin : float, optional
        Rate at which tank and liquid turn about the tank's axis, rad/s. `Tank.parameters` for
        SloshTank and Spacecraft then include the spin of the liquid.
    large_waves : bool
        True: compute the coefficients that give the pendulum of mode 1 the energy of large waves,
        from fully nonlinear potential flow, in about 10 s. False: these coefficients are available
        only for spheres and upright cylinders, from tables that cover a range of fills.

    Returns
    -------
    Tank
        Mass, modes and picture of the liquid.

    Raises
    ------
    FmuError
        If the drawing, the fill or a number is not allowed.

    Examples
    --------
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> hubslosh.tank(sphere, "50%", gravity=0.5, nu=0.9e-6).modes["frequency"].round(3).tolist()
    [0.222, 0.409, 0.519]
    """
    if (fill is None) == (fill_mass is None):
        raise FmuError('give the fill: a height in m, "60%" of the volume, or fill_mass in kg')
    if fill is not None:
        check_fill(fill)
    check_numbers(
        fill_mass=fill_mass, modes=modes, gravity=gravity, nu=nu, sigma=sigma,
        contact_angle=contact_angle, spin=spin,
    )  # fmt: skip
    if modes < 1 or modes != int(modes):
        raise FmuError(f"modes must be a whole number of 1 or more, not {modes!r}")
    amount = (float(fill_mass), "kg") if fill_mass is not None else fill
    case = TankCase(
        _tank_source(source), amount, int(modes), gravity, nu, sigma, contact_angle, spin,
        large_waves,
    )  # fmt: skip
    found = _solve_case(case)
    for warning in found._solved.warnings():
        warnings.warn(warning, FmuWarning, stacklevel=2)
    return found


def fill_table(
    case: TankCase, between: Sequence[float | str]
) -> "tuple[dict[str, Value], list[str]]":
    """Return the parameters of a draining tank 1 of Spacecraft, and warnings.

    ``between`` has the lowest and the highest fill of the table of modal parameters. Up to 12 fills
    are placed between the two given fills, which takes about 5 s of CPU time.
    """
    ends = tuple(between)
    if len(ends) != 2:
        raise FmuError(f"between must be the lowest and the highest fill, not {between!r}")
    found: tuple[dict[str, Value], list[str]] = native.table(
        read_drawing(case.source), ends, case.modes, _liquid(case)
    )
    return found


def _tank_source(source: Any) -> "dict[str, Any] | Path":
    """Return the path of a tank file, or a dictionary with the content of a tank file."""
    if isinstance(source, Mapping):
        given = dict(source)
        for key in ("points", "svg"):  # paths that are relative to the tank file
            if isinstance(given.get(key), str):
                given[key] = str(Path(given[key]).absolute())
        return given
    if isinstance(source, str | Path):
        return Path(source)
    raise FmuError(
        f"a tank must be a tank file, or a dict with the content of a tank file, not {source!r}"
    )


def check_fill(fill: Any) -> Any:
    """Return a fill; raise FmuError if it is neither a height, a percentage nor a mass."""
    amount = amount_of(fill)
    if not is_number(amount) or np.isnan(amount):
        raise FmuError(f'fill must be a height in m, or a share such as "60%", not {fill!r}')
    return fill


def amount_of(fill: Any) -> Any:
    """Return the number in a fill: its height in m, percentage (60 for "60%") or mass in kg."""
    if isinstance(fill, str):
        return percent_of(fill)
    return fill[0] if is_mass(fill) else fill


def is_mass(fill: Any) -> bool:
    """Return True if a fill is a mass, such as (120, "kg")."""
    return isinstance(fill, tuple) and len(fill) == 2 and fill[1] == "kg"


def toml_key(key: Any) -> str:
    """Return a key in the notation of TOML, with quotes if necessary."""
    return str(key) if re.fullmatch(r"[A-Za-z0-9_-]+", str(key)) else json.dumps(str(key))


def _toml(value: Any) -> str:
    """Return a value in the notation of TOML."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{toml_key(k)} = {_toml(v)}" for k, v in value.items())
        return f"{{ {inner} }}"
    if isinstance(value, str | os.PathLike):
        return json.dumps(str(value), ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if hasattr(value, "tolist"):  # an array or a number of NumPy
        return _toml(value.tolist())
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Sequence):
        return f"[{', '.join(_toml(v) for v in value)}]"
    raise FmuError(f"{value!r} cannot be written to TOML (allowed: numbers, strings, lists)")


def _from_z(axis: Sequence[float]) -> list[float]:
    """Return the quaternion of the shortest rotation from the z axis to ``axis``."""
    given = vector(axis, 3, "axis")
    if not given.any():
        raise FmuError("axis must not be zero")
    x, y, z = given / np.linalg.norm(given)
    if z < -1 + 1e-12:
        return [0.0, 1.0, 0.0, 0.0]
    q = np.array([1 + z, -y, x, 0.0])
    return [float(v) for v in q / np.linalg.norm(q)]
