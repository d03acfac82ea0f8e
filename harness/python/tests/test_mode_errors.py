"""Error of the slosh force over the number of slosh modes."""

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

import hubslosh
from hubslosh import modes

MASSES = np.array([0.7563, 0.02326, 0.00563])  # kg
OMEGAS = 2 * np.pi * np.array([2.3436, 4.0318, 5.1035])  # rad/s
ZETAS = np.array([0.01, 0.02, 0.05])


def test_the_impulse_response_equals_that_of_the_matrix_exponential() -> None:
    """The sum over modes equals C exp(A t) B of the thesis's state space (4.16 to 4.21)."""
    time = np.linspace(0, 3, 40)
    forces = modes.impulse(MASSES, OMEGAS, ZETAS, time)
    for force, m, w, z in zip(forces, MASSES, OMEGAS, ZETAS, strict=True):
        a = np.array([[0, 1], [-(w**2), -2 * z * w]])
        # the equation of x = l alpha is x'' = -2 zeta w x' - w^2 x - u
        exact = [
            (m * np.array([w**2, 2 * z * w]) @ scipy.linalg.expm(a * t) @ [0, -1]) for t in time
        ]
        # the tolerance allows rounding errors of exponentials with arguments up to 30
        np.testing.assert_allclose(force, exact, atol=1e-11 * m * w)


def test_mode_responses_equal_the_linearised_fmu(fmu: Path) -> None:
    """The response is from the acceleration of the tank to the force, with three modes."""
    settings = {"slosh.modes": 3, "friction.model": "none", "init.slosh_angle": 0.0}
    model = hubslosh.linearize(fmu, settings, "tau_cmd", ["F_tangential", "omega_dot"])
    with hubslosh.Plant(fmu, settings) as plant:
        names = ("slosh.mass", "slosh.frequency", "slosh.damping")
        values = plant.get([f"{name}[{n}]" for name in names for n in (1, 2, 3)])
        liquid, arm = plant.get(["tank.m_liq", "tank.r"])
    masses, frequencies, zetas = np.array(values).reshape(3, 3)
    grid = np.linspace(0.5, 6, 200)
    force, acceleration = model.response(grid)[:, :, 0].T
    with_modes = modes.mode_responses(masses, 2 * np.pi * frequencies, zetas, grid)
    mine = with_modes.sum(axis=0) - (liquid - masses.sum())
    np.testing.assert_allclose(force / (arm * acceleration), mine, rtol=1e-9)


def test_with_four_slosh_modes_the_impulse_response_has_an_error_of_one_per_cent(
    fmu: Path,
) -> None:
    """As in figure 4.4 of the thesis, four undamped modes deviate by less than 1 %.

    With the bench's damping the deviation is a little larger.
    """
    undamped = {"slosh.zeta_from_correlation": False, "slosh.zeta": 0.0}
    assert hubslosh.mode_errors(undamped, 3.5, fmu)["impulse"][4] < 0.01
    errors = hubslosh.mode_errors({"tank.h": 0.1}, 3.5, fmu)
    # at the impulse, the forces of the dampers, 2 zeta w m, add to the forces of the springs
    assert 0.01 < errors["impulse"][4] < 0.0105
    # errors decrease with every mode and end at 0
    assert (errors.diff().iloc[1:] < 0).all().all()
    assert (errors.iloc[-1] == 0).all()
    assert errors.attrs["needed"]["band"][0.05] == 1
    # the force of a mode after an impulse is proportional to m w; mode 2 is the largest left out
    ratio = 0.0302 * 4.0318 / 2.3436
    assert ratio < errors["impulse"][1] < 2 * ratio
    with pytest.raises(hubslosh.FmuError, match="the liquid cannot slosh"):
        hubslosh.mode_errors({"slosh.model": "frozen"}, fmu=fmu)
    with pytest.raises(hubslosh.FmuError, match="below=0"):
        hubslosh.mode_errors(below=0, fmu=fmu)
