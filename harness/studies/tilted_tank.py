"""Draws slosh frequencies of a cylinder over the tilt of its axis, book/tilted_tank.svg.

    PYTHONPATH=harness/python python3 harness/studies/tilted_tank.py

It needs gmsh, scikit-fem and matplotlib (``requirements.txt``). It computes three fills, each at
eleven angles between the tank's axis and gravity, in a minute.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import hubslosh

PICTURE = Path(__file__).resolve().parents[2] / "book" / "tilted_tank.svg"
RADIUS, HEIGHT = 0.1, 2.0  # m; the liquid does not reach the top at any tilt
DEPTHS = (0.5, 1.0, 2.0)  # depth of the liquid in the upright tank, radii
TILTS = np.linspace(0, 60, 11)  # degrees


def frequencies(depth: float, tilt: float) -> tuple[float, float]:
    """Return the lowest slosh frequencies (Hz) along the slope of the tank and across it."""
    angle = np.radians(tilt)
    found = hubslosh.liquid_modes(
        {"cylinder": {"radius": RADIUS, "height": HEIGHT}}, f"{100 * depth * RADIUS / HEIGHT}%",
        modes=4, specific_force=9.80665 * np.array([np.sin(angle), 0, np.cos(angle)]),
        resolution=10,
    )  # fmt: skip
    modes = found.modes.dropna(subset="direction")
    along = np.abs(modes["direction"]) < 45
    return float(modes[along]["frequency"].iloc[0]), float(modes[~along]["frequency"].iloc[0])


def main() -> None:
    mpl.rcParams["svg.hashsalt"] = "hubslosh"
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    for depth, color in zip(DEPTHS, ("#0072b2", "#d55e00", "#009e73"), strict=True):
        found = np.array([frequencies(depth, tilt) for tilt in TILTS])
        part = 100 * (found / found[0] - 1)
        axes.plot(TILTS, part[:, 0], color=color, label=f"depth {depth:g} R, along the slope")
        axes.plot(TILTS, part[:, 1], "--", color=color, label=f"depth {depth:g} R, across it")
        print(
            f"depth {depth:g} R, 60 degrees: {part[-1, 0]:.1f} % along, {part[-1, 1]:.1f} % across"
        )
    axes.set_xlabel("angle between the tank's axis and gravity, degrees")
    axes.set_ylabel("change of the slosh frequency, %")
    axes.set_title("An upright cylinder under tilt: the slower mode moves along the slope")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)
    figure.savefig(PICTURE, metadata={"Date": None, "Creator": None})
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
