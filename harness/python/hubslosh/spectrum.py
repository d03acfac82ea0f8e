"""Estimates of frequency responses from time histories, by scipy.signal.

The program ``hubslosh`` has its own, independent estimate.
"""

import numpy as np
import pandas as pd

from .arguments import check_numbers, numbers_in, vector
from .fmu import FmuError

BINS = 3  # Default half width of the smoothing window, lines of the spectrum

INPUT_FLOOR = 1e-4  # Ratio to the largest input power below which a frequency is left out


def frequency_response(
    data: pd.DataFrame,
    input: str = "tau_cmd",
    output: str = "omega",
    *,
    resolution: float | None = None,
    band: tuple[float, float] | None = None,
    hold: bool = False,
) -> pd.DataFrame:
    """Estimate the frequency response from one column of a time history to another.

    The estimate is H1 = S_uy / S_uu with the spectra of the whole time history smoothed over
    frequency by a Hann window (Ljung, *System Identification*, section 6.4). The time history must
    contain the whole motion: it must begin at rest, and it must end at rest or be much longer than
    the decay time. The estimate is corrected for the course of the input between the rows: by
    sinc²(f Δt) if the input is linear, and by sinc(f Δt) and a delay of half a row if it is held.
    For a held input an error of about f Δt remains, because its steps have power above half the
    sampling rate.

    Parameters
    ----------
    data : DataFrame
        A table with the column ``time`` (s, in equal steps), as `simulate` returns it.
    input : str
        Column of the input.
    output : str
        Column of the output.
    resolution : float, optional
        Half width of the smoothing window, Hz; by default three lines of the spectrum. A wider
        window reduces noise more, but flattens a narrow resonance: keep the resolution below ζ f,
        where f is the frequency and ζ the damping ratio of the resonance.
    band : tuple of float, optional
        Lowest and highest frequency, Hz; by default all.
    hold : bool
        True if the input is held from row to row; otherwise it is linear between rows.

    Returns
    -------
    DataFrame
        Columns ``frequency`` (Hz), ``real`` and ``imag`` (unit of the output per unit of the
        input), ``gain`` (magnitude), ``phase`` (deg, unwrapped), ``coherence`` (γ², 0 to 1) and
        ``gain_std``, the standard deviation of the gain, gain·√((1 − γ²) / (2 n γ²)) for an
        average over n lines (Bendat and Piersol, *Random Data*, chapter 9). Frequencies with
        less than 1e-4 of the input's largest power are left out.

    Raises
    ------
    FmuError
        If a column is missing or not finite, time does not increase in equal steps, or the input
        has no power in the band.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> import hubslosh
    >>> time = np.arange(0, 200, 0.05)
    >>> torque = np.where(time < 100, 0.1 * np.sin(2 * np.pi * time * (0.2 + 0.01 * time)), 0)
    >>> run = hubslosh.simulate(
    ...     parameters={"friction.model": "viscous"},
    ...     inputs=pd.DataFrame({"time": time, "tau_cmd": torque}), outputs="omega")
    >>> response = hubslosh.frequency_response(run, band=(1.0, 1.1))
    >>> round(float(response["coherence"].min()), 2)
    1.0
    """
    from scipy import fft, signal

    check_numbers(resolution=resolution)
    if band is not None:
        vector(band, 2, "band")
    time, u, y = numbers_in(data, ["time", input, output], "data")
    if len(time) < 16:
        raise FmuError(f"a frequency response needs 16 rows or more, not {len(time)}")
    step = float(np.median(np.diff(time)))
    # allow deviations of a thousandth of a step, because times in files are rounded
    uneven = np.flatnonzero(np.abs(np.diff(time) - step) > 1e-3 * step)
    if step <= 0 or len(uneven):
        row = uneven[0] if len(uneven) else 0
        raise FmuError(
            f"time must increase in equal steps; it does not after row {row}, {time[row]} s"
        )
    if not np.ptp(u):
        raise FmuError(f"{input} is constant, so its effect on the output cannot be estimated")

    line = 1 / (len(time) * step)
    if resolution is None:
        resolution = BINS * line
    if not 1.5 * line <= resolution <= 0.1 / step:
        raise FmuError(
            f"resolution must be from {1.5 * line:.3g} Hz (1.5 lines of the spectrum) to "
            f"{0.1 / step:.3g} Hz (a tenth of the sampling rate), not {resolution:.3g} Hz"
        )
    window = signal.windows.hann(2 * round(resolution / line) + 1)
    window /= window.sum()
    spectrum_u, spectrum_y = fft.rfft(u - u.mean()), fft.rfft(y - y.mean())
    frequency = np.arange(len(spectrum_u)) * line
    s_uu, s_yy, s_uy = (
        signal.fftconvolve(a, window, mode="same")
        for a in (np.abs(spectrum_u) ** 2, np.abs(spectrum_y) ** 2, spectrum_u.conj() * spectrum_y)
    )

    low, high = band or (0.0, np.inf)
    keep = (frequency > 0) & (frequency >= low) & (frequency <= high)
    keep &= s_uu >= INPUT_FLOOR * s_uu.max()
    if not keep.any():
        raise FmuError(f"{input} has no power between {low} and {high} Hz")
    frequency, s_uu, s_yy, s_uy = (a[keep] for a in (frequency, s_uu, s_yy, s_uy))
    between = np.sinc(frequency * step)
    between = between * np.exp(-1j * np.pi * frequency * step) if hold else between**2
    response = s_uy / s_uu / between
    gain = np.abs(response)
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.clip(np.abs(s_uy) ** 2 / (s_uu * s_yy), 0.0, 1.0)
        std = gain * np.sqrt((1 - coherence) * np.sum(window**2) / (2 * coherence))
    return pd.DataFrame({
        "frequency": frequency, "real": response.real, "imag": response.imag, "gain": gain,
        "phase": np.degrees(np.unwrap(np.angle(response))), "coherence": coherence, "gain_std": std,
    })  # fmt: skip
