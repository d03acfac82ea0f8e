"""Attitude: quaternions, Euler angles, and the reference of a slew.

A quaternion q has its scalar first and maps body to inertial axes, as Spacecraft's ``q[1]`` …
``q[4]``. Angles are in rad.
"""

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import array, check_columns, check_numbers, floats, not_positive, refuse, vector
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

NAMES = tuple(f"q[{i}]" for i in range(1, 5))  # Columns of a table that hold a quaternion

Real = NDArray[np.float64]


def _unit_quaternions(q: Any) -> Real:
    """Return the quaternions in ``q`` as rows (n × 4), each divided by its norm.

    ``q`` is an array (4) or (n × 4), or a table with the columns q[1] to q[4].
    """
    if hasattr(q, "columns"):
        check_columns(q, NAMES, "the table")
        q = q[list(NAMES)].to_numpy(float)
    rows = array(q)
    if rows.ndim not in (1, 2) or rows.shape[-1] != 4:
        raise FmuError("a quaternion has four numbers, the scalar first")
    length = np.linalg.norm(rows, axis=-1, keepdims=True)
    if not (np.isfinite(rows).all() and (length > 0).all()):
        raise FmuError("a quaternion must be finite and not 0")
    return np.asarray(rows / length, float)


def _as_given(q: Any, names: tuple[str, ...], values: Real) -> Any:
    """Return ``values`` as a table with the columns ``names`` if ``q`` is a table.

    Otherwise ``values`` is returned as it is, an array.
    """
    if not hasattr(q, "columns"):
        return values
    import pandas as pd

    table = pd.DataFrame(values, columns=list(names), index=q.index)
    table.attrs["units"] = dict.fromkeys(names, "rad")
    return table


def angles(q: "ArrayLike | pd.DataFrame") -> Any:
    """Return roll, pitch and yaw of a quaternion, of each row of an array, or of a run's table.

    The craft is turned by yaw about z, then by pitch about its new y, then by roll about its new x
    (3-2-1, Tait–Bryan). At a pitch of ±90° roll and yaw turn about the same axis; roll is then 0.

    Parameters
    ----------
    q : array_like, shape (4,) or (n, 4), or DataFrame
        Quaternions from body to inertial axes, scalar first, of any length but 0; or a table
        with the columns ``q[1]`` to ``q[4]``.

    Returns
    -------
    ndarray, shape (3,) or (n, 3), or DataFrame
        Roll, pitch and yaw, rad; pitch is from -π/2 to π/2. For a table: a table with the
        columns ``roll``, ``pitch`` and ``yaw``.

    Raises
    ------
    FmuError
        If a quaternion is 0, not finite, or not of four numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from hubslosh import attitude
    >>> q = attitude.quaternion(yaw=np.radians(90))
    >>> np.degrees(attitude.angles(q)).round(6) + 0.0
    array([ 0.,  0., 90.])
    """
    from scipy.spatial.transform import Rotation

    rows = _unit_quaternions(q)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # at a pitch of 90 degrees
        turned = Rotation.from_quat(rows, scalar_first=True).as_euler("ZYX")
    return _as_given(q, ("roll", "pitch", "yaw"), turned[..., ::-1])


def quaternion(roll: ArrayLike = 0.0, pitch: ArrayLike = 0.0, yaw: ArrayLike = 0.0) -> Real:
    """Return the quaternion of roll, pitch and yaw, the inverse of `angles`.

    Parameters
    ----------
    roll, pitch, yaw : array_like
        Angles about x, y and z, rad: numbers, or arrays that NumPy can broadcast to one shape.

    Returns
    -------
    ndarray, shape (4,) or (n, 4)
        Unit quaternions from body to inertial axes, scalar first and not negative.

    Raises
    ------
    FmuError
        If an angle is no number, or the shapes do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> from hubslosh import attitude
    >>> attitude.quaternion(yaw=np.radians(90)).round(4)
    array([0.7071, 0.    , 0.    , 0.7071])
    """
    from scipy.spatial.transform import Rotation

    try:
        three = np.stack(np.broadcast_arrays(yaw, pitch, roll), axis=-1).astype(float)
    except (TypeError, ValueError) as error:
        raise FmuError(f"roll, pitch and yaw must be numbers: {error}") from None
    return np.asarray(Rotation.from_euler("ZYX", three).as_quat(canonical=True, scalar_first=True))


def rotation_vector(q: "ArrayLike | pd.DataFrame") -> Any:
    """Return the rotation vector (axis times angle) of each attitude.

    The attitude is a quaternion, an array with one quaternion in each row, or the table of a run.

    Parameters
    ----------
    q : array_like, shape (4,) or (n, 4), or DataFrame
        Quaternions from body to inertial axes, scalar first, as for `angles`.

    Returns
    -------
    ndarray, shape (3,) or (n, 3), or DataFrame
        Rotation vectors, rad, with lengths from 0 to π. For a table: a table with the columns
        ``angle[1]`` to ``angle[3]``.

    Raises
    ------
    FmuError
        If a quaternion is 0, not finite, or not of four numbers.

    Examples
    --------
    >>> from hubslosh import attitude
    >>> attitude.rotation_vector(attitude.axis_angle((0, 0, 1), 0.2)).round(6)
    array([0. , 0. , 0.2])
    """
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_quat(_unit_quaternions(q), scalar_first=True).as_rotvec()
    return _as_given(q, ("angle[1]", "angle[2]", "angle[3]"), turned)


def axis_angle(axis: ArrayLike, angle: ArrayLike) -> Real:
    """Return the quaternion of a turn about an axis.

    Parameters
    ----------
    axis : array_like, shape (3,)
        Axis, of any length but 0. The axis has equal components in body and inertial axes.
    angle : array_like
        Angle, rad; an array gives a quaternion for each element.

    Returns
    -------
    ndarray, shape (4,) or (n, 4)
        Unit quaternions, scalar first.

    Raises
    ------
    FmuError
        If the axis is 0, or the axis or an angle is not of finite numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from hubslosh import attitude
    >>> attitude.axis_angle((0, 1, 0), np.pi).round(6)
    array([0., 0., 1., 0.])
    """
    unit = vector(axis, 3, "an axis")
    length = np.linalg.norm(unit)
    if not length > 0:
        raise FmuError("an axis must not be 0")
    try:
        half = floats(angle)[..., None] / 2
    except (TypeError, ValueError):
        raise FmuError(f"angle must be numbers, rad, not {angle!r}") from None
    return np.asarray(np.concatenate([np.cos(half), np.sin(half) * unit / length], axis=-1))


def error(q: "ArrayLike | pd.DataFrame", wanted: "ArrayLike | pd.DataFrame") -> Any:
    """Return the shortest rotation from the present attitude to a wanted attitude.

    Parameters
    ----------
    q : array_like, shape (4,) or (n, 4), or DataFrame
        Present attitude, as for `angles`.
    wanted : array_like, shape (4,) or (n, 4), or DataFrame
        Attitude to reach: one quaternion, or one for each row of ``q``.

    Returns
    -------
    ndarray, shape (3,) or (n, 3), or DataFrame
        Rotation vectors in body axes, rad. If ``q`` is a table: a table with the columns
        ``error[1]`` to ``error[3]``.

    Raises
    ------
    FmuError
        If a quaternion is 0, not finite, or not of four numbers.

    Examples
    --------
    >>> from hubslosh import attitude
    >>> now, later = attitude.quaternion(yaw=0.1), attitude.quaternion(yaw=0.3)
    >>> attitude.error(now, later).round(6) + 0.0
    array([0. , 0. , 0.2])
    """
    from scipy.spatial.transform import Rotation

    mine, other = (
        Rotation.from_quat(_unit_quaternions(one), scalar_first=True) for one in (q, wanted)
    )
    turned = (mine.inv() * other).as_rotvec()
    return _as_given(q, ("error[1]", "error[2]", "error[3]"), turned)


def slew(
    angle: float,
    duration: float,
    axis: ArrayLike = (1, 0, 0),
    *,
    inertia: ArrayLike | None = None,
    start: float = 0.0,
    step: float = 0.1,
    stop: float | None = None,
) -> "pd.DataFrame":
    """Return the reference of a slew from rest to rest, for `closed_loop`.

    The craft turns about a fixed axis. Its acceleration is one period of a sine, so that the
    torque begins and ends at 0, without a jump.

    Parameters
    ----------
    angle : float
        Angle of the slew, rad.
    duration : float
        Time from rest to rest, s.
    axis : array_like, shape (3,)
        Axis in body axes, of any length but 0.
    inertia : array_like, shape () or (3, 3), optional
        Moment of inertia about the axis, or inertia matrix in body axes, kg·m². If given, the
        table also has the torque that the slew of a rigid craft takes.
    start : float
        Time at which the slew begins, s.
    step : float
        Time between rows, s.
    stop : float, optional
        Time of the last row, s; by default, and at the earliest, the end of the slew.

    Returns
    -------
    DataFrame
        Columns ``time`` (s), ``q[1]`` to ``q[4]`` (body to inertial axes), ``omega[1]`` to
        ``omega[3]`` (rad/s, body axes) and, with ``inertia``, ``torque[1]`` to ``torque[3]``
        (N·m, body axes).

    Raises
    ------
    FmuError
        If ``duration`` or ``step`` is not positive, the axis is 0, or ``inertia`` has another
        shape.

    Examples
    --------
    >>> import numpy as np
    >>> from hubslosh import attitude
    >>> slew = attitude.slew(np.radians(30), 20, axis=(0, 0, 1), inertia=400.0, step=5)
    >>> slew[["time", "omega[3]", "torque[3]"]].round(4)
       time  omega[3]  torque[3]
    0   0.0    0.0000     0.0000
    1   5.0    0.0262     3.2899
    2  10.0    0.0524     0.0000
    3  15.0    0.0262    -3.2899
    4  20.0    0.0000    -0.0000
    """
    import pandas as pd

    check_numbers(angle=angle, duration=duration, step=step, start=start, stop=stop)
    refuse(not_positive("duration", duration, "s") + not_positive("step", step, "s"))
    end = start + duration
    stop = end if stop is None else max(stop, end)
    time = np.append(np.arange(0.0, stop - 1e-9 * step, step), stop)
    t, w = np.clip(time - start, 0.0, duration), 2 * np.pi / duration
    axis_angle(axis, 0.0)  # raises an error if the axis is wrong
    unit = floats(axis) / np.linalg.norm(axis)
    turned = angle * (t - np.sin(w * t) / w) / duration
    rate = angle * (1 - np.cos(w * t)) / duration
    acceleration = angle * w * np.sin(w * t) / duration
    table = {"time": time} | dict(zip(NAMES, axis_angle(axis, turned).T, strict=True))
    table |= {f"omega[{i + 1}]": rate * unit[i] for i in range(3)}
    units = {"time": "s"} | {f"omega[{i + 1}]": "rad/s" for i in range(3)}
    if inertia is not None:
        J = array(inertia)
        if J.shape not in ((), (3, 3)):
            raise FmuError(f"inertia must be a number or a 3 × 3 matrix, not {inertia!r}")
        moment = J * unit if J.shape == () else J @ unit
        gyroscopic = np.zeros(3) if J.shape == () else np.cross(unit, moment)
        torque = np.outer(acceleration, moment) + np.outer(rate**2, gyroscopic)
        table |= {f"torque[{i + 1}]": torque[:, i] for i in range(3)}
        units |= {f"torque[{i + 1}]": "N.m" for i in range(3)}
    frame = pd.DataFrame(table)
    frame.attrs["units"] = units
    return frame
