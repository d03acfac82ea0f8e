"""Draws the work-precision diagram of a sweep of the thesis: error over CPU time of integrators.

    PYTHONPATH=harness/python python3 harness/studies/work_precision.py

It needs Rust, dist/HubSlosh.fmu (``cargo run --release -- pack``), Python 3.11 or newer and, for
the instruction counts, valgrind. The first run creates a virtual environment in the target
directory and needs the network. It takes some ten minutes, mostly for SciPy. Use the machine for
nothing else meanwhile, because CPU times are compared. Finally it runs work_precision_six.py.

All methods solve one motion of the bench: an exponential sweep of 2700 s with
0.1 N·m at a fill of 10 cm. The torque is given at times 20 ms apart and is
linear between them; the methods return the hub's rate at each of these times.
The FMU has Coulomb friction as a set-valued law, with stick and slip as events.
The other methods have no events. They replace the sign function of the friction
by tanh(omega / eps). With eps = 1e-5 rad/s this causes an error of 1.5e-5
rad/s, so that Dopri5 was also run with eps = 1e-8 rad/s for smaller errors.
Errors are differences from the FMU's solution at a tolerance of 1e-13, which
agrees with the reference trajectories to their last digits
(fmu/plant/tests/plant/trajectories.rs).
"""

import functools
import json
import math
import re
import subprocess
import sys
import time
from pathlib import Path

import environment

try:
    import matplotlib
    import numpy as np
    from scipy.integrate import solve_ivp
except ModuleNotFoundError as missing:
    environment.run_again_in("work-precision", missing)

matplotlib.use("svg")
import matplotlib.pyplot as plt  # import after the backend is chosen

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "book"
SWEEP = 2700.0  # s
STEP = 0.02  # s
COUNTED = (10.0, 30.0)  # part of the sweep in which instructions are counted, s

TOLERANCES = ["1e-2", "1e-3", "1e-4", "3e-5", *(f"1e-{n}" for n in range(5, 11))]
RUST = {
    "HubSlosh, linear": ("linear", TOLERANCES),
    "HubSlosh, spherical": ("spherical", TOLERANCES),
    "ode_solvers Dopri5": ("dopri5", [f"1e-{n}" for n in range(3, 10)]),
    "ode_solvers Dopri5, eps 1e-8": (
        "dopri5@1e-8",
        ["1e-7", "1e-8", "1e-9", "3e-10", "1e-10", "3e-11", "1e-11"],
    ),
    "ode_solvers Dop853": ("dop853", [f"1e-{n}" for n in range(3, 8)]),
    "RK4, fixed step": ("rk4", ["5e-3", "1e-3", "2e-4"]),
}
RUNS = {"dopri5": 3, "dopri5@1e-8": 3, "dop853": 3}
"""Number of repetitions of each measurement, by method; 10 by default."""
PRINTED = {"1e-2", "1e-4", "1e-6", "1e-8", "1e-10"}
"""Tolerances in the table, for methods with more than three; the picture has all tolerances."""
SCIPY = {"SciPy RK45": ("RK45", [1e-4, 1e-6]), "SciPy LSODA": ("LSODA", [1e-5, 1e-7])}


def build() -> Path:
    """Build the Rust program and return its path.

    The build does not use ``-p``, which would compile most crates again.
    """
    command = ["cargo", "build", "--release", "--workspace", "--bench", "work_precision"]
    done = subprocess.run(
        [*command, "--message-format=json"], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    if done.returncode:
        sys.exit("error: the Rust program could not be built")
    messages = (json.loads(line) for line in done.stdout.splitlines())
    found = [m["executable"] for m in messages if m.get("executable")]
    return Path(found[-1])


def run(program: Path, *arguments: str) -> tuple[float, float]:
    """Run the method that ``arguments`` name.

    Return its CPU time per 20 ms of the simulation, ns, and its largest error of omega, rad/s.
    """
    done = subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"error: {program.name} {' '.join(arguments)}: {done.stderr}")
    cost, error = done.stdout.strip().split(",")
    return float(cost), float(error)


def instructions(program: Path, method: str, tolerance: str) -> float:
    """Return the instructions of a method per 20 ms, without the torque; NaN without valgrind.

    For the FMU, only instructions within its functions are counted.
    """
    if method in ("linear", "spherical"):
        return counted(program, method, tolerance, "--toggle-collect=fmi2*")
    return counted(program, method, tolerance) - counted(program, "torque", "0")


@functools.cache
def counted(program: Path, method: str, tolerance: str, *options: str) -> float:
    """Return the instructions per 20 ms that callgrind counts; NaN without valgrind."""
    counts = []
    for seconds in COUNTED:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
        command += [*options, program]
        try:
            done = subprocess.run(
                [*command, method, tolerance, str(seconds), "1"],
                cwd=ROOT,
                capture_output=True,
                text=True,
            )
        except FileNotFoundError:
            return math.nan
        counts.append(int(re.search(r"Collected : (\d+)", done.stderr)[1]))
    return (counts[1] - counts[0]) / ((COUNTED[1] - COUNTED[0]) / STEP)


def scipy(method: str, tolerance: float, exact: np.ndarray) -> tuple[float, float]:
    """Solve the smoothed equations by SciPy; return the same quantities as ``run``."""
    m, length, r, g = 0.756293271862872, 0.045241351252659934, 0.225, 9.81
    i0, c = 0.322414 + 1.3304311084678084 * r * r, 0.06627875369876737
    rate = math.log(3.5 / 1.25) / SWEEP
    times = np.arange(len(exact)) * STEP
    torque = 0.1 * np.sin(math.tau * 1.25 * np.expm1(rate * times) / rate)
    knots = torque.tolist()
    exp, tanh = math.exp, math.tanh

    def system(t: float, x: np.ndarray) -> tuple[float, ...]:
        k = min(int(t / STEP), len(knots) - 2)
        tau = knots[k] + (t / STEP - k) * (knots[k + 1] - knots[k])
        _, w, al, al_d = x.tolist()
        dry = tanh(w / 1e-5) * (0.003498 + 0.002423 * exp(-((w / 0.08581) ** 2)))
        w_d = (tau - 0.03793 * w - dry + r * (m * g * al + c * length * al_d)) / i0
        return w, w_d, al_d, -c / m * al_d - g / length * al - r / length * w_d

    start = time.process_time()
    found = solve_ivp(
        system,
        (0.0, times[-1]),
        np.zeros(4),
        method,
        times,
        rtol=tolerance,
        atol=tolerance * 1e-2,
    )
    cost = (time.process_time() - start) / (len(times) - 1) * 1e9
    return cost, float(np.abs(found.y[1] - exact).max())


def basilisk() -> list[tuple[str, float, float]]:
    """Return the rows of basilisk.md on RK4: step (ms), CPU time over the FMU's, error."""
    rows = re.findall(
        r"^\| Basilisk's RK4 \| (\S+) \| (\S+) \| (\S+) \|$",
        (PAGES / "basilisk.md").read_text(),
        re.MULTILINE,
    )
    return [(step, float(cost), float(error)) for step, error, cost in rows]


def at_error(points: list[tuple], error: float) -> float:
    """Return the smallest cost of the ``points`` of a method with at most this error."""
    return min((cost for _, cost, err, _ in points if err <= error), default=math.inf)


def draw(all_points: dict[str, list[tuple]], unit: float) -> None:
    """Draw the diagram of error over cost.

    CPU times of Basilisk are known relative to the spherical model of the FMU at 1e-8.
    """
    plt.rcParams.update({"svg.hashsalt": "hubslosh", "font.size": 10})
    figure, axes = plt.subplots(figsize=(8, 5.2), layout="constrained")
    for (name, points), marker in zip(all_points.items(), "osD<^vPX", strict=True):
        style = "-" if name.startswith("HubSlosh") else "--"
        axes.loglog(
            [p[1] / unit for p in points],
            [p[2] for p in points],
            style,
            marker=marker,
            markersize=5,
            label=name,
        )
    ours = next(cost for t, cost, *_ in all_points["HubSlosh, spherical"] if t == "1e-8")
    axes.loglog(
        [cost * ours / unit for _, cost, _ in basilisk()],
        [error for *_, error in basilisk()],
        "h:",
        color="0.5",
        markersize=5,
        label="Basilisk RK4, quoted: 20 s release, no friction",
    )
    axes.set_xlabel("cost of 20 ms of motion / cost of one RK4 step")
    axes.set_ylabel("largest error of omega over the sweep / (rad/s)")
    axes.set_title("2700 s sweep, 0.1 N·m, 10 cm, dry friction")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend()
    figure.savefig(PAGES / "work_precision.svg", metadata={"Date": None})


def table(all_points: dict[str, list[tuple]], unit: float) -> str:
    """Return the table of the page in Markdown."""
    rows = [
        "| method (eps: width of smoothed friction, 1e-5 rad/s unless stated) "
        "| tolerance (RK4: step, s) | error of the hub's rate, rad/s "
        "| CPU time per 20 ms of motion, in RK4 steps of 5 ms | instructions per 20 ms of motion |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, points in all_points.items():
        for tolerance, cost, error, count in points:
            if len(points) > 3 and tolerance not in PRINTED:
                continue
            counted = "" if math.isnan(count) else f"{count:.0f}"
            rows.append(f"| {name} | {tolerance} | {error:.1e} | {cost / unit:.1f} | {counted} |")
    return "\n".join(rows)


def main() -> None:
    if not (ROOT / "dist" / "HubSlosh.fmu").exists():
        sys.exit("error: dist/HubSlosh.fmu is missing: cargo run --release -- pack")
    program = build()
    results = environment.target() / "work_precision"
    results.mkdir(parents=True, exist_ok=True)
    reference = {}
    for model in ("linear", "spherical"):
        reference[model] = str(results / f"{model}.f64")
        run(program, model, "1e-13", str(SWEEP), "1", "--write", reference[model])
    all_points: dict[str, list[tuple]] = {}
    for name, (method, tolerances) in RUST.items():
        exact = reference["spherical" if method == "spherical" else "linear"]
        for tolerance in tolerances:
            runs = RUNS.get(method, 10)
            cost, error = run(program, method, tolerance, str(SWEEP), str(runs), exact)
            count = instructions(program, method, tolerance)
            all_points.setdefault(name, []).append((tolerance, cost, error, count))
            print(f"{name:28} {tolerance:6} {error:.1e} rad/s {cost:9.0f} ns", flush=True)
    exact = np.fromfile(reference["linear"])
    for name, (method, tolerances) in SCIPY.items():
        for tolerance in tolerances:
            cost, error = scipy(method, tolerance, exact)
            point = (f"{tolerance:.0e}".replace("e-0", "e-"), cost, error, math.nan)
            all_points.setdefault(name, []).append(point)
            print(f"{name:28} {point[0]:6} {error:.1e} rad/s {cost:9.0f} ns", flush=True)
    unit = all_points["RK4, fixed step"][0][1] / 4  # one step of 5 ms
    smoother = run(program, "rk4@1e-3", "5e-3", str(SWEEP), "10", reference["linear"])[0] / 4
    draw(all_points, unit)
    linear, spherical = all_points["HubSlosh, linear"], all_points["HubSlosh, spherical"]
    others = {n: p for n, p in all_points.items() if not n.startswith("HubSlosh")}
    ratios, factors = [], []
    for error in (1e-4, 1e-5, 1e-6, 1e-7):
        best = min(others, key=lambda n: at_error(others[n], error))
        cost = at_error(others[best], error)
        least = at_error(linear, error)
        said = f"{cost / least:.1f} times ({best})" if cost < math.inf else "none gets there"
        factors.append(cost / least)
        turning = at_error(spherical, error) / unit
        ratios.append(f"| {error:.0e} | {least / unit:.2f} | {turning:.2f} | {said} |")
    page = [
        "# Work and precision",
        "",
        "<!-- Written by harness/studies/work_precision.py. -->",
        "",
        "How much CPU time does the FMU need for a given error, compared with other integrators?",
        "",
        "**At equal error the best of the other integrators needs "
        f"{min(factors):.0f} to {max(factors):.0f} times the FMU's",
        "time,** because the FMU's power series take long steps, and the FMU locates",
        "stick and slip of dry friction as events. This holds for HubSlosh, the bench",
        "with dry friction. In [six axes](#six-axes), without friction, the integrator",
        "heyoka is as fast as the FMU.",
        "",
        *(__doc__ or "").split("\n\n")[3].splitlines(),
        "",
        "![work-precision diagram](work_precision.svg)",
        "",
        "The unit of cost is one RK4 step of 5 ms on these equations, which took",
        f"{unit:.0f} ns with eps = 1e-5 rad/s, where the tanh is nearly always 1. With eps =",
        f"1e-3 rad/s, where the tanh has to be computed, a step took {smoother:.0f} ns.",
        "",
        "Instructions are counted by callgrind and do not depend on the machine; the",
        "computation of the torque is left out. Times are CPU times, the least of several",
        "runs on a shared machine, on which whole runs take up to twice as long; SciPy ran",
        "once. The FMU's cost includes its C interface.",
        "",
        "| largest error of the hub's rate, rad/s "
        "| cost of HubSlosh with linear liquid, in RK4 steps per 20 ms of motion "
        "| cost of HubSlosh with spherical liquid, in RK4 steps per 20 ms of motion "
        "| cost of the best other method, in multiples of HubSlosh with linear liquid |",
        "| --- | --- | --- | --- |",
        *ratios,
        "",
        "The picture shows further tolerances of each method.",
        "",
        table(all_points, unit),
        "",
        "Basilisk has no dry friction, so it cannot run this sweep. The errors of its",
        "integrators in a motion without friction are on the page of the [comparison with",
        "Basilisk](basilisk.md).",
        "",
        "The tables are written by",
        "`PYTHONPATH=harness/python python3 harness/studies/work_precision.py`.",
        "",
    ]
    (PAGES / "work_precision.md").write_text("\n".join(page))
    print(f"wrote {PAGES / 'work_precision.md'} and .svg")
    sys.exit(
        subprocess.run(
            [sys.executable, Path(__file__).with_name("work_precision_six.py")]
        ).returncode
    )


if __name__ == "__main__":
    main()
