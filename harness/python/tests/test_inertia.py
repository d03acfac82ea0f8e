"""Inertia of a hub as the sum over its parts."""

from pathlib import Path

import numpy as np
import pytest

import hubslosh
from hubslosh import FmuError, bottom_up

# Table 5.6 of Rubaga's thesis, kg m2
TABLE = {
    "bearing plate": 0.001170, "bottom plate": 0.000166, "top plate": 0.0936, "battery": 0.0180,
    "electronics, switches": 0.00355, "counterweights": 0.0972, "electronics block": 0.0277,
    "reaction wheel": 0.07876, "bolts": 0.01095, "water jug": 0.01322,
}  # fmt: skip


def total(parts: dict) -> float:
    return float(bottom_up(parts)["inertia"].sum())


def test_the_parts_in_table_5_6_of_the_thesis_do_not_add_up_to_its_total() -> None:
    """The parts in Rubaga's table add to 0.344316 kg·m²; the thesis prints 0.343 and 0.343268."""
    found = bottom_up({name: {"inertia": inertia} for name, inertia in TABLE.items()})
    assert found.attrs["parameters"]["hub.I"] == pytest.approx(0.344316, abs=1e-12)
    assert found["share"].idxmax() == "counterweights"
    assert found["share"].sum() == pytest.approx(1)


def test_the_inertia_of_every_shape_equals_the_sum_over_its_points() -> None:
    """The inertia of a body cut into n x n x n points is within 1/n² of the closed form.

    The bodies are off the axis.
    """
    n, mass, at = 60, 3.0, np.array([0.2, -0.1])
    u = (np.arange(n) + 0.5) / n - 0.5
    x, y = (grid.ravel() for grid in np.meshgrid(u, u))
    r = np.sqrt((np.arange(n) + 0.5) / n)  # radii of rings with equal areas
    angle = 2 * np.pi * np.arange(12) / 12
    ring = (np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel())
    hollow = np.sqrt(0.25 + 0.75 * (np.arange(n) + 0.5) / n)
    tube = (np.outer(hollow, np.cos(angle)).ravel(), np.outer(hollow, np.sin(angle)).ravel())
    # a rod along x consists of discs; only the y coordinates of their points matter
    rod = (np.tile(u, 12 * n), np.repeat(ring[1], n))
    cases = [
        ({"box": (0.3, 0.2)}, (0.3 * x, 0.2 * y)),
        ({"disc": 0.15}, (0.15 * ring[0], 0.15 * ring[1])),
        ({"tube": (0.05, 0.1)}, (0.1 * tube[0], 0.1 * tube[1])),
        ({"rod": (0.02, 0.4)}, (0.4 * rod[0], 0.02 * rod[1])),
        ({"point": True}, (np.zeros(1), np.zeros(1))),
    ]
    for shape, (px, py) in cases:
        found = total({"part": {"mass": mass, "position": at, **shape}})
        points = mass * np.mean((px + at[0]) ** 2 + (py + at[1]) ** 2)
        assert found == pytest.approx(points, rel=1 / n**2), shape


def test_imbalance_gives_the_gravity_torque_of_a_tilted_bench(fmu: Path) -> None:
    """The FMU's torque on the dry hub equals the sum of the torques on the parts."""
    parts = {
        "plate": {"mass": 2.0, "box": (0.5, 0.3)},
        "battery": {"mass": 1.0, "position": (-0.1, 0.05), "box": (0.1, 0.06)},
        "wheel": {"mass": 1.5, "position": (-0.05, -0.12), "disc": 0.06},
    }
    found = bottom_up(parts).attrs["parameters"]
    tilt, theta = 0.02, 0.3
    settings = found | {"bench.tilt": tilt, "init.theta": theta, "slosh.model": "frozen"}
    with hubslosh.Plant(fmu, settings) as plant:
        torque, inertia = plant.get(["tau_gravity", "hub.I"])
    assert inertia == found["hub.I"]
    # gravity across the bearing axis acts along theta = 0: F = m g tan(tilt) (1, 0) on each part
    across = 9.81 * np.tan(tilt)
    expected = 0.0
    for part in parts.values():
        x, y = part.get("position", (0.0, 0.0))
        expected -= part["mass"] * across * (x * np.sin(theta) + y * np.cos(theta))
    assert torque == pytest.approx(expected, rel=1e-12)


def test_all_wrong_parts_of_a_hub_are_reported_at_once() -> None:
    """One message names each wrong part and the allowed values."""
    parts = {"a": {"mass": -1.0}, "b": {"mass": 1.0, "box": 0.3}, "c": {"mass": 1, "bx": 1}}
    with pytest.raises(FmuError) as said:
        bottom_up(parts)
    for words in ("a: mass=-1.0", "b: box=0.3 (allowed: (a, b)", "c: bx (allowed: mass"):
        assert words in str(said.value)
    with pytest.raises(FmuError, match="there are no parts"):
        bottom_up({})
    with pytest.raises(FmuError, match="inner radius is larger"):
        bottom_up({"a": {"mass": 1.0, "tube": (0.2, 0.1)}})
