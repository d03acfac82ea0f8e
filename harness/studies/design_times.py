"""Measures CPU and elapsed time of design steps, for a satellite with two tanks of two modes.

    python3 harness/studies/design_times.py
    python3 harness/studies/design_times.py --before dist/release/hubslosh-0.5.0-….whl

The satellite is that of example 14; its controller has 15 states. With `--before`, the steps that
an older wheel has are also measured: margins, and a tenth of the Monte Carlo runs.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "14_telecom_satellite"
FILLS, POINTS, RUNS, STOP = 40, 1000, 300, 300.0
"""Number of fills of the family, points of the review and Monte Carlo runs; seconds per run."""
RATE = 1e-3
"""Angular velocity at the start of a run, rad/s."""


@dataclass(frozen=True)
class Time:
    """CPU time and elapsed time of a design step."""

    what: str
    count: int
    cpu: float
    """CPU time of this process and its children, s."""
    elapsed: float
    """Elapsed time, s."""

    def __str__(self) -> str:
        each = 1e3 * self.cpu / self.count
        return f"| {self.what} | {self.count} | {self.cpu:.2f} | {each:.1f} | {self.elapsed:.2f} |"


HEAD = (
    "| step | number | CPU time, s | CPU time of each, ms | elapsed, s |\n| --- "
    + "| --- " * 4
    + "|"
)


def timed(what: str, count: int, step: Callable[[], Any]) -> tuple[Time, Any]:
    """Call ``step``; return its time and its result.

    ``what`` is the name of the design step, and ``count`` how many times it does its work.
    """
    before, begin = os.times(), time.monotonic()
    found = step()
    after, end = os.times(), time.monotonic()
    return Time(what, count, sum(after[:4]) - sum(before[:4]), end - begin), found


def satellite() -> tuple[Any, Any]:
    """Return the modules of example 14 for the craft and for its design review."""
    sys.path.insert(0, str(EXAMPLE))
    import design_review
    import telecom

    return telecom, design_review


def loop_of(given: dict[str, Any]) -> Any:
    """Return the control loop with the parameters and matrices in ``given``."""
    import control

    import hubslosh

    *matrices, period = given["controller"]
    names = given["measured"], given["command"]
    return hubslosh.Loop(control.ss(*matrices, period or 0), given["period"], given["model"],
                         given["parameters"], *names, delay=given["delay"])  # fmt: skip


def loop_steps(loop: Any, inertia: float, runs: int, stop: float) -> list[Time]:
    """Return the times of margins, and of ``runs`` Monte Carlo runs to ``stop`` (s), of a loop.

    ``inertia`` is the nominal value of the inertia that varies.
    """
    from dataclasses import replace

    import hubslosh

    hubslosh.margins(loop)
    times = [
        timed("margins of three axes", 10, lambda: [hubslosh.margins(loop) for _ in range(10)])
    ]

    def outcome(values: dict[str, float]) -> dict[str, float]:
        one = replace(loop, parameters=loop.parameters | values)
        run = one.simulate(stop, outputs=["omega[1]"])
        return {"rate": abs(run["omega[1]"].iloc[-1]), "delay": hubslosh.margins(one).delay_margin}

    ranges = {"craft.Jxx": (0.95 * inertia, 1.05 * inertia), "init.omega[1]": (-RATE, RATE)}
    many = lambda: hubslosh.monte_carlo(ranges, runs, outcome=outcome, progress=False)  # noqa: E731
    times.append(timed(f"Monte Carlo: {stop:g} s and margins", runs, many))
    return [of for of, _ in times]


def now(fills: int, points: int, runs: int, stop: float) -> tuple[list[Time], dict[str, Any]]:
    """Return the times of all design steps in this version, and the loop for `before`.

    ``fills``, ``points`` and ``runs`` say how large the design steps are; runs end at ``stop``, s.
    """
    import numpy as np

    import hubslosh

    telecom, design_review = satellite()
    craft = telecom.craft
    craft.linearize("50%")  # read the FMU before the time is measured
    over = [f"{fill:g}%" for fill in np.linspace(4, 97, fills)]

    def family() -> list[Any]:
        craft.solve(over)
        return [craft.linearize(fill) for fill in over]

    of_family, _ = timed("family of linear models, two tanks each", fills, family)
    loop = telecom.loop("50%")
    times = [*loop_steps(loop, 1150.0, runs, stop)]
    draws = max(points - 214, 0)
    of_review, review = timed("review", points, lambda: design_review.review(telecom.FILLS, draws))
    of_review = Time(
        "review: margins at points", len(review.points), of_review.cpu, of_review.elapsed
    )
    law = telecom.controller()
    matrices = [np.asarray(of).tolist() for of in (law.A, law.B, law.C, law.D)]
    measured, command = loop.names
    given = {
        "controller": [*matrices, law.dt], "period": loop.period, "model": "Spacecraft",
        "parameters": dict(loop.parameters), "measured": measured, "command": command,
        "delay": loop.delay, "version": hubslosh.__version__,
    }  # fmt: skip
    return [times[0], of_family, of_review, times[1]], given


BEFORE = """
import json, sys, warnings
warnings.simplefilter("ignore")
import hubslosh.fmu
sys.path.insert(0, sys.argv[1])
import design_times
given = json.load(open(sys.argv[2]))
known = hubslosh.fmu.Fmu.open(given["model"]).variables
given["parameters"] = {n: x for n, x in given["parameters"].items() if n in known}
loop = design_times.loop_of(given)
for step in design_times.loop_steps(loop, 1150.0, int(sys.argv[3]), float(sys.argv[4])):
    print(step)
"""


def before(wheel: Path, given: dict[str, Any], runs: int, stop: float) -> str:
    """Return the rows of the table for ``wheel``, an older version of the package.

    ``given`` has the loop that `now` returned.
    """
    with tempfile.TemporaryDirectory(prefix="hubslosh-") as folder:
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(folder)
        file = Path(folder) / "loop.json"
        file.write_text(json.dumps(given), encoding="utf-8")
        command = [sys.executable, "-c", BEFORE, Path(__file__).parent, file, runs, stop]
        done = subprocess.run(
            [str(part) for part in command], env=os.environ | {"PYTHONPATH": folder}, text=True,
            stdout=subprocess.PIPE, check=True,
        )  # fmt: skip
    return done.stdout


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, metavar="WHEEL", help="an older wheel to compare")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    times, given = now(FILLS, POINTS, RUNS, STOP)
    print(HEAD, *times, sep="\n")
    if args.before:
        print(f"\n{args.before.name}:\n\n{HEAD}")
        print(before(args.before.absolute(), given, RUNS // 10, STOP))


if __name__ == "__main__":
    main()
