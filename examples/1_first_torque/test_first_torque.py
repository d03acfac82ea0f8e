"""The numbers of the README are reproduced."""

import pytest
from first_torque import run


@pytest.mark.parametrize(
    ("model", "rate", "angle", "stopped"),
    [("frozen", 0.2139, 0.0, 13.24), ("spherical", 0.2142, 0.0105, 17.89)],
)
def test_a_torque_pulse_gives_the_results_that_the_readme_states(
    fmu: str, model: str, rate: float, angle: float, stopped: float
) -> None:
    """The simulation agrees in every digit that the README gives."""
    table = run(fmu, model)
    assert round(table["omega"].max(), 4) == rate
    assert round(table["slosh_angle"].abs().max(), 4) == angle
    assert round(table["time"][~table["stuck"]].max(), 2) == stopped


def test_under_constant_torque_the_mean_slosh_angle_is_quasi_static(fmu: str) -> None:
    """Over two periods the mean satisfies tan(angle) = -r omega_dot/g to 5 %."""
    table = run(fmu, "spherical").query("1 <= time < 1.83")
    lean = -0.225 * table["omega_dot"].mean() / 9.81
    assert table["slosh_angle"].mean() == pytest.approx(lean, rel=0.05)
