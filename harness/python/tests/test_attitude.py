"""Euler angles and quaternions, compared with rotation matrices and with Spacecraft.fmu."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hubslosh import FmuError, attitude, simulate


def turn(axis: int, angle: float) -> np.ndarray:
    """Return the matrix from axes turned about x, y or z to the original axes.

    ``angle`` is in rad.
    """
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def matrix(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a quaternion by its definition."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return (w**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross


def test_euler_angles_equal_the_product_of_three_rotations() -> None:
    """The quaternion of roll, pitch and yaw turns vectors as the product of three matrices does.

    `angles` returns the three angles from the quaternion again, also for many rows at once.
    """
    random = np.random.default_rng(1)
    roll, yaw = random.uniform(-np.pi, np.pi, (2, 20))
    pitch = random.uniform(-1.5, 1.5, 20)
    rows = attitude.quaternion(roll, pitch, yaw)
    for q, r, p, y in zip(rows, roll, pitch, yaw, strict=True):
        assert np.abs(matrix(q) - turn(2, y) @ turn(1, p) @ turn(0, r)).max() < 1e-14
    # conditioning grows as 1/cos(pitch), at most 14
    assert np.abs(attitude.angles(rows) - np.stack([roll, pitch, yaw], 1)).max() < 1e-13
    assert attitude.angles(attitude.quaternion(pitch=np.pi / 2)).tolist() == [
        0, pytest.approx(np.pi / 2), 0,
    ]  # fmt: skip


def test_the_attitude_error_is_the_remaining_rotation_in_body_axes() -> None:
    """An attitude turned by its error is the wanted attitude.

    The error is a rotation vector in body axes, and takes the shorter way (at most π).
    """
    random = np.random.default_rng(2)
    q, wanted = random.standard_normal((2, 20, 4))
    left = attitude.error(q, wanted)
    for a, b, e in zip(q, wanted, left, strict=True):
        a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
        step = attitude.axis_angle(e, np.linalg.norm(e))
        # near π the error is the square root of the rounding error
        assert np.abs(matrix(a) @ matrix(step) - matrix(b)).max() < 1e-7
    assert (np.linalg.norm(left, axis=1) <= np.pi + 1e-12).all()
    assert attitude.error([1, 0, 0, 0], attitude.axis_angle((0, 0, 1), 0.3)) == pytest.approx(
        [0, 0, 0.3]
    )
    vector = attitude.rotation_vector(attitude.axis_angle((0, 2, 0), -0.4))
    assert vector == pytest.approx([0, -0.4, 0])


def test_a_rigid_craft_follows_the_slew_under_its_torque(fmu: Path) -> None:
    """Spacecraft.fmu without liquid is driven by the torque of a slew about no principal axis.

    The torque is interpolated linearly between rows 0.05 s apart. For a sine with a period of 20 s,
    the interpolation errors are (0.05 · 2π/20)²/8 = 3e-5 of the torque.
    """
    J = np.array([[100.0, -5, 2], [-5, 120, 0], [2, 0, 90]])
    slew = attitude.slew(0.5, 20, (1, 1, 0.5), inertia=J, start=1, step=0.05, stop=25)
    craft = {"craft.mass": 500.0, "tanks": 0, "craft.Jxy": -5.0, "craft.Jxz": 2.0, "craft.Jyz": 0.0}
    craft |= {"craft.Jxx": 100.0, "craft.Jyy": 120.0, "craft.Jzz": 90.0}
    craft |= {f"craft.r[{i}]": 0.0 for i in (1, 2, 3)}
    inputs = slew[["time", "torque[1]", "torque[2]", "torque[3]"]]
    run = simulate(fmu.with_name("Spacecraft.fmu"), craft, inputs)
    names = [f"q[{i}]" for i in range(1, 5)] + [f"omega[{i}]" for i in (1, 2, 3)]
    assert np.abs(run[names] - slew[names]).max().max() < 3e-5 * 0.5
    left = attitude.error(run, slew)
    assert list(left) == ["error[1]", "error[2]", "error[3]"]
    assert attitude.angles(run).attrs["units"]["roll"] == "rad"
    turned = attitude.rotation_vector(run).iloc[-1].to_numpy()
    assert turned == pytest.approx(0.5 * np.array([2, 2, 1]) / 3, abs=1e-5)


def test_invalid_attitudes_are_refused() -> None:
    """Arrays of a wrong size, zero vectors and tables without a quaternion raise an error."""
    with pytest.raises(FmuError, match="four numbers"):
        attitude.angles([1, 0, 0])
    with pytest.raises(FmuError, match="not 0"):
        attitude.angles([0, 0, 0, 0])
    with pytest.raises(FmuError, match=r"no column q\[1\], q\[2\]"):
        attitude.angles(pd.DataFrame({"time": [0.0]}))
    with pytest.raises(FmuError, match="an axis must"):
        attitude.axis_angle((0, 0, 0), 1)
    with pytest.raises(FmuError, match="must be numbers"):
        attitude.quaternion("x")
    with pytest.raises(FmuError, match="duration must be a number above 0, s"):
        attitude.slew(1, 0)
