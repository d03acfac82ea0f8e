"""Compares the motion of two builds of HubSlosh.fmu: the newest release and the present build.

    export PYTHONPATH=harness/python
    python3 harness/studies/compare_releases.py [--before FMU] [--now FMU] [--short]

It needs dist/HubSlosh.fmu and the package's compiled part (``cargo run --release -- pack``,
``cargo build --release -p hubslosh-native``) and Python 3.11 or newer. The first run creates a
virtual environment in the target directory and needs the network. It takes some minutes or, with
``--short`` (300 s instead of 2700 s of every sweep), some seconds.

The runs are every slosh model with every friction law of version 0.1.0, with wheel and gyro, for
300 s; and the 22 sine sweeps of Rubaga's thesis, 2700 s each, with the linear and the spherical
model. For each output and scalar local variable that both builds have, the largest difference is
divided by the maximum of the signal. The quotient must be at most 1e-13. If a motion amplifies
rounding errors, its last digits are not valid; therefore the quotient may also be up to SENSITIVE
times the quotient that the older build has when only the last bit of a parameter is changed.
Otherwise the program exits with 1. ``omega_imu`` is left out, because in version 0.1.0 the gyro
sampled one step too late from about 50 s on.
"""

import argparse
import itertools
import math
import sys
from pathlib import Path

import environment

try:
    import numpy as np
    import pandas as pd

    from hubslosh import simulate
    from hubslosh.fmu import Fmu, Value
except ModuleNotFoundError as missing:
    environment.run_again_in("cluster", missing)

ROOT = Path(__file__).resolve().parents[2]
RELEASE = next((ROOT / "dist/release").glob("HubSlosh-*[0-9].fmu"))
STEP = 0.02  # s
TOLERANCE = 1e-8
ALLOWED = 1e-13
SENSITIVE = 5
SLOSH = ("frozen", "linear", "planar", "spherical", "liquid")
FRICTION = ("none", "viscous", "stribeck_smooth", "stribeck")
AMPLITUDES = (0.0125, *(n * 0.025 for n in range(1, 11)))  # N·m

Parameters = dict[str, Value]


def sweep(amplitude: float, seconds: float) -> pd.DataFrame:
    """Return the torque (N·m) of a sweep from 1.25 to 3.5 Hz, exponential in frequency."""
    time = np.arange(round(seconds / STEP) + 1) * STEP
    rate = math.log(3.5 / 1.25) / seconds
    torque = amplitude * np.sin(math.tau * 1.25 * np.expm1(rate * time) / rate)
    return pd.DataFrame({"time": time, "tau_cmd": torque})


def runs(seconds: float) -> list[tuple[str, Parameters, pd.DataFrame]]:
    """Return the name, the parameters and the torque of every compared run."""
    all_runs: list[tuple[str, Parameters, pd.DataFrame]] = []
    torque = sweep(0.1, 300.0)
    for slosh, friction in itertools.product(SLOSH, FRICTION):
        parameters = {"slosh.model": slosh, "friction.model": friction}
        both: Parameters = {"wheel.enabled": True, "imu.enabled": True}
        all_runs.append((f"{slosh}, {friction}, 300 s", parameters | both, torque))
    for slosh, fill, amplitude in itertools.product(
        ("linear", "spherical"), (0.05, 0.1), AMPLITUDES
    ):
        name = f"{slosh}, {1000 * fill:.0f} mm, {amplitude:g} N·m"
        all_runs.append((name, {"slosh.model": slosh, "tank.h": fill}, sweep(amplitude, seconds)))
    return all_runs


def signals(*fmus: Path) -> list[str]:
    """Return the outputs and scalar local variables that all FMUs have, without gyro."""
    names = [Fmu.open(fmu).names("output", "local") for fmu in fmus]
    common = set(names[0]).intersection(*names) - {"omega_imu"}
    return [name for name in names[0] if name in common and "[" not in name and "(" not in name]


def run(fmu: Path, parameters: Parameters, torque: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    return simulate(fmu, parameters, torque, outputs=names, tolerance=TOLERANCE)


def difference(one: pd.DataFrame, other: pd.DataFrame, names: list[str]) -> tuple[float, str]:
    """Return the largest difference of two runs, and the signal in which it occurs.

    Differences are relative to the maximum of their signal.
    """
    largest = (0.0, "")
    for name in names:
        a, b = one[name].to_numpy(float), other[name].to_numpy(float)
        apart = float(np.abs(a - b).max())
        if apart > 0:
            largest = max(largest, (apart / float(np.abs(a).max() or math.ulp(0.0)), name))
    return largest


def sensitivity(fmu: Path, parameters: Parameters, torque: pd.DataFrame, names: list[str]) -> float:
    """Return the largest change of a signal if a parameter changes in its last bit.

    This is how far rounding errors alone can move the results of the run.
    """
    reference = run(fmu, parameters, torque, names)
    found = 0.0
    for name, toward in itertools.product(("hub.I", "tank.r"), (0.0, math.inf)):
        start = float(Fmu.open(fmu).variable(name).start)
        moved = parameters | {name: math.nextafter(start, toward)}
        found = max(found, difference(reference, run(fmu, moved, torque, names), names)[0])
    return found


def main() -> int:
    """Compare both builds, print a table in Markdown, and return 1 if a difference is too large."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--before", type=Path, default=RELEASE)
    parser.add_argument("--now", type=Path, default=ROOT / "dist/HubSlosh.fmu")
    parser.add_argument("--short", action="store_true", help="sweeps of 300 s")
    given = parser.parse_args()
    names = signals(given.before, given.now)
    same, close, wrong = 0, 0, 0
    print("| run | largest difference | of | last bit of a parameter | |")
    print("| --- | --- | --- | --- | --- |")
    for name, parameters, torque in runs(300.0 if given.short else 2700.0):
        before, now = (run(fmu, parameters, torque, names) for fmu in (given.before, given.now))
        apart, signal = difference(before, now, names)
        if apart == 0:
            same += 1
        elif apart <= ALLOWED:
            close += 1
        else:
            moved = sensitivity(given.before, parameters, torque, names)
            verdict = "sensitive" if apart <= SENSITIVE * moved else "TOO FAR"
            wrong += verdict == "TOO FAR"
            print(f"| {name} | {apart:.1e} | {signal} | {moved:.1e} | {verdict} |", flush=True)
    print(f"\n{len(names)} signals; {same} runs with the same bits, {close} to {ALLOWED:g}.")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
