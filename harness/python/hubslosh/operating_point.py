"""The trimmed operating point of Spacecraft, at which the thrust acts through the centre of mass.

Otherwise the craft would turn faster and faster, and a linear model would be valid only at the
start. Appendages have the deflection that the steady thrust causes, so that they do not vibrate.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arguments import caller
from .fmu import Fmu, FmuWarning, Parameters, Quantity
from .plant import Plant, read_vector
from .quantities import ModeQuantity, Modes, force_in_tank

Vector = NDArray[np.float64]

# Largest angular acceleration that counts as 0, rad/s². It turns the craft by 0.03° in 100 s;
# rounding errors are about 1e-17 rad/s².
LEFT = 1e-7


@dataclass(frozen=True, eq=False, repr=False)
class OperatingPoint:
    """Operating point of Spacecraft with thrust through the centre of mass.

    Attributes
    ----------
    model : str or Path
        Name or file of the FMU.
    parameters : dict
        Parameters of the FMU at this point.
    shift : ndarray, shape (3,)
        Displacement of the origin O, where the thrust acts, at right angles to the thrust, body
        axes, m. It brings the line of thrust through the centre of mass.
    untrimmed : dict or None
        Parameters before trimming; None if the thrust is 0.
    tanks : tuple of str
        Names of the tanks in the FMU's order.

    Examples
    --------
    >>> import hubslosh
    >>> craft = hubslosh.Craft(900, [400, 380, 300], center_of_mass=(0.1, 0, 0), thrust=50)
    >>> print(craft.trim("0%"))
    O, where the thrust acts, moves by (0.1, 0, 0) m to the centre of mass
    angular acceleration: 0.01316 rad/s² before, 0 rad/s² left
    """

    model: str | Path
    parameters: dict[str, Quantity]
    shift: Vector
    untrimmed: dict[str, Quantity] | None
    tanks: tuple[str, ...]

    @cached_property
    def _remaining(self) -> tuple[Vector, dict[str, float]]:
        modes = Modes(self.model, self.parameters)
        with Plant(self.model, self.parameters) as plant:
            spins, across = read_vector(plant, "omega").any(), {}
            for number, name in enumerate(self.tanks, 1):
                sloshes = plant.get([f"tank[{number}].modes"])[0]
                bob = ModeQuantity(number, "bob", 1)
                height = modes.value(bob) if spins and sloshes else 0.0
                axis, here = force_in_tank(plant, number, height)
                across[name] = float(np.linalg.norm(here - axis * (axis @ here)))
            return read_vector(plant, "omega_dot"), across

    @cached_property
    def untrimmed_acceleration(self) -> Vector:
        """Angular acceleration before trimming, body axes, rad/s².

        Appendages have the deflection that this acceleration causes, so that they do not vibrate.
        """
        if self.untrimmed is None:
            return np.zeros(3)
        return _steady_acceleration(self.model, self.untrimmed)

    @property
    def angular_acceleration(self) -> Vector:
        """Angular acceleration after trimming, body axes, rad/s²."""
        return self._remaining[0]

    @property
    def lateral_acceleration(self) -> dict[str, float]:
        """Specific force across each tank's axis after trimming, m/s², by the tank's name.

        If it is not 0, the liquid is not at rest at this point. It is evaluated at the tank's
        origin or, if the craft spins, at the slosh mass of the tank's first mode.
        """
        return self._remaining[1]

    def __repr__(self) -> str:
        return f"OperatingPoint({np.linalg.norm(self.angular_acceleration):.2g} rad/s² left)"

    def __str__(self) -> str:
        lines = [
            f"O, where the thrust acts, moves by {_row(self.shift)} m to the centre of mass",
            f"angular acceleration: {np.linalg.norm(self.untrimmed_acceleration):.4g} rad/s² "
            f"before, {np.linalg.norm(self.angular_acceleration):.2g} rad/s² left",
        ]
        if self.lateral_acceleration:
            rest = ", ".join(
                f"{name} {value:.2g} m/s²" for name, value in self.lateral_acceleration.items()
            )
            lines.append(f"left across the axis of each tank: {rest}")
        return "\n".join(lines)


def _row(values: Vector) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in values)})"


def trim(model: str | Path, parameters: Parameters, tanks: Sequence[str] = ()) -> OperatingPoint:
    """Return the operating point of Spacecraft whose thrust acts through the centre of mass.

    The origin O, and with it the thrust, is moved across the direction of the thrust. Appendages
    get the displacements ``eta_0`` at which they rest under the thrust. A craft without thrust, or
    on a pivot, is returned unchanged.
    """
    every, before, none = dict(parameters), dict(parameters), np.zeros(3)
    fmu = Fmu.open(model)
    forces = [every.get(f"force[{i}]", 0.0) for i in (1, 2, 3)]
    if not is_spacecraft(fmu) or not any(forces):
        return OperatingPoint(model, every, none, None, tuple(tanks))
    with Plant(model, every) as plant:
        force, center = read_vector(plant, "force"), read_vector(plant, "center_of_mass")
        kind, mount, count = plant.get(["mount_kind", "mount", "tanks"])
        if (kind or mount) != 1 or not force.any():
            return OperatingPoint(model, every, none, before, tuple(tanks))
        flexible = _flexible(plant)
        deflections = _deflections(plant, flexible, force / plant.get(["mass"])[0])
        if any(deflections.values()):
            every |= deflections
            with Plant(model, every) as deformed:
                center = read_vector(deformed, "center_of_mass")
        shift = center - force * (force @ center) / (force @ force)
        places = ["craft.r", *(f"tank[{number}].position" for number in range(1, int(count) + 1))]
        places += [f"{name}position" for name in flexible]
        for place in places:
            moved = read_vector(plant, place) - shift
            every |= {f"{place}[{i + 1}]": float(x) for i, x in enumerate(moved)}
    return OperatingPoint(model, every, shift, before, tuple(tanks))


def _flexible(plant: Plant) -> list[str]:
    """Return the prefixes, such as "appendage[1].", of appendage modes that the craft can excite.

    The craft's motion does not excite a mode whose participation factors are all 0.
    """
    names = [f"appendage[{j}]." for j in range(1, int(plant.get(["appendages"])[0]) + 1)]
    return [name for name in names if _participation(plant, name).any()]


def _steady_acceleration(model: str | Path, parameters: Parameters) -> Vector:
    """Return the angular acceleration of the craft, rad/s², with appendages that do not vibrate.

    At ``parameters`` of the FMU ``model``, appendages are deflected as far as the steady force
    requires.
    """
    with Plant(model, parameters) as plant:
        names = _flexible(plant)

    def accelerations(deflections: Vector) -> tuple[Vector, Vector]:
        """Return the accelerations of appendage modes and the craft's angular acceleration.

        The modes are at rest, with the modal displacements ``deflections``.
        """
        start = dict(zip((f"{name}eta_0" for name in names), deflections.tolist(), strict=True))
        start |= dict.fromkeys((f"{name}eta_dot_0" for name in names), 0.0)
        with Plant(model, {**parameters, **start}) as plant:
            modal = plant.get([f"der({name}eta_dot)" for name in names])
            return np.array(modal), read_vector(plant, "omega_dot")

    eta = np.zeros(len(names))
    rest, turning = accelerations(eta)
    if names:
        columns = [accelerations(row)[0] - rest for row in np.eye(len(names))]
        slope = np.array(columns).T
        for _ in range(4):  # converges fast, because accelerations are almost linear in eta
            eta = eta - np.linalg.solve(slope, rest)
            rest, turning = accelerations(eta)
    return turning


def _participation(plant: Plant, name: str) -> Vector:
    """Return the six participation factors of the appendage mode with the prefix ``name``."""
    return read_vector(plant, f"{name}participation", 6)


def _deflections(plant: Plant, names: Sequence[str], force: Vector) -> dict[str, Quantity]:
    """Return the start values at which appendages are at rest under ``force``, m/s² (3).

    ``names`` are the prefixes of the appendage modes, and ``force`` is the steady specific force.
    """
    found: dict[str, Quantity] = {}
    for name in names:
        along = _participation(plant, name)[:3]
        omega = 2 * np.pi * plant.get([f"{name}frequency"])[0]
        found |= {f"{name}eta_0": float(-(along @ force) / omega**2), f"{name}eta_dot_0": 0.0}
    return found


def is_spacecraft(fmu: Fmu) -> bool:
    """Return True if an FMU is Spacecraft, with any number of tanks and modes."""
    return "craft.r[1]" in fmu.variables


def warn_of_rotation(what: str, turning: Any) -> None:
    """Warn if ``turning``, the angular acceleration at the linearisation point, is not 0.

    ``what`` names the point in the warning.
    """
    if text := rotation(what, turning):
        warnings.warn(text, FmuWarning, stacklevel=caller())


def warn_of_attitude(what: str, names: Sequence[str], omega: Any) -> None:
    """Warn if ``names`` of outputs include the attitude q of a craft that spins at ``omega``.

    This attitude is never steady, so that a linear model of it is valid only at the start.
    ``what`` names the linearisation point in the warning.
    """
    if np.any(omega) and any(name.startswith("q[") for name in names):
        warnings.warn(
            f"{what} is no steady state of q: the attitude of a craft that spins at "
            f"{_row(np.asarray(omega, float))} rad/s changes by itself, so that linear models and "
            "margins with q are valid only at the start. Measure omega instead",
            FmuWarning, stacklevel=caller(),
        )  # fmt: skip


def rotation(what: str, turning: Any) -> str:
    """Return a warning if the angular acceleration ``turning`` is not 0, else an empty string.

    ``what`` names the point in the warning.
    """
    size = float(np.linalg.norm(turning))
    if size <= LEFT:
        return ""
    return (
        f"{what} is no steady state: an angular acceleration of {size:.4g} rad/s² remains, "
        f"{_row(np.asarray(turning, float))} about the body axes, so that linear models and "
        "margins are valid only at the start. Possible causes are a thrust that misses the centre "
        "of mass (Craft.trim corrects it), a constant torque, and liquid that is not at rest, as "
        "in a tank whose axis is not parallel to the thrust"
    )
