"""Engines of a craft: their resultant force, and time histories of engines that fire in pulses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .arguments import floats, not_positive, not_vectors, refuse, vector
from .fmu import FmuError, did_you_mean

Vector = NDArray[np.float64]

MOST_PULSES = 1_000_000  # Largest number of pulses of one engine in a time history


@dataclass(frozen=True, eq=False)
class Engine:
    """An engine of a `Craft`: its position, its direction and its thrust.

    Parameters
    ----------
    position : sequence of float, shape (3,)
        Point where the thrust acts, from the craft's origin O, body axes, m.
    direction : sequence of float, shape (3,)
        Direction of the force on the craft, body axes, of any length.
    thrust : float
        Thrust, N.
    burns : bool
        The engine burns at the operating point, as a main engine does. False is for thrusters of
        attitude control, which fire in pulses, see `Craft.pulses`.

    Examples
    --------
    >>> import hubslosh
    >>> main = hubslosh.Engine((0, 0, -1.2), (0, 0, 1), 400)
    >>> craft = hubslosh.Craft(900, [400, 380, 300], engines={"main": main})
    >>> craft.parameters(0)["force[3]"]
    400.0
    """

    position: Sequence[float]
    direction: Sequence[float]
    thrust: float
    burns: bool = True

    def problems(self) -> list[str]:
        """Return everything that is wrong with the engine.

        Returns
        -------
        list of str
            One sentence for each problem; empty if there is none.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Engine((0, 0, 0), (0, 0, 1), -5).problems()
        ['thrust must be a number above 0, N, not -5']
        """
        found = not_vectors(self, 3, "position", "direction")
        if not found and not np.any(self.direction):
            found.append("direction must not be zero")
        found += not_positive("thrust", self.thrust, "N")
        if not isinstance(self.burns, bool):
            found.append(f"burns must be True or False, not {self.burns!r}")
        return found

    def wrench(self, origin: Vector) -> Vector:
        """Return force (N) and torque (N·m) about a point of the craft, body axes.

        Parameters
        ----------
        origin : ndarray, shape (3,)
            The point from the craft's origin O, body axes, m.

        Returns
        -------
        ndarray, shape (6,)
            Force, then torque.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> hubslosh.Engine((1, 0, 0), (0, 0, 1), 22).wrench(np.zeros(3)).tolist()
        [0.0, 0.0, 22.0, 0.0, -22.0, 0.0]
        """
        along = vector(self.direction, 3, "direction")
        force = self.thrust * along / np.linalg.norm(along)
        return np.concatenate([force, np.cross(vector(self.position, 3, "") - origin, force)])


def resultant(force: Vector, engines: Mapping[str, Engine]) -> tuple[Vector, Vector, Vector]:
    """Return the force of all engines, a point on its line of action, and the remaining torque.

    ``force`` (N) acts at the craft's origin O, in addition to the engines. The point is measured
    from O, m. The remaining torque (N·m) is the part about the line of action, which no choice of
    the point can remove.
    """
    total = np.concatenate([force, np.zeros(3)])
    for engine in engines.values():
        if engine.burns:
            total = total + engine.wrench(np.zeros(3))
    force, torque = total[:3], total[3:]
    size = float(force @ force)
    point = np.cross(force, torque) / size if size else np.zeros(3)
    return force, point, torque - np.cross(point, force)


def pulse_history(
    base: Vector, wrenches: Mapping[str, Vector], on: Sequence[str], firing: Any, stop: float
) -> pd.DataFrame:
    """Return force and torque over time while engines fire in pulses; see `Craft.pulses`.

    ``base`` has force and torque at the operating point, where the engines named in ``on`` are
    firing. ``wrenches`` has force and torque of each engine.
    """
    example = 'such as {"roll": [(0.0, 0.02), (1.0, 1.05)]}'
    if not isinstance(firing, Mapping):
        raise FmuError(f"firing must be pulses by engine, {example}, not {firing!r}")
    refuse(not_positive("stop", stop, "s"))
    edges, steps = [0.0, float(stop)], []
    for name, given in firing.items():
        if name not in wrenches:
            raise FmuError(f"the craft has no engine {name}{did_you_mean(str(name), wrenches)}")
        base = base - wrenches[name] * (name in on)
        try:
            pulses = floats(given).reshape(-1, 2)
        except (TypeError, ValueError):
            raise FmuError(f"{name}: pulses must be (start, end) in s, {example}") from None
        if len(pulses) > MOST_PULSES or not np.isfinite(pulses).all():
            raise FmuError(f"{name}: pulses must be at most {MOST_PULSES} pairs of finite times, s")
        flat = np.sort(pulses, axis=0)
        order = (pulses[:, 0] < pulses[:, 1]).all() and (flat[1:, 0] >= flat[:-1, 1]).all()
        if not order or (pulses < 0).any() or (pulses > stop).any():
            raise FmuError(
                f"{name}: each pulse must end after it starts, pulses must not overlap, and all "
                f"must lie between 0 and stop = {stop:g} s"
            )
        steps.append((pulses, wrenches[name]))
        edges += pulses.ravel().tolist()
    time = np.unique(edges)
    total = np.tile(base, (len(time), 1))
    for pulses, wrench in steps:
        started = np.searchsorted(np.sort(pulses[:, 0]), time, side="right")
        ended = np.searchsorted(np.sort(pulses[:, 1]), time, side="right")
        total += np.outer(started - ended, wrench)
    names = [f"{kind}[{i}]" for kind in ("force", "torque") for i in (1, 2, 3)]
    return pd.DataFrame({"time": time, **dict(zip(names, total.T, strict=True))})
