"""Measures error and CPU time of Spacecraft.fmu, heyoka, SUNDIALS, SciPy and Basilisk.

    PYTHONPATH=harness/python python3 harness/studies/work_precision_six.py

It needs dist/Spacecraft.fmu (``cargo run --release -- pack --model Spacecraft --out
dist/Spacecraft.fmu``) and Python 3.11 or newer. The first run creates a virtual environment in the
target directory and needs the network. It writes its section of book/work_precision.md in ten
minutes; with --heyoka only the comparison with heyoka, in four. Use the machine for nothing else
meanwhile, because CPU times are compared.

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
    import score
    from scipy.integrate import solve_ivp
    from sksundae import cvode

    import hubslosh
except ModuleNotFoundError as missing:
    environment.run_again_in("work-precision", missing)

PAGE = ROOT / "book" / "work_precision.md"
MARKS = ("<!-- six axes: written by harness/studies/work_precision_six.py -->", "<!-- end -->")
HEYOKA_MARKS = ("<!-- beside heyoka -->", "<!-- beside heyoka: end -->")
FMU = ROOT / "dist" / "Spacecraft.fmu"
CASE = "thrust"
ROUNDS = 20
"""Repetitions of the inputs; in every second repetition torque and lateral force change sign."""
RUNS = 7
"""Number of repetitions of each measurement; the shortest time counts."""
SHORT_RUNS = 41
"""The same for runs of some milliseconds, because a shared machine is seldom quiet for longer."""
RESTARTS = (0.02, 0.05, 0.1)
"""Times after which the inputs change in the measurement of restarts, s."""

Pieces = list[tuple[float, float, np.ndarray, np.ndarray]]
"""Pieces of time with constant inputs: begin, end, force and torque, times of rows."""

Solution = Callable[[Pieces], tuple[np.ndarray, float]]
"""Function from pieces to the states at all rows and the CPU time without set-up, s."""


OURS, HEYOKA = "Spacecraft.fmu", "heyoka, Taylor"

Measured = tuple[str, float, list[float], list[float]]
"""Method, tolerance, and for each scenario the largest relative error and the CPU time, µs/s."""


def pieces(rounds: int, every: float) -> Pieces:
    """Return the pieces of time in which inputs are constant, with rows every ``every`` s."""
    made = []
    for k in range(rounds):
        turned = np.array([1, 1, 1, 1, 1, 1.0]) if k % 2 == 0 else np.array([-1, -1, 1, -1, -1, -1])
        for begin, end, wrench in cases.segments(CASE):
            count = round((end - begin) / every)
            times = 20.0 * k + begin + every * np.arange(1, count + 1)
            made.append((20.0 * k + begin, 20.0 * k + end, wrench * turned, times))
    return made


def restarts(rounds: int, length: float) -> Pieces:
    """Return pieces of ``length`` s with one row each: inputs that vary by up to 10 %."""
    made = []
    for begin, _, wrench, times in pieces(rounds, length):
        begins = np.hstack([begin, times[:-1]])
        for k, (first, last) in enumerate(zip(begins.tolist(), times.tolist(), strict=True)):
            varied = wrench * (1 + 0.1 * np.sin(0.7 * k + begin + np.arange(6)))
            made.append((first, last, varied, np.array([last])))
    return made


class Heyoka:
    """heyoka's Taylor integrator, with dense output at the rows."""

    def __init__(self, tolerance: float, *, is_empty: bool = False) -> None:
        """Compile the integrator; if ``is_empty``, for one equation that needs no computation."""
        equations, self.start = heyoka_taylor.craft_system(cases.parameters(CASE))
        if is_empty:
            x = hy.make_vars("x")
            equations, self.start = [(x, sum(hy.par[i] for i in range(6)))], np.zeros(1)
        self.taylor = hy.taylor_adaptive(
            equations, self.start, pars=[0.0] * 6, tol=tolerance, compact_mode=False
        )

    def __call__(self, given: Pieces) -> tuple[np.ndarray, float]:
        """Return the states at the rows of the given pieces, and the CPU time."""
        ta, found = self.taylor, []
        ta.time = 0.0
        ta.state[:] = self.start
        pars, until, grid, state = ta.pars, ta.propagate_until, ta.propagate_grid, ta.state
        grids = [np.hstack([begin, times]) for begin, _, _, times in given]
        is_single = len(grids[0]) == 2
        spent = time.process_time()
        for (_, end, wrench, _), times in zip(given, grids, strict=True):
            pars[:] = wrench
            if is_single:
                until(end)
                found.append(state.copy())
            else:
                found.append(grid(times)[-1][1:])
        spent = time.process_time() - spent
        return np.vstack(found)[:, 4:], spent


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


def timed(right: Compiled, solve: Callable[[float, np.ndarray, np.ndarray, Callable], np.ndarray]):
    """Return a Solution that calls ``solve`` for each piece with begin, rows, state and rates."""

    def solution(given: Pieces) -> tuple[np.ndarray, float]:
        y, found, spent = np.array(right.start), [], time.process_time()
        for begin, _, wrench, times in given:
            found.append(solve(begin, times, y, right.of(wrench)))
            y = found[-1][-1]
        return np.vstack(found)[:, 4:], time.process_time() - spent

    return solution


def sundials(right: Compiled, tolerance: float) -> Solution:
    """Return a function that solves by CVODE (Adams), restarted where the inputs jump."""

    def solve(begin: float, times: np.ndarray, y: np.ndarray, rates: Callable) -> np.ndarray:
        solver = cvode.CVODE(
            rates, method="Adams", rtol=tolerance, atol=tolerance * 1e-2, max_num_steps=100000
        )
        return solver.solve(np.hstack([begin, times]), y).y[1:]

    return timed(right, solve)


def dop853(right: Compiled, tolerance: float) -> Solution:
    """Return a function that solves by SciPy's DOP853, restarted where the inputs jump."""

    def solve(begin: float, times: np.ndarray, y: np.ndarray, rates: Callable) -> np.ndarray:
        y_d = np.empty(len(y))
        return solve_ivp(
            lambda t, y: rates(t, np.ascontiguousarray(y), y_d).copy(),
            (begin, times[-1]), y, "DOP853", times, rtol=tolerance, atol=tolerance,
        ).y.T  # fmt: skip

    return timed(right, solve)


def fmu(tolerance: float) -> Solution:
    """Return a function that solves by Spacecraft.fmu, from row to row, in one call of Python."""
    settings, axes = hubslosh_fmus.with_tanks(cases.parameters(CASE))
    names = hubslosh_fmus.columns_of(len(axes))

    def solution(given: Pieces) -> tuple[np.ndarray, float]:
        points = np.hstack([[given[0][0]], *(times for _, _, _, times in given)])
        counts = [len(times) for _, _, _, times in given]
        wrench = np.repeat([w for _, _, w, _ in given], counts, axis=0)
        wrench = np.vstack([wrench, wrench[-1]])
        inputs = dict(zip(hubslosh_fmus.WRENCH, wrench.T.copy(), strict=True))
        first = {name: float(values[0]) for name, values in inputs.items()}
        with hubslosh.Plant(FMU, settings, tolerance=tolerance, inputs=first) as plant:
            spent = time.process_time()
            run = plant.run(points, inputs, None, names)
            spent = time.process_time() - spent
        return np.column_stack([run[name][1:] for name in names]), spent

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


def costs(solutions: list[Solution], given: Pieces, runs: int) -> list[float]:
    """Return the CPU times of solutions, s. Runs alternate, so that all meet the same machine."""
    least = [math.inf] * len(solutions)
    for _ in range(runs):
        for k, solution in enumerate(solutions):
            least[k] = min(least[k], solution(given)[1])
    return least


SCENARIOS: dict[str, tuple[Callable[[int], Pieces], int]] = {
    "rows every 1 s": (lambda rounds: pieces(rounds, 1.0), 4),
    "rows every 50 ms": (lambda rounds: pieces(rounds, 0.05), 4),
    **{
        f"new inputs every {1e3 * length:g} ms": (lambda n, length=length: restarts(n, length), 1)
        for length in RESTARTS
    },
}
"""Function from the number of rounds to pieces of time, and the number of rounds in a cost."""


def beside_heyoka() -> list[Measured]:
    """Measure Spacecraft.fmu and heyoka in all scenarios, and return their errors and CPU times.

    heyoka is called from Python for each piece. The time of the same calls for an equation that
    needs no computation is subtracted.
    """
    methods = [(OURS, t, fmu(t)) for t in (1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12)]
    methods += [
        (HEYOKA, t, Heyoka(t)) for t in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12)
    ]
    empty, exact = Heyoka(1e-9, is_empty=True), Heyoka(1e-16)
    rows: list[Measured] = [(name, t, [], []) for name, t, _ in methods]
    for scenario, (given, rounds) in SCENARIOS.items():
        wanted = without_rates(exact(given(1))[0])
        scale = abs(wanted).max(axis=0)
        long = given(rounds)
        least = costs([empty, *(solution for _, _, solution in methods)], long, SHORT_RUNS)
        for row, (name, _, solution), spent in zip(rows, methods, least[1:], strict=True):
            found = without_rates(solution(given(1))[0])
            own = spent - least[0] if name == HEYOKA else spent
            row[2].append(float((abs(found - wanted).max(axis=0) / scale).max()))
            row[3].append(own / long[-1][1] * 1e6)
            print(f"{scenario}: {name} {row[1]:.0e} {row[2][-1]:.1e} {row[3][-1]:.4g}", flush=True)
    return rows


def least_cost(rows: list[Measured], method: str, scenario: int, allowed: float) -> float:
    """Return the smallest CPU time of a method in a scenario with an error of at most `allowed`."""
    return min(
        (cost[scenario] for name, _, wrong, cost in rows if name == method
         and wrong[scenario] <= allowed),
        default=math.nan,
    )  # fmt: skip


def compare(rows: list[Measured]) -> str:
    """Return the part of the page about heyoka: times and ratios at equal errors."""
    lines, ratios = [], []
    for k, scenario in enumerate(SCENARIOS):
        cells = [scenario]
        for allowed in (1e-8, 1e-10):
            ours, theirs = (least_cost(rows, name, k, allowed) for name in (OURS, HEYOKA))
            ratios.append(ours / theirs)
            cells.append(f"{ours:.3g} : {theirs:.3g} = {ratios[-1]:.2f}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([
        HEYOKA_MARKS[0],
        f"**At equal error Spacecraft.fmu takes {min(ratios):.2f} to {max(ratios):.2f} times the",
        f"CPU time of heyoka.** Both were measured in turn, {SHORT_RUNS} times each; the least",
        "counts. Calls of heyoka from Python are subtracted.",
        "",
        "| inputs and rows | µs of CPU time per simulated second, Spacecraft.fmu : heyoka = ratio, "
        "at errors up to 1e-8 | up to 1e-10 |",
        "| --- | --- | --- |",
        *lines,
        HEYOKA_MARKS[1],
    ])  # fmt: skip


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
        (OURS, [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], fmu, ROUNDS, RUNS),
        ("SUNDIALS, CVODE", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], lambda t: sundials(right, t), 3, 3),
        ("SciPy, DOP853", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12], lambda t: dop853(right, t), 2, 2),
    ]
    for name, tolerances, make, rounds, runs in methods:
        for tolerance in tolerances:
            solution = make(tolerance)
            found = without_rates(solution(pieces(1, 0.1))[0])
            spent = [costs([solution], pieces(rounds, every), runs)[0] for every in (1.0, 0.05)]
            least = [x / (20.0 * rounds) * 1e6 for x in spent]
            rows.append((name, f"{tolerance:.0e}".replace("e-0", "e-"), error(found), least))
            print(*rows[-1], flush=True)
    for step in (0.001, 0.005, 0.02):
        wrong, spent = basilisk_row(step)
        rows.append(("Basilisk, RK4", f"{1e3 * step:g} ms", wrong, [math.nan, spent]))
        print(*rows[-1], flush=True)
    return rows


UNPRINTED = {"1e-6", "1e-10", "1e-15"}
"""Tolerances that the table of the page leaves out."""


def section(rows: list[tuple[str, str, float, list[float]]], compared: str, compiled: float) -> str:
    """Return the section of the page in Markdown; ``compared`` is its part about heyoka."""

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
        compared,
        "",
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
        "The tables are written by",
        "`PYTHONPATH=harness/python python3 harness/studies/work_precision_six.py`;",
        "with `--heyoka` it measures only the first.",
        "",
        MARKS[1],
    ])  # fmt: skip


def replace_part(written: str, marks: tuple[str, str]) -> None:
    """Replace the part of the page between two marks, which ``written`` includes."""
    text = PAGE.read_text(encoding="utf-8")
    pattern = re.escape(marks[0]) + ".*?" + re.escape(marks[1])
    text = re.sub(pattern, lambda _: written, text, count=1, flags=re.DOTALL)
    PAGE.write_text(text, encoding="utf-8")
    print(f"wrote {PAGE}")


def main() -> None:
    """Measure all methods and write the section; with --heyoka only its part about heyoka."""
    compared = compare(beside_heyoka())
    if sys.argv[1:] == ["--heyoka"]:
        replace_part(compared, HEYOKA_MARKS)
    else:
        replace_part(section(measure(), compared, compiling()), MARKS)


if __name__ == "__main__":
    main()
