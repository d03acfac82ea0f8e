"""A saved state brings everything back, bit for bit."""

from pathlib import Path

import numpy as np
import pytest

from hubslosh import FmuError, Plant

STEP = 0.02  # s
EVERYTHING = {
    "friction.model": "stribeck",
    "wheel.enabled": True,
    "imu.enabled": True,
    "imu.lsb": 7.636e-5,
    "slosh.modes": 3,
}
"""All that has a memory: stick and slip, the wheel's speed, the gyro's noise and samples."""


def go_on(plant: Plant, steps: int) -> bytes:
    """Step on with a small torque, so that the hub sticks at times; all signals as bits."""
    names = plant.names("output", "local")
    rows = []
    first = round(plant.time / STEP)
    for k in range(first, first + steps):
        plant.step((k + 1) * STEP, 0.008 * np.sin(2 * np.pi * 2.34 * k * STEP), 0.01)
        rows.append(plant.get(names))
    stuck = [row[names.index("stuck")] for row in rows]
    assert 0 < sum(stuck) < len(stuck), "the run should stick and slip"
    return np.array(rows).tobytes()


@pytest.mark.parametrize("model", ["frozen", "linear", "planar", "spherical", "paraboloid"])
def test_replay_from_a_saved_state_is_bit_identical(fmu: Path, model: str) -> None:
    """In the same instance, and in one that has never stepped and was set up differently."""
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


def test_states_in_memory_are_replayed_too(fmu: Path) -> None:
    """fmi2GetFMUstate and fmi2SetFMUstate without the detour through bytes."""
    with Plant(fmu, EVERYTHING) as plant:
        go_on(plant, 300)
        time, state = plant.time, plant._call("getFMUstate")
        first = go_on(plant, 300)
        plant._call("setFMUstate", state)
        plant.time = time
        assert go_on(plant, 300) == first
        plant._call("freeFMUstate", state)


def test_a_damaged_state_is_refused_and_changes_nothing(fmu: Path) -> None:
    """Cut short or with one bit turned, with a sentence that says so."""
    with Plant(fmu) as plant:
        plant.step(STEP, 0.1)
        time, good = plant.save()
        turned = bytearray(good)
        turned[len(good) // 2] ^= 1
        for bad in (good[:-1], b"", bytes(turned)):
            with pytest.raises(FmuError, match="fmi2DeSerializeFMUstate"):
                plant.restore((time, bad))
        assert plant.save() == (time, good)
