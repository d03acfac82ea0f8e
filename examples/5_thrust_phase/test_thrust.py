"""The numbers of the README are reproduced."""

import numpy as np
import pytest
from thrust import BANDWIDTHS, CRAFT, THRUST, decay, linear, run, slosh_pole

import hubslosh


def test_mass_frequencies_damping_and_bond_number_equal_the_readme(fmu: str) -> None:
    """The FMU computes mass, frequencies, damping and Bond number."""
    names = ["tank.m_liq", "slosh.frequency[1]", "slosh.damping[1]", "tank.bond"]
    with hubslosh.Plant(fmu, CRAFT | {"g_axial": THRUST}) as plant:
        mass, frequency, damping, bond = plant.get(names)
    assert mass == pytest.approx(4301, abs=1)
    assert frequency == pytest.approx(0.02337, abs=5e-6)
    assert damping == pytest.approx(0.00105, abs=5e-6)
    assert bond / 4 == pytest.approx(259.3, abs=0.05)
    assert linear(fmu).poles.imag.max() / (2 * np.pi) == pytest.approx(0.02390, abs=5e-6)


@pytest.mark.parametrize(
    ("name", "error", "rate"),
    [("below", 0.442, 2.11e-3), ("near", 0.18, 2.24e-3), ("above", 0.035, 3.05e-4)],
)
def test_the_linear_model_under_thrust_predicts_the_decay(
    fmu: str, name: str, error: float, rate: float
) -> None:
    """The decay of nonlinear pendulums that start at 5° agrees to 3 %.

    The decay is measured in windows of six periods.
    """
    predicted = -slosh_pole(fmu, BANDWIDTHS[name]).real
    assert predicted == pytest.approx(rate, rel=5e-3)
    table = run(fmu, BANDWIDTHS[name])
    assert decay(table) == pytest.approx(predicted, rel=0.03)
    assert round(np.degrees(table["theta"].abs().max()), 3) == error
