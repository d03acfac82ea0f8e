"""Design review of the control loop of a `Craft` over its fills: margins, slosh, worst case."""

import re
import warnings
from collections.abc import Container, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd

from .arguments import (
    MOST_FILLS,
    MOST_WORK,
    check_ranges,
    cores,
    parse_share,
    percent_of,
    range_ends,
    refuse,
)
from .fmu import Fmu, FmuError, FmuWarning, Parameters, Quantity
from .linearization import LinearModel
from .loop import Loop
from .operating_point import rotation
from .quantities import (
    DELAY,
    NO_MODE,
    ModeQuantity,
    Modes,
    full_names,
    mode_quantity,
    nominal_value,
    short_name,
    slosh_mass_error,
)
from .requirements import Requirement, judged, requirements_of
from .review_point import Point, Vector
from .sampling import draw
from .short import ShortTable
from .simulation import parameters_of
from .stabilisation import resonances
from .stability import margins_and_gain
from .suggestion import Suggestion, suggest
from .temporary import write_file
from .worst_case import Confirmation, confirm, search

if TYPE_CHECKING:
    from .craft import Craft, Fill

# Share by which damping ratios of appendages vary, because no formula predicts them.
ZETA_PART = 0.5

# Ways in which a slosh mode is stabilised, worst first.
SEVERITY = ("unstable", "neither", "phase", "gain", "gain and phase")


@dataclass(frozen=True)
class Uncertain:
    """An uncertain quantity of a review, with its range at each fill."""

    name: str
    """Name as given by the user, or a default: "inertia of craft", or "damping of" or "frequency
    of" with the name of a tank or appendage."""
    text: str
    """Range in words, such as "± 10%"."""
    ends: tuple[dict[str, tuple[float, float, float]], ...]
    """For each fill, low end, nominal value and high end of each parameter, by its full name; empty
    if the tank has no such slosh mode at this fill."""

    def values(self, fill: int, share: float) -> dict[str, float]:
        """Return the values of the parameters at one fill and one position in their ranges.

        ``fill`` is the index of the fill; ``share`` is -1 at the low end of the range, 0 at the
        nominal value and 1 at the high end.
        """
        return {
            name: nominal + abs(share) * ((high if share > 0 else low) - nominal)
            for name, (low, nominal, high) in self.ends[fill].items()
        }


@dataclass(frozen=True, eq=False, repr=False)
class Review:
    """Result of `Craft.review`; ``print`` shows the verdict and its reasons in at most 20 lines.

    Attributes
    ----------
    craft : Craft
        The craft that was reviewed.
    fills : tuple of str
        Fills in words, such as "50%" or "120 kg".
    at : ndarray, shape (n,)
        Fills as numbers, in ``unit``.
    unit : str
        Unit of ``at``: "%" of the volume, or "kg" of liquid.
    uncertain : tuple of Uncertain
        Uncertain quantities, each with its ``name``, its range as ``text`` and the ``ends`` of
        the range at each fill.
    family : tuple of LinearModel
        Linear model of the craft at each fill, from commands to measurements. All models have the
        same states; if a mode is missing at a fill, its rows and columns are zero.
    nominal : tuple of Point
        Nominal operating point at each fill, with its ``loop``, ``margins`` and loop ``gain``.
    points : DataFrame
        A row for each operating point. ``kind`` says how the point was chosen ("nominal", "one at
        a time", "draw" or "search"), and ``fill`` is the index of its fill. ``stable`` says
        whether the closed loop is stable. The margins are ``modulus_margin``, ``phase_margin``
        (deg), ``gain_up`` and ``gain_down`` (dB by which the gain may rise and fall) and
        ``delay_margin`` (s); they are NaN if the loop is unstable. ``growth`` (1/s) is the growth
        rate of the least stable pole of the closed loop. ``distance`` is the modulus margin or, if
        the loop is unstable, minus the growth rate. One further column for each uncertain quantity
        has its place in its range: -1 at the low end, 0 at the nominal value, 1 at the high end.
    slosh : DataFrame
        A row for each slosh mode that appears in the loop gain, at each fill and for each command,
        with the columns of `hubslosh.stabilisation.resonances`.
    worst : Point
        Operating point with the smallest ``distance``, found by a search.
    confirmation : Confirmation
        Simulation of the nonlinear FMU at the worst operating point.
    suggestion : Suggestion
        A notch or roll-off that raises the smallest margin, with its cost in phase.
    warnings : tuple of str
        Warnings about the tanks; a warning that applies to several fills is given for only one.
    limits : tuple of Requirement
        Required margins, as `requirements` judges them.

    Examples
    --------
    >>> import numpy as np
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
    >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
    >>> gains = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
    >>> limits = {"phase_margin": {"nominal": 40, "all": 30}, "gain_margin": 6}
    >>> review = craft.review(gains, 0.1, ["30%", "50%"], draws=5, requirements=limits)
    >>> review.passed, review.requirements()["passed"].tolist()
    (True, [True, True, True])
    >>> len(review.unstable()), review.modes()
    (0, {'main mode 1': 'gain- and phase-stabilised'})
    >>> review.stabilisation()
    ['main mode 1: gain- and phase-stabilised.']
    >>> review.bands()["phase_margin_low"].round().tolist()
    [59.0, 58.0]
    >>> list(review.worst_values())
    ['tank[1].zeta[1]', 'tank[1].frequency[1]', 'craft.Jxx', 'craft.Jyy', 'craft.Jzz']
    >>> review.save("review.html"), len(review.html()) > 100_000
    (None, True)
    """

    craft: "Craft"
    fills: tuple[str, ...]
    at: Vector
    unit: str
    uncertain: tuple[Uncertain, ...]
    family: tuple[LinearModel, ...]
    nominal: tuple[Point, ...]
    points: pd.DataFrame
    slosh: pd.DataFrame
    worst: Point
    confirmation: Confirmation
    suggestion: Suggestion
    warnings: tuple[str, ...] = field(default=())
    limits: tuple[Requirement, ...] = field(default=())

    def bands(self) -> pd.DataFrame:
        """Return the range of each margin at each fill, over all stable points.

        Returns
        -------
        DataFrame
            A row for each fill. ``fill`` is its index and ``at`` the fill in `unit`. ``points`` is
            the number of operating points at this fill, and ``unstable`` the number of unstable
            ones among them. For each margin of `points` the columns ``…_low``, ``…_nominal`` and
            ``…_high`` have the smallest, the nominal and the largest value over the stable points.
            They are NaN if no point is stable, and ``…_nominal`` is NaN if the nominal point is
            unstable.

        """
        names = ["modulus_margin", "phase_margin", "gain_up", "gain_down", "delay_margin"]
        groups = self.points.groupby("fill")
        table = pd.DataFrame({"fill": range(len(self.fills)), "at": self.at})
        table["points"] = groups.size()
        table["unstable"] = table["points"] - groups["stable"].sum()
        nominal = self.points[self.points["kind"] == "nominal"].set_index("fill")
        for name in names:
            table[f"{name}_low"] = groups[name].min()
            table[f"{name}_nominal"] = nominal[name]
            table[f"{name}_high"] = groups[name].max()
        return table

    def unstable(self) -> pd.DataFrame:
        """Return the unstable rows of `points`, sorted so that the fastest growth comes first.

        Returns
        -------
        DataFrame
            The rows of `points` at which the loop is unstable; an empty table if there are none.
        """
        rows = self.points[~self.points["stable"]]
        return rows.sort_values("growth", ascending=False, kind="stable")

    def requirements(self) -> pd.DataFrame:
        """Return the verdict on each requirement, failed requirements first.

        Returns
        -------
        DataFrame
            A row for each requirement. ``requirement`` is the requirement in words, and ``passed``
            is true if it is met. ``least`` is the smallest margin over all operating points to
            which the requirement applies (-inf if a point is unstable), and ``fill`` the index of
            the fill with this margin. ``points`` is the number of operating points to which the
            requirement applies, and ``failing`` the number of operating points that fail; an
            unstable point always fails.
        """
        return judged(self.limits, self.points)

    @property
    def passed(self) -> bool:
        """True if every point is stable and every requirement is met."""
        return bool(self.points["stable"].all() and self.requirements()["passed"].all())

    def modes(self) -> dict[str, str]:
        """Return how each slosh mode is stabilised, in words, by the name of the mode.

        Unstable modes come first. At each fill, the verdict is the worst verdict over all commands.

        Returns
        -------
        dict of str to str
            For example ``{"main mode 1": "phase-stabilised"}``.
        """
        found = []
        for mode, rows in self.slosh.groupby("mode", sort=False):
            verdicts: dict[str, list[int]] = {}
            for fill, of in rows.groupby("fill"):
                worst = min(of["stabilised"], key=SEVERITY.index)
                verdicts.setdefault(worst, []).append(int(fill))
            hows = sorted(verdicts, key=SEVERITY.index)
            if len(hows) == 1 and (hows[0] != "unstable" or len(self.fills) == 1):
                words = _verdict(hows[0])
            else:
                words = ", ".join(f"{_verdict(how)} at {self._fill_text(verdicts[how])}"
                                  for how in hows)  # fmt: skip
            found.append((SEVERITY.index(hows[0]), str(mode), words))
        return {mode: words for _, mode, words in sorted(found, key=lambda row: row[0])}

    def _fill_text(self, fills: Sequence[int]) -> str:
        """Return fills in words; successive fills are joined, such as "5% to 35%".

        ``fills`` are the numbers of the fills in the review.
        """
        spans: list[list[int]] = []
        for fill in fills:
            if spans and fill == spans[-1][-1] + 1:
                spans[-1].append(fill)
            else:
                spans.append([fill])
        words = [
            self.fills[of[0]] + (f" to {self.fills[of[-1]]}" if len(of) > 1 else "") for of in spans
        ]
        return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)

    def stabilisation(self) -> list[str]:
        """Return a sentence for each kind of stabilisation, with the modes of this kind.

        For example, one sentence names all modes that are gain-stabilised.

        Returns
        -------
        list of str
            Sentences, unstable modes first.
        """
        modes: dict[str, list[str]] = {}
        for mode, how in self.modes().items():
            modes.setdefault(how, []).append(mode)
        others = (self.points["kind"] != "nominal") & ~self.points["stable"]
        where = " (nominal points)" if others.any() else ""
        return [f"{', '.join(of)}: {how}{where}." for how, of in modes.items()]

    @property
    def summary(self) -> str:
        """Two sentences: whether every operating point is stable, and which requirements fail."""
        return " ".join([self._stable_points() + self._neutral(), *self._failures()])

    def _failures(self) -> list[str]:
        """Return a sentence about the requirements that fail; empty if none fails."""
        table = self.requirements()
        failed = table[~table["passed"]]
        if table.empty:
            return []
        if failed.empty:
            return [f"It meets {_all_of(len(table), 'requirement')}."]
        words = []
        for row in failed.itertuples():
            unit = next(limit.unit for limit in self.limits if str(limit) == row.requirement)
            least = f"{row.least:.3g}{unit}" if np.isfinite(row.least) else "unstable"
            words.append(f"{row.requirement} ({least} at fill {self.fills[row.fill]})")
        return [
            f"It FAILS {len(failed)} of {_plural(len(table), 'requirement')}: {'; '.join(words)}."
        ]

    def _neutral(self) -> str:
        """Return a sentence on neutral poles of nominal points, or an empty string if none."""
        fills = [k for k, point in enumerate(self.nominal) if len(point.margins.neutral)]
        if not fills:
            return ""
        most = max(len(self.nominal[k].margins.neutral) for k in fills)
        return (
            f" {_plural(most, 'pole')} at {self._fill_text(fills)} {'is' if most == 1 else 'are'} "
            "neutral, which counts as stable: the controller does not move "
            f"{'this pole' if most == 1 else 'these poles'} (an attitude without feedback, or an "
            "axis without gain)."
        )

    def _stable_points(self) -> str:
        table = self.points
        unstable = table[~table["stable"]]
        count, all_of = _plural(len(self.fills), "fill"), _all_of(len(self.fills), "fill")
        points = _plural(len(table), "point")
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
        """Return the parameters that differ from their nominal values at the worst point.

        Returns
        -------
        dict of str to float
            Values in SI units by the names of the FMU's parameters.
        """
        found: dict[str, float] = {}
        for quantity, share in zip(self.uncertain, self.worst.shares, strict=True):
            if share:
                found |= quantity.values(self.worst.fill, float(share))
        return found

    def _describe(self, point: Point) -> str:
        """Return the fill of a point and its quantities that are not nominal, in words."""
        words = [f"fill {self.fills[point.fill]}"]
        for quantity, share in zip(self.uncertain, point.shares, strict=True):
            values = quantity.values(point.fill, float(share)) if share else {}
            if quantity.name.startswith(("frequency of", "inertia of")) and values:
                name, value = next(iter(values.items()))
                change = value / quantity.ends[point.fill][name][1] - 1
                words.append(f"{quantity.name} {100 * change:+.3g} %")
            else:
                words += [
                    f"{short_name(name, point.loop.tanks)} = {value:.4g}"
                    for name, value in values.items()
                ]
        return ", ".join(words)

    def html(self) -> str:
        """Return the report as a page with verdict, figures and tables; needs matplotlib.

        Returns
        -------
        str
            HTML that refers to no other files, so that it can be read without a network.
        """
        from .review_page import page

        return page(self)

    def save(self, path: str | Path) -> None:
        """Write the report as a page; needs matplotlib.

        Parameters
        ----------
        path : str or Path
            File to write, .html.

        Raises
        ------
        FmuError
            If the name does not end in .html, or the file cannot be written.
        """
        write_file(path, ".html", self.html)

    def __str__(self) -> str:
        table = self.points
        lines = [self.summary, *self.stabilisation()[:8]]
        stable = table[table["stable"]]
        if len(stable) < len(table):
            first = self.unstable().iloc[0]
            lines.append(
                f"unstable: {len(table) - len(stable)} of {_plural(len(table), 'point')}, fastest "
                f"{first['growth']:.3g} 1/s at fill {self.fills[int(first['fill'])]}"
            )
        for name, unit in (("phase_margin", "°"), ("gain_up", " dB"), ("delay_margin", " s")):
            low, high = stable[name].min(), stable[name].max()
            of = "" if len(stable) == len(table) else " of stable points"
            if len(stable):
                lines.append(f"{name.replace('_', ' ')}{of}: {low:.3g} to {high:.3g}{unit}")
        lines += [f"worst case: {self._describe(self.worst)}", f"there {self.confirmation.summary}"]
        lines.append(self.suggestion.text)
        if self.uncertain:
            lines += ["uncertain: " + "; ".join(f"{u.name} {u.text}" for u in self.uncertain)]
        if self.warnings:
            lines.append(f"{_plural(len(self.warnings), 'warning')}, see .warnings")
        return "\n".join(line if len(line) < 500 else f"{line[:499]}…" for line in lines)

    def __repr__(self) -> str:
        return f"Review({self.summary})"


def _plural(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def _all_of(number: int, what: str) -> str:
    return ("all " if number > 1 else "") + _plural(number, what)


def _verdict(how: str) -> str:
    words = {"unstable": "unstable", "neither": "stabilised by neither gain nor phase"}
    return words.get(how, f"{how.replace(' and', '- and')}-stabilised")


def review(
    craft: "Craft",
    controller: Any,
    period: float,
    fills: "Sequence[Fill]",
    *,
    damping: Literal["interval", "nominal"],
    frequency: str,
    inertia: str,
    uncertain: Mapping[str, Any] | None,
    requirements: Mapping[str, Any] | None,
    draws: int,
    seed: int,
    parameters: Parameters | None = None,
    **options: Any,
) -> Review:
    """Return the review of a loop; see `Craft.review`."""
    check_ranges(draws=draws, seed=seed, period=period)
    limits = requirements_of(requirements)
    shares = {"frequency": frequency, "inertia": inertia}
    space = _Space.create(
        craft, controller, period, fills, damping, shares, uncertain, parameters, options
    )
    count = len(space.uncertain)
    _check_work(len(space.loops) * (1 + 2 * count) + draws, space.loops[0])
    none = np.zeros(count)
    planned = [("nominal", k, none) for k in range(len(space.loops))]
    ends = [sign * row + 0.0 for row in np.eye(count) for sign in (-1.0, 1.0)]  # no -0
    planned += [("one at a time", k, x) for k in range(len(space.loops)) for x in ends]
    if count:
        ranges = {u.name: (-1.0, 1.0) for u in space.uncertain}
        for run in range(int(draws)):
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
        suggest(nominal, every, table), space.warnings, limits,
    )  # fmt: skip


def row_of(point: Point, uncertain: Iterable[Uncertain]) -> dict[str, Any]:
    """Return one row of the table `Review.points`: the values and margins of a point."""
    found = point.margins
    down, up = found.gain_margins
    margins = {
        "modulus_margin": found.modulus_margin, "phase_margin": found.phase_margin, "gain_up": up,
        "gain_down": down, "delay_margin": found.delay_margin,
    }  # fmt: skip
    if not found.stable:
        margins = dict.fromkeys(margins, np.nan)
    return {"fill": point.fill, "stable": found.stable} | margins | {
        "growth": point.growth, "distance": point.distance,
    } | {u.name: x for u, x in zip(uncertain, point.shares, strict=True)}  # fmt: skip


def _family(points: Sequence[Point]) -> tuple[LinearModel, ...]:
    """Return the linear models of the craft at all points, all with the same states.

    The states are all states that any of the models has, in the FMU's order. If a model lacks one
    of these states, its rows and columns are zeros.
    """
    models = []
    used: set[str] = set()
    for point in points:
        used |= set(point.loop.plant().states)
        models.append(point.loop._plant({}, all_states=True))
    keep = [i for i, name in enumerate(models[0].states) if name in used]
    names = tuple(models[0].states[i] for i in keep)
    return tuple(
        replace(m, A=m.A[np.ix_(keep, keep)], B=m.B[keep], C=m.C[:, keep], states=names)
        for m in models
    )


def _check_work(points: int, loop: Loop) -> None:
    """Raise FmuError if the review of ``points`` operating points would take hours."""
    states = len(loop.gain().A)
    if points * states**3 > MOST_WORK:
        raise FmuError(
            f"the review has {points} points of {states} states, which would take hours (allowed: "
            f"{MOST_WORK / states**3:.0f} points of this size): give fewer fills, quantities or "
            "draws, a shorter delay, or a longer period"
        )


@dataclass(frozen=True, eq=False)
class _Space:
    """The operating points of a review: its fills, and uncertain quantities with ranges."""

    craft: "Craft"
    names: tuple[str, ...]
    at: Vector
    unit: str
    loops: tuple[Loop, ...]
    given: tuple[tuple[dict[str, Quantity], dict[str, Quantity]], ...]
    """Untrimmed parameters and given quantities of slosh modes at each fill."""
    uncertain: tuple[Uncertain, ...]
    warnings: tuple[str, ...]

    @classmethod
    def create(
        cls,
        craft: "Craft",
        controller: Any,
        period: float,
        fills: Any,
        damping: str,
        shares: dict[str, Any],
        uncertain: Any,
        parameters: Parameters | None,
        options: dict[str, Any],
    ) -> "_Space":
        """Check the arguments of a review, compute its tanks, and return the space of points."""
        fills = _list_of(fills)
        if damping not in ("interval", "nominal"):
            raise FmuError(f'damping must be "interval" or "nominal", not {damping!r}')
        Loop(
            controller, period, craft.model, wheels=craft.wheels, **options
        )._must_be_linear()  # raise an error before the time-consuming computation of the tanks
        loops, tanks, given, problems, turns = [], [], [], [], ""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with suppress(FmuError):  # the loop below raises the error with the fill
                craft.solve(fills)
            for k, fill in enumerate(fills):
                try:
                    loop = craft.loop(controller, period, fill, parameters=parameters, **options)
                    every, modes, _ = craft._resolve(fill, parameters)
                    loops.append(loop)
                    given.append((every, modes))
                    tanks.append(craft.tank_at(fill))
                except FmuError as error:
                    problems.append(f"fills[{k}] = {fill!r}: {error}" if loops else str(error))
                    break
                if not turns:
                    turns = rotation(
                        "the nominal point", craft.trim(fill, parameters).angular_acceleration
                    )
        refuse(problems)
        said = tuple(dict.fromkeys([*(str(w.message) for w in caught), *filter(None, [turns])]))
        # report a warning only once if it differs between fills only in its numbers
        said = tuple({re.sub(r"= [\d.e+-]+", "", text): text for text in said}.values())
        for text in said:
            warnings.warn(text, FmuWarning, stacklevel=4)
        ranges = _full_ranges(craft, uncertain or {})
        # a damping ratio that is given does not vary over the interval of the formula
        known = full_names(parameters_of(parameters), Fmu.open(craft.model), craft._names)
        known |= dict.fromkeys(ranges, 0.0)
        points = [every for every, _ in given]
        found = []
        if damping == "interval":
            found += _damping(craft, tanks, known)
            found += _of_appendages(craft, points, "zeta", ZETA_PART, known)
        parts = {name: _part(share, name) for name, share in shares.items()}
        found += _frequencies(craft, loops, parts["frequency"], ranges)
        found += _of_appendages(craft, points, "frequency", parts["frequency"], ranges)
        found += _inertia(points, parts["inertia"], ranges)
        found += _quantities(loops, points, ranges, craft._names)
        at = [percent_of(fill) for fill in fills]
        percent = None not in at
        if not percent:
            at = [sum(tank.mass for tank in of.values()) for of in tanks]
        unit = "%" if percent else "kg"
        words = tuple(f"{x:.3g}%" if percent else f"{x:.4g} kg" for x in at)
        return cls(craft, words, np.array(at), unit, tuple(loops), tuple(given), tuple(found), said)

    def point(self, fill: int, shares: Vector) -> Point:
        """Compute the operating point at one fill.

        ``fill`` is the index of the fill. ``shares`` has the position of each uncertain quantity in
        its range, as in `Uncertain.values`.
        """
        loop, (every, modes) = self.loops[fill], self.given[fill]
        plain: dict[str, Any] = {}
        factors: dict[str, float] = {}
        modes = dict(modes)
        for quantity, share in zip(self.uncertain, shares, strict=True):
            for name, value in quantity.values(fill, float(share)).items() if share else ():
                mode = mode_quantity(name)
                if mode is None:
                    plain[name] = value
                elif mode.kind == "frequency":  # as a factor, because the mass may change it, too
                    factors[name] = value / quantity.ends[fill][name][1]
                else:
                    modes[name] = value
        late = plain.pop(DELAY, loop.delay)
        there = self.craft._realised(every | plain, modes, factors)
        loop = replace(loop, model=there.model, parameters=there.parameters, delay=late)
        margins, gain = margins_and_gain(loop)
        return Point(fill, np.array(shares, float), loop, margins, gain)

    def evaluate(self, which: Iterable[tuple[int, Vector]]) -> list[Point]:
        """Compute operating points on all cores; each is given by the arguments of `point`."""
        with warnings.catch_warnings(), ThreadPoolExecutor(cores()) as pool:
            warnings.simplefilter("ignore", FmuWarning)  # `create` has issued them already
            return list(pool.map(lambda job: self.point(*job), which))


def _list_of(fills: Any) -> list[Any]:
    if isinstance(fills, str | Mapping) or not hasattr(fills, "__iter__"):
        raise FmuError(f'fills must be a list, such as ["10%", "50%", "90%"], not {fills!r}')
    found = list(fills)
    if not found:
        raise FmuError('fills is empty: give at least one fill, such as ["50%"]')
    if len(found) > MOST_FILLS:
        raise FmuError(f"fills has {len(found)} fills (allowed: {MOST_FILLS})")
    return found


def _full_ranges(craft: "Craft", given: Any) -> dict[str, tuple[str, Any]]:
    """Return the user's ranges by the full name of each quantity in the FMU.

    Each entry has the name as the user wrote it and the range.
    """
    if not isinstance(given, Mapping):
        raise FmuError(f'uncertain must be ranges by name, such as {{"craft.mass": (1380, 1420)}}, '
                       f"not {given!r}")  # fmt: skip
    full = full_names(given, Fmu.open(craft.model), craft._names)
    return dict(zip(full, ((str(name), range_) for name, range_ in given.items()), strict=True))


def _damping(craft: "Craft", tanks: list[dict[str, Any]], given: Container[str]) -> list[Uncertain]:
    """Return the range of the damping of each tank, over which all its modes vary together.

    The reason is that one correlation gives the damping of all modes of a tank. ``tanks`` has the
    solved tanks at each fill by name. ``given`` has the full names of quantities for which the user
    gives a value or a range; they are left out.
    """
    found, known = [], False
    for number, name in enumerate(craft.tanks, 1):
        tables = [of[name].modes if name in of else None for of in tanks]
        ends: list[dict[str, tuple[float, float, float]]] = []
        for table in tables:
            rows = []
            if table is not None and "zeta_low" in table:
                rows = table[["zeta_low", "zeta", "zeta_high"]].to_numpy().tolist()
            known |= bool(rows)
            here = {f"tank[{number}].zeta[{n}]": tuple(row) for n, row in enumerate(rows, 1)}
            ends.append({name: row for name, row in here.items() if name not in given})
        if any(ends):
            found.append(Uncertain(f"damping of {name}", "over its interval", tuple(ends)))
    if craft.tanks and not known:
        raise FmuError(
            'damping="interval" needs the viscosity of a liquid: MountedTank(…, nu=…), m²/s; '
            'damping="nominal" does not vary damping ratios'
        )
    return found


def _part(given: Any, what: str) -> float:
    """Return the share by which a quantity varies, such as 0.1 for "10%"; 0 for "nominal".

    ``what`` is the argument's name in the error message.
    """
    part = 0.0 if given == "nominal" else parse_share(given)
    if part is None or part >= 1:
        raise FmuError(
            f'{what} must be a share of the nominal value, such as "10%", or "nominal", not '
            f"{given!r}"
        )
    return part


def _scaled(part: float, values: Mapping[str, float]) -> dict[str, tuple[float, float, float]]:
    return {name: ((1 - part) * x, x, (1 + part) * x) for name, x in values.items()}


def _frequencies(
    craft: "Craft", loops: Sequence[Loop], part: float, ranges: Mapping[str, Any]
) -> list[Uncertain]:
    """Return the range of the slosh frequencies of each tank, whose modes vary together.

    They vary by the share ``part``. ``loops`` has the loop at each fill. Frequencies in ``ranges``
    are left out, because the user gives their ranges.
    """
    found = []
    for number, name in enumerate(craft.tanks if part else (), 1):
        ends = []
        for loop in loops:
            modes = Modes(loop.model, loop.parameters)  # type: ignore[arg-type]
            every = [ModeQuantity(number, "frequency", n) for n in (1, 2, 3)]
            every = [mode for mode in every if mode.name("frequency") not in ranges]
            here = {
                mode.name("frequency"): modes.value(mode)
                for mode in every
                if not modes.problem(mode)
            }
            ends.append(_scaled(part, here))
        if any(ends):
            found.append(Uncertain(f"frequency of {name}", f"± {100 * part:g}%", tuple(ends)))
    return found


def _of_appendages(
    craft: "Craft", given: Sequence[Parameters], kind: str, part: float, known: Container[str]
) -> list[Uncertain]:
    """Return the range of frequency or damping of each appendage, whose modes vary together.

    ``kind`` is "frequency" or "zeta", ``part`` the share by which it varies, and ``given`` the
    parameters at each fill. ``known`` has the full names of quantities for which the user gives a
    value or a range; they are left out.
    """
    found, words = [], {"frequency": "frequency of", "zeta": "damping of"}[kind]
    for name in craft.appendages if part else ():
        owners = enumerate(craft._names.appendages, 1)
        full = [f"appendage[{j}].{kind}" for j, owner in owners if owner == name]
        full = [of for of in full if of not in known]
        ends = tuple(
            _scaled(part, {of: float(every[of]) for of in full})  # type: ignore[arg-type]
            for every in given
        )
        if full:
            found.append(Uncertain(f"{words} {name}", f"± {100 * part:g}%", ends))
    return found


def _inertia(
    given: Sequence[Parameters], part: float, ranges: Mapping[str, Any]
) -> list[Uncertain]:
    """Return the range of the dry craft's inertia, which varies by the share ``part``.

    ``given`` has the parameters at each fill. The result is empty if the user varies a component of
    the inertia, which is then in ``ranges``.
    """
    names = [f"craft.J{axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]
    if not part or any(name in ranges for name in names):
        return []
    ends = tuple(
        _scaled(part, {name: float(every[name]) for name in names if every.get(name)})  # type: ignore[arg-type]
        for every in given
    )
    return [Uncertain("inertia of craft", f"± {100 * part:g}%", ends)]


def _quantities(
    loops: Sequence[Loop],
    given: Sequence[Parameters],
    ranges: Mapping[str, tuple[str, Any]],
    tanks: Iterable[str],
) -> list[Uncertain]:
    """Return the quantities whose ranges the user gives.

    The keys of ``ranges`` are full names; each entry has the user's name and the range. ``loops``
    and ``given`` have the loop and the untrimmed parameters at each fill; ``tanks`` are names for
    messages.
    """
    fmu = Fmu.open(loops[0].model)
    allowed = [DELAY]
    allowed += [n for n in fmu.names("parameter", "structuralParameter") if fmu.kind(n) == "Real"]
    known = Modes(loops[0].model, loops[0].parameters)  # type: ignore[arg-type]
    problems, found = [], []
    for full, (name, range_) in ranges.items():
        shown = short_name(full, tanks)
        if instead := slosh_mass_error(full):
            problems.append(f"uncertain: {shown} {instead}")
            continue
        if mode_quantity(full) is None and full not in allowed:
            problems.append(
                f"uncertain has {shown}, which is neither a Real parameter of {fmu.name} nor delay"
            )
            continue
        bad = known.problem(mode) if (mode := mode_quantity(full)) else ""
        if bad not in ("", NO_MODE):
            problems.append(f"uncertain: {shown} {bad}")
            continue
        nominals = [_nominal(loop, every, full) for loop, every in zip(loops, given, strict=True)]
        limits, problem = _ends(range_, nominals)
        if problem:
            problems.append(f"uncertain: {shown} {problem}")
            continue
        if isinstance(range_, str):
            text = f"± {range_.strip().lstrip('±').strip()}"
        else:
            text = f"{float(range_[0]):g} to {float(range_[1]):g} {_unit(fmu, full)}".rstrip()
        rows = tuple(
            {} if nominal is None else {full: (low, nominal, high)}
            for (low, high), nominal in zip(limits, nominals, strict=True)
        )
        found.append(Uncertain(name, text, rows))
    refuse(problems)
    return found


def _unit(fmu: Fmu, name: str) -> str:
    if mode := mode_quantity(name):
        return {"frequency": "Hz", "zeta": "", "mass": "kg", "bob": "m"}[mode.kind]
    return "s" if name == DELAY else fmu.unit(name).replace("1", "").replace(".", "·")


def _nominal(loop: Loop, untrimmed: Parameters, name: str) -> float | None:
    """Return the nominal value of the quantity ``name``, or None if its mode does not exist.

    ``loop`` is the loop at one fill, and ``untrimmed`` has the parameters before the craft is
    trimmed.
    """
    if name == DELAY:
        return float(loop.delay)
    return nominal_value(Modes(loop.model, loop.parameters), untrimmed, name)  # type: ignore[arg-type]


Ends = list[tuple[float, float]]


def _ends(given: Any, nominals: list[float | None]) -> tuple[Ends, str]:
    """Return (low, high) of the range ``given`` at each fill, and an empty text.

    ``nominals`` has the nominal value at each fill. If the range is wrong, the text is the rest of
    an error sentence.
    """
    known = [value for value in nominals if value is not None]
    if not known:
        return [], NO_MODE
    try:
        found = [range_ends(given, known[0] if value is None else value) for value in nominals]
    except ValueError as error:
        return [], str(error)
    low, high = found[0]
    if not isinstance(given, str) and (outside := [x for x in known if not low <= x <= high]):
        return [], f"is nominally {outside[0]:.6g}, outside {low:g} to {high:g}"
    return found, ""
