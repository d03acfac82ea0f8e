"""Hosts agree, and the master that repeats steps keeps its tolerance.

`.ci/importers` compares libcosim, which needs a further package.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from one_loop import RECORDED, STEPS, TOLERANCE, adaptive, difference, exact, fixed, in_fmpy


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest) -> Path:
    path: Path = request.config.getoption("--folder")
    assert (path / "Controller.fmu").is_file(), "cargo run --release -p one-loop -- FMU dist"
    return path


@pytest.mark.parametrize(("name", "slopes"), [("held", False), ("slopes", True)])
def test_fmpy_and_the_harness_give_equal_results(
    fmu: str, folder: Path, name: str, slopes: bool
) -> None:
    """The guaranteed accuracy is 1e-9; with the same calls the results are bit-identical."""
    theirs = pd.read_csv(folder / f"loop_{name}.csv")
    assert len(theirs) == STEPS + 1 and list(theirs) == ["time", "tau", *RECORDED]
    assert theirs["omega"].abs().max() > 0.02
    assert difference(in_fmpy(folder, fmu, slopes), theirs) <= TOLERANCE


def test_slopes_of_the_inputs_change_the_result_of_coupled_fmus(folder: Path) -> None:
    """Results with and without slopes of the inputs differ by 20 %.

    Therefore two hosts can be compared only if both set slopes or neither does.
    """
    held, slopes = (pd.read_csv(folder / f"loop_{name}.csv") for name in ("held", "slopes"))
    assert difference(held, slopes) > 0.1


def test_the_error_of_fixed_steps_grows_as_their_square(fmu: str, folder: Path) -> None:
    """Half of 10 ms divides the error by 3.5, half of 5 ms by 3.8."""
    errors = []
    for step in (0.02, 0.01):
        rows, steps = fixed(fmu, folder, step)
        errors.append(np.abs(rows[:, 1:] - exact(fmu, rows[:, 0])).max())
        assert steps == round(80 / step)
    assert errors == pytest.approx([6.6e-4, 1.9e-4], rel=0.02)


def test_a_master_with_step_size_control_makes_half_as_many_steps(fmu: str, folder: Path) -> None:
    """The master makes 4,416 steps with the error of 8,000 fixed steps.

    Two thirds of its steps are rolled back or are half steps.
    """
    rows, steps = adaptive(fmu, folder, 1e-5)
    error = np.abs(rows[:, 1:] - exact(fmu, rows[:, 0])).max()
    assert error < 1.9e-4 and steps < 5000
    lengths = np.diff(rows[:, 0])
    assert lengths.max() > 8 * lengths.min() and rows[-1, 0] == 80
