"""What others say of the packed FMU: XML schema, fmpy's validation, fmutool, FMI Library.

As a program: ``python importers.py dist/HubSlosh.fmu``; leaves with 1 when anybody finds anything.
``.ci/importers`` makes the environment (requirements-importers.txt) and calls it.
"""

import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from lxml import etree


def schema_findings(fmu: Path) -> list[str]:
    """Return what the schema of FMI 2.0, as fmpy carries it, finds in modelDescription.xml."""
    folder = Path(fmpy.__file__).parent / "schema" / "fmi2"
    schema = etree.XMLSchema(etree.parse(str(folder / "fmi2ModelDescription.xsd")))
    with zipfile.ZipFile(fmu) as archive:
        document = etree.fromstring(archive.read("modelDescription.xml"))
    schema.validate(document)
    return [f"line {entry.line}: {entry.message}" for entry in schema.error_log]


def fmpy_findings(fmu: Path) -> list[str]:
    """Return what fmpy's validation finds, and what keeps it from simulating."""
    findings = [str(problem) for problem in validate_fmu(str(fmu))]
    for interface in ("CoSimulation", "ModelExchange"):
        try:
            result = simulate_fmu(str(fmu), fmi_type=interface, stop_time=1.0, validate=True)
        except Exception as error:
            findings.append(f"{interface}: {error}")
        else:
            if abs(result["time"][-1] - 1.0) > 1e-9:
                findings.append(f"{interface} ended at {result['time'][-1]} s, not at 1 s")
    return findings


def fmutool_findings(fmu: Path) -> list[str]:
    """Return what ``fmutool -check`` (PyPI's fmu-manipulation-toolbox) says but for "all well"."""
    program = Path(sys.executable).with_name("fmutool")
    done = subprocess.run(
        [program, "-input", fmu, "-check"], capture_output=True, text=True, check=False
    )
    said = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    # Each check ends with one sentence of its own when it has found nothing.
    well = ("seems to be compliant with FMI-2.0", "No semantic error against the FMI-2 standard")
    findings = [line for line in said if not line.startswith("INFO")]
    findings += [f'does not say "{words}"' for words in well if words not in done.stdout]
    return findings if done.returncode == 0 else [*said, f"ended with {done.returncode}"]


def fmi_library_findings(fmu: Path) -> list[str]:
    """Return what Modelon's FMI Library, inside libcosim, says while it loads and steps the FMU."""
    # Its messages are the process's, so it gets one of its own.
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
    # libcosim itself leaves enumerations out and says so; that is no finding.
    skipped = "FMI 2.0 Enumeration variable type not supported"
    lines = (done.stdout + done.stderr).splitlines()
    said = [line for line in lines if line.strip() and skipped not in line]
    return said if done.returncode == 0 else [*said, f"ended with {done.returncode}"]


def main() -> None:
    """Ask all, show what they find."""
    if len(sys.argv) != 2:
        sys.exit("usage: python importers.py FMU")
    fmu = Path(sys.argv[1])
    if not fmu.is_file():
        sys.exit(f"error: there is no file {fmu}; cargo run --release -- pack")
    asked = {
        "XML schema of FMI 2.0": schema_findings,
        f"fmpy {fmpy.__version__}": fmpy_findings,
        "fmutool": fmutool_findings,
        "FMI Library": fmi_library_findings,
    }
    count = 0
    for who, findings_of in asked.items():
        findings = findings_of(fmu)
        count += len(findings)
        print(f"{who}: {len(findings)} findings")
        print("".join(f"  {finding}\n" for finding in findings), end="")
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
