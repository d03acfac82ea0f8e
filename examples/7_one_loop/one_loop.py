"""One loop of two FMUs in three hosts, and a master that repeats steps to choose their length.

    cargo run --release -p one-loop -- dist/HubSlosh.fmu dist
    python examples/7_one_loop/one_loop.py --folder dist        # libcosim needs libcosimpy

The first command packs Controller.fmu and simulates the closed loop with the harness.
"""

import argparse
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

import hubslosh

STEP, STEPS = 0.02, 3000
"""Communication step, s, and number of steps."""
PLANT = {"init.slosh_angle": 0.1, "tank.h": (50, "mm"), "friction.model": "viscous"}
"""Parameters of the plant; they equal those in src/main.rs and ssp/."""
RECORDED = ["theta", "omega", "slosh_angle"]
TOLERANCE = 1e-9
"""Largest allowed difference between hosts, relative to each column's largest value."""


@dataclass
class Loop:
    """Plant and controller as two FMUs, connected by a Jacobi master.

    A Jacobi master steps both FMUs with the inputs from the start of the step.
    """

    plant: hubslosh.Plant
    controller: hubslosh.Plant
    slopes: bool
    """True if each input follows the derivative that the other FMU gives; otherwise it is held."""
    time: float = 0.0
    steps: int = field(default=0, init=False)

    def exchange(self) -> list[float]:
        """Read all outputs, then set all inputs; return tau and the recorded signals."""
        theta, omega, omega_dot = self.plant.get(["theta", "omega", "omega_dot"])
        row = self.plant.get(RECORDED)
        self.controller.set("theta", theta)
        self.controller.set("omega", omega)
        # der(tau) depends on the inputs, which are therefore set before it is read
        tau, tau_dot = self.controller.get(["tau", "der(tau)"])
        self.plant.set("tau_cmd", tau)
        if self.slopes:
            self.controller.set_slope("theta", omega)
            self.controller.set_slope("omega", omega_dot)
            self.plant.set_slope("tau_cmd", tau_dot)
        return [tau, *row]

    def step(self, end: float) -> None:
        """Step both FMUs to the time ``end`` (s)."""
        self.plant.step(end)
        self.controller.step(end)
        self.time = end
        self.steps += 1

    def save(self) -> tuple:
        """Return the saved states of both FMUs."""
        return self.plant.save(), self.controller.save()

    def restore(self, saved: tuple) -> None:
        """Restore the states that `save` returned."""
        self.plant.restore(saved[0])
        self.controller.restore(saved[1])
        self.time = saved[0][0]


def in_fmpy(folder: Path, fmu: str | Path, slopes: bool) -> pd.DataFrame:
    """Simulate the closed loop with fmpy.

    If ``slopes``, inputs change linearly over a step; otherwise they are held.
    """
    with hubslosh.Plant(fmu, PLANT) as plant, hubslosh.Plant(folder / "Controller.fmu") as pd_fmu:
        loop, rows = Loop(plant, pd_fmu, slopes), []
        for k in range(STEPS + 1):
            rows.append([k * STEP, *loop.exchange()])
            if k < STEPS:
                loop.step((k + 1) * STEP)
    return pd.DataFrame(rows, columns=["time", "tau", *RECORDED])


def in_libcosim(folder: Path, fmu: str | Path) -> pd.DataFrame:
    """Pack both FMUs as SSP into ``folder`` and simulate it with libcosim, which holds inputs."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    system = pack_system(folder, fmu)
    log_output_level(CosimLogLevel.ERROR)
    with tempfile.TemporaryDirectory() as unpacked:
        with zipfile.ZipFile(system) as archive:
            archive.extractall(unpacked)
        run = CosimExecution.from_ssp_file(unpacked, step_size=round(STEP * 1e9))
        observer = CosimObserver.create_last_value()
        run.add_observer(observer)

        def reader(component: str, names: list[str]) -> Callable[[], list[float]]:
            index = run.slave_index_from_instance_name(component)
            references = {v.name.decode(): v.reference for v in run.slave_variables(index)}
            wanted = [references[name] for name in names]
            return lambda: list(observer.last_real_values(index, wanted))

        tau, recorded = reader("controller", ["tau"]), reader("plant", RECORDED)
        rows = []  # the observer reads values at the ends of steps
        for k in range(STEPS):
            if not run.step():
                raise hubslosh.FmuError("libcosim cannot step the FMUs")
            rows.append([(k + 1) * STEP, *tau(), *recorded()])
    return pd.DataFrame(rows, columns=["time", "tau", *RECORDED])


def pack_system(folder: Path, fmu: str | Path) -> Path:
    """Write Loop.ssp into ``folder``."""
    system = folder / "Loop.ssp"
    with zipfile.ZipFile(system, "w", zipfile.ZIP_DEFLATED) as archive:
        texts = Path(__file__).with_name("ssp")
        archive.write(texts / "SystemStructure.ssd", "SystemStructure.ssd")
        archive.write(hubslosh.fmu_path(fmu), "resources/HubSlosh.fmu")
        archive.write(folder / "Controller.fmu", "resources/Controller.fmu")
    return system


def difference(one: pd.DataFrame, other: pd.DataFrame) -> float:
    """Return the largest difference of two tables, relative to each column's largest value."""
    one, other = one.set_index("time"), other.set_index("time")
    common = one.index.intersection(other.index)
    assert len(common) >= STEPS
    return ((one.loc[common] - other.loc[common]).abs().max() / other.abs().max()).max()


# A master that repeats steps ---------------------------------------------------------------------

PULSES = ((0.0, 0.0), (2.0, 0.05), (3.0, 0.0), (40.0, -0.1), (40.5, 0.0))
"""External torque (``tau_ext``) from each of these times on: s, N·m."""
STOP = 80.0  # s
LONGEST = 0.5
"""Longest step of the adaptive master, s."""
WATCHED = ["theta", "omega", "slosh_angle"]


def exactly(fmu: str | Path) -> hubslosh.Plant:
    """Return the plant with a solver so accurate that only errors of the coupling remain."""
    return hubslosh.Plant(fmu, PLANT, tolerance=1e-11)


def jump(loop: Loop) -> float:
    """Set the external torque at the present time; return the time of its next change, s."""
    loop.plant.set("tau_ext", [torque for start, torque in PULSES if start <= loop.time][-1])
    return min((start for start, _ in PULSES if start > loop.time), default=STOP)


def fixed(fmu: str | Path, folder: Path, step: float) -> tuple[np.ndarray, int]:
    """Simulate with a fixed step, s.

    Return rows of time and watched outputs, and the number of steps.
    """
    with exactly(fmu) as plant, hubslosh.Plant(folder / "Controller.fmu") as pd_fmu:
        loop, rows = Loop(plant, pd_fmu, slopes=True), []
        while loop.time < STOP - 1e-9:
            jump(loop)
            loop.exchange()
            loop.step(round(loop.time / step + 1) * step)
            rows.append([loop.time, *plant.get(WATCHED)])
    return np.array(rows), loop.steps


def adaptive(fmu: str | Path, folder: Path, tolerance: float) -> tuple[np.ndarray, int]:
    """Simulate with a master that chooses its steps; return rows and the number of steps.

    It makes each step whole, rolls back, and makes it in two halves. The difference of the results,
    in units of ``tolerance``, is the error of the whole step. This error grows as the third power
    of the step, since linearly extrapolated inputs have errors of second order.
    """
    with exactly(fmu) as plant, hubslosh.Plant(folder / "Controller.fmu") as pd_fmu:
        loop, rows, step = Loop(plant, pd_fmu, slopes=True), [], 1e-3

        def go(end: float) -> np.ndarray:
            loop.exchange()
            loop.step(end)
            return np.array(plant.get(WATCHED))

        while loop.time < STOP - 1e-9:
            until = jump(loop)
            saved, start = loop.save(), loop.time
            # equal steps up to the next jump, so that a step ends exactly there and none is very
            # short
            left = np.ceil((until - start) / step)
            end = until if left == 1 else start + (until - start) / left
            whole = go(end)
            loop.restore(saved)
            go((start + end) / 2)
            halves = go(end)
            error = np.abs(whole - halves).max() / tolerance
            step = (end - start) * np.clip(0.9 * (error + 1e-9) ** (-1 / 3), 0.2, 3)
            step = min(step, LONGEST)
            if error <= 1:
                rows.append([loop.time, *halves])
            else:
                loop.restore(saved)
    return np.array(rows), loop.steps


def exact(fmu: str | Path, times: np.ndarray) -> np.ndarray:
    """Return the watched outputs at ``times`` of the linear loop, from its eigenvalues."""
    plant = hubslosh.linearize(fmu, PLANT, ["tau_cmd", "tau_ext"], WATCHED)
    k_p, k_d, t_f = 4.22, 1.88, 0.02  # as in controller.rs
    n = len(plant.A)
    # states of the plant, tau and the external torque
    A = np.zeros((n + 2, n + 2))
    A[:n, :n], A[:n, n:] = plant.A, plant.B
    A[n, :n] = -(np.array([k_p, k_d]) @ plant.C[:2]) / t_f
    A[n, n] = -1 / t_f
    x = np.zeros(n + 2)
    x[:n] = np.linalg.lstsq(plant.C, [0.0, 0.0, PLANT["init.slosh_angle"]], rcond=None)[0]
    rates, modes = np.linalg.eig(A)

    def after(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        return ((np.linalg.solve(modes, x) * np.exp(np.multiply.outer(t, rates))) @ modes.T).real

    found, now = np.empty((len(times), len(WATCHED))), 0.0
    starts = [start for start, _ in PULSES] + [np.inf]
    for k, (start, torque) in enumerate(PULSES):
        x = after(np.array(start - now), x)
        x[-1], now = torque, start
        # at a jump the values are those before it
        these = (times > start + 1e-9) & (times <= starts[k + 1] + 1e-9)
        found[these] = after(times[these] - start, x)[:, :n] @ plant.C.T
    return found


def hosts(folder: Path, fmu: str | Path) -> dict[str, float]:
    """Return the difference of each host's result from the result of ``hubslosh run``.

    libcosim is included if it is installed.
    """
    held, slopes = (pd.read_csv(folder / f"loop_{name}.csv") for name in ("held", "slopes"))
    found = {
        "fmpy, inputs held": difference(in_fmpy(folder, fmu, False), held),
        "fmpy, inputs with derivatives": difference(in_fmpy(folder, fmu, True), slopes),
        "held against slopes": difference(held, slopes),
    }
    try:
        found["libcosim (SSP), inputs held"] = difference(in_libcosim(folder, fmu), held)
    except ModuleNotFoundError:
        print("libcosim is not compared: it needs pip install libcosimpy")
    return found


def figure(runs: dict[str, list[tuple[np.ndarray, int, float]]], path: Path) -> None:
    import matplotlib.pyplot as plt

    from hubslosh.plot import COLORS, save

    whole, (history, steps, work) = plt.subplots(
        3, figsize=(8, 9), layout="constrained", height_ratios=(1, 1, 1.2)
    )
    rows = runs["chosen by the master"][1][0]
    history.plot(rows[:, 0], np.degrees(rows[:, 1]), color=COLORS[0], linewidth=1, label="theta")
    history.plot(
        rows[:, 0], np.degrees(rows[:, 3]), color=COLORS[1], linewidth=0.8, label="slosh angle"
    )
    history.set(xlabel="time (s)", ylabel="angle (deg)", title="Two pulses of torque, then ringing")
    steps.semilogy(rows[1:, 0], np.diff(rows[:, 0]), color=COLORS[0], linewidth=0.8)
    steps.set(xlabel="time (s)", ylabel="accepted step (s)")
    steps.set_title("The master takes longer steps as the slosh dies out, short ones at a pulse")
    for (name, several), color in zip(runs.items(), COLORS[:2], strict=True):
        work.loglog(
            [n for _, n, _ in several], [e for _, _, e in several], "o-", color=color, label=name
        )
    work.set(xlabel="steps, those rolled back included", ylabel="largest error (rad, rad/s)")
    work.set_title("and needs half as many for the same error")
    for ax in (history, steps, work):
        ax.grid(alpha=0.3, which="both")
    history.legend()
    work.legend(title="step")
    save(whole, path)


def main() -> None:
    parser = argparse.ArgumentParser(description="One loop in several hosts.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--folder", type=Path, default=Path("dist"), help="Controller.fmu's folder")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    parser.add_argument("--hosts-only", action="store_true", help="compare the hosts only")
    args = parser.parse_args()
    if not (args.folder / "Controller.fmu").exists():
        command = f"cargo run --release -p one-loop -- dist/HubSlosh.fmu {args.folder}"
        sys.exit(f"error: {args.folder} has no Controller.fmu; create it with: {command}")
    differences = hosts(args.folder, args.fmu)
    for name, value in differences.items():
        print(f"{name}: {value:.1e}")
    if any(value > TOLERANCE for name, value in differences.items() if "against" not in name):
        sys.exit("error: the hosts differ")
    if args.hosts_only:
        return
    runs: dict[str, list[tuple[np.ndarray, int, float]]] = {}
    for name, run, choices in (
        ("fixed", fixed, (0.04, 0.02, 0.01, 0.005, 0.0025)),
        ("chosen by the master", adaptive, (1e-4, 1e-5, 1e-6, 1e-7)),
    ):
        for choice in choices:
            rows, steps = run(args.fmu, args.folder, choice)
            error = np.abs(rows[:, 1:] - exact(args.fmu, rows[:, 0])).max()
            runs.setdefault(name, []).append((rows, steps, error))
            print(f"step {name}, {choice}: {steps} steps, error {error:.1e}")
    figure(runs, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
