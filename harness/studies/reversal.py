"""Draws the motion of the liquid of Spacecraft during thrust reversals, book/ball.svg.

    PYTHONPATH=harness/python python3 harness/studies/reversal.py

It needs dist/Spacecraft.fmu (``cargo run --release -- pack --model Spacecraft``) and the packages
in requirements.txt. The craft is the FMU's default, 1180 kg with 382 kg of liquid in a half-full
upright cylinder, 1.2 m high. The thrust is forwards, then backwards with 0.01 m/s² of the dry
craft, then forwards again.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh import plot

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "dist" / "Spacecraft.fmu"
PICTURE = ROOT / "book" / "ball.svg"
DRY, BACK, FORWARD = 1180.0, -11.8, 60.0  # kg, N, N
REVERSED, RESUMED, END = 10.0, 50.0, 100.0  # s
PARAMETERS = {
    "tank[1].ball.travel": 0.6,
}  # fmt: skip
OUTPUTS = [
    "velocity[3]", "energy", "work", "dissipated", "tank[1].angle_y[1]",
    "tank[1].ball.position[1]", "tank[1].ball.position[3]", "tank[1].ball.velocity[3]",
    "tank[1].ball.state",
]  # fmt: skip


def simulate() -> pd.DataFrame:
    """Return the simulated run, with a row every 0.1 s."""
    times = [0.0, REVERSED, REVERSED, RESUMED, RESUMED, END]
    # The forward thrust is tilted by 0.2 %, so that the liquid does not return along the axis.
    along = [FORWARD, FORWARD, BACK, BACK, FORWARD, FORWARD]
    inputs = pd.DataFrame({"time": times, "force[3]": along, "force[1]": 0.002 * np.abs(along)})
    return hubslosh.simulate(FMU, PARAMETERS, inputs, step=0.1, outputs=OUTPUTS, tolerance=1e-8)


def draw(picture: Path) -> None:
    """Simulate the run, print the energy balance, and draw the picture."""
    run = simulate()
    mpl.rcParams["svg.hashsalt"] = "hubslosh"
    figure, axes = plt.subplots(3, figsize=(7.2, 7.2), sharex=True, layout="constrained")
    time, state = run["time"], run["tank[1].ball.state"]
    for axis in axes:
        for number, color in ((2, plot.COLORS[4]), (3, plot.COLORS[5])):
            axis.fill_between(
                time, 0, 1, where=state == number, color=color, alpha=0.25, linewidth=0,
                transform=axis.get_xaxis_transform(),
                label={2: "flying", 3: "sliding"}[number] if axis is axes[0] else None,
            )  # fmt: skip
        axis.grid(alpha=0.3)
    axes[0].plot(time, run["tank[1].ball.position[3]"], color=plot.COLORS[0])
    axes[0].set_ylabel("height of the liquid's centre\nin the tank, m")
    axes[0].legend(loc="upper right", fontsize=9)
    axes[0].set_title("Thrust 60 N, at 10 s −11.8 N, at 50 s 60 N again")
    axes[1].plot(time, run["velocity[3]"], color=plot.COLORS[0])
    axes[1].set_ylabel("velocity of the craft, m/s")
    gone = run["work"] - (run["energy"] - run["energy"].iloc[0])
    axes[2].plot(time, gone, color=plot.COLORS[0], label="work − change of energy")
    axes[2].plot(time, run["dissipated"], "--", color=plot.COLORS[1], label="dissipated")
    axes[2].set_ylabel("J")
    axes[2].set_xlabel("time, s")
    axes[2].legend(loc="upper left", fontsize=9)
    figure.savefig(picture, metadata={"Date": None, "Creator": None})
    changes = run[state.diff() != 0]
    print(changes[["time", "tank[1].ball.state", "dissipated"]].to_string(index=False))
    flying = run[(state == 2) & (time < RESUMED)]
    speed = flying["tank[1].ball.velocity[3]"].max()
    print(f"fastest {speed:.4f} m/s, {381.704 * speed:.1f} N·s")
    print(f"energy balance {np.ptp(gone - run['dissipated']):.1e} J")
    print(f"wrote {picture}")


if __name__ == "__main__":
    draw(PICTURE)
