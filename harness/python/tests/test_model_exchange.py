"""fmpy integrates the FMU's equations itself: what comes out is what Co-Simulation gives."""

from pathlib import Path

import numpy as np
import pytest
from conftest import drive
from fmpy import simulate_fmu

STEP = 0.02  # s
TIME = np.arange(1001) * STEP  # 20 s
HELD = 25  # rows between two changes of the torque
SIGNALS = {
    "theta": 1e-6,
    "omega": 1e-6,
    "slosh_angle": 1e-6,
    "slosh_angle_radial": 1e-6,
    "slosh_rate": 1e-5,
    "heat": 1e-6,
    "work": 1e-6,
}
"""Compared variables and their tolerances, SI.

fmpy gives CVODE a tolerance of 1e-9 times the present value and 1e-9 times the nominal one
(1e-11 to 1e-12 for the liquid) for each of the 1,000 to 10,000 steps of 20 s, and most errors of
an oscillation that is hardly damped stay: a few hundred times as much comes together. On the
bench's own motions that is below 1e-6 everywhere. A liquid that swings with 5 rad/s is given
5e-9 rad/s at each step, and its rate is off by up to 7e-6.
"""
MODELS = {"frozen": 1, "linear": 2, "planar": 3, "spherical": 4, "liquid": 5}


def quickly(chosen: str) -> list:
    """Return all models; the tests of all but one are long."""
    long = pytest.mark.long
    return [name if name == chosen else pytest.param(name, marks=long) for name in MODELS]


def tau() -> np.ndarray:
    """Return a torque, N·m, that changes twice a second and is often less than static friction."""
    levels = np.array([0.1, 0.0, -0.2, 0.004, 0.3, 0.0, 0.0, -0.3])
    return levels[np.arange(len(TIME)) // HELD % len(levels)]


def bench_tau() -> np.ndarray:
    """Return a sine in steps of 20 ms, 2 Hz, 0.1 N·m; the hub sticks four times a second."""
    return 0.1 * np.sin(2 * np.pi * 2.0 * TIME)


def steps_for_fmpy(torque: np.ndarray, held: int) -> np.ndarray:
    """Return the torque as fmpy takes jumps: two rows at the same time. They are events."""
    rows = [(0.0, torque[0])]
    for k in range(held, len(TIME), held):
        rows += [(TIME[k], torque[k - 1]), (TIME[k], torque[k])]
    rows.append((TIME[-1] + 1, torque[-1]))
    return np.array(rows, [("time", float), ("tau_cmd", float)])


def difference(a: dict[str, np.ndarray], b: dict[str, np.ndarray], name: str) -> float:
    """Return the largest difference of a signal between two runs, in SI units."""
    largest = float(np.abs(a[name] - b[name]).max())
    print(f"{name}: {largest:.1e} of {np.abs(b[name]).max():.1e}")
    return largest


def start_values(model: str) -> dict[str, float]:
    """Return the start values of the runs: a turning hub with displaced liquid."""
    values = {"slosh.model": MODELS[model], "init.omega": 0.5, "init.slosh_angle": 0.3}
    return values | {"init.slosh_angle_radial": 0.2}


def model_exchange(
    fmu: Path,
    start: dict[str, float],
    torque: np.ndarray,
    held: int = HELD,
    interval: float = STEP,
    **arguments,
) -> dict[str, np.ndarray]:
    """Return the signals at TIME, simulated by the integrator of fmpy (Model Exchange)."""
    result = simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        stop_time=TIME[-1],
        output_interval=interval,
        start_values=start,
        input=steps_for_fmpy(torque, held),
        output=[*SIGNALS, "event_count"],
        **arguments,
    )
    # Rows at events come besides; of rows at the same time the last is after the event.
    here = np.searchsorted(result["time"], TIME + 1e-9) - 1
    assert np.abs(result["time"][here] - TIME).max() < 1e-9
    return {name: np.asarray(result[name])[here].astype(float) for name in result.dtype.names}


def co_simulation(fmu: Path, start: dict[str, float], torque: np.ndarray) -> dict[str, np.ndarray]:
    """Return the signals at TIME, simulated by the FMU itself with the tolerance 1e-12."""
    columns = [*SIGNALS, "event_count"]
    return drive(fmu, TIME, torque, start, tolerance=1e-12, hold=True, columns=columns)


@pytest.mark.parametrize("model", quickly("liquid"))
def test_cvode_finds_the_motion_of_co_simulation_on_the_bench(fmu: Path, model: str) -> None:
    """Every signal agrees to 1e-6 in SI units over 70 or more changes of stick and slip."""
    start = {"slosh.model": MODELS[model], "init.slosh_angle": 0.0}
    expected = co_simulation(fmu, start, bench_tau())
    assert expected["event_count"][-1] >= 70, "the hub sticks and slips"
    found = model_exchange(fmu, start, bench_tau(), held=1, solver="CVode", relative_tolerance=1e-9)
    assert found["event_count"][-1] == expected["event_count"][-1]
    for name in SIGNALS:
        assert difference(found, expected, name) <= 1e-6, name


@pytest.mark.parametrize("model", quickly("spherical"))
def test_cvode_finds_the_motion_of_co_simulation_through_stick_slip_and_torque_jumps(
    fmu: Path, model: str
) -> None:
    """CVODE's root finder locates sticking and slipping between jumps of the torque."""
    start = start_values(model)
    expected = co_simulation(fmu, start, tau())
    assert expected["event_count"][-1] >= 8, "the hub sticks and slips"
    found = model_exchange(fmu, start, tau(), solver="CVode", relative_tolerance=1e-9)
    assert found["event_count"][-1] == expected["event_count"][-1]
    for name, allowed in SIGNALS.items():
        assert difference(found, expected, name) <= allowed, name


def test_the_difference_to_co_simulation_is_cvodes_error(fmu: Path) -> None:
    """With a tolerance 100 times smaller the difference is at least 10 times smaller."""
    expected = co_simulation(fmu, start_values("spherical"), tau())
    coarse, fine = (
        model_exchange(
            fmu, start_values("spherical"), tau(), solver="CVode", relative_tolerance=tolerance
        )
        for tolerance in (1e-8, 1e-10)
    )
    for name in ("theta", "omega", "slosh_angle", "slosh_angle_radial"):
        assert difference(fine, expected, name) < difference(coarse, expected, name) / 10, name


def test_euler_converges_to_co_simulation_with_first_order(fmu: Path) -> None:
    """A tenth of the step gives a tenth of the error, although events lie between the steps."""
    expected = co_simulation(fmu, start_values("frozen"), tau())
    coarse, fine = (
        # fmpy's Euler makes one step of an output interval
        difference(
            model_exchange(
                fmu,
                start_values("frozen"),
                tau(),
                interval=step,
                solver="Euler",
                step_size=step,
            ),
            expected,
            "omega",
        )
        for step in (1e-2, 1e-3)
    )
    # 10 but for what is of second order; how an event lies in its step changes it a little.
    assert 5 < coarse / fine < 20
