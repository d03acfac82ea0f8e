"""``python -m hubslosh``, error messages of the package, and parameter files."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import option

import hubslosh
from hubslosh import FmuError, Plant, read_parameters, simulate

PACKAGE = Path(__file__).resolve().parents[1]


def test_the_module_runs_the_commands_of_the_program(
    fmu: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """``python -m hubslosh run`` writes the results of `simulate`, and passes on the exit code."""
    table = pd.DataFrame({"time": np.arange(101) * 0.02})
    table["tau_cmd"] = 0.1 * np.sin(15 * table["time"])
    hubslosh.to_csv(table, tmp_path / "torque.csv")
    command = [sys.executable, "-m", "hubslosh", "run", "--fmu", fmu]
    command += ["--input", tmp_path / "torque.csv", "--out", tmp_path / "answer.csv"]
    options = ["--set", "slosh.model=spherical", "--set", "friction.model=none"]
    surroundings = os.environ | {"HUBSLOSH": str(option(request, "--hubslosh"))}
    for more, code in (options, 0), (["--set", "tank.height=1"], 1):
        done = subprocess.run(
            [*command, *more], capture_output=True, env=surroundings, check=False, cwd=PACKAGE
        )
        assert done.returncode == code, done.stderr
    ours = simulate(fmu, {"slosh.model": 4, "friction.model": 1}, table, outputs="omega")
    assert np.array_equal(pd.read_csv(tmp_path / "answer.csv")["omega"], ours["omega"])


def test_the_error_about_a_removed_name_names_its_replacement() -> None:
    """The error of a removed name contains its replacement."""
    with pytest.raises(AttributeError, match=r"'drive'; use hubslosh\.simulate instead"):
        _ = hubslosh.drive


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"tank.height": 0.1}, "no variable tank.height; did you mean tank.h"),
        ({"rho": 1000.0}, "no variable rho; did you mean fluid.rho"),
        ({"slosh.model": "conical"}, "slosh.model expects one of frozen (1), linear (2), planar"),
        ({"wheel.enabled": "yes"}, 'wheel.enabled expects true or false, not "yes"'),
        ({"hub.I": "heavy"}, 'hub.I expects a number, not "heavy"'),
        ({"hub.I": (1, 2, 3)}, "hub.I cannot be (1, 2, 3) (allowed: a number"),
        ({"tank.h": 0.0}, "tank.h"),
        ({"theta": 1.0}, "theta is computed"),
    ],
)
def test_wrong_settings_raise_a_one_sentence_error(
    fmu: Path, settings: dict, sentence: str
) -> None:
    """The error contains the FMU's own message if the FMU has given one."""
    with pytest.raises(FmuError) as told:
        Plant(fmu, settings)
    assert sentence in str(told.value)


def test_a_torque_that_is_not_a_number_is_refused(fmu: Path) -> None:
    """A NaN in the torque raises an error that names the input."""
    with pytest.raises(FmuError, match="tau_cmd"):
        simulate(fmu, inputs=pd.DataFrame({"time": [0, 1], "tau_cmd": [0, float("nan")]}))


def test_a_missing_fmu_raises_an_error_with_the_command_that_builds_it(tmp_path: Path) -> None:
    """The message contains the command that builds the FMU."""
    with pytest.raises(FmuError, match="pack builds it"):
        Plant(tmp_path / "none.fmu")


def test_a_file_of_parameters_equals_a_mapping(fmu: Path, tmp_path: Path) -> None:
    """TOML and SSV files of ``hubslosh tank --parameters`` give bit-identical results."""
    start = {"slosh.table.m_liq": 2.0, "slosh.table.mass[1]": 0.5, "slosh.table.length[1]": 0.05}
    start |= {"slosh.source": "table", "init.slosh_angle": 0.1}
    toml, ssv = tmp_path / "tank.toml", tmp_path / "tank.ssv"
    toml.write_text("\n".join(f'"{name}" = {value!r}' for name, value in start.items()))
    kinds = {float: "Real", str: "Enumeration"}
    rows = (
        f'<p:Parameter name="{name}"><p:{kinds[type(value)]} value="{value}"/></p:Parameter>'
        for name, value in start.items()
    )
    space = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    ssv.write_text(
        f'<p:ParameterSet xmlns:p="{space}" version="1.0" name="tank"><p:Parameters>'
        f"{''.join(rows)}</p:Parameters></p:ParameterSet>"
    )
    assert read_parameters(toml) == start == read_parameters(ssv)
    expected = simulate(fmu, start, stop=1)
    assert expected["omega"].abs().max() > 0.01
    for file in (toml, str(ssv)):
        assert simulate(fmu, file, stop=1).equals(expected)
    toml.write_text("a = [1]")
    with pytest.raises(FmuError, match="line 1: a cannot be a value of a parameter"):
        read_parameters(toml)
