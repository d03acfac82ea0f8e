"""Compares Spacecraft.fmu with Basilisk's spacecraft in six degrees of freedom; writes a page.

    PYTHONPATH=harness/python python3 harness/studies/basilisk_six.py

It needs dist/Spacecraft.fmu (``cargo run --release -- pack --model Spacecraft --out
dist/Spacecraft.fmu``) and Python 3.11 or newer. The first run creates a virtual environment in the
target directory and needs the network. It takes a minute or two.

In Basilisk, the hub is the dry craft with the rigid liquids, and each tank is a
``sphericalPendulum``. Both craft fly freely from the same initial state, under forces and torques
that are constant over some seconds.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import environment

try:
    import numpy as np
    import pandas as pd
    from Basilisk.simulation import extForceTorque, spacecraft, sphericalPendulum, svIntegrators
    from Basilisk.utilities import SimulationBaseClass, macros, pythonVariableLogger

    from basilisk_comparison import (
        ALLOWED,
        EVERY,
        Signals,
        bob,
        column,
        differences,
        pendulum_at,
        write,
    )  # fmt: skip
    from hubslosh import FmuError, simulate
except ModuleNotFoundError as missing:
    environment.run_again_in("basilisk", missing)

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "modelDescription" / "Spacecraft" / "documentation" / "basilisk.md"

TOLERANCE = 1e-13  # tolerance of the FMU's solver in the comparison
SIGNALS = ("attitude", "omega", "position", "velocity", "p[1]", "p[2]")


@dataclass(frozen=True)
class Tank:
    """A tank with one slosh mode; its values differ from the start values of Spacecraft.fmu."""

    position: tuple[float, float, float]  # m, from O
    q: tuple[float, float, float, float] = (1, 0, 0, 0)  # tank to body axes
    p: tuple[float, float, float] = (0, 0, -1)  # direction of the bob at the start, tank axes
    p_dot: tuple[float, float, float] = (0, 0, 0)  # 1/s
    m_0: float = 114.356  # kg
    H_0: float = 0.0246138  # m
    I_0: float = 0.904854  # kg·m²
    mass: float = 46.4931  # kg
    length: float = 0.174907  # m
    hinge: float = 0.114366  # m

    def axes(self) -> np.ndarray:
        """Return the matrix from tank to body axes."""
        return rotation(np.array(self.q) / np.linalg.norm(self.q))


@dataclass(frozen=True)
class Case:
    """Inputs of one comparison, for both programs.

    Each segment has its end (s), and a constant force (N) and torque (N·m), body axes.
    """

    text: str
    segments: list[tuple[float, tuple[float, float, float], tuple[float, float, float]]]
    tanks: tuple[Tank, Tank]
    omega: tuple[float, float, float] = (0, 0, 0)  # rad/s
    zeta: float = 0.01
    mass: float = 1180.0  # dry mass, kg
    r: tuple[float, float, float] = (0.012, -0.018, 0.21)  # dry centre of mass from O, m
    J: np.ndarray = field(
        default_factory=lambda: np.array([[910, 14, -9], [14, 860, 6], [-9, 6, 640.0]])
    )  # dry inertia about the dry centre of mass, kg·m²

    @property
    def duration(self) -> float:
        """End of the last segment, s."""
        return self.segments[-1][0]


G_REF = 1.5  # specific force for which zeta is given, m/s²
UPRIGHT = (Tank((0.62, 0, -0.2)), Tank((-0.62, 0, -0.2)))
LEANING = (
    Tank((0.62, 0.1, -0.2), q=(0.98, 0.1, -0.15, 0.05), p=(0.3, -0.2, -0.9), p_dot=(0.4, 0.3, 0)),
    Tank((-0.5, 0.2, 0.3), q=(0.9, -0.2, 0.3, 0.1), p=(-0.5, 0.1, -0.8), mass=30.0, length=0.25),
)
PULSES = [
    (1.0, (0, 0, 2450), (0, 0, 0)),
    (2.0, (0, 0, 2450), (0, 160, 0)),
    (5.0, (0, 0, 2450), (-35, -23, 0)),
    (6.0, (0, 0, 2450), (0, 0, 120)),
    (9.0, (150, 0, 2450), (0, 0, 0)),
    (20.0, (0, 0, 2450), (-35, -23, 0)),
]
THROWN = [(8.0, (60, -40, 1900), (20, 10, -15)), (20.0, (0, 0, 1900), (0, 0, 0))]
SPIN = (0.2, -0.3, 0.4)
CASES = {
    "pulses": Case("upright tanks at ±x, thrust, torque pulses about all axes", PULSES, UPRIGHT),
    "pulses, undamped": Case("as *pulses*, without damping", PULSES, UPRIGHT, zeta=0.0),
    "thrown": Case("two unequal, tilted tanks, moving liquid, craft that tumbles under thrust",
                   THROWN, LEANING, SPIN),
    "thrown, undamped": Case("as *thrown*, without damping", THROWN, LEANING, SPIN, zeta=0.0),
    "heavily damped": Case("as *thrown*, damping ratio 0.2", THROWN, LEANING, SPIN, zeta=0.2),
}  # fmt: skip


def rotation(q: Sequence[float]) -> np.ndarray:
    """Return the matrix of a unit quaternion, scalar first."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def dcm_from_mrp(sigma: np.ndarray) -> np.ndarray:
    """Return the matrix from body to inertial axes of modified Rodrigues parameters."""
    s2 = sigma @ sigma
    return rotation(np.array([1 - s2, *(2 * sigma)]) / (1 + s2))


def skew(a: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product with ``a``."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def drag(case: Case, tank: Tank) -> float:
    """Return the viscous damping coefficient of the tank's slosh mass, N·s/m."""
    return 2 * case.zeta * tank.mass * (G_REF / tank.length) ** 0.5


def ours(fmu: Path, case: Case, start: Signals, tolerance: float = TOLERANCE) -> Signals:
    """Return the signals of our FMU every 20 ms, simulated in steps of 20 ms.

    ``start`` has the first samples of Basilisk's signals, from which the FMU starts.
    """
    settings: dict[str, float | int] = {"craft.mass": case.mass, "tanks": 2}
    for name, (i, j) in {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2),
                         "yz": (1, 2)}.items():  # fmt: skip
        settings[f"craft.J{name}"] = case.J[i, j]

    def put(name: str, values: Sequence[float], index: str = "{}") -> None:
        for i, value in enumerate(values, 1):
            settings[f"{name}[{index.format(i)}]"] = float(value)

    put("craft.r", case.r)
    put("init.omega", case.omega)
    put("init.position", start["position"][0])
    put("init.velocity", start["velocity"][0])
    for i, tank in enumerate(case.tanks, 1):
        name = f"tank[{i}]"
        settings |= {f"{name}.m_0": tank.m_0, f"{name}.H_0": tank.H_0, f"{name}.I_0": tank.I_0}
        settings |= {f"{name}.mass[1]": tank.mass, f"{name}.length[1]": tank.length}
        settings |= {f"{name}.hinge[1]": tank.hinge, f"{name}.zeta[1]": case.zeta}
        settings[f"{name}.g_ref"] = G_REF
        settings[f"{name}.damping_law"] = "constant"
        put(f"{name}.position", tank.position)
        put(f"{name}.q", tank.q)
        put(f"{name}.p_0", tank.p, "1,{}")
        put(f"{name}.p_dot_0", tank.p_dot, "1,{}")
    ends = [0.0] + [end for end, *_ in case.segments]
    wrenches = [np.hstack(segment[1:]) for segment in case.segments]
    table = pd.DataFrame(
        np.vstack([*wrenches, wrenches[-1]]),
        columns=[f"{port}[{i}]" for port in ("force", "torque") for i in (1, 2, 3)],
    )
    table.insert(0, "time", ends)
    columns = {"q": 4, "omega": 3, "position": 3, "velocity": 3}
    names = [f"{name}[{i}]" for name, n in columns.items() for i in range(1, n + 1)]
    names += [f"tank[{i}].p[1,{k}]" for i in (1, 2) for k in (1, 2, 3)]
    run = simulate(
        fmu, settings, table, case.duration, EVERY, names, tolerance=tolerance, hold=True
    )
    q, omega, position, velocity, *bobs = np.split(run[names].to_numpy(), [4, 7, 10, 13, 16], 1)
    return {
        "attitude": np.array([rotation(row).ravel() for row in q]),
        "omega": omega,
        "position": position,
        "velocity": velocity,
        **{f"p[{i}]": bobs[i - 1] @ case.tanks[i - 1].axes().T for i in (1, 2)},
    }


def basilisk(case: Case, integrator: str = "RKF78", step: float = 1e-3) -> Signals:
    """Return Basilisk's signals every 20 ms.

    ``integrator`` is the name of the integrator in Basilisk, and ``step`` its step, s.
    """
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))

    # rigid part of the craft: dry craft and rigid liquids about their common centre of mass
    parts = [(case.mass, np.array(case.r), case.J)]
    for tank in case.tanks:
        e = tank.axes()[:, 2]
        # the rigid liquid has no inertia about the tank's axis, I_z = 0
        inertia = tank.I_0 * (np.eye(3) - np.outer(e, e))
        parts.append((tank.m_0, np.array(tank.position) + tank.H_0 * e, inertia))
    mass = sum(m for m, *_ in parts)
    centre = sum(m * s for m, s, _ in parts) / mass
    inertia = sum(J - m * skew(s - centre) @ skew(s - centre) for m, s, J in parts)

    craft = spacecraft.Spacecraft()
    craft.hub.mHub = mass
    craft.hub.r_BcB_B = column(*centre)
    craft.hub.IHubPntBc_B = inertia.tolist()
    craft.hub.omega_BN_BInit = column(*case.omega)
    craft.setIntegrator(getattr(svIntegrators, f"svIntegrator{integrator}")(craft))
    pendulums = [pendulum_of(case, tank) for tank in case.tanks]
    for pendulum in pendulums:
        craft.addStateEffector(pendulum)
    forces = extForceTorque.ExtForceTorque()
    craft.addDynamicEffector(forces)

    every = macros.sec2nano(EVERY)
    hub = craft.scStateOutMsg.recorder(every)

    liquid = pythonVariableLogger.PythonVariableLogger(
        {f"p{i}": lambda _, p=p: bob(craft, p) for i, p in enumerate(pendulums, 1)}, every
    )
    for model in (craft, forces, hub, liquid):
        simulation.AddModelToTask("task", model)
    for n, (end, force, torque) in enumerate(case.segments):
        forces.extForce_B = column(*force)
        forces.extTorquePntB_B = column(*torque)
        if n == 0:
            simulation.InitializeSimulation()
        simulation.ConfigureStopTime(macros.sec2nano(end))
        simulation.ExecuteSimulation()
    return {
        "attitude": np.array([dcm_from_mrp(sigma).ravel() for sigma in hub.sigma_BN]),
        "omega": hub.omega_BN_B,
        "position": hub.r_BN_N,
        "velocity": hub.v_BN_N,
        "p[1]": np.array(liquid.p1),
        "p[2]": np.array(liquid.p2),
    }


def pendulum_of(case: Case, tank: Tank) -> sphericalPendulum.SphericalPendulum:
    """Return Basilisk's pendulum for a tank.

    Its angles are zero at the start, so that its first axis points to the bob at the start.
    """
    axes = tank.axes()
    first = np.array(tank.p) / np.linalg.norm(tank.p)
    rate = np.array(tank.p_dot) - first * (first @ tank.p_dot)
    first, rate = axes @ first, axes @ rate
    third = np.cross(first, [0.6, 0.0, 0.8])
    third /= np.linalg.norm(third)
    second = np.cross(third, first)
    place = np.array(tank.position) + tank.hinge * axes[:, 2]
    frame = (first, second, third)
    return pendulum_at(tank.mass, tank.length, place, drag(case, tank), frame, rate)


def cost_table(fmu: Path, exact: Signals) -> list[str]:
    """Return a table with the errors and CPU times of both programs for the case *thrown*.

    CPU times are relative to Spacecraft.fmu at the tolerance 1e-8.
    """
    case = CASES["thrown"]
    rows = []
    for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        begin = time.process_time()
        got = ours(fmu, case, exact, tolerance)
        seconds = time.process_time() - begin
        rows.append((f"Spacecraft.fmu, tolerance {tolerance:.0e}", "20", got, seconds))
    for step in (1, 2, 5, 10, 20):
        begin = time.process_time()
        got = basilisk(case, "RK4", step * 1e-3)
        rows.append(("Basilisk's RK4", str(step), got, time.process_time() - begin))
    unit = rows[2][-1]
    return [
        "| integrator | step, ms | largest difference | CPU time |",
        "| --- | --- | --- | --- |",
        *(
            f"| {name} | {step} | {max(differences(got, exact)):.1e} | {seconds / unit:.2g} |"
            for name, step, got, seconds in rows
        ),
    ]


def page(cases: list[str], cost: list[str], worst: float) -> str:
    """Return the page with the comparison of all cases and the table of costs."""
    return "\n".join([
        "<!-- Written by harness/studies/basilisk_six.py; do not edit. -->",
        "# Comparison with Basilisk",
        "",
        "Does Spacecraft agree with an independent implementation?",
        "",
        f"Basilisk {version('bsk')} (AVS Lab, University of Colorado) has a spacecraft in six",
        "degrees of freedom and a spherical pendulum for slosh, which were written independently",
        "of this project. For a craft with two tanks of one mode each, Spacecraft and Basilisk",
        f"agree to **{worst:.0e}** of each signal's maximum over 20 s. These commands make the",
        "comparison and write this page:",
        "",
        "    cargo run --release -- pack --model Spacecraft --out dist/Spacecraft.fmu",
        "    PYTHONPATH=harness/python python3 harness/studies/basilisk_six.py",
        "",
        "The second command fails, and does not change this page, if a difference is larger than",
        f"{ALLOWED:.0e}.",
        "",
        "In Basilisk the hub is the dry craft with the rigid liquids, and its body point B is the",
        "point O of Spacecraft. The damping matrix of a pendulum is c times the unit matrix.",
        "Basilisk has no centring stiffness, so that k is 0. Basilisk integrates with RKF78 in",
        f"steps of 1 ms, Spacecraft in steps of 20 ms with a tolerance of {TOLERANCE:.0e}. Samples",
        "are compared every 20 ms. The signal `attitude` is the direction cosine matrix, and the",
        "signal `p[i]` the direction of the pendulum of tank i in body axes. The five cases are:",
        "",
        *(f"* *{name}*: {case.text}." for name, case in CASES.items()),
        "",
        *cases,
        "",
        "## Cost at equal error",
        "",
        "The table is for the case *thrown*. Differences are from Basilisk's RKF78 at 1 ms. The",
        "CPU time is for the whole run with its set-up and with Python's part every 20 ms, in",
        "multiples of the time of Spacecraft.fmu at a tolerance of 1e-8. It shows an order of",
        "magnitude and is not a benchmark.",
        "",
        *cost,
        "",
    ])  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Compares Spacecraft.fmu with Basilisk.")
    parser.add_argument(
        "--fmu", type=Path, default=ROOT / "dist" / "Spacecraft.fmu", metavar="FILE"
    )
    parser.add_argument("--out", type=Path, default=PAGE, metavar="FILE", help="the page to write")
    args = parser.parse_args()
    lines = [
        f"| case | {' | '.join(f'`{name}`' for name in SIGNALS)} |",
        "| --- |" + " --- |" * len(SIGNALS),
    ]
    worst = 0.0
    try:
        for name, case in CASES.items():
            their = basilisk(case)
            if name == "thrown":
                exact = their
            found = differences(ours(args.fmu, case, their), their)
            worst = max(worst, *found)
            lines.append(f"| {name} | {' | '.join(f'{x:.1e}' for x in found)} |")
        cost = cost_table(args.fmu, exact)
    except FmuError as error:
        sys.exit(f"error: {error}")
    write(args.out, page(lines, cost, worst), worst)


if __name__ == "__main__":
    main()
