"""The validators of FMPy and of ``hubslosh check`` find no problems in the FMU."""

import subprocess
import sys
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu


def test_the_validator_of_fmpy_finds_no_problems(fmu: Path) -> None:
    """FMPy checks schema, names, model structure, start values, causalities and units."""
    assert validate_fmu(str(fmu)) == []


@pytest.mark.long
def test_the_command_hubslosh_check_finds_no_problems(fmu: Path) -> None:
    """The test calls ``hubslosh check`` as a user does."""
    command = [sys.executable, "-m", "fmpy", "validate", str(fmu)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "No problems found."), done.stderr
