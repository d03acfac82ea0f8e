"""Transfer functions fitted to frequency responses."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from .arguments import check_table, floats
from .fmu import FmuError
from .linearization import control_package

ITERATIONS = 30
"""Iterations of Sanathanan and Koerner's method, which converges within ten."""


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """H(s) = B(s)/A(s), s in rad/s, coefficients from the highest power down; A begins with 1."""

    numerator: NDArray[np.float64]
    """Coefficients of B."""
    denominator: NDArray[np.float64]
    """Coefficients of A; the first is 1."""
    fit: float
    """``100 (1 − |H_data − H| / |H_data − mean H_data|)``, %: 100 is perfect."""

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Roots of A by magnitude, rad/s."""
        return _sorted(np.roots(self.denominator))

    @property
    def zeros(self) -> NDArray[np.complex128]:
        """Roots of B by magnitude, rad/s."""
        return _sorted(np.roots(self.numerator))

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return H at frequencies in Hz."""
        s = 2j * np.pi * np.atleast_1d(floats(frequency))
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s))

    def to_control(self) -> Any:
        """Return a ``control.TransferFunction``; needs the package control."""
        return control_package().TransferFunction(self.numerator, self.denominator)


def fit(response: pd.DataFrame, poles: int = 3, zeros: int = 2) -> TransferFunction:
    """Fit a transfer function to a frequency response.

    * ``response``: A table with the columns ``frequency`` (Hz), ``real`` and ``imag``, as
      `frequency_response` returns it.
    * ``poles``, ``zeros``: Numbers of poles and zeros. From torque to rate a hub with one slosh
      mode has three and two; its zeros are the antiresonance, its pair of poles the resonance.

    Least squares over all frequencies (Levenberg–Marquardt), starting from the Sanathanan–Koerner
    iteration. The poles may become unstable. Use a band in which the coherence is near 1; a real
    pole far below the band is poorly determined.
    """
    from scipy.optimize import least_squares

    check_table(response, "response")
    for name, count in (("poles", poles), ("zeros", zeros)):
        if not isinstance(count, int | np.integer):
            raise FmuError(f"{name} must be a whole number, not {count!r}")
    problems = [
        f"response has no column {name}"
        for name in ("frequency", "real", "imag")
        if name not in response.columns
    ]
    if not (0 <= zeros <= poles and poles >= 1):
        problems.append(f"poles must be 1 or more and at least zeros, not {poles} and {zeros}")
    if not problems and len(response) < poles + zeros + 1:
        problems.append(f"{len(response)} frequencies are too few for {poles + zeros + 1} unknowns")
    if problems:
        raise FmuError("; ".join(problems))
    frequency, real, imag = (
        response[name].to_numpy(float) for name in ("frequency", "real", "imag")
    )
    data = real + 1j * imag
    if not (np.isfinite(data).all() and np.isfinite(frequency).all()):
        raise FmuError("response is not finite everywhere")
    # s in units of the band's middle, for the equations' condition
    unit = 2 * np.pi * float(np.exp(np.mean(np.log(frequency))))
    s = 2j * np.pi * frequency / unit
    powers_b = s[:, None] ** np.arange(zeros, -1, -1)
    powers_a = s[:, None] ** np.arange(poles - 1, -1, -1)

    def parts(x: NDArray[np.complex128]) -> NDArray[np.float64]:
        return np.concatenate([x.real, x.imag])

    a = np.zeros(poles)
    for _ in range(ITERATIONS):
        weight = 1 / np.abs(s**poles + powers_a @ a) if a.any() else np.ones(len(s))
        rows = np.hstack([powers_b, -data[:, None] * powers_a]) * weight[:, None]
        matrix = np.vstack([rows.real, rows.imag])
        size = np.linalg.norm(matrix, axis=0)
        x = np.linalg.lstsq(matrix / size, parts(data * s**poles * weight), rcond=None)[0] / size
        a = x[zeros + 1 :]

    def left(x: NDArray[np.float64]) -> NDArray[np.float64]:
        model = powers_b @ x[: zeros + 1] / (s**poles + powers_a @ x[zeros + 1 :])
        return parts(model - data)

    best = least_squares(left, x, method="lm", x_scale="jac", xtol=1e-14, ftol=1e-14)
    x = best.x if np.sum(best.fun**2) <= np.sum(left(x) ** 2) else x
    spread = np.linalg.norm(data - data.mean())
    scale_b = unit ** (poles - np.arange(zeros, -1.0, -1))
    scale_a = unit ** (poles - np.arange(poles, -1.0, -1))
    return TransferFunction(
        x[: zeros + 1] * scale_b,
        np.concatenate([[1.0], x[zeros + 1 :]]) * scale_a,
        float(100 * (1 - np.linalg.norm(left(x)) / spread)),
    )


def _sorted(roots: Any) -> NDArray[np.complex128]:
    roots = np.asarray(roots, complex)
    return roots[np.argsort(np.abs(roots))]
