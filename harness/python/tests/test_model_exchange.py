"""Model Exchange, in which fmpy integrates the FMU's equations, agrees with Co-Simulation."""

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
"""Compared variables and their tolerances, SI units.

fmpy sets the tolerance of CVODE to 1e-9 of the present value plus 1e-9 of the nominal value
(1e-11 to 1e-12 for the liquid) in each of the 1,000 to 10,000 steps of 20 s. Because the
oscillations are hardly damped, most errors remain, and add up to a few hundred times the tolerance.
In typical motions of the bench this is below 1e-6 for all variables. A liquid that swings with
5 rad/s has a tolerance of 5e-9 rad/s in each step, and an error of its rate of up to 7e-6 rad/s.
"""
MODELS = {"frozen": 1, "linear": 2, "planar": 3, "spherical": 4, "liquid": 5}


def quickly(chosen: str) -> list:
    """Return all slosh models as test cases; all except ``chosen`` are long tests."""
    long = pytest.mark.long
    return [name if name == chosen else pytest.param(name, marks=long) for name in MODELS]


def tau() -> np.ndarray:
    """Return a torque, N·m, that changes twice a second and is often less than static friction."""
    levels = np.array([0.1, 0.0, -0.2, 0.004, 0.3, 0.0, 0.0, -0.3])
    return levels[np.arange(len(TIME)) // HELD % len(levels)]


def bench_tau() -> np.ndarray:
    """Return a sine of 2 Hz and 0.1 N·m in steps of 20 ms; the hub sticks four times a second."""
    return 0.1 * np.sin(2 * np.pi * 2.0 * TIME)


def steps_for_fmpy(torque: np.ndarray, held: int) -> np.ndarray:
    """Return the torque with each jump as two rows at one time, which fmpy treats as events."""
    rows = [(0.0, torque[0])]
    for k in range(held, len(TIME), held):
        rows += [(TIME[k], torque[k - 1]), (TIME[k], torque[k])]
    rows.append((TIME[-1] + 1, torque[-1]))
    return np.array(rows, [("time", float), ("tau_cmd", float)])


def difference(a: dict[str, np.ndarray], b: dict[str, np.ndarray], name: str) -> float:
    """Return the largest difference of the signal ``name`` between two runs, in SI units."""
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
    """Return the signals at TIME, simulated by the integrator of fmpy (Model Exchange).

    The torque has a value for each interval of ``held`` steps.
    """
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
    # The result also has rows at events. The last of several rows at a time is after the event.
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


def test_the_difference_to_co_simulation_is_the_error_of_cvode(fmu: Path) -> None:
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
        # the Euler method of fmpy makes one step per output interval
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
    # the ratio is about 10; terms of second order and the places of events in steps change it
    assert 5 < coarse / fine < 20
