"""FMUs of FMI 3.0 give the same results as FMUs of FMI 2.0, mostly bit-identical ones."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import single_calls

from hubslosh import FmuError, Plant, RunError, closed_loop, linearize, simulate
from hubslosh.fmu import Fmu

STEP = 0.02  # s
TIME = np.arange(501) * STEP
INPUTS = {
    "HubSlosh": {"tau_cmd": 0.1 * np.sin(14.0 * TIME), "g_axial": 9.81 + 0.5 * np.sin(TIME)},
    "Spacecraft": {"torque[1]": 0.2 * np.sin(3.0 * TIME), "force[3]": 1.0 + 0.0 * TIME},
    "SloshTank": {
        "a[1]": 0.3 * np.sin(5.0 * TIME),
        "a[3]": 9.81 + 0.0 * TIME,
        # within a step the FMU integrates omega_dot, so that the host need not set omega
        "omega[2]": 0.1 * np.sin(4.0 * TIME),
        "omega_dot[2]": 0.4 * np.cos(4.0 * TIME),
    },
}
PARAMETERS = {
    "HubSlosh": {
        "slosh.model": "spherical",
        "init.slosh_angle": (10, "deg"),
        "imu.enabled": True,
        "wheel.enabled": True,
    },
    "Spacecraft": {
        "appendages": 2,
        "appendage[1].participation[2]": 9.0,
        "appendage[2].participation[6]": 6.0,
        "appendage[2].position[1]": 0.7,
        "appendage[2].eta_0": 0.2,
    },
    "SloshTank": {},
}


def three(fmu: Path, model: str = "HubSlosh") -> Path:
    """Return the FMI 3.0 version of a model, which lies next to its FMI 2.0 version ``fmu``."""
    return fmu.with_name(f"{model}-fmi3.fmu")


@pytest.mark.parametrize("model", INPUTS)
def test_held_inputs_give_results_that_are_bit_identical_to_fmi_2(fmu: Path, model: str) -> None:
    """All outputs and local variables agree in 501 rows, with parameters of every type."""
    inputs = pd.DataFrame({"time": TIME} | INPUTS[model])
    two = fmu.with_name(f"{model}.fmu")
    wanted = Fmu.open(two).names("output", "local")
    arguments = (PARAMETERS[model], inputs, None, None, wanted)
    first = simulate(two, *arguments, hold=True)
    second = simulate(three(fmu, model), *arguments, hold=True)
    pd.testing.assert_frame_equal(first, second, check_exact=True, obj=model)
    assert first.attrs["units"] == second.attrs["units"]
    assert any(first[name].nunique() > 100 for name in first.columns[1 + len(INPUTS[model]) :])
    if model == "HubSlosh":
        assert second["event_count"].iloc[-1] > 10 and second["stuck"].dtype == bool


@pytest.mark.parametrize("model", INPUTS)
def test_linear_inputs_are_passed_by_intermediate_update(fmu: Path, model: str) -> None:
    """FMI 3.0 has no function for slopes of inputs, so the host sets inputs within the step.

    The FMU computes the slope from two values; results agree with FMI 2.0 to 1e-11. Held inputs
    would differ by more than 1e-3.
    """
    inputs = pd.DataFrame({"time": TIME} | INPUTS[model])
    first = simulate(fmu.with_name(f"{model}.fmu"), None, inputs)
    second = simulate(three(fmu, model), None, inputs)
    held = simulate(three(fmu, model), None, inputs, hold=True)
    outputs = [name for name in first if first[name].dtype == float][1 + len(INPUTS[model]) :]
    worst = max(
        np.abs(held[name] - first[name]).max() / size for name, size in _sizes(first[outputs])
    )
    assert worst > 1e-3
    for name, size in _sizes(first[outputs]):
        assert np.abs(second[name] - first[name]).max() < 1e-11 * size, name


def _sizes(table: pd.DataFrame) -> list[tuple[str, float]]:
    """Return the largest value of each column that changes."""
    return [(name, np.abs(table[name]).max()) for name in table if table[name].any()]


def test_single_steps_and_saved_states_are_bit_identical_to_fmi_2(fmu: Path) -> None:
    """A second instance restores the saved state of the first one and continues bit-identically."""
    rows = []
    names = Fmu.open(fmu).names("output", "local")
    for path in (fmu, three(fmu)):
        with Plant(path, PARAMETERS["HubSlosh"]) as plant, Plant(path) as other:
            for k in range(100):
                plant.step((k + 1) * STEP, 0.1 * np.sin(k))
            saved = plant.save()
            for instance in (plant, other):
                instance.restore(saved)
                instance.step(101 * STEP, 0.05)
            assert plant.get(names) == other.get(names)
            rows.append(plant.get(names))
    assert rows[0] == rows[1]


def test_a_controller_in_the_loop_is_bit_identical_to_fmi_2(fmu: Path) -> None:
    """The loop has a latency of one cycle and a delay within a cycle."""
    first, second = (
        closed_loop(
            lambda _, y: -0.5 * y[0] - 0.6 * y[1], 0.1, 10, path, {"init.omega": 0.1},
            measured=["theta", "omega"], latency=1, delay=0.03,
        )
        for path in (fmu, three(fmu))
    )  # fmt: skip
    pd.testing.assert_frame_equal(first, second, check_exact=True)
    assert np.abs(first["omega"]).max() > 0.05


def test_errors_of_an_fmi_3_fmu_become_python_errors(fmu: Path) -> None:
    """A value out of range, a failed step and a failed initialisation raise errors of fmi3."""
    with pytest.raises(FmuError, match=r"fmi3.*tank\.h"):
        simulate(three(fmu), {"tank.h": -1.0}, stop=0.1)
    inputs = pd.DataFrame({"time": [0.0, 0.1, 0.2], "g_axial": [9.81, -1e9, 9.81]})
    with pytest.raises(RunError, match=r"fmi3SetFloat64 returned fmi3.*g_axial"):
        simulate(three(fmu), None, inputs, hold=True)
    with pytest.raises(FmuError, match=r"fmi3.*wheel\.speed_min"):
        linearize(three(fmu), {"wheel.speed_min": 500.0, "wheel.enabled": True})


@pytest.mark.parametrize("model", INPUTS)
def test_a_linear_model_is_bit_identical_to_fmi_2(fmu: Path, model: str) -> None:
    """All matrices and names agree, for a start in motion with parameters of every type.

    The functions for directional derivatives have different names in FMI 2.0 and 3.0, but the FMU
    computes the same derivatives.
    """
    moving = {
        "HubSlosh": {"friction.model": "viscous", "init.omega": 0.1, "tau_cmd": 0.02},
        "Spacecraft": {"init.omega[2]": 0.1, "force[3]": 100.0, "tank[1].p_0[1,1]": 0.2},
        "SloshTank": {"omega[2]": 0.1, "a[3]": 1.5, "tank.p_0[1,1]": 0.2},
    }[model]
    arguments = {"parameters": PARAMETERS[model] | moving, "all_states": True}
    first = linearize(fmu.with_name(f"{model}.fmu"), **arguments)
    second = linearize(three(fmu, model), **arguments)
    assert (first.states, first.inputs, first.outputs) == (
        second.states, second.inputs, second.outputs,
    )  # fmt: skip
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one, other) and one.any()
    some = {"inputs": second.inputs[0], "outputs": second.outputs[:2]}
    assert linearize(three(fmu, model), moving, **some).D.shape == (2, 1)


@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("model", INPUTS)
def test_a_run_in_one_compiled_call_is_bit_identical_to_single_calls(
    fmu: Path, model: str, hold: bool
) -> None:
    """A run in one compiled call equals a run that calls each function of the FMU from Python.

    Outputs of all types are compared; inputs are linear within steps.
    """
    inputs = pd.DataFrame({"time": TIME} | INPUTS[model])
    path = three(fmu, model)
    columns = Fmu.open(path).names("output", "local")
    whole = simulate(path, PARAMETERS[model], inputs, outputs=columns, hold=hold)
    single = single_calls(path, PARAMETERS[model], inputs, columns, hold)
    assert np.array_equal(whole.to_numpy(float), single.to_numpy(float))


@pytest.mark.parametrize(
    ("torque", "hold", "sentence"),
    [
        # a held input is NaN in one row: refused when it is set
        (np.where(np.arange(501) == 300, np.nan, 0.0), True, "fmi3SetFloat64 returned fmi3Discard"),
        # an interpolated input is NaN in one row: refused within the step that leads to this row
        (
            np.where(np.arange(501) == 301, np.nan, 0.0),
            False,
            "fmi3SetFloat64 returned fmi3Discard",
        ),
    ],
)
def test_a_run_that_stops_reports_the_time_and_keeps_its_rows(
    fmu: Path, torque: np.ndarray, hold: bool, sentence: str
) -> None:
    """The message names the function of FMI that failed, as with FMI 2.0."""
    slopes = None if hold else {"tau_cmd": np.append(np.diff(torque) / STEP, 0.0)}
    with Plant(three(fmu), torque=0.0) as plant, pytest.raises(RunError) as told:
        plant.run(TIME, {"tau_cmd": torque}, slopes, ["omega"])
    error = told.value
    assert str(error).startswith(f"the run stopped at t = 6.0 s: {sentence}: ")
    assert "tau_cmd" in str(error)
    assert len(error.columns["omega"]) == len(error.columns["time"]) == 301
