"""`simulate`: results equal those of fmpy and of single calls; errors name what is wrong."""

import _thread
import re
import signal
import subprocess
import threading
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import drive, option, single_calls
from fmpy import simulate_fmu

import hubslosh
from hubslosh import FmuError, FmuWarning, Plant, RunError, simulate, simulation

STEP = 0.02  # s
TIME = np.arange(3001) * STEP
TORQUE = 0.05 * np.sin(2 * np.pi * 2.4 * TIME)  # N·m, near the slosh frequency
TABLE = pd.DataFrame({"time": TIME, "tau_cmd": TORQUE})


def test_warnings_of_the_fmu_become_python_warnings(fmu: Path) -> None:
    """At a hundredth of g the FMU warns that surface tension matters; at 1 g it does not."""
    with pytest.warns(FmuWarning, match="the Bond number is 9.2"):
        simulate(fmu, {"g_axial": 0.1}, stop=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(fmu, stop=0.1)


def test_a_run_out_of_range_has_the_message_of_the_command(
    fmu: Path, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """The message has the reason, the share of the time, and the first time.

    The table has no additional columns.
    """
    started = {"init.slosh_angle": 0.5}
    run = simulate(fmu, started, stop=1, step=0.1, outputs="omega")
    command = [option(request, "--hubslosh"), "run", "--fmu", fmu, "--step", "0.1"]
    command += ["--profile", "zero:duration=1", "--set", "init.slosh_angle=0.5"]
    command += ["--out", tmp_path / "run.csv"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    (sentence,) = run.out_of_range
    assert f"the run left the range of its model: {sentence}\n" in said
    assert sentence.endswith("above 45 degrees (80.0 %, first at 0 s)")
    assert list(run) == ["time", "omega"] and run[run["time"] < 0.5].out_of_range == [sentence]
    assert simulate(fmu, stop=1, step=0.1).out_of_range == []
    kept = simulate(fmu, started, stop=1, step=0.1, outputs="limited_by_kind")
    assert list(kept) == ["time", "limited_by_kind"] and kept.out_of_range == [sentence]
    loop = hubslosh.Loop([[4.0, 2.0]], 0.1, model=fmu)
    assert len(loop.simulate(1, started, outputs=[]).out_of_range) == 1


def test_a_long_run_estimates_the_time_out_of_range_from_some_rows(fmu: Path) -> None:
    """The share of the time agrees to 0.5 % with the share in a run that reads every row."""
    started = {"init.slosh_angle": 0.5}
    shares = []
    for outputs in ("omega", ["omega", "limited_by_kind"]):
        (sentence,) = simulate(fmu, started, stop=60, step=0.02, outputs=outputs).out_of_range
        shares.append(float(re.findall(r"\(([\d.]+) %, first at 0 s\)", sentence)[0]))
    assert shares[0] == pytest.approx(shares[1], abs=0.5) and 0 < shares[1] < 100


def test_a_held_torque_gives_results_that_are_bit_identical_to_fmpy(fmu: Path) -> None:
    """With the same times and calls, outputs of all types agree in each of 3001 rows."""
    theirs = simulate_fmu(
        str(fmu), stop_time=60, output_interval=STEP,
        start_values={"slosh.model": 4, "init.slosh_angle": 0},
        input=np.array(list(zip(TIME, TORQUE, strict=True)), [("time", float), ("tau_cmd", float)]),
        output=["omega", "slosh_angle_radial", "omega_dot", "stuck", "regime", "event_count"],
    )  # fmt: skip
    columns = list(theirs.dtype.names)[1:]
    ours = simulate(fmu, {"slosh.model": "spherical"}, TABLE, outputs=columns, hold=True)
    assert list(ours) == ["time", "tau_cmd", *columns]
    # steps of fmpy end at 0.02 k or at a time of the table, which differ in the last digit
    assert np.abs(theirs["time"] - ours["time"]).max() < 1e-12
    assert ours["event_count"].iloc[-1] > 10 and ours["stuck"].dtype == bool
    for name in columns:
        assert np.array_equal(theirs[name], ours[name]), name


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("model", ["linear", "spherical"])
def test_a_run_in_one_compiled_call_is_bit_identical_to_single_calls(
    fmu: Path, model: str, hold: bool
) -> None:
    """Three inputs are held or linear; outputs of all types are listed in a mixed order."""
    inputs = TABLE.assign(tau_ext=0.01 * np.cos(3 * TIME), g_axial=9.81 + 0.5 * np.sin(TIME))
    columns = ["stuck", "omega", "regime", "tau_fluid", "event_count", "theta"]
    parameters, inputs = {"slosh.model": model}, inputs[:1001]
    whole = simulate(fmu, parameters, inputs, outputs=columns, hold=hold)
    single = single_calls(fmu, parameters, inputs, columns, hold)
    assert whole["stuck"].dtype == bool and whole["event_count"].dtype == np.intc
    assert whole["stuck"].any() and not whole["stuck"].all()
    assert np.array_equal(whole.to_numpy(float), single.to_numpy(float))


def test_a_step_that_does_not_fit_the_rows_of_the_input_does_not_change_results(fmu: Path) -> None:
    """The torque is linear between its rows, which are 20 ms apart, with steps of 50 ms and 7 ms.

    The allowed difference, 1e-9, is ten times the tolerance of the solver.
    """
    rows = simulate(fmu, inputs=TABLE, tolerance=1e-10, outputs=["theta", "omega"])
    for step in (0.05, 0.007):
        run = simulate(fmu, inputs=TABLE, step=step, tolerance=1e-10, outputs=["theta", "omega"])
        assert len(run) == np.ceil(60 / step - 1e-9) + 1
        assert run["time"].iloc[-1] == 60
        common = pd.merge_asof(run, rows, on="time", tolerance=1e-9, direction="nearest").dropna()
        assert len(common) > 80
        for name in ("theta", "omega"):
            difference = np.abs(common[f"{name}_x"] - common[f"{name}_y"]).max()
            assert difference <= 1e-9 * np.abs(rows[name]).max(), name


def test_two_rows_at_one_time_are_a_jump(fmu: Path) -> None:
    """A pulse whose edges are two rows at one time equals a pulse with held inputs."""
    jumps = pd.DataFrame(
        {"time": [0.0, 1.003, 1.003, 2.007, 2.007, 10.0], "tau_cmd": [0, 0, 0.05, 0.05, 0, 0]}
    )
    run = simulate(fmu, inputs=jumps, step=STEP, outputs=["omega"])
    time = np.union1d(run["time"], [1.003, 2.007])
    torque = np.where((time >= 1.003) & (time < 2.007), 0.05, 0.0)
    held = drive(fmu, time, torque, hold=True, columns=["omega"])["omega"]
    assert np.abs(run["omega"]).max() > 0.01
    assert np.array_equal(run["omega"], held[np.isin(time, run["time"])])


def test_without_inputs_a_run_follows_the_default_experiment_of_the_fmu(fmu: Path) -> None:
    """Start, stop and step are those of DefaultExperiment; the columns are the outputs."""
    run = simulate(fmu, {"init.slosh_angle": (10, "deg"), "tank.h": (50, "mm")})
    assert run["time"].iloc[-1] == 20 and len(run) == 1001
    assert run["slosh_angle"][0] == pytest.approx(np.radians(10), rel=1e-15)
    assert run.attrs["units"]["slosh_angle"] == "rad"
    same = simulate(fmu, {"init.slosh_angle": np.radians(10), "tank.h": 0.05})
    pd.testing.assert_frame_equal(run, same, rtol=1e-12, atol=1e-14)


def test_the_slope_of_a_torque_history_is_used(fmu: Path) -> None:
    """A file of ``hubslosh torque`` has slopes, which here differ from the differences of rows."""
    table = TABLE.assign(tau_slope=np.full(len(TIME), 0.25))[:501]
    ours = simulate(fmu, inputs=table, outputs=["omega"])
    theirs = drive(fmu, TIME[:501], TORQUE[:501], slope=table["tau_slope"], columns=["omega"])
    assert np.array_equal(ours["omega"], theirs["omega"])


def test_all_wrong_arguments_of_simulate_are_reported_at_once(fmu: Path) -> None:
    """One message lists wrong columns, parameters, units, outputs and times."""
    inputs = pd.DataFrame({"time": [0.0, 2.0, 1.0], "tau": [0.0, 0.0, 0.0], "g_axial": [9.0] * 3})
    parameters = {"tank.height": 1, "tank.h": (5, "inch"), "theta": 1.0, "slosh.model": "conical"}
    with pytest.raises(FmuError) as told:
        simulate(fmu, parameters, inputs, outputs=["omga", "omega", "omega"], step=-1.0)
    for words in (
        "no inputs of HubSlosh: tau (did you mean tau_",
        "inputs are tau_cmd, tau_ext, g_axial",
        "time in inputs goes back after row 1, 2.0 s",
        "no variable tank.height; did you mean tank.h",
        'tank.h has no unit "inch" (allowed: m, mm)',
        "theta is computed by the FMU (output)",
        "slosh.model expects one of frozen (1), linear (2), planar (3), spherical (4), liquid (5)",
        "no variable omga; did you mean omega",
        "omega is named twice",
        "step must be a positive number of seconds, not -1.0",
    ):
        assert words in str(told.value)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"inputs": pd.DataFrame({"tau_cmd": [0.0, 1.0]})}, "inputs has no column named time"),
        ({"inputs": TABLE[:1]}, "two rows or more, not 1"),
        ({"inputs": TABLE.assign(tau_cmd=np.nan)}, "tau_cmd of inputs is not finite in row 0"),
        ({"inputs": TABLE, "parameters": {"tau_cmd": 1.0}}, "tau_cmd is given twice"),
        ({"stop": -1.0}, "stop must be later than start"),
        ({"tolerance": 0.0}, "tolerance must be a positive number"),
        ({"parameters": {"slosh.modes": 1.5}}, 'expects a whole number, not "1.5"'),
        # as a C int, these numbers would lose all but their last 32 bits
        ({"parameters": {"slosh.modes": 2**32 + 1}}, "from -2147483648 to 2147483647"),
        ({"parameters": {"imu.seed": 2**31}}, "from -2147483648 to 2147483647"),
        (
            {"parameters": {"slosh.modes": float("inf")}},
            'slosh.modes expects a whole number, not "inf"',
        ),
        ({"parameters": {"slosh.model": 2**32 + 2}}, "expects one of frozen (1), linear (2)"),
        ({"parameters": {"tank.h": float("nan")}}, "tank.h expects a finite number, not NaN"),
        ({"stop": 1e12}, "rows (allowed: at most 20000000)"),
        ({"step": 1e-300}, "rows (allowed: at most 20000000)"),
        ({"parameters": {"tank.h": 0.0}}, "tank.h"),
    ],
)
def test_wrong_arguments_raise_a_one_sentence_error(
    fmu: Path, arguments: dict, sentence: str
) -> None:
    """Each call has one wrong argument."""
    with pytest.raises(FmuError) as told:
        simulate(fmu, **arguments)
    assert sentence in str(told.value)


def test_the_limit_of_rows_equals_that_of_the_command_line() -> None:
    """The constant in Python equals the constant in the Rust source of the program."""
    budget = Path(__file__).parents[2] / "files" / "src" / "budget.rs"
    assert f"pub const ROWS: usize = {simulation.MOST_ROWS:_};" in budget.read_text()


def test_a_run_that_stops_reports_the_time_and_keeps_its_rows(fmu: Path) -> None:
    """The FMU refuses a NaN in row 500; the 501 rows up to this row are kept."""
    torque = TORQUE.copy()
    torque[500] = np.nan
    with Plant(fmu, torque=0.0) as plant, pytest.raises(RunError) as told:
        plant.run(TIME, {"tau_cmd": torque}, None, ["omega"])
    error = told.value
    assert str(error).startswith("the run stopped at t = 10.0 s: fmi2SetReal returned fmi2Error: ")
    assert "tau_cmd" in str(error)
    assert error.time == 10.0
    assert len(error.columns["omega"]) == len(error.columns["time"]) == 501
    good = drive(fmu, TIME[:501], TORQUE[:501], hold=True)["omega"]
    assert np.array_equal(error.columns["omega"], good)


def test_an_unknown_model_raises_an_error_with_suggestions(tmp_path: Path) -> None:
    """An FMU is opened by name and by file; a file that is not an FMU is refused."""
    with pytest.raises(FmuError, match='no FMU "HubSlush" here'):
        simulate("HubSlush")
    with pytest.raises(FmuError, match="pack builds it"):
        simulate(tmp_path / "none.fmu")
    (tmp_path / "text.fmu").write_text("no zip")
    with pytest.raises(FmuError, match="is not an FMU: the file is not a zip archive"):
        simulate(tmp_path / "text.fmu")


def test_inputs_may_be_in_their_display_units(fmu: Path) -> None:
    """A torque in mN·m, with its slope, equals the torque in N·m.

    The table that a run returns can be the input of another run.
    """
    short = TABLE[:501].assign(tau_slope=np.append(np.diff(TORQUE[:501]) / STEP, 0.0))
    scaled = short.assign(tau_cmd=1e3 * short["tau_cmd"], tau_slope=1e3 * short["tau_slope"])
    scaled.attrs["units"] = {"time": "s", "tau_cmd": "mN.m"}
    ours = simulate(fmu, inputs=short, outputs=["omega"])
    # the tolerance allows the rounding error of the division by 1000
    assert (
        np.abs(simulate(fmu, inputs=scaled, outputs=["omega"])["omega"] - ours["omega"]).max()
        < 1e-14
    )
    again = simulate(fmu, inputs=ours[["time", "tau_cmd"]], outputs=["omega"])
    assert np.abs(again["omega"] - ours["omega"]).max() < 1e-12
    scaled.attrs["units"] = {"tau_cmd": "lbf.ft"}
    with pytest.raises(
        FmuError, match=r"unit of tau_cmd in inputs: the variable has no unit lbf.ft .*mN.m"
    ):
        simulate(fmu, inputs=scaled)


LONG = np.arange(3_000_001) * STEP
"""Times of a run that takes some seconds of CPU time, s."""


def test_an_interrupt_stops_a_running_simulation(fmu: Path) -> None:
    """The case is a long run of a hub without friction, which never sticks."""
    turning = {"slosh.model": "frozen", "friction.model": "none", "init.omega": 1.0}
    # restore the default handler, because background processes of a shell ignore SIGINT
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with Plant(fmu, turning) as plant:
            threading.Timer(0.1, _thread.interrupt_main).start()
            with pytest.raises(KeyboardInterrupt):
                plant.run(LONG, {}, None, ["theta"])
            assert 0 < plant.get(["theta"])[0] < LONG[-1] / 2
    finally:
        signal.signal(signal.SIGINT, handler)


def test_other_python_threads_run_during_a_simulation(fmu: Path) -> None:
    """While one thread simulates, the main thread counts, so that the GIL must be released."""
    with Plant(fmu) as plant:
        run = threading.Thread(target=plant.run, args=(LONG[:300_001], {}, None, ["theta"]))
        run.start()
        count = 0
        while run.is_alive():
            count += 1
    assert count > 1000


def test_an_unknown_fmu_name_is_refused_with_the_fmus_that_exist(
    fmu: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The message lists the FMUs that exist, and has the command that builds the FMU."""
    names = ("HubSlosh", "Spacecraft", "Spacecraft-fmi3")
    (tmp_path / "fmus").mkdir()
    for name in names:
        (tmp_path / "fmus" / f"{name}.fmu").touch()
    monkeypatch.setattr(hubslosh.fmu, "__file__", str(tmp_path / "fmu.py"))
    monkeypatch.setattr(hubslosh.fmu, "source_tree", lambda: None)
    for name in names:
        assert hubslosh.fmu_path(name) == tmp_path / "fmus" / f"{name}.fmu"
    with pytest.raises(FmuError, match=", ".join(names)):
        hubslosh.simulate("Spacecraft_3x2")
    with pytest.raises(FmuError, match="did you mean HubSlosh"):
        hubslosh.fmu_path("Hubslosh")
    with pytest.raises(FmuError, match=r"pack --model SloshTank --fmi 3$"):
        hubslosh.fmu_path("SloshTank-fmi3")
    with pytest.raises(FmuError, match=r"pack --model SloshTank --fmi 3 --arrays$"):
        hubslosh.fmu_path("SloshTank-fmi3-arrays")
