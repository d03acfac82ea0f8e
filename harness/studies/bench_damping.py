"""Compares models of damping and of the onset of rotary slosh with measurements on a bench.

    PYTHONPATH=harness/python python3 harness/studies/bench_damping.py [--jobs N] [--out FILE.csv]

It needs dist/HubSlosh.fmu (``cargo run --release -- pack``) and the packages in requirements.txt.
It simulates sine sweeps of 1.25 to 3.5 Hz in 2700 s, for both fills of the bench, with:

* `slosh.model`: linear, spherical, liquid,
* `slosh.zeta_amplitude`: 0 to 0.016 1/rad,
* disturbances of a real bench that can start rotary slosh (`SEEDS`).

For each model it prints the largest angular acceleration of the hub at the torque amplitudes 0.25
and 0.0125 N·m, by central differences of the rate at 50 Hz; for 0.0125 N·m also from the rate that
the specified gyro measures. It also prints the smallest amplitude of `LADDER` at which the slosh
becomes rotary. Rubaga's thesis has 2.21 and 0.222 rad/s², and rotary slosh from 0.075 to 0.1 N·m.
The output is the tables of book/damping.md. Some 370 runs take half an hour of CPU time.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

import hubslosh

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "dist" / "HubSlosh.fmu"

FIRST, LAST, DURATION, STEP = 1.25, 3.5, 2700.0, 0.02  # Hz, Hz, s, s
LADDER = (0.05, 0.06, 0.075, 0.1, 0.125, 0.15, 0.2, 0.25)  # N·m
SMALL, LARGE = 0.0125, 0.25  # N·m
FILLS = (0.05, 0.10)  # m
MODELS = ("linear", "spherical", "liquid")
GROWTHS = (0.0, 0.012, 0.016)  # 1/rad

# Disturbances that can start rotary slosh: parameters, and the standard deviation of white torque
# noise at 50 Hz, N·m.
SEEDS = {
    "none": ({}, 0.0),
    "waves": ({"init.slosh_angle_radial": np.radians(2.0)}, 0.0),
    "tilt": ({"bench.tilt": np.radians(0.5), "hub.imbalance": 0.05}, 0.0),
    "noise": ({}, 2e-3),
}

# Slosh counts as rotary if, over two seconds, the radial amplitude is at least half the tangential
# amplitude and above 3 degrees.
WINDOW, SHARE, LEAST = 2.0, 0.5, np.radians(3.0)


def sweep(amplitude: float, noise: float) -> pd.DataFrame:
    """Return the inputs of a run: the thesis's torque sweep, linear in frequency, and noise.

    ``amplitude`` and ``noise`` (standard deviation) are torques, N·m.
    """
    time = np.arange(round(DURATION / STEP)) * STEP
    phase = 2 * np.pi * (FIRST * time + (LAST - FIRST) / (2 * DURATION) * time**2)
    columns = {"time": time, "tau_cmd": amplitude * np.sin(phase)}
    if noise > 0:
        columns["tau_ext"] = np.random.default_rng(1).normal(0.0, noise, len(time))
    return pd.DataFrame(columns)


def largest_acceleration(rate: pd.Series) -> float:
    """Return the largest angular acceleration, rad/s², by central differences of the rate."""
    values = rate.to_numpy()
    return float(np.abs(values[2:] - values[:-2]).max() / (2 * STEP))


def swirls(run: pd.DataFrame) -> bool:
    """Return True if the slosh is rotary in any window of the run."""
    count = round(WINDOW / STEP)
    whole = len(run) // count * count
    swing = [
        np.ptp(run[name].to_numpy()[:whole].reshape(-1, count), axis=1) / 2
        for name in ("slosh_angle_radial", "slosh_angle")
    ]
    return bool(np.any((swing[0] > LEAST) & (swing[0] > SHARE * swing[1])))


def drive(model: str, growth: float, fill: float, seed: str, amplitude: float) -> pd.DataFrame:
    """Simulate one sweep of the bench.

    ``growth`` is the growth of damping with amplitude, ``fill`` the depth in m, ``seed`` the name
    of noise in `SEEDS`, and ``amplitude`` the amplitude of the torque, N·m.
    """
    more, noise = SEEDS[seed]
    parameters = {
        "slosh.model": model,
        "slosh.zeta_amplitude": growth,
        "tank.h": fill,
        "imu.enabled": True,
        **more,
    }
    outputs = ["omega", "omega_imu", "slosh_angle", "slosh_angle_radial"]
    return hubslosh.simulate(
        FMU, parameters=parameters, inputs=sweep(amplitude, noise), outputs=outputs
    )


def case(key: tuple[str, float, float, str]) -> dict[str, object]:
    """Return accelerations and onset of rotary slosh for one combination of `cases`."""
    model, growth, fill, seed = key
    row: dict[str, object] = dict(
        zip(("model", "zeta_amplitude", "fill_m", "seed"), key, strict=True)
    )
    run = partial(drive, model, growth, fill, seed)
    small = run(SMALL)
    row["peak_small"] = largest_acceleration(small["omega"])
    row["peak_small_gyro"] = largest_acceleration(small["omega_imu"])
    try:
        row["peak_large"] = largest_acceleration(run(LARGE)["omega"])
    except hubslosh.RunError as why:
        row["refused"] = str(why)
    row["swirl_from"] = np.nan
    if model != "linear":
        for amplitude in LADDER:
            try:
                if swirls(run(amplitude)):
                    row["swirl_from"] = amplitude
                    break
            except hubslosh.RunError as why:
                row["refused"] = str(why)
                break
    return row


def cases() -> list[tuple[str, float, float, str]]:
    """Return all cases: slosh model, growth of damping, fill and seed.

    The linear model has only one seed, because its liquid always stays in its plane.
    """
    every = product(MODELS, GROWTHS, FILLS, SEEDS)
    return [key for key in every if key[0] != "linear" or key[3] == "none"]


HEADS = (
    "ζ_A, 1/rad",
    "disturbance",
    "largest hub acceleration at 0.25 N·m, rad/s²",
    "largest hub acceleration at 0.0125 N·m, rad/s²",
    "largest acceleration at 0.0125 N·m as read by the gyro, rad/s²",
    "rotary slosh begins at, N·m",
)
MEASURED = "| measured on the bench (thesis 7.1, 7.2) | | | 2.21 | | 0.222 | 0.075 to 0.1 |"


def text(rows: pd.DataFrame) -> str:
    """Return the tables in Markdown."""
    lines = []
    for fill in FILLS:
        lines.append(" | ".join((f"| {fill * 100:.0f} cm fill: slosh model", *HEADS)) + " |")
        lines.append("| --- " * (1 + len(HEADS)) + "|")
        for row in rows[rows["fill_m"] == fill].itertuples():
            large = "leaves its range" if np.isnan(row.peak_large) else f"{row.peak_large:.2f}"
            onset = "none" if np.isnan(row.swirl_from) else f"{row.swirl_from:g}"
            small, noisy = f"{row.peak_small:.3f}", f"{row.peak_small_gyro:.3f}"
            swirl = "-" if row.model == "linear" else onset
            cells = (row.model, f"{row.zeta_amplitude:g}", row.seed, large, small, noisy, swirl)
            lines.append(f"| {' | '.join(cells)} |")
        lines += [MEASURED, ""]
    return "\n".join(lines)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--jobs", type=int, default=2, help="processes")
    options.add_argument("--out", type=Path, help="also write the rows to this CSV file")
    given = options.parse_args()
    with ProcessPoolExecutor(given.jobs) as pool:
        rows = pd.DataFrame(pool.map(case, cases()))
    if "peak_large" not in rows:
        rows["peak_large"] = np.nan
    if given.out:
        rows.to_csv(given.out, index=False)
    print(text(rows))


if __name__ == "__main__":
    main()
