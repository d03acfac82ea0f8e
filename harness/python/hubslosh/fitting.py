"""Transfer functions fitted to frequency responses."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from .arguments import check_table, floats, not_columns, numbers_in, refuse
from .fmu import FmuError
from .linearization import control_package

ITERATIONS = 30  # Iterations of Sanathanan and Koerner's method, which converges within ten


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """A transfer function H(s) = B(s)/A(s), s in rad/s, as `fit` returns it.

    Attributes
    ----------
    numerator : ndarray, shape (m + 1,)
        Coefficients of B, which has m zeros, from the highest power of s down.
    denominator : ndarray, shape (n + 1,)
        Coefficients of A, which has n poles, from the highest power of s down; the first is 1.
    fit : float
        Fit to the data, %: ``100 (1 − |H_data − H| / |H_data − mean(H_data)|)`` with norms over
        all frequencies. 100 is perfect.

    Examples
    --------
    >>> import numpy as np
    >>> from hubslosh import TransferFunction
    >>> hub = TransferFunction(np.array([2.5]), np.array([1.0, 0.1]), fit=99.0)
    >>> hub.poles
    array([-0.1+0.j])
    """

    numerator: NDArray[np.float64]
    denominator: NDArray[np.float64]
    fit: float

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Roots of A in order of magnitude, rad/s."""
        return _sorted(np.roots(self.denominator))

    @property
    def zeros(self) -> NDArray[np.complex128]:
        """Roots of B in order of magnitude, rad/s."""
        return _sorted(np.roots(self.numerator))

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return the frequency response H(2πj · frequency).

        Parameters
        ----------
        frequency : array_like, shape (n,)
            Frequencies, Hz.

        Returns
        -------
        ndarray of complex, shape (n,)
            H at each frequency, in the unit of the data that was fitted.

        Examples
        --------
        >>> import numpy as np
        >>> from hubslosh import TransferFunction
        >>> hub = TransferFunction(np.array([2.5]), np.array([1.0, 0.1]), fit=99.0)
        >>> abs(hub.response([0.0, 1.0])).round(3)
        array([25.   ,  0.398])
        """
        s = 2j * np.pi * np.atleast_1d(floats(frequency))
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s))

    def to_control(self) -> Any:
        """Convert to python-control.

        Returns
        -------
        control.TransferFunction
            The same transfer function.

        Raises
        ------
        FmuError
            If the package control is not installed.

        Examples
        --------
        >>> import numpy as np
        >>> from hubslosh import TransferFunction
        >>> hub = TransferFunction(np.array([2.5]), np.array([1.0, 0.1]), fit=99.0)
        >>> float(hub.to_control().dcgain())
        25.0
        """
        return control_package().TransferFunction(self.numerator, self.denominator)


def fit(response: pd.DataFrame, poles: int = 3, zeros: int = 2) -> TransferFunction:
    """Fit a transfer function to a frequency response.

    The fit is least squares over all frequencies by Levenberg–Marquardt, started from the
    Sanathanan–Koerner iteration. Use a band in which the coherence is near 1. Unstable poles are
    not prevented, and a real pole far below the band is poorly determined.

    Parameters
    ----------
    response : DataFrame
        Frequency response with the columns ``frequency`` (Hz), ``real`` and ``imag``, as
        `frequency_response` returns it.
    poles : int
        Number of poles. A hub with one slosh mode has three from torque to rate; the complex
        pair is the resonance.
    zeros : int
        Number of zeros, at most ``poles``. A hub with one slosh mode has two: the antiresonance.

    Returns
    -------
    TransferFunction
        Coefficients and the quality of the fit.

    Raises
    ------
    FmuError
        If a column is missing or not finite, a number of poles or zeros is not allowed, or the
        frequencies are fewer than the unknowns.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> import hubslosh
    >>> frequency = np.linspace(0.5, 2, 50)
    >>> lag = 2.5 / (2j * np.pi * frequency + 0.1)
    >>> data = pd.DataFrame({"frequency": frequency, "real": lag.real, "imag": lag.imag})
    >>> hubslosh.fit(data, poles=1, zeros=0).poles.round(6)
    array([-0.1+0.j])
    """
    from scipy.optimize import least_squares

    check_table(response, "response")
    for name, count in (("poles", poles), ("zeros", zeros)):
        if not isinstance(count, int | np.integer):
            raise FmuError(f"{name} must be a whole number, not {count!r}")
    names = ["frequency", "real", "imag"]
    problems = not_columns(response, names, "response")
    if not (0 <= zeros <= poles and poles >= 1):
        problems.append(f"poles must be 1 or more and at least zeros, not {poles} and {zeros}")
    if not problems and len(response) < poles + zeros + 1:
        problems.append(f"{len(response)} frequencies are too few for {poles + zeros + 1} unknowns")
    refuse(problems)
    frequency, real, imag = numbers_in(response, names, "response")
    data = real + 1j * imag
    # s is divided by the middle of the band, so that the equations are well conditioned
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
