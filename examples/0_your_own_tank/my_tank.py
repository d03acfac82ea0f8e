"""Your own tank: change the numbers, run, look at my_tank.png.

python examples/0_your_own_tank/my_tank.py
"""

import sys

import matplotlib.pyplot as plt
import pandas as pd

import hubslosh
from hubslosh.plot import time_histories

# Any parameter by its name: in SI units, or with a unit. The list: `hubslosh variables`.
MY_TANK = {
    "hub.I": 40.0,  # kg·m², craft and dry tank about the axis of rotation
    "tank.d": (600, "mm"),  # inner diameter
    "tank.h": (400, "mm"),  # fill height
    "tank.r": (500, "mm"),  # from the axis of rotation to the tank's axis
    "fluid.rho": 1010.0,  # kg/m³
    "fluid.nu": 0.9e-6,  # m2/s
    "g_axial": 9.81,  # m/s² along the tank's axis: gravity, or thrust over mass
    "friction.model": "none",
}
# The manoeuvre: rows of time (s) and torque (N·m), joined by straight lines; two rows make a jump.
TORQUE = [(0, 10), (2, 10), (2, -10), (4, -10), (4, 0), (20, 0)]


def compare(fmu: str = "HubSlosh") -> dict[str, pd.DataFrame]:
    """Run the manoeuvre with rigid and with sloshing liquid."""
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


def main() -> None:
    """Draw the two runs over each other."""
    axes = None
    for liquid, run in compare(*sys.argv[1:]).items():
        names = ("tau_cmd", "theta", "omega", "slosh_angle", "wave_height")
        axes = time_histories(run, *names, axes=axes, label=liquid)
        print(f"{liquid}: {run['omega'].iloc[-500:].abs().max():.4f} rad/s in the last 10 s")
    plt.savefig("my_tank.png", dpi=120)
    print("wrote my_tank.png")


if __name__ == "__main__":
    main()
