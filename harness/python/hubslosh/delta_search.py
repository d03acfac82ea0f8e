"""Search for the smallest Δ that brings a sampled loop to the limit of stability.

Δ has the deviation δ of each uncertain parameter from its nominal value; ±1 is an end of the
parameter's range. The size of Δ is the largest |δ|.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .certificate import WorstCase, corners
from .fmu import FmuError
from .linearization import LinearModel
from .progress import Line, Progress
from .stability import _closed_matrix, _is_neutral, _may_be_neutral

if TYPE_CHECKING:
    from .loop import Loop
    from .uncertainty import UncertainModel

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

DRAWS = 500  # Number of random Δ that are tried in each box of Δ

# Magnitude of a pole above which the loop counts as unstable. It is a little above 1, because the
# undamped poles of uncontrollable modes are computed with rounding errors.
UNSTABLE = 1 + 1e-9

FIRST_STEP, LAST_STEP = 0.2, 2e-3  # Largest and smallest step of δ in a pattern search

SHRINK = (0.9, 1 - 3e-3)  # Ratios of the next to the present size of the box of Δ, tried in turn

TOGETHER = 64  # Number of Δ whose poles are computed together, so that the matrices fit the cache

# Number of points on the line from Δ = 0 to a corner, and on other lines, at which stability is
# tested.
CORNER_STEPS, LINE_STEPS = 8, 24


class DeltaSearch:
    """A search for the smallest Δ at which a loop around an uncertain model is unstable.

    Δ has the deviations of the uncertain parameters. The closed loop's matrices are computed for
    many Δ at once.
    """

    def __init__(
        self, model: "UncertainModel", loop: "Loop", K: LinearModel, progress: Progress = None
    ) -> None:
        self.model, self.loop, self.K = model, loop, K
        self.least = model._least
        """Lower bound of each δ."""
        self.damping = model._of_kind("zeta")
        self.frequencies = model._of_kind("frequency")
        self.centers = np.array([model.center.get(name, 0.0) for name in model.deltas])
        self.radii = np.array([
            float(model.spread.loc[name, name]) if name in model.spread.index else 1.0
            for name in model.deltas
        ])  # fmt: skip
        self.states = len(loop._gain(model.at(np.zeros(len(model.counts))), K).A)
        self.line = Line(progress)

    def poles(self, deltas: Matrix) -> Complex:
        """Return the poles of the closed loop for each Δ; a neutral pole is replaced by 0.

        The poles are NaN if the parameters at Δ are impossible, such as a negative mass.
        """
        parts = [deltas[k : k + TOGETHER] for k in range(0, len(deltas), TOGETHER)]
        return np.concatenate([self._poles(part) for part in parts])

    def _poles(self, deltas: Matrix) -> Complex:
        try:
            with np.errstate(all="ignore"):
                matrices = _closed_matrix(self.loop._gain(self.model._plants(deltas), self.K))
                found = np.linalg.eigvals(matrices).astype(complex)
        except (FmuError, np.linalg.LinAlgError):
            if len(deltas) > 1:
                return np.concatenate([self._poles(delta[None]) for delta in deltas])
            return np.full((1, self.states), np.nan, complex)
        for k in np.flatnonzero(_may_be_neutral(matrices, found, self.loop.period)):
            gain = self.loop._gain(self.model.at(deltas[k]), self.K)
            found[k, _is_neutral(gain, found[k])] = 0.0
        return found

    def radius(self, deltas: Matrix) -> Matrix:
        """Return the largest magnitude of the closed loop's poles for each Δ.

        It is -inf if the parameters at Δ are impossible, such as a negative mass.
        """
        if not len(deltas):
            return np.zeros(0)
        sizes = np.abs(self.poles(deltas)).max(axis=1, initial=0.0)
        return np.where(np.isnan(sizes), -np.inf, sizes)

    def say(self, best: WorstCase, share: float) -> None:
        """Show the smallest unstable size so far, and an estimate of the remaining time.

        ``share`` is the finished share of the work.
        """
        so_far = f"{best.size:.4g} times the ranges so far" if best.delta else "none so far"
        left = f", about {self.line.left(share):.0f} s left" if share > 0.05 else ""
        self.line.show(f"worst case: {so_far}{left}")

    def limits(self, ways: Matrix, largest: float, steps: int) -> list[WorstCase]:
        """Return the Δ at the limit of stability on lines from Δ = 0.

        Each row of ``ways`` is the direction of a line; its largest component is 1. Stability is
        tested at ``steps`` points of each line, up to the size ``largest``. Lines whose limit is
        larger than the limit on another line are left out.
        """
        sizes = np.linspace(0, largest, steps + 1)
        at = np.maximum(sizes[1:, None, None] * ways, self.least)
        radii = self.radius(at.reshape(-1, ways.shape[1])).reshape(steps, len(ways))
        # a line ends where no craft has the Δ
        ends = (radii > UNSTABLE) | (radii < 0)
        first = ends.argmax(axis=0)
        hit = radii[first, np.arange(len(ways))] > UNSTABLE
        low, high = sizes[first].copy(), sizes[first + 1].copy()
        kept = np.flatnonzero(hit)
        while kept.size and (high - low)[kept].max() > 1e-14 * largest:
            middle = (low + high)[kept] / 2
            beyond = self.radius(np.maximum(middle[:, None] * ways[kept], self.least)) > UNSTABLE
            high[kept[beyond]], low[kept[~beyond]] = middle[beyond], middle[~beyond]
            # drop lines whose limit is certainly larger than the limit on another line
            kept = kept[low[kept] <= high[kept].min()]
            if ((high - low)[kept] <= np.spacing(high[kept])).all():
                break
        return [self._case(np.maximum(high[k] * ways[k], self.least), float(high[k]))
                for k in kept]  # fmt: skip

    def _case(self, at: Matrix, size: float) -> WorstCase:
        poles = self.poles(at[None])[0]
        critical = poles[np.argmax(np.abs(poles))]
        named = dict(zip(self.model.deltas, at.tolist(), strict=True))
        frequency = abs(float(np.angle(critical))) / (2 * np.pi * self.loop.period)
        return WorstCase(named, size, frequency, self.model.values(at), self.model.tanks)

    def is_limit(self, delta: Matrix) -> bool:
        """Return True if the loop is unstable at Δ, but stable at a slightly smaller Δ."""
        inside, outside = self.radius(np.array([delta * (1 - 1e-6), delta * (1 + 1e-6)]))
        return bool(inside <= UNSTABLE < outside)

    def limit(self, delta: Matrix) -> WorstCase | None:
        """Return the limit of stability on the line from 0 to an unstable Δ; None if not found."""
        size = float(np.abs(delta).max())
        return min(
            self.limits(delta[None] / size, size, LINE_STEPS), key=attrgetter("size"), default=None
        )

    def worst(self, largest: float) -> WorstCase:
        """Return the smallest unstable Δ that is found; see `UncertainModel.worst_case`."""
        count = len(self.least)
        start = self.poles(np.zeros((1, count)))[0]
        if np.abs(start).max(initial=0.0) >= 1:
            raise FmuError(
                "the loop is unstable at Δ = 0, that is with nominal parameters: "
                "hubslosh.margins(loop) shows its margins"
            )
        best = min(self._followed(start, largest), key=attrgetter("size"), default=NOTHING)
        self.say(best, 0.1)
        found = self.limits(corners(count), min(best.size, largest), CORNER_STEPS)
        best = min([best, *found], key=attrgetter("size"))
        return self.smallest([self._drawn(min(best.size, largest))], best, largest)

    def _followed(self, start: Complex, largest: float) -> Iterator[WorstCase]:
        """Yield limits of stability that are found by following each lightly damped pole.

        ``start`` has the closed loop's poles (z plane) at Δ = 0. For each of them, every δ changes
        by the same amount, up to ``largest``, in the direction that increases the magnitude of the
        pole.
        """
        count, seen = len(self.least), set()
        light = start[(start.imag > 0) & (np.abs(start) > np.exp(-0.3 * np.abs(np.angle(start))))]
        steps = 1e-4 * np.vstack([np.eye(count), -np.eye(count)])
        for pole in light[np.argsort(-np.abs(light))]:
            here, follow = np.zeros(count), complex(pole)
            for _ in range(6):
                every = self.poles(here + steps)
                nearest = np.abs(every - follow).argmin(axis=1)
                sizes = np.abs(every[np.arange(len(every)), nearest])
                slopes = sizes[:count] - sizes[count:]
                size = np.abs(slopes).max(initial=0.0)
                way = np.where(np.abs(slopes) > 1e-6 * size, np.sign(slopes), 0.0)
                if tuple(way) in seen or not way.any():
                    break
                seen.add(tuple(way))
                found = self.limits(way[None], largest, LINE_STEPS)
                if not found:
                    break
                yield found[0]
                here = self.model.delta(found[0].delta)
                poles = self.poles(here[None])[0]
                follow = complex(poles[np.argmax(np.abs(poles))])

    def smallest(self, starts: Sequence[Matrix], best: WorstCase, largest: float) -> WorstCase:
        """Return the smallest unstable Δ that pattern searches in shrinking boxes find.

        The searches begin at ``starts``, at the smallest Δ so far, and at Δ at which frequencies
        are equal. If one of them finds an unstable Δ in the box, the box shrinks to the limit of
        stability on the line to this Δ.
        """
        shares = [*SHRINK] if best.delta else [1.0, *SHRINK]
        try:
            while shares:
                self.say(best, 0.3 if shares[0] == SHRINK[0] else 0.65)
                found = self._in_box(starts, best, shares[0] * min(best.size, largest))
                if found.size < best.size:
                    best = found
                elif best.delta:
                    del shares[0]
                else:
                    break
        finally:
            self.line.close()
        return best

    def _in_box(self, starts: Sequence[Matrix], best: WorstCase, box: float) -> WorstCase:
        """Search the box ``|δ| ≤ box`` for an unstable Δ.

        The search begins at ``starts`` and at ``best``, the smallest unstable Δ that is known. If
        it finds an unstable Δ, return the limit of stability on the line from 0 to this Δ.
        """
        known = [self.model.delta(best.delta)] if best.delta else []
        near = [at * min(1.0, box / np.abs(at).max(initial=box)) for at in (*known, *starts)]
        for group in (near, self._meetings(box)):
            at = self._climbed(group, box)
            if at is not None:
                return self.limit(at) or NOTHING
        return NOTHING

    def _drawn(self, size: float) -> Matrix:
        """Return the least stable of random Δ in the box ``|δ| ≤ size``.

        Half of the Δ have the smallest damping ratios. Random Δ can find a loop that is unstable
        only between the corners of the box.
        """
        rng = np.random.default_rng(1)
        at = rng.uniform(-size, size, (DRAWS, len(self.least)))
        at[1::2, self.damping] = -size
        at = np.maximum(at, self.least)
        found: Matrix = at[self.radius(at).argmax()]
        return found

    def _meetings(self, size: float) -> list[Matrix]:
        """Return Δ at which two uncertain frequencies are equal, if their ranges overlap.

        In the box ``|δ| ≤ size``, two modes of equal frequency and little damping can be unstable
        in only a thousandth of the ranges, which random Δ would miss. Each pair of frequencies
        gives three Δ, at frequencies that both modes can have. The damping ratios have their
        smallest values, and other parameters their nominal values.
        """
        at = np.zeros(len(self.least))
        at[self.damping] = -size
        found = []
        for i, j in combinations(self.frequencies, 2):
            (a, b), (c, d) = ((self.centers[k], self.radii[k]) for k in (i, j))
            low, high = max(a - b * size, c - d * size), min(a + b * size, c + d * size)
            for f in np.linspace(low, high, 3) if low < high else ():
                new = at.copy()
                new[[i, j]] = (f - a) / b, (f - c) / d
                found.append(np.maximum(new, self.least))
        return found

    def _climbed(self, starts: Sequence[Matrix], size: float) -> Matrix | None:
        """Return an unstable Δ in the box ``|δ| ≤ size``, or None.

        Pattern searches begin at each Δ in ``starts``. A search changes one δ at a time, or two
        frequencies by the same amount. It tries all these changes, then sums of the changes that
        make the loop less stable. All searches end as soon as one finds an unstable Δ.
        """
        if not len(starts):
            return None
        moves = list(np.eye(len(self.least)))
        for i, j in combinations(self.frequencies, 2):
            both = 1 / self.radii[[i, j]]
            moves.append(np.zeros(len(self.least)))
            moves[-1][[i, j]] = both / both.max()
        ways = np.vstack([moves, -np.array(moves)])
        low = np.maximum(-size, self.least)
        at = np.clip(np.array(starts), low, size)
        best, steps = self.radius(at), np.full(len(at), FIRST_STEP)
        while best.max() <= UNSTABLE and (active := np.flatnonzero(steps > LAST_STEP)).size:
            before = best.copy()
            singles: list[Matrix] = []
            for k in active:
                new = np.clip(at[k] + steps[k] * ways, low, size)
                singles.append(new[(new != at[k]).any(axis=1)])
            found = self._radii(singles)
            sums: list[Matrix] = []
            for k, new, sizes in zip(active, singles, found, strict=True):
                order = np.argsort(-sizes)
                good = new[order[sizes[order] > best[k]]] - at[k]
                sums.append(np.clip(at[k] + good.cumsum(axis=0)[1:], low, size))
            for k, *tried in zip(active, singles, found, sums, self._radii(sums), strict=True):
                new, sizes = np.vstack(tried[::2]), np.concatenate(tried[1::2])
                if len(new) and sizes.max() > best[k]:
                    best[k], at[k] = sizes.max(), new[sizes.argmax()]
            steps[best <= before + 1e-13] /= 2
        return at[best.argmax()] if best.max() > UNSTABLE else None

    def _radii(self, groups: list[Matrix]) -> list[Matrix]:
        """Return the largest magnitude of a closed-loop pole (z plane) for each Δ of each group."""
        ends = np.cumsum([len(group) for group in groups])[:-1]
        return np.split(self.radius(np.vstack(groups)), ends)


NOTHING = WorstCase({}, np.inf, np.nan, {})
