"""fmpy's own simulation loop, as a user calls it."""

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
    """Return fmpy's input as its documentation shows it."""
    return np.array(list(zip(time, torque, strict=True)), [("time", float), ("tau_cmd", float)])


def simulate(fmu: Path, **arguments) -> np.ndarray:
    """Return the rate over a minute from rest in steps of 20 ms, rad/s."""
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


def test_with_default_parameters_only_hubslosh_moves(fmu: Path) -> None:
    """With default parameters the slosh angle of HubSlosh spans at least 0.06 rad within 20 s.

    SloshTank and Spacecraft stay at rest. This is what a user sees first in a simulation tool.
    """
    result = simulate_fmu(str(fmu))
    assert np.isfinite([list(row) for row in result]).all()
    assert 0.06 < np.ptp(result["slosh_angle"]) < 0.12
    for model, outputs in {"Spacecraft": ["omega", "slosh_force"], "SloshTank": ["force"]}.items():
        names = [f"{name}[{i}]" for name in outputs for i in (1, 2, 3)]
        result = simulate_fmu(str(fmu.with_name(f"{model}.fmu")), output=names, stop_time=5.0)
        assert not any(result[name].any() for name in names)


def test_held_inputs_of_fmpy_equal_those_of_the_harness(fmu: Path) -> None:
    """From a plain table, fmpy holds each value over the step.

    Results differ only by rounding.
    """
    rate = drive(fmu, TIME, tau(TIME), hold=True)["omega"]
    assert difference(simulate(fmu, input=table(TIME, tau(TIME))), rate) <= 1e-9


def test_held_input_half_a_step_early_has_no_delay(fmu: Path) -> None:
    """In harness/hosts/fmpy_example.py a held input that is set half a step early is not late.

    An input that FMPy holds over steps of length H acts half a step late, which at the frequency ω
    is an error of ωH/2 = 0.15 of the torque. If each value is set half a step early, only errors
    of second order are left. The fundamental of the torque is too small by (ωH)²/24 = 0.004.
    Within a step the torque is wrong by up to ωH/2 in both directions; this changes the rate by
    (ωH)²/8 = 0.011 of the rate of the hub alone, which is a few times the rate near the
    antiresonance.
    """
    fine = np.arange(60001) * 0.001
    exact = drive(fmu, fine, tau(fine))["omega"][::20]
    held = simulate(fmu, input=table(TIME, tau(TIME)))
    early = simulate(fmu, input=table(TIME - STEP / 2, tau(TIME)))
    assert 0.1 < difference(held, exact) < 0.3
    assert difference(early, exact) < 0.03


def test_fmpy_still_allocates_nine_derivatives(fmu: Path) -> None:
    """With fmpy 0.3.32, its latest, ``set_input_derivatives`` needs exactly nine inputs.

    When this fails, fmpy has been repaired: drop the fixture `repaired`, and let fmpy_example.py
    and README say ``set_input_derivatives=True``.
    """
    with pytest.raises(ValueError, match="same size"):
        simulate(fmu, input=table(TIME, tau(TIME)), set_input_derivatives=True)


@pytest.mark.usefixtures("repaired")
def test_interpolated_inputs_of_fmpy_equal_those_of_the_harness(fmu: Path) -> None:
    """The FMU's part of fmpy's interpolation is in order.

    Where a communication point meets a row, fmpy hands over the slope that ends there. Rows
    early by 1e-9 s make it the one that begins, and the torque wrong by 1e-9 s · ω = 2e-8.
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


def test_the_example_runs(fmu: Path) -> None:
    """The documentation contains this example."""
    example = Path(__file__).resolve().parents[2] / "hosts" / "fmpy_example.py"
    done = subprocess.run(
        [sys.executable, str(example), str(fmu)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "largest rate 0.0" in done.stdout


def heard_by_omsimulator(name: str) -> str:
    """Return what is left of a variable's name below ``model.root.fmu`` in OMSimulator 3.

    It splits names at points and takes away a part that is in its own path.
    """
    return ".".join(part for part in name.split(".") if part not in ("model", "root", "fmu"))


def test_omsimulator_sets_the_spherical_model_by_names_that_it_accepts(fmu: Path) -> None:
    """OMSimulator cannot set the enumerations `slosh.model` and `friction.model`.

    Other parameters, of type Integer, choose the same models.
    """
    variables = read_model_description(str(fmu)).modelVariables
    lost = {v.name for v in variables if heard_by_omsimulator(v.name) != v.name}
    assert lost == {"slosh.model", "friction.model"}
    items = next(v for v in variables if v.name == "slosh.model").declaredType.items
    spherical = next(int(item.value) for item in items if item.name == "spherical")

    def run(**start: float) -> np.ndarray:
        return simulate(fmu, start_values={"init.slosh_angle": 0.3, **start})

    by_kind = run(**{"slosh.kind": spherical, "friction.kind": 2})
    assert np.array_equal(by_kind, run(**{"slosh.model": spherical, "friction.model": 2}))
    assert difference(by_kind, run()) > 1e-3
