"""Names of a craft's quantities, which have the same meaning in every method of `Craft`.

If one quantity of a slosh mode changes, its other quantities stay the same. ``frequency`` is the
natural frequency in a fixed tank under the present thrust. If it changes, the height of the slosh
mass stays the same, and a centring stiffness keeps its share of the restoring force. If ``mass`` or
``bob`` (the height of the slosh mass on the tank's axis) changes, mass, centre of mass and inertia
of the liquid at rest stay the same, because the rigid liquid is changed by the opposite amount.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .arguments import refuse
from .fmu import Fmu, FmuError, Parameters, Quantity, did_you_mean
from .plant import Plant, read_vector

TURN = 2 * np.pi

# Quantities of a slosh mode, in Hz, 1, kg and m. ``bob`` is the height of the slosh mass on the
# tank's axis.
KINDS = ("frequency", "zeta", "mass", "bob")

DELAY = "delay"  # Delay of a loop, s

OMEGA = tuple(f"init.omega[{i}]" for i in (1, 2, 3))  # Angular velocity at the start, rad/s

# Names that a tank or appendage of a `Craft` must not have, because names of the FMU begin so.
RESERVED = re.compile(
    r"(tank|appendage)(\[\d\])?|appendages|craft|init|pivot|solver|delay|force|torque|omega|q"
)

# Rest of the error message, after the name of a quantity, if the tank does not have the mode.
NO_MODE = "does not exist: its tank has no such mode"

# Parameters of a slosh mode, which exist only if the tank has this mode.
OF_A_MODE = re.compile(r"tank\[\d\]\.(mass|length|hinge|k|zeta|wave)\[\d\]$")

_MODE_QUANTITY = re.compile(rf"tank\[(\d)\]\.({'|'.join(KINDS)})\[(\d)\]")
_LENGTH_OR_HINGE = re.compile(r"(tank\[\d\])\.(length|hinge)(\[\d\])")


class Names(tuple[str, ...]):
    """Names of a craft's tanks, and the name of the appendage of each flexible mode."""

    appendages: tuple[str, ...] = ()

    @classmethod
    def collect(cls, tanks: Iterable[str], appendages: Iterable[str] = ()) -> "Names":
        """Create the names of a craft; ``appendages`` has the appendage's name for each mode."""
        if isinstance(tanks, Names):
            return tanks
        found = cls(tanks)
        found.appendages = tuple(appendages)
        return found

    def prefixes(self) -> list[tuple[str, str, int]]:
        """Return rows that relate the FMU's numbers to the names of tanks and appendages.

        Each row has the beginning of the FMU's names, the name of the tank or appendage, and the
        number of the mode (0 for a tank). For example, (``appendage[3].``, ``array``, 1) means that
        the FMU's third flexible mode is mode 1 of the appendage ``array``.
        """
        found = [(f"tank[{number}].", name, 0) for number, name in enumerate(self, 1)]
        for j, name in enumerate(self.appendages, 1):
            found.append((f"appendage[{j}].", name, self.appendages[:j].count(name)))
        return found


@dataclass(frozen=True)
class ModeQuantity:
    """A quantity of one slosh mode, such as the frequency of mode 1 of tank 2."""

    tank: int
    kind: str
    number: int

    def name(self, kind: str) -> str:
        """Return the name of one parameter of this slosh mode in the FMU.

        For example, ``kind`` "zeta" of the first mode of tank 2 gives ``tank[2].zeta[1]``.
        """
        return f"tank[{self.tank}].{kind}[{self.number}]"


def mode_quantity(name: str) -> ModeQuantity | None:
    """Return the quantity of a slosh mode with this full name, or None for other names.

    For example ``tank[1].frequency[1]`` is the frequency of mode 1 of tank 1.
    """
    match = _MODE_QUANTITY.fullmatch(name)
    return ModeQuantity(int(match[1]), match[2], int(match[3])) if match else None


def full_name(name: str, tanks: Iterable[str]) -> str:
    """Return a quantity's name in the FMU: the number of the tank or mode instead of its name.

    For example ``NTO.zeta[1]`` becomes ``tank[1].zeta[1]``, and ``array.zeta[1]`` becomes
    ``appendage[3].zeta``.
    """
    found = []
    for prefix, owner, mode in Names.collect(tanks).prefixes():
        if not name.startswith(f"{owner}."):
            continue
        kind = name.removeprefix(f"{owner}.")
        if mode:
            match = re.fullmatch(rf"(\w+)\[{mode}(?:,(\d+))?\]", kind)
            if not match:
                continue
            kind = match[1] + (f"[{match[2]}]" if match[2] else "")
        found.append((len(owner), prefix + kind))
    return max(found)[1] if found else name


def short_name(name: str, tanks: Iterable[str]) -> str:
    """Return a quantity's name for users: the name of the tank or appendage instead of the number.

    For example ``tank[1].zeta[1]`` becomes ``NTO.zeta[1]``, and ``appendage[3].zeta`` becomes
    ``array.zeta[1]``.
    """
    for prefix, owner, mode in Names.collect(tanks).prefixes():
        if name.startswith(prefix):
            kind = name.removeprefix(prefix)
            if mode:
                kind, _, element = kind.removesuffix("]").partition("[")
                kind = f"{kind}[{mode},{element}]" if element else f"{kind}[{mode}]"
            return f"{owner}.{kind}"
    return name


def unknown(name: str, fmu: Fmu, tanks: Iterable[str], also: Iterable[str] = ()) -> str:
    """Return an error message if a name is not a quantity of a craft, else an empty string.

    ``also`` has names that are allowed in addition to the FMU's variables, the quantities of slosh
    modes and the delay.
    """
    tanks, also = Names.collect(tanks), [DELAY, *also]
    full = full_name(name, tanks)
    if full in also or mode_quantity(full) or full in fmu.variables:
        return ""
    numbers = [f"tank[{number}]." for number in range(1, len(tanks) + 1)]
    used = tuple(prefix for prefix, _, _ in tanks.prefixes())
    known = [
        n for n in fmu.variables if not n.startswith(("tank[", "appendage[")) or n.startswith(used)
    ]
    known += [f"{number}bob[{n}]" for number in numbers for n in (1, 2, 3)]
    short = [short_name(n, tanks) for n in known]
    return f"the craft has no quantity {name}{did_you_mean(name, [*also, *short, *known])}"


def full_names(
    given: Parameters, fmu: Fmu, tanks: Iterable[str], also: Iterable[str] = ()
) -> dict[str, Quantity]:
    """Return values with their names in the FMU, such as ``tank[1].zeta[1]`` for ``NTO.zeta[1]``.

    Raises FmuError for names that are not quantities of a craft (see `unknown`), and for a quantity
    that is given under both of its names.
    """
    tanks, found = Names.collect(tanks), dict[str, Quantity]()
    problems = [text for name in given if (text := unknown(str(name), fmu, tanks, also))]
    for name, value in given.items():
        full = full_name(str(name), tanks)
        if full in found:
            both = (full, short_name(full, tanks))
            problems.append(f"{' and '.join(both)} are the same quantity: give it once")
        found[full] = value
    refuse(problems)
    return found


def slosh_mass_error(name: str) -> str:
    """Return an error message if a parameter would move the slosh mass, else an empty string.

    An uncertain length or hinge of a pendulum is refused, because it would change several
    quantities at once: both move the slosh mass, and the length also changes the frequency.
    """
    if not (match := _LENGTH_OR_HINGE.fullmatch(name)):
        return ""
    frequency, bob = (f"{match[1]}.{kind}{match[3]}" for kind in ("frequency", "bob"))
    also = " and changes the frequency" if match[2] == "length" else ""
    return (
        f"moves the slosh mass{also}: give {frequency}, Hz, which keeps the height of the slosh "
        f"mass, or {bob}, m, the height of the slosh mass on the tank's axis"
    )


class Modes:
    """Parameters of Spacecraft in which quantities of slosh modes can be read and changed."""

    def __init__(self, model: str | Path, given: Parameters) -> None:
        self.model, self.fmu, self.given = model, Fmu.open(model), dict(given)

    def number(self, name: str) -> float:
        """Return the given value of a parameter or, if none is given, the FMU's start value."""
        if name in self.given:
            return float(self.fmu.convert(name, self.given[name]))
        return float(self.fmu.variable(name).start or 0.0)

    def problem(self, mode: ModeQuantity) -> str:
        """Return the reason why a quantity cannot be set, or an empty string if it can."""
        if mode.tank > self.number("tanks") or mode.number > self.number(
            f"tank[{mode.tank}].modes"
        ):
            return NO_MODE
        if mode.kind == "zeta":
            return ""
        if self.number(f"tank[{mode.tank}].fill.points"):
            return (
                "follows from the fill table of its tank, which drains, and cannot be given; leave "
                "out mass_flow, or vary the fill instead"
            )
        if self.number(f"tank[{mode.tank}].diameter"):
            return "follows from the diameter of its tank, and cannot be given; leave out diameter"
        planar = any(
            self.number(f"tank[{mode.tank}].direction[{n},{i}]")
            for n in range(1, int(self.number(f"tank[{mode.tank}].modes")) + 1)
            for i in (1, 2)
        )
        if planar and mode.kind in ("mass", "bob"):
            return "is for tanks without planar modes; the mass of a box follows from its drawing"
        return ""

    def value(self, mode: ModeQuantity) -> float:
        """Return the value of a quantity of a slosh mode, SI units."""
        if mode.kind == "bob":
            return self.number(mode.name("hinge")) - self._length(mode)
        if mode.kind != "frequency":
            return self.number(mode.name(mode.kind))
        along = self._axial_force(mode)
        w2 = along / self._length(mode)
        w2 += self.number(mode.name("k")) / self.number(mode.name("mass"))
        if not w2 > 0:
            raise FmuError(
                f"{mode.name('frequency')} does not exist: neither thrust and spin "
                f"({along:.3g} m/s² along the tank's axis) nor surface tension holds the liquid"
            )
        return float(np.sqrt(w2)) / TURN

    def _length(self, mode: ModeQuantity) -> float:
        f, length = self.number(mode.name("frequency")), self.number(mode.name("length"))
        if f > 0:
            by_gravity = (TURN * f) ** 2 - self.number(mode.name("k")) / self.number(
                mode.name("mass")
            )
            length = self.number(f"tank[{mode.tank}].g_ref") / by_gravity
        return length

    def _axial_force(self, mode: ModeQuantity) -> float:
        """Return the specific force along the tank's axis at the slosh mass of ``mode``, m/s²."""
        bob = self.number(mode.name("hinge")) - self._length(mode)
        with Plant(self.model, self.given) as plant:
            axis, force = force_in_tank(plant, mode.tank, bob)
        return float(axis @ force)

    def scale_frequency(self, mode: ModeQuantity, factor: float) -> None:
        """Multiply a mode's frequency by a factor.

        The factor is the same at every thrust, and the height of the slosh mass does not change.
        """
        if not factor > 0:
            raise FmuError(f"{mode.name('frequency')} must be above 0 Hz")
        length = self._length(mode)
        new = length / factor**2
        changes = {"length": new, "k": self.number(mode.name("k")) * factor**2, "frequency": 0.0}
        changes["hinge"] = self.number(mode.name("hinge")) + new - length
        self.given |= {mode.name(name): value for name, value in changes.items()}

    def set(self, mode: ModeQuantity, value: float) -> None:
        """Set one quantity of a mode.

        The other quantities of the mode do not change. Mass, centre of mass and inertia of the
        whole liquid do not change, either.
        """
        if mode.kind == "zeta":
            self.given[mode.name("zeta")] = value
        elif mode.kind == "frequency":
            self.scale_frequency(mode, value / self.value(mode))
        elif mode.kind == "mass":
            if not value > 0:
                raise FmuError(f"{mode.name('mass')} must be above 0 kg")
            old, bob = (
                self.number(mode.name("mass")),
                self.value(ModeQuantity(mode.tank, "bob", mode.number)),
            )
            self.given[mode.name("k")] = self.number(mode.name("k")) * value / old
            self.given[mode.name("mass")] = value
            self._keep_at_rest(mode.tank, [(old, bob), (-value, bob)])
        else:
            length, old, m = self._length(mode), self.value(mode), self.number(mode.name("mass"))
            spins = any(map(self.number, OMEGA))
            before = self._axial_force(mode) if spins else 0.0
            self.given |= {mode.name("hinge"): value + length, mode.name("length"): length}
            self.given[mode.name("frequency")] = 0.0
            self._keep_at_rest(mode.tank, [(m, old), (-m, value)])
            # in a craft that spins the specific force differs at the new height; keep the frequency
            if before:
                length *= self._axial_force(mode) / before
                self.given |= {mode.name("length"): length, mode.name("hinge"): value + length}

    def _keep_at_rest(self, tank: int, points: list[tuple[float, float]]) -> None:
        """Add point masses to a tank's rigid liquid, so that the sum of all liquid stays the same.

        ``points`` are pairs of mass (kg) and height (m); they compensate changed slosh masses. If
        the rigid liquid's inertia would become negative, the dry craft's inertia is reduced
        instead; see `rigid_rest`.
        """
        prefix = f"tank[{tank}]"
        m_0, H_0, I_0, more = (
            self.number(f"{prefix}.{name}") for name in ("m_0", "H_0", "I_0", "dI_y")
        )
        m_0, H_0, I_0, lent = rigid_rest(m_0, H_0, I_0, more, points)
        found = {f"{prefix}.m_0": m_0, f"{prefix}.H_0": H_0, f"{prefix}.I_0": I_0}
        if lent:
            axis = axis_of([self.number(f"{prefix}.q[{i}]") for i in range(1, 5)])
            J = lent * (np.eye(3) - np.outer(axis, axis))
            for i in range(3):
                for j in range(i, 3):
                    name = f"craft.J{'xyz'[i]}{'xyz'[j]}"
                    found[name] = self.number(name) + float(J[i, j])
        self.given |= found


def axis_of(q: Any) -> np.ndarray:
    """Return the axis (unit vector, body axes) of a tank with the attitude ``q``, scalar first."""
    w, x, y, z = np.asarray(q) / np.linalg.norm(q)
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def force_in_tank(plant: Plant, tank: int, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a tank's axis, and the specific force (m/s²) at a height (m) on it, body axes."""
    axis = axis_of(read_vector(plant, f"tank[{tank}].q", 4))
    place = read_vector(plant, f"tank[{tank}].position") + height * axis
    omega = read_vector(plant, "omega")
    turning = np.cross(read_vector(plant, "omega_dot"), place)
    turning = turning + np.cross(omega, np.cross(omega, place))
    return axis, read_vector(plant, "specific_force") + turning


def nominal_value(modes: Modes, untrimmed: Parameters, name: str) -> float | None:
    """Return the nominal value of a quantity by its full name, or None if its mode is missing.

    ``modes`` has the parameters of the trimmed operating point. ``untrimmed`` has the parameters
    before trimming, which moves the origin and with it all positions.
    """
    if mode := mode_quantity(name):
        return None if modes.problem(mode) else modes.value(mode)
    if name in untrimmed:
        return float(modes.fmu.convert(name, untrimmed[name]))
    if OF_A_MODE.match(name):
        return None
    start = modes.fmu.variable(name).start
    return float(start) if start is not None else None


def rigid_rest(
    m_0: float, H_0: float, I_0: float, more_y: float, points: Iterable[tuple[float, float]]
) -> tuple[float, float, float, float]:
    """Return mass, height and inertia of the rigid liquid after point masses are added to it.

    ``points`` has pairs of a mass and its height. The fourth result is 0 or, if the inertia of the
    rigid liquid across the axis would become negative, as in a sphere, this negative inertia; the
    returned inertia is then raised to 0, and the caller must add the negative inertia to the dry
    craft. Dry craft and rigid liquid move together, so that only the sum of their inertias acts.
    """
    moment = m_0 * H_0
    inertia = I_0 + moment * H_0
    for m, height in points:
        m_0, moment, inertia = m_0 + m, moment + m * height, inertia + m * height**2
    H_0 = moment / m_0 if m_0 > 0 else 0.0
    I_0 = inertia - moment * H_0
    lent = min(0.0, I_0, I_0 + more_y)
    return m_0, H_0, I_0 - lent, lent


def apply_changes(
    model: str | Path,
    given: Parameters,
    values: Parameters,
    factors: Mapping[str, float] | None = None,
    tanks: Iterable[str] = (),
) -> dict[str, Quantity]:
    """Return parameters of Spacecraft in which quantities of slosh modes are changed.

    ``values`` maps full names of parameters to their new values. ``factors`` maps full names of
    frequencies to the ratio of the new to the given frequency, which holds at any thrust. ``tanks``
    has the tanks' names for error messages.
    """
    modes, problems = Modes(model, given), []
    for name, value in values.items():
        mode = mode_quantity(name)
        assert mode is not None
        if problem := modes.problem(mode):
            problems.append(f"{short_name(name, tanks)} {problem}")
            continue
        like = mode.name("hinge" if mode.kind == "bob" else mode.kind)
        modes.set(mode, float(modes.fmu.convert(like, value)))
    refuse(problems)
    for name, factor in (factors or {}).items():
        mode = mode_quantity(name)
        assert mode is not None
        modes.scale_frequency(mode, factor)
    return modes.given
