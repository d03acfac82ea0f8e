"""Loop gains in Bode, Nichols and Nyquist diagrams, for `plot` and the page of a review."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .stability import _compiled, band, frequencies

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from .linearization import LinearModel

DEEPEST, HIGHEST = -80.0, 60.0  # Widest range of loop gain that a diagram shows, dB

AROUND = 1.3  # Ratio of a diagram's range in dB to the largest gain margin that it shows

# Largest change of the loop gain's logarithm between neighbouring points, 0.12 rad or 1 dB; where
# the loop gain changes more, frequencies are inserted.
TURN = 0.12

ODD = (-900, -540, -180, 180)  # Phases at which the loop gain is real and negative, deg

# Circle of the loop gains at the distance 0.5 from -1, the usual requirement of a modulus margin.
CIRCLE = -1 + 0.5 * np.exp(1j * np.linspace(0, 2 * np.pi, 200))


@dataclass(frozen=True, eq=False)
class Curve:
    """Curve of the loop gain of one command, with the loops of the other commands closed."""

    name: str
    color: str
    frequency: NDArray[np.float64]
    """Hz"""
    gain: NDArray[np.complex128]
    line: str = "-"

    @property
    def decibels(self) -> NDArray[np.float64]:
        """Magnitude, dB."""
        with np.errstate(divide="ignore"):
            return 20 * np.log10(np.abs(self.gain))

    @property
    def phase(self) -> NDArray[np.float64]:
        """Unwrapped phase, deg.

        It is shifted by a multiple of 360° so that it lies between -360° and 0° at the highest
        frequency at which the gain is above 0 dB.
        """
        phase = np.degrees(np.unwrap(np.angle(self.gain)))
        above = np.flatnonzero(np.abs(self.gain) >= 1)
        return phase - 360 * (np.floor(phase[above[-1] if len(above) else 0] / 360) + 1)

    def draw(self, ax: "Axes", x: Any, y: Any, width: float = 1.0) -> None:
        """Draw the curve with its name, colour and line."""
        ax.plot(x, y, self.line, color=self.color, label=self.name, linewidth=width)


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of several loop gains in one diagram."""

    every: tuple[Curve, ...]
    range: tuple[float, float]
    """Range of loop gain that the diagrams show, dB."""

    @property
    def phases(self) -> tuple[float, float]:
        """Range of phase that the diagrams show, deg.

        The range contains the phase of every curve at all frequencies at which the gain of that
        curve lies within ``range``.
        """
        ends = [-180.0]
        for curve in self.every:
            inside = (curve.decibels > self.range[0]) & (curve.decibels < self.range[1])
            ends += [curve.phase[inside].min(initial=-180), curve.phase[inside].max(initial=-180)]
        low, high = 90 * np.floor((min(ends) - 10) / 90), 90 * np.ceil((max(ends) + 10) / 90)
        return max(float(low), -900.0), min(float(high), 360.0)


def curves_of(
    gains: "Sequence[tuple[str, str, str, LinearModel]]", crossings: "pd.DataFrame"
) -> Curves:
    """Return the curves of loop gains with one input and one output.

    Each item of ``gains`` has the name, the colour, the line style and the loop gain. The curves
    span all frequencies at which one of the gains lies within the diagrams' range, which is chosen
    so that it contains the gain margins nearest to 0 dB.
    """
    margins = crossings["gain_margin"].replace([np.inf, -np.inf], np.nan).dropna()
    down, up = margins[margins < 0].max(), margins[margins >= 0].min()
    bottom = max(DEEPEST, -10 * np.ceil(AROUND * np.nanmax([up, 30]) / 10))
    top = min(HIGHEST, 10 * np.ceil(AROUND * np.nanmax([-down, 20]) / 10))
    shown = crossings["gain_margin"].isna() | crossings["gain_margin"].between(-top, -bottom)
    known = crossings.loc[shown & (crossings["frequency"] > 0), "frequency"]
    bands = [band(gain) for *_, gain in gains]
    low = min(known.min() / 5 if len(known) else np.inf, *(low for low, _ in bands))
    high = max(known.max() * 2 if len(known) else 0.0, *(high for _, high in bands))
    high = min([high, *(0.5 / g.period for *_, g in gains if g.period is not None)])
    drawn = []
    for name, color, line, gain in gains:
        drawn.append(Curve(name, color, *_smooth(gain, frequencies(gain, low, high)), line))
    seen = [(c.decibels > bottom - 3) & (c.decibels < top + 3) for c in drawn]
    ends = [c.frequency[inside] for c, inside in zip(drawn, seen, strict=True) if inside.any()]
    if ends:
        low = min(*(f[0] for f in ends), known.min() / 1.5 if len(known) else np.inf)
        high = max(*(f[-1] for f in ends), known.max() * 1.5 if len(known) else 0.0)
    keep = [(curve.frequency >= low) & (curve.frequency <= high) for curve in drawn]
    cut = [
        replace(curve, frequency=curve.frequency[inside], gain=curve.gain[inside])
        for curve, inside in zip(drawn, keep, strict=True)
    ]
    return Curves(tuple(cut), (float(bottom), float(top)))


def _smooth(
    gain: "LinearModel", f: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Return frequencies (Hz) for a smooth curve of the loop gain, and the loop gain at each.

    The frequencies are ``f`` and further frequencies where the loop gain changes fast.
    """
    model, values = _compiled(gain), np.zeros(0, complex)
    new, old = f, np.zeros(0)
    for _ in range(6):
        more = np.array(model.response(2 * np.pi * new)).view(complex)
        every, order = np.concatenate([old, new]), np.argsort(np.concatenate([old, new]))
        old, values = every[order], np.concatenate([values, more])[order]
        finite = np.isfinite(values)  # the loop gain is infinite at an undamped pole
        old, values = old[finite], values[finite]
        with np.errstate(divide="ignore", invalid="ignore"):
            wide = np.flatnonzero(np.abs(np.log(values[1:] / values[:-1])) > TURN)
        new = (old[wide] + np.outer([1 / 3, 2 / 3], old[wide + 1] - old[wide])).ravel()
    return old, values


def _edge() -> Any:
    """Return the colour of reference lines, such as the line at 0 dB."""
    import matplotlib

    return matplotlib.rcParams["axes.edgecolor"]


def _ticks(low: float, high: float) -> NDArray[np.float64]:
    step = 90 if high - low <= 540 else 180
    return np.arange(step * np.ceil(low / step), high + 1, step)


def draw_bode(gain: "Axes", phase: "Axes", curves: Curves) -> None:
    """Draw gain and phase over frequency, with lines at 0 dB and at odd multiples of 180°."""
    low, high = curves.phases
    for curve in curves.every:
        curve.draw(gain, curve.frequency, curve.decibels)
        curve.draw(phase, curve.frequency, curve.phase)
    gain.axhline(0, color=_edge(), linewidth=0.8)
    for turn in ODD:
        if low < turn < high:
            phase.axhline(turn, color=_edge(), linewidth=0.8, linestyle="--")
    gain.set(xscale="log", ylim=curves.range, ylabel="loop gain (dB)")
    phase.set(xscale="log", ylim=(low, high), yticks=_ticks(low, high))
    phase.set(xlabel="frequency (Hz)", ylabel="phase (deg)")
    ends = [(curve.frequency[0], curve.frequency[-1]) for curve in curves.every]
    phase.set_xlim(min(first for first, _ in ends), max(last for _, last in ends))


def draw_nichols(ax: "Axes", curves: Curves) -> None:
    """Draw gain over phase.

    A cross marks -1; the contour around the point -1 contains the loop gains whose distance to -1
    is 0.5.
    """
    left, right = curves.phases
    for curve in curves.every:
        curve.draw(ax, curve.phase, curve.decibels)
    for turn in ODD:
        ax.plot(np.degrees(np.angle(-CIRCLE)) + turn, 20 * np.log10(np.abs(CIRCLE)),
                color=_edge(), linewidth=0.8)  # fmt: skip
        ax.plot(turn, 0, "+", color=_edge(), markersize=9)
    ax.axhline(0, color=_edge(), linewidth=0.8)
    ax.set(xlim=(left, right), ylim=curves.range, xticks=_ticks(left, right))
    ax.set(xlabel="phase (deg)", ylabel="loop gain (dB)")


def draw_nyquist(ax: "Axes", curves: Curves) -> None:
    """Draw the complex loop gain near -1, at positive frequencies.

    A cross marks -1. The circle around the point -1 has the radius 0.5; the dotted circle is the
    unit circle.
    """
    sizes = [1.5]
    for curve in curves.every:
        curve.draw(ax, curve.gain.real, curve.gain.imag)
        below = np.flatnonzero(np.abs(curve.gain) <= 1)
        sizes.append(np.abs(curve.gain[below[0] :]).max() if len(below) else 1.5)
    unit = np.exp(1j * np.linspace(0, 2 * np.pi, 200))
    ax.plot(unit.real, unit.imag, ":", color=_edge(), linewidth=0.8)
    ax.plot(CIRCLE.real, CIRCLE.imag, color=_edge(), linewidth=0.8)
    ax.plot(-1, 0, "+", color=_edge(), markersize=9)
    reach = 1.15 * min(max(sizes), 2.5)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.set(xlabel="Re L", ylabel="Im L")
