"""Counts the processor instructions of fmi2DoStep of HubSlosh and Spacecraft; prints a table.

    python3 harness/studies/six_axes.py [--short] dist/HubSlosh.fmu dist/Spacecraft.fmu

It needs Linux, a C compiler, Python 3.11 or newer and valgrind. FMUs of older versions are
accepted, too; parameters that they do not have are left out. The host of step_cost.py sets a torque
and its slope and calls fmi2DoStep with 20 ms; the table has the mean over 1000 steps, after the
first 100 steps. With --short only two rows are counted, and compared with the page. They may differ
by 10 %, because compilers differ by some per cent.

| case | what |
| --- | --- |
| hub | HubSlosh's bench, spherical model, no friction |
| held | a craft with the same liquid, one tank and mode, under 1 g, which turns about one axis |
| one | 1180 kg under 2400 N, one tank, one mode, the damping law that all releases have |
| two | the same, two tanks of one mode, as in the comparison with Basilisk |
| four | the same, four tanks of three modes each |
| planar | one tank, one mode that swings in only one plane |
| curved | one tank, one mode with s = 1.408, kappa = 0.734 |
"""

import math
import re
import statistics
import sys
import tempfile
from pathlib import Path

import step_cost

PAGE = Path(__file__).resolve().parents[2] / "modelDescription/Spacecraft/documentation/model.md"
STEP = 0.02  # s
STEPS = (100, 1100)  # first and last step whose instructions are counted
HELD_MASS = 1e9  # kg

# case, tolerance, row of the table
ROWS = [
    ("hub", 1e-6, "HubSlosh's bench, spherical model, no friction (2.3 Hz)"),
    ("held", 1e-6, "the liquid of this bench in a Spacecraft that is held to one axis"),
    ("one", 1e-6, "1180 kg, one tank, one mode (0.4 Hz)"),
    ("two", 1e-6, "1180 kg, two tanks of one mode"),
    ("four", 1e-6, "1180 kg, four tanks of three modes"),
    ("two", 1e-8, "1180 kg, two tanks of one mode, at a tolerance of 1e-8"),
    ("planar", 1e-6, "1180 kg, one tank, one planar mode"),
    ("curved", 1e-6, "1180 kg, one tank, one mode with s and κ"),
]


def parameters(case: str) -> dict[str, float | str]:
    """Return the start values of a case."""
    if case == "hub":
        return {
            "slosh.model": "spherical",
            "friction.model": "none",
            "init.slosh_angle": 0.1,
            "init.slosh_angle_radial": 0.05,
        }
    p: dict[str, float | str] = {"init.omega[1]": 0.01, "init.omega[2]": -0.02}
    p["init.omega[3]"] = 0.03

    def vector(name: str, values: tuple[float, ...]) -> None:
        p.update({f"{name}[{i}]": x for i, x in enumerate(values, 1)})

    def bob(tank: int, mode: int, values: tuple[float, ...]) -> None:
        p.update({f"tank[{tank}].p_0[{mode},{i}]": x for i, x in enumerate(values, 1)})

    bob(1, 1, (0.05, 0.0 if case == "planar" else 0.1, -0.99))
    p["tank[1].damping_law"] = "constant"
    if case == "held":
        inertia = {"Jxx": HELD_MASS, "Jyy": HELD_MASS, "Jzz": 0.322414}
        p.update({f"craft.{j}": x for j, x in {**inertia, "Jxy": 0, "Jxz": 0, "Jyz": 0}.items()})
        p["craft.mass"] = HELD_MASS
        vector("craft.r", (0, 0, 0))
        vector("init.omega", (0, 0, 0))
        vector("tank[1].position", (0.225, 0, 0))
        p.update({"tank[1].g_ref": 9.81, "tank[1].diameter": 0.163, "tank[1].depth": 0.10})
    elif case == "planar":
        p["tank[1].direction[1,1]"] = 1.0
    elif case == "curved":
        p["tank[1].nonlinear_inertia[1]"] = 1.408
        p["tank[1].nonlinear_stiffness[1]"] = 0.734
    elif case == "two":
        p.update({"tanks": 2, "tank[2].damping_law": "constant"})
        bob(2, 1, (-0.02, 0.05, -0.99))
        vector("tank[1].position", (0.6, 0, 0))
        vector("tank[2].position", (-0.6, 0, 0))
    elif case == "four":
        p["tanks"] = 4
        for i, (x, y) in enumerate([(0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6)], 1):
            p.update({f"tank[{i}].modes": 3, f"tank[{i}].damping_law": "constant"})
            vector(f"tank[{i}].position", (x, y, -0.2))
            vector(f"tank[{i}].q", (0.97, 0.1 * x, -0.1 * y, 0.05))
            for mode in (1, 2, 3):
                bob(i, mode, (0.1, 0.05, -0.99))
    return p


def count_instructions(program: Path, folder: Path, case: str, tolerance: float) -> float:
    """Return the mean number of instructions of one fmi2DoStep, over 1000 steps."""
    values = parameters(case)
    if case == "hub":
        w, swing = 13.0, {"tau_cmd": 0.05}
    elif case == "held":
        values["force[3]"] = HELD_MASS * 9.81
        w, swing = 13.0, {"torque[3]": 0.05}
    else:
        values["force[3]"] = 2400.0
        w, swing = 2.5, {"torque[1]": 20.0, "torque[2]": 10.0, "torque[3]": 20.0}
    told = step_cost.arguments(
        folder, values, swing,
        steps=STEPS[1], step=STEP, frequencies=(w, w), tolerance=tolerance,
    )  # fmt: skip
    return statistics.mean(step_cost.count_instructions(program, told)[STEPS[0] :])


def main() -> None:
    short = sys.argv[1:2] == ["--short"]
    if len(sys.argv) != 3 + short:
        sys.exit(__doc__)
    page = PAGE.read_text(encoding="utf-8")
    print("| model, motion | instructions of a step | divided by the instructions of HubSlosh |")
    print("| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        program = step_cost.build_host(Path(folder))
        hub = step_cost.unpack(sys.argv[-2], Path(folder, "hub"))
        craft = step_cost.unpack(sys.argv[-1], Path(folder, "craft"))
        unit = math.nan
        for case, tolerance, what in [row for row in ROWS if row[0] in ("hub", "one") or not short]:
            n = count_instructions(program, hub if case == "hub" else craft, case, tolerance)
            unit = n if case == "hub" else unit
            print(f"| {what} | {n:,.0f} | {n / unit:.1f} |", flush=True)
            written = re.search(rf"^\| {re.escape(what)}.*?\| ([\d,]+) \|", page, re.MULTILINE)
            if short and abs(n / float(written[1].replace(",", "")) - 1) > 0.1:
                sys.exit(f"error: {PAGE} has {written[1]}")


if __name__ == "__main__":
    main()
