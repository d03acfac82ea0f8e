"""The statements of the README about the manoeuvre are true."""

import my_tank
import pytest
from my_tank import MY_TANK, compare, summary


def test_rigid_liquid_ends_at_rest_and_sloshing_liquid_does_not(fmu: str) -> None:
    """The numbers of the run with sloshing liquid are printed in the README.

    A rigid craft is at rest after the manoeuvre, except for rounding errors.
    """
    runs = compare(fmu)
    last = {liquid: run["omega"].iloc[-500:].abs().max() for liquid, run in runs.items()}
    assert last["frozen"] < 1e-12
    assert round(last["spherical"], 4) == 0.008
    assert "±59 millidegrees" in summary(runs)
    assert summary(runs).endswith("up to 5.8 mm")
    assert runs["frozen"]["slosh_angle"].abs().max() == 0.0
    assert MY_TANK["friction.model"] == "none"


def test_the_summary_reports_that_the_liquid_leaves_the_range_of_its_model(
    fmu: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a hundredth of the thrust, the wave is too large for the model."""
    monkeypatch.setattr(my_tank, "MY_TANK", MY_TANK | {"g_axial": 0.1})
    assert "out of range for" in summary(compare(fmu))
