"""FMPy's function ``simulate_fmu``, as users call it."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import drive
from fmpy import read_model_description, simulate_fmu, simulation

STEP = 0.02  # s
TIME = np.arange(3001) * STEP


def tau(time: np.ndarray) -> np.ndarray:
    """Return a torque near the slosh frequency, N·m."""
    return 0.05 * np.sin(2 * np.pi * 2.4 * time)


def table(time: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """Return a torque history in the form that the documentation of fmpy shows."""
    return np.array(list(zip(time, torque, strict=True)), [("time", float), ("tau_cmd", float)])


def simulate(fmu: Path, **arguments) -> np.ndarray:
    """Simulate a minute from rest in steps of 20 ms, and return the rate, rad/s."""
    start = {"init.slosh_angle": 0} | arguments.pop("start_values", {})
    result = simulate_fmu(
        str(fmu),
        stop_time=60,
        output_interval=STEP,
        output=["omega"],
        start_values=start,
        **arguments,
    )
    here = np.searchsorted(result["time"], TIME - 1e-9)
    assert np.abs(result["time"][here] - TIME).max() < 1e-9
    return np.asarray(result["omega"])[here]


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest difference, relative to the largest value of ``b``."""
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.fixture
def repaired(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let fmpy's ``set_input_derivatives`` work with any number of inputs, not just nine."""

    class Input(simulation.Input):
        def __init__(self, *args, **kwargs) -> None:
            super().__init__(*args, **kwargs)
            self.continuous = [
                c._replace(derivatives=(c.values._type_ * len(c.vrs))()) for c in self.continuous
            ]

    monkeypatch.setattr(simulation, "Input", Input)


def test_of_the_three_fmus_only_hubslosh_moves_with_default_parameters(fmu: Path) -> None:
    """A user's first simulation shows a slosh angle of HubSlosh that spans at least 0.06 rad.

    SloshTank and Spacecraft stay at rest.
    """
    result = simulate_fmu(str(fmu))
    assert np.isfinite([list(row) for row in result]).all()
    assert 0.06 < np.ptp(result["slosh_angle"]) < 0.12
    for model, outputs in {"Spacecraft": ["omega", "slosh_force"], "SloshTank": ["force"]}.items():
        names = [f"{name}[{i}]" for name in outputs for i in (1, 2, 3)]
        result = simulate_fmu(str(fmu.with_name(f"{model}.fmu")), output=names, stop_time=5.0)
        assert not any(result[name].any() for name in names)


def test_held_inputs_of_fmpy_equal_those_of_the_harness(fmu: Path) -> None:
    """By default fmpy holds each value of a table over the step.

    Results differ only by rounding errors.
    """
    rate = drive(fmu, TIME, tau(TIME), hold=True)["omega"]
    assert difference(simulate(fmu, input=table(TIME, tau(TIME))), rate) <= 1e-9


def test_an_input_that_is_held_half_a_step_early_has_no_delay(fmu: Path) -> None:
    """The method of harness/hosts/fmpy_example.py leaves only errors of second order.

    An input that FMPy holds over steps of length H acts half a step late, which at the frequency ω
    is an error of ωH/2 = 0.15 of the torque. If each value is set half a step early, the
    fundamental of the torque is too small by (ωH)²/24 = 0.004. Within a step the torque is wrong by
    up to ωH/2 in both directions; this changes the rate by (ωH)²/8 = 0.011 of the rate of the hub
    alone, which is a few times the rate near the antiresonance.
    """
    fine = np.arange(60001) * 0.001
    exact = drive(fmu, fine, tau(fine))["omega"][::20]
    held = simulate(fmu, input=table(TIME, tau(TIME)))
    early = simulate(fmu, input=table(TIME - STEP / 2, tau(TIME)))
    assert 0.1 < difference(held, exact) < 0.3
    assert difference(early, exact) < 0.03


def test_fmpy_still_accepts_input_derivatives_only_for_nine_inputs(fmu: Path) -> None:
    """In fmpy 0.3.32, the latest version, ``set_input_derivatives`` needs exactly nine inputs.

    If this test fails, fmpy has been repaired: remove the fixture `repaired`, and recommend
    ``set_input_derivatives=True`` in fmpy_example.py and README.
    """
    with pytest.raises(ValueError, match="same size"):
        simulate(fmu, input=table(TIME, tau(TIME)), set_input_derivatives=True)


@pytest.mark.usefixtures("repaired")
def test_interpolated_inputs_of_fmpy_equal_those_of_the_harness(fmu: Path) -> None:
    """The fixture `repaired` makes fmpy pass slopes of the input to the FMU.

    If a communication point coincides with a row, fmpy passes the slope before the row. Therefore
    the rows are 1e-9 s early, so that fmpy passes the slope after the row; this makes the torque
    wrong by 1e-9 s · ω = 2e-8.
    """
    rate = drive(fmu, TIME, tau(TIME))["omega"]
    early = table(TIME - 1e-9, tau(TIME))
    assert difference(simulate(fmu, input=early, set_input_derivatives=True), rate) <= 1e-7


def test_fmpy_steps_to_jumps_of_the_input(fmu: Path) -> None:
    """The edges of a pulse lie between the output points, and fmpy ends a step at each edge."""
    edges = [(0.0, 0.0), (1.003, 0.0), (1.003, 0.05), (2.007, 0.05), (2.007, 0.0), (60.0, 0.0)]
    theirs = simulate(fmu, input=np.array(edges, [("time", float), ("tau_cmd", float)]))
    time = np.union1d(TIME, [1.003, 2.007])
    torque = np.where((time >= 1.003) & (time < 2.007), 0.05, 0.0)
    rate = drive(fmu, time, torque, hold=True)["omega"][np.isin(time, TIME)]
    assert difference(theirs, rate) <= 1e-9


def test_wrong_start_values_stop_the_simulation(fmu: Path) -> None:
    """A tank with the height tank.h = 0 is refused."""
    with pytest.raises(Exception, match="fmi2ExitInitializationMode"):
        simulate(fmu, start_values={"tank.h": 0})


def test_the_example_for_fmpy_runs(fmu: Path) -> None:
    """The documentation shows this example, harness/hosts/fmpy_example.py."""
    example = Path(__file__).resolve().parents[2] / "hosts" / "fmpy_example.py"
    done = subprocess.run(
        [sys.executable, str(example), str(fmu)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "largest rate 0.0" in done.stdout


def name_in_omsimulator(name: str) -> str:
    """Return the name by which OMSimulator 3 looks up a variable of ``model.root.fmu``.

    OMSimulator splits names at dots, and removes parts that occur in the path of the FMU.
    """
    return ".".join(part for part in name.split(".") if part not in ("model", "root", "fmu"))


def test_omsimulator_sets_the_spherical_model_by_names_that_it_accepts(fmu: Path) -> None:
    """OMSimulator cannot set the enumerations `slosh.model` and `friction.model`.

    Other parameters, of type Integer, choose the same models.
    """
    variables = read_model_description(str(fmu)).modelVariables
    lost = {v.name for v in variables if name_in_omsimulator(v.name) != v.name}
    assert lost == {"slosh.model", "friction.model"}
    items = next(v for v in variables if v.name == "slosh.model").declaredType.items
    spherical = next(int(item.value) for item in items if item.name == "spherical")

    def run(**start: float) -> np.ndarray:
        return simulate(fmu, start_values={"init.slosh_angle": 0.3, **start})

    by_kind = run(**{"slosh.kind": spherical, "friction.kind": 2})
    assert np.array_equal(by_kind, run(**{"slosh.model": spherical, "friction.model": 2}))
    assert difference(by_kind, run()) > 1e-3
