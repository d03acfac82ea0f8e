"""Stability margins of a loop from all its gain and phase crossings, however narrow."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuError, Parameters
from .linearization import LinearModel, eigenvectors, mode_table
from .loop import Loop, _from_control
from .native import Model
from .quantities import short_name

if TYPE_CHECKING:
    import pandas as pd

Matrix = NDArray[np.float64]

NEAR = 0.2  # Largest relative difference between the frequencies of a mode and a crossing "near" it

FAR = 20  # Gain margin above which phase crossings are not printed, dB

MOST = 13  # Number of printed crossings: the crossings with the smallest margins

LIGHT = 0.2  # Damping ratio below which a pole counts as a lightly damped mode

CONVERGED = 1e-11  # Relative change at which a delay has converged; rounding errors are about 1e-12

MOVED = 1e-11  # Residue, relative to the norms of B and C, below which a mode is not excited


@dataclass(frozen=True, eq=False)
class Margins:
    """Stability margins of a control loop; ``print`` shows a verdict and the main crossings.

    Attributes
    ----------
    crossings : DataFrame
        A row for each gain or phase crossing, sorted by frequency. Column ``loop`` names the
        command at which the loop was broken. ``crossing`` is "gain" if the magnitude of the loop
        gain is 1, or "phase" if the loop gain is real and negative. ``frequency`` is in Hz.
        ``gain_margin`` (phase crossings) is the change of the gain in dB, negative for a smaller
        gain, that moves this crossing to -1, the limit of stability. ``phase_margin`` (gain
        crossings) is in deg, from -180 to 180. ``delay_margin`` is the delay in s that uses up the
        phase margin at this frequency, where a negative phase margin counts as a lag of up to
        360°. ``near`` has the lightly damped modes of the plant whose frequency differs from the
        crossing frequency by at most a fifth; a mode is named by its tank or, if it belongs to no
        tank, by the states that take part most.
    stable : bool
        True if every pole of the closed loop decays, except neutral poles. For a `Loop`, only its
        controllable and observable part counts.
    poles : ndarray of complex
        Poles of the closed loop, sorted by magnitude: in rad/s, or in the z plane if the loop is
        sampled.
    modulus_margin : float
        Smallest distance between the loop gain and the point -1.
    delay_margin : float
        Smallest additional delay of all commands, s, that makes the loop unstable; 0 if the loop is
        already unstable.
    modes : DataFrame
        Modes of the plant with damping ratios below 0.2, with the columns of `LinearModel.modes`.
    neutral : ndarray of complex
        Poles among ``poles`` that neither grow nor decay, because the controller has no effect on
        them. Examples are an attitude that the controller does not use, and the motion about an
        axis about which the controller has no gain.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
    >>> found = hubslosh.margins(loop)
    >>> found.stable, round(found.phase_margin)
    (True, 45)
    """

    crossings: "pd.DataFrame"
    stable: bool
    poles: NDArray[np.complex128]
    modulus_margin: float
    delay_margin: float
    modes: "pd.DataFrame"
    neutral: NDArray[np.complex128]

    @property
    def gain_margins(self) -> tuple[float, float]:
        """Gain margins, dB: by how much the gain may be reduced, and by how much increased.

        The result is (-inf, inf) if any gain is allowed.
        """
        every = self.crossings["gain_margin"].to_numpy(float)  # NaN for gain crossings
        down, up = every[every < 0], every[every >= 0]
        return float(down.max(initial=-np.inf)), float(up.min(initial=np.inf))

    @property
    def phase_margin(self) -> float:
        """Phase margin with the smallest magnitude of all gain crossings, deg.

        The margin is inf if the loop gain has no gain crossing.
        """
        margins = self.crossings["phase_margin"].to_numpy(float)
        margins = margins[~np.isnan(margins)]
        return float(margins[np.abs(margins).argmin()]) if len(margins) else np.inf

    def __str__(self) -> str:
        down, up = self.gain_margins
        lines = [
            f"closed loop: {'stable' if self.stable else 'UNSTABLE'}{_neutral_text(self.neutral)}",
            f"gain margins {_decibel(up)} and {_decibel(down)}, "
            f"phase margin {_degrees(self.phase_margin)}, "
            f"delay margin {self.delay_margin:.3g} s, modulus margin {self.modulus_margin:.3g}",
        ]
        if near := sorted({name for name in self.crossings["near"] if name}):
            more = f" and {len(near) - 2} groups more" if len(near) > 2 else ""
            lines.append(f"crossings near lightly damped modes: {'; '.join(near[:2])}{more}")
        if not len(self.crossings):
            return "\n".join([*lines, "no crossings"])
        margin, phase = self.crossings["gain_margin"].abs(), self.crossings["phase_margin"].abs()
        far = (margin > FAR) & ~self.crossings["gain_margin"].isin(self.gain_margins)
        # a gain margin of 6 dB counts as much as a phase margin of 45°
        ease = (margin / 6).fillna(phase / 45)[~far].sort_values(kind="stable")
        first = self.crossings["delay_margin"].dropna().nsmallest(1).index
        shown = self.crossings.loc[sorted({*ease.index[:MOST], *first})]
        lines.append(shown.to_string(index=False, na_rep="", float_format=lambda v: f"{v:.4g}"))
        if left := len(ease) - len(shown):
            lines.append(f"and {left} crossings with larger margins")
        if far.any():
            lines.append(f"and {far.sum()} phase crossings with gain margins beyond {FAR} dB")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"Margins({'; '.join(str(self).splitlines()[:2])})"


def _neutral_text(neutral: NDArray[np.complex128]) -> str:
    """Return the end of a sentence about neutral poles, or an empty string if there are none."""
    count = len(neutral)
    if not count:
        return ""
    poles = "neutral pole, which is" if count == 1 else "neutral poles, which are"
    return (
        f", except for {count} {poles} not controlled (an attitude without feedback, or an axis "
        "without gain)"
    )


def _degrees(value: float) -> str:
    return f"{value:.3g}°" if np.isfinite(value) else "none"


def _decibel(value: float) -> str:
    if np.isfinite(value):
        return f"{value:+.3g} dB"
    return "none upwards" if value > 0 else "none downwards"


def margins(loop: Loop | LinearModel | Any, parameters: Parameters | None = None) -> Margins:
    """Return the stability margins of a loop, with every gain and phase crossing.

    Crossings are found without a frequency grid: poles and zeros bound slope and curvature of the
    loop gain, and intervals of frequency are halved until each has at most one crossing. Then each
    crossing is refined with the state-space model up to rounding errors. Phase crossings with a
    loop gain below 1e-12 or above 1e8 are left out.

    Parameters
    ----------
    loop : Loop, LinearModel or system of python-control
        A `Loop` with a linear controller; its sampled loop gain is exact, also for delays. Or a
        loop gain L, continuous or discrete, for the closed loop u = -L u. If there are several
        commands, the loop is broken at one command after the other, with the others closed.
    parameters : mapping, optional
        Parameters of the FMU in addition to the parameters of the loop; only for a `Loop`.

    Returns
    -------
    Margins
        Crossings, margins, poles and modes.

    Raises
    ------
    FmuError
        If the controller is a function, or anything is wrong with the loop.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
    >>> hubslosh.margins(loop).stable
    True
    """
    return margins_and_gain(loop, parameters)[0]


def margins_and_gain(
    loop: Any, parameters: Parameters | None = None
) -> tuple[Margins, LinearModel]:
    """Return the result of `margins`, and the loop gain from which the margins were computed."""
    if isinstance(loop, Loop):
        K = loop._must_be_linear()
        plant = loop.plant(parameters)
        modes = plant._modes(LIGHT)
        small = minimal(plant)
        gain = loop._gain(small, K)

        def delayed(more: float) -> LinearModel:
            return loop._gain(small, K, more)

        moved = _controllable_modes(plant, modes)
        return _margins(gain, modes, moved, delayed, loop.tanks), gain
    if parameters:
        raise FmuError("parameters= is only for a Loop: a loop gain has no parameters")
    gain = loop if isinstance(loop, LinearModel) else _loop_gain(loop)
    modes = gain._modes(LIGHT)
    return _margins(gain, modes, [modes] * gain.D.shape[1], None), gain


Modes = list[tuple[float, float, tuple[str, ...]]]  # Frequency (Hz), damping ratio, active states


def _controllable_modes(plant: LinearModel, modes: Modes) -> list[Modes]:
    """Return, for each input of ``plant``, the modes that it excites and that are observable.

    Modes with equal frequencies are treated together, because an input excites a combination of
    them, for example of the modes of two equal tanks. ``modes`` has all modes of the plant.
    """
    _, B, C, _ = plant
    poles, left, right = eigenvectors(plant)
    kept = np.zeros((B.shape[1], len(modes)), bool)
    for k, (frequency, _, _) in enumerate(modes):
        same = (np.abs(np.abs(poles) / (2 * np.pi) - frequency) < 1e-6 * frequency) & (
            poles.imag > 0
        )
        L, R = left[:, same].conj().T, right[:, same]
        residues = (C @ R) @ np.linalg.lstsq(L @ R, L @ B, rcond=1e-12)[0]
        size = np.linalg.norm(C) * np.linalg.norm(B, axis=0)
        kept[:, k] = np.linalg.norm(residues, axis=0) > MOVED * size
    return [[mode for mode, here in zip(modes, row, strict=True) if here] for row in kept]


def _loop_gain(system: Any) -> LinearModel:
    if not hasattr(system, "dt"):
        raise FmuError(
            "margins needs a Loop, or a loop gain as LinearModel or system of python-control, not "
            f"{type(system).__name__}"
        )
    return _from_control(system)


def _margins(
    gain: LinearModel,
    modes: Modes,
    moved: list[Modes],
    delayed: Callable[[float], LinearModel] | None,
    tanks: tuple[str, ...] = (),
) -> Margins:
    import pandas as pd

    outputs, inputs = gain.D.shape
    if outputs != inputs:
        raise FmuError(f"a loop gain has as many inputs as outputs, not {inputs} and {outputs}")
    if abs(np.linalg.det(np.eye(inputs) + gain.D)) < 1e-12:
        raise FmuError("the loop cannot be closed: I + D is singular")
    rows, modulus, least_delay = [], np.inf, np.inf
    poles = _closed(gain)
    for i in range(inputs):
        one = _broken_at(gain, i)
        name = gain.inputs[i] if i < len(gain.inputs) else f"u[{i + 1}]"
        found, closest = _crossings(one, poles)
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
            near = _nearby_modes(row["frequency"], moved[i], tanks)
            rows.append(row | {"delay_margin": late, "near": near})
    columns = [
        "loop", "crossing", "frequency", "gain_margin", "phase_margin", "delay_margin", "near",
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=columns).sort_values("frequency", kind="stable")
    table = table.reset_index(drop=True)
    units = {"frequency": "Hz", "gain_margin": "dB", "phase_margin": "deg", "delay_margin": "s"}
    table.attrs["units"] = units
    neutral = _is_neutral(gain, poles)
    stable = _largest(poles[~neutral], gain.period) < (0 if gain.period is None else 1)
    delay = 0.0
    if stable:
        delay = least_delay if delayed is None else _delay_margin(delayed, gain, poles)
    return Margins(
        table, bool(stable), poles, float(modulus), float(delay), mode_table(modes), poles[neutral]
    )


def _broken_at(gain: LinearModel, i: int) -> LinearModel:
    """Return the loop gain of command ``i``, with the loops of all other commands closed."""
    if gain.D.shape == (1, 1):
        return gain
    others = [j for j in range(len(gain.D)) if j != i]
    A, B, C, D = gain
    closing = np.linalg.inv(np.eye(len(others)) + D[np.ix_(others, others)])
    from_x, from_u = -closing @ C[others], -closing @ D[others, i]
    B_i = (B[:, i] + B[:, others] @ from_u)[:, None]
    D_i = np.array([[D[i, i] + D[i, others] @ from_u]])
    return replace(
        gain, A=A + B[:, others] @ from_x, B=B_i, C=(C[i] + D[i, others] @ from_x)[None], D=D_i,
        inputs=gain.inputs[i : i + 1], outputs=gain.outputs[i : i + 1],
    )  # fmt: skip


def _closed_matrix(gain: LinearModel) -> Matrix:
    A, B, C, D = gain
    found: Matrix = A - B @ np.linalg.solve(np.eye(D.shape[-1]) + D, C)
    return found


def _closed(gain: LinearModel) -> NDArray[np.complex128]:
    """Return the closed loop's poles in ascending order of magnitude."""
    poles = np.linalg.eigvals(_closed_matrix(gain)).astype(complex)
    return poles[np.argsort(np.abs(poles))]


def _size(A: Matrix) -> Any:
    """Return the Frobenius norm of a matrix, or of each matrix of a stack; 1 for zeros."""
    size = np.linalg.norm(A, axis=(-2, -1))
    return np.where(size > 0, size, 1.0)


def _errors(
    A: Matrix, poles: NDArray[np.complex128], period: float | None
) -> tuple[Matrix, Matrix]:
    """Return each pole's distance from the limit of stability, and its largest rounding error.

    ``A`` is the closed loop's matrix, or a stack of matrices with as many rows of ``poles``. The
    limit is the imaginary axis or, if the loop has a sampling ``period``, the unit circle.
    """
    off = np.abs(poles.real if period is None else np.abs(poles) - 1)
    away = np.abs(poles if period is None else poles - 1)
    rounding, size = A.shape[-1] * np.finfo(float).eps, _size(A)[..., None]
    chain = np.cbrt(rounding) * size
    return off, np.where(away <= chain, chain, np.sqrt(rounding) * size)


def _may_be_neutral(A: Matrix, poles: NDArray[np.complex128], period: float | None) -> Any:
    """Return True if rounding errors can move one of ``poles`` to the limit of stability.

    ``A`` is the closed loop's matrix; for ``period`` see `_errors`.
    """
    off, most = _errors(A, poles, period)
    return (off <= most).any(axis=-1)


def _is_neutral(gain: LinearModel, poles: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Return a mask of the poles of the closed loop that are neutral.

    A neutral pole is at the limit of stability up to rounding errors, and feedback does not move
    it, so that the loop gain has this pole, too. The rounding error of a simple pole is n ε ‖A‖
    times its condition number (LAPACK Users' Guide, 4.8.1). The condition number of a multiple pole
    is infinite; the error of a double pole is the square root of n ε times ‖A‖. The poles of a
    chain of three integrators, at 0 (or 1 if sampled), have an error of the cube root of n ε times
    ‖A‖. No condition number is computed for poles that are farther from the limit than this error.
    """
    from scipy.linalg import eig, matrix_balance

    A = _closed_matrix(gain)
    # balancing reduces the norm, so that most loops need no condition numbers
    if not len(A) or not _may_be_neutral(A, poles, gain.period):
        return np.zeros(len(poles), bool)
    A = matrix_balance(A)[0]
    off, most = _errors(A, poles, gain.period)
    size, rounding = _size(A), len(A) * np.finfo(float).eps
    near = off <= most
    if near.any():
        near &= np.abs(poles[:, None] - np.linalg.eigvals(gain.A)).min(axis=1) <= most
    if not near.any():
        return near
    values, left, right = eig(A, left=True)
    nearest = np.abs(poles[:, None] - values).argmin(axis=1)
    with np.errstate(divide="ignore"):
        error = rounding * size / np.abs((left.conj() * right).sum(axis=0))
    found: NDArray[np.bool_] = (off <= np.minimum(error[nearest], most)) & near
    return found


def _moved(gain: LinearModel) -> NDArray[np.complex128]:
    """Return the closed loop's poles in ascending order of magnitude, without neutral poles."""
    poles = _closed(gain)
    return poles[~_is_neutral(gain, poles)]


def _largest(poles: NDArray[np.complex128], period: float | None) -> float:
    """Return the largest real part of the poles or, of a sampled model, the largest magnitude.

    ``poles`` has no neutral poles; ``period`` is None for a continuous model.
    """
    sizes = poles.real if period is None else np.abs(poles)
    return float(max(sizes, default=-np.inf if period is None else 0.0))


def _zeros(gain: LinearModel) -> NDArray[np.complex128]:
    """Return the finite zeros of a model with one input and one output.

    If D is 0, the output is differentiated until a derivative depends directly on the input.
    """
    A, b, c, d = gain.A, gain.B[:, 0], gain.C[0], float(gain.D[0, 0])
    while len(A):
        size = np.linalg.norm(c)
        if abs(d) > 1e-10 * size * np.linalg.norm(b):
            return np.linalg.eigvals(A - np.outer(b, c) / d).astype(complex)
        if size <= 1e-300 or not b.any():
            break
        # a Householder reflection makes the output the first state
        v = c / size
        v[0] += np.copysign(1.0, v[0])
        H = np.eye(len(A)) - 2 * np.outer(v, v) / (v @ v)
        A, b = H @ A @ H, H @ b
        c, d, A, b = A[0, 1:], float(b[0]), A[1:, 1:], b[1:]
    return np.zeros(0, complex)


def _frequencies(values: Any, period: float | None) -> Matrix:
    """Return the frequencies of poles or zeros, rad/s, without 0 and infinity.

    ``values`` are in the s plane or, if there is a sampling ``period`` (s), in the z plane.
    """
    values = np.asarray(values, complex)
    values = values[np.isfinite(values) & (values != 0)]
    sizes = np.abs(values.imag) if period is None else np.abs(np.angle(values)) / period
    return sizes[(sizes > 0) & np.isfinite(sizes)]


def _compiled(model: LinearModel) -> Any:
    """Return ``model`` in the form in which the native library evaluates its transfer function."""
    return Model(*(np.ascontiguousarray(matrix, float) for matrix in model), model.period or 0.0)


def band(model: LinearModel) -> tuple[float, float]:
    """Return the frequency band (Hz) of a diagram from the first input to the first output.

    The band reaches from a fifth of the frequency of the lowest pole or zero to five times the
    highest, but not above half the sampling rate.
    """
    one = LinearModel(model.A, model.B[:, :1], model.C[:1], model.D[:1, :1], (), (), ())
    values = np.concatenate([model.poles, _zeros(one)])
    highest = np.inf
    if model.period is not None:
        values = np.log(values[values != 0].astype(complex)) / model.period
        highest = 0.5 / model.period
    found = [float(f) for f in np.abs(values) / (2 * np.pi) if 1e-6 < f < 1e6]
    low, high = min(found, default=0.1) / 5, min(max(found, default=10.0) * 5, highest)
    return min(low, high / 100), high


def frequencies(model: LinearModel, low: float, high: float, count: int = 200) -> Matrix:
    """Return ``count`` frequencies from ``low`` to ``high`` (Hz), and more near poles.

    More frequencies are needed near lightly damped poles, where the response changes fast.
    """
    lines = [np.geomspace(low, high * (1 - 1e-9), count)]
    s = np.linalg.eigvals(model.A).astype(complex)
    if model.period is not None:
        s = np.log(s[np.abs(s) > 0.1]) / model.period
    for pole in s[(s.imag > 0) & (-s.real < LIGHT * np.abs(s))]:
        width = max(abs(pole.real), 1e-6 * abs(pole))
        around = width * np.concatenate([[0], np.geomspace(0.1, 60, 24)])
        lines.append(np.abs(pole.imag + np.concatenate([-around, around])) / (2 * np.pi))
    every = np.unique(np.concatenate(lines))
    return every[(every >= low) & (every <= high)]


def _crossings(
    gain: LinearModel, closed: NDArray[np.complex128]
) -> "tuple[list[tuple[str, float, complex]], float]":
    """Return kind, frequency (rad/s) and loop gain of each crossing, and the modulus margin.

    ``closed`` has the poles of the closed loop.
    """
    poles, zeros = np.linalg.eigvals(gain.A).astype(complex), _zeros(gain)
    low, high = _band(gain, [poles, zeros, closed])
    roots = [np.ascontiguousarray(values).view(float) for values in (poles, zeros, closed)]
    found, closest = _compiled(gain).crossings(roots, low, high)
    kinds = {True: "gain", False: "phase"}
    return [(kinds[is_gain], w, complex(re, im)) for is_gain, w, re, im in found], closest


def _band(gain: LinearModel, roots: list[NDArray[np.complex128]]) -> tuple[float, float]:
    """Return the lowest and the highest frequency at which crossings are searched, rad/s.

    ``roots`` has the poles and zeros of the loop gain and the poles of the closed loop.
    """
    nyquist = np.inf if gain.period is None else np.pi / gain.period
    known = np.concatenate([_frequencies(values, gain.period) for values in roots])
    sizes = np.concatenate([np.abs(values) for values in roots])
    if gain.period is None:  # real poles count, too
        known = np.concatenate([known, sizes[(sizes > 0) & np.isfinite(sizes)]])
    else:
        near = np.concatenate(roots)
        near = near[np.abs(near) > 0]
        known = np.concatenate([known, np.abs(np.log(near)) / gain.period])
    known = known[(known < nyquist) & np.isfinite(known)]
    size = max(known, default=1.0 if gain.period is None else nyquist)
    low = 1e-3 * min(known[known > 1e-9 * size], default=size)
    return low, min(1e3 * size, (1 - 1e-7) * nyquist)


def _nearby_modes(frequency: float, modes: Modes, tanks: tuple[str, ...]) -> str:
    """Return the names, frequencies and damping ratios of the modes near ``frequency`` (Hz).

    ``tanks`` are the names of the tanks, which the names of their modes contain.
    """
    close = [mode for mode in modes if abs(mode[0] - frequency) <= NEAR * mode[0]]
    if not close:
        return ""
    who = sorted({_mode_of(state, tanks) for _, _, states in close for state in states})
    f, zeta = [f for f, _, _ in close], [100 * zeta for _, zeta, _ in close]
    return f"{', '.join(who)} ({_span(f)} Hz, ζ = {_span(zeta)} %)"


def _span(values: list[float]) -> str:
    low, high = (f"{min(values):.3g}", f"{max(values):.3g}")
    return low if low == high else f"{low} to {high}"


def _mode_of(state: str, tanks: tuple[str, ...]) -> str:
    """Return the name of the mode to which a state belongs, or the state's name if unknown.

    For example, the state tank[1].p[2,1] belongs to mode 2 of the first of ``tanks``.
    """
    if found := re.fullmatch(r"slosh\.\w+\[(\d+)\]", state):
        return f"slosh mode {found[1]}"
    shown = short_name(state, tanks)
    if re.fullmatch(r"appendage\[\d\]\.eta(?:_dot)?", state) and shown != state:
        return re.sub(r"\.eta(?:_dot)?\[(\d)\]$", r" mode \1", shown)
    if found := re.fullmatch(r"(?:tank\[(\d)\]|.+)\.p(?:_dot)?\[(\d),\d\]", state):
        owner = shown.rpartition(".p")[0] if shown != state else f"tank {found[1]}"
        return f"slosh of {owner}" + (f" mode {found[2]}" if found[2] != "1" else "")
    return state


def _delay_margin(
    delayed: Callable[[float], LinearModel], gain: LinearModel, closed: NDArray[np.complex128]
) -> float:
    """Return the smallest additional delay, s, at which a sampled loop becomes unstable.

    ``delayed`` returns the loop gain with an additional delay, ``gain`` is the loop gain without
    it, and ``closed`` has the poles of the closed loop. At a frequency at which an eigenvalue of L
    has the magnitude 1, a delay rotates the eigenvalue to -1. This is exact only for whole cycles,
    because of the zero-order hold. Frequency and delay are therefore refined.
    """
    least = np.inf
    with np.errstate(all="ignore"):  # an eigenvalue may be 0
        for delay, w in sorted(_unit_eigenvalues(gain, closed)):
            # the refinement changes the delay by less than half a cycle
            if delay - (gain.period or 0.0) / 2 >= least:
                break
            least = min(least, _exact_delay(delayed, gain, delay, w))
    return least


def _exact_delay(
    delayed: Callable[[float], LinearModel], gain: LinearModel, delay: float, w: float
) -> float:
    """Refine an estimate of the delay (s) and the frequency w (rad/s) at which det(I + L) is 0.

    L is the loop gain: ``gain`` without the delay, and ``delayed`` returns it for any delay.
    """
    period = gain.period or 0.0

    def refined_delay(delay: float) -> float:
        """Return the delay after one correction.

        At the frequency at which an eigenvalue of L has the magnitude 1, the corrected delay
        rotates the eigenvalue to -1, except for the effect of the delay on this frequency.
        """
        nonlocal w
        cycles = int(delay / period)
        model = _compiled(delayed(delay - cycles * period))
        w, phase = model.critical(w, period * cycles)
        return float(delay + phase / w)

    for _ in range(20):  # Steffensen's iteration
        first = refined_delay(delay)
        if abs(first - delay) <= CONVERGED * first:
            return first
        second = refined_delay(first)
        if abs(second - first) <= CONVERGED * second:
            return second
        bend = second - 2 * first + delay
        delay = second if bend == 0 else delay - (first - delay) ** 2 / bend
    return delay


def _unit_eigenvalues(
    gain: LinearModel, closed: NDArray[np.complex128]
) -> list[tuple[float, float]]:
    """Return each frequency at which an eigenvalue of a loop gain has the magnitude 1.

    Each item is the delay (s) that rotates the eigenvalue to -1, followed by the frequency (rad/s).
    ``gain`` is the loop gain, and ``closed`` has the poles of the closed loop.
    """
    period = gain.period or 0.0
    roots = [np.linalg.eigvals(gain.A).astype(complex), closed]
    low, high = _band(gain, roots)
    nodes = [np.geomspace(low, high, 100)]
    for pole in np.concatenate(roots):
        root = np.log(complex(pole)) / period if pole else complex(-np.inf)
        if root.imag > 0 and -root.real < LIGHT * abs(root):
            around = max(abs(root.real), 1e-9 * abs(root)) * np.array([0, 0.3, 1, 3, 10])
            nodes.append(root.imag + np.concatenate([-around, around]))
    every = np.unique(np.concatenate(nodes))
    every = np.ascontiguousarray(every[(every > low) & (every < high)])
    return [
        (float(np.angle(-complex(re, im)) % (2 * np.pi)) / w, w)
        for w, re, im in _compiled(gain).unit_eigenvalues(every)
    ]


def minimal(model: LinearModel, tolerance: float = 1e-11) -> LinearModel:
    """Return the part of a model that is both controllable and observable.

    The states are transformed by orthonormal bases of the controllable and of the observable
    subspace. Singular values below ``tolerance`` times the norm of the matrix count as 0.
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
