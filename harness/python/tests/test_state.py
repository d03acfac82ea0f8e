"""Saved states of FMU instances restore runs bit by bit."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hubslosh import FmuError, Plant
from hubslosh.feedback import Feedback, Linear

STEP = 0.02  # s
EVERYTHING = {
    "friction.model": "stribeck",
    "wheel.enabled": True,
    "imu.enabled": True,
    "imu.lsb": 7.636e-5,
    "slosh.modes": 3,
}
"""Parameters with all parts that have states: friction, wheel, noise and samples of the gyro."""


def go_on(plant: Plant, steps: int) -> bytes:
    """Continue with a small torque for some steps, and return the signals as bytes.

    Under this torque the hub sticks at times.
    """
    names = plant.names("output", "local")
    rows = []
    first = round(plant.time / STEP)
    for k in range(first, first + steps):
        plant.step((k + 1) * STEP, 0.008 * np.sin(2 * np.pi * 2.34 * k * STEP), 0.01)
        rows.append(plant.get(names))
    stuck = [row[names.index("stuck")] for row in rows]
    assert 0 < sum(stuck) < len(stuck), "the run should stick and slip"
    return np.array(rows).tobytes()


@pytest.mark.parametrize("model", ["frozen", "linear", "planar", "spherical", "liquid"])
def test_replay_from_a_saved_state_is_bit_identical(fmu: Path, model: str) -> None:
    """A state is restored in its own instance and in a new instance with other parameters."""
    settings = EVERYTHING | {"slosh.model": model}
    with Plant(fmu, settings) as plant, Plant(fmu) as other:
        go_on(plant, 500)
        saved = plant.save()
        assert plant.save() == saved, "saving changes nothing"
        first = go_on(plant, 500)
        plant.restore(saved)
        assert plant.save() == saved, "restoring and saving again gives the same bytes"
        assert go_on(plant, 500) == first
        other.restore(saved)
        assert go_on(other, 500) == first


def test_a_damaged_state_is_refused_and_does_not_change_the_instance(fmu: Path) -> None:
    """The state is cut off or has one changed bit, which the error states."""
    with Plant(fmu) as plant:
        plant.step(STEP, 0.1)
        time, good = plant.save()
        turned = bytearray(good)
        turned[len(good) // 2] ^= 1
        for bad in (good[:-1], b"", bytes(turned)):
            with pytest.raises(FmuError, match="fmi2DeSerializeFMUstate"):
                plant.restore((time, bad))
        assert plant.save() == (time, good)


CLOSED = """
import sys, threading
import numpy as np
from hubslosh import FmuError, Plant

for _ in range(8):
    plant = Plant(sys.argv[1], {"init.slosh_angle": 0.2})
    time = np.arange(10001) * 0.01
    found = []

    def run():
        try:
            found.append(plant.run(time, {}, None, ["omega"])["omega"][-1])
        except FmuError as error:
            found.append(str(error))

    runs = [threading.Thread(target=run) for _ in range(2)]
    for thread in runs:
        thread.start()
    plant.close()
    for thread in runs:
        thread.join()
    for result in found:
        assert isinstance(result, float) or "closed" in result or "stopped" in result, found
    try:
        plant.get(["omega"])
    except FmuError as error:
        assert "the instance is closed" in str(error)
    else:
        raise AssertionError
    plant.close()
"""


def test_close_waits_for_a_run_in_another_thread(fmu: Path) -> None:
    """The test runs in a process of its own, because a missing lock would end it by SIGSEGV."""
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-c", CLOSED, fmu]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr}"


def test_a_controller_cannot_close_the_instance_that_it_controls(fmu: Path) -> None:
    """The run ends with an error; afterwards the instance can be closed."""
    with Plant(fmu) as plant:

        def law(*_: object) -> list[float]:
            plant.close()
            return [0.0]

        feedback = Feedback(law, ["omega"], ["tau_cmd"], cycles=2, parts=1, switch=0, latency=0)
        with pytest.raises(FmuError, match="cannot be closed while one of its calls is running"):
            plant.run(np.arange(3) * 0.1, {}, None, ["omega"], feedback)


def test_a_controller_of_another_size_than_its_loop_is_refused(fmu: Path) -> None:
    """The sizes of arrays are compared before any of their numbers is read."""
    one, none = np.ones((1, 1)), np.zeros((0, 0))
    law = Linear(none, np.zeros((0, 1)), np.zeros((1, 0)), one, np.zeros((2, 1)), np.zeros((2, 1)))
    size = {"cycles": 2, "parts": 1, "switch": 0, "latency": 0}

    def run(controller: Any, rows: int = 3, **other: int) -> None:
        feedback = Feedback(controller, ["omega"], ["tau_cmd"], **(size | other))
        with Plant(fmu) as plant:
            plant.run(np.arange(rows) * 0.1, {}, None, ["omega"], feedback)

    run(law)
    for controller, rows, other, words in [
        (lambda *_: [1.0, 2.0], 3, {}, r"commands of the controller: 2 \(expected: 1\)"),
        (replace(law, D=np.ones((1, 2))), 3, {}, r"numbers in D: 2 \(expected: 1\)"),
        (replace(law, reference=np.zeros((1, 1))), 3, {}, "numbers in reference: 1"),
        (replace(law, quaternion=[0, 1, 2, 3]), 3, {}, "quaternion"),
        (law, 4, {}, r"rows of the run: 4 \(expected: 3\)"),
        (law, 3, {"parts": 0}, r"rows of the run: 3 \(expected: 1\)"),
    ]:
        with pytest.raises(ValueError, match=words):
            run(controller, rows, **other)
