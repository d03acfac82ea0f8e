"""Runs HubSlosh in the co-simulation master ecos (PyPI: ecospy 0.7); tried on Linux.

    pip install ecospy==0.7.2 fmpy==0.3.32 numpy     # and Debian's libtbb12 for ecospy
    python harness/hosts/ecos.py dist/HubSlosh.fmu

This program drives the FMU with a sine for a minute, and prints the largest difference from a
simulation by fmpy with the same steps. ecos has limitations: it cannot set enumerations
(`slosh.model`, `friction.model`), so that the slosh model is linear, and it does not report errors
of an FMU, so that the values must be checked, as here.
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
