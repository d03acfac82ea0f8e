"""Margins of a loop: every gain and phase crossing, however narrow."""

import itertools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuError, Quantity
from .linearization import LinearModel
from .loop import Loop, _from_control

if TYPE_CHECKING:
    import pandas as pd

Matrix = NDArray[np.float64]

NEAR = 0.2
"""A crossing is near a mode if their frequencies differ by at most this part of the mode's."""

INTEGRATOR = 1e8
"""A loop gain above this is at an integrator, or another pole on the axis: no phase crossing."""

FAR = 20
"""dB; phase crossings with larger margins are not printed."""

LIGHT = 0.2
"""Damping ratio below which a pole is a mode to be named."""


@dataclass(frozen=True, eq=False)
class Margins:
    """Result of `margins`; ``print`` shows a verdict in words and the main rows of the table."""

    crossings: "pd.DataFrame"
    """A row for each crossing, by frequency: ``loop`` (the command at which it was broken),
    ``crossing`` ("gain": the loop gain is 1; "phase": it is negative real), ``frequency`` (Hz),
    ``gain_margin`` (dB, by which the gain may grow, < 0: shrink, until this phase crossing passes
    through -1), ``phase_margin`` (deg, from -180 to 180), ``delay_margin`` (s, phase margin from 0
    to 360 deg over frequency), ``near``: the lightly damped modes of the plant within a fifth of
    its frequency, of which tank or by the states that take most part."""
    stable: bool
    """True if the closed loop is stable; for a `Loop`, its controllable and observable part."""
    poles: NDArray[np.complex128]
    """Poles of the closed loop by magnitude: rad/s, or in the z plane."""
    modulus_margin: float
    """Least distance of the loop gain to -1."""
    delay_margin: float
    """Further delay of all commands, s, at which the loop becomes unstable; 0 if it already is."""
    modes: "pd.DataFrame"
    """Modes of the plant with damping ratios below 0.2: see `LinearModel.modes`."""

    @property
    def gain_margins(self) -> tuple[float, float]:
        """Factors in dB by which the gain may shrink and grow: (-inf, inf) if without limit."""
        all_of = self.crossings.loc[self.crossings["crossing"] == "phase", "gain_margin"]
        return max(all_of[all_of < 0], default=-np.inf), min(all_of[all_of >= 0], default=np.inf)

    @property
    def phase_margin(self) -> float:
        """Return the smallest phase margin in magnitude, deg; inf without a gain crossing."""
        margins = self.crossings["phase_margin"].dropna()
        return float(margins.iloc[margins.abs().argmin()]) if len(margins) else np.inf

    def __str__(self) -> str:
        """Return the verdict, then the crossings."""
        down, up = self.gain_margins
        lines = [
            f"closed loop: {'stable' if self.stable else 'UNSTABLE'}",
            f"gain margins {_decibel(up)} and {_decibel(down)}, "
            f"phase margin {_degrees(self.phase_margin)}, "
            f"delay margin {self.delay_margin:.3g} s, modulus margin {self.modulus_margin:.3g}",
        ]
        if near := sorted({name for name in self.crossings["near"] if name}):
            lines.append(f"crossings near lightly damped modes: {'; '.join(near)}")
        if not len(self.crossings):
            return "\n".join([*lines, "no crossings"])
        margin = self.crossings["gain_margin"]
        far = (margin.abs() > FAR) & ~margin.isin(self.gain_margins)
        shown = self.crossings[~far].to_string(
            index=False, na_rep="", float_format=lambda v: f"{v:.4g}"
        )
        if far.any():
            shown += f"\nand {far.sum()} phase crossings with gain margins beyond {FAR} dB"
        return "\n".join([*lines, shown])


def _degrees(value: float) -> str:
    return f"{value:.3g}°" if np.isfinite(value) else "none"


def _decibel(value: float) -> str:
    if np.isfinite(value):
        return f"{value:+.3g} dB"
    return "none upwards" if value > 0 else "none downwards"


def margins(
    loop: Loop | LinearModel | Any, parameters: Mapping[str, Quantity] | None = None
) -> Margins:
    """Return every gain and phase crossing of a loop, its margins, and whether it is stable.

    * ``loop``: A `Loop`, whose sampled loop gain is exact, delay included. Or a loop gain L that is
      closed with u = -L u: a `LinearModel` or a system of python-control, continuous or discrete.
      With several commands each loop is broken in turn while the others are closed.
    * ``parameters``: Parameters of the FMU in addition to the loop's own.

    No frequency grid is involved: crossings are eigenvalues of a matrix pencil, the roots of 1 -
    L(s) L(-s) and of L(s) - L(-s), or the same in z. These roots divide the frequencies into
    intervals. A change of sign from one interval to the next is a crossing, which bisection refines
    to rounding.
    """
    return margins_and_gain(loop, parameters)[0]


def margins_and_gain(
    loop: Any, parameters: Mapping[str, Quantity] | None = None
) -> tuple[Margins, LinearModel]:
    """Return what `margins` finds, and the loop gain."""
    if isinstance(loop, Loop):
        loop.check()
        loop._must_be_linear()
        plant = loop.plant(parameters)
        modes = plant.modes(LIGHT)
        small = minimal(plant)
        gain = loop._gain(small)

        def delayed(more: float) -> LinearModel:
            return loop._gain(small, more)

        moved = [_moved_by(plant, i, modes) for i in range(len(plant.inputs))]
        return _margins(gain, modes, moved, delayed), gain
    if parameters:
        raise FmuError("parameters are for a Loop; this loop gain has none")
    gain = loop if isinstance(loop, LinearModel) else _loop_gain(loop)
    modes = gain.modes(LIGHT)
    return _margins(gain, modes, [modes] * gain.D.shape[1], None), gain


def _moved_by(plant: LinearModel, i: int, modes: "pd.DataFrame") -> "pd.DataFrame":
    """Return the modes that one input moves and an output shows."""
    A, B, C, D = plant
    one = LinearModel(
        A, B[:, i : i + 1], C, D[:, i : i + 1], plant.states, plant.inputs[i : i + 1], plant.outputs
    )
    here = minimal(one).modes(LIGHT)["frequency"].to_numpy()
    kept = [bool((np.abs(here - f) < 1e-6 * f).any()) for f in modes["frequency"]]
    return modes[np.array(kept, bool)]


def _loop_gain(system: Any) -> LinearModel:
    if not hasattr(system, "dt"):
        raise FmuError(
            "margins needs a Loop, or a loop gain as LinearModel or system of python-control, not "
            f"{type(system).__name__}"
        )
    return _from_control(system)


def _margins(
    gain: LinearModel,
    modes: "pd.DataFrame",
    moved: "list[pd.DataFrame]",
    delayed: Callable[[float], LinearModel] | None,
) -> Margins:
    import pandas as pd

    outputs, inputs = gain.D.shape
    if outputs != inputs:
        raise FmuError(f"a loop gain has as many inputs as outputs, not {inputs} and {outputs}")
    if abs(np.linalg.det(np.eye(inputs) + gain.D)) < 1e-12:
        raise FmuError("the loop cannot be closed: I + D is singular")
    rows, modulus, least_delay = [], np.inf, np.inf
    for i in range(inputs):
        one = _broken_at(gain, i)
        name = gain.inputs[i] if i < len(gain.inputs) else f"u[{i + 1}]"
        found, closest = _crossings(one)
        modulus = min(modulus, closest)
        for kind, w, L in found:
            late = np.nan
            row: dict[str, Any] = {"loop": name, "crossing": kind, "frequency": w / (2 * np.pi)}
            row |= {"gain_margin": np.nan, "phase_margin": np.nan}
            if kind == "gain":
                phase = np.degrees(np.angle(-L))
                late = np.radians(phase % 360) / w
                row["phase_margin"] = phase
                least_delay = min(least_delay, late)
            else:
                row["gain_margin"] = -20 * np.log10(abs(L))
            rows.append(row | {"delay_margin": late, "near": _near(row["frequency"], moved[i])})
    columns = [
        "loop",
        "crossing",
        "frequency",
        "gain_margin",
        "phase_margin",
        "delay_margin",
        "near",
    ]
    table = pd.DataFrame(rows, columns=columns).sort_values("frequency", kind="stable")
    table = table.reset_index(drop=True)
    units = {"frequency": "Hz", "gain_margin": "dB", "phase_margin": "deg", "delay_margin": "s"}
    table.attrs["units"] = units
    poles = _closed(gain)
    stable = _largest(gain) < (0 if gain.period is None else 1)
    delay = 0.0
    if stable:
        delay = least_delay if delayed is None else _delay_margin(delayed, least_delay)
    return Margins(table, bool(stable), poles, float(modulus), float(delay), modes)


def _broken_at(gain: LinearModel, i: int) -> LinearModel:
    """Return the loop gain at one command while the others are closed with u = -L u."""
    if gain.D.shape == (1, 1):
        return gain
    others = [j for j in range(len(gain.D)) if j != i]
    A, B, C, D = gain
    closing = np.linalg.inv(np.eye(len(others)) + D[np.ix_(others, others)])
    from_x, from_u = -closing @ C[others], -closing @ D[others, i]
    return LinearModel(
        A + B[:, others] @ from_x,
        (B[:, i] + B[:, others] @ from_u)[:, None],
        (C[i] + D[i, others] @ from_x)[None],
        np.array([[D[i, i] + D[i, others] @ from_u]]),
        gain.states,
        gain.inputs[i : i + 1],
        gain.outputs[i : i + 1],
        gain.period,
    )


def _closed(gain: LinearModel) -> NDArray[np.complex128]:
    """Return the closed loop's poles by magnitude."""
    A, B, C, D = gain
    poles = np.linalg.eigvals(A - B @ np.linalg.solve(np.eye(len(D)) + D, C)).astype(complex)
    return poles[np.argsort(np.abs(poles))]


def _largest(gain: LinearModel) -> float:
    """Return what decides stability: largest real part, or magnitude in the z plane."""
    poles = _closed(gain)
    sizes = poles.real if gain.period is None else np.abs(poles)
    return float(max(sizes, default=-np.inf if gain.period is None else 0.0))


def _pencils(gain: LinearModel) -> "list[tuple[Matrix, Matrix]]":
    """Return (M, E) with the zeros of 1 - L(s) L(-s) and of L(s) - L(-s) as eigenvalues.

    In the z plane 1/z is in the place of -s. The states are those of L, then of the other factor;
    then u, the input of L, and y, its output.
    """
    A, B, C, D = gain
    n = len(A)
    one, none, column = np.eye(n), np.zeros((n, n)), np.zeros((n, 1))
    row, zero, unit = column.T, np.zeros((1, 1)), np.ones((1, 1))
    if gain.period is None:  # s x1 = A x1 + B u, -s x2 = A x2 + B y or B u
        gains = (
            np.block([[A, none, B, column], [none, -A, column, -B], [C, row, D, -unit],
                      [row, C, -unit, D]]),
            np.diag([1.0] * (2 * n) + [0.0, 0.0]),
        )  # fmt: skip
        phases = (
            np.block([[A, none, B], [none, -A, -B], [C, -C, zero]]),
            np.diag([1.0] * (2 * n) + [0.0]),
        )
    else:  # z x1 = A x1 + B u, x2 = z (A x2 + B y or B u)
        gains = (
            np.block([[A, none, B, column], [none, one, column, column], [C, row, D, -unit],
                      [row, C, -unit, D]]),
            np.block([[one, none, column, column], [none, A, column, B],
                      [np.zeros((2, 2 * n + 2))]]),
        )  # fmt: skip
        phases = (
            np.block([[A, none, B], [none, one, column], [C, -C, zero]]),
            np.block([[one, none, column], [none, A, B], [np.zeros((1, 2 * n + 1))]]),
        )
    return [gains, phases]


def _frequencies(values: Any, period: float | None) -> Matrix:
    """Return the frequencies of poles, zeros or eigenvalues, rad/s, without 0 and infinity."""
    values = np.asarray(values, complex)
    values = values[np.isfinite(values) & (values != 0)]
    sizes = np.abs(values.imag) if period is None else np.abs(np.angle(values)) / period
    return sizes[(sizes > 0) & np.isfinite(sizes)]


def _nodes(gain: LinearModel, more: Any, low: float, high: float) -> Matrix:
    """Return frequencies between which L does nothing that is not seen at them, rad/s.

    Those of the eigenvalues ``more``; and for what rounding may do to these, a grid of 400, closer
    about each pole of the open and the closed loop in steps of its bandwidth.
    """
    nodes = [np.geomspace(low, high, 400), _frequencies(more, gain.period)]
    for pole in (*np.linalg.eigvals(gain.A), *_closed(gain)):
        if gain.period is not None:
            pole = np.log(complex(pole)) / gain.period if pole else -1.0
        width = max(abs(np.real(pole)), 1e-9 * abs(pole))
        about = width * np.array([0, 0.3, 1, 3, 10, 30, 100])
        nodes.append(abs(np.imag(pole)) + np.concatenate([-about, about]))
    every = np.unique(np.concatenate(nodes))
    return every[(every > low) & (every < high)]


def _crossings(gain: LinearModel) -> "tuple[list[tuple[str, float, complex]], float]":
    """Return kind, frequency (rad/s) and loop gain of each crossing; and the modulus margin."""
    from scipy.linalg import eigvals
    from scipy.optimize import brentq, minimize_scalar

    def L(w: Any) -> Any:
        try:
            return gain.response(np.asarray(w) / (2 * np.pi))[:, 0, 0]
        except np.linalg.LinAlgError:  # on an undamped pole
            if len(w) == 1:
                return np.array([complex(np.inf)])
            return np.concatenate([L([one]) for one in w])

    with np.errstate(all="ignore"):
        gains, phases = (eigvals(*pencil) for pencil in _pencils(gain))
    every = [gains, phases, np.linalg.eigvals(gain.A)]
    known = np.concatenate([_frequencies(values, gain.period) for values in every])
    nyquist = np.inf if gain.period is None else np.pi / gain.period
    known = known[known < nyquist]
    size = max(known, default=1.0 if gain.period is None else nyquist)
    low = 1e-3 * min(known[known > 1e-9 * size], default=size)
    high = min(1e3 * size, (1 - 1e-7) * nyquist)

    found: list[tuple[str, float, complex]] = []
    signs: list[tuple[str, Any, Callable[[complex], float]]] = [
        ("gain", gains, lambda value: float(np.log(max(abs(value), 1e-300)))),
        ("phase", phases, lambda value: float(np.nan_to_num(value.imag / abs(value)))),
    ]
    closest = np.inf
    for kind, eigenvalues, sign in signs:
        nodes = _nodes(gain, eigenvalues, low, high)
        points = np.sort(np.concatenate([[low], (nodes[1:] + nodes[:-1]) / 2, [high]]))
        values = L(points)
        finite = values[np.isfinite(values)]
        closest = min(closest, np.abs(1 + finite).min(initial=np.inf))
        good = np.isfinite(values) & (np.abs(values) > 1e-300)
        points, values = points[good], values[good]
        height = np.array([sign(value) for value in values])
        for k in np.flatnonzero((height[1:] > 0) != (height[:-1] > 0)):
            bounds = points[k], points[k + 1]
            w = brentq(lambda w, sign=sign: sign(L([w])[0]), *bounds, xtol=1e-300, rtol=1e-15)
            value = complex(L([w])[0])
            jump = abs(sign(value)) > 1e-6 or abs(value) > INTEGRATOR  # a pole on the axis
            if not jump and (kind == "gain" or value.real < 0):
                found.append((kind, float(w), value))
        for k in np.argsort(np.abs(1 + values))[:5]:
            bounds = points[max(k - 1, 0)], points[min(k + 1, len(points) - 1)]
            best = minimize_scalar(
                lambda w: float(abs(1 + L([w])[0])), bounds=bounds, method="bounded",
                options={"xatol": 1e-10 * bounds[1]},
            )  # fmt: skip
            closest = min(closest, best.fun)
    for w in (0.0, nyquist):  # where L is real in any case
        s = 1j * w if gain.period is None else np.exp(1j * w * gain.period)
        end = complex(L([w])[0]) if np.isfinite(s) else 0j
        if end.real < 0 and abs(end) < INTEGRATOR:
            found.append(("phase", w, complex(end.real)))
    found.sort(key=lambda crossing: crossing[1])
    return found, closest


def _near(frequency: float, modes: "pd.DataFrame") -> str:
    """Return the modes near a frequency, by name."""
    apart = (modes["frequency"] - frequency).abs()
    close = modes[apart <= NEAR * modes["frequency"]]
    if not len(close):
        return ""
    who = sorted({_mode_of(state) for mode in close.itertuples() for state in mode.states})
    f, zeta = close["frequency"], 100 * close["zeta"]
    return f"{', '.join(who)} ({_span(f)} Hz, ζ = {_span(zeta)} %)"


def _span(values: "pd.Series") -> str:
    low, high = (f"{values.min():.3g}", f"{values.max():.3g}")
    return low if low == high else f"{low} to {high}"


def _mode_of(state: str) -> str:
    """Return the slosh mode that a state of our FMUs belongs to, otherwise the state itself."""
    if found := re.fullmatch(r"slosh\.\w+\[(\d+)\]", state):
        return f"slosh mode {found[1]}"
    if found := re.fullmatch(r"tank\[(\d)\]\.p(?:_dot)?\[(\d),\d\]", state):
        return f"slosh of tank {found[1]}" + (f" mode {found[2]}" if found[2] != "1" else "")
    return state


def _delay_margin(delayed: Callable[[float], LinearModel], first: float) -> float:
    """Return the least further delay at which a sampled loop is no longer stable, s.

    first: what the crossings say, which for a sampled loop holds at whole cycles.
    """
    from scipy.optimize import brentq

    def excess(delay: float) -> float:
        return _largest(delayed(delay)) - 1

    if not np.isfinite(first):
        return np.inf
    period = delayed(0.0).period or first
    # quarters of a cycle, whose exponentials come again; or multiples of them
    step = period / 4 * max(np.ceil(first / period / 10), 1) if first > period else first / 20
    end = 1.5 * first + 2 * period
    for low, high in itertools.pairwise(np.arange(0, end + step, step)):
        if excess(high) >= 0:
            return float(brentq(excess, low, high, xtol=1e-12 * high))
    return np.inf


def minimal(model: LinearModel, tolerance: float = 1e-11) -> LinearModel:
    """Return the part of a model that inputs move and outputs show, in other coordinates.

    By orthonormal bases of the controllable and of the observable subspace; directions smaller than
    ``tolerance`` of the matrix's norm are rounding.
    """

    def basis(A: Matrix, B: Matrix) -> Matrix:
        size = np.linalg.norm(A) or 1.0
        scale = np.linalg.norm(B, axis=0)
        new = B / np.where(scale > 0, scale, 1.0)
        found, limit = np.zeros((len(A), 0)), tolerance
        while new.size:
            for _ in range(2):
                new = new - found @ (found.T @ new)
            left, sizes, _ = np.linalg.svd(new, full_matrices=False)
            fresh = left[:, sizes > limit]
            if not fresh.size:
                break
            found = np.hstack([found, fresh])
            new, limit = A @ fresh, tolerance * size
        return found

    A, B, C, D = model
    moved = basis(A, B)
    A, B, C = moved.T @ A @ moved, moved.T @ B, C @ moved
    seen = basis(A.T, C.T)
    A, B, C = seen.T @ A @ seen, seen.T @ B, C @ seen
    states = tuple(f"x[{i + 1}]" for i in range(len(A)))
    return LinearModel(A, B, C, D, states, model.inputs, model.outputs, model.period)
