"""Defines a satellite; prints mass properties and margins over the fill, and simulates a burn."""

import warnings

import control
import numpy as np
import pandas as pd

import hubslosh

craft = hubslosh.Craft(
    mass=1400.0,  # kg, dry
    center_of_mass=(0.012, -0.008, 1.05),  # m from O
    inertia=[[1150.0, -14.0, 22.0], [-14.0, 980.0, 9.0], [22.0, 9.0, 870.0]],  # kg·m²
    thrust=400.0,  # N along z
    tanks={
        "NTO": hubslosh.MountedTank(
            {"density": 1440.0, "shape": {"sphere": {"radius": 0.55}}},
            position=(0.06, 0.42, 0.2), nu=2.8e-7,
        ),
        "MMH": hubslosh.MountedTank(
            {"density": 875.0, "shape": {"domed_cylinder": {
                "radius": 0.45, "height": 0.9, "bottom": 0.45, "top": 0.45}}},
            position=(-0.05, -0.62, 0.1), nu=8.9e-7,
        ),
    },
)  # fmt: skip
FILLS = [f"{fill:g}%" for fill in np.linspace(4, 97, 20)]
PERIOD, DELAY = 0.1, 0.12  # s
MEASURED = ["q[2]", "omega[1]", "q[3]", "omega[2]", "q[4]", "omega[3]"]


def controller(bandwidth: float = 0.02, notch: float = 0.12) -> control.StateSpace:
    """Return a PID controller of half angles and rates for each axis, with notch and roll-off.

    ``bandwidth`` and the frequency ``notch`` are in Hz.
    """
    s = control.tf("s")
    w, n, r = (2 * np.pi * f for f in (bandwidth, notch, 25 * bandwidth))
    filters = (s**2 + 0.2 * n * s + n**2) / (s**2 + 1.2 * n * s + n**2)
    filters *= r**2 / (s**2 + 1.4 * r * s + r**2)
    both = control.ss([], [], [], [[1.0, 1.0]])
    axes = []
    for J in np.diag(craft.mass_properties("50%").inertia):
        angle, rate = 2 * J * (w**2 + 0.1 * w**3 / s), control.ss([], [], [], [[1.4 * w * J]])
        axes.append(control.tf2ss(filters) * both * control.append(control.tf2ss(angle), rate))
    return control.append(*axes)


def loop(fill: str, of: hubslosh.Craft | None = None) -> hubslosh.Loop:
    """Return the three-axis loop at a fill of both tanks.

    ``of`` is the craft, by default this satellite.
    """
    return (of or craft).loop(controller(), PERIOD, fill, measured=MEASURED, delay=DELAY)


def over_fills() -> pd.DataFrame:
    """Return the satellite's mass properties and stability margins, a row for each fill."""
    rows = []
    for fill in FILLS:
        at, found = craft.mass_properties(fill), hubslosh.margins(loop(fill))
        rows.append({
            "fill (%)": float(fill[:-1]), "mass (kg)": at.mass, "z (m)": at.center_of_mass[2],
            "Jzz (kg·m²)": at.inertia[2, 2], "stable": found.stable,
            "phase margin (°)": found.phase_margin, "gain margin (dB)": found.gain_margins[1],
            "delay margin (s)": found.delay_margin,
        })  # fmt: skip
    return pd.DataFrame(rows)


if __name__ == "__main__":
    # damping of spheres was measured in smaller spheres or more viscous liquids
    warnings.filterwarnings("ignore", "tank NTO: damping", hubslosh.FmuWarning)
    print(craft, craft.mass_properties("60%"), over_fills().to_string(index=False), sep="\n\n")
    burn = craft.drain({"NTO": 0.083, "MMH": 0.05}, "60%")  # kg/s
    run = hubslosh.simulate("Spacecraft", burn, stop=60, outputs=["mass", "center_of_mass"])
    print(run.iloc[[0, -1]].to_string(index=False))
