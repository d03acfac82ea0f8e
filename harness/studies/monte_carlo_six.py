"""Measures the CPU time of Monte Carlo runs by Spacecraft.fmu and by batches of heyoka.

    PYTHONPATH=harness/python python3 harness/studies/monte_carlo_six.py [RUNS]

It needs the same files and packages as work_precision_six.py, and prints one line for each method.
RUNS is 1000 by default. Each run is 200 s of the craft of work_precision_six.py, with inertias,
slosh masses and lengths within 5 % of their nominal values, at a tolerance of 1e-10. heyoka
integrates a batch of runs side by side; its results are the states at the end.
"""

import sys
import time

import work_precision_six as six  # installs the packages, and finds the modules of the benchmark

# isort: split
import cases
import heyoka as hy
import heyoka_taylor
import hubslosh_fmus
import numpy as np
import pandas as pd

import hubslosh

TOLERANCE = 1e-10
ROUNDS = 10
SIZES = (1, 4, 8)
"""Numbers of runs that heyoka integrates side by side."""


def ranges(settings: dict) -> dict[str, tuple[float, float]]:
    """Return the range of each drawn parameter of the FMU."""
    names = [f"craft.J{axis}" for axis in ("xx", "yy", "zz")]
    names += [f"tank[{i}].{what}[1]" for i in (1, 2) for what in ("mass", "length")]
    return {name: (0.95 * settings[name], 1.05 * settings[name]) for name in names}


def by_fmu(runs: int) -> tuple[pd.DataFrame, float]:
    """Return the final rates of all runs of `hubslosh.monte_carlo`, and the CPU time, s."""
    settings, _ = hubslosh_fmus.with_tanks(cases.parameters(six.CASE))
    given = six.pieces(ROUNDS, 1.0)
    end = given[-1][1]
    table = pd.DataFrame([*(of[2] for of in given), given[-1][2]], columns=hubslosh_fmus.WRENCH)
    table.insert(0, "time", [*(of[0] for of in given), end])

    def outcome(drawn: dict) -> dict[str, float]:
        run = hubslosh.simulate(
            six.FMU, settings | drawn, table, end, end, ["omega"], tolerance=TOLERANCE, hold=True
        )
        return run.iloc[-1][["omega[1]", "omega[2]", "omega[3]"]].to_dict()

    outcome({})  # load the FMU
    begin = time.process_time()
    found = hubslosh.monte_carlo(ranges(settings), runs, outcome=outcome, workers=1, progress=False)
    return found, time.process_time() - begin


def by_heyoka(drawn: np.ndarray, size: int) -> tuple[np.ndarray, float, float]:
    """Return the final rates of all runs, and the CPU times of integrating and of compiling, s.

    ``drawn`` has a row of the seven drawn parameters for each run; incomplete batches are left out.
    """
    p = cases.parameters(six.CASE)
    p["J_xx"], p["J_yy"], p["J_zz"] = hy.par[6], hy.par[7], hy.par[8]
    for i, tank in enumerate(p["tank"]):
        mass, length = hy.par[9 + 2 * i], hy.par[10 + 2 * i]
        # as in the FMU, the damping ratio is constant
        tank["c"] *= mass / tank["m"] * hy.sqrt(tank["l"] / length)
        tank["m"], tank["l"] = mass, length
    # Otherwise heyoka would load recurrences from its cache that an earlier call has compiled.
    p["mass"] *= 1 + 1e-15 * np.random.default_rng().integers(1, 100)
    begin = time.process_time()
    equations, start = heyoka_taylor.craft_system(p)
    start = np.array(start, float)[:, None] * np.ones(size)
    make = hy.taylor_adaptive if size == 1 else hy.taylor_adaptive_batch
    shape = (lambda x: x[:, 0]) if size == 1 else (lambda x: x)
    taylor = make(
        equations, shape(start), pars=shape(np.zeros((13, size))), tol=TOLERANCE, compact_mode=False
    )
    compiled = time.process_time()
    rates = []
    for batch in drawn[: len(drawn) // size * size].reshape(-1, size, drawn.shape[1]):
        taylor.set_time(0.0) if size > 1 else setattr(taylor, "time", 0.0)
        taylor.state[:] = shape(start)
        for _, end, wrench, _ in six.pieces(ROUNDS, 1.0):
            taylor.pars[:] = shape(np.vstack([wrench[:, None] * np.ones(size), batch.T]))
            taylor.propagate_until(end)
        rates.append(taylor.state.reshape(-1, size)[4:7].T.copy())
    return np.vstack(rates), time.process_time() - compiled, compiled - begin


def main() -> None:
    """Measure all methods."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    found, spent = by_fmu(runs)
    print(f"Spacecraft.fmu: {1e3 * spent / runs:.2f} ms of CPU time a run", flush=True)
    drawn, wanted = found.iloc[:, 1:8].to_numpy(), found.iloc[:, 8:].to_numpy()
    for size in SIZES:
        rates, spent, compiling = by_heyoka(drawn, size)
        differs = np.max(np.abs(rates - wanted[: len(rates)]))
        print(
            f"heyoka, {size} side by side: {1e3 * spent / len(rates):.2f} ms, after "
            f"{compiling:.0f} s of compiling; final rates differ by at most {differs:.1e} rad/s",
            flush=True,
        )


if __name__ == "__main__":
    main()
