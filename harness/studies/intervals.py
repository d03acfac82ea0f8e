"""Measures coverage and width of the 95 % intervals that the program prints, over random draws.

    python3 harness/studies/intervals.py [--draws 100] [--program hubslosh] [--only METHOD]

Each draw is a recording of a plant with known true values. It has noise of the gyro, and errors of
clock, torque and scale that are drawn from the tolerances of the method. The plants are closed
forms, or one run of HubSlosh.fmu. With 100 draws, a coverage of 0.95 has a standard deviation of
0.022.

`design` predicts standard deviations before a recording exists. For `design`, the last column is
the ratio of the predicted width to the width that `identify` finds from the recordings of the
draws: the median, and the range of nine tenths of the draws.

The output is the tables of `book/verification.md`.
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
Result = dict[str, tuple[float, ...]]
"""True value and interval ends by quantity; for `design` also predicted over fitted width."""

GYRO = 4.07e-4
"""Standard deviation of the gyro's noise in one row, rad/s."""


class Bench:
    """Runs the command `hubslosh` in a folder."""

    def __init__(self, program: str, fmu: str, folder: Path) -> None:
        self.program, self.fmu, self.folder = program, fmu, folder

    def call(self, *arguments: str) -> str:
        done = subprocess.run(
            [self.program, *arguments], cwd=self.folder, capture_output=True, text=True, check=False
        )
        if done.returncode:
            message = f"{' '.join(arguments)}: {done.stderr}"
            raise RuntimeError(message)
        return done.stdout

    def write(self, name: str, **columns: Vector) -> None:
        rows = np.column_stack(list(columns.values()))
        header = ",".join(columns)
        np.savetxt(self.folder / name, rows, delimiter=",", header=header, comments="", fmt="%.12g")

    def identify(self, kind: str, *arguments: str) -> dict[str, dict[str, dict[str, object]]]:
        """Return the result of `hubslosh identify`."""
        self.call("identify", kind, "draw.csv", "--out", "found.json", *arguments)
        return json.loads((self.folder / "found.json").read_text())

    def run(self, *settings: str, profile: str) -> tuple[Vector, Vector, Vector]:
        """Simulate HubSlosh.fmu; return time, torque and true rate."""
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
"""Function that yields the intervals of a method for each of a number of draws."""


def ends(found: dict[str, object], truth: float) -> tuple[float, float, float]:
    """Return the true value and the ends of the interval in ``found``; null means infinity."""
    low, high = found["interval"]  # type: ignore[misc]
    return truth, -np.inf if low is None else low, np.inf if high is None else high


def free_decay(bench: Bench, rng: np.random.Generator) -> Result:
    """Fit a decaying oscillation of 2.3 Hz, recorded with a clock error of up to 100 ppm.

    Compared with small amplitudes, at the initial amplitude of 10 mm the damping is twice as large
    and the frequency 0.5 % lower.
    """
    f, zeta, growth, hardening, start = 2.3, 0.004, 0.4, -50.0, 0.01
    time = np.arange(0, 60, 0.02)
    natural = 2 * np.pi * f
    left = np.exp(-zeta * natural * time)
    size = start * left / (1 + growth * start * (1 - left) / zeta)
    square = np.cumsum(np.append(0, 0.01 * (size[1:] ** 2 + size[:-1] ** 2)))
    phase = natural * (np.sqrt(1 - zeta**2) * time + hardening * square) + 1
    clock = 1 + 1e-4 * rng.standard_normal()
    bench.write(
        "draw.csv",
        time=time / clock,
        wave_height=size * np.cos(phase) + 2e-4 * rng.standard_normal(time.size),
    )
    found = bench.identify("decay")["measurement"]
    truths = {"frequency": f, "zeta": zeta, "zeta_amplitude": growth, "hardening": hardening}
    return {name: ends(found[name], truth) for name, truth in truths.items()}


def gyro(bench: Bench, rng: np.random.Generator) -> Result:
    """Estimate the white noise of a gyro from half an hour at 10 Hz."""
    truth = 1e-4
    time = 0.1 * np.arange(1 << 14)
    bench.write("draw.csv", time=time, omega=truth / np.sqrt(0.1) * rng.standard_normal(time.size))
    said = bench.call("gyro", "--recording", "draw.csv", "--chunk", "100", "--out", "gyro")
    line = next(line for line in said.splitlines() if line.startswith("angle random walk"))
    low, high = line.split("95 %: ")[1].strip(")").split(" to ") if " to " in line else ("0", "inf")
    return {"N": (truth, float(low), float(high))}


def friction(bench: Bench, rng: np.random.Generator) -> Result:
    """Fit friction and inertia of an empty bench; torque and gyro have scale errors of 1 %."""
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


FREE = {"hub.I": 0.35, "friction.b": 0.05}
"""True values of the parameters in `any_fmu`."""


def any_fmu(bench: Bench, rng: np.random.Generator) -> Result:
    """Identify the parameters of a hub, simulated in closed form, by ``identify fmu``.

    The scale of its torque is known to 1 %.
    """
    found, _ = free_fit(bench, rng)
    return {name: ends(found[name], truth) for name, truth in FREE.items()}


def planned_free(bench: Bench, rng: np.random.Generator) -> Result:
    """Predict the intervals of the fit in `any_fmu` by `design`, from the torque only."""
    found, asked = free_fit(bench, rng)
    # the predictions are valid near the expected values; here the true values are expected
    expected = ",".join(f"{name}={truth}:0.001:1" for name, truth in FREE.items())
    asked[asked.index("--free") + 1] = expected
    stated = bench.call("design", "torque.csv", *asked, "--noise", "omega=1e-3", "--json")
    planned = {bound["name"]: bound["std"] for bound in json.loads(stated)}
    return {name: foretold(found[name], truth, planned[name]) for name, truth in FREE.items()}


def free_fit(
    bench: Bench, rng: np.random.Generator
) -> tuple[dict[str, dict[str, object]], list[str]]:
    """Return the parameters that `identify fmu` finds, and the flags that `design` also accepts."""
    inertia, b = FREE.values()
    step = 0.05
    time = step * np.arange(600)
    torque = np.repeat(0.1 * (2 * rng.random(15) - 1), 40)
    keep = np.exp(-b * step / inertia)
    rate = np.zeros(time.size)
    for k in range(1, time.size):
        rate[k] = keep * rate[k - 1] + torque[k - 1] / b * (1 - keep)
    scale = 1 + 0.01 * rng.standard_normal()
    measured = rate + 1e-3 * rng.standard_normal(time.size)
    bench.write("draw.csv", time=time, tau_cmd=torque / scale, omega=measured)
    bench.write("torque.csv", time=time, tau_cmd=torque / scale)
    asked = ["--fmu", bench.fmu, "--free", "hub.I=0.3:0.1:1,friction.b=0.04:0:1"]
    asked += ["--inputs", "tau_cmd:held", "--outputs", "omega"]
    for setting in ("slosh.model=frozen", "fluid.rho=1e-6", "friction.model=viscous"):
        asked += ["--set", setting]
    asked += ["--tolerance", "scale(tau_cmd)=1%"]
    return bench.identify("fmu", *asked)["parameters"], asked


def foretold(found: dict[str, object], truth: float, std: float) -> tuple[float, ...]:
    """Return the true value, the interval that `design` predicts, and a ratio.

    The ratio is the predicted standard deviation ``std`` divided by the standard deviation of the
    fit.
    """
    value, fitted = float(found["value"]), float(found["std"])  # type: ignore[arg-type]
    return truth, value - 1.96 * std, value + 1.96 * std, std / fitted


def planned_bench(bench: Bench, draws: int) -> Iterator[Result]:
    """Design an optimal multisine for the bench; in each draw its gyro has another seed.

    `design` predicts the part of a standard deviation that noise causes, `std_noise` of the fit.
    """
    model = ["--set", "slosh.model=linear"]
    plan = ["--multisine", "0.25", "--period", "300", "--duration", "600", "--optimal"]
    plan += ["--sensor-errors", "--out", "torque.csv", "--json"]
    planned = json.loads(bench.call("design", "--fmu", bench.fmu, *plan, *model))["parameters"]
    for seed in range(1, draws + 1):
        gyro = ["--set", "imu.enabled=true", "--set", f"imu.seed={seed}"]
        command = ["--input", "torque.csv", "--columns", "omega_imu", "--out", "draw.csv"]
        bench.call("run", "--fmu", bench.fmu, *command, *model, *gyro)
        columns = ["--columns", "omega=omega_imu", "--model", "linear"]
        result = bench.identify("bench", "--fmu", bench.fmu, *columns)
        found = result["parameters"] | result["measurement"]
        # leave out the bias, which has no single true value because it drifts
        yield {
            name: foretold(
                found[name] | {"std": found[name]["std_noise"]}, bound["value"], bound["std_noise"]
            )
            for name, bound in planned.items()
            if name in found
        }


def campaign(friction: str) -> Draws:
    """Return a function that yields features of a slow sweep, each with another seed of gyro noise.

    The true value is the feature of the sweep without gyro noise.
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
        features = {
            "features.csv": "by demodulation",
            "features_spa.csv": "by spectral analysis (spa)",
        }
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
            for table, method in features.items():
                for feature, name in (("f_res", "resonance"), ("f_dip", "antiresonance")):
                    truth = float(runs["clean", table][0][f"{feature}_hz"])
                    value = float(runs["noisy", table][k][f"{feature}_hz"])
                    half = 1.96 * float(runs["noisy", table][k][f"{feature}_std_hz"])
                    result[f"{name}, {method}"] = (truth, value - half, value + half)
            yield result

    return draw


def tank_damping(bench: Bench, rng: np.random.Generator) -> Result:
    """Compute the damping of random tanks with a measured shape, and with nearly this shape.

    Heights of the latter differ by up to 5 %. True values are three fits to measurements in NASA
    SP-106, two for cylinders and one for spheres, but at least the damping of the wall's boundary
    layer.
    """
    nu, g = 10 ** rng.uniform(-6.5, -5.5), 10 ** rng.uniform(-1, 1)
    radius, off = rng.uniform(0.05, 0.5), rng.uniform(-0.05, 0.05)
    number = nu / np.sqrt(g * radius**3)
    deep = rng.uniform(0.5, 2)
    sinh = np.sinh(1.84 * deep)
    bottom = 0.318 / sinh * (1 + (1 - deep) / np.cosh(1.84 * deep))
    mikishev = 0.79 * np.sqrt(number) * (1 + bottom)
    shallow = rng.uniform(0.1, 2)
    stephens = 5.23 / (2 * np.pi) * np.sqrt(number) * np.tanh(1.84 * shallow) ** -0.25
    stephens *= 1 + 2 * (1 - shallow) / np.sinh(3.68 * shallow)
    # the measurements cover B = 1e4 nu/sqrt(g D^3) from 0.01 to 1
    part, size = rng.uniform(0.1, 1.9), 10 ** rng.uniform(-2, 0)
    ball = (1e-4 * size / nu * np.sqrt(g)) ** (-2 / 3) / 2
    upper = (1 + 0.46 * (2 - part)) / (1.46 * (2 - part)) if part > 1 else 1 / part
    sumner = 0.131 / (2 * np.pi) * size**0.359 * upper

    def interval(shape: str, depth: float) -> tuple[float, float]:
        (bench.folder / "tank.toml").write_text(f"density = 1000\n{shape}\n")
        numbers = {"--fill": depth, "--nu": nu, "--gravity": g, "--modes": 1}
        flags = [text for flag in numbers for text in (flag, f"{numbers[flag]:.15g}")]
        bench.call("tank", "tank.toml", *flags, "--out", "tank.json")
        found = json.loads((bench.folder / "tank.json").read_text())
        low, high = found["damping"]["modes"][0]["interval"]
        return low, high

    def cylinder(depth: float) -> tuple[float, float]:
        shape = f"shape = {{ cylinder = {{ radius = {radius}, height = {3 * radius} }} }}"
        return interval(shape, depth * radius)

    def dished(depth: float) -> tuple[float, float]:
        """Return the interval of a cylinder whose bottom is a flat cone."""
        rise, top = abs(off) * radius, 3 * radius
        bottom, wall = [0, 0, radius, rise], [radius, rise, radius, top]
        profile = f"{{ line = {bottom} }}, {{ line = {wall} }}"
        return interval(f"profile = [{profile}]", depth * radius)

    def spheroid(factor: float) -> tuple[float, float]:
        half = factor * ball
        kind = f"spheroid = {{ radius = {ball}, half_height = {half} }}"
        return interval(f"shape = {{ {kind} }}", part * half)

    return {
        "cylinder, Mikishev and Dorozhkin": (mikishev, *cylinder(deep)),
        "cylinder, Stephens and others": (stephens, *cylinder(shallow)),
        "nearly a cylinder, Mikishev and Dorozhkin": (mikishev, *dished(deep)),
        "sphere, Sumner and Stofan": (sumner, *spheroid(1)),
        "nearly a sphere, Sumner and Stofan": (sumner, *spheroid(1 + off)),
    }


def each(method: Callable[[Bench, np.random.Generator], Result]) -> Draws:
    """Return a function that yields the result of ``method`` for each of the seeds 0, 1, 2, …."""

    def draw(bench: Bench, draws: int) -> Iterator[Result]:
        for seed in range(draws):
            yield method(bench, np.random.default_rng(seed))

    return draw


CLEAN: dict[str, tuple[Vector, Vector, Vector]] = {}


def clean(bench: Bench, *settings: str, profile: str) -> tuple[Vector, Vector, Vector]:
    """Return a run without noise; each run is simulated only once."""
    if profile not in CLEAN:
        CLEAN[profile] = bench.run(*settings, profile=profile)
    return CLEAN[profile]


METHODS: dict[str, Draws] = {
    "identify decay": each(free_decay),
    "gyro --recording": each(gyro),
    "identify friction": each(friction),
    "identify fmu": each(any_fmu),
    "tank --nu": each(tank_damping),
    "design --free": each(planned_free),
    "design": planned_bench,
    "campaign (viscous)": campaign("viscous"),
    "campaign (stribeck)": campaign("stribeck"),
}


def census(bench: Bench, only: str, draws: int) -> Iterator[str]:
    """Yield a row of the table for each quantity that the command estimates with an interval."""
    for name, method in METHODS.items():
        if only not in name:
            continue
        found: dict[str, list[tuple[float, ...]]] = {}
        refused = 0
        for result in method(bench, draws):
            for parameter, interval in result.items():
                found.setdefault(parameter, []).append(interval)
        for parameter, intervals in found.items():
            given = [of[:3] for of in intervals if np.isfinite(of[2] - of[1])]
            refused = len(intervals) - len(given)
            held = sum(low <= truth <= high for truth, low, high in given)
            width = (
                np.median([(high - low) / abs(truth or np.nan) for truth, low, high in given])
                if given
                else np.nan
            )
            wide = "-" if np.isnan(width) else f"{100 * width:.2g} %"
            ratios = [interval[3] for interval in intervals if len(interval) > 3]
            of_fit = "-"
            if ratios:
                low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95))
                of_fit = f"{middle:.2f} ({low:.2f} to {high:.2f})"
            share = f"{held} of {len(given)} | {wide}"
            yield f"| `{name}` | `{parameter}` | {share} | {refused} | {of_fit} |"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--program", default="target/release/hubslosh")
    parser.add_argument("--fmu", default="dist/HubSlosh.fmu")
    parser.add_argument("--only", default="")
    args = parser.parse_args()
    head = ("held", "width, of the truth", "without an interval", "width over the fit's")
    print("| command | quantity |", " | ".join(head), "|")
    print("|" + " --- |" * (2 + len(head)))
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(
            str(Path(args.program).resolve()), str(Path(args.fmu).resolve()), Path(folder)
        )
        for row in census(bench, args.only, args.draws):
            print(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
