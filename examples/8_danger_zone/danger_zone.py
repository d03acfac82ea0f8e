"""Heights of a tank at which its liquid destabilises the thrust-vector control of a craft.

The craft has one tank on its axis.

python examples/8_danger_zone/danger_zone.py
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.optimize import brentq

import hubslosh
from hubslosh.plot import COLORS, save

THRUST = 2400.0  # N
GIMBAL = -1.3  # m, height of the engine's gimbal, where the FMU's origin O lies
FREQUENCY, RATIO = 0.2, 0.7
"""Bandwidth and damping ratio of the attitude loop: rad/s, 1."""
DRY = (1180.0, 0.21, 860.0)
"""Dry craft: mass (kg), height of its centre of mass (m), transverse inertia about it (kg·m²)."""
LIQUID = (253.493, 0.0563967, 3.67522)
"""Rigid liquid: mass (kg), height of its centre of mass above the tank's origin (m), kg·m²."""
BOB = (128.211, 0.248039, 0.136534)
"""Slosh mode: mass (kg), pendulum length (m), height of its hinge above the tank's origin (m)."""


@dataclass(frozen=True)
class Craft:
    """The craft with the origin of its tank at the height ``z`` (m) above the gimbal."""

    z: float
    zeta: float = 0.0

    def __post_init__(self) -> None:
        """Compute mass, centre of mass and inertia of dry craft and rigid liquid together."""
        (m_b, z_b, I_b), (m_0, H_0, I_0) = DRY, LIQUID
        M = m_b + m_0
        z_R = (m_b * z_b + m_0 * (self.z + H_0)) / M
        inertia = I_b + m_b * (z_b - z_R) ** 2 + I_0 + m_0 * (self.z + H_0 - z_R) ** 2
        for name, value in {"M": M, "z_R": z_R, "I": inertia}.items():
            object.__setattr__(self, name, value)

    @property
    def hinge(self) -> float:
        """Height of the hinge above the centre of mass of the rigid part, m."""
        return self.z + BOB[2] - self.z_R

    @property
    def bob(self) -> float:
        """Height of the bob at rest above the centre of mass of the rigid part, m."""
        return self.hinge - BOB[1]

    @property
    def force_height(self) -> float:
        """Height of the gimbal above the centre of mass of the rigid part, m."""
        return GIMBAL - self.z_R

    @property
    def percussion(self) -> float:
        """Height of the centre of percussion for a force at the gimbal, m."""
        return self.I / (self.M * -self.force_height)

    @property
    def gains(self) -> tuple[float, float]:
        """Gains K_p (N·m/rad) and K_d (N·m·s/rad) of the attitude loop."""
        return self.I * FREQUENCY**2, self.I * 2 * RATIO * FREQUENCY

    @property
    def predicted_growth(self) -> float:
        """Return the shift of the undamped slosh pole's real part by the loop, 1/s.

        To first order in the gains it is K_d (w_z² - w_p²)/(2 I w_p²).
        """
        m, l, _ = BOB
        g = THRUST / (self.M + m)
        b, h = self.bob, self.hinge
        pole = g / l * (1 + m / self.M + m * b * h / self.I)
        apart = m / self.I * g / l * h * (b + self.I / (self.M * self.force_height))
        return -self.gains[1] * apart / (2 * self.I * pole)

    @property
    def damping_needed(self) -> float:
        """Smallest damping ratio with which the loop is stable; 0 if none is needed."""
        m, l, _ = BOB
        sigma = 1 + m / self.M + m * self.bob**2 / self.I
        # 2 zeta_p w_p = (c/m) sigma, c = 2 zeta m sqrt(g/l)
        return max(self.predicted_growth, 0.0) / (np.sqrt(THRUST / (self.M + m) / l) * sigma)

    def parameters(self) -> dict[str, float]:
        """Return the parameters of the FMU, with O at the gimbal."""
        m, l, hinge = BOB
        return {
            "craft.mass": DRY[0], "craft.r[3]": DRY[1] - GIMBAL, "craft.Jyy": DRY[2],
            "tank[1].position[3]": self.z - GIMBAL, "tank[1].m_0": LIQUID[0],
            "tank[1].H_0": LIQUID[1], "tank[1].I_0": LIQUID[2], "tank[1].mass[1]": m,
            "tank[1].length[1]": l, "tank[1].hinge[1]": hinge, "tank[1].zeta[1]": self.zeta,
            "tank[1].g_ref": THRUST / (self.M + m), "force[3]": THRUST,
        }  # fmt: skip


def closed_loop_poles(fmu: str, craft: Craft) -> np.ndarray:
    """Return the poles of FMU and attitude loop, computed by the FMU's directional derivatives."""
    model = hubslosh.linearize(
        fmu, craft.parameters(), ["force[1]"], ["q[3]", "omega[2]"], all_states=True
    )
    A, B, C, D = model
    k_p, k_d = craft.gains
    # theta = 2 q_3; the torque about the centre of mass is force_height times the force.
    gain = np.array([[-2 * k_p, -k_d]]) / craft.force_height
    assert not D.any()
    return np.linalg.eigvals(A + B @ gain @ C)


def growth(fmu: str, craft: Craft) -> float:
    """Return the real part of the slosh pole in the closed loop, 1/s.

    Of all poles above 1 rad/s, only the slosh pole in pitch is shifted by the loop.
    """
    poles = closed_loop_poles(fmu, craft)
    m, l, _ = BOB
    pole = THRUST / (craft.M + m) / l * (1 + m / craft.M + m * craft.bob * craft.hinge / craft.I)
    yaw_plane = hubslosh.linearize(fmu, craft.parameters(), ["force[1]"], ["omega[2]"],
                                   all_states=True).poles  # fmt: skip
    moved = [p for p in poles if p.imag > 1 and np.abs(yaw_plane - p).min() > 1e-7]
    if not moved:
        return 0.0
    return float(min(moved, key=lambda p: abs(p.imag**2 - pole)).real)


def simulate(fmu: str, craft: Craft, stop: float, period: float = 0.01) -> pd.DataFrame:
    """Simulate the sampled loop; the liquid is released at 1 degree from rest.

    The run ends at ``stop``, s, and the controller has the cycle time ``period``, s.
    """
    k_p, k_d = craft.gains

    def law(_: float, seen: np.ndarray) -> float:
        q_1, q_3, rate = seen
        angle = 2 * np.arctan2(q_3, q_1)
        return float(-(k_p * angle + k_d * rate) / craft.force_height)

    start = {"tank[1].p_0[1,1]": np.sin(np.radians(1)), "tank[1].p_0[1,3]": -np.cos(np.radians(1))}
    return hubslosh.closed_loop(
        law, period, stop, fmu, craft.parameters() | start,
        measured=("q[1]", "q[3]", "omega[2]"), command="force[1]",
        outputs=["q[1]", "q[3]", "tank[1].angle_x[1]"],
    )  # fmt: skip


def simulated_growth(fmu: str, craft: Craft, stop: float = 120.0) -> float:
    """Return the growth rate of the slosh amplitude in the simulated loop, 1/s."""
    run = simulate(fmu, craft, stop)
    time, angle = run["time"].to_numpy(), run["tank[1].angle_x[1]"].to_numpy()
    top = (np.abs(angle[1:-1]) >= np.abs(angle[:-2])) & (np.abs(angle[1:-1]) > np.abs(angle[2:]))
    t, peaks = time[1:-1][top], np.abs(angle[1:-1][top])
    later = t > 40  # the attitude has settled
    return float(np.polyfit(t[later], np.log(peaks[later]), 1)[0])


def zone(fmu: str) -> tuple[float, float]:
    """Return the lower and the upper end of the heights at which the FMU's loop is unstable, m."""
    return tuple(
        brentq(lambda z: growth(fmu, Craft(z)), low, high, xtol=1e-4)
        for low, high in ((0.0, 0.2), (0.7, 1.1))
    )


def predicted_zone() -> tuple[float, float]:
    """Return the two predicted ends of the unstable heights of the tank, m."""
    hinge = brentq(lambda z: Craft(z).hinge, -1, 1)
    bob = brentq(lambda z: Craft(z).bob - Craft(z).percussion, 0, 2)
    return hinge, bob


def figure(fmu: str) -> plt.Figure:
    """Draw the growth rate over the tank's height, and two time histories."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
    heights = np.linspace(-1.2, 1.2, 61)
    low, high = predicted_zone()
    left.axvspan(low, high, color="0.9", label="hinge above CoM, bob below x_cp")
    left.axhline(0, color="0.5", linewidth=0.8)
    left.plot(heights, [1e3 * Craft(z).predicted_growth for z in heights], color=COLORS[0],
              label="first order in the gains")  # fmt: skip
    left.plot(heights, [1e3 * growth(fmu, Craft(z)) for z in heights], "--", color=COLORS[1],
              label="poles from the FMU's derivatives")  # fmt: skip
    some = [-0.9, -0.45, 0.2, 0.5, 1.1]
    left.plot(some, [1e3 * simulated_growth(fmu, Craft(z)) for z in some], "o", color=COLORS[2],
              label="simulated")  # fmt: skip
    left.set(xlabel="height of the tank's origin (m)", ylabel="growth of slosh (10$^{-3}$/s)",
             title=f"With a tank at {low:.2f} to {high:.2f} m the loop is unstable")  # fmt: skip
    left.legend(fontsize=8)
    for n, (z, text) in enumerate(((0.5, "0.50 m: in the zone"), (-0.45, "−0.45 m"))):
        run = simulate(fmu, Craft(z), 300)
        right.plot(run["time"], np.degrees(run["tank[1].angle_x[1]"]), color=COLORS[1 - n],
                   linewidth=0.6, label=text)  # fmt: skip
    right.set(
        xlabel="time (s)",
        ylabel="slosh angle (°)",
        title="Slosh grows in the zone and dies out below it",
    )
    right.legend(fontsize=8)
    return drawing


def main() -> None:
    parser = argparse.ArgumentParser(description="Where a tank destabilises an attitude loop.")
    parser.add_argument("--fmu", default="Spacecraft", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    print("zone, m: predicted {:.3f} to {:.3f}".format(*predicted_zone()), end="; ")
    print("from the FMU {:.3f} to {:.3f}".format(*zone(args.fmu)))
    for z in (-1.6, -0.45, 0.14, 0.2, 0.5, 0.8, 1.2):
        craft = Craft(z)
        rates = (craft.predicted_growth, growth(args.fmu, craft), simulated_growth(args.fmu, craft))
        cells = [f"{z:.2f}", *(f"{rate:.4e}" for rate in rates), f"{craft.damping_needed:.5f}"]
        print(f"| {' | '.join(cells)} |")
    save(figure(args.fmu), args.out)


if __name__ == "__main__":
    main()
