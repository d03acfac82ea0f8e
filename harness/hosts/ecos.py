"""HubSlosh in ecos (PyPI: ecospy 0.7), a co-simulation master of its own; tried on Linux.

    pip install ecospy==0.7.2 fmpy==0.3.32 numpy     # and Debian's libtbb12 for ecospy
    python harness/hosts/ecos.py dist/HubSlosh.fmu

Drives the FMU with a sine for a minute and prints by how much the motion differs from what fmpy
gets for the same steps. Limitations: ecos can't set enumerations (`slosh.model`, `friction.model`),
so the model is linear. It does not report an FMU's errors: check the values, as here.
"""

import sys
from pathlib import Path

import numpy as np
from ecospy import EcosSimulation, EcosSimulationStructure

from compare import STEP, compare, drive, sine

PARAMETERS = {"tank.h": 0.05, "init.slosh_angle": 0.1, "init.omega": 0.02, "slosh.modes": 2}
SIGNALS = ["theta", "omega", "slosh_angle"]

if len(sys.argv) != 2:
    sys.exit("usage: python ecos.py FMU")
fmu = Path(sys.argv[1]).resolve()
time, torque = sine(60)

with EcosSimulationStructure() as structure:
    structure.add_model("plant", str(fmu))
    structure.add_parameter_set(
        "start", {f"plant::{name}": value for name, value in PARAMETERS.items()}
    )
    with EcosSimulation(structure=structure, step_size=STEP) as simulation:
        if not simulation.init(parameter_set="start"):
            sys.exit("error: ecos could not initialise the FMU")
        rows = [[simulation.get_real(f"plant::{name}") for name in SIGNALS]]
        for value in torque[:-1]:
            simulation.set_real("plant::tau_cmd", value)
            simulation.step()
            rows.append([simulation.get_real(f"plant::{name}") for name in SIGNALS])
        if abs(simulation.get_time() - time[-1]) > 1e-9:
            sys.exit(f"error: ecos ended at {simulation.get_time()} s, not at {time[-1]} s")
        simulation.terminate()

here = dict(zip(SIGNALS, np.array(rows).T, strict=True))
there = drive(fmu, time, torque, PARAMETERS, SIGNALS)
compare(here, there, allowed=1e-9)
