"""Checks of a packed FMU by other tools.

The tools are FMI's XML schema, fmpy's validation, fmutool, FMI Library and CasADi. The command
``python importers.py dist/HubSlosh.fmu`` exits with 1 if a tool has a finding. FMI Library reads
FMI 2.0 here, CasADi checks FMUs of FMI 3.0; neither checks an FMU with arrays. ``.ci/importers``
creates the environment (requirements-importers.txt) and runs the command.
"""

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import casadi
import fmpy
import numpy as np
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from lxml import etree


def version_of(fmu: Path) -> int:
    """Return the FMI version of an FMU, 2 or 3."""
    return int(read_model_description(str(fmu), validate=False).fmiVersion[0])


def schema_findings(fmu: Path) -> list[str]:
    """Return the errors of modelDescription.xml against FMI's XML schema, which fmpy contains."""
    name = f"fmi{version_of(fmu)}"
    folder = Path(fmpy.__file__).parent / "schema" / name
    schema = etree.XMLSchema(etree.parse(str(folder / f"{name}ModelDescription.xsd")))
    with zipfile.ZipFile(fmu) as archive:
        document = etree.fromstring(archive.read("modelDescription.xml"))
    schema.validate(document)
    return [f"line {entry.line}: {entry.message}" for entry in schema.error_log]


def fmpy_findings(fmu: Path) -> list[str]:
    """Return the findings of fmpy's validation, and the error if its simulation fails."""
    findings = [str(problem) for problem in validate_fmu(str(fmu))]
    for interface in ("CoSimulation", "ModelExchange"):
        try:
            result = simulate_fmu(str(fmu), fmi_type=interface, stop_time=1.0, validate=True)
        except Exception as error:
            findings.append(f"{interface}: {error}")
        else:
            if abs(result["time"][-1] - 1.0) > 1e-9:
                findings.append(f"{interface} ends at {result['time'][-1]} s instead of 1 s")
    return findings


def fmutool_findings(fmu: Path, version: int) -> list[str]:
    """Return the findings of ``fmutool -check`` (PyPI's fmu-manipulation-toolbox)."""
    program = Path(sys.executable).with_name("fmutool")
    done = subprocess.run(
        [program, "-input", fmu, "-check"], capture_output=True, text=True, check=False
    )
    said = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    # Each of its checks without a finding prints one of these sentences.
    well = (
        f"seems to be compliant with FMI-{version}.0",
        f"No semantic error against the FMI-{version} standard",
    )
    findings = [line for line in said if not line.startswith("INFO")]
    findings += [f'the sentence "{words}" is missing' for words in well if words not in done.stdout]
    return findings if done.returncode == 0 else [*said, f"exit code {done.returncode}"]


def fmi_library_findings(fmu: Path) -> list[str]:
    """Return the messages of Modelon's FMI Library while libcosim loads and steps the FMU."""
    # Its messages go to the output of the process; therefore it runs in a separate process.
    program = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimSlave import CosimLocalSlave
log_output_level(CosimLogLevel.WARNING)
run = CosimExecution.from_step_size(step_size=20_000_000)
run.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="plant"))
sys.exit(not run.step(50))
"""
    done = subprocess.run(
        [sys.executable, "-c", program, fmu.resolve()], capture_output=True, text=True, check=False
    )
    # libcosim reports that it ignores enumerations, which is no finding.
    skipped = "FMI 2.0 Enumeration variable type not supported"
    lines = (done.stdout + done.stderr).splitlines()
    said = [line for line in lines if line.strip() and skipped not in line]
    return said if done.returncode == 0 else [*said, f"exit code {done.returncode}"]


def casadi_findings(fmu: Path) -> list[str]:
    """Return what fails in CasADi: Model Exchange, and Jacobians compared with differences."""
    name = read_model_description(str(fmu)).modelName
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder)
        try:
            dae = casadi.DaeBuilder(name, folder, {})
            function = dae.create("f", ["x", "u"], ["ode", "y"])
            jacobians = function.factory(
                "jacobians", ["x", "u"], ["jac:ode:x", "jac:ode:u", "jac:y:u"]
            )
        except RuntimeError as error:
            return [str(error)]
        # CasADi has no start values of states that follow from parameters, such as unit vectors.
        start = simulate_fmu(str(fmu), fmi_type="ModelExchange", stop_time=0.01, output=dae.x())
        x, u = (np.array(list(start[0])[1:]), np.array(dae.start(dae.u())).ravel())
        found = [np.array(part) for part in jacobians(x, u)]
        step = 1e-6

        def slopes(of: int, by: int) -> np.ndarray:
            columns = []
            for n in range(len((x, u)[by])):
                ends = []
                for side in (1, -1):
                    point = [x.copy(), u.copy()]
                    point[by][n] += side * step
                    ends.append(np.array(function(*point)[of]).ravel())
                columns.append((ends[0] - ends[1]) / (2 * step))
            return np.array(columns).T

        findings = []
        which = [("dx'/dx", 0, 0), ("dx'/du", 0, 1), ("dy/du", 1, 1)]
        for jacobian, (words, of, by) in zip(found, which, strict=True):
            expected = slopes(of, by)
            difference = np.abs(jacobian - expected).max() / max(1.0, np.abs(expected).max())
            if not difference < 1e-6:
                findings.append(f"{words} differs from central differences by {difference:.1e}")
        return findings


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit("usage: python importers.py FMU")
    fmu = Path(sys.argv[1])
    if not fmu.is_file():
        sys.exit(f"error: {fmu} does not exist; create it with: cargo run --release -- pack")
    version = version_of(fmu)
    asked = {
        f"XML schema of FMI {version}.0": schema_findings,
        f"fmpy {fmpy.__version__}": fmpy_findings,
        "fmutool": lambda fmu: fmutool_findings(fmu, version),
    }
    if version == 2:
        asked["FMI Library"] = fmi_library_findings
    elif not any(
        variable.dimensions
        for variable in read_model_description(str(fmu), validate=False).modelVariables
    ):
        asked[f"CasADi {casadi.__version__}"] = casadi_findings
    count = 0
    for who, findings_of in asked.items():
        findings = findings_of(fmu)
        count += len(findings)
        print(f"{who}: {len(findings)} findings")
        print("".join(f"  {finding}\n" for finding in findings), end="")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
