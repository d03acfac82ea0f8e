"""The numbers of the README are reproduced: poles of the nutation, growth, the flat spin."""

import numpy as np
import pytest
from spinner import OBLATE, PROLATE, mean_growth, nutation, nutation_pole

from hubslosh import FmuWarning


def test_the_nutation_pole_equals_that_of_an_independent_formulation(spacecraft: str) -> None:
    """For the prolate craft, nine digits of the pole are known."""
    assert nutation_pole(spacecraft, PROLATE) == pytest.approx(0.002551418 + 0.468308812j, abs=1e-9)
    assert nutation_pole(spacecraft, OBLATE).real == pytest.approx(-0.0023893, abs=5e-8)


@pytest.mark.parametrize("j_zz", [PROLATE, OBLATE])
def test_nutation_grows_or_decays_at_the_rate_of_the_pole(spacecraft: str, j_zz: float) -> None:
    """The growth rates agree only within 2 %, because the nutation angle is not small.

    It also varies during a turn, because the craft is not symmetric.
    """
    found = mean_growth(nutation(spacecraft, j_zz, 500))
    assert found == pytest.approx(nutation_pole(spacecraft, j_zz).real, rel=0.02)


def test_without_slosh_the_nutation_angle_hardly_changes(spacecraft: str) -> None:
    """It changes by at most a hundredth of the change with slosh."""
    assert abs(mean_growth(nutation(spacecraft, PROLATE, 500, slosh=False))) < 2.5e-5


def test_the_prolate_craft_ends_in_a_flat_spin(spacecraft: str) -> None:
    """For a given angular momentum, the energy is smallest about the axis of greatest inertia.

    In the end, z is across this axis, and the slosh masses point outwards.
    """
    with pytest.warns(FmuWarning, match="leaves its range"):
        angle = np.degrees(nutation(spacecraft, PROLATE, 4000)["angle"].iloc[-1])
    assert angle == pytest.approx(90, abs=2)
