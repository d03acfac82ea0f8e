"""Suggestion of a notch or roll-off filter by a design review, with the phase that it costs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .linearization import LinearModel
from .loop import _tustin
from .stability import _compiled, _largest, _moved, frequencies

if TYPE_CHECKING:
    from .review_point import Point

LARGEST_PHASE_LOSS = 15.0  # Largest loss of phase at the rigid-body crossover that is accepted, deg

WORTH = 0.02  # Smallest increase of the modulus margin for which a filter is suggested

WORST = 5  # Number of worst points at which filters are tested, in addition to the nominal points


@dataclass(frozen=True, eq=False)
class Suggestion:
    """The notch or roll-off filter that increases the smallest modulus margin most, if any."""

    text: str
    """Suggestion in one sentence."""
    filter: LinearModel | None
    """Sampled filter for one command; None if no filter increases the margin enough."""
    controller: LinearModel | None
    """Sampled controller with this filter on each command."""
    before: float
    """Smallest `distance` of the tested points without the filter; see `Review.points`."""
    after: float
    """Smallest `distance` of the tested points with the filter."""
    cost: float
    """Loss of phase by the filter at the rigid-body crossover, deg; the largest of all commands."""


def suggest(
    nominal: "Sequence[Point]", every: "Sequence[Point]", slosh: pd.DataFrame
) -> Suggestion:
    """Try notches at the slosh mode with the highest peak, and roll-offs, and return the best.

    A filter is judged by the smallest modulus margin over the points ``nominal`` and the worst
    points of ``every``. Filters that cost too much phase at the rigid-body crossover are left out.
    ``slosh`` is the table of slosh modes in the loop.
    """
    worst = sorted(every, key=lambda point: point.distance)[:WORST]
    points = list({id(point): point for point in [*nominal, *worst]}.values())
    grids = [_sampled(point) for point in points]
    before = min(point.distance for point in points)
    loop = nominal[0].loop
    rigid = pd.concat([point.margins.crossings for point in nominal])
    rigid = rigid[(rigid["crossing"] == "gain") & (rigid["near"] == "")]
    best = None
    for words, law in _candidates(slosh, rigid["frequency"], loop.period):
        at = np.exp(2j * np.pi * rigid["frequency"].to_numpy() * loop.period)
        cost = float(-np.degrees(np.angle(law._at(at)[:, 0, 0])).min(initial=0.0))
        if cost > LARGEST_PHASE_LOSS:
            continue
        after = min(_distance(p, w, L, law) for p, (w, L) in zip(points, grids, strict=True))
        if best is None or after > best[0] + 1e-3 or (after > best[0] - 1e-3 and cost < best[1]):
            best = (after, cost, words, law)
    controller = loop.linear()
    if best is None or best[0] < before + WORTH or controller is None:
        text = (
            f"No notch or roll-off that was tried raises the smallest modulus margin by {WORTH:g} "
            f"and costs at most {LARGEST_PHASE_LOSS:.0f}° of phase at the rigid crossover."
        )
        return Suggestion(text, None, None, before, before, 0.0)
    after, cost, words, law = best
    if before > 0:
        change = f"raises the smallest modulus margin from {before:.2f} to {after:.2f}"
    elif after > 0:
        change = f"stabilises every point tried (modulus margin {after:.2f})"
    else:
        change = f"slows the growth from {-before:.2g} to {-after:.2g} 1/s"
    text = (
        f"{words} on each command {change}; it costs {cost:.1f}° of phase at the rigid crossover."
    )
    return Suggestion(text, law, _series(controller, law), before, after, cost)


def _candidates(
    slosh: pd.DataFrame, rigid: "pd.Series[float]", period: float
) -> list[tuple[str, LinearModel]]:
    """Return candidate filters, each with its description, for one slosh mode.

    The filters are placed at an unstable slosh mode or, if all modes are stable, at the mode with
    the largest loop gain. ``slosh`` is the table of slosh modes in the loop, ``rigid`` has the
    frequencies (Hz) at which the loop gain without slosh crosses 0 dB, and ``period`` is the
    sampling period, s.
    """
    if slosh.empty:
        return []
    unstable = slosh["stabilised"] == "unstable"
    shown = slosh[unstable] if unstable.any() else slosh
    mode = shown.loc[shown["peak"].idxmax(), "mode"]
    f = float(slosh.loc[slosh["mode"] == mode, "frequency"].mean())
    found = []
    for zeta in (0.3, 0.6, 1.0):
        for depth in (6, 12, 20):
            words = f"A notch at {f:.3g} Hz ({depth} dB deep, damping ratio {zeta:g})"
            found.append((words, _second_order(f, zeta, period, 10 ** (-depth / 20))))
    crossover = rigid.max() if len(rigid) else 0.0
    for share in (0.35, 0.5, 0.7, 1.0, 1.5):
        if share * f > crossover:
            words = f"A second-order roll-off at {share * f:.3g} Hz (damping ratio 0.7)"
            found.append((words, _second_order(share * f, 0.7, period, None)))
    return [(words, law) for words, law in found if 2 * f * period < 0.9]


def _second_order(f: float, zeta: float, period: float, notch: float | None) -> LinearModel:
    """Return the low-pass w²/(s² + 2 ζ w s + w²), or a notch with this denominator, sampled.

    ``f`` is the frequency w in Hz, ``zeta`` is ζ, and ``notch`` is the gain of the notch at ``f``,
    or None for the low-pass. Sampling with ``period`` (s) is by Tustin's rule, prewarped at ``f``.
    """
    w = 2 / period * np.tan(np.pi * f * period)
    A, B = np.array([[0.0, 1.0], [-w * w, -2 * zeta * w]]), np.array([[0.0], [1.0]])
    if notch is None:
        C, D = np.array([[w * w, 0.0]]), np.zeros((1, 1))
    else:
        C, D = np.array([[0.0, -2 * zeta * w * (1 - notch)]]), np.ones((1, 1))
    return _tustin(LinearModel(A, B, C, D, ("f[1]", "f[2]"), ("u",), ("y",)), period)


def _series(first: LinearModel, law: LinearModel) -> LinearModel:
    """Return the controller ``law`` with the filter ``first`` on each of its outputs."""
    count = len(first.D)
    matrices = [np.kron(np.eye(count), matrix) for matrix in law]
    states = tuple(f"filter[{i + 1}]" for i in range(len(matrices[0])))
    return first._then(LinearModel(*matrices, states, first.outputs, first.outputs), "")


def _sampled(point: "Point") -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return points z on the unit circle, and the matrix of the loop gain at each of them."""
    high = 0.5 / point.loop.period
    f = frequencies(point.gain, high / 1e4, high)
    count = len(point.gain.D)
    values = np.array(_compiled(point.gain).response(2 * np.pi * f)).view(complex)
    return np.exp(2j * np.pi * f * point.loop.period), values.reshape(-1, count, count)


def _distance(
    point: "Point", z: NDArray[np.complex128], L: NDArray[np.complex128], law: LinearModel
) -> float:
    """Return the modulus margin with the filter ``law`` in the loop; negative if unstable.

    ``point`` is the operating point; ``L`` is the loop gain without the filter at the points ``z``.
    """
    size = _largest(_moved(_series(point.gain, law)), point.gain.period)
    if size >= 1:
        return -float(np.log(size) / point.loop.period)
    sensitivity = np.linalg.inv(np.eye(L.shape[1]) + law._at(z) * L)
    return float(1 / np.abs(np.diagonal(sensitivity, axis1=1, axis2=2)).max())
