"""The numbers of the README are reproduced."""

import numpy as np
import pytest
from stiction import saturation, summary


def test_the_wheel_supplies_torque_until_it_reaches_its_speed_limit(fmu: str) -> None:
    """The wheel's torque is at most 0.26 N·m; its speed limit holds the hub below 0.77 rad/s."""
    runs = saturation(fmu)
    for name, torque, rate, late in (("any torque", 2.39, 1.44, 5.2), ("wheel", 0.26, 0.77, 6.4)):
        table = runs[name]
        error = np.degrees((table["theta"] - np.pi / 2).abs())
        assert round(table["tau_actuator"].abs().max(), 2) == torque
        assert round(table["omega"].max(), 2) == rate
        assert round(table["time"][error > 0.1].max(), 1) == late
    rpm = runs["wheel"]["wheel_speed"] * 30 / np.pi
    assert rpm.min() == pytest.approx(200, abs=1e-9) and rpm.max() <= 3000


def test_dry_friction_leaves_an_error_and_smoothed_friction_creeps(fmu: str) -> None:
    """The simulation agrees with every digit of the README's table."""
    table = summary(fmu).round(4)
    errors = table.drop(columns="stuck (%)").to_numpy()
    assert np.abs(errors - EXPECTED).max() < 1.5e-4
    stuck = table["stuck (%)"]
    assert stuck.loc["PD", "set-valued"] == pytest.approx(93.9, abs=0.2)
    assert (stuck.drop("set-valued", level=1) == 0).all()


EXPECTED = [
    [-0.1917, -0.1917, -0.1917],
    [0.0001, 0.0, 0.0],
    [-0.0315, -0.0035, 0.0],
    [-0.1860, -0.1793, -0.1569],
    [0.1338, -0.0006, -0.0007],
    [-0.0076, 0.0001, 0.0],
    [0.0353, -0.0217, -0.0004],
    [0.1328, -0.0035, -0.0186],
]
"""Errors in deg; rows: PD, then PID, each with the set-valued law and the smoothed laws."""
