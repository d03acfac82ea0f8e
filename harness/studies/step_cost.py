"""Counts the instructions of fmi2DoStep by callgrind: median, maximum, and upper bound of a step.

    python3 harness/studies/step_cost.py dist/HubSlosh.fmu --step 0.001 --swing tau_cmd=0.1 \
        --set slosh.model=spherical --max-steps 1000
    python3 harness/studies/step_cost.py dist/HubSlosh.fmu --table

It needs Linux on x86-64, a C compiler and valgrind. A host in C (step_cost.c) calls fmi2DoStep with
inputs that follow a sine sweep, linear within steps. callgrind counts the instructions of each
call, which are the same on every machine. With ``--max-steps`` the FMU gets this
``solver.max_steps`` and, at the end, a step of 1e6 s, which it refuses after so many internal
steps. The instructions of this step are the largest possible number in a step; divide them by the
instructions per second of your processor (about 2e9) to compare with a deadline. ``--table`` prints
the table of the page "Bound on a step" of HubSlosh.
"""

import argparse
import math
import re
import statistics
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree

WARM = 20  # number of first steps that are not counted
LONG = 1e6  # length of the step that the FMU refuses, s

# slosh model, modes, friction law, step in s
CASES = [
    *((slosh, 1, "stribeck", 0.02) for slosh in ("frozen", "linear", "planar", "spherical")),
    *((slosh, modes, "stribeck", 0.02) for slosh in ("linear", "spherical") for modes in (3, 10)),
    *((slosh, 1, "stribeck", h) for slosh in ("linear", "spherical") for h in (1e-3, 5e-3, 0.1)),
    *(("linear", 1, friction, 0.02) for friction in ("viscous", "stribeck_smooth", "lugre")),
    ("spherical", 1, "lugre", 0.02),
]


def build_host(folder: Path) -> Path:
    """Compile step_cost.c; return the path of the program."""
    program = folder / "step_cost"
    source = Path(__file__).with_suffix(".c")
    options = ["-std=gnu11", "-O2", "-Wall", "-Wextra"]
    subprocess.run(["cc", *options, source, "-ldl", "-lm", "-o", program], check=True)
    return program


def unpack(fmu: str, folder: Path) -> Path:
    """Unpack an FMU into a new folder; return the folder."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


def arguments(
    folder: Path,
    values: Mapping[str, float | str],
    swing: Mapping[str, float],
    *,
    steps: int,
    step: float,
    frequencies: tuple[float, float],
    tolerance: float = 1e-6,
    long: float = 0.0,
) -> list[str]:
    """Return the command-line arguments of the host.

    * ``values``: start values by name; enumerations by the names of their items. Names that the FMU
      does not have are left out, so that older FMUs are accepted, too.
    * ``swing``: amplitudes of the inputs that follow the sweep.
    * ``frequencies``: first and last angular frequency of the sweep, rad/s.
    * ``long``: length of a last step, s; 0 for none.
    """
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    variables = {v.get("name"): v for v in root.iter("ScalarVariable")}
    items = {
        kind.get("name"): {item.get("name"): item.get("value") for item in kind.iter("Item")}
        for kind in root.iter("SimpleType")
    }
    library = folder / "binaries" / "linux64"
    library /= f"{root.find('CoSimulation').get('modelIdentifier')}.so"
    told = [library, root.get("guid"), tolerance, steps, step, *frequencies, long]
    for name, value in values.items():
        if name not in variables:
            continue
        kind = variables[name][0]
        code = "r" if kind.tag == "Real" else "i"
        number = items[kind.get("declaredType")][value] if isinstance(value, str) else value
        told += [code, variables[name].get("valueReference"), number]
    for name, size in swing.items():
        told += ["u", variables[name].get("valueReference"), size]
    return [str(word) for word in told]


def count_instructions(program: Path, told: Iterable[str]) -> list[int]:
    """Return the number of instructions of each fmi2DoStep, in order."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out")
        tool = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}"]
        tool += ["--toggle-collect=fmi2DoStep", "--dump-after=fmi2DoStep"]
        done = subprocess.run([*tool, program, *told], capture_output=True, text=True)
        if done.returncode:
            sys.exit(done.stderr)
        # callgrind writes a file for each call, and one for the end of the program
        dumps = sorted(out.parent.glob("out.*"), key=lambda file: int(file.suffix[1:]))
        texts = (file.read_text(encoding="utf-8", errors="replace") for file in dumps)
        totals = (re.search(r"^(?:totals|summary): (\d+)", text, re.MULTILINE) for text in texts)
        return [int(found[1]) for found in totals if found and int(found[1])]


def words(counts: list[int]) -> tuple[str, str]:
    """Return the median and the largest count after the first steps as text."""
    counted = counts[WARM:]
    return f"{statistics.median(counted):.0f}", str(max(counted))


def print_table(fmu: str, steps: int) -> None:
    """Print the table of slosh models, friction laws and steps of HubSlosh."""
    with tempfile.TemporaryDirectory() as name:
        folder = unpack(fmu, Path(name, "fmu"))
        program = build_host(Path(name))
        print(
            "| `slosh.model` | modes | `friction.model` | communication step "
            "| median of the instructions | largest number of instructions |"
        )
        print("| --- | --- | --- | --- | --- | --- |")
        for slosh, modes, friction, step in CASES:
            values = {"slosh.model": slosh, "slosh.modes": modes, "friction.model": friction}
            band = (2 * math.pi * 1.25, 2 * math.pi * 3.5)
            told = arguments(
                folder, values, {"tau_cmd": 0.1},
                steps=steps, step=step, frequencies=band, tolerance=1e-4,
            )  # fmt: skip
            cells = [slosh, modes, friction, f"{1000 * step:g} ms"]
            cells += words(count_instructions(program, told))
            print("|", " | ".join(str(cell) for cell in cells), "|", flush=True)


def setting(text: str) -> tuple[str, float | str]:
    """Return name and value of ``NAME=VALUE``."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        return name, value


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu")
    parser.add_argument("--table", action="store_true", help="print the table of HubSlosh's page")
    parser.add_argument("--step", type=float, default=0.001, help="communication step, s")
    parser.add_argument("--steps", type=int, default=2000, help="number of steps")
    parser.add_argument("--set", type=setting, action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--swing", type=setting, action="append", default=[], metavar="INPUT=SIZE")
    parser.add_argument("--from", dest="low", type=float, default=1.25, metavar="HZ")
    parser.add_argument("--to", dest="high", type=float, default=3.5, metavar="HZ")
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--max-steps", type=int, help="solver.max_steps, and the step it bounds")
    asked = parser.parse_args()
    if asked.table:
        print_table(asked.fmu, asked.steps)
        return
    values = dict(asked.set)
    if asked.max_steps:
        values["solver.max_steps"] = asked.max_steps
    with tempfile.TemporaryDirectory() as name:
        folder = unpack(asked.fmu, Path(name, "fmu"))
        told = arguments(
            folder, values, dict(asked.swing), steps=asked.steps, step=asked.step,
            frequencies=(2 * math.pi * asked.low, 2 * math.pi * asked.high),
            tolerance=asked.tolerance, long=LONG if asked.max_steps else 0.0,
        )  # fmt: skip
        counts = count_instructions(build_host(Path(name)), told)
    bounded = counts.pop() if asked.max_steps else None
    median, largest = words(counts)
    print(f"instructions of a step of {asked.step:g} s: median {median}, largest {largest}")
    if bounded:
        print(f"of a step that is refused after {asked.max_steps} internal steps: {bounded}")


if __name__ == "__main__":
    main()
