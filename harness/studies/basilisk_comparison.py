"""Compares the spherical slosh model with Basilisk's ``sphericalPendulum``; writes a page.

    PYTHONPATH=harness/python python3 harness/studies/basilisk_comparison.py

It needs dist/HubSlosh.fmu (``cargo run --release -- pack``) and Python 3.11 or newer. The first run
creates a virtual environment in the target directory and needs the network. It takes minutes.

Basilisk's spacecraft has six degrees of freedom, while HubSlosh turns only about z. Therefore
Basilisk's hub gets a very large mass M, and moments of inertia of M · 1 m² about x and y. Its
inertia about z is that of HubSlosh with the rigid liquid, ``hub.I`` + m0 r². A thrust (M + m) g
along the body's z axis replaces gravity along the tank's axis. The motion in the other five degrees
of freedom tends to zero as 1/M, which the page shows.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import environment

try:
    import numpy as np
    from Basilisk.simulation import extForceTorque, spacecraft, sphericalPendulum, svIntegrators
    from Basilisk.utilities import SimulationBaseClass, macros, pythonVariableLogger

    from hubslosh import FmuError, Plant
except ModuleNotFoundError as missing:
    environment.run_again_in("basilisk", missing)

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "book" / "basilisk.md"

DURATION = 20.0  # s
EVERY = 0.02  # time between samples, s
TOLERANCE = 1e-14  # tolerance of the FMU's solver
MASS = 1e14  # mass of Basilisk's hub in the comparison, kg
ALLOWED = 1e-9  # largest difference, relative to the maximum of the signal
GRAVITY = 9.81  # m/s², the default of g_axial
LEVER = 0.225  # m, the default of tank.r
DAMPING = (0.0, 0.003, 0.05)
FILLS = (0.10, 0.05)  # m
SIGNALS = ("theta", "omega", "slosh_angle", "slosh_angle_radial")

Signals = dict[str, np.ndarray]
Vector = Sequence[float] | np.ndarray


@dataclass(frozen=True)
class Start:
    """Initial state and torque of a run; sin(angle) = displacement/length along x and y."""

    text: str
    angle_x: float = 0.0  # rad
    angle_y: float = 0.0  # rad
    rate_x: float = 0.0  # rad/s
    rate_y: float = 0.0  # rad/s
    omega: float = 0.0  # rad/s
    pulse: float = 0.0  # N·m, during the first second


@dataclass(frozen=True)
class Case:
    """Inputs of one comparison, for our FMU and for Basilisk."""

    start: Start
    h: float  # m, fill
    zeta: float  # damping ratio
    m: float  # kg, pendulum
    length: float  # m, pendulum
    inertia: float  # kg·m², hub and rigid liquid about z

    @property
    def omega_1(self) -> float:
        """Natural frequency, rad/s."""
        return (GRAVITY / self.length) ** 0.5

    @property
    def damping(self) -> float:
        """Viscous damping coefficient of the slosh mass, N·s/m."""
        return 2 * self.zeta * self.omega_1 * self.m


def starts(length: float) -> dict[str, Start]:
    """Return the initial states of all compared motions, for a pendulum of ``length`` (m)."""
    cone = np.arcsin(0.3)
    conical = (GRAVITY / (length * np.cos(cone))) ** 0.5  # rate of a conical pendulum, rad/s
    return {
        "pulse": Start("hub and liquid at rest; a torque of 0.05 N·m acts for 1 s", pulse=0.05),
        "release": Start("liquid released at a tangential slosh angle of 0.1 rad", angle_y=0.1),
        "release far": Start("liquid released at a tangential slosh angle of 0.5 rad", angle_y=0.5),
        "conical": Start(
            "hub at rest, pendulum on a circle with a radius of 0.3 of its length",
            angle_x=float(cone),
            rate_y=float(conical * 0.3),
        ),
        "spinning": Start(
            "hub at −3 rad/s; radial and tangential slosh angles of 0.2 and 0.3 rad "
            "with rates of 1 and −5 rad/s; a torque of 0.05 N·m acts for 1 s",
            angle_x=0.2, angle_y=0.3, rate_x=1.0, rate_y=-5.0, omega=-3.0, pulse=0.05,
        ),
        "very far": Start("liquid released at a tangential slosh angle of 1.2 rad", angle_y=1.2),
    }  # fmt: skip


def case(fmu: Path, start: str, h: float, zeta: float) -> Case:
    """Return a case with the mass and length that the FMU computes for the fill ``h`` (m).

    ``start`` is the name of an initial state, and ``zeta`` the damping ratio.
    """
    with Plant(fmu, {"tank.h": h}) as plant:
        m_0, m, length, hub = plant.get(["tank.m_0", "slosh.mass[1]", "slosh.length[1]", "hub.I"])
    return Case(starts(length)[start], h, zeta, m, length, hub + m_0 * LEVER**2)


def ours(fmu: Path, given: Case, tolerance: float = TOLERANCE) -> Signals:
    """Return the signals of our FMU every 20 ms, simulated in steps of 20 ms."""
    start = given.start
    settings = {
        "slosh.model": "spherical",
        "friction.model": "none",
        "tank.h": given.h,
        "tank.r": LEVER,
        "g_axial": GRAVITY,
        "slosh.zeta_from_correlation": False,
        "slosh.zeta": given.zeta,
        "init.slosh_angle_radial": start.angle_x,
        "init.slosh_angle": start.angle_y,
        "init.slosh_rate_radial": start.rate_x,
        "init.slosh_rate": start.rate_y,
        "init.omega": start.omega,
    }
    with Plant(fmu, settings, tolerance=tolerance, torque=start.pulse) as plant:
        rows = [plant.get(SIGNALS)]
        for k in range(1, round(DURATION / EVERY) + 1):
            plant.step(k * EVERY, start.pulse if k * EVERY <= 1.0 else 0.0)
            rows.append(plant.get(SIGNALS))
    return dict(zip(SIGNALS, np.array(rows).T, strict=True))


def bob(craft: spacecraft.Spacecraft, pendulum: sphericalPendulum.SphericalPendulum) -> np.ndarray:
    """Return the direction from the hinge of Basilisk's pendulum to its slosh mass, body axes.

    Basilisk rotates the frame of the pendulum during a run, to avoid the singularity of its angles.
    """
    state = craft.dynManager.getStateObject
    phi = state(pendulum.nameOfPhiState).getState()[0][0]
    theta = state(pendulum.nameOfThetaState).getState()[0][0]
    frame = np.hstack([pendulum.pHat_01, pendulum.pHat_02, pendulum.pHat_03])
    c = np.cos(theta)
    return frame @ [np.cos(phi) * c, np.sin(phi) * c, -np.sin(theta)]


def basilisk(given: Case, mass: float, integrator: str = "RKF78", step: float = 1e-3) -> Signals:
    """Return Basilisk's signals every 20 ms.

    ``mass`` is the mass of the hub, kg; ``integrator`` is the name of the integrator in Basilisk,
    and ``step`` its step, s.
    """
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))

    craft = spacecraft.Spacecraft()
    craft.hub.mHub = mass
    craft.hub.r_BcB_B = column(0, 0, 0)
    craft.hub.IHubPntBc_B = [[mass, 0, 0], [0, mass, 0], [0, 0, given.inertia]]
    craft.hub.omega_BN_BInit = column(0, 0, given.start.omega)
    craft.setIntegrator(getattr(svIntegrators, f"svIntegrator{integrator}")(craft))

    pendulum = pendulum_of(given)
    craft.addStateEffector(pendulum)

    thrust = extForceTorque.ExtForceTorque()
    thrust.extForce_B = column(0, 0, (mass + given.m) * GRAVITY)
    thrust.extTorquePntB_B = column(0, 0, given.start.pulse)
    craft.addDynamicEffector(thrust)

    every = macros.sec2nano(EVERY)
    hub = craft.scStateOutMsg.recorder(every)

    liquid = pythonVariableLogger.PythonVariableLogger(
        {"bob": lambda _: bob(craft, pendulum)}, every
    )
    for model in (craft, thrust, hub, liquid):
        simulation.AddModelToTask("task", model)

    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(1.0))
    simulation.ExecuteSimulation()
    thrust.extTorquePntB_B = column(0, 0, 0)
    simulation.ConfigureStopTime(macros.sec2nano(DURATION))
    simulation.ExecuteSimulation()

    directions = np.array(liquid.bob)
    # modified Rodrigues parameters: tan(theta/4) along z, known up to whole turns
    angle = np.unwrap(4 * np.arctan(hub.sigma_BN[:, 2]))
    return {
        "theta": angle - angle[0],
        "omega": hub.omega_BN_B[:, 2],
        "slosh_angle": np.arcsin(directions[:, 1]),
        "slosh_angle_radial": np.arcsin(directions[:, 0]),
    }


def pendulum_of(given: Case) -> sphericalPendulum.SphericalPendulum:
    """Return Basilisk's pendulum, hinged at the position of the tank.

    Its angles are zero at the start, so that the first axis of its frame points to the initial
    position of the bob. The third axis is as near to radial as possible, so that tangential motion
    changes the angle phi, which has no singularity. The damping is the same in all directions.
    """
    start = given.start
    sines = np.sin([start.angle_x, start.angle_y])
    rates = np.cos([start.angle_x, start.angle_y]) * [start.rate_x, start.rate_y]
    down = np.sqrt(1 - sines @ sines)
    bob = np.array([*sines, -down])
    velocity = np.array([*rates, sines @ rates / down])  # derivative of the direction, 1/s
    third = np.array([1.0, 0.0, 0.0]) - bob[0] * bob
    third /= np.linalg.norm(third)
    second = np.cross(third, bob)
    place, drag = (LEVER, 0, 0), given.damping
    return pendulum_at(given.m, given.length, place, drag, (bob, second, third), velocity)


def pendulum_at(
    mass: float, length: float, place: Vector, drag: float, axes: Sequence[Vector], rate: Vector
) -> sphericalPendulum.SphericalPendulum:
    """Return Basilisk's pendulum with its hinge at ``place``, m, body axes.

    The first of ``axes`` points to the slosh mass at the start; ``rate`` has the rates of the
    angles, and ``drag`` is the damping coefficient, N·s/m.
    """
    _, second, third = axes
    pendulum = sphericalPendulum.SphericalPendulum()
    pendulum.massInit = mass
    pendulum.pendulumRadius = length
    pendulum.d = column(*place)
    pendulum.D = (drag * np.eye(3)).tolist()
    pendulum.pHat_01, pendulum.pHat_02, pendulum.pHat_03 = (column(*axis) for axis in axes)
    pendulum.phiDotInit = float(rate @ second)
    pendulum.thetaDotInit = float(-rate @ third)
    return pendulum


def column(x: float, y: float, z: float) -> list[list[float]]:
    """Return a vector in the form that Basilisk expects, a column matrix."""
    return [[float(x)], [float(y)], [float(z)]]


def differences(a: Signals, b: Signals) -> list[float]:
    """Return the largest difference of each signal in ``a``, relative to its maximum in ``b``."""
    return [np.abs(a[name] - b[name]).max() / np.abs(b[name]).max() for name in b]


def timed(signals: Callable[[], Signals]) -> tuple[Signals, float]:
    """Call a function without arguments; return its result and the CPU time, s."""
    begin = time.process_time()
    return signals(), time.process_time() - begin


def cases_table(fmu: Path, pool: ProcessPoolExecutor) -> tuple[list[str], float]:
    """Compare all cases at one mass of the hub.

    Return the lines of a table, and the largest difference in this table. The table has a row for
    each initial state, with the largest differences over both fills and all damping ratios.
    """
    names = list(starts(1.0))
    cases = [(name, case(fmu, name, h, zeta)) for h in FILLS for name in names for zeta in DAMPING]
    theirs = pool.map(partial(basilisk, mass=MASS), [given for *_, given in cases])
    largest = {name: [0.0] * len(SIGNALS) for name in names}
    for (name, given), their in zip(cases, theirs, strict=True):
        found = differences(their, ours(fmu, given))
        largest[name] = [max(pair) for pair in zip(largest[name], found, strict=True)]
    heads = [f"largest relative difference of `{name}`" for name in SIGNALS]
    lines = [
        f"| way to start | {' | '.join(heads)} |",
        "| --- |" + " --- |" * len(SIGNALS),
    ]
    for name, found in largest.items():
        lines.append(f"| {name} | {' | '.join(f'{x:.1e}' for x in found)} |")
    return lines, max(max(found) for found in largest.values())


def integrators_table(fmu: Path) -> list[str]:
    """Return a table with error and CPU time, relative to the FMU, of Basilisk's integrators."""
    given = case(fmu, "release far", 0.10, 0.003)
    own = ours(fmu, given)
    rows = []
    for tolerance in (1e-6, 1e-8, 1e-10, 1e-12):
        got, seconds = timed(partial(ours, fmu, given, tolerance))
        rows.append((f"HubSlosh, tolerance {tolerance:.0e}", "20", differences(got, own), seconds))
    for integrator, steps in (("RKF78", (1, 2, 5, 10, 20)), ("RK4", (1, 2, 5, 10, 20))):
        for step in steps:
            run = partial(basilisk, given, MASS, integrator, step * 1e-3)
            got, seconds = timed(run)
            rows.append((f"Basilisk's {integrator}", str(step), differences(got, own), seconds))
    unit = rows[1][-1]
    lines = [
        "| integrator | step, ms | largest difference "
        "| CPU time, in multiples of HubSlosh at tolerance 1e-8 |",
        "| --- | --- | --- | --- |",
    ]
    for name, step, found, seconds in rows:
        lines.append(f"| {name} | {step} | {max(found):.1e} | {seconds / unit:.1f} |")
    return lines


def rounding(fmu: Path) -> tuple[dict[str, float], float]:
    """Measure how undamped motion magnifies small differences.

    Return the change of the FMU's motion for two initial states, by name, if the initial angle is
    replaced by the next larger floating-point number. Also return the change of the motion *very
    far* with a solver tolerance of 1e-12 instead of `TOLERANCE`.
    """
    moved = {}
    for name in ("release far", "very far"):
        given = case(fmu, name, 0.10, 0.0)
        beside = replace(given.start, angle_y=float(np.nextafter(given.start.angle_y, np.inf)))
        own = ours(fmu, given)
        moved[name] = max(differences(ours(fmu, replace(given, start=beside)), own))
    return moved, max(differences(ours(fmu, given, 1e-12), own))


def page(
    cases: list[str],
    integrators: list[str],
    worst: float,
    ulp: dict[str, float],
    looser: float,
) -> str:
    """Return the page with two tables, the largest difference, and the results of `rounding`."""
    far, very = ulp["release far"], ulp["very far"]
    described = "\n".join(f"* *{name}*: {start.text}." for name, start in starts(1.0).items())
    return "\n".join([
        "<!-- Written by harness/studies/basilisk_comparison.py; do not edit. -->",
        "# Comparison with Basilisk: the spherical model",
        "",
        "Does the spherical model agree with an independent implementation?",
        "",
        f"**Yes, to {worst:.0e} of each signal's maximum over 20 s, for damped and undamped",
        f"motion, near rest and far from rest.** Basilisk {version('bsk')} (AVS Lab, University of",
        "Colorado) has a spherical pendulum for slosh, `sphericalPendulum`. It was written",
        "independently of HubSlosh: the pendulum's coordinates are angles (in HubSlosh a",
        "unit vector), and the hub's acceleration is found by back-substitution (in",
        "HubSlosh from one linear equation). The runs have no friction, because Basilisk",
        "has none. These commands make the comparison and write this page:",
        "",
        "    cargo run --release -- pack",
        "    PYTHONPATH=harness/python python3 harness/studies/basilisk_comparison.py",
        "",
        "The second command fails, and does not change this page, if a difference is",
        f"larger than {ALLOWED:.0e}.",
        "",
        "Damped runs agree with Basilisk from version 2.11.1 on. In earlier versions",
        "`sphericalPendulum` added the damping force to the torques without its lever arm",
        "(issue 1484 of AVSLab's repository), so that only undamped runs agree.",
        "",
        "## What is compared",
        "",
        "HubSlosh has `slosh.model` = spherical with one mode, `friction.model` = none, and",
        "the bench's tank at two fills. The runs start in six ways:",
        "",
        described,
        "",
        "Basilisk's spacecraft moves freely in six degrees of freedom, whereas HubSlosh",
        "turns about a fixed axis. Therefore the spacecraft has a very large mass M, and",
        "moments of inertia of M · 1 m² about x and y. About z it has the inertia of the",
        "bench, `hub.I` + m_0 r² (m_0 is the rigid liquid, r its distance `tank.r`). A",
        "thrust (M + m) g along the body's z axis takes the place of gravity, where m is",
        "the pendulum's mass. The pendulum's hinge is at (`tank.r`, 0, 0), and its damping",
        "matrix is c times the unit matrix with c = 2 zeta omega_1 m. Basilisk integrates",
        "with RKF78 in steps of 1 ms. HubSlosh runs from Python in steps of 20 ms with a",
        f"tolerance of {TOLERANCE:.0e}. The tables have the largest difference between samples",
        "20 ms apart, divided by the signal's maximum.",
        "",
        f"## Largest differences, M = {MASS:.0e} kg",
        "",
        "Each number is the largest over both fills and damping ratios of 0, 0.003 and",
        "0.05, as a share of the signal's maximum:",
        "",
        *cases,
        "",
        "Runs that start *very far* from rest pass 45°, where Basilisk changes the frame of",
        "its pendulum's angles. Undamped motion far from rest magnifies rounding errors. For",
        "example, if the start angle is replaced by the next larger floating-point number",
        f"(10 cm, zeta 0), results of HubSlosh change by {far:.0e} in *release far* and by",
        f"{very:.0e} in *very far*. A tolerance of 1e-12 in place of {TOLERANCE:.0e} changes",
        f"*very far* by {looser:.0e}.",
        "",
        "Basilisk's free hub recoils from the pendulum, which raises the pendulum's frequency",
        "by the share m/(2M). The difference is proportional to 1/M from 1e6 kg on, until only",
        "rounding is left.",
        "",
        "## Error and cost of each integrator",
        "",
        "The table is for the start *release far* at 10 cm with a damping ratio of 0.003 and",
        f"M = {MASS:.0e} kg. Differences are from HubSlosh at a tolerance of {TOLERANCE:.0e}.",
        "The CPU time is for the whole run, with Python's part every 20 ms in both programs.",
        "It shows an order of magnitude and is not a benchmark, because Basilisk's hub has",
        "five degrees of freedom more.",
        "",
        *integrators,
        "",
    ])  # fmt: skip


def write(out: Path, text: str, worst: float) -> None:
    """Write the page, or exit with an error if the largest difference exceeds `ALLOWED`."""
    if worst > ALLOWED:
        sys.exit(
            f"{text}\nerror: the largest difference is {worst:.1e} (allowed: up to {ALLOWED:.0e}); "
            "the page is not written"
        )
    half_written = out.with_suffix(".tmp")
    half_written.write_text(text, encoding="utf-8")
    half_written.replace(out)
    print(f"largest difference {worst:.1e}; wrote {out}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Compares the spherical model with Basilisk's.")
    parser.add_argument("--fmu", type=Path, default=ROOT / "dist" / "HubSlosh.fmu", metavar="FILE")
    parser.add_argument("--out", type=Path, default=PAGE, metavar="FILE", help="the page to write")
    args = parser.parse_args()
    try:
        with ProcessPoolExecutor() as pool:
            cases, worst = cases_table(args.fmu, pool)
        integrators = integrators_table(args.fmu)
        ulp, looser = rounding(args.fmu)
    except FmuError as error:
        sys.exit(f"error: {error}")
    write(args.out, page(cases, integrators, worst, ulp, looser), worst)


if __name__ == "__main__":
    main()
