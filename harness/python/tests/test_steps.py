"""Results are independent of the communication steps."""

from pathlib import Path

import numpy as np
import pytest
from conftest import drive

DURATION = 60  # s
KNOTS = np.arange(10 * DURATION + 1) / 10
"""Times of the corners of the torque, s; every run has communication points there."""
TORQUE = 0.05 * np.sin(2 * np.pi * 2.35 * KNOTS)
"""Torque at the knots, N·m, linear between them; its frequency is near the slosh frequency."""


def communication_points(cut: str) -> np.ndarray:
    """Return ascending times, s, at which steps end; all rows of the torque are among them.

    ``cut`` says how the time between two rows is divided.
    """
    if cut == "random":
        between = np.random.default_rng(1).uniform(0, DURATION, 1200)
        return np.union1d(KNOTS, between)
    steps = {"20 ms": 5, "5 ms": 20}[cut]
    return np.arange(len(KNOTS) * steps - steps + 1) / (10 * steps)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("friction", ["stribeck", "stribeck_smooth"])
@pytest.mark.parametrize("model", ["linear", "planar", "spherical", "liquid"])
def test_communication_steps_of_20_ms_5_ms_and_random_length_agree_within_the_tolerance(
    fmu: Path, model: str, friction: str, tolerance: float
) -> None:
    """A piecewise linear torque acts in three runs with different communication steps.

    At the corners of the torque, rate and angle differ by at most the solver's tolerance, relative
    to the maximum of each signal.
    """
    settings = {"slosh.model": model, "friction.model": friction}
    columns = ("theta", "omega", "slosh_angle", "slosh_angle_radial")
    runs = []
    for cut in ("20 ms", "5 ms", "random"):
        time = communication_points(cut)
        torque = np.interp(time, KNOTS, TORQUE)
        run = drive(fmu, time, torque, settings, tolerance=tolerance, columns=columns)
        at_knots = np.searchsorted(time, KNOTS - 1e-9)
        assert np.abs(time[at_knots] - KNOTS).max() < 1e-12
        runs.append({name: run[name][at_knots] for name in columns})
    for name in columns:
        largest = np.abs(runs[0][name]).max()
        for other in runs[1:]:
            assert np.abs(other[name] - runs[0][name]).max() <= tolerance * largest, name
