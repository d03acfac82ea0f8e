"""Names of a craft's uncertain quantities, with one meaning in every method of `Craft`.

A quantity of a slosh mode changes alone. ``frequency`` is that with the tank held, under the thrust
that acts: the bob's height stays, and a centring stiffness keeps its share of the restoring force.
``mass`` and ``bob`` (the bob's height on the tank's axis) leave mass, centre of mass and inertia of
the liquid at rest as they are. The rigid liquid takes up the difference.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .fmu import Fmu, FmuError, Parameters, Quantity
from .plant import Plant

TURN = 2 * np.pi

KINDS = ("frequency", "zeta", "mass", "bob")
"""Quantities of a mode: Hz, 1, kg, and height of the bob on the tank's axis, m."""

DELAY = "delay"
"""Delay of a loop, s."""

RESERVED = re.compile(r"tank(\[\d\])?|craft|init|pivot|solver|delay|force|torque|omega|q")
"""Names that no tank of a `Craft` may have: parameters of the FMU begin with them."""

_OF_A_MODE = re.compile(rf"tank\[(\d)\]\.({'|'.join(KINDS)})\[(\d)\]")
_MOVES_THE_BOB = re.compile(r"(tank\[\d\])\.(length|hinge)(\[\d\])")


@dataclass(frozen=True)
class OfMode:
    """A quantity of a slosh mode."""

    tank: int
    kind: str
    mode: int

    def of(self, kind: str) -> str:
        """Return the FMU's name of a parameter of this mode."""
        return f"tank[{self.tank}].{kind}[{self.mode}]"


def of_mode(name: str) -> OfMode | None:
    """Return the quantity of a mode that a full name stands for."""
    match = _OF_A_MODE.fullmatch(name)
    return OfMode(int(match[1]), match[2], int(match[3])) if match else None


def full_name(name: str, tanks: Iterable[str]) -> str:
    """Return a name with the number of its tank: ``tank[1].zeta[1]`` for ``NTO.zeta[1]``."""
    found = [(tank, number) for number, tank in enumerate(tanks, 1) if name.startswith(f"{tank}.")]
    if not found:
        return name
    tank, number = max(found, key=lambda row: len(row[0]))
    return f"tank[{number}]{name.removeprefix(tank)}"


def full_names(given: Parameters, tanks: Iterable[str]) -> dict[str, Quantity]:
    """Return values by full names; a quantity that is given under both of its names is refused."""
    tanks, found = list(tanks), dict[str, Quantity]()
    for name, value in given.items():
        full = full_name(name, tanks)
        if full in found:
            raise FmuError(f"{name} and {full} are the same quantity: give it once")
        found[full] = value
    return found


def moves_the_bob(name: str) -> str:
    """Return why a parameter's range would change more than one quantity; "" if it does not."""
    if not (match := _MOVES_THE_BOB.fullmatch(name)):
        return ""
    frequency, bob = (f"{match[1]}.{kind}{match[3]}" for kind in ("frequency", "bob"))
    also = " and changes the frequency" if match[2] == "length" else ""
    return (
        f"moves the bob{also}: give {frequency}, Hz, which keeps the bob where it is, or {bob}, "
        "the bob's height on the tank's axis, m"
    )


class Modes:
    """Slosh modes of Spacecraft's parameters, whose quantities can be read and changed."""

    def __init__(self, model: str | Path, given: Parameters) -> None:
        """Take the parameters of an FMU; nothing is computed before it is asked for."""
        self.model, self.fmu, self.given = model, Fmu.open(model), dict(given)

    def number(self, name: str) -> float:
        """Return a parameter's value, which may be the FMU's own."""
        if name in self.given:
            return float(self.fmu.convert(name, self.given[name]))
        return float(self.fmu.variable(name).start or 0.0)

    def problem(self, of: OfMode) -> str:
        """Return why a quantity does not exist; "" if it does."""
        if of.tank > self.number("tanks") or of.mode > self.number(f"tank[{of.tank}].modes"):
            return "does not exist at this fill: its tank has no such mode"
        if of.kind == "zeta":
            return ""
        if self.number(f"tank[{of.tank}].fill.points") or self.number(f"tank[{of.tank}].diameter"):
            return "follows from the tank's fill table or diameter, and cannot be given"
        planar = any(
            self.number(f"tank[{of.tank}].direction[{n},{i}]")
            for n in range(1, int(self.number(f"tank[{of.tank}].modes")) + 1)
            for i in (1, 2)
        )
        if planar and of.kind in ("mass", "bob"):
            return "is for tanks without planar modes; a box has its mass from its drawing"
        return ""

    def value(self, of: OfMode) -> float:
        """Return the value of a quantity."""
        if of.kind == "bob":
            return self.number(of.of("hinge")) - self._length(of)
        if of.kind != "frequency":
            return self.number(of.of(of.kind))
        w2 = self._along(of.tank) / self._length(of)
        w2 += self.number(of.of("k")) / self.number(of.of("mass"))
        if not w2 > 0:
            raise FmuError(
                f"{of.of('frequency')} does not exist: neither thrust ({self._along(of.tank):.3g} "
                "m/s² along the tank's axis) nor surface tension holds the liquid"
            )
        return float(np.sqrt(w2)) / TURN

    def _length(self, of: OfMode) -> float:
        f, length = self.number(of.of("frequency")), self.number(of.of("length"))
        if f > 0:
            of_gravity = (TURN * f) ** 2 - self.number(of.of("k")) / self.number(of.of("mass"))
            length = self.number(f"tank[{of.tank}].g_ref") / of_gravity
        return length

    def _along(self, tank: int) -> float:
        """Return the specific force along a tank's axis in a craft that does not turn, m/s²."""
        with Plant(self.model, self.given) as plant:
            force = plant.get([f"specific_force[{i}]" for i in (1, 2, 3)])
            q = plant.get([f"tank[{tank}].q[{i}]" for i in range(1, 5)])
        w, x, y, z = np.array(q) / np.linalg.norm(q)
        axis = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
        return float(np.dot(axis, force))

    def scale_frequency(self, of: OfMode, factor: float) -> None:
        """Multiply a mode's frequency by a factor, at every thrust; its bob stays."""
        if not factor > 0:
            raise FmuError(f"{of.of('frequency')} must be above 0 Hz")
        length = self._length(of)
        new = length / factor**2
        changes = {"length": new, "k": self.number(of.of("k")) * factor**2, "frequency": 0.0}
        changes["hinge"] = self.number(of.of("hinge")) + new - length
        self.given |= {of.of(name): value for name, value in changes.items()}

    def set(self, of: OfMode, value: float) -> None:
        """Change a quantity alone."""
        if of.kind == "zeta":
            self.given[of.of("zeta")] = value
        elif of.kind == "frequency":
            self.scale_frequency(of, value / self.value(of))
        elif of.kind == "mass":
            if not value > 0:
                raise FmuError(f"{of.of('mass')} must be above 0 kg")
            old, bob = self.number(of.of("mass")), self.value(OfMode(of.tank, "bob", of.mode))
            self.given[of.of("k")] = self.number(of.of("k")) * value / old
            self.given[of.of("mass")] = value
            self._keep_at_rest(of.tank, [(old, bob), (-value, bob)])
        else:
            length, old, m = self._length(of), self.value(of), self.number(of.of("mass"))
            self.given |= {of.of("hinge"): value + length, of.of("length"): length}
            self.given[of.of("frequency")] = 0.0
            self._keep_at_rest(of.tank, [(m, old), (-m, value)])

    def _keep_at_rest(self, tank: int, points: list[tuple[float, float]]) -> None:
        """Add masses at heights to the rigid liquid; the dry craft lends it inertia."""
        prefix = f"tank[{tank}]"
        m_0, H_0, I_0, more = (
            self.number(f"{prefix}.{name}") for name in ("m_0", "H_0", "I_0", "dI_y")
        )
        m_0, H_0, I_0, lent = rigid_rest(m_0, H_0, I_0, more, points)
        found = {f"{prefix}.m_0": m_0, f"{prefix}.H_0": H_0, f"{prefix}.I_0": I_0}
        if lent:
            w, x, y, z = q = np.array([self.number(f"{prefix}.q[{i}]") for i in range(1, 5)])
            w, x, y, z = q / np.linalg.norm(q)
            axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
            J = lent * (np.eye(3) - np.outer(axis, axis))
            for i in range(3):
                for j in range(i, 3):
                    name = f"craft.J{'xyz'[i]}{'xyz'[j]}"
                    found[name] = self.number(name) + float(J[i, j])
        self.given |= found


def rigid_rest(
    m_0: float, H_0: float, I_0: float, more_y: float, points: Iterable[tuple[float, float]]
) -> tuple[float, float, float, float]:
    """Return mass, height and inertia of a rigid liquid with masses added at heights.

    Also the inertia across the axis, 0 or below, that the dry craft has to lend because the
    liquid's own, as in a sphere, would be negative; both are rigid.
    """
    moment = m_0 * H_0
    inertia = I_0 + moment * H_0
    for m, height in points:
        m_0, moment, inertia = m_0 + m, moment + m * height, inertia + m * height**2
    H_0 = moment / m_0 if m_0 > 0 else 0.0
    I_0 = inertia - moment * H_0
    lent = min(0.0, I_0, I_0 + more_y)
    return m_0, H_0, I_0 - lent, lent


def changed(
    model: str | Path,
    given: Parameters,
    values: Parameters,
    factors: Mapping[str, float] | None = None,
) -> dict[str, Quantity]:
    """Return parameters of Spacecraft with quantities of slosh modes, by full names, changed.

    factors: frequencies by their ratio to those of the parameters, whatever the thrust is.
    """
    modes, problems = Modes(model, given), []
    for name, value in values.items():
        of = of_mode(name)
        assert of is not None
        if problem := modes.problem(of):
            problems.append(f"{name} {problem}")
            continue
        like = of.of("hinge" if of.kind == "bob" else of.kind)
        modes.set(of, float(modes.fmu.convert(like, value)))
    if problems:
        raise FmuError("; ".join(problems))
    for name, factor in (factors or {}).items():
        of = of_mode(name)
        assert of is not None
        modes.scale_frequency(of, factor)
    return modes.given
