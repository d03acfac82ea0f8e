"""Features by the harness equal features by an independent analysis of the same stored runs."""

import csv
import functools
import subprocess
from pathlib import Path

import pytest

import check_analysis
from check_analysis import TOLERANCES

# Sweeps around antiresonance and resonance, about as slow as in the thesis; with 0.16 N·m the slosh
# becomes rotary.
PLAN = """
title = "For the analysis"
profile = "exp-sweep:f0=2.1,f1=2.8,duration=800"
[set]
imu.enabled = true
[vary]
slosh.model = ["linear", "spherical"]
profile.amplitude = [0.025, 0.16]
[count]
imu.seed = 1
"""


# cache the results, because both tests analyse the same four runs
analyse = functools.cache(check_analysis.analyse)


@pytest.fixture(scope="module")
def campaign(program: Path, fmu: Path, tmp_path_factory) -> Path:
    """Return the directory of a campaign of four short sweeps."""
    directory = tmp_path_factory.mktemp("analysis")
    (directory / "plan.toml").write_text(PLAN, encoding="utf-8")
    command = [program, "campaign", "--plan", "plan.toml", "--fmu", fmu, "--out", "out"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return directory / "out"


def test_every_feature_is_reproduced_from_its_definition(campaign: Path) -> None:
    """NumPy and SciPy reproduce the features of linear and rotary slosh within tolerances."""
    assert check_analysis.compare(campaign, analyse) == []
    with (campaign / "features.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    # all features exist, also those of rotary slosh
    turning = rows[-1]
    assert [turning[column] for column in TOLERANCES if turning[column] == ""] == []
    assert rows[0]["rotary_from_hz"] == ""


def test_a_wrong_number_in_a_campaigns_features_is_detected(campaign: Path) -> None:
    """The check finds an antiresonance that is 4 mHz wrong, and one that is missing."""
    path = campaign / "features_spa.csv"
    text = path.read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    rows[0]["f_dip_hz"] = str(float(rows[0]["f_dip_hz"]) + 4e-3)
    rows[1]["f_res_hz"] = ""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    differences = check_analysis.compare(campaign, analyse)
    path.write_text(text, encoding="utf-8")
    assert len(differences) == 2, differences
    assert "f_dip_hz" in differences[0] and "f_res_hz is empty" in differences[1]
