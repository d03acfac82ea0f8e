"""Margins of the live page "Slew" by `hubslosh.margins`, for some of its settings, as JSON.

``slew_margins.py Spacecraft.fmu OUT.json``; ``check_live.py`` compares the page with them. Nothing
here is taken from the page: parameters, gains and notch are written from its text (book/slew.md).
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy import signal

import hubslosh
from hubslosh import LinearModel, Loop

PERIOD = 0.1  # s
START = {
    "bandwidth": 0.03, "ratio": 0.7, "delay": 0.15, "center": 0.105, "width": 0.4, "thrust": 44,
    "fill": 280, "zeta": 0.0085,
}  # fmt: skip
"""The page's settings at its start: Hz, 1, s, Hz, 1, N, mm, 1; without notch."""
CASES: list[dict[str, Any]] = [
    {},
    {"delay": 2.5},
    {"notch": "on", "delay": 2.5},
    {"bandwidth": 0.08, "ratio": 1.0, "delay": 0},
    {"zeta": 0.0005, "fill": 500, "thrust": 120, "delay": 0.35},
    {"notch": "on", "center": 0.3, "width": 1, "bandwidth": 0.12, "delay": 0.4},
]
"""Differences from the nominal case."""


def parameters(values: dict[str, Any]) -> dict[str, Any]:
    """Return what the FMU is given."""
    depth = values["fill"] / 1000
    mass = 430 + 2 * 1008 * np.pi * 0.35**2 * depth
    found = {"craft.mass": 430, "craft.Jxx": 95, "craft.Jyy": 80, "craft.Jzz": 90, "tanks": 2}
    for number, side in ((1, 0.6), (2, -0.6)):
        tank = {
            "position[2]": side, "position[3]": -0.35, "diameter": 0.7, "depth": depth,
            "density": 1008, "zeta[1]": values["zeta"], "g_ref": values["thrust"] / mass,
        }  # fmt: skip
        found |= {f"tank[{number}].{name}": value for name, value in tank.items()}
    found |= {f"init.omega[{i}]": 0.0 for i in (1, 2, 3)}
    return found | {"force[3]": values["thrust"]}


def controller(values: dict[str, Any], inertia: np.ndarray) -> Any:
    """Return gains of half angles and rates; behind them three notches."""
    w = 2 * np.pi * values["bandwidth"]
    moments = np.diag(inertia)
    gains = np.hstack([2 * w**2 * moments, 2 * values["ratio"] * w * moments])
    if values.get("notch") != "on":
        return gains
    center = 2 / PERIOD * np.tan(np.pi * values["center"] * PERIOD)  # rad/s, warped
    over, under = ([1, 2 * z * center, center**2] for z in (values["width"] / 10, values["width"]))
    one = signal.tf2ss(*signal.bilinear(over, under, 1 / PERIOD))
    a, b, c, d = (np.kron(np.eye(3), matrix) for matrix in one)
    names = tuple(f"notch[{i}]" for i in range(len(a)))
    return LinearModel(a, b @ gains, c, d @ gains, names, (), (), PERIOD)


def main() -> None:
    """Write the margins of all cases."""
    fmu, out = sys.argv[1:]
    measured = ["q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]"]
    torques = [f"torque[{i}]" for i in (1, 2, 3)]
    found = []
    for case in CASES:
        values = START | case
        given = parameters(values)
        diagonal = [f"inertia[{i},{i}]" for i in (1, 2, 3)]
        inertia = hubslosh.simulate(fmu, given, stop=0.1, outputs=diagonal)[diagonal].iloc[0]
        law = controller(values, inertia.to_numpy())
        loop = Loop(law, PERIOD, fmu, given, measured, torques, delay=values["delay"])
        margins = hubslosh.margins(loop)
        crossings = margins.crossings.replace({np.nan: None}).to_dict("records")
        least = {"delay": margins.delay_margin, "modulus": margins.modulus_margin}
        found.append({"settings": case, "stable": margins.stable, "crossings": crossings} | least)
        print(f"{case}\n{margins}")
    Path(out).write_text(json.dumps(found, indent=1, allow_nan=False), encoding="utf-8")


if __name__ == "__main__":
    main()
