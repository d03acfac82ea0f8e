"""The package as a program, and its errors."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from hubslosh import (
    FmuError,
    Plant,
    drive,
    read_parameters,
    read_table,
    simulate,
    write_table,
)

PACKAGE = Path(__file__).resolve().parents[1]


def test_the_program_drives_the_fmu_and_writes_a_table(fmu: Path, tmp_path: Path) -> None:
    """``python -m hubslosh`` reads a torque from a file and writes the results of `drive`."""
    time = np.arange(101) * 0.02
    torque, answer = tmp_path / "torque.csv", tmp_path / "answer.csv"
    write_table(torque, {"time": time, "tau_cmd": 0.1 * np.sin(15 * time)})
    command = [sys.executable, "-m", "hubslosh", "--fmu", fmu, "--input", torque, "--out", answer]
    options = ["--set", "slosh.model=spherical", "--set", "friction.model=none"]
    done = subprocess.run(
        [*command, *options], capture_output=True, text=True, check=False, cwd=PACKAGE
    )
    assert done.returncode == 0, done.stderr
    table = read_table(answer, ["time", "omega"])
    settings = {"slosh.model": 4, "friction.model": 1}
    assert np.array_equal(
        table["omega"], drive(fmu, time, 0.1 * np.sin(15 * time), settings)["omega"]
    )


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"tank.height": 0.1}, "no variable tank.height; did you mean tank.h"),
        ({"rho": 1000.0}, "no variable rho; did you mean fluid.rho"),
        (
            {"slosh.model": "conical"},
            "the allowed values are frozen, linear, planar, spherical, liquid",
        ),
        ({"wheel.enabled": "yes"}, "the allowed values are true and false"),
        ({"hub.I": "heavy"}, "hub.I cannot be 'heavy'"),
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
        drive(fmu, [0, 1, 2], [0, float("nan"), 0])


def test_a_missing_fmu_raises_an_error_with_the_command_that_builds_it(tmp_path: Path) -> None:
    """The message contains the command that makes the FMU."""
    with pytest.raises(FmuError, match="pack makes it"):
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


def test_the_program_never_replaces_its_input(fmu: Path, tmp_path: Path) -> None:
    """An output is refused if it is the input, also under another name of the same file."""
    torque, link = tmp_path / "torque.csv", tmp_path / "link.csv"
    torque.write_text("time,tau_cmd\n0,0\n1,0\n")
    link.symlink_to(torque)
    command = [sys.executable, "-m", "hubslosh", "--fmu", str(fmu), "--input", str(torque)]
    done = subprocess.run(
        [*command, "--out", str(link)], capture_output=True, text=True, check=False, cwd=PACKAGE
    )
    assert done.returncode == 1 and "it is the input" in done.stderr
    assert torque.read_text() == "time,tau_cmd\n0,0\n1,0\n"


def test_times_of_a_table_are_in_seconds(tmp_path: Path) -> None:
    """Dates and durations are converted by their type; integers in Parquet have no unit."""
    path = tmp_path / "a.parquet"
    ticks = np.arange(3) * 20
    for kind in ("duration[ms]", "timestamp[ms]", "time32[ms]"):
        time = pa.array(ticks).cast("int32" if kind == "time32[ms]" else "int64").cast(kind)
        pq.write_table(pa.table({"time": time, "omega": ticks}), path)
        assert read_table(path, ["time"])["time"].tolist() == [0.0, 0.02, 0.04]
        with pytest.raises(FmuError, match="omega holds"):
            pq.write_table(pa.table({"time": [0.0, 1.0, 2.0], "omega": time}), path)
            read_table(path, ["omega"])
    pq.write_table(pa.table({"time": ticks}), path)
    with pytest.raises(FmuError, match="their unit is not known"):
        read_table(path, ["time"])
