"""Linear controllers: compiled code, delays of any length, and margins confirmed by simulation."""

from collections.abc import Callable
from pathlib import Path

import control
import numpy as np
import pandas as pd
import pytest

import hubslosh
from hubslosh import FmuError, LinearModel, Loop, attitude, closed_loop, linearize, margins
from hubslosh.feedback import Linear

VISCOUS = {"friction.model": "viscous"}
PERIOD = 0.1  # s
GAINS = np.array([[0.4, 0.6]])  # N·m/rad, N·m·s/rad
OUTPUTS = ["theta", "omega", "slosh_angle"]


@pytest.fixture
def spacecraft(fmu: Path) -> Path:
    return fmu.with_name("Spacecraft.fmu")


def craft() -> dict[str, float]:
    """Return parameters of a craft under thrust with two tanks and slosh modes at about 0.1 Hz."""
    values = {"craft.mass": 650.0, "craft.Jxx": 180.0, "craft.Jyy": 150.0, "craft.Jzz": 160.0}
    values |= {"craft.Jxy": 4.0, "craft.Jxz": -3.0, "craft.r[3]": 0.0, "tanks": 2, "force[3]": 88.0}
    for tank, side in (("tank[1]", 0.7), ("tank[2]", -0.7)):
        values |= {
            f"{tank}.position[2]": side, f"{tank}.position[3]": -0.1, f"{tank}.modes": 1,
            f"{tank}.m_0": 50.0, f"{tank}.H_0": 0.0, f"{tank}.I_0": 1.5, f"{tank}.I_z": 1.5,
            f"{tank}.mass[1]": 30.0, f"{tank}.length[1]": 0.2, f"{tank}.hinge[1]": 0.0,
            f"{tank}.zeta[1]": 0.004, f"{tank}.g_ref": 0.1,
        }  # fmt: skip
    return values


def three_axes(model: Path) -> Loop:
    """Return the loop about three axes of `craft`, with a PD controller of quaternion and rate.

    The loop has a filter and a delay of 0.13 s.
    """
    w, J = 2 * np.pi * 0.03, np.diag([300.0, 170.0, 260.0])
    gains = np.hstack([2 * w**2 * J, 1.4 * w * J])
    smooth = control.ss(0.5 * np.eye(3), 0.5 * np.eye(3), np.eye(3), 0, PERIOD)
    return Loop(
        smooth * gains, PERIOD, model, craft(),
        measured=["q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]"],
        command=["torque[1]", "torque[2]", "torque[3]"], delay=0.13,
    )  # fmt: skip


def law_of(linear: Linear) -> Callable[[int, float, list[float]], list[float]]:
    """Return a linear controller as a Python function that stores its state."""
    A, B, C, D = (m.tolist() for m in (linear.A, linear.B, linear.C, linear.D))
    x = [0.0] * len(A)

    def row(total: float, coefficients: list[float], values: list[float]) -> float:
        for c, v in zip(coefficients, values, strict=True):
            total += c * v
        return total

    def command(cycle: int, time: float, measured: list[float]) -> list[float]:
        nonlocal x
        wanted, at = linear.reference[cycle].tolist(), linear.quaternion
        e = [r - v for r, v in zip(wanted, measured, strict=True)]
        if at is not None:
            q, r = ([values[i] for i in at] for values in (measured, wanted))
            sign = -1.0 if q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3] < 0 else 1.0
            e[at[1]] = sign * (q[0] * r[1] - q[1] * r[0] - q[2] * r[3] + q[3] * r[2])
            e[at[2]] = sign * (q[0] * r[2] + q[1] * r[3] - q[2] * r[0] - q[3] * r[1])
            e[at[3]] = sign * (q[0] * r[3] - q[1] * r[2] + q[2] * r[1] - q[3] * r[0])
        forward = linear.feedforward[cycle].tolist()
        u = [row(row(0.0, c, x), d, e) + f for c, d, f in zip(C, D, forward, strict=True)]
        x = [row(row(0.0, a, x), b, e) for a, b in zip(A, B, strict=True)]
        return u

    return command


def test_a_compiled_controller_is_bit_identical_to_the_controller_in_python(
    spacecraft: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A linear controller runs in compiled code; the same controller as a Python function agrees.

    The controller has three commands, six measurements among which is a quaternion, a filter with a
    state, and a reference; the run has substeps.
    """
    loop = three_axes(spacecraft)
    slew = attitude.slew(np.radians(30), 20, (1, 0.3, 0), inertia=np.diag([300.0, 170.0, 260.0]))
    external = pd.DataFrame({"time": [0.0, 15.0, 40.0], "force[1]": [0.0, 2.0, 0.0]})

    def run() -> pd.DataFrame:
        return loop.simulate(40, reference=slew, inputs=external, substeps=2)

    compiled = run()
    with monkeypatch.context() as patch:
        patch.setattr(hubslosh.loop, "Linear", lambda *matrices: law_of(Linear(*matrices)))
        pd.testing.assert_frame_equal(run(), compiled, check_exact=True)
    assert len(compiled) == 801 and compiled["time"].iloc[-1] == 40
    left = attitude.error(compiled, slew[[f"q[{i}]" for i in range(1, 5)]].to_numpy()[-1])
    assert np.degrees(np.linalg.norm(left.iloc[0])) == pytest.approx(30, abs=1e-6)
    # the liquid still moves, so that the attitude is reached only on average
    assert np.degrees(np.linalg.norm(left.iloc[-1])) < 1


def test_a_matrix_of_gains_acts_bit_identically_to_a_function(fmu: Path) -> None:
    """A matrix of gains is bit-identical to a function that adds the terms from left to right.

    A filter gives the same as its difference equation.
    """
    start = VISCOUS | {"init.slosh_angle": (5, "deg")}
    by_matrix = closed_loop(GAINS, PERIOD, 20, fmu, start, outputs=OUTPUTS)

    def law(time: float, y: np.ndarray) -> float:
        return 0.0 + 0.4 * (0 - y[0]) + 0.6 * (0 - y[1]) + 0.0

    by_function = closed_loop(law, PERIOD, 20, fmu, start, outputs=OUTPUTS)
    pd.testing.assert_frame_equal(by_matrix, by_function, check_exact=True)

    # the filter x' = 0.5 x + e, u = 0.3 x + 0.2 e of the rate, given in three forms
    parts = [np.array([[v]]) for v in (0.5, 1.0, 0.3, 0.2)]
    model = LinearModel(*parts, ("x",), ("e",), ("u",), PERIOD)
    x = 0.0

    def filtered(time: float, y: np.ndarray) -> float:
        nonlocal x
        u, x = 0.3 * x + 0.2 * -y[0], 0.5 * x + -y[0]
        return u

    runs = [
        closed_loop(c, PERIOD, 20, fmu, start, measured="omega", outputs=OUTPUTS)
        for c in (model, control.ss(*parts, PERIOD), filtered)
    ]
    pd.testing.assert_frame_equal(runs[0], runs[1], check_exact=True)
    pd.testing.assert_frame_equal(runs[0], runs[2], check_exact=True)
    assert runs[0]["slosh_angle"].abs().max() > 0.05


def test_a_continuous_controller_is_discretised_by_tustins_rule(fmu: Path) -> None:
    """The discrete controller equals the result of python-control, also for a state-space model."""
    lead = control.tf([0.6, 0.4], [0.05, 1])
    start = VISCOUS | {"init.slosh_angle": (5, "deg")}
    runs = [
        closed_loop(c, PERIOD, 20, fmu, start, measured=["theta"], outputs=OUTPUTS)
        for c in (lead, control.ss(lead), control.sample_system(lead, PERIOD, "tustin"))
    ]
    for run in runs[1:]:  # not bit-identical, because the states have other coordinates
        assert np.abs(run - runs[0]).max().max() < 1e-12
    # Tustin's rule moves a frequency; the discrete gain there equals the continuous gain
    loop = Loop(lead, PERIOD, fmu, VISCOUS, ["theta"])
    f = 2.0
    moved = np.arctan(np.pi * f * PERIOD) / (np.pi * PERIOD)
    found, expected = loop.linear().response(moved)[0, 0, 0], lead(2j * np.pi * f)
    assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("delay", [0.037, 0.1, 0.25])
def test_a_delay_of_any_length_is_exact_in_model_and_simulation(fmu: Path, delay: float) -> None:
    """Over 100 cycles with different torques the discrete model and the FMU agree.

    The FMU uses its linear slosh model and a tolerance of 1e-9.
    """
    model = linearize(fmu, VISCOUS, ["tau_cmd"], OUTPUTS).sampled(PERIOD, delay=delay)
    commands = 0.05 * np.sin(np.arange(100.0) ** 1.3)
    given = iter(commands)
    run = closed_loop(
        lambda time, _: next(given), PERIOD, 10, fmu, VISCOUS,
        delay=delay, outputs=OUTPUTS, tolerance=1e-9,
    )  # fmt: skip
    x = np.zeros(len(model.A))
    for row, u in zip(run[OUTPUTS].to_numpy(), commands, strict=False):
        assert np.abs(model.C @ x - row).max() < 1e-9
        x = model.A @ x + model.B[:, 0] * u
    assert run["omega"].abs().max() > 0.01
    if delay == PERIOD:
        given = iter(commands)
        late = closed_loop(
            lambda time, _: next(given), PERIOD, 10, fmu, VISCOUS,
            latency=1, outputs=OUTPUTS, tolerance=1e-9,
        )  # fmt: skip
        pd.testing.assert_frame_equal(run, late, check_exact=True)


def test_the_simulated_loop_becomes_unstable_at_the_delay_margin(fmu: Path) -> None:
    """With a tenth less delay than the margin the motion decays, with a tenth more it grows.

    The margin is not a whole number of cycles.
    """
    start = VISCOUS | {"init.slosh_angle": 0.001}
    found = margins(Loop(GAINS, PERIOD, fmu, VISCOUS, delay=0.04))
    assert found.stable and 0.5 * PERIOD < found.delay_margin < 0.8 * PERIOD
    last = []
    for part in (0.9, 1.1):
        delay = 0.04 + part * found.delay_margin
        run = closed_loop(GAINS, PERIOD, 60, fmu, start, delay=delay, outputs=["theta"])
        theta = run["theta"].abs()
        last.append(theta[-100:].max() / theta[100:300].max())
        assert margins(Loop(GAINS, PERIOD, fmu, VISCOUS, delay=delay)).stable == (part < 1)
    assert last[0] < 0.9 and last[1] > 1.1, last


def test_margins_of_a_spacecraft_name_the_tanks_whose_slosh_is_near_a_crossing(
    spacecraft: Path,
) -> None:
    """The crossings near slosh frequencies name both tanks and belong to the torque about z.

    About z the liquid moves because the tanks are off the axis.
    """
    found = margins(three_axes(spacecraft))
    near = found.crossings[found.crossings["near"] != ""]
    assert found.stable and set(near["loop"]) == {"torque[3]"}
    assert near["near"].str.startswith("slosh of tank 1, slosh of tank 2 (0.1").all()
    assert "slosh of tank 1" in str(found) and "closed loop: stable" in str(found)


def test_errors_of_a_loop_are_reported_in_words(fmu: Path, spacecraft: Path) -> None:
    """A wrong size, type, period or reference raises `FmuError` and never a `TypeError`."""
    loop = (GAINS, PERIOD, 1.0, fmu, VISCOUS)
    wrong = {
        "2 \\(theta, omega\\) and 1": lambda: closed_loop([[1.0]], *loop[1:]),
        "must be a function of time": lambda: closed_loop("pd", *loop[1:]),
        "sampled with 0.2 s, the loop with 0.1 s": lambda: closed_loop(
            control.ss([], [], [], GAINS, 0.2)
            * control.ss(0.5 * np.eye(2), np.eye(2), np.eye(2), 0, 0.2),
            *loop[1:],
        ),
        "an improper transfer function": lambda: closed_loop(
            control.tf([1, 0], [1]), *loop[1:], measured=["omega"]
        ),
        "is not specified": lambda: closed_loop(
            control.tf([1], [1, 0.5], True), *loop[1:], measured=["omega"]
        ),
        "pole at 2/period": lambda: closed_loop(
            control.tf([1], [1, -20]), *loop[1:], measured=["omega"]
        ),
        "delay must be a number of seconds from 0": lambda: closed_loop(*loop, delay=-0.1),
        "period must be a number of seconds from 1e-06 to 1e\\+06, not '10 Hz'": lambda: (
            closed_loop(GAINS, "10 Hz", *loop[2:])
        ),
        "must be names of variables, such as": lambda: closed_loop(*loop, outputs=3),
        "reference has thta, .*did you mean theta": lambda: closed_loop(
            *loop, reference=pd.DataFrame({"time": [0, 1], "thta": 0.0})
        ),
        "reference must be a pandas.DataFrame": lambda: closed_loop(*loop, reference={"theta": 1}),
        "a controller function computes its own reference": lambda: closed_loop(
            lambda t, y: 0.0, *loop[1:], reference=pd.DataFrame({"time": [0, 1], "theta": 0.0})
        ),
        "returned None at t = 0 s; it must return a finite number": lambda: closed_loop(
            lambda t, y: None, *loop[1:]
        ),
        "2 finite numbers \\(tau_cmd, tau_ext\\)": lambda: closed_loop(
            lambda t, y: 1.0, *loop[1:], command=["tau_cmd", "tau_ext"]
        ),
        "the loop gain needs a linear controller": lambda: margins(
            Loop(lambda t, y: 0.0, 0.1, fmu)
        ),
        "margins needs a Loop": lambda: margins(GAINS),
        "inputs must be a pandas.DataFrame": lambda: closed_loop(*loop, inputs=[1, 2]),
    }
    for sentence, call in wrong.items():
        with pytest.raises(FmuError, match=sentence):
            call()
    with pytest.raises(ZeroDivisionError):  # an exception of the controller is passed on
        closed_loop(lambda t, y: 1 / 0, *loop[1:])
    # a name means a list with this name
    assert list(closed_loop(*loop, outputs="omega")) == ["time", "tau_cmd", "omega"]


@pytest.mark.parametrize("delay", [0.0, 0.06, 0.1])
def test_the_closed_loop_of_the_loop_gain_predicts_the_simulated_motion(
    fmu: Path, delay: float
) -> None:
    """The closed loop of `Loop.gain` predicts angle and rate of the simulation over 100 cycles.

    One measurement, the acceleration, depends directly on the torque and is read before the new
    torque acts. The motion begins with a displaced liquid; the FMU uses its linear slosh model and
    a tolerance of 1e-9.
    """
    gains = np.array([[0.4, 0.6, 0.05]])  # of angle, rate and acceleration
    loop = Loop(gains, PERIOD, fmu, VISCOUS, ["theta", "omega", "omega_dot"], delay=delay)
    L = loop.gain()
    start = {"init.slosh_angle": 1e-3}
    run = loop.simulate(10, start, outputs=["theta", "omega"], tolerance=1e-9)
    x = np.zeros(len(L.A))
    x[L.states.index("slosh.q_tangential[1]")] = hubslosh.simulate(
        fmu, VISCOUS | start, stop=0.1, outputs=["slosh.q_tangential[1]"]
    ).iloc[0, 1]
    places = [L.states.index("theta"), L.states.index("omega")]
    for row in run[["theta", "omega"]].to_numpy():
        assert np.abs(x[places] - row).max() < 1e-9
        x = (L.A - L.B @ L.C) @ x
    assert run["theta"].abs().max() > 1e-5
