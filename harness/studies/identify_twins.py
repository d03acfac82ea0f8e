"""Tests with twins whether the intervals of `hubslosh identify --free` contain the true values.

    python identify_twins.py FOLDER [--cases VanDerPol,Hub,…] [--twins 100] [--first 1]

FOLDER must contain VanDerPol.fmu, BouncingBall.fmu and Dahlquist.fmu of modelica/Reference-FMUs
(built for FMI 2.0), and Orifice.fmu (`orifice.py`, exported by PythonFMU, whose binary needs
LD_PRELOAD=libpython3.11.so). The program finds HubSlosh itself.

A twin is a simulated recording whose true parameters are known. No recording comes from an FMU:
each case solves its equation in closed form, or by SciPy at a tolerance of 1e-10, with true values
drawn within 30 % of the start of the fit, and adds noise. The program prints a table in Markdown.
"""

import argparse
import json
import subprocess
import tempfile
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from math import exp, inf, log, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.random import Generator, default_rng
from scipy.integrate import solve_ivp


@dataclass
class Twin:
    """A simulated recording (a twin of a measured one), with the true values of the unknowns."""

    table: pd.DataFrame
    truth: dict[str, float]


@dataclass
class Case:
    """An FMU, its unknowns, and the function that simulates its recordings."""

    fmu: str
    arguments: list[str]
    make: Callable[[Generator], Twin]
    what: str = field(default="")


def draw_near(random: Generator, value: float) -> float:
    """Return a random number within 30 % of ``value``."""
    return float(value * random.uniform(0.7, 1.3))


def noisy(random: Generator, signal: np.ndarray, part: float) -> np.ndarray:
    """Return the signal with white noise of ``part`` times the signal's standard deviation."""
    return signal + part * signal.std() * random.normal(size=signal.size)


def van_der_pol(random: Generator) -> Twin:
    """Return a few cycles of the Van der Pol oscillator x0' = x1, x1' = mu (1 - x0²) x1 - x0."""
    truth = {
        "mu": draw_near(random, 1.0),
        "x0@1": draw_near(random, 2.0),
        "x1@1": random.uniform(-0.3, 0.3),
    }
    mu, t = truth["mu"], np.arange(0.0, 20.001, 0.05)
    solved = solve_ivp(
        lambda _, x: [x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]],
        (0.0, 20.0),
        [truth["x0@1"], truth["x1@1"]],
        method="DOP853",
        t_eval=t[t <= 20.0],
        rtol=1e-10,
        atol=1e-12,
    )
    x0, x1 = (noisy(random, x, 0.03) for x in solved.y)
    return Twin(pd.DataFrame({"time": solved.t, "x0": x0, "x1": x1}), truth)


def bouncing_ball(random: Generator) -> Twin:
    """Return the path of a bouncing ball, which rests on the ground when slower than 0.1 m/s."""
    truth = {
        "e": random.uniform(0.55, 0.9),
        "g": -draw_near(random, 9.81),
        "h@1": draw_near(random, 1.0),
    }
    e, g, h0 = truth["e"], -truth["g"], truth["h@1"]
    pieces, at = [(0.0, h0, 0.0)], sqrt(2 * h0 / g)
    up = e * g * at
    while up >= 0.1:
        pieces.append((at, 0.0, up))
        at += 2 * up / g
        up *= e
    time = np.arange(0.0, 3.0, 0.01)
    h = np.zeros_like(time)
    for k, (begin, start, up) in enumerate(pieces):
        end = pieces[k + 1][0] if k + 1 < len(pieces) else at
        rows = (time >= begin) & (time < end)
        s = time[rows] - begin
        h[rows] = start + up * s - g / 2 * s**2
    return Twin(pd.DataFrame({"time": time, "h": noisy(random, h, 0.02)}), truth)


def dahlquist(random: Generator) -> Twin:
    """Return an exponential decay, x' = -k x."""
    truth = {"k": draw_near(random, 1.0), "x@1": draw_near(random, 1.0)}
    time = np.arange(0.0, 5.0, 0.02)
    x = truth["x@1"] * np.exp(-truth["k"] * time)
    return Twin(pd.DataFrame({"time": time, "x": noisy(random, x, 0.05)}), truth)


def orifice(random: Generator) -> Twin:
    """Return the level of a draining tank, area · h' = q - c sqrt(h), with an inflow in steps."""
    truth = {
        "area": draw_near(random, 1.0),
        "c": draw_near(random, 0.5),
        "h@1": draw_near(random, 1.0),
    }
    time = np.arange(0.0, 40.0, 0.2)
    q = 0.3 + 0.3 * np.repeat(random.integers(0, 2, 20), 10)
    h, levels = truth["h@1"], []
    for flow in q:
        levels.append(h)
        solved = solve_ivp(
            lambda _, y, flow=flow: (
                (flow - truth["c"] * np.sqrt(np.maximum(y, 0.0))) / truth["area"]
            ),
            (0.0, 0.2),
            [h],
            method="DOP853",
            rtol=1e-10,
            atol=1e-12,
        )
        h = solved.y[0, -1]
    level = noisy(random, np.array(levels), 0.03)
    return Twin(pd.DataFrame({"time": time, "q": q, "h": level}), truth)


def hub(random: Generator) -> Twin:
    """Return the motion of a hub with stick and slip, I w' = tau - b w - c sgn(w).

    The torque has steps; the solution is in closed form from step to step.
    """
    truth = {
        "hub.I": draw_near(random, 0.3),
        "friction.b": draw_near(random, 0.04),
        "friction.c": draw_near(random, 0.02),
        "bias(omega)@1": 1e-3 * random.normal(),
    }
    inertia, b, c, _ = truth.values()
    step, time = 0.05, np.arange(0.0, 60.0, 0.05)
    tau = np.repeat(0.1 * random.uniform(-1.0, 1.0, 60), 20)
    w, rates = 0.0, []
    for torque in tau:
        rates.append(w)
        left = step
        while left > 0.0:
            if w == 0.0 and abs(torque) <= c:
                break
            sign = np.sign(w if w != 0.0 else torque)
            limit = (torque - sign * c) / b
            # w(t) = limit + (w - limit) exp(-b t/I) is 0 at this time
            ratio = limit / (limit - w) if w != 0.0 else 1.0
            stop = -inertia / b * log(ratio) if 0.0 < ratio < 1.0 else float("inf")
            if stop < left:
                w, left = 0.0, left - stop
            else:
                w = limit + (w - limit) * exp(-b * left / inertia)
                left = 0.0
    omega = np.array(rates) + truth["bias(omega)@1"] + 2e-3 * random.normal(size=time.size)
    return Twin(pd.DataFrame({"time": time, "tau_cmd": tau, "omega": omega}), truth)


STICKING = [
    "slosh.model=frozen",
    "fluid.rho=1e-6",
    "friction.model=stribeck",
    "friction.d=0",
]
CASES = {
    "VanDerPol": Case(
        "VanDerPol.fmu",
        [
            "--free",
            "mu=1:0.2:4,x0@each=2:-4:4,x1@each=0:-2:2",
            "--outputs",
            "x0,x1",
            "--solver",
            "host",
        ],
        van_der_pol,
        "limit cycle; Model Exchange, starts free",
    ),
    "BouncingBall": Case(
        "BouncingBall.fmu",
        [
            "--free",
            "e=0.7:0.5:0.99,g=-9.81:-15:-5,h@each=1:0.3:2",
            "--outputs",
            "h",
            "--solver",
            "host",
        ],
        bouncing_ball,
        "bounces until it rests; Model Exchange, events",
    ),
    "Dahlquist": Case(
        "Dahlquist.fmu",
        ["--free", "k=1:0.1:5,x@each=1:0.1:5", "--outputs", "x", "--solver", "host"],
        dahlquist,
        "decay; Model Exchange",
    ),
    "Orifice": Case(
        "Orifice.fmu",
        [
            "--free",
            "area=1:0.1:5,c=0.5:0.05:2,h@each=1:0.1:5",
            *("--outputs", "h", "--inputs", "q:held"),
        ],
        orifice,
        "exported by PythonFMU; Co-Simulation, driven",
    ),
    "Hub": Case(
        "HubSlosh",
        ["--free", "hub.I=0.3:0.05:2,friction.b=0.04:0:1,friction.c=0.02:0:0.1"]
        + ["--bias", "omega", "--inputs", "tau_cmd:held", "--outputs", "omega"]
        + [word for item in STICKING for word in ("--set", item)],
        hub,
        "stick and slip; Co-Simulation, bias free",
    ),
}


def run(case: Case, twin: Twin, program: str, folder: str) -> dict:
    recording, result = Path(folder) / "twin.csv", Path(folder) / "result.json"
    twin.table.to_csv(recording, index=False)
    command = [program, "-q", "identify", recording, "--fmu", case.fmu, *case.arguments]
    subprocess.run([*command, "--out", result], check=True, capture_output=True)
    return json.loads(result.read_text(encoding="utf-8"))


class Tally:
    """Errors of the estimates of all twins, relative to their standard deviations.

    A result with the verdict that the model does not fit is counted separately, because the verdict
    says that its intervals cannot be trusted.
    """

    def __init__(self) -> None:
        self.seen: dict[str, list[tuple[bool, float, float]]] = defaultdict(list)
        self.refused: list[int] = []
        self.unfit: list[int] = []

    def add(self, seed: int, found: dict | str, truth: dict[str, float]) -> None:
        """Count the result of the twin ``seed``; ``found`` is the error text if it was refused."""
        if isinstance(found, str):
            self.refused.append(seed)
            return
        if not (found["fits"] and found["converged"]):
            self.unfit.append(seed)
            return
        for unknown, e in (found["parameters"] | found["measurement"]).items():
            if unknown in truth and e["std"]:
                low, high = (inf if end is None else end for end in e["interval"])
                error = (e["value"] - truth[unknown]) / e["std"]
                self.seen[unknown].append((low <= truth[unknown] <= high, error, e["std"]))

    def rows(self) -> list[str]:
        """Return a row for each unknown of the Markdown table of coverage."""
        rows = []
        for unknown, each in self.seen.items():
            inside, off, std = (np.array(column, dtype=float) for column in zip(*each, strict=True))
            rows.append(
                f"| `{unknown}` | {int(inside.sum())} of {len(each)} "
                f"| {sqrt((off**2).mean()):.2f} | {abs(off).max():.1f} | {np.median(std):.1e} |"
            )
        return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder with the FMUs of other projects")
    parser.add_argument("--cases", default=",".join(CASES), help="which cases")
    parser.add_argument("--twins", type=int, default=100, help="number of twins of each case")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--program", default="hubslosh", help="the program")
    arguments = parser.parse_args()
    print("| FMU | unknown | inside its 95 % interval | rms of error/σ | largest | median σ |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in arguments.cases.split(","):
        case = CASES[name]
        if case.fmu.endswith(".fmu"):
            case.fmu = str(arguments.folder / case.fmu)
        tally, last = Tally(), ""
        with tempfile.TemporaryDirectory() as folder:
            for seed in range(arguments.first, arguments.first + arguments.twins):
                twin = case.make(default_rng(seed))
                try:
                    found = run(case, twin, arguments.program, folder)
                except subprocess.CalledProcessError as error:
                    found = last = error.stderr.decode()[-200:]
                tally.add(seed, found, twin.truth)
        print("\n".join(f"| {name} {row}" for row in tally.rows()))
        print(
            f"<!-- {name}: {case.what}; does not fit: {tally.unfit}; "
            f"refused: {tally.refused} {last} -->",
            flush=True,
        )


if __name__ == "__main__":
    main()
