"""Reaction wheels of a craft: limits of torque and speed, and the momentum that turns the craft.

A wheel turns the craft through the FMU's input ``h_wheels``, the angular momentum of the wheels
relative to the body. Its derivative is minus the wheels' torque on the craft.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .arguments import column_of, vector
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

Vector = NDArray[np.float64]

MOMENTUM = tuple(f"h_wheels[{i}]" for i in (1, 2, 3))  # Input of the FMU, N·m·s
TORQUE = tuple(f"torque[{i}]" for i in (1, 2, 3))  # Input of the FMU, N·m

ALL = "wheels"  # Name of the torques of all wheels, as "torque" is that of three components


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
        Moment of inertia of the rotor about the axis, kg·m². It also belongs to the inertia of the
        craft.
    max_torque : float
        Largest torque, N·m; a larger command is limited to it.
    max_speed : float
        Largest speed relative to the body, rad/s. At this speed a torque that would raise it has no
        effect.
    speed : float
        Speed at the start, rad/s; it gives the wheel's bias momentum.

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
            Sentences; none if all is right.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Wheel((0, 0, 1), 0.01, 0.2, 400, speed=500).problems()
        ['speed must be from -400 to 400 rad/s (max_speed), not 500']
        """
        found = []
        try:
            if not vector(self.axis, 3, "axis").any():
                found.append("axis must not be zero")
        except FmuError as error:
            found.append(str(error))
        units = {"inertia": "kg·m²", "max_torque": "N·m", "max_speed": "rad/s"}
        for name, unit in units.items():
            value = getattr(self, name)
            endless = name == "inertia" and value == np.inf
            if not (_is_number(value) and value > 0) or endless:
                found.append(f"{name} must be a number above 0, {unit}, not {value!r}")
        if not (_is_number(self.speed) and np.isfinite(self.speed)):
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
        """Return axis, limits and momentum in a few words.

        Returns
        -------
        str
            The words.

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
        """Return the wheel in a line."""
        return f"Wheel({self.describe()})"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def wrong_wheels(wheels: Any) -> list[str]:
    """Return everything that is wrong with the argument ``wheels`` of a craft or loop."""
    if not isinstance(wheels, Mapping):
        return [
            'wheels must be Wheel by name, such as {"z": Wheel((0, 0, 1), inertia=0.01, '
            f"max_torque=0.2, max_speed=400, speed=100)}}, not {wheels!r}; a constant angular "
            "momentum is inertia times speed"
        ]
    found = []
    for name, wheel in wheels.items():
        if not isinstance(name, str) or not name:
            found.append(f"the name of a wheel must be a text, not {name!r}")
        elif not isinstance(wheel, Wheel):
            found.append(f"wheel {name} must be a Wheel, not {wheel!r}")
        else:
            found += [f"wheel {name}: {problem}" for problem in wheel.problems()]
    return found


def torque_names(wheels: Mapping[str, Wheel]) -> dict[str, Wheel]:
    """Return the wheels by the names of their torques, such as ``z.torque``."""
    return {f"{name}.torque": wheel for name, wheel in wheels.items()}


def momentum(wheels: Mapping[str, Wheel]) -> Vector:
    """Return the angular momentum of wheels at the start, body axes, N·m·s."""
    return sum((wheel.momentum for wheel in wheels.values()), np.zeros(3))


def speed_name(torque: str) -> str:
    """Return the name of a wheel's speed, such as ``z.speed``, for the name of its torque."""
    return f"{torque.removesuffix('.torque')}.speed"


@dataclass(frozen=True)
class Histories:
    """Torques and speeds of wheels over time, and the inputs that make the FMU turn."""

    inputs: "pd.DataFrame"
    """The table of inputs with straight lines between its rows, two rows at each jump."""
    time: Vector
    """Start of each interval with constant torques, and the end of the last one, s."""
    torque: dict[str, Vector]
    """Torque on the craft in each interval by name, N·m."""
    speed: dict[str, Vector]
    """Speed at each time by name, rad/s."""

    def columns(self, time: Vector) -> dict[str, Vector]:
        """Return the torque that acts from each time on and the speed of each wheel, by name."""
        place = np.searchsorted(self.time, time, side="right") - 1
        place = np.clip(place, 0, len(self.time) - 2)
        found = {name: values[place] for name, values in self.torque.items()}
        for name, values in self.speed.items():
            found[name] = np.interp(time, self.time, values)
        return found


def histories(
    inputs: "pd.DataFrame", wheels: Mapping[str, Wheel], start: Vector, *, hold: bool
) -> Histories:
    """Return torques and speeds of wheels that ``inputs`` command, for example by ``z.torque``.

    Their torques are held from row to row, within the wheels' limits. ``start`` is the momentum of
    all wheels at the start, N·m·s. ``hold``: the other inputs are held, too.
    """
    import pandas as pd

    named = {name: of for name, of in torque_names(wheels).items() if name in inputs}
    problems = [
        f"inputs has {name}, which the wheels set: leave it out, or the torques of the wheels"
        for name in MOMENTUM
        if name in inputs
    ]
    units = dict(inputs.attrs.get("units", {}))
    problems += [
        f"the unit of {name} in inputs must be N.m, not {units[name]}"
        for name in named
        if units.get(name, "N.m") != "N.m"
    ]
    given = {str(name): column_of(inputs, name, "inputs", problems) for name in inputs.columns}
    time = given.get("time")
    if "time" not in given:
        problems.append("inputs has no column time")
    elif time is not None and (len(time) < 2 or (np.diff(time) < 0).any()):
        problems.append("time in inputs must be two finite numbers or more that grow")
    if problems:
        raise FmuError("; ".join(problems))
    assert time is not None
    commanded = {name: values for name in named if (values := given[name]) is not None}
    rows = np.flatnonzero(np.diff(time) > 0)  # the intervals, between rows that are no jump
    # an interval ends early where a wheel reaches its largest speed
    edges, torques = [], []
    speeds = {name: [float(wheel.speed)] for name, wheel in named.items()}
    intervals = []  # row of the table, start and end of each part with constant torques
    for row in rows:
        begin, end = float(time[row]), float(time[row + 1])
        asked = {
            name: float(np.clip(commanded[name][row], -wheel.max_torque, wheel.max_torque))
            for name, wheel in named.items()
        }
        while begin < end:
            acting, full = {}, {}  # torques, and times at which wheels reach their largest speed
            for name, wheel in named.items():
                rate = -asked[name] / wheel.inertia
                left = np.copysign(wheel.max_speed, rate) - speeds[name][-1]
                acting[name] = asked[name] if left * rate > 0 else 0.0
                if acting[name]:
                    full[name] = max(begin + left / rate, np.nextafter(begin, np.inf))
            stop = min([end, *full.values()])
            edges.append(begin)
            torques.append(acting)
            intervals.append((row, begin, stop))
            for name, wheel in named.items():
                speed = speeds[name][-1] - acting[name] * (stop - begin) / wheel.inertia
                if full.get(name, np.inf) <= stop:
                    speed = float(np.copysign(wheel.max_speed, -acting[name]))
                speeds[name].append(speed)
            begin = stop
    edges.append(float(time[-1]))
    at = np.array(edges)
    torque = {name: np.array([one[name] for one in torques]) for name in named}
    speed = {name: np.array(values) for name, values in speeds.items()}
    h = np.tile(start, (len(at), 1))
    for name, wheel in named.items():
        h += np.outer(wheel.inertia * (speed[name] - wheel.speed), wheel.direction)
    first = np.array([row for row, _, _ in intervals])
    begins, ends = (np.array([part[i] for part in intervals]) for i in (1, 2))
    table = {"time": np.column_stack([begins, ends]).ravel()}
    for name, values in given.items():
        if name == "time" or name in named:
            continue
        assert values is not None
        slope = (values[first + 1] - values[first]) / (time[first + 1] - time[first])
        slope = 0.0 * slope if hold else slope
        pair = [values[first] + slope * (t - time[first]) for t in (begins, ends)]
        table[name] = np.column_stack(pair).ravel()
    for i, name in enumerate(MOMENTUM):
        table[name] = np.column_stack([h[:-1, i], h[1:, i]]).ravel()
    frame = pd.DataFrame(table)
    frame.attrs["units"] = {name: unit for name, unit in units.items() if name in table}
    named_speed = {speed_name(name): values for name, values in speed.items()}
    return Histories(frame, at, torque, named_speed)
