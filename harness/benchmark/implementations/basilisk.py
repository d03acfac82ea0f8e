"""Computes the cases that Basilisk can simulate: no friction, no centring stiffness, no draining.

    python3 basilisk.py RESULTS_FOLDER [CASE ...]

It uses Basilisk's `sphericalPendulum` and the integrator RKF78 with steps of 1 ms, or 5 ms in the
long spin-up.
"""

import numpy as np
from Basilisk.simulation import extForceTorque, spacecraft, sphericalPendulum, svIntegrators
from Basilisk.utilities import SimulationBaseClass, macros

import cases

STEP = {"thrust": 1e-3, "spinner": 5e-3}


def column(values) -> list[list[float]]:
    """Return a vector in the form that Basilisk expects, a column matrix."""
    return [[float(x)] for x in values]


def pendulum_of(tank: dict) -> sphericalPendulum.SphericalPendulum:
    """Return Basilisk's pendulum for a tank; its angles are 0 at the start.

    The first axis of its frame points to the slosh mass at the start.
    """
    first = tank["p_0"] / np.linalg.norm(tank["p_0"])
    third = np.cross(first, [0.6, 0.48, 0.64])
    third /= np.linalg.norm(third)
    second = np.cross(third, first)
    pendulum = sphericalPendulum.SphericalPendulum()
    pendulum.massInit = tank["m"]
    pendulum.pendulumRadius = tank["l"]
    pendulum.d = column(tank["hinge"])
    pendulum.D = (tank["c"] * np.eye(3)).tolist()
    pendulum.pHat_01, pendulum.pHat_02, pendulum.pHat_03 = map(column, (first, second, third))
    pendulum.phiDotInit = float(tank["p_dot_0"] @ second)
    pendulum.thetaDotInit = float(-tank["p_dot_0"] @ third)
    return pendulum


def bob(craft, pendulum) -> np.ndarray:
    """Return the present direction from the hinge to the slosh mass of ``pendulum``.

    Basilisk rotates the pendulum's frame during a run.
    """
    state = craft.dynManager.getStateObject
    phi = state(pendulum.nameOfPhiState).getState()[0][0]
    theta = state(pendulum.nameOfThetaState).getState()[0][0]
    frame = np.hstack([pendulum.pHat_01, pendulum.pHat_02, pendulum.pHat_03])
    c = np.cos(theta)
    return frame @ [np.cos(phi) * c, np.sin(phi) * c, -np.sin(theta)]


def run(case: str, integrator: str = "RKF78", step: float | None = None) -> np.ndarray:
    """Simulate a case by Basilisk, and return the rows of its results.csv.

    ``integrator`` is the name of the integrator in Basilisk, and ``step`` its step, s.
    """
    p = cases.parameters(case)
    step = step or STEP[case]
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub = p["mass"]
    craft.hub.r_BcB_B = column(p["center"])
    craft.hub.IHubPntBc_B = cases.inertia(p).tolist()
    craft.hub.omega_BN_BInit = column(p["omega_0"])
    # O is at rest at the start; Basilisk needs the velocity of the common centre of mass
    total = p["mass"] + sum(tank["m"] for tank in p["tank"])
    first = p["mass"] * p["center"] + sum(
        tank["m"] * (tank["hinge"] + tank["l"] * tank["p_0"]) for tank in p["tank"]
    )
    swing = sum(tank["m"] * tank["l"] * tank["p_dot_0"] for tank in p["tank"])
    craft.hub.v_CN_NInit = column((np.cross(p["omega_0"], first) + swing) / total)
    craft.setIntegrator(getattr(svIntegrators, f"svIntegrator{integrator}")(craft))
    pendulums = [pendulum_of(tank) for tank in p["tank"]]
    for pendulum in pendulums:
        craft.addStateEffector(pendulum)
    forces = extForceTorque.ExtForceTorque()
    craft.addDynamicEffector(forces)
    simulation.AddModelToTask("task", craft)
    simulation.AddModelToTask("task", forces)
    times, rows = cases.row_times(case), []

    def state():
        return craft.scStateOutMsg.read()

    def row(t):
        now = state()
        bobs = [bob(craft, pendulum) for pendulum in pendulums]
        rows.append(np.hstack([t, now.omega_BN_B, now.v_BN_N, *bobs]))

    def pieces():
        if case != "spinner":
            yield from cases.segments(case)
            return
        for k in range(round(p["end"] / p["every"])):
            omega = np.array(state().omega_BN_B) if k else p["omega_0"]
            torque = p["K"] * (np.array([0, 0, p["spin"]]) - omega)
            torque = np.clip(torque, -p["most"], p["most"])
            yield k * p["every"], (k + 1) * p["every"], np.hstack([np.zeros(3), torque])

    for begin, end, wrench in pieces():
        forces.extForce_B = column(wrench[:3])
        forces.extTorquePntB_B = column(wrench[3:])
        if begin == 0.0:
            simulation.InitializeSimulation()
            simulation.ConfigureStopTime(0)
            simulation.ExecuteSimulation()
            row(0.0)
        inside = times[(times > begin + 1e-9) & (times < end - 1e-9)]
        for t in [*inside, end]:
            simulation.ConfigureStopTime(macros.sec2nano(round(float(t), 9)))
            simulation.ExecuteSimulation()
            if np.any(np.abs(times - t) < 1e-9):
                row(t)
    return np.array(rows)


CASES = {name: lambda name=name: run(name) for name in STEP}


if __name__ == "__main__":
    cases.run(CASES)
