"""The numbers of the README are reproduced."""

import numpy as np
import pandas as pd
import pytest
from slew import ANGLE, DURATION, PROFILES, results, settling_time

SETTLED = {
    ("bang-stop-bang", "frozen"): 4.1,
    ("bang-stop-bang", "linear"): 6.3,
    ("bang-stop-bang", "spherical"): 13.3,
    ("smoothed", "frozen"): 4.8,
    ("smoothed", "linear"): 6.3,
    ("smoothed", "spherical"): 6.4,
}
"""Settling times, s."""

ERRORS = {
    ("bang-stop-bang", "frozen"): 0.0032,
    ("bang-stop-bang", "linear"): 0.0212,
    ("bang-stop-bang", "spherical"): 0.0230,
    ("smoothed", "frozen"): 0.0006,
    ("smoothed", "linear"): 0.0026,
    ("smoothed", "spherical"): 0.0038,
}
"""Largest pointing errors after the slew, deg."""


@pytest.fixture(scope="module")
def runs(fmu: str) -> dict[tuple[str, str], pd.DataFrame]:
    return results(fmu)


@pytest.mark.parametrize("name", PROFILES)
def test_angle_and_rate_of_a_slew_profile_are_integrals_of_its_acceleration(name: str) -> None:
    """Sums over steps of 0.1 ms agree with rate and angle to 1e-7, or to 5e-5 if it has jumps."""
    time = np.linspace(0, 6, 60001)
    angle, rate, acceleration = np.array([PROFILES[name](t) for t in time]).T
    step = time[1]
    rates = np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2) * step])
    angles = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2) * step])
    assert np.abs(rates - rate).max() < 1e-4 and np.abs(angles - angle).max() < 1e-7
    assert angle[-1] == ANGLE and np.all(angle[time >= DURATION[name]] == pytest.approx(ANGLE))


def test_settling_times_and_errors_have_the_numbers_of_the_readme(runs: dict) -> None:
    """The smoothed slew takes 1.2 s longer but has settled 7 s earlier."""
    settled = {key: round(settling_time(run, key[0]), 1) for key, run in runs.items()}
    assert settled == SETTLED
    errors = {
        key: round(np.degrees(run["error"][run["time"] > DURATION[key[0]]].abs().max()), 4)
        for key, run in runs.items()
    }
    assert errors == ERRORS


def test_liquid_keeps_its_direction_of_oscillation_in_space_while_the_hub_turns(runs: dict) -> None:
    """After the turn the liquid swings radially, which a planar model cannot reproduce."""
    end = runs["bang-stop-bang", "spherical"].query("time > 5")
    radial, tangential = (end[f"slosh_angle{s}"].abs().max() for s in ("_radial", ""))
    assert radial > 2 * tangential
    assert (runs["bang-stop-bang", "linear"]["slosh_angle_radial"] == 0).all()
