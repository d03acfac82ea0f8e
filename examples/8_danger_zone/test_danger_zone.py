"""The README's numbers: the danger zone, growth rates, and the damping that removes the zone."""

import pytest
from danger_zone import Craft, growth, predicted_zone, simulated_growth, zone

# Growth rates, 1/s, from an independent formulation of the craft in six axes; all digits of the
# FMU's growth rates agree.
GROWTH = {
    -1.60: -3.1726e-2, -0.45: -7.9994e-3, 0.14: 7.6250e-4, 0.20: 1.1911e-3, 0.50: 1.8675e-3,
    0.80: 4.5618e-4, 1.20: -3.2389e-3,
}  # fmt: skip


@pytest.mark.parametrize(("z", "expected"), GROWTH.items())
def test_poles_from_the_fmus_derivatives_equal_those_of_the_closed_form(
    spacecraft: str, z: float, expected: float
) -> None:
    """The closed form is of first order in the gains, and its error is 0.2 %."""
    craft = Craft(z)
    assert growth(spacecraft, craft) == pytest.approx(expected, rel=2e-5, abs=5e-8)
    assert craft.predicted_growth == pytest.approx(expected, rel=2.5e-3)


def test_the_danger_zone_of_tank_positions_ends_where_the_closed_form_predicts(
    spacecraft: str,
) -> None:
    """Both ends agree to 1 mm; they move by terms of second order in the gains."""
    assert zone(spacecraft) == pytest.approx(predicted_zone(), abs=1e-3)


@pytest.mark.parametrize("z", [-0.45, 0.5])
def test_the_simulated_growth_rate_of_slosh_equals_that_of_the_poles(
    spacecraft: str, z: float
) -> None:
    """The 10 ms cycle delays the torque by 5 ms, which changes the growth by 0.3 %."""
    found = simulated_growth(spacecraft, Craft(z))
    assert found == pytest.approx(growth(spacecraft, Craft(z)), rel=0.01)


def test_the_slosh_damping_required_for_stability_equals_the_prediction(spacecraft: str) -> None:
    """With 5 % more damping the loop is stable, with 5 % less it is unstable."""
    needed = Craft(0.5).damping_needed
    assert growth(spacecraft, Craft(0.5, zeta=0.95 * needed)) > 0
    assert growth(spacecraft, Craft(0.5, zeta=1.05 * needed)) < 0
