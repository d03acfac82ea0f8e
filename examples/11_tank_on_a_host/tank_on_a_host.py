"""Couples SloshTank.fmu with a rigid body: in Python, as SSP in libcosim, and in Basilisk.

python examples/11_tank_on_a_host/tank_on_a_host.py --ssp dist/TankOnHost.ssp
"""

import argparse
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pandas as pd

import hubslosh

STOP = 20.0  # s
STEPS = (0.04, 0.02, 0.01, 0.005)
"""Communication steps, s."""
RECORDED = [f"omega[{i}]" for i in (1, 2, 3)]
MASS, CENTRE = 300.0, np.array([0.02, -0.01, 0.1])
"""Mass (kg) and centre of mass from O (m) of the dry craft. The liquid, with 382 kg, is heavier."""
INERTIA = np.diag([210.0, 190.0, 150.0])
"""Inertia of the dry craft about its centre of mass, kg·m²."""
POSITION = np.array([0.3, 0.1, -0.2])
"""Position of the tank's origin from O, m."""
M_0, H_0, I_0 = 253.493, 0.0563967, 3.67522
"""Rigid liquid: mass (kg), height above the tank's origin (m), inertia across the axis (kg·m²)."""
BOB, LENGTH, HINGE = 128.211, 0.248039, 0.136534
"""Slosh mode: mass (kg), length (m) and height of the hinge (m)."""
STIFFNESS, ZETA = 40.0, 0.03
"""Centring stiffness by a diaphragm in weightlessness (N/m), and damping ratio."""
START = {"init.omega[1]": 0.15, "init.omega[2]": -0.1, "init.omega[3]": 0.25}
SIGNALS = {
    **{f"specific_force[{i}]": f"a[{i}]" for i in (1, 2, 3)},
    **{f"omega[{i}]": f"omega[{i}]" for i in (1, 2, 3)},
    **{f"omega_dot[{i}]": f"omega_dot[{i}]" for i in (1, 2, 3)},
}
"""Inputs of the tank's FMU, each with the output of the craft's FMU that is connected to it."""
LOADS = {f"bias[{i}]": f"{'force' if i < 4 else 'torque'}[{(i - 1) % 3 + 1}]" for i in range(1, 7)}
"""Inputs of the craft's FMU, each with the output of the tank's FMU that is connected to it."""

Values = dict[str, float | int]


def body(mass: float, centre: np.ndarray, inertia: np.ndarray) -> Values:
    """Return Spacecraft's parameters of a dry craft: mass (kg), centre (m) and inertia (kg·m²)."""
    values: Values = {"craft.mass": mass}
    values |= {f"craft.r[{i}]": float(x) for i, x in enumerate(centre, 1)}
    for i, a in enumerate("xyz"):
        for j, b in list(enumerate("xyz"))[i:]:
            values[f"craft.J{a}{b}"] = float(inertia[i, j])
    return values


def tank(name: str) -> Values:
    """Return the parameters of the tank: ``tank`` in SloshTank or ``tank[1]`` in Spacecraft."""
    values: Values = {f"{name}.position[{i}]": float(x) for i, x in enumerate(POSITION, 1)}
    values |= {
        f"{name}.m_0": M_0, f"{name}.H_0": H_0, f"{name}.I_0": I_0, f"{name}.mass[1]": BOB,
        f"{name}.length[1]": LENGTH, f"{name}.hinge[1]": HINGE, f"{name}.k[1]": STIFFNESS,
        f"{name}.zeta[1]": ZETA, f"{name}.g_ref": 1e-6, f"{name}.p_0[1,1]": 0.4,
        f"{name}.damping_law": "constant",
    }  # fmt: skip
    return values


def lumped() -> tuple[float, np.ndarray, np.ndarray]:
    """Return mass, centre of mass and inertia of craft and liquid as one rigid body.

    The liquid counts as the rigid liquid plus the slosh mass at its hinge, because the tank's
    parameter coupling = rigid_body requires this.
    """
    e = np.array([0.0, 0.0, 1.0])
    parts = [
        (MASS, CENTRE, INERTIA),
        (M_0, POSITION + H_0 * e, I_0 * np.diag([1.0, 1.0, 0.0])),
        (BOB, POSITION + HINGE * e, np.zeros((3, 3))),
    ]
    mass = sum(m for m, *_ in parts)
    centre = sum(m * s for m, s, _ in parts) / mass
    arms = [(m, s - centre, J) for m, s, J in parts]
    inertia = sum(J + m * (s @ s * np.eye(3) - np.outer(s, s)) for m, s, J in arms)
    return mass, centre, inertia


def simulate_whole(folder: Path | None) -> pd.DataFrame:
    """Return the reference: the motion of craft and tank, simulated by one Spacecraft.fmu."""
    settings = body(MASS, CENTRE, INERTIA) | tank("tank[1]") | {"tanks": 1} | START
    return hubslosh.simulate(
        fmu(folder, "Spacecraft"), settings, stop=STOP, step=STEPS[0], outputs=RECORDED,
        tolerance=1e-11,
    )  # fmt: skip


def fmu(folder: Path | None, name: str) -> str | Path:
    """Return the file of an FMU in a folder, or its name in the package."""
    return folder / f"{name}.fmu" if folder else name


def coupled(folder: Path | None, step: float, wrench: bool = False) -> pd.DataFrame:
    """Simulate the coupled FMUs; the craft's FMU steps first, and values are held over the step.

    If ``wrench`` is true, the craft's FMU receives the total force and torque of the tank; this
    coupling is simple, but diverges.
    """
    if wrench:
        host_settings, loads = body(MASS, CENTRE, INERTIA), {p: p for p in LOADS.values()}
    else:
        host_settings, loads = body(*lumped()), LOADS
    host_settings |= {"tanks": 0} | START
    tank_settings = tank("tank") | {"coupling_kind": 3}
    with (
        hubslosh.Plant(str(fmu(folder, "Spacecraft")), host_settings) as host,
        hubslosh.Plant(str(fmu(folder, "SloshTank")), tank_settings) as liquid,
    ):
        rows = [[0.0, *host.get(RECORDED)]]
        for n in range(1, round(STOP / step) + 1):
            if not np.isfinite(rows[-1]).all() or max(map(abs, rows[-1][1:])) > 1e3:
                break
            for name, value in zip(loads.values(), liquid.get(list(loads)), strict=True):
                host.set(name, value)
            host.step(n * step)
            for name, value in zip(SIGNALS.values(), host.get(list(SIGNALS)), strict=True):
                liquid.set(name, value)
            liquid.step(n * step)
            rows.append([n * step, *host.get(RECORDED)])
    return pd.DataFrame(rows, columns=["time", *RECORDED])


def pack_ssp(folder: Path | None, archive: Path, step: float) -> None:
    """Write the system with both FMUs as SSP 1.0."""

    def component(name: str, source: str, ins: Mapping[str, str], outs: list[str],
                  settings: Values) -> str:  # fmt: skip
        connectors = [(name, "input") for name in ins] + [(name, "output") for name in outs]
        lines = [
            f'<ssd:Connector name={quoteattr(name)} kind="{kind}"><ssc:Real/></ssd:Connector>'
            for name, kind in connectors
        ]
        values = [
            f"<ssv:Parameter name={quoteattr(name)}><ssv:"
            f'{"Integer" if isinstance(value, int) else "Real"} value="{value!r}"/></ssv:Parameter>'
            for name, value in settings.items()
        ]
        return f"""<ssd:Component name="{name}" source="resources/{source}.fmu"
    type="application/x-fmu-sharedlibrary" implementation="CoSimulation">
<ssd:Connectors>{"".join(lines)}</ssd:Connectors>
<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>
<ssv:ParameterSet name="{name}" version="1.0"><ssv:Parameters>{"".join(values)}
</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>
</ssd:Component>
"""

    wires = [("host", a, "liquid", b) for a, b in SIGNALS.items()]
    wires += [("liquid", a, "host", b) for a, b in LOADS.items()]
    connections = "".join(
        f'<ssd:Connection startElement="{a}" startConnector="{b}" endElement="{c}" '
        f'endConnector="{d}"/>\n'
        for a, b, c, d in wires
    )
    host = component("host", "Spacecraft", {b: b for b in LOADS.values()}, list(SIGNALS),
                     body(*lumped()) | {"tanks": 0} | START)  # fmt: skip
    liquid = component("liquid", "SloshTank", {b: b for b in SIGNALS.values()}, list(LOADS),
                       tank("tank") | {"coupling_kind": 3})  # fmt: skip
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription name="TankOnHost" version="1.0"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
<ssd:System name="system">
<ssd:Elements>
{host}{liquid}</ssd:Elements>
<ssd:Connections>
{connections}</ssd:Connections>
<ssd:Annotations><ssc:Annotation type="org.openmodelica">
<oms:Annotations xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd">
<oms:SimulationInformation><oms:FixedStepMaster description="oms-ma" stepSize="{step}"
absoluteTolerance="1e-8" relativeTolerance="1e-8"/></oms:SimulationInformation>
</oms:Annotations></ssc:Annotation></ssd:Annotations>
</ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="{STOP}"/>
</ssd:SystemStructureDescription>
"""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as out:
        out.writestr("SystemStructure.ssd", text)
        for name in ("Spacecraft", "SloshTank"):
            out.write(hubslosh.fmu_path(fmu(folder, name)), f"resources/{name}.fmu")


def in_libcosim(folder: Path | None, step: float) -> pd.DataFrame:
    """Simulate the SSP in libcosim, which exchanges values after both FMUs step (Jacobi)."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    with tempfile.TemporaryDirectory() as name:
        archive = Path(name) / "TankOnHost.ssp"
        pack_ssp(folder, archive, step)
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(Path(name) / "system")
        run = CosimExecution.from_ssp_file(str(Path(name) / "system"), step_size=round(step * 1e9))
        host = run.slave_index_from_instance_name("host")
        reference = {v.name.decode(): v.reference for v in run.slave_variables(host)}
        observer = CosimObserver.create_last_value()
        run.add_observer(observer)
        rows = []
        for n in range(1, round(STOP / step) + 1):
            if not run.step():
                sys.exit("error: libcosim could not continue the simulation")
            found = observer.last_real_values(host, [reference[name] for name in RECORDED])
            rows.append([n * step, *found])
    return pd.DataFrame(rows, columns=["time", *RECORDED])


def on_basilisk(folder: Path | None, step: float) -> pd.DataFrame:
    """Simulate the tank on Basilisk's spacecraft (PyPI: bsk), whose hub is the body of `lumped`."""
    from Basilisk.simulation import extForceTorque, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros

    def column(vector: np.ndarray) -> list[list[float]]:
        return [[float(x)] for x in vector]

    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    mass, centre, inertia = lumped()
    craft.hub.mHub, craft.hub.r_BcB_B = mass, column(centre)
    craft.hub.IHubPntBc_B = inertia.tolist()
    craft.hub.omega_BN_BInit = column(np.array(list(START.values())))
    loads = extForceTorque.ExtForceTorque()
    craft.addDynamicEffector(loads)
    for model in (craft, loads):
        simulation.AddModelToTask("task", model)
    simulation.InitializeSimulation()
    settings = tank("tank") | {"coupling_kind": 3}
    with hubslosh.Plant(str(fmu(folder, "SloshTank")), settings) as liquid:
        rows = [[0.0, *START.values()]]
        for n in range(1, round(STOP / step) + 1):
            bias = liquid.get(list(LOADS))
            loads.extForce_B, loads.extTorquePntB_B = column(bias[:3]), column(bias[3:])
            simulation.ConfigureStopTime(macros.sec2nano(n * step))
            simulation.ExecuteSimulation()
            state = craft.scStateOutMsg.read()
            omega, omega_dot = np.array(state.omega_BN_B), np.array(state.omegaDot_BN_B)
            # in free flight the specific force at B follows from force and motion of the body
            at_centre = np.array(bias[:3]) / mass
            a = at_centre - np.cross(omega_dot, centre) - np.cross(omega, np.cross(omega, centre))
            for name, value in zip(SIGNALS.values(), [*a, *omega, *omega_dot], strict=True):
                liquid.set(name, float(value))
            liquid.step(n * step)
            rows.append([n * step, *omega])
    return pd.DataFrame(rows, columns=["time", *RECORDED])


def error(found: pd.DataFrame, reference: pd.DataFrame) -> float:
    """Return the largest difference of the angular rate, relative to its largest value."""
    at = np.interp(reference["time"], found["time"], np.arange(len(found)))
    rows = np.rint(at).astype(int)
    aligned = np.abs(found["time"].to_numpy()[rows] - reference["time"].to_numpy()) < 1e-9
    apart = np.abs(found[RECORDED].to_numpy()[rows] - reference[RECORDED].to_numpy())[aligned]
    return float(apart.max() / np.abs(reference[RECORDED].to_numpy()).max())


def table(folder: Path | None) -> dict[str, dict[float, float]]:
    """Return the errors by simulator and step, for all simulators that are installed."""
    reference = simulate_whole(folder)
    hosts = {"fmpy, host first": coupled, "libcosim (SSP)": in_libcosim, "Basilisk": on_basilisk}
    found: dict[str, dict[float, float]] = {}
    for name, run in hosts.items():
        try:
            found[name] = {step: error(run(folder, step), reference) for step in STEPS}
        except ModuleNotFoundError as missing:
            print(f"{name}: not installed ({missing})")
    return found


def main() -> None:
    import matplotlib.pyplot as plt

    from hubslosh.plot import COLORS, save

    parser = argparse.ArgumentParser(description="SloshTank.fmu on a rigid body in several hosts.")
    parser.add_argument("--folder", type=Path, help="folder with FMUs to use instead")
    parser.add_argument("--ssp", type=Path, help="write the system as SSP, too")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    if args.ssp:
        pack_ssp(args.folder, args.ssp, STEPS[1])
    for name, errors in table(args.folder).items():
        print(f"| {name} | " + " | ".join(f"{errors[step]:.1e}" for step in STEPS) + " |")
    reference = simulate_whole(args.folder)
    drawing, axes = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained")
    runs = {
        "bias on the lumped body": coupled(args.folder, STEPS[1]),
        "force and torque as they are": coupled(args.folder, STEPS[1], wrench=True),
    }
    print("the naive way ends at", runs["force and torque as they are"]["time"].iloc[-1], "s")
    lessons = (
        "With the bias the coupling is stable at any mass ratio",
        "With the wrench it diverges within a second",
    )
    for ax, (text, run), color, lesson in zip(axes, runs.items(), COLORS, lessons, strict=False):
        ax.set_title(lesson)
        ax.plot(run["time"], run["omega[1]"], color=color, label=text)
        ax.plot(reference["time"], reference["omega[1]"], "--", color="0.3", linewidth=1,
                label="Spacecraft.fmu, all in one")  # fmt: skip
        ax.set(xlabel="time (s)", ylabel="rate about x (rad/s)", ylim=(-0.4, 0.6), xlim=(0, STOP))
        ax.legend(fontsize=8)
    save(drawing, args.out)


if __name__ == "__main__":
    main()
