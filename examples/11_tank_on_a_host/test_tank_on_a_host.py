"""The numbers of the README for the two FMUs in Python are reproduced, and the SSP is valid.

libcosim and Basilisk are not tested, because they need further packages.
"""

import zipfile
from pathlib import Path

import pytest
from fmpy.ssp.ssd import read_ssd
from tank_on_a_host import STEPS, coupled, error, pack_ssp, simulate_whole

from hubslosh import FmuWarning


@pytest.fixture
def both(spacecraft: str) -> Path | None:
    """Return the folder of the FMUs, or None to use the FMUs of the package."""
    return Path(spacecraft).parent if spacecraft.endswith(".fmu") else None


def test_the_error_of_lumped_coupling_is_proportional_to_the_step(both: Path | None) -> None:
    """The error is proportional to the step, for a tumbling craft that is lighter than its tank."""
    reference = simulate_whole(both)
    errors = [error(coupled(both, step), reference) for step in STEPS[:3]]
    assert errors == pytest.approx([4.5e-4, 2.2e-4, 1.1e-4], rel=0.03)


def test_coupling_a_light_craft_by_total_force_and_torque_diverges(both: Path | None) -> None:
    """With steps of 20 ms the run diverges within a second, until a pendulum is upside down."""
    with pytest.warns(FmuWarning, match="leaves its range"):
        assert coupled(both, STEPS[1], wrench=True)["time"].iloc[-1] < 1.0


def test_the_ssp_file_is_valid_and_contains_both_fmus(both: Path | None, tmp_path: Path) -> None:
    """Fmpy validates the file. Nine signals go from craft to tank, and six from tank to craft."""
    archive = tmp_path / "TankOnHost.ssp"
    pack_ssp(both, archive, 0.02)
    system = read_ssd(str(archive), validate=True).system
    assert len(system.connections) == 15
    names = zipfile.ZipFile(archive).namelist()
    assert {"resources/Spacecraft.fmu", "resources/SloshTank.fmu"} <= set(names)
