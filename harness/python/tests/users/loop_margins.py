"""Prints and draws the margins of an attitude loop at two fills."""

import numpy as np

import hubslosh
from hubslosh import plot

sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.8), modes=1, nu=0.9e-6)}
craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
gains = np.hstack([20 * np.eye(3), 80 * np.eye(3)])
for fill in ("30%", "60%"):
    loop = craft.loop(gains, 0.1, fill, delay=0.05)
    margins = hubslosh.margins(loop)
    print(margins.stable, margins.phase_margin, margins.crossings["frequency"].min())
axes = plot.margins(loop)
plot.save(axes[0].figure, "margins.png")
