"""The numbers of the README are reproduced: margins, slew, random runs, an unstable loop."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from spacecraft import TANK, after_slew, craft, full, loop, slew

import hubslosh


def test_the_script_is_as_short_as_its_readme_says() -> None:
    """The script contains all steps from the drawing of the tank to the pictures of the slew."""
    script = Path(__file__).with_name("spacecraft.py").read_text()
    assert len(script.splitlines()) <= 45


def test_margins_and_simulation_agree_that_a_long_delay_excites_slosh(spacecraft: str) -> None:
    """With a delay of 0.15 s the loop is stable; with 2 s it is unstable near slosh.

    Poles and simulation agree.
    """
    mine = replace(loop, model=spacecraft)
    found = hubslosh.margins(mine)
    near = found.crossings[found.crossings["near"].str.contains("slosh of tank 1, slosh of tank 2")]
    assert found.stable and set(near["loop"]) == {"torque[3]"}
    assert near["frequency"].to_numpy() == pytest.approx([0.100, 0.115], abs=0.002)
    assert found.phase_margin == pytest.approx(60.8, abs=0.5)
    assert found.delay_margin == pytest.approx(1.80, abs=0.05)
    rigid = {"craft.mass": craft["craft.mass"], "tanks": 2}
    for number, side in ((1, 0.6), (2, -0.6)):
        rigid |= full.parameters("Spacecraft", number, position=(0, side, -0.35), rigid=True)
    late = replace(mine, delay=2.0)
    assert not hubslosh.margins(late).stable
    assert hubslosh.margins(replace(late, parameters=craft | rigid)).stable
    run = late.simulate(400, reference=slew, outputs=["omega[3]"])
    swing = run["omega[3]"].to_numpy()[1000:]
    first, last = np.abs(swing[:1000]).max(), np.abs(swing[-1000:]).max()
    assert last > 1.3 * first
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(len(swing))))
    assert np.argmax(spectrum) / (len(swing) * 0.1) == pytest.approx(0.113, abs=0.006)


def test_monte_carlo_runs_have_the_results_that_the_readme_states(spacecraft: str) -> None:
    """The test repeats the nominal slew and six of the 200 random runs."""
    mine = replace(loop, model=spacecraft)
    nominal = after_slew({}, mine)
    assert nominal["error (deg)"] == pytest.approx(0.151, rel=0.03)
    assert nominal["settling (s)"] == pytest.approx(9.2, abs=0.5)
    table = hubslosh.monte_carlo(
        {"craft.Jzz": (80.0, 100.0)}, 6, 1, lambda values: after_slew(values, mine)
    )
    assert table["error (deg)"].between(0.1, 0.45).all() and table["error (deg)"].nunique() == 6


def test_modes_of_the_spherical_tank_equal_published_values() -> None:
    """In a sphere, all hinges are at the centre.

    For half a fill the first eigenvalue is 1.5602 (NASA SP-106, 2.15).
    """
    assert full.modes["hinge"][0] == pytest.approx(0.35, abs=1e-9)
    half = hubslosh.tank(TANK, fill="50%", modes=1, gravity=1.0)
    expected = np.sqrt(1.560157 / 0.35) / (2 * np.pi)
    assert half.modes["frequency"][0] == pytest.approx(expected, rel=1e-5)
