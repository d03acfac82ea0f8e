"""Simulates your own tank: change the numbers, run the script, and look at my_tank.png.

python examples/0_your_own_tank/my_tank.py
"""

import argparse
from pathlib import Path
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

# Parameters of an upright cylinder on a craft that turns about one axis, in SI or with a unit.
# You can add any parameter of the FMU; `hubslosh variables` lists all parameters.
MY_TANK = {
    "hub.I": 40.0,  # kg·m², craft and dry tank about the axis of rotation
    "tank.d": (600, "mm"),  # inner diameter
    "tank.h": (400, "mm"),  # fill height
    "tank.r": (500, "mm"),  # distance from the axis of rotation to the tank's axis
    "fluid.rho": 1010.0,  # kg/m³
    "fluid.nu": 0.9e-6,  # m2/s
    "g_axial": 9.81,  # m/s² along the tank's axis: gravity, or thrust over mass
    "friction.model": "none",
}
# The manoeuvre: pairs of time (s) and torque (N·m), interpolated linearly; two pairs at the same
# time are a jump.
TORQUE = [(0, 10), (2, 10), (2, -10), (4, -10), (4, 0), (20, 0)]


def compare(fmu: str = "HubSlosh") -> dict[str, hubslosh.Run]:
    """Simulate the manoeuvre with rigid and with sloshing liquid."""
    inputs = pd.DataFrame(TORQUE, columns=["time", "tau_cmd"])
    return {
        liquid: hubslosh.simulate(
            fmu,
            parameters=MY_TANK | {"slosh.model": liquid},
            inputs=inputs,
            step=0.02,
            outputs=["theta", "omega", "slosh_angle", "wave_height"],
        )
        for liquid in ("frozen", "spherical")
    }


def pointing_error(runs: dict[str, hubslosh.Run]) -> pd.Series:
    """Return the craft's angle with sloshing liquid minus its angle with rigid liquid, 0.001°."""
    return 1e3 * np.degrees(runs["spherical"]["theta"] - runs["frozen"]["theta"])


def summary(runs: dict[str, hubslosh.Run]) -> str:
    """Return sentences on the motion after the manoeuvre, and on the validity of the model."""
    end = max((time for time, torque in TORQUE if torque), default=0)
    late = runs["spherical"]["time"] > end
    error, wave = pointing_error(runs)[late], 1e3 * runs["spherical"]["wave_height"][late]
    # amplitude about the mean, because sloshing and rigid liquid may have other mean angles
    swing = (error.max() - error.min()) / 2
    answer = (
        f"After the manoeuvre the liquid swings the craft by ±{swing:.0f} millidegrees,\n"
        f"with a wave of up to {wave.max():.1f} mm"
    )
    # If the liquid moves too much for the model, the numbers above cannot be trusted. Package 0.6.1
    # does not have the attribute out_of_range.
    beyond = getattr(runs["spherical"], "out_of_range", [])
    return "\n".join([answer, *(fill(text, 80) for text in beyond)])


def figure(runs: dict[str, hubslosh.Run]) -> plt.Figure:
    """Draw the pointing error and the wave, with the result above them."""
    drawing, (pointing, wave) = plt.subplots(2, figsize=(8, 5), sharex=True, layout="constrained")
    time = runs["spherical"]["time"]
    pointing.plot(time, pointing_error(runs), color=COLORS[1])
    pointing.set(ylabel="pointing error (0.001°)")
    wave.plot(time, 1e3 * runs["spherical"]["wave_height"], color=COLORS[0])
    wave.set(xlabel="time (s)", ylabel="wave at the wall (mm)")
    end = max((time for time, torque in TORQUE if torque), default=0)
    for ax in (pointing, wave):
        ax.axvspan(0, end, color="0.92", linewidth=0)
        ax.grid(alpha=0.3)
        ax.margins(x=0)
    top = pointing.get_xaxis_transform()
    pointing.text(end / 2, 0.96, "torque", transform=top, ha="center", va="top", color="0.4")
    drawing.suptitle(summary(runs))
    return drawing


def main() -> None:
    parser = argparse.ArgumentParser(description="What the liquid does to your craft.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path("my_tank.png"))
    args = parser.parse_args()
    runs = compare(args.fmu)
    print(summary(runs))
    save(figure(runs), args.out)
    print("wrote", args.out)


if __name__ == "__main__":
    main()
