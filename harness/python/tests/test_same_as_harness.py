"""The package, fmpy and the program simulate the same motion of an FMU under the same torque."""

import itertools
import subprocess
import time as clock
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import COLUMNS, Harness, drive, option
from fmpy import extract, fmi2, read_model_description

import hubslosh
from hubslosh import TORQUE, FmuError, simulate

MODELS = ["frozen", "linear", "planar", "spherical", "liquid"]
FILLS = [0.05, 0.1]
"""Fills of Rubaga's thesis, m."""
AMPLITUDES = [0.0125, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25]
"""Torque amplitudes of the thesis, N·m."""
SWEEP = "exp-sweep:amplitude=0.1,f0=1.25,f1=3.5,duration=300"


STARTS = {"init.slosh_angle": 0.0}
"""Start values with which the FMU starts at rest, as in the package."""


def by_fmpy(
    fmu: Path, folder: Path, time: np.ndarray, torque: np.ndarray, settings: dict,
    tolerance: float | None = None, hold: bool = False,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Simulate an FMU with single calls of fmpy; the table is written to ``folder``.

    The torque is interpolated linearly between the rows or, with ``hold``, held.
    """
    description = read_model_description(str(fmu))
    variables = {v.name: v for v in description.modelVariables}
    plant = fmi2.FMU2Slave(
        guid=description.guid, modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=extract(str(fmu), str(folder)), instanceName="plant",
    )  # fmt: skip
    plant.instantiate()
    for name, value in (STARTS | settings).items():
        variable = variables[name]
        if isinstance(value, str):
            items = {item.name: int(item.value) for item in variable.declaredType.items}
            plant.setInteger([variable.valueReference], [items[value]])
        else:
            plant.setReal([variable.valueReference], [value])
    plant.setupExperiment(tolerance=tolerance, startTime=time[0], stopTime=time[-1])
    plant.enterInitializationMode()
    torque_in = [variables[TORQUE].valueReference]
    plant.setReal(torque_in, [torque[0]])
    plant.exitInitializationMode()
    seen = [variables[name].valueReference for name in COLUMNS]
    rows = [plant.getReal(seen)]
    for k, step in enumerate(np.diff(time)):
        plant.setReal(torque_in, [torque[k]])
        if not hold:
            plant.setRealInputDerivatives(torque_in, [1], [(torque[k + 1] - torque[k]) / step])
        plant.doStep(time[k], step)
        rows.append(plant.getReal(seen))
    plant.terminate()
    plant.freeInstance()
    return dict(zip(COLUMNS, np.transpose(rows), strict=True))


def shared(quick: set[tuple], *values: list) -> list:
    """Return all combinations of ``values`` as test cases; all except ``quick`` are long tests."""
    long = pytest.mark.long
    return [
        case if case in quick else pytest.param(*case, marks=long)
        for case in itertools.product(*values)
    ]


@pytest.mark.parametrize(
    ("model", "friction"),
    shared(
        {("liquid", "stribeck"), ("spherical", "stribeck_smooth")},
        MODELS,
        ["stribeck", "stribeck_smooth"],
    ),
)
def test_python_and_the_command_give_the_same_rate_in_a_sweep_of_five_minutes(
    fmu: Path, harness: Harness, tmp_path: Path, model: str, friction: str
) -> None:
    """Every host sets the same inputs, so that any difference is an error of a host.

    The tolerance is 1e-12 rad/s, which is 1e-11 of the largest rate.
    """
    settings = {"slosh.model": model, "friction.model": friction}
    flags = [f for name, value in settings.items() for f in ("--set", f"{name}={value}")]
    theirs = harness("--profile", SWEEP, "--step", "0.02", *flags)
    ours = drive(fmu, theirs["time"], theirs[TORQUE], settings)
    by_calls = by_fmpy(fmu, tmp_path, theirs["time"], theirs[TORQUE], settings)
    assert len(theirs["time"]) == 15001
    assert np.ptp(theirs["omega"]) > 0.05
    for name in COLUMNS:
        assert np.array_equal(ours[name], by_calls[name]), name
        assert np.abs(ours[name] - theirs[name]).max() <= 1e-12, name


@pytest.mark.long
@pytest.mark.parametrize(
    "sweep", list(itertools.product([*MODELS, "liquid"], FILLS, AMPLITUDES)), ids=str
)
def test_fmpy_and_the_program_agree_over_a_whole_sweep_of_the_thesis(
    fmu: Path, harness: Harness, tmp_path: Path, sweep: tuple[str, float, float]
) -> None:
    """The sweep takes 45 minutes at 50 Hz, with rotary slosh and breaking waves."""
    model, fill, amplitude = sweep
    settings = {"slosh.model": model, "tank.h": fill}
    flags = [f for name, value in settings.items() for f in ("--set", f"{name}={value}")]
    profile = f"exp-sweep:amplitude={amplitude},f0=1.25,f1=3.5,duration=2700"
    theirs = harness("--profile", profile, "--step", "0.02", *flags)
    assert len(theirs["time"]) == 135_001
    begin = clock.process_time()
    ours = by_fmpy(fmu, tmp_path, theirs["time"], theirs[TORQUE], settings)
    seconds = clock.process_time() - begin
    off = {name: float(np.abs(ours[name] - theirs[name]).max()) for name in COLUMNS}
    print(f"{sweep}: {seconds:.1f} s of CPU in fmpy, {off}")
    for name in COLUMNS:
        assert off[name] <= 1e-9, name


def test_python_and_the_command_give_the_same_rate_under_a_held_torque(
    fmu: Path, harness: Harness, tmp_path: Path
) -> None:
    """The torque is held between samples; step, tolerance, tank and start are not the defaults."""
    settings = {"slosh.model": "spherical", "tank.h": 0.05, "init.slosh_angle": 0.1}
    flags = [f for name, value in settings.items() for f in ("--set", f"{name}={value}")]
    profile = "pulse:amplitude=0.05,start=0.1,width=1,duration=20"
    theirs = harness(
        "--profile", profile, "--step", "0.005", "--tolerance", "1e-6", "--hold", *flags
    )
    ours = drive(fmu, theirs["time"], theirs[TORQUE], settings, tolerance=1e-6, hold=True)
    by_calls = by_fmpy(fmu, tmp_path, theirs["time"], theirs[TORQUE], settings, 1e-6, hold=True)
    assert np.array_equal(ours["omega"], by_calls["omega"])
    assert np.abs(ours["omega"] - theirs["omega"]).max() <= 1e-12


def test_a_torque_history_written_by_python_gives_the_same_run_of_the_program(
    fmu: Path, harness: Harness, tmp_path: Path
) -> None:
    """The program reads all digits that Python has written."""
    time = np.arange(1001) * 0.02
    torque = 0.05 * np.sin(2 * np.pi * 2.4 * time)
    ours = drive(fmu, time, torque)
    table = pd.DataFrame({"time": time, TORQUE: torque})
    for ending, write in (("csv", hubslosh.to_csv), ("parquet", hubslosh.to_parquet)):
        path = tmp_path / f"torque.{ending}"
        write(table, path)
        theirs = harness("--input", str(path))
        assert np.array_equal(theirs[TORQUE], torque)
        assert np.abs(ours["omega"] - theirs["omega"]).max() <= 1e-12


def pulses() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return times (s) and torques (N·m) of pulses that rows every 20 ms would miss."""
    close, closer = np.arange(401) * 0.005, np.arange(2001) * 0.001
    return {
        "30 ms on rows of 5 ms": (close, np.where(np.arange(401) % 50 < 6, 0.2, 0.0)),
        "8 ms at 1 kHz": (closer, np.where((closer > 0.3025) & (closer < 0.3105), 0.2, 0.0)),
        "49 Hz": (closer, 0.2 * np.sin(2 * np.pi * 49 * closer)),
        "uneven rows": (np.array([0, 0.0301, 0.0302, 1.0, 1.0, 1.7, 2.0]), np.eye(7)[3] - 0.2),
    }


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize(
    "step", [*(pytest.param(h, marks=pytest.mark.long) for h in (0.02, 0.005)), 0.0333]
)
@pytest.mark.parametrize("name", pulses())
def test_an_input_history_acts_the_same_in_python_and_on_the_command_line(
    fmu: Path, harness: Harness, tmp_path: Path, name: str, step: float, hold: bool
) -> None:
    """Times, inputs and outputs are bit-identical; the step only chooses the rows."""
    time, torque = pulses()[name]
    path = tmp_path / "in.parquet"
    table = pd.DataFrame({"time": time, TORQUE: torque})
    hubslosh.to_parquet(table, path)
    flags = ["--input", str(path), "--step", str(step), *(["--hold"] if hold else [])]
    theirs = harness(*flags)
    ours = simulate(fmu, inputs=table, step=step, hold=hold, outputs=list(COLUMNS))
    for column in ("time", TORQUE, *COLUMNS):
        assert np.array_equal(theirs[column], ours[column]), column
    assert np.abs(ours["omega"]).max() > 1e-4
    # if the result has the rows of the input, the solver makes other steps
    whole = simulate(fmu, inputs=table, hold=hold, outputs=["omega"], tolerance=1e-10)
    fine = simulate(fmu, inputs=table, step=step, hold=hold, outputs=["omega"], tolerance=1e-10)
    both = pd.merge_asof(fine, whole, on="time", tolerance=1e-9, direction="nearest").dropna()
    assert len(both) >= 2
    largest = np.abs(whole["omega"]).max()
    assert np.abs(both["omega_x"] - both["omega_y"]).max() <= 1e-8 * largest


@pytest.mark.parametrize("step", ["0.02", "0.007"])
@pytest.mark.parametrize(
    "profile",
    ["sine:frequency=50,duration=2", "pulse:start=0.005,width=0.01,duration=2",
     "lin-sweep:f0=1,f1=60,duration=2", "sine-noise:duration=2"],
)  # fmt: skip
def test_a_profile_written_as_a_table_gives_the_run_of_the_profile(
    fmu: Path, harness: Harness, request: pytest.FixtureRequest, tmp_path: Path,
    profile: str, step: str,
) -> None:  # fmt: skip
    """A table of ``hubslosh torque`` in Python gives exactly the results of ``run --profile``."""
    path = tmp_path / "torque.parquet"
    command = [option(request, "--hubslosh"), "torque", "--profile", profile]
    subprocess.run([*command, "--out", path, "--step", "0.02"], check=True, capture_output=True)
    table = pd.read_parquet(path)
    theirs = harness("--profile", profile, "--step", step)
    ours = simulate(fmu, inputs=table, step=float(step), outputs=list(COLUMNS))
    assert np.array_equal(theirs["time"], ours["time"])
    # with a step of 0.007 s, interpolation between rows gives other last digits
    exact = step == "0.02"
    for column in COLUMNS:
        off = np.abs(theirs[column] - ours[column]).max()
        assert off <= (0.0 if exact else 1e-6) * np.abs(ours[column]).max(), column
    assert np.abs(ours["omega"]).max() > 1e-4


def test_python_and_the_command_refuse_slopes_for_an_fmu_that_cannot_interpolate(
    fmu: Path, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Both give the same reason, and each names its own option for held inputs."""
    held = tmp_path / "held.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b'canInterpolateInputs="true"', b'canInterpolateInputs="false"')
            new.writestr(name, data)
    table = pd.DataFrame({"time": [0.0, 1.0], TORQUE: [0.1, 0.2]})
    table.to_csv(tmp_path / "in.csv", index=False)
    command = [option(request, "--hubslosh"), "run", "--fmu", held, "--out", tmp_path / "out.csv"]
    command += ["--input", tmp_path / "in.csv"]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    with pytest.raises(FmuError) as error:
        simulate(held, inputs=table)
    sentence = str(error.value)
    assert "HubSlosh cannot interpolate its inputs" in sentence and "with hold=True" in sentence
    assert sentence.replace("hold=True", "--hold") in said.stderr
    run = simulate(held, inputs=table, hold=True, step=0.02, outputs=["omega"])
    assert run.attrs["inputs"] == "held from row to row" and "before" in run.attrs["rows"]
    subprocess.run([*command, "--hold"], check=True, capture_output=True)
    assert np.array_equal(pd.read_csv(tmp_path / "out.csv")["omega"], run["omega"])
