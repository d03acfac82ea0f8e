"""Frequency responses from time histories, by scipy.signal.

This is an estimate of its own, independent of the one in the program ``hubslosh``.
"""

import numpy as np
import pandas as pd

from .fmu import FmuError, did_you_mean

SEGMENTS = 8
"""Into how many lengths a record is cut unless a resolution is given; they overlap by half."""

INPUT_FLOOR = 1e-4
"""Where the input's power density is below this part of its maximum there is no estimate."""


def frequency_response(
    data: pd.DataFrame,
    input: str = "tau_cmd",
    output: str = "omega",
    *,
    resolution: float | None = None,
    band: tuple[float, float] | None = None,
) -> pd.DataFrame:
    """Estimate the frequency response from one column of a time history to another.

    data: a table with the column ``time`` (s, in equal steps), as `simulate` returns it.
    resolution: length of the segments' reciprocal, Hz; by default eight lengths in the record. A
    resonance is met where it is several times as wide: ζ f > resolution.
    band: lowest and highest frequency wanted, Hz; by default all.

    The estimate is Welch's: H1 = S_uy / S_uu, averaged over Hann-windowed segments that overlap by
    half (Bendat and Piersol, *Random Data*, chapter 6). Frequencies at which the input's power is
    less than 1e-4 of its largest are left out.

    Returns a table with the columns ``frequency`` (Hz), ``real`` and ``imag`` (unit of the output
    per unit of the input), ``gain`` (their magnitude), ``phase`` (deg, unwrapped), ``coherence``
    (0 to 1) and ``gain_std``, the gain's standard deviation gain·√((1 − γ²) / (2 n γ²)) for n
    segments (Bendat and Piersol, chapter 9).
    """
    from scipy import signal

    problems = [
        f"data has no column {name}{did_you_mean(name, map(str, data.columns))}"
        for name in ("time", input, output)
        if name not in data.columns
    ]
    if problems:
        raise FmuError("; ".join(problems))
    time, u, y = (data[name].to_numpy(float) for name in ("time", input, output))
    for name, values in (("time", time), (input, u), (output, y)):
        if not np.isfinite(values).all():
            raise FmuError(f"{name} is not finite in row {np.flatnonzero(~np.isfinite(values))[0]}")
    if len(time) < 16:
        raise FmuError(f"a frequency response needs 16 rows or more, not {len(time)}")
    step = (time[-1] - time[0]) / (len(time) - 1)
    # one row off by a thousandth of a step is what times rounded in a file may be
    uneven = np.flatnonzero(np.abs(np.diff(time) - step) > 1e-3 * step)
    if step <= 0 or len(uneven):
        row = uneven[0] if len(uneven) else 0
        raise FmuError(f"time must grow in equal steps; it does not after row {row}, {time[row]} s")
    if not np.ptp(u):
        raise FmuError(f"{input} does not change; nothing can be said about its effect")

    duration = len(time) * step
    if resolution is None:
        resolution = SEGMENTS / duration
    if not 1 / duration <= resolution <= 1 / (16 * step):
        raise FmuError(
            f"resolution must be from {1 / duration:.3g} Hz (one segment) to "
            f"{1 / (16 * step):.3g} Hz (16 rows), not {resolution:.3g} Hz"
        )
    length = round(1 / (resolution * step))
    options = {"fs": 1 / step, "nperseg": length, "noverlap": length // 2, "detrend": "constant"}
    frequency, s_uu = signal.welch(u, **options)
    _, s_yy = signal.welch(y, **options)
    _, s_uy = signal.csd(u, y, **options)
    segments = max(1, (len(u) - length // 2) // (length - length // 2))

    low, high = band or (0.0, np.inf)
    keep = (frequency > 0) & (frequency >= low) & (frequency <= high)
    keep &= s_uu >= INPUT_FLOOR * s_uu.max()
    if not keep.any():
        raise FmuError(f"{input} has no power between {low} and {high} Hz")
    frequency, s_uu, s_yy, s_uy = (a[keep] for a in (frequency, s_uu, s_yy, s_uy))
    response = s_uy / s_uu
    gain = np.abs(response)
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.clip(np.abs(s_uy) ** 2 / (s_uu * s_yy), 0.0, 1.0)
        if segments == 1:
            coherence[:] = np.nan  # of a single segment it is always 1
        std = gain * np.sqrt((1 - coherence) / (2 * segments * coherence))
    return pd.DataFrame(
        {
            "frequency": frequency,
            "real": response.real,
            "imag": response.imag,
            "gain": gain,
            "phase": np.degrees(np.unwrap(np.angle(response))),
            "coherence": coherence,
            "gain_std": std,
        }
    )
