"""Coverage and width of the 95 % intervals that the command prints, each over random draws.

    python3 harness/studies/intervals.py [--draws 100] [--program hubslosh] [--only METHOD]

Each draw is a recording of a plant whose truth is known. It has noise of the gyro, and errors of
clock, torque and scale drawn from the tolerances that the method states. The plants are closed
forms, or one run of HubSlosh.fmu. Of 100 draws a share of 0.95 is known to 0.022.
Prints the table of `book/verification.md`.
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
Result = dict[str, tuple[float, float, float]]
"""Truth and ends of each interval."""

GYRO = 4.07e-4
"""Noise of a row of the gyro, rad/s."""


class Bench:
    """Runs the command in a folder."""

    def __init__(self, program: str, fmu: str, folder: Path) -> None:
        """Keep the paths of the command, of HubSlosh.fmu and of the folder."""
        self.program, self.fmu, self.folder = program, fmu, folder

    def call(self, *arguments: str) -> str:
        """Return what the command prints."""
        done = subprocess.run(
            [self.program, *arguments], cwd=self.folder, capture_output=True, text=True, check=False
        )
        if done.returncode:
            message = f"{' '.join(arguments)}: {done.stderr}"
            raise RuntimeError(message)
        return done.stdout

    def write(self, name: str, **columns: Vector) -> None:
        """Write a table as CSV."""
        rows = np.column_stack(list(columns.values()))
        header = ",".join(columns)
        np.savetxt(self.folder / name, rows, delimiter=",", header=header, comments="", fmt="%.12g")

    def identify(self, kind: str, *arguments: str) -> dict[str, dict[str, dict[str, object]]]:
        """Return the result of `hubslosh identify`."""
        self.call("identify", kind, "draw.csv", "--out", "found.json", *arguments)
        return json.loads((self.folder / "found.json").read_text())

    def run(self, *settings: str, profile: str) -> tuple[Vector, Vector, Vector]:
        """Return time, torque and true rate of HubSlosh.fmu."""
        flags = [flag for setting in settings for flag in ("--set", setting)]
        self.call(
            "run",
            "--fmu",
            self.fmu,
            "--profile",
            profile,
            *flags,
            "--columns",
            "omega",
            "--out",
            "clean.csv",
        )
        table = np.genfromtxt(self.folder / "clean.csv", delimiter=",", names=True)
        return table["time"], table["tau_cmd"], table["omega"]


Draws = Callable[[Bench, int], Iterator[Result]]
"""Makes so many draws of a method; the results of one are its intervals."""


def ends(found: dict[str, object], truth: float) -> tuple[float, float, float]:
    """Return truth and ends; an end that is null is open."""
    low, high = found["interval"]  # type: ignore[misc]
    return truth, -np.inf if low is None else low, np.inf if high is None else high


def free_decay(bench: Bench, rng: np.random.Generator) -> Result:
    """Fit a damped oscillation of 2.3 Hz, recorded by a clock of 100 ppm."""
    f, zeta = 2.3, 0.004
    time = np.arange(0, 60, 0.02)
    natural = 2 * np.pi * f
    signal = np.exp(-zeta * natural * time) * np.cos(natural * np.sqrt(1 - zeta**2) * time + 1)
    clock = 1 + 1e-4 * rng.standard_normal()
    bench.write(
        "draw.csv",
        time=time / clock,
        wave_height=0.01 * signal + 2e-4 * rng.standard_normal(time.size),
    )
    found = bench.identify("decay")["measurement"]
    return {"frequency": ends(found["frequency"], f), "zeta": ends(found["zeta"], zeta)}


def gyro(bench: Bench, rng: np.random.Generator) -> Result:
    """Estimate white noise of a gyro at 10 Hz over half an hour."""
    truth = 1e-4
    time = 0.1 * np.arange(1 << 14)
    bench.write("draw.csv", time=time, omega=truth / np.sqrt(0.1) * rng.standard_normal(time.size))
    said = bench.call("gyro", "--recording", "draw.csv", "--chunk", "100", "--out", "gyro")
    line = next(line for line in said.splitlines() if line.startswith("angle random walk"))
    low, high = line.split("95 %: ")[1].strip(")").split(" to ") if " to " in line else ("0", "inf")
    return {"N": (truth, float(low), float(high))}


def friction(bench: Bench, rng: np.random.Generator) -> Result:
    """Fit an empty bench; the scales of torque and gyro have errors of 1 %."""
    time, torque, rate = clean(
        bench,
        "slosh.model=frozen",
        "fluid.rho=1e-6",
        profile="lin-sweep:amplitude=0.05,f0=0.1,f1=1.5,duration=120",
    )
    torque = torque / (1 + 0.01 * rng.standard_normal())
    rate = rate * (1 + 0.01 * rng.standard_normal()) + GYRO * rng.standard_normal(time.size)
    bench.write("draw.csv", time=time, tau_cmd=torque, omega=rate)
    found = bench.identify("friction", "--fmu", bench.fmu)["parameters"]
    truths = {
        "hub.I": 0.322414,
        "friction.b": 0.03793,
        "friction.c": 3.498e-3,
        "friction.d": 2.423e-3,
    }
    return {name: ends(found[name], truth) for name, truth in truths.items()}


def any_fmu(bench: Bench, rng: np.random.Generator) -> Result:
    """Fit a hub in closed form with `--free`; the scale of its torque is known to 1 %."""
    inertia, b, step = 0.35, 0.05, 0.05
    time = step * np.arange(600)
    torque = np.repeat(0.1 * (2 * rng.random(15) - 1), 40)
    keep = np.exp(-b * step / inertia)
    rate = np.zeros(time.size)
    for k in range(1, time.size):
        rate[k] = keep * rate[k - 1] + torque[k - 1] / b * (1 - keep)
    scale = 1 + 0.01 * rng.standard_normal()
    bench.write(
        "draw.csv",
        time=time,
        tau_cmd=torque / scale,
        omega=rate + 1e-3 * rng.standard_normal(time.size),
    )
    found = bench.identify(
        "fmu",
        "--fmu",
        bench.fmu,
        "--free",
        "hub.I=0.3:0.1:1,friction.b=0.04:0:1",
        "--inputs",
        "tau_cmd",
        "--held",
        "tau_cmd",
        "--outputs",
        "omega",
        "--set",
        "slosh.model=frozen",
        "--set",
        "fluid.rho=1e-6",
        "--set",
        "friction.model=viscous",
        "--tolerance",
        "scale(tau_cmd)=1%",
    )["parameters"]
    return {"hub.I": ends(found["hub.I"], inertia), "friction.b": ends(found["friction.b"], b)}


def campaign(friction: str) -> Draws:
    """Return a source of draws: features of slow sweeps, whose gyro has another seed in each.

    The truth is the feature of the run without a gyro.
    """

    def draw(bench: Bench, draws: int) -> Iterator[Result]:
        plan = f"""title = "Intervals"
profile = "lin-sweep:amplitude=0.02,f0=2.0,f1=2.6,duration=720"
[set]
slosh.model = "linear"
friction.model = "{friction}"
"""
        seeds = list(range(1, draws + 1))
        noise = f"imu.enabled = true\n[vary]\nimu.seed = {seeds}\n"
        features = ("features.csv", "features_spa.csv")
        runs = {}
        for name, text in (("clean", plan), ("noisy", plan + noise)):
            (bench.folder / f"{name}.toml").write_text(text)
            out = f"{name}-{friction}"
            bench.call("campaign", "--fmu", bench.fmu, "--plan", f"{name}.toml", "--out", out)
            for table in features:
                with (bench.folder / out / table).open() as file:
                    runs[name, table] = list(csv.DictReader(file))
        for k in range(draws):
            result = {}
            for table in features:
                for feature in ("f_res", "f_dip"):
                    truth = float(runs["clean", table][0][f"{feature}_hz"])
                    value = float(runs["noisy", table][k][f"{feature}_hz"])
                    half = 1.96 * float(runs["noisy", table][k][f"{feature}_std_hz"])
                    result[f"{feature}_hz, {table}"] = (truth, value - half, value + half)
            yield result

    return draw


def each(method: Callable[[Bench, np.random.Generator], Result]) -> Draws:
    """Return the draws of a method, which have the seeds 0, 1 and so on."""

    def draw(bench: Bench, draws: int) -> Iterator[Result]:
        for seed in range(draws):
            yield method(bench, np.random.default_rng(seed))

    return draw


CLEAN: dict[str, tuple[Vector, Vector, Vector]] = {}


def clean(bench: Bench, *settings: str, profile: str) -> tuple[Vector, Vector, Vector]:
    """Return a run without noise, which is made once."""
    if profile not in CLEAN:
        CLEAN[profile] = bench.run(*settings, profile=profile)
    return CLEAN[profile]


METHODS: dict[str, Draws] = {
    "identify decay": each(free_decay),
    "gyro --recording": each(gyro),
    "identify friction": each(friction),
    "identify --free": each(any_fmu),
    "campaign (viscous)": campaign("viscous"),
    "campaign (stribeck)": campaign("stribeck"),
}


def census(bench: Bench, only: str, draws: int) -> Iterator[str]:
    """Yield the rows of the table."""
    for name, method in METHODS.items():
        if only not in name:
            continue
        found: dict[str, list[tuple[float, float, float]]] = {}
        refused = 0
        for result in method(bench, draws):
            for parameter, interval in result.items():
                found.setdefault(parameter, []).append(interval)
        for parameter, intervals in found.items():
            given = [(t, low, high) for t, low, high in intervals if np.isfinite(high - low)]
            refused = len(intervals) - len(given)
            held = sum(low <= truth <= high for truth, low, high in given)
            width = (
                np.median([(high - low) / truth for truth, low, high in given]) if given else np.nan
            )
            share = f"{held} of {len(given)} | {100 * width:.2g} %"
            yield f"| `{name}` | `{parameter}` | {share} | {refused} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--program", default="target/release/hubslosh")
    parser.add_argument("--fmu", default="dist/HubSlosh.fmu")
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    print("| command | quantity | held | width, of the truth | without an interval |")
    print("| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(
            str(Path(args.program).resolve()), str(Path(args.fmu).resolve()), Path(folder)
        )
        for row in census(bench, args.only, args.draws):
            print(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
