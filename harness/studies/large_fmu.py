"""Builds an FMU with many variables, and measures time and memory of `hubslosh check` for it.

    cargo build --release
    python3 harness/studies/large_fmu.py --variables 100044

A C compiler builds the FMU from harness/check/tests/all/model.c. It has one state and both
interfaces. Every tenth variable is a parameter; the others are multiples of the state. Each
variable has a unit and a description, about 300 bytes of XML.
"""

import argparse
import platform
import resource
import subprocess
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "harness/check/tests/all/model.c"
OWN = 4  # number of variables in HEAD: x, der(x), k, u
FLAGS = (
    'modelIdentifier="model" canNotUseMemoryManagementFunctions="true" '
    'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
)
HEAD = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="model" guid="{{model}}"
    numberOfEventIndicators="0">
  <ModelExchange {FLAGS}/>
  <CoSimulation {FLAGS} canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit></UnitDefinitions>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" initial="exact">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1" initial="calculated">
      <Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed">
      <Real min="0" start="1"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="3" causality="input">
      <Real start="0"/></ScalarVariable>
"""
TAIL = """  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies="1" dependenciesKind="constant"/></Outputs>
    <Derivatives>
      <Unknown index="2" dependencies="1 4" dependenciesKind="fixed fixed"/></Derivatives>
    <InitialUnknowns><Unknown index="2" dependencies="1 3 4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def variable(k: int) -> str:
    """Return the XML of the additional variable with the index ``k``, counted from 0."""
    name = f"machine.drive[{k // 1000}].stage[{k // 10 % 100}]"
    if k % 10 == 0:
        name += ".preload"
        kind = 'causality="parameter" variability="fixed" initial="exact"'
        start = ' start="0"'
    else:
        name += f".torque[{k % 10}]"
        kind = 'causality="local" variability="continuous" initial="calculated"'
        start = ""
    return (
        f'    <ScalarVariable name="{name}" valueReference="{OWN + k}" {kind} '
        f'description="Torque at flange {k} of the drive train, about its axis of rotation">\n'
        f'      <Real unit="N.m" nominal="1000"{start}/>\n    </ScalarVariable>\n'
    )


def write(path: Path, variables: int) -> int:
    """Write an FMU with ``variables`` variables; return the size of its description, bytes."""
    if variables < OWN:
        raise ValueError(f"{variables} variables (allowed: {OWN} or more)")
    more = variables - OWN
    description = HEAD + "".join(map(variable, range(more))) + TAIL
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "model.so")
        options = ["-std=gnu11", "-O1", "-shared", "-fPIC", "-DRATE=1.0"]
        options += ["-DCO_SIMULATION", "-DMODEL_EXCHANGE", f"-DMANY={more}"]
        subprocess.run(["cc", *options, SOURCE, "-o", library, "-lm"], check=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as fmu:
            fmu.writestr("modelDescription.xml", description)
            fmu.write(library, "binaries/linux64/model.so")
            fmu.writestr("documentation/index.html", "<html></html>")
            fmu.writestr("documentation/licenses/license.txt", "MIT")
    return len(description.encode())


def main() -> None:
    assert platform.system() == "Linux", "the binary is made for Linux"
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--variables", type=int, default=100_044)
    parser.add_argument("--out", type=Path, help="write the FMU to this path, and keep it")
    parser.add_argument("--hubslosh", type=Path, default=ROOT / "target/release/hubslosh")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        fmu = args.out or Path(folder, "large.fmu")
        size = write(fmu, args.variables)
        began = time.monotonic()
        done = subprocess.run([args.hubslosh, "check", fmu], check=False)
        elapsed = time.monotonic() - began
    # CPU time of all finished child processes, and memory of the largest one
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"{args.variables} variables, {size / 1e6:.1f} MB of XML: exit code {done.returncode}, "
        f"{elapsed:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of CPU time, "
        f"{used.ru_maxrss / 1024:.0f} MiB in the largest process"
    )


if __name__ == "__main__":
    main()
