"""Checks the results of a campaign of sweeps by an independent analysis of its stored runs.

This program is written from the definitions in book/campaign_methods.md, with numpy and scipy, and
shares no code with the harness: it has another Fourier transform, another least-squares solver and
another discretisation. If results differ by more than the tolerances below, then one of the two
programs does not follow the documentation.

    python check_analysis.py dist/campaign
"""

import argparse
import csv
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet
from numpy.typing import NDArray
from scipy import optimize, signal, stats

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Features = dict[str, float | None]

TOLERANCES = {
    "f_dip_hz": 3e-3,
    "f_res_hz": 3e-3,
    "delta_f_hz": 6e-3,
    "notch_db": 0.5,
    "fit_freq_pct": 1.5,
    "fit_time_pct": 1.5,
    "coherence": 0.05,
    "snr_res_db": 0.5,
    "snr_dip_db": 0.5,
    "skewness": 0.05,
    "kurtosis": 0.5,
    "rotary_from_hz": 3e-3,
    "rotary_to_hz": 3e-3,
    "rotary_s": 3.0,
    "swirl": 0.01,
    "off_axis_median": 1e-6,
    "off_axis_energy": 1e-6,
    "leakage": 1e-6,
}
"""Largest allowed difference between the two programs, in the unit of the column. Skewness and
kurtosis may differ because the residuals of the two fits differ slightly; sums over the same
samples may not."""


@dataclass
class Sweep:
    """A sweep from ``f0`` to ``f1`` (Hz) in ``duration`` (s)."""

    exponential: bool
    f0: float
    f1: float
    duration: float

    @classmethod
    def parse(cls, text: str) -> "Sweep":
        """Read a profile's text, such as ``exp-sweep:amplitude=0.1,f0=1.25,f1=3.5,duration=60``."""
        kind, _, rest = text.partition(":")
        if kind not in ("exp-sweep", "lin-sweep"):
            raise ValueError(f"{text} is not a sweep")
        values = dict(part.split("=") for part in rest.split(","))
        return cls(kind == "exp-sweep", *(float(values[k]) for k in ("f0", "f1", "duration")))

    def phase(self, t: Real) -> Real:
        """Phase at the time ``t``, rad."""
        if self.exponential:
            a = np.log(self.f1 / self.f0) / self.duration
            return 2 * np.pi * self.f0 * np.expm1(a * t) / a
        return 2 * np.pi * (self.f0 * t + (self.f1 - self.f0) / self.duration * t**2 / 2)

    def time_of(self, f: Real) -> Real:
        """Time, s, at which the sweep passes the frequency ``f``, Hz."""
        if self.exponential:
            return np.log(f / self.f0) / np.log(self.f1 / self.f0) * self.duration
        return (f - self.f0) / (self.f1 - self.f0) * self.duration

    def rate(self, f: float) -> float:
        """Rate of change of the sweep's frequency at the frequency ``f``, Hz/s."""
        if self.exponential:
            return abs(f * np.log(self.f1 / self.f0) / self.duration)
        return self.mean_rate

    @property
    def mean_rate(self) -> float:
        """Mean rate of change of the sweep's frequency, Hz/s."""
        return abs(self.f1 - self.f0) / self.duration

    @property
    def lag(self) -> float:
        """Longest lag of ``spa``, s: 200 for the thesis's band, but at most half the recording."""
        slower = np.sqrt(1.25 * 3.5 / (self.f0 * self.f1))
        return min(200 * slower, self.duration / 2)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency of the sweep, Hz."""
        return min(self.f0, self.f1), max(self.f0, self.f1)


def demodulate(sweep: Sweep, time: Real, torque: Real, output: Real, grid: Real) -> Complex:
    """Return Fourier coefficients of torque and output at the frequencies ``grid``, Hz.

    They are computed at the phase of the sweep, in Hann windows of at most 24 cycles.
    """
    carrier = np.exp(-1j * sweep.phase(time))
    response = np.empty(len(grid), complex)
    for i, (f, centre) in enumerate(zip(grid, sweep.time_of(grid), strict=True)):
        cycles = np.clip(0.015 * f**2 / sweep.rate(f), 3, 24)
        near = np.abs(time - centre) <= cycles / 2 / f
        window = np.cos(np.pi / cycles * f * (time[near] - centre)) ** 2 * carrier[near]
        response[i] = window @ output[near] / (window @ torque[near])
    return response


def spa(step: float, torque: Real, output: Real, grid: Real, lag: float) -> Complex:
    """Return the frequency response at ``grid``, Hz, by Blackman and Tukey's method.

    ``lag`` is the largest lag of the correlations, s, and ``step`` the time between rows, s.
    """
    u, y = torque - torque.mean(), output - output.mean()
    last = min(round(lag / step), len(u) - 1)
    lags = np.arange(-last, last + 1)
    taper = (1 + np.cos(np.pi * lags / last)) / 2
    middle = len(u) - 1

    def transformed(x: Real) -> Complex:
        covariance = signal.correlate(x, u, method="fft")[middle - last : middle + last + 1]
        # sum over all lags, in rows of 256 lags that share a phase factor
        rows = np.pad(covariance * taper, (0, -len(lags) % 256)).reshape(-1, 256)
        turn = -2j * np.pi * step * grid
        within = np.exp(np.outer(np.arange(256), turn))
        starts = np.exp(np.outer(256 * np.arange(len(rows)) - last, turn))
        return ((rows @ within) * starts).sum(axis=0)

    return transformed(y) / transformed(u)


def features(grid: Real, response: Complex) -> Features:
    """Return the antiresonance and the resonance of a frequency response.

    They are both ends of the largest rise of |H| in dB over the frequencies ``grid``.
    """
    level = 20 * np.log10(np.abs(response))
    lowest = np.minimum.accumulate(level)
    high = int(np.argmax(level - lowest))
    if level[high] - lowest[high] <= 1:
        return {}
    low = int(np.argmin(level[: high + 1]))

    def vertex(i: int) -> tuple[float, float] | None:
        if not 0 < i < len(grid) - 1:
            return None
        curve = np.polynomial.Polynomial.fit(np.log(grid[i - 1 : i + 2]), level[i - 1 : i + 2], 2)
        top = curve.deriv().roots()[0].real
        return float(np.exp(top)), float(curve(top))

    antiresonance, resonance = vertex(low), vertex(high)
    found = {"f_dip_hz": antiresonance and antiresonance[0], "f_res_hz": resonance and resonance[0]}
    if antiresonance and resonance:
        found |= {
            "delta_f_hz": resonance[0] - antiresonance[0],
            "notch_db": resonance[1] - antiresonance[1],
        }
    return found


@dataclass
class Model:
    """Transfer function ``numerator(s) / ((s + p) (s² + 2 ζ ω s + ω²))``, s in rad/s.

    Coefficients begin with the highest power of s.
    """

    numerator: Real
    p: float
    omega: float
    zeta: float

    def denominator(self) -> Real:
        """Return the coefficients of the denominator, the highest power first."""
        pair = [1, 2 * self.zeta * self.omega, self.omega**2]
        return np.polymul([1, self.p], pair)

    def response(self, grid: Real) -> Complex:
        """Frequency response H of the model at the frequencies ``grid``, Hz."""
        s = 2j * np.pi * grid
        return np.polyval(self.numerator, s) / np.polyval(self.denominator(), s)


def fit(grid: Real, measured: Complex) -> Model:
    """Fit a model to a complex response at the frequencies ``grid`` by least squares.

    The poles are optimised; for given poles the numerator follows from linear least squares.
    """
    unit = 2 * np.pi * grid.mean()
    s = 2j * np.pi * grid / unit
    target = np.concatenate([measured.real, measured.imag])

    def solved(logarithms: Real) -> tuple[Real, Real]:
        p, omega, zeta = np.exp(logarithms)
        columns = np.stack([s**2, s, s**0]) / ((s + p) * (s**2 + 2 * zeta * omega * s + omega**2))
        matrix = np.concatenate([columns.real, columns.imag], axis=1).T
        numerator = np.linalg.lstsq(matrix, target)[0]
        return numerator, matrix @ numerator - target

    resonance = grid[np.argmax(np.abs(measured))] * 2 * np.pi / unit
    starts = [(0.05, resonance * shift, zeta) for shift in (1, 0.97) for zeta in (0.005, 0.05)]
    bounds = ([-18, np.log(0.1), -12], [5, np.log(10), 3])
    best = min(
        (
            optimize.least_squares(lambda x: solved(x)[1], np.log(start), bounds=bounds)
            for start in starts
        ),
        key=lambda found: found.cost,
    )
    p, omega, zeta = np.exp(best.x)
    numerator = solved(best.x)[0] * unit ** np.arange(1, 4)
    return Model(numerator, p * unit, omega * unit, zeta)


def residual_of(model: Model, step: float, torque: Real, rate: Real) -> Real:
    """Return the measured rate minus the rate of ``model`` under the same torque.

    ``step`` is the time between rows, s. The torque is interpolated linearly; the initial state of
    the model is fitted.
    """
    driven = signal.TransferFunction(model.numerator, model.denominator()).to_ss()
    time = np.arange(len(torque)) * step
    _, forced, _ = signal.lsim(driven, torque, time)
    poles = np.roots(model.denominator())
    free = np.concatenate([[np.exp(p * time).real, np.exp(p * time).imag] for p in poles]).T
    # columns of conjugate poles coincide, and the imaginary part of the real pole's column is 0;
    # lstsq then returns the solution with the smallest norm
    missing = rate - rate.mean() - forced
    return missing - free @ np.linalg.lstsq(free, missing, rcond=1e-9)[0]


def coherence(step: float, torque: Real, output: Real, length: int) -> tuple[Real, Real]:
    """Return Welch's coherence of torque and output.

    It uses half-overlapping, zero-padded Hamming windows of ``length`` rows, which are ``step`` s
    apart.
    """
    window = signal.windows.hamming(length, sym=True)
    return signal.coherence(
        torque - torque.mean(),
        output - output.mean(),
        fs=1 / step,
        window=window,
        noverlap=length - length // 2,
        nfft=4 * length,
        detrend=False,
    )


def analyse(path: Path) -> tuple[Features, Features]:
    """Return the features of ``features.csv`` and of ``features_spa.csv`` for a stored sweep."""
    file = pyarrow.parquet.ParquetFile(path)
    notes = {k.decode(): v.decode() for k, v in file.metadata.metadata.items()}
    columns = file.read()
    time, torque, rate, radial, tangential, force_r, force_t = (
        columns[name].to_numpy()
        for name in (
            "time",
            "tau_cmd",
            "omega_imu",
            "slosh_angle_radial",
            "slosh_angle",
            "F_radial",
            "F_tangential",
        )
    )
    sweep, step = Sweep.parse(notes["profile"]), float(notes["step"])
    grid = np.geomspace(*sweep.band, 2000)
    longest = 2 * len(time) // 9
    values: Features = {}

    whole = spa(step, torque, rate, grid, sweep.lag)
    spa_features = features(grid, whole)
    model = fit(grid, whole)
    miss = np.linalg.norm(whole - model.response(grid))
    values["fit_freq_pct"] = 100 * (1 - miss / np.linalg.norm(whole - whole.mean()))
    residual = residual_of(model, step, torque, rate)
    lost = np.linalg.norm(residual) / np.linalg.norm(rate - rate.mean())
    values["fit_time_pct"] = 100 * (1 - lost)
    values["skewness"] = float(stats.skew(residual))
    values["kurtosis"] = float(stats.kurtosis(residual, fisher=False))
    antiresonance, resonance = spa_features.get("f_dip_hz"), spa_features.get("f_res_hz")
    if antiresonance and resonance:
        segment = np.sqrt(1 / (3 * sweep.mean_rate))
        f, gamma = coherence(step, torque, residual, min(round(segment / step), longest))
        values["coherence"] = float(gamma[(f >= antiresonance) & (f <= resonance)].mean())
        f, gamma = coherence(step, torque, rate, longest)
        snr = 10 * np.log10(gamma / (1 - gamma))
        values["snr_res_db"] = float(snr[np.argmin(np.abs(f - resonance))])
        values["snr_dip_db"] = float(snr[np.argmin(np.abs(f - antiresonance))])

    amplitude = abs(float(notes["profile"].split("amplitude=")[1].split(",")[0]))
    x, y, force = (demodulate(sweep, time, torque, s, grid) for s in (radial, tangential, force_r))
    power = np.abs(x) ** 2 + np.abs(y) ** 2
    swirl = np.where(np.sqrt(power) * amplitude < 0.02, 0, 2 * (x * y.conj()).imag / power)
    turning = np.abs(swirl) > 0.5
    values["swirl"] = float(swirl[np.argmax(np.abs(swirl))])
    share = np.abs(np.gradient(sweep.time_of(grid), edge_order=1))
    share[[0, -1]] /= 2
    values["rotary_s"] = float(share[turning].sum())
    values["rotary_from_hz"] = float(grid[turning][0]) if turning.any() else None
    values["rotary_to_hz"] = float(grid[turning][-1]) if turning.any() else None
    squares = force_r**2, force_r**2 + force_t**2
    some = squares[1] > 0
    values["off_axis_median"] = float(np.median(squares[0][some] / squares[1][some]))
    values["off_axis_energy"] = float(squares[0].sum() / squares[1].sum())
    # the arm of the tank is not stored as a signal; it is in the settings, or the FMU's start value
    settings = dict(pair.split("=", 1) for pair in notes["settings"].split())
    arm = float(settings.get("tank.r", 0.225))
    values["leakage"] = float(np.sqrt(np.mean(np.abs(arm * force) ** 2)))

    swept = features(grid, demodulate(sweep, time, torque, rate, grid))
    return values | swept, values | spa_features


def compare(
    campaign: Path, analyse: Callable[[Path], tuple[Features, Features]] = analyse
) -> list[str]:
    """Analyse all runs of a campaign; return one line for each feature that differs too much."""
    rows = {}
    with (campaign / "runs.csv").open(newline="") as file:
        rows["features.csv"] = [row for row in csv.DictReader(file) if not row["error"]]
    with (campaign / "features_spa.csv").open(newline="") as file:
        rows["features_spa.csv"] = list(csv.DictReader(file))
    names = [row["name"] for row in rows["features.csv"]]
    worst: dict[str, float] = {}
    differences = []
    for i, name in enumerate(names):
        print(f"{name} ({i + 1} of {len(names)})", file=sys.stderr)
        ours = analyse(campaign / "runs" / f"{name}.parquet")
        for table, values in zip(rows, ours, strict=True):
            for column, tolerance in TOLERANCES.items():
                text, value = rows[table][i][column], values.get(column)
                if (text == "") != (value is None):
                    differences.append(f"{name}: {column} is {text or 'empty'}, here {value}")
                elif value is not None:
                    miss = abs(float(text) - value)
                    worst[column] = max(worst.get(column, 0), miss)
                    if not miss <= tolerance:
                        differences.append(
                            f"{name}: {column} of {table} is {text}, here {value:.6g}, "
                            f"allowed {tolerance}"
                        )
    for column, miss in worst.items():
        print(f"{column}: largest difference {miss:.2g} (allowed {TOLERANCES[column]})")
    return differences


def main() -> None:
    """Compare the tables of a campaign with this analysis; exit with 1 if they differ."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("campaign", type=Path, help="directory with the results of a campaign")
    campaign = parser.parse_args().campaign
    if not (campaign / "runs.csv").is_file():
        parser.error(f"{campaign} has no runs.csv; hubslosh campaign --out {campaign} writes it")
    differences = compare(campaign)
    print("\n".join(differences) or "the tables agree with this analysis")
    sys.exit(bool(differences))


if __name__ == "__main__":
    main()
