"""Reaction wheels of a craft: limits of torque and speed, and angular momentum.

The FMU has the input ``h_wheels``, the angular momentum of the wheels relative to the body. Its
derivative is minus the torque of the wheels on the craft.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .arguments import is_number, not_positive, not_vectors, vector, wrong_parts
from .feedback import Feedback, Linear

if TYPE_CHECKING:
    import pandas as pd

Vector = NDArray[np.float64]

MOMENTUM = tuple(f"h_wheels[{i}]" for i in (1, 2, 3))  # Inputs: momentum of the wheels, N·m·s
TORQUE = tuple(f"torque[{i}]" for i in (1, 2, 3))  # Inputs: torque on the craft, N·m

# A wheel in `Feedback.wheels`: column of its torque, axis, inertia, largest torque, largest speed
# and speed at the start.
Row = tuple[int, list[float], float, float, float, float]

ALL = "wheels"  # Name for the torques of all wheels, as "torque" is the name of three components


@dataclass(frozen=True, eq=False)
class Wheel:
    """A reaction wheel of a `Craft`: its axis, its inertia and its limits.

    The torque of a wheel is the torque on the craft about the axis, so that the wheel accelerates
    in the opposite direction: inertia · d(speed)/dt = -torque. The craft also feels -ω × h of the
    wheel's angular momentum h = inertia · speed · axis.

    Parameters
    ----------
    axis : sequence of float, shape (3,)
        Direction of the axis, body axes, of any length.
    inertia : float
        Moment of inertia of the rotor about the axis, kg·m². The inertia of the craft also includes
        the wheel's inertia.
    max_torque : float
        Largest torque, N·m; a larger command is limited to this torque.
    max_speed : float
        Largest speed relative to the body, rad/s. At this speed a torque that would raise the speed
        has no effect.
    speed : float
        Speed at the start, rad/s; this speed gives the wheel's bias momentum.

    Examples
    --------
    A wheel with 4 N·m·s at its largest speed; a command of 0.5 N·m is limited to 0.2 N·m:

    >>> import numpy as np
    >>> import hubslosh
    >>> wheel = hubslosh.Wheel((0, 0, 1), inertia=0.01, max_torque=0.2, max_speed=400)
    >>> craft = hubslosh.Craft(900, [400, 380, 300], wheels={"z": wheel})
    >>> loop = craft.loop(lambda t, y: 0.5, 0.1, 0, command="z.torque")
    >>> run = loop.simulate(30, outputs=["omega[3]"])
    >>> run[["time", "z.torque", "z.speed", "omega[3]"]].iloc[[0, 100, 250]].round(5)
         time  z.torque  z.speed  omega[3]
    0     0.0       0.2      0.0   0.00000
    100  10.0       0.2   -200.0   0.00667
    250  25.0       0.0   -400.0   0.01333
    """

    axis: Sequence[float]
    inertia: float
    max_torque: float
    max_speed: float
    speed: float = 0.0

    def problems(self) -> list[str]:
        """Return everything that is wrong with the wheel.

        Returns
        -------
        list of str
            One sentence for each problem; empty if there is none.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Wheel((0, 0, 1), 0.01, 0.2, 400, speed=500).problems()
        ['speed must be from -400 to 400 rad/s (max_speed), not 500']
        """
        found = not_vectors(self, 3, "axis")
        if not found and not np.any(self.axis):
            found.append("axis must not be zero")
        found += not_positive("inertia", self.inertia, "kg·m²")
        found += not_positive("max_torque", self.max_torque, "N·m", finite=False)
        found += not_positive("max_speed", self.max_speed, "rad/s", finite=False)
        if not (is_number(self.speed) and np.isfinite(self.speed)):
            found.append(f"speed must be a finite number, rad/s, not {self.speed!r}")
        elif not found and abs(self.speed) > self.max_speed:
            found.append(
                f"speed must be from {-self.max_speed:g} to {self.max_speed:g} rad/s (max_speed), "
                f"not {self.speed:g}"
            )
        return found

    @property
    def direction(self) -> Vector:
        """Unit vector of the axis, body axes."""
        along = vector(self.axis, 3, "axis")
        found: Vector = along / np.linalg.norm(along)
        return found

    @property
    def momentum(self) -> Vector:
        """Angular momentum relative to the body at the start, body axes, N·m·s."""
        return self.inertia * self.speed * self.direction

    def describe(self) -> str:
        """Return a text with axis, limits and momentum.

        Returns
        -------
        str
            The text.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Wheel((0, 0, 1), 0.01, 0.2, 400).describe()
        'axis (0, 0, 1), up to 0.2 N·m and 4 N·m·s'
        """
        axis = ", ".join(f"{x:g}" for x in vector(self.axis, 3, "axis"))
        bias = f", {self.inertia * self.speed:.4g} N·m·s at the start" if self.speed else ""
        most = self.inertia * self.max_speed
        return f"axis ({axis}), up to {self.max_torque:g} N·m and {most:.4g} N·m·s{bias}"

    def __repr__(self) -> str:
        return f"Wheel({self.describe()})"


def wrong_wheels(wheels: Any) -> list[str]:
    """Return everything that is wrong with the argument ``wheels`` of a craft or loop."""
    example = (
        ', such as {"z": Wheel((0, 0, 1), inertia=0.01, max_torque=0.2, max_speed=400, speed=100)} '
        "(a constant angular momentum is inertia times speed)"
    )
    return wrong_parts("wheel", wheels, Wheel, example=example)


def torque_names(wheels: Mapping[str, Wheel]) -> dict[str, Wheel]:
    """Return the wheels by the names of their torques, such as ``z.torque``."""
    return {f"{name}.torque": wheel for name, wheel in wheels.items()}


def momentum(wheels: Mapping[str, Wheel]) -> Vector:
    """Return the angular momentum of wheels at the start, body axes, N·m·s."""
    return sum((wheel.momentum for wheel in wheels.values()), np.zeros(3))


def speed_name(torque: str) -> str:
    """Return the name of a wheel's speed, such as ``z.speed``, for the name of its torque."""
    return f"{torque.removesuffix('.torque')}.speed"


def rows_of(wheels: Mapping[str, Wheel], command: Sequence[str]) -> list[Row]:
    """Return the data of each wheel that a controller commands, as `Feedback.wheels` takes them.

    ``command`` has the names of all commands, and ``wheels`` the wheels by the names of their
    torques among them.
    """
    return [
        (command.index(name), of.direction.tolist(), of.inertia, of.max_torque, of.max_speed,
         of.speed)
        for name, of in wheels.items()
    ]  # fmt: skip


def follow(
    torques: Vector, wheels: Mapping[str, Wheel], start: tuple[float, float, float]
) -> Feedback:
    """Return a controller that commands given torques of wheels.

    ``torques`` has a row for each step and a column for each wheel, N·m. ``wheels`` has the wheels
    by the names of their torques. ``start`` is the momentum of all wheels at the start, N·m·s.
    """
    rows, names = len(torques), list(wheels)
    law = Linear(*np.zeros((4, 0, 0)), np.zeros((rows, 0)), np.ascontiguousarray(torques))
    law.C, law.D = np.zeros((len(names), 0)), np.zeros((len(names), 0))
    return Feedback(
        law, [], names, cycles=rows, parts=1, switch=0, latency=0,
        wheels=rows_of(wheels, names), momentum=start,
    )  # fmt: skip


def columns_of(wheels: Mapping[str, Wheel], feedback: Feedback) -> dict[str, Vector]:
    """Return histories of the torque of each wheel after each row (N·m) and its speed (rad/s)."""
    torque = feedback.commands
    torque[-1] = torque[-2]
    found = {name: torque[:, feedback.command.index(name)] for name in wheels}
    return found | dict(zip(map(speed_name, wheels), feedback.speeds.T, strict=True))


def saturated(wheels: Mapping[str, Wheel], feedback: Feedback, time: Vector) -> list[str]:
    """Return a warning for each wheel that is at its largest speed in the last rows of a run.

    ``wheels`` has the wheels by the names of their torques, in the order of ``feedback``; ``time``
    is the time of each row, s.
    """
    found = []
    for (name, wheel), speed in zip(wheels.items(), feedback.speeds.T, strict=True):
        below = np.flatnonzero(np.abs(speed) < wheel.max_speed)
        first = int(below[-1]) + 1 if len(below) else 0
        if first < len(time) - 1:
            found.append(
                f"wheel {name.removesuffix('.torque')} stays at its largest speed, "
                f"{wheel.max_speed:g} rad/s, from {time[first]:.4g} s to the end of the run at "
                f"{time[-1]:.4g} s, and gives no torque in one direction. Give it a larger inertia "
                "or max_speed, start it at a speed that leaves more room, or unload it with "
                "thrusters, whose torque is a command or an input"
            )
    return found


def units_of(wheels: Mapping[str, Wheel]) -> dict[str, str]:
    """Return the units of torques and speeds of wheels, which are named by their torques."""
    return dict.fromkeys(wheels, "N.m") | {speed_name(name): "rad/s" for name in wheels}


def torques_of(
    inputs: "pd.DataFrame", wheels: Mapping[str, Wheel], problems: list[str]
) -> dict[str, Wheel]:
    """Return the wheels whose torques are columns of ``inputs``, by the names of the torques.

    An error message about these columns is appended to ``problems``.
    """
    found = {name: of for name, of in torque_names(wheels).items() if name in inputs}
    problems += [
        f"inputs has {name}, which the reaction wheels set: leave out either {name} or the torques "
        "of the wheels"
        for name in MOMENTUM
        if found and name in inputs
    ]
    units = dict(inputs.attrs.get("units", {}))
    problems += [
        f"the unit of {name} in inputs must be N.m, not {units[name]}"
        for name in found
        if units.get(name, "N.m") != "N.m"
    ]
    return found
