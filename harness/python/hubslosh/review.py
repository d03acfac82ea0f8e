"""A design review of a loop around a `Craft` over its fills: margins, slosh, worst case.

Each point is linearised in steady thrust: the thrust acts through the centre of mass, as after
trimming. Otherwise the craft would turn faster and faster.
"""

import os
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .files import write_file
from .fmu import Fmu, FmuError, FmuWarning, Quantity, did_you_mean
from .linearization import LinearModel, linearize
from .loop import Loop
from .sampling import _not_whole, draw
from .short import ShortTable
from .stabilisation import resonances
from .stability import Margins, _largest, margins_and_gain
from .suggestion import Suggestion, suggest
from .worst_case import Confirmation, confirm, search

if TYPE_CHECKING:
    from .craft import Craft, Fill

Vector = NDArray[np.float64]

_PLACE = re.compile(r"(?:craft\.r|tank\[\d\]\.position)\[(\d)\]$")
"""Coordinates from O."""

OF_A_MODE = re.compile(r"tank\[\d\]\.(mass|length|hinge|k|zeta|wave)\[\d\]$")
"""Parameters that a tank without this mode does not have."""


@dataclass(frozen=True)
class Uncertain:
    """A quantity of the review with its range."""

    name: str
    """Name of a parameter of the FMU, "delay", or "damping of" a tank."""
    text: str
    """Its range in words."""
    values: Callable[[int, float], dict[str, float]]
    """Parameters at the fill of an index, from a share: -1 low end, 0 nominal, 1 high end."""


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the review that was evaluated."""

    fill: int
    """Index of the fill."""
    shares: Vector
    """Position of each uncertain quantity: -1 low end, 0 nominal, 1 high end."""
    loop: Loop
    """Loop at this point, its thrust through the centre of mass."""
    margins: Margins
    """Margins of the loop."""
    gain: LinearModel
    """Sampled loop gain."""

    @property
    def growth(self) -> float:
        """Growth rate of the closed loop's least stable pole, 1/s."""
        size = _largest(self.margins.poles, self.gain.period)
        return float(np.log(size) / self.loop.period)

    @property
    def distance(self) -> float:
        """Modulus margin of a stable loop; otherwise minus the growth rate, 1/s."""
        return self.margins.modulus_margin if self.margins.stable else -self.growth


@dataclass(frozen=True, eq=False, repr=False)
class Review:
    """Result of `Craft.review`; ``print`` gives the answer in at most 20 lines."""

    craft: "Craft"
    """The craft that was reviewed."""
    fills: tuple[str, ...]
    """Fills in words."""
    at: Vector
    """Fills as numbers, in ``unit``."""
    unit: str
    """Unit of ``at``: "%" of the volume, or "kg" of liquid."""
    uncertain: tuple[Uncertain, ...]
    """Uncertain quantities."""
    family: tuple[LinearModel, ...]
    """Linear model of the craft at each fill, from commands to measurements. All have the same
    states, also those of modes that a fill does not have."""
    nominal: tuple[Point, ...]
    """Nominal point at each fill, with its margins and loop gain."""
    points: pd.DataFrame
    """A row for each point: ``kind`` ("nominal", "one at a time", "draw" or "search"), ``fill``
    (index), ``stable``, ``modulus_margin``, ``phase_margin`` (deg), ``gain_up`` and ``gain_down``
    (dB), ``delay_margin`` (s), ``growth`` (1/s, of the closed loop's least stable pole),
    ``distance`` (modulus margin, or minus the growth rate of an unstable loop), and the share of
    each uncertain quantity: -1 low end, 0 nominal, 1 high end."""
    slosh: pd.DataFrame
    """A row for each nominal fill, loop and slosh mode that shows in the loop gain: see
    `hubslosh.stabilisation.resonances`."""
    worst: Point
    """Point with the least distance; a search has led to it."""
    confirmation: Confirmation
    """Simulation of the nonlinear FMU at the worst point."""
    suggestion: Suggestion
    """A notch or roll-off that raises the smallest margin, with its cost in phase."""
    warnings: tuple[str, ...] = field(default=())
    """Warnings about the tanks, each for one of the fills where it applies."""

    def bands(self) -> pd.DataFrame:
        """Return the least and largest value of each margin at each fill, over all points.

        Columns: ``fill`` (index), ``at`` (see `at`), and for each margin ``…_low``, ``…_nominal``
        and ``…_high``.
        """
        names = ["modulus_margin", "phase_margin", "gain_up", "gain_down", "delay_margin"]
        groups = self.points.groupby("fill")
        table = pd.DataFrame({"fill": range(len(self.fills)), "at": self.at})
        nominal = self.points[self.points["kind"] == "nominal"].set_index("fill")
        for name in names:
            table[f"{name}_low"] = groups[name].min()
            table[f"{name}_nominal"] = nominal[name]
            table[f"{name}_high"] = groups[name].max()
        return table

    def modes(self) -> dict[str, str]:
        """Return how each slosh mode is stabilised, in words, by its name."""
        found = {}
        for mode, rows in self.slosh.groupby("mode", sort=False):
            counts = rows["stabilised"].value_counts()
            if len(counts) == 1:
                found[str(mode)] = _stabilised(counts.index[0])
                continue
            parts = []
            for how in counts.index:
                chosen = rows[rows["stabilised"] == how]
                fills = [self.fills[k] for k in sorted(set(chosen["fill"]))]
                where = fills[0] if len(fills) == 1 else f"{fills[0]} to {fills[-1]}"
                parts.append(f"{_stabilised(how)} (fills {where})")
            found[str(mode)] = ", ".join(parts)
        return found

    def stabilisation(self) -> list[str]:
        """Return how the slosh modes are stabilised, a line for modes with the same words."""
        modes: dict[str, list[str]] = {}
        for mode, how in self.modes().items():
            modes.setdefault(how, []).append(mode)
        return [f"{', '.join(of)}: {how}." for how, of in modes.items()]

    @property
    def answer(self) -> str:
        """The answer in a sentence."""
        table = self.points
        unstable = table[~table["stable"]]
        count = _count(len(self.fills), "fill")
        all_of = f"all {count}" if len(self.fills) > 1 else count
        points = _count(len(table), "point")
        if len(unstable):
            nominal = unstable[unstable["kind"] == "nominal"]
            if len(nominal):
                fills = ", ".join(self.fills[k] for k in nominal["fill"])
                return f"The nominal loop is UNSTABLE at {len(nominal)} of {count}: {fills}."
            return (
                f"The nominal loop is stable at {all_of}, but UNSTABLE at {len(unstable)} of "
                f"{points} within the uncertainty."
            )
        worst = table.loc[table["distance"].idxmin()]
        return (
            f"The loop is stable at {all_of} and {points}; its smallest modulus "
            f"margin is {worst['modulus_margin']:.2f} (fill {self.fills[int(worst['fill'])]}), "
            f"its phase margin at least {table['phase_margin'].abs().min():.0f}°, its delay "
            f"margin at least {table['delay_margin'].min():.2g} s."
        )

    def worst_values(self) -> dict[str, float]:
        """Return the parameters at the worst point that differ from the nominal ones."""
        found: dict[str, float] = {}
        for quantity, share in zip(self.uncertain, self.worst.shares, strict=True):
            if share:
                found |= quantity.values(self.worst.fill, float(share))
        return found

    def html(self) -> str:
        """Return the page: answer, figures, tables. It needs no network, and prints on paper."""
        from .review_page import page

        return page(self)

    def save(self, path: str | Path) -> None:
        """Write the page, .html. Needs matplotlib."""
        write_file(path, ".html", self.html)

    def __str__(self) -> str:
        """Return the answer, then what it rests on."""
        table = self.points
        lines = [self.answer, *self.stabilisation()[:8]]
        for name, unit in (("phase_margin", "°"), ("gain_up", " dB"), ("delay_margin", " s")):
            low, high = table[name].min(), table[name].max()
            lines.append(f"{name.replace('_', ' ')}: {low:.3g} to {high:.3g}{unit}")
        values = ", ".join(f"{name} = {x:.4g}" for name, x in self.worst_values().items())
        where = f"fill {self.fills[self.worst.fill]}" + (f", {values}" if values else "")
        lines += [f"worst case: {where}; {self.confirmation}"]
        lines.append(self.suggestion.text)
        if self.uncertain:
            lines += ["uncertain: " + "; ".join(f"{u.name} {u.text}" for u in self.uncertain)]
        if self.warnings:
            lines.append(f"{_count(len(self.warnings), 'warning')}, see .warnings")
        return "\n".join(line if len(line) < 500 else f"{line[:499]}…" for line in lines)

    def __repr__(self) -> str:
        """Return the answer."""
        return f"Review({self.answer})"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def _stabilised(how: str) -> str:
    return how if how == "unstable" else f"{how.replace(' and', '- and')}-stabilised"


def review(
    craft: "Craft",
    controller: Any,
    period: float,
    fills: "Sequence[Fill]",
    *,
    damping: Literal["interval", "nominal"],
    uncertain: Mapping[str, Any] | None,
    draws: int,
    seed: int,
    parameters: Mapping[str, Quantity] | None = None,
    **options: Any,
) -> Review:
    """Return the review of a loop; see `Craft.review`."""
    if wrong := _not_whole(draws=(draws, 0), seed=(seed, 0)):
        raise FmuError("; ".join(wrong))
    space = _Space.of(craft, controller, period, fills, damping, uncertain, parameters, options)
    count = len(space.uncertain)
    none = np.zeros(count)
    planned = [("nominal", k, none) for k in range(len(space.loops))]
    ends = [sign * row for row in np.eye(count) for sign in (-1.0, 1.0)]
    planned += [("one at a time", k, x) for k in range(len(space.loops)) for x in ends]
    if count:
        ranges = {u.name: (-1.0, 1.0) for u in space.uncertain}
        for run in range(draws):
            shares = draw(ranges, run, seed).values()
            planned.append(("draw", run % len(space.loops), np.array([*shares])))
    points = space.evaluate((k, x) for _, k, x in planned)
    searched = search(space.evaluate, points)
    kinds = [kind for kind, _, _ in planned] + ["search"] * len(searched)
    every = points + searched
    rows = [
        {"kind": kind} | row_of(point, space.uncertain)
        for kind, point in zip(kinds, every, strict=True)
    ]
    worst = min(every, key=lambda point: point.distance)
    nominal = tuple(points[: len(space.loops)])
    slosh = []
    for k, point in enumerate(nominal):
        named = point.loop.gain()
        slosh += [{"fill": k} | row for row in resonances(named, list(craft.tanks))]
    columns = [
        "fill", "loop", "mode", "frequency", "zeta", "zeta_closed", "zero", "order", "peak",
        "phase", "stabilised",
    ]  # fmt: skip
    table = ShortTable(slosh, columns=columns)
    table.attrs["units"] = {
        "frequency": "Hz", "zeta": "1", "zeta_closed": "1", "zero": "Hz", "peak": "dB",
        "phase": "deg",
    }  # fmt: skip
    return Review(
        craft, space.names, space.at, space.unit, space.uncertain, _family(nominal), nominal,
        ShortTable(rows), table, worst, confirm(worst),
        suggest(nominal, every, table), space.warnings,
    )  # fmt: skip


def row_of(point: Point, uncertain: Iterable[Uncertain]) -> dict[str, Any]:
    """Return the numbers of a point."""
    found = point.margins
    down, up = found.gain_margins
    return {
        "fill": point.fill, "stable": found.stable, "modulus_margin": found.modulus_margin,
        "phase_margin": found.phase_margin, "gain_up": up, "gain_down": down,
        "delay_margin": found.delay_margin, "growth": point.growth, "distance": point.distance,
    } | {u.name: x for u, x in zip(uncertain, point.shares, strict=True)}  # fmt: skip


def _family(points: Sequence[Point]) -> tuple[LinearModel, ...]:
    """Return the plants with the states that any of them has, in the FMU's order."""
    models = []
    used: set[str] = set()
    for point in points:
        measured, command = point.loop.names
        loop = point.loop
        model = linearize(loop.model, loop.parameters, command, measured, all_states=True)
        used |= set(loop.plant().states)
        models.append(model)
    keep = [i for i, name in enumerate(models[0].states) if name in used]
    names = tuple(models[0].states[i] for i in keep)
    return tuple(
        replace(m, A=m.A[np.ix_(keep, keep)], B=m.B[keep], C=m.C[:, keep], states=names)
        for m in models
    )


@dataclass(frozen=True, eq=False)
class _Space:
    """Fills and uncertain quantities of a review."""

    names: tuple[str, ...]
    at: Vector
    unit: str
    loops: tuple[Loop, ...]
    uncertain: tuple[Uncertain, ...]
    warnings: tuple[str, ...]

    @classmethod
    def of(
        cls,
        craft: "Craft",
        controller: Any,
        period: float,
        fills: Any,
        damping: str,
        uncertain: Any,
        parameters: Mapping[str, Quantity] | None,
        options: dict[str, Any],
    ) -> "_Space":
        """Check the arguments of a review, and solve its tanks."""
        fills = _list_of(fills)
        if damping not in ("interval", "nominal"):
            raise FmuError(f'damping must be "interval" or "nominal", not {damping!r}')
        loops, tanks, problems = [], [], []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with suppress(FmuError):  # the loop below names the fill
                craft.solve(fills)
            for k, fill in enumerate(fills):
                try:
                    loop = craft.loop(controller, period, fill, parameters=parameters, **options)
                    if not loops:
                        loop._must_be_linear()
                    loops.append(loop)
                    tanks.append(craft.tank_at(fill))
                except FmuError as error:
                    problems.append(f"fills[{k}] = {fill!r}: {error}" if loops else str(error))
                    break
        if problems:
            raise FmuError("; ".join(problems))
        said = tuple(dict.fromkeys(str(w.message) for w in caught))
        # the same warning with another number at another fill
        said = tuple({re.sub(r"= [\d.e+-]+", "", text): text for text in said}.values())
        for text in said:
            warnings.warn(text, FmuWarning, stacklevel=4)
        found = _damping(craft, tanks) if damping == "interval" else []
        found += _given(loops, uncertain or {})
        percent = all(isinstance(f, str) and f.strip().endswith("%") for f in fills)
        if percent:
            at = [float(fill.strip()[:-1]) for fill in fills]
        else:
            at = [sum(tank.mass for tank in of.values()) for of in tanks]
        unit = "%" if percent else "kg"
        words = tuple(f"{x:.3g}%" if percent else f"{x:.4g} kg" for x in at)
        return cls(words, np.array(at), unit, tuple(loops), tuple(found), said)

    def point(self, fill: int, shares: Vector) -> Point:
        """Evaluate a point."""
        loop, delay = self.loops[fill], self.loops[fill].delay
        values: dict[str, Any] = {}
        for quantity, share in zip(self.uncertain, shares, strict=True):
            if share:
                values |= quantity.values(fill, float(share))
        delay = values.pop("delay", delay)
        every = {**loop.parameters, **values}  # type: ignore[dict-item]
        loop = trimmed(replace(loop, parameters=every, delay=delay))
        margins, gain = margins_and_gain(loop)
        return Point(fill, np.array(shares, float), loop, margins, gain)

    def evaluate(self, which: Iterable[tuple[int, Vector]]) -> list[Point]:
        """Evaluate points on all cores."""
        count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
        with ThreadPoolExecutor(count or os.cpu_count()) as pool:
            return list(pool.map(lambda job: self.point(*job), which))


def _list_of(fills: Any) -> list[Any]:
    if isinstance(fills, str | Mapping) or not hasattr(fills, "__iter__"):
        raise FmuError(f'fills must be a list, such as ["10%", "50%", "90%"], not {fills!r}')
    found = list(fills)
    if not found:
        raise FmuError('fills is empty: give at least one fill, such as ["50%"]')
    return found


def trimmed(loop: Loop) -> Loop:
    """Return the loop with the thrust through the centre of mass: O moves across the thrust."""
    from .plant import Plant

    every: dict[str, Any] = dict(loop.parameters)  # type: ignore[arg-type]
    if "craft.r[1]" not in Fmu.open(loop.model).variables:
        return loop
    with Plant(loop.model, every) as plant:
        center = np.array(plant.get([f"center_of_mass[{i}]" for i in (1, 2, 3)]))
        force = np.array(plant.get([f"force[{i}]" for i in (1, 2, 3)]))
    if not force.any():
        return loop
    shift = center - force * (force @ center) / (force @ force)
    for name, value in every.items():
        if match := _PLACE.match(name):
            every[name] = float(value) - float(shift[int(match[1]) - 1])
    return replace(loop, parameters=every)


def _between(low: float, nominal: float, high: float, share: float) -> float:
    end = high if share > 0 else low
    return nominal + abs(share) * (end - nominal)


def _damping(craft: "Craft", tanks: list[dict[str, Any]]) -> list[Uncertain]:
    """Return the damping of each tank, all of whose modes share the error of one correlation."""
    found = []
    for number, name in enumerate(craft.tanks, 1):
        tables = [of[name].modes if name in of else None for of in tanks]
        ends = [
            table[["zeta_low", "zeta", "zeta_high"]].to_numpy().tolist()
            if table is not None and "zeta_low" in table
            else []
            for table in tables
        ]
        if not any(ends):
            continue

        def values(
            fill: int, share: float, number: int = number, ends: list[Any] = ends
        ) -> dict[str, float]:
            return {
                f"tank[{number}].zeta[{n}]": _between(*row, share)
                for n, row in enumerate(ends[fill], 1)
            }

        found.append(Uncertain(f"damping of {name}", "over its interval", values))
    if craft.tanks and not found:
        raise FmuError(
            'damping="interval" needs the viscosity of a liquid: MountedTank(…, nu=…), m²/s; '
            'damping="nominal" takes damping ratios as they are'
        )
    return found


def _given(loops: Sequence[Loop], given: Any) -> list[Uncertain]:
    """Return the uncertain parameters of the FMU, and the delay."""
    if not isinstance(given, Mapping):
        raise FmuError(f'uncertain must be ranges by name, such as {{"craft.mass": (1380, 1420)}}, '
                       f"not {given!r}")  # fmt: skip
    fmu = Fmu.open(loops[0].model)
    allowed = ["delay"]
    allowed += [n for n in fmu.names("parameter", "structuralParameter") if fmu.kind(n) == "Real"]
    problems, found = [], []
    for name, range_ in given.items():
        if name not in allowed:
            problems.append(
                f"uncertain has {name}, which is not a Real parameter of {fmu.name}, nor delay"
                f"{did_you_mean(str(name), allowed)}"
            )
            continue
        nominals = [_nominal(fmu, loop, name) for loop in loops]
        ends, problem = _ends(range_, nominals)
        if problem:
            problems.append(f"uncertain: {name} {problem}")
            continue

        def values(
            fill: int, share: float, name: str = name, nominals: Any = nominals, ends: Any = ends
        ) -> dict[str, float]:
            nominal = nominals[fill]
            if nominal is None:
                return {}
            return {name: _between(ends[fill][0], nominal, ends[fill][1], share)}

        if isinstance(range_, str):
            text = f"± {range_.strip().lstrip('±').strip()}"
        else:
            text = f"{float(range_[0]):g} to {float(range_[1]):g} {_unit(fmu, name)}".rstrip()
        found.append(Uncertain(name, text, values))
    if problems:
        raise FmuError("; ".join(problems))
    return found


def _unit(fmu: Fmu, name: str) -> str:
    return "s" if name == "delay" else fmu.unit(name).replace("1", "").replace(".", "·")


def _nominal(fmu: Fmu, loop: Loop, name: str) -> float | None:
    """Return the nominal value; None if this fill does not have the mode."""
    if name == "delay":
        return float(loop.delay)
    every: Mapping[str, Any] = loop.parameters  # type: ignore[assignment]
    if name in every:
        return float(fmu.convert(name, every[name]))  # type: ignore[arg-type]
    if OF_A_MODE.match(name):
        return None
    start = fmu.variable(name).start
    return float(start) if start is not None else None


Ends = list[tuple[float, float]]


def _ends(given: Any, nominals: list[float | None]) -> tuple[Ends, str]:
    """Return the ends of a range at each fill, or what is wrong with it."""
    known = [value for value in nominals if value is not None]
    allowed = 'allowed: (low, high), or a share of the nominal value such as "5%"'
    if not known:
        return [], "exists at no fill: its tank does not have this mode"
    if isinstance(given, str):
        text = given.strip().lstrip("±").strip()
        try:
            share = float(text.removesuffix("%")) / 100
        except ValueError:
            share = np.nan
        if not text.endswith("%") or not 0 < share < np.inf:
            return [], f"cannot be {given!r} ({allowed})"
        if 0 in known:
            return [], f"is 0, of which {given} is nothing: give (low, high)"
        scaled = [(value or 0.0) * np.array([1 - share, 1 + share]) for value in nominals]
        return [(float(a), float(b)) for a, b in scaled], ""
    try:
        low, high = (float(end) for end in given)
    except (TypeError, ValueError):
        return [], f"cannot be {given!r} ({allowed})"
    if not (np.isfinite([low, high]).all() and low < high):
        return [], f"cannot be {given!r} ({allowed}, low < high)"
    outside = [value for value in known if not low <= value <= high]
    if outside:
        return [], f"is nominally {outside[0]:.6g}, outside {low:g} to {high:g}"
    return [(low, high)] * len(nominals), ""
