"""Runs HubSlosh as SSP in libcosim (PyPI: libcosimpy 0.0.6); tried on Linux.

libcosim is the co-simulation master of the Open Simulation Platform; it loads FMUs with Modelon's
FMI Library.

    pip install libcosimpy==0.0.6 fmpy==0.3.32 numpy
    python harness/hosts/cosim.py dist/HubSlosh.fmu

This program packs the system of ssp/, checks its XML against the schemas of SSP 1.0, and drives the
system with a sine for a minute. It prints the largest difference from a simulation of only the FMU
by fmpy. libcosim has limitations: it ignores enumerations (`slosh.model`, `friction.model`), so
that the slosh model is linear. If an FMU returns an error, libcosim prints the FMU's message and
ends the process.
"""

import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from fmpy.ssp.ssd import read_ssd, read_ssv
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver

from compare import STEP, compare, drive, sine
from ssp import pack

SIGNALS = ["theta", "omega", "slosh_angle", "omega_imu"]


def libcosim(folder: Path, time: np.ndarray, torque: np.ndarray) -> dict[str, np.ndarray]:
    """Simulate an unpacked SSP under a torque (N·m) that is held between the times (s)."""
    log_output_level(CosimLogLevel.ERROR)
    run = CosimExecution.from_ssp_file(str(folder), step_size=round(STEP * 1e9))
    plant = run.slave_index_from_instance_name("plant")
    reference = {v.name.decode(): v.reference for v in run.slave_variables(plant)}
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    run.add_observer(observer)
    run.add_manipulator(manipulator)
    wanted = [reference[name] for name in SIGNALS]
    rows = []
    for value in torque[:-1]:
        manipulator.slave_real_values(plant, [reference["tau_cmd"]], [value])
        if not run.step():
            sys.exit("error: libcosim could not continue the simulation")
        rows.append(observer.last_real_values(plant, wanted))
    end = run.status().current_time * 1e-9
    if abs(end - time[-1]) > 1e-9:
        sys.exit(f"error: libcosim ended at {end} s, not at {time[-1]} s")
    return dict(zip(SIGNALS, np.array(rows).T, strict=True))


def main() -> None:
    """Pack and check the SSP, simulate it, and compare the results."""
    if len(sys.argv) != 2:
        sys.exit("usage: python cosim.py FMU")
    fmu = Path(sys.argv[1]).resolve()
    time, torque = sine(60)
    with tempfile.TemporaryDirectory() as name:
        system, folder = Path(name) / "HubSlosh.ssp", Path(name) / "system"
        pack(fmu, system)
        read_ssd(str(system), validate=True)
        release = read_ssv(str(system), "resources/release.ssv", validate=True)
        # libcosim needs an unpacked archive.
        with zipfile.ZipFile(system) as archive:
            archive.extractall(folder)
        here = libcosim(folder, time, torque)
    settings = {parameter.name: parameter.value for parameter in release.parameters}
    there = drive(fmu, time, torque, settings, SIGNALS)
    # libcosim's observer records only the ends of steps, not the start.
    compare(here, {signal: values[1:] for signal, values in there.items()}, allowed=1e-9)


if __name__ == "__main__":
    main()
