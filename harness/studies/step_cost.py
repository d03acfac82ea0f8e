"""The cost of one fmi2DoStep of HubSlosh in instructions, as a table in Markdown.

    python3 harness/studies/step_cost.py dist/HubSlosh.fmu FOLDER_WITH_fmi2Functions.h

Compiles step_cost.c, which says how it counts, and runs it for slosh models, modes, friction laws
and communication steps. Linux, x86-64 or another processor that its kernel can step.
"""

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.etree import ElementTree

STEPS = 100_000
AMPLITUDE = 0.1  # N m
SLOSH = {"frozen": 1, "linear": 2, "planar": 3, "spherical": 4, "paraboloid": 5}
FRICTION = {"viscous": 2, "stribeck_smooth": 3, "stribeck": 4, "lugre": 5}

# slosh model, modes, friction law, step in s
CASES = [
    *((slosh, 1, "stribeck", 0.02) for slosh in SLOSH),
    *((slosh, modes, "stribeck", 0.02) for slosh in ("linear", "spherical") for modes in (3, 10)),
    *((slosh, 1, "stribeck", h) for slosh in ("linear", "spherical") for h in (1e-3, 5e-3, 0.1)),
    *(("linear", 1, friction, 0.02) for friction in ("viscous", "stribeck_smooth", "lugre")),
    ("spherical", 1, "lugre", 0.02),
]


def main() -> None:
    """Print the table, a row per case."""
    fmu, headers = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(fmu).extractall(folder)
        root = ElementTree.parse(Path(folder, "modelDescription.xml")).getroot()
        references = {v.get("name"): v.get("valueReference") for v in root.iter("ScalarVariable")}
        program = Path(folder, "step_cost")
        source = Path(__file__).with_suffix(".c")
        options = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-I", headers]
        subprocess.run(["cc", *options, source, "-ldl", "-lm", "-o", program], check=True)
        library = Path(folder, "binaries", "linux64", "HubSlosh.so")
        print("| slosh model | modes | friction | step | median | 99.99 % | most |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
        for slosh, modes, friction, h in CASES:
            values = {
                "slosh.model": SLOSH[slosh],
                "slosh.modes": modes,
                "friction.model": FRICTION[friction],
            }
            command = [program, library, root.get("guid"), STEPS, h, AMPLITUDE]
            command.append(references["tau_cmd"])
            for name, value in values.items():
                command += [references[name], "i", value]
            command = [str(argument) for argument in command]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            counts = done.stdout.split() if done.returncode == 0 else [done.stdout.strip(), "", ""]
            cells = [slosh, modes, friction, f"{1000 * h:g} ms", *counts]
            print("|", " | ".join(str(cell) for cell in cells), "|", flush=True)


if __name__ == "__main__":
    main()
