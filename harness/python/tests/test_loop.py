"""The sampled linear model and the simulated closed loop: exactness and delay."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import drive

from hubslosh import FmuError, Loop, closed_loop, linearize, simulate

VISCOUS = {"friction.model": "viscous"}
PERIOD = 0.1  # s
OUTPUTS = ["theta", "omega", "slosh_angle"]


def command(time: float) -> float:
    """Return a torque, N·m, that jumps at the start of every control cycle."""
    return 0.05 * np.sin(3.0 * time) + 0.02 * np.cos(17.0 * time)


def test_the_sampled_model_is_exact_at_the_sampling_instants(fmu: Path) -> None:
    """Over 100 cycles with a torque delayed by two cycles, the sampled model and the FMU agree.

    The FMU uses its linear slosh model and a tolerance of 1e-9.
    """
    run = closed_loop(
        lambda time, _: command(time), PERIOD, 10, fmu, VISCOUS,
        latency=2, outputs=OUTPUTS, tolerance=1e-9,
    )  # fmt: skip
    model = linearize(fmu, VISCOUS, ["tau_cmd"], OUTPUTS).sampled(PERIOD, latency=2)
    assert model.states[-2:] == ("tau_cmd[-2]", "tau_cmd[-1]") and model.period == PERIOD
    A, B, C, D = model
    x = np.zeros(len(A))
    for k, row in enumerate(run[OUTPUTS].to_numpy()):
        assert np.abs(C @ x - row).max() < 1e-9
        x = A @ x + B[:, 0] * command(k * PERIOD)
    assert not D.any() and np.abs(run["omega"]).max() > 0.01
    # the frequency response equals the response of python-control, which must read the period
    f = np.array([0.5, 2.4])
    z = np.exp(2j * np.pi * f * PERIOD)
    assert np.allclose(model.to_control()(z)[1, 0], model.response(f)[:, 1, 0], rtol=1e-9)


def test_a_loop_equals_a_simulation_with_the_recorded_torques(fmu: Path) -> None:
    """A run with the recorded, held torques as input is bit-identical, for each slosh model."""
    parameters = {"slosh.model": "spherical", "init.slosh_angle": (5, "deg")}
    seen = []

    def law(time: float, measured: np.ndarray) -> float:
        seen.append((time, *measured))
        return -0.5 * measured[0] - 0.6 * measured[1]

    run = closed_loop(
        law, 0.02, 20, fmu, parameters, latency=1, outputs=["omega", "theta", "stuck"]
    )
    again = drive(
        fmu, run["time"], run["tau_cmd"], parameters, hold=True, columns=["omega", "theta"]
    )
    assert list(run) == ["time", "tau_cmd", "omega", "theta", "stuck"]
    assert run.attrs["units"]["tau_cmd"] == "N.m"
    for name in ("omega", "theta"):
        assert np.array_equal(run[name], again[name])
    # measured at the beginning of each cycle; commanded one cycle later
    assert np.array_equal(np.array(seen), run[["time", "theta", "omega"]][:-1])
    commands = -0.5 * run["theta"] - 0.6 * run["omega"]
    assert run["tau_cmd"][0] == 0
    assert np.array_equal(run["tau_cmd"][1:-1], commands[:-2])


def test_substeps_add_rows_and_other_inputs_are_interpolated_linearly(fmu: Path) -> None:
    """The inputs are a ramp of g_axial and an external torque; results agree to 1e-7."""
    inputs = pd.DataFrame(
        {"time": [0, 1.0, 3, 5], "tau_ext": [0, 0.02, -0.02, 0], "g_axial": [9.81, 9.81, 5, 5]}
    )

    def law(time: float, measured: np.ndarray) -> float:
        return -0.5 * measured[0] - 0.6 * measured[1]

    coarse, fine = (
        closed_loop(
            law, 0.1, 5, fmu, VISCOUS,
            inputs=inputs, substeps=substeps, outputs=["omega"], tolerance=1e-9,
        )
        for substeps in (1, 10)
    )  # fmt: skip
    assert len(coarse) == 51 and len(fine) == 501
    assert np.abs(fine["omega"][::10].to_numpy() - coarse["omega"].to_numpy()).max() < 1e-9
    assert fine["g_axial"].iloc[200] == pytest.approx((9.81 + 5) / 2, abs=1e-12)
    assert coarse["omega"].abs().max() > 1e-3


def test_all_errors_in_the_arguments_of_a_loop_are_reported_at_once(fmu: Path) -> None:
    """One message lists wrong names, signs and values."""
    inputs = pd.DataFrame({"time": [0.0, 1.0], "tau_cmd": [0.0, 0.0]})
    with pytest.raises(FmuError) as error:
        closed_loop(
            lambda time, measured: 0.0, -1, 10, fmu, {"friction.modal": "viscous"},
            latency=-1, substeps=0, outputs=["thta"], measured=["omga"], inputs=inputs,
        )  # fmt: skip
    for part in (
        "period must be a number of seconds from 1e-06", "latency must be", "substeps must be",
        "did you mean friction.model?", "did you mean theta?", "did you mean omega?",
        "inputs has tau_cmd, which the controller commands",
    ):  # fmt: skip
        assert part in str(error.value), part
    with pytest.raises(FmuError, match="allowed: at most 20000000"):
        closed_loop(lambda time, measured: 0.0, 1e-6, 1e6, fmu)
    with pytest.raises(FmuError, match="not an input of HubSlosh"):
        closed_loop(lambda time, measured: 0.0, 1, 10, fmu, command="omega")
    model = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"])
    with pytest.raises(FmuError, match="period must be"):
        model.sampled(0)
    with pytest.raises(FmuError, match="latency must be a whole number"):
        model.sampled(0.1, -1)
    with pytest.raises(FmuError, match="sampled already"):
        model.sampled(0.1).sampled(0.1)


def test_the_name_of_a_vector_stands_for_all_its_components(fmu: Path) -> None:
    """Loops, linear models and recorded outputs accept names such as ``omega``."""
    craft = fmu.with_name("Spacecraft.fmu")
    start = {"force[3]": 100.0, "init.omega[1]": 0.01}
    whole = Loop(np.eye(3), 0.1, craft, start, "omega", "torque")
    each = ["omega[1]", "omega[2]", "omega[3]"]
    parts = Loop(np.eye(3), 0.1, craft, start, each, ["torque[1]", "torque[2]", "torque[3]"])
    assert whole.names == parts.names and whole.problems() == []
    run = whole.simulate(1.0, outputs=["omega", "tank[1].p"])
    rods = [f"tank[1].p[{n},{i}]" for n in (1, 2, 3) for i in (1, 2, 3)]
    assert list(run)[4:] == [*each, *rods]
    assert run[each].equals(parts.simulate(1.0, outputs=each)[each])
    assert linearize(craft, start, "torque", "omega").outputs == tuple(each)
    assert linearize(fmu, VISCOUS, "tau_cmd", "omega").outputs == ("omega",)
    with pytest.raises(FmuError, match="did you mean omega"):
        linearize(craft, start, "torque", "omga")


@pytest.mark.parametrize("is_linear", [True, False])
def test_a_command_of_the_controller_is_added_to_the_constant_value_of_its_input(
    fmu: Path, *, is_linear: bool
) -> None:
    """A run with the recorded inputs as histories is bit-identical, also before the first command.

    The case is a gimballed engine: force[1], force[2] and torque[3] are commands, and the
    parameters contain a thrust along x and z and a torque about z.
    """
    craft = fmu.with_name("Spacecraft.fmu")
    start = {"force[1]": 12.0, "force[3]": 400.0, "torque[3]": 5.0, "init.omega[2]": 0.01}
    command = ["force[1]", "force[2]", "torque[3]"]
    gains = np.diag([-300.0, 300.0, 200.0])[[1, 0, 2]]
    law = gains if is_linear else lambda time, omega: -gains @ omega
    loop = Loop(law, 0.1, craft, start, "omega", command, latency=1, delay=0.04)
    run = loop.simulate(5, outputs="omega", substeps=5)
    assert run[command].iloc[0].tolist() == [12.0, 0.0, 5.0]
    first = int(np.flatnonzero((run[command] != run[command].iloc[0]).any(axis=1))[0])
    assert run["time"][first] == pytest.approx(0.14)
    inputs = run[["time", *command]]
    alone = {name: value for name, value in start.items() if name not in command}
    again = simulate(craft, alone, inputs, outputs="omega", hold=True)
    assert (again[["omega[1]", "omega[2]", "omega[3]"]] == run.iloc[:, 4:7]).all().all()
    assert run["omega[2]"].abs().max() > 0.005


def test_an_input_history_replaces_the_constant_value_of_the_input_in_a_loop(fmu: Path) -> None:
    """A throttled thrust replaces the constant thrust, unless both are given in one call."""
    craft = fmu.with_name("Spacecraft.fmu")
    start = {"force[3]": 400.0, "init.omega[2]": 0.01}
    loop = Loop(np.eye(3), 0.1, craft, start, "omega", "torque")
    thrust = pd.DataFrame({"time": [0.0, 1.0, 1.0, 2.0], "force[3]": [300.0, 300.0, 0.0, 0.0]})
    run = loop.simulate(2, inputs=thrust, outputs=["specific_force[3]", "mass"])
    along = (run["specific_force[3]"] * run["mass"]).to_numpy()
    assert along[[5, -1]] == pytest.approx([300.0, 0.0], abs=1.0)
    assert run["force[3]"].iloc[[0, -1]].tolist() == [300.0, 0.0]
    with pytest.raises(FmuError, match=r"force\[3\] is given twice, in parameters and in inputs"):
        loop.simulate(2, {"force[3]": 100.0}, inputs=thrust)
    with pytest.raises(FmuError, match=r"force\[3\] is given twice"):
        closed_loop(
            np.eye(3), 0.1, 2, craft, start, measured="omega", command="torque", inputs=thrust
        )
