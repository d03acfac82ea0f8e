"""Worst operating point of a design review: its search, and its confirmation by simulation."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .fmu import Fmu
from .linearization import LinearModel
from .quantities import OMEGA
from .run import Run
from .simulation import parameters_of
from .stability import _closed, _is_neutral

if TYPE_CHECKING:
    from .review_point import Point

Vector = NDArray[np.float64]
Evaluate = Callable[[Iterable[tuple[int, Vector]]], "list[Point]"]

STARTS = 2  # Number of points from which the search starts, at different fills

SMALLEST = 0.25  # Smallest step of the search, in units in which the range of a quantity is -1 to 1

ASIDE = 0.01  # Relative difference of the two simulated gains from the gain at the limit, ±

STEPS = 11  # Gains between the limit and a simulated gain at which the pole is followed

RATE = 1e-8  # Disturbance at the start of a simulation: angular velocity about each axis, rad/s

GROWTH = 9.0  # Logarithm of the largest growth in a simulation, so that motions stay small


@dataclass(frozen=True, eq=False)
class Confirmation:
    """Simulation of the nonlinear FMU at the worst point, compared with the linear prediction."""

    command: str | None
    """Command whose gain is scaled up to the limit; None if the loop is unstable without this."""
    factor: float
    """Predicted factor of the gain at the limit of stability; 1 if the loop is unstable."""
    simulated_factor: float
    """Factor of the gain at which the simulated oscillation neither grows nor decays."""
    frequency: float
    """Predicted frequency of the critical oscillation, Hz."""
    simulated_frequency: float
    """Frequency of the oscillation in the simulation, Hz."""
    growth: float
    """Predicted growth rate in the last run, 1/s."""
    simulated_growth: float
    """Growth rate in the simulation of the last run, 1/s."""
    runs: dict[float, Run]
    """Simulated runs by the factor of the gain."""

    @property
    def agrees(self) -> bool:
        """True if the simulation agrees with the prediction to 1 %.

        The frequency of the oscillation is compared, and the factor of the gain at the limit of
        stability or, of an unstable loop, the growth rate.
        """
        if abs(self.simulated_frequency - self.frequency) > 0.01 * self.frequency:
            return False
        if self.command is not None:
            return abs(self.simulated_factor - self.factor) <= 0.01 * abs(self.factor)
        # compare slow growth with a growth by the factor e within the run
        duration = max(float(run["time"].iloc[-1]) for run in self.runs.values())
        return abs(self.simulated_growth - self.growth) <= 0.01 * max(
            abs(self.growth), 1 / duration
        )

    @property
    def out_of_range(self) -> list[str]:
        """One sentence for each tank that left the range of its model in one of the runs."""
        found = [
            (f"with gain × {factor:.4g} " if self.command else "", text)
            for factor, run in self.runs.items()
            for text in run.out_of_range
        ]
        return [where + text for where, text in found]

    @property
    def summary(self) -> str:
        """Comparison with the prediction, and a note if a tank left the range of its model."""
        left = "; the simulation left the range of its model (confirmation.out_of_range)"
        return self._comparison() + (left if self.out_of_range else "")

    def __str__(self) -> str:
        text = "; the simulation left the range of its model: " if self.out_of_range else ""
        return self._comparison() + text + "; ".join(self.out_of_range)

    def _comparison(self) -> str:
        verdict = "confirms" if self.agrees else "does NOT confirm"
        if self.command is None:
            pairs = (
                (self.simulated_growth, self.simulated_frequency), (self.growth, self.frequency)
            )  # fmt: skip
            found, expected = (
                f"{abs(rate):.4g} 1/s " + (f"at {f:.4g} Hz" if f else "without oscillation")
                for rate, f in pairs
            )
            what = "growth" if self.growth > 0 else "decay"
            if self.simulated_growth * self.growth < 0:
                found = f"{'decay' if self.growth > 0 else 'growth'} instead, {found}"
            return f"the nonlinear simulation {verdict} its {what}: {found} (predicted {expected})"
        apart = abs(self.simulated_factor / self.factor - 1)
        return (
            f"the nonlinear simulation {verdict} its margin: {self.command} reaches the limit at "
            f"{_decibel(self.simulated_factor)} dB and {self.simulated_frequency:.4g} Hz "
            f"(predicted {_decibel(self.factor)} dB, {self.frequency:.4g} Hz; the gains differ by "
            f"{100 * apart:.2g} %)"
        )


def _decibel(factor: float) -> str:
    return f"{20 * np.log10(factor):+.2f}"


def search(evaluate: Evaluate, points: "Sequence[Point]") -> "list[Point]":
    """Search for the operating point with the smallest `distance`; return all points tried.

    The search starts at the worst points so far, and at the corner of the ranges at which each
    quantity has its worse end. It changes one quantity at a time; if no change makes the point
    worse, the step is halved. Therefore it finds a local minimum.
    """
    found: list[Point] = list(points)
    count = len(points[0].shares)
    if not count:
        return []
    corners = evaluate(_corners(points))
    found += corners
    starts: list[Point] = []
    for point in sorted(found, key=lambda point: point.distance):
        if point.fill not in [start.fill for start in starts]:
            starts.append(point)
    known = {(point.fill, *point.shares): point for point in found}
    for here in starts[:STARTS]:
        step = 1.0
        while step >= SMALLEST:
            moves = [sign * step * row for row in np.eye(count) for sign in (-1.0, 1.0)]
            tried = [(here.fill, np.clip(here.shares + move, -1, 1)) for move in moves]
            keys = {(fill, *shares): (fill, shares) for fill, shares in tried}
            new = [key for key in keys if key not in known]
            known |= zip(new, evaluate([keys[key] for key in new]), strict=True)
            best = min((known[key] for key in keys), key=lambda point: point.distance)
            if best.distance < here.distance - 1e-9:
                here = best
            else:
                step /= 2
    return list(known.values())[len(points) :]


def _corners(points: "Sequence[Point]") -> list[tuple[int, Vector]]:
    """Return a corner of the ranges for each of the worst fills, with the fill's number.

    At the corner each quantity is at the end of its range at which the loop is less stable.
    """
    estimates = []
    for fill in {point.fill for point in points}:
        here = [point for point in points if point.fill == fill]
        nominal = next(point for point in here if not point.shares.any())
        corner, losses = np.zeros(len(nominal.shares)), np.zeros(len(nominal.shares))
        for point in here:
            if np.count_nonzero(point.shares) == 1 and abs(point.shares).max() == 1:
                (j,) = np.flatnonzero(point.shares)
                loss = nominal.distance - point.distance
                if loss > losses[j]:
                    corner[j], losses[j] = point.shares[j], loss
        estimates.append((nominal.distance - losses.sum(), fill, corner))
    estimates.sort(key=lambda row: row[0])
    return [(fill, corner) for _, fill, corner in estimates[: 2 * STARTS] if corner.any()]


def confirm(point: "Point") -> Confirmation:
    """Simulate the nonlinear FMU at a point, and compare it with the linear prediction.

    A stable loop is simulated with the gain of one command 1 % below and above its nearest gain
    margin. The growth rates of both runs give the gain at the limit. An unstable loop is simulated
    with its own gain, and its largest growth rate, with or without oscillation, is compared with
    the prediction.
    """
    rows = point.margins.crossings.query("crossing == 'phase' and frequency > 0")
    gain, T = point.loop.gain(), point.loop.period
    if not point.margins.stable or rows.empty:  # there is no gain margin: compare the slowest pole
        command, factor, factors = None, 1.0, [1.0]
        criticals = [_critical(gain)]
    else:
        row = rows.loc[rows["gain_margin"].abs().idxmin()]
        command, factor = str(row["loop"]), float(10 ** (row["gain_margin"] / 20))
        factors = [factor * (1 - ASIDE), factor * (1 + ASIDE)]
        at_limit = np.exp(2j * np.pi * row["frequency"] * T)
        criticals = [_followed(gain, command, at_limit, (factor, end)) for end in factors]
    with ThreadPoolExecutor() as pool:
        found = list(pool.map(lambda *of: _compare(point, gain, command, *of), factors, criticals))
    runs = {scale: run for scale, (run, _, _) in zip(factors, found, strict=True)}
    expected, simulated = ([row[i] for row in found] for i in (1, 2))
    if command is None:
        limit = 1.0
    else:
        (low, high), (a, b) = np.log(factors), (pole.real for pole in simulated)
        limit = float(np.exp(low - a * (high - low) / (b - a)))

    def hertz(poles: list[complex]) -> float:
        return float(np.mean([abs(pole.imag) for pole in poles]) / (2 * np.pi))

    return Confirmation(
        command, factor, limit, hertz(expected), hertz(simulated), expected[-1].real,
        simulated[-1].real, runs,
    )  # fmt: skip


def _compare(
    point: "Point", gain: LinearModel, command: str | None, factor: float, critical: complex
) -> tuple[Run, complex, complex]:
    """Return a run, and the predicted and the simulated pole that decides stability (1/s).

    ``gain`` is the loop gain of the point, and ``critical`` the predicted pole in the z plane with
    the gain of ``command`` multiplied by ``factor``.
    """
    loop, T = point.loop, point.loop.period
    law = loop.linear()
    assert law is not None
    if command is not None:
        gain, law = (_scaled(of, gain.inputs.index(command), factor) for of in (gain, law))
        loop = replace(loop, controller=law)
    poles = _closed(gain)
    s = np.log(critical) / T
    times = [1 / max(abs(s.real), 1e-9)]
    times += [20 * 2 * np.pi / abs(s.imag)] if s.imag else []
    cycles = max(times) / T
    cycles = float(np.clip(cycles, 500, 20000))
    if s.real > 0:
        cycles = min(cycles, max(GROWTH / (s.real * T), 20))
    stop = int(cycles) * T
    given, fmu = parameters_of(loop.parameters), Fmu.open(loop.model)
    rates = {name: float(fmu.convert(name, given.get(name, 0.0))) for name in OMEGA}
    # the reference of a craft that spins is its angular velocity at the start
    held = {name.removeprefix("init."): rate for name, rate in rates.items() if any(rates.values())}
    held = {name: rate for name, rate in held.items() if name in loop.names[0]}
    reference = pd.DataFrame({"time": [0.0, stop], **held}) if held else None
    start = {name: rate + RATE for name, rate in rates.items()}
    run = loop.simulate(stop, start, reference=reference, outputs=[])
    # use only commands in which the pole is prominent; others may show a similar pole
    shown = [command] if command else _showing(gain, critical)
    constants = loop._constants(parameters_of(loop.parameters))
    # leave out the last row, which repeats the command of the row before
    signals = run[shown].to_numpy()[:-1] - [constants[name] for name in shown]
    # leave out poles that a run of this length cannot separate from the critical pole, for example
    # poles of axes with the same inertia
    apart = np.minimum(np.abs(poles - critical), np.abs(poles - critical.conjugate()))
    rest = poles[apart * len(run) > 1]
    return run, complex(s), complex(np.log(_fit(signals, rest, critical)) / T)


def _showing(gain: LinearModel, pole: complex) -> list[str]:
    """Return the commands in which the closed-loop pole ``pole`` (z plane) is prominent.

    They follow from the eigenvector of the pole; ``gain`` is the loop gain.
    """
    A, B, C, D = gain
    closing = np.linalg.solve(np.eye(len(D)) + D, C)
    values, vectors = np.linalg.eig(A - B @ closing)
    share = np.abs(closing @ vectors[:, np.argmin(np.abs(values - pole))])
    return [name for name, size in zip(gain.inputs, share, strict=True) if size >= share.max() / 3]


def _scaled(model: LinearModel, output: int, factor: float) -> LinearModel:
    """Return ``model`` with the output of index ``output`` multiplied by ``factor``."""
    scale = np.ones((len(model.D), 1))
    scale[output] = factor
    return replace(model, C=scale * model.C, D=scale * model.D)


def _followed(
    gain: LinearModel, command: str, pole: complex, factors: tuple[float, float]
) -> complex:
    """Return the closed-loop pole (z plane) into which ``pole`` moves while a gain changes.

    ``factors`` has the first and the last factor of the gain of ``command``; ``pole`` is a pole at
    the first factor. The factor changes in small steps, so that the pole can be followed. The
    followed pole need not have the slowest decay at the last factor, because a slosh mode with
    little damping may decay more slowly.
    """
    for factor in np.linspace(*factors, STEPS):
        poles = _closed(_scaled(gain, gain.inputs.index(command), factor))
        pole = complex(poles[np.argmin(np.abs(poles - pole))])
    return pole


def _critical(gain: LinearModel) -> complex:
    """Return the pole of a closed loop that grows fastest, or decays slowest (z plane).

    ``gain`` is the loop gain. In a stable loop the result is an oscillating pole, if the loop has
    one; a negative pole oscillates with half the sampling rate. Neutral poles do not count, unless
    all poles are neutral.
    """
    poles = _closed(gain)
    neutral = _is_neutral(gain, poles)
    poles = poles if neutral.all() else poles[~neutral]
    moving = poles[(poles.imag > 0) | (poles.real < 0) & (poles.imag == 0)]
    unstable = np.abs(poles).max() >= 1
    chosen = poles[poles.imag >= 0] if unstable or not len(moving) else moving
    return complex(chosen[np.argmax(np.abs(chosen))])


def _fit(signals: Vector, known: NDArray[np.complex128], start: complex) -> complex:
    """Return the pole z for which ``signals`` are best fitted by a sum of powers of poles.

    The poles ``known`` are part of the sum, too; the search begins at ``start``. The method is
    variable projection: for each trial value of the pole, the amplitudes follow from linear least
    squares.
    """
    from scipy.optimize import least_squares

    skipped = len(signals) // 3
    y = signals[skipped:] / np.maximum(np.abs(signals[skipped:]).max(axis=0), 1e-300)
    k = np.arange(len(y))

    def powers(poles: Any) -> Vector:
        z = np.atleast_1d(poles)
        table = np.exp(np.outer(k, np.log(z)))
        # scale each column, because powers of a growing pole become large
        table /= np.abs(table).max(axis=0)
        return np.hstack([table.real, table.imag[:, z.imag != 0]])

    faded = (np.abs(known) / max(abs(start), 1.0)) ** skipped < 1e-7
    lasting = known[~faded & (known.imag >= 0)]
    left, sizes, _ = np.linalg.svd(powers([*lasting, 1.0]), full_matrices=False)
    Q = left[:, sizes > 1e-9 * sizes[0]]
    y = y - Q @ (Q.T @ y)

    def pole(p: Any) -> complex:
        moved = complex(p[0], p[1]) if start.imag else complex(p[0])
        return complex(start * np.exp(moved / len(y)))

    def residual(p: Any) -> Vector:
        basis = powers(pole(p))
        basis = basis - Q @ (Q.T @ basis)
        return (y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]).ravel()

    # the fit may change the growth over the whole run by at most e^10, and the phase by 10 rad
    first = [0.0, 0.0] if start.imag else [0.0]
    found = least_squares(residual, first, bounds=(-10, 10), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return pole(found.x)
