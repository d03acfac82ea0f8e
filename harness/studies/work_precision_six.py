"""Measures error and CPU time of Spacecraft.fmu, heyoka, SUNDIALS, SciPy and Basilisk.

    PYTHONPATH=harness/python python3 harness/studies/work_precision_six.py

It needs dist/Spacecraft.fmu (``cargo run --release -- pack --model Spacecraft --out
dist/Spacecraft.fmu``) and Python 3.11 or newer. The first run creates a virtual environment in the
target directory and needs the network. It writes its section of book/work_precision.md in some
minutes. Use the machine for nothing else meanwhile, because CPU times are compared.

The spacecraft is taken from [a case of the slosh
benchmark](../harness/benchmark/thrust/page.md). It has two pendulums, under
forces and torques that jump. Errors are differences from the benchmark's
reference solution of 20 s.
"""

import math
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

import environment

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "harness" / "benchmark" / p) for p in ("", "implementations")]

try:
    import basilisk
    import cases
    import heyoka as hy
    import heyoka_taylor
    import hubslosh_fmus
    import numpy as np
    import pandas as pd
    import score
    from scipy.integrate import solve_ivp
    from sksundae import cvode

    import hubslosh
except ModuleNotFoundError as missing:
    environment.run_again_in("work-precision", missing)

PAGE = ROOT / "book" / "work_precision.md"
MARKS = ("<!-- six axes: written by harness/studies/work_precision_six.py -->", "<!-- end -->")
FMU = ROOT / "dist" / "Spacecraft.fmu"
CASE = "thrust"
ROUNDS = 20
"""Repetitions of the inputs; in every second repetition torque and lateral force change sign."""
RUNS = 7
"""Number of repetitions of each measurement; the shortest time counts."""

Solution = Callable[[list], np.ndarray]
"""Function from pieces (begin, end, force and torque, times of rows) to the states at all rows."""


def pieces(rounds: int, every: float) -> list[tuple[float, float, np.ndarray, np.ndarray]]:
    """Return the pieces of time in which inputs are constant, with the times of their rows.

    Rows are ``every`` s apart; the motion is repeated for ``rounds`` rounds of 20 s.
    """
    made = []
    for k in range(rounds):
        turned = np.array([1, 1, 1, 1, 1, 1.0]) if k % 2 == 0 else np.array([-1, -1, 1, -1, -1, -1])
        for begin, end, wrench in cases.segments(CASE):
            count = round((end - begin) / every)
            times = 20.0 * k + begin + every * np.arange(1, count + 1)
            made.append((20.0 * k + begin, 20.0 * k + end, wrench * turned, times))
    return made


class Heyoka:
    """heyoka's Taylor integrator, with dense output at the rows."""

    def __init__(self, tolerance: float) -> None:
        equations, self.start = heyoka_taylor.craft_system(cases.parameters(CASE))
        self.taylor = hy.taylor_adaptive(
            equations, self.start, pars=[0.0] * 6, tol=tolerance, compact_mode=False
        )

    def __call__(self, given: list) -> np.ndarray:
        """Return the states at all rows of the pieces of time ``given``."""
        ta, found = self.taylor, []
        ta.time = 0.0
        ta.state[:] = self.start
        for begin, _, wrench, times in given:
            ta.pars[:] = wrench
            found.append(ta.propagate_grid(np.hstack([begin, times]))[-1][1:])
        states = np.vstack(found)
        return states[:, 4:]


def compiling() -> float:
    """Return the CPU time, s, in which heyoka compiles a craft that is not in its cache."""
    p = cases.parameters(CASE)
    p["mass"] *= 1 + 1e-9 * np.random.default_rng().random()
    begin = time.process_time()
    equations, start = heyoka_taylor.craft_system(p)
    hy.taylor_adaptive(equations, start, pars=[0.0] * 6, tol=1e-12, compact_mode=False)
    return time.process_time() - begin


class Compiled:
    """Right-hand side of the equations, compiled by heyoka, for other integrators."""

    def __init__(self) -> None:
        equations, self.start = heyoka_taylor.craft_system(cases.parameters(CASE))
        variables = [x for x, _ in equations]
        self.rates = hy.cfunc([hy.expression(rate) for _, rate in equations], variables)

    def of(self, wrench: np.ndarray) -> Callable[[float, np.ndarray, np.ndarray], np.ndarray]:
        """Return the right-hand side of the equations for constant force and torque ``wrench``."""
        rates = self.rates

        def written(t: float, y: np.ndarray, y_d: np.ndarray) -> np.ndarray:
            return rates(y, pars=wrench, outputs=y_d)

        return written


def sundials(right: Compiled, tolerance: float) -> Solution:
    """Return a function that solves by CVODE (Adams), restarted where the inputs jump."""

    def solution(given: list) -> np.ndarray:
        y, found = np.array(right.start), []
        for begin, _, wrench, times in given:
            solver = cvode.CVODE(
                right.of(wrench), method="Adams", rtol=tolerance, atol=tolerance * 1e-2,
                max_num_steps=100000,
            )  # fmt: skip
            states = solver.solve(np.hstack([begin, times]), y).y
            found.append(states[1:])
            y = states[-1]
        return np.vstack(found)[:, 4:]

    return solution


def dop853(right: Compiled, tolerance: float) -> Solution:
    """Return a function that solves by SciPy's DOP853, restarted where the inputs jump."""

    def solution(given: list) -> np.ndarray:
        y, found = np.array(right.start), []
        for begin, end, wrench, times in given:
            rates, y_d = right.of(wrench), np.empty(len(y))
            states = solve_ivp(
                lambda t, y, rates=rates, y_d=y_d: rates(t, np.ascontiguousarray(y), y_d).copy(),
                (begin, end), y, "DOP853", np.minimum(times, end), rtol=tolerance, atol=tolerance,
            ).y.T  # fmt: skip
            found.append(states)
            y = states[-1]
        return np.vstack(found)[:, 4:]

    return solution


def fmu(tolerance: float) -> Solution:
    """Return a function that solves by Spacecraft.fmu, from row to row, including its set-up."""
    p = cases.parameters(CASE)
    settings, axes = hubslosh_fmus.with_tanks(p)
    names = hubslosh_fmus.columns_of(len(axes))

    def solution(given: list) -> np.ndarray:
        wrench = np.array([*(piece[2] for piece in given), given[-1][2]])
        table = pd.DataFrame(wrench, columns=hubslosh_fmus.WRENCH)
        table.insert(0, "time", [piece[0] for piece in given] + [given[-1][1]])
        every = given[0][3][1] - given[0][3][0]
        run = hubslosh.simulate(
            FMU, settings, table, given[-1][1], float(every), names, tolerance=tolerance, hold=True
        )
        return run[names].to_numpy()[1:]

    return solution


def error(found: np.ndarray) -> float:
    """Return the largest error over 20 s with rows every 0.1 s, relative to the largest values.

    Columns of ``found`` are the rate, the velocity, and the direction of each slosh mass.
    """
    columns = score.specification()[CASE]["columns"]
    wanted = score.read(score.HERE / CASE / "results.csv", columns)
    names = list(columns)[1:]
    rows = [dict(zip(names, row, strict=True)) for row in found.tolist()]
    later = score.Table(columns, wanted.rows[1:])
    return score.largest_error(rows, later, "column")[0]


def without_rates(found: np.ndarray) -> np.ndarray:
    """Return the columns that the benchmark scores: all columns except p' of both bobs."""
    return np.hstack([found[:, :9], found[:, 12:15]]) if found.shape[1] == 18 else found


def cost(solution: Solution, every: float, rounds: int, runs: int) -> float:
    """Return the CPU time per simulated second, µs, without the time of the first round."""
    long, short = pieces(rounds, every), pieces(1, every)
    solution(short)

    def least(given: list) -> float:
        taken = []
        for _ in range(runs):
            begin = time.process_time()
            solution(given)
            taken.append(time.process_time() - begin)
        return min(taken)

    return (least(long) - least(short)) / (20.0 * (rounds - 1)) * 1e6


def basilisk_row(step: float) -> tuple[float, float]:
    """Return error and CPU time of Basilisk's RK4 with a step in s."""
    begin = time.process_time()
    found = basilisk.run(CASE, "RK4", step)
    spent = time.process_time() - begin
    return error(found[1:, 1:]), spent / 20.0 * 1e6


def measure() -> list[tuple[str, str, float, list[float]]]:
    """Return for each method its name, tolerance, error, and CPU times.

    The CPU times are for rows every 1 s and every 50 ms.
    """
    rows = []
    right = Compiled()
    methods: list[tuple[str, list[float], Callable, int, int]] = [
        ("Spacecraft.fmu", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], fmu, ROUNDS, RUNS),
        ("heyoka, Taylor", [1e-6, 1e-9, 1e-12, 1e-15], Heyoka, ROUNDS, RUNS),
        ("SUNDIALS, CVODE", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], lambda t: sundials(right, t), 3, 3),
        ("SciPy, DOP853", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], lambda t: dop853(right, t), 2, 2),
    ]
    for name, tolerances, make, rounds, runs in methods:
        for tolerance in tolerances:
            solution = make(tolerance)
            found = without_rates(solution(pieces(1, 0.1)))
            costs = [cost(solution, every, rounds, runs) for every in (1.0, 0.05)]
            rows.append((name, f"{tolerance:.0e}".replace("e-0", "e-"), error(found), costs))
            print(*rows[-1], flush=True)
    for step in (0.001, 0.005, 0.02):
        wrong, spent = basilisk_row(step)
        rows.append(("Basilisk, RK4", f"{1e3 * step:g} ms", wrong, [math.nan, spent]))
        print(*rows[-1], flush=True)
    return rows


UNPRINTED = {"1e-6", "1e-10", "1e-15"}
"""Tolerances that the table of the page leaves out."""

AT = 1e-10
"""Error at which the first sentence of the page compares the methods."""


def at_error(rows: list[tuple[str, str, float, list[float]]]) -> str:
    """Return in words the smallest CPU time of each method with an error of at most `AT`."""
    least: dict[str, float] = {}
    for name, _, wrong, (_, fine) in rows:
        if wrong <= AT:
            least[name] = min(fine, least.get(name, math.inf))
    words = [f"{value:.0f} µs ({name})" for name, value in least.items()]
    return f"{', '.join(words[:-1])} and {words[-1]}"


def section(rows: list[tuple[str, str, float, list[float]]], compiled: float) -> str:
    """Return the section of the page in Markdown."""

    def number(x: float) -> str:
        return "–" if math.isnan(x) else f"{x:.3g}"

    lines = [
        "| method | tolerance (Basilisk: step) | largest relative error "
        "| CPU time per simulated second with rows every 1 s, µs "
        "| CPU time per simulated second with rows every 50 ms, µs |",
        "| --- | --- | --- | --- | --- |",
        *(
            f"| {name} | {tolerance} | {wrong:.0e} | {number(coarse)} | {number(fine)} |"
            for name, tolerance, wrong, (coarse, fine) in rows
            if tolerance not in UNPRINTED
        ),
    ]
    return "\n".join([
        MARKS[0],
        "",
        "## Six axes",
        "",
        f"**At an error of at most {AT:.0e} and rows every 50 ms a simulated second takes",
        f"{at_error(rows)} of CPU time.**",
        *(__doc__ or "").split("\n\n")[3].strip().splitlines(),
        "Costs are CPU time per simulated second on a shared machine, without set-up,",
        f"while the inputs of the 20 s repeat. They are the least of {RUNS} runs of",
        "400 s; of CVODE, 3 runs of 60 s; of DOP853, 2 runs of 40 s. Before a run heyoka",
        f"compiles its Taylor recurrences in {compiled:.0f} s of CPU time. CVODE (Adams method,",
        "called from scikit-sundae) and DOP853 call right-hand sides that heyoka compiled; their",
        "times contain the calls from Python. Basilisk's time contains its set-up, and",
        "its rows are 0.1 s apart.",
        "",
        *lines,
        "",
        "The table is written by",
        "`PYTHONPATH=harness/python python3 harness/studies/work_precision_six.py`.",
        "",
        MARKS[1],
    ])  # fmt: skip


def with_section(text: str, written: str) -> str:
    """Return the page in which this section replaces the old one, or is appended."""
    if MARKS[0] not in text:
        return f"{text.rstrip()}\n\n{written}\n"
    pattern = re.escape(MARKS[0]) + ".*?" + re.escape(MARKS[1])
    return re.sub(pattern, lambda _: written, text, count=1, flags=re.DOTALL)


def main() -> None:
    written = section(measure(), compiling())
    text = with_section(PAGE.read_text(encoding="utf-8"), written)
    PAGE.write_text(text, encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
