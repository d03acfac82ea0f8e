"""A sampled controller between the outputs and the inputs of a run: see `batch.run`.

A linear one is computed by the library ``hubslosh_batch``; a function is called back from there.
Without the library the same sums are taken here in the same order, with the same bits.
"""

from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, Structure, c_double, c_int, c_size_t, c_void_p
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

_LAW = CFUNCTYPE(c_int, c_size_t, c_double, POINTER(c_double), POINTER(c_double))


@dataclass
class Linear:
    """u = C x + D e + f, then x = A x + B e, with the error e = r - y of what is measured."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    reference: Matrix
    """r, a row per cycle."""
    feedforward: Matrix
    """f, a row per cycle."""
    quaternion: NDArray[np.uintp] | None = None
    """Places of a quaternion in y, scalar first: the error of its vector part is that of q⁻¹ ⊗ r,
    half of what is left to turn about each body axis, the short way round."""

    def law(self) -> "Callable[[int, float, Matrix], list[float]]":
        """Return it as a function, with a state of its own."""
        A, B, C, D = (m.tolist() for m in (self.A, self.B, self.C, self.D))
        reference, feedforward = self.reference.tolist(), self.feedforward.tolist()
        at = None if self.quaternion is None else self.quaternion.tolist()
        x = [0.0] * len(A)

        def row(total: float, coefficients: list[float], values: list[float]) -> float:
            for c, v in zip(coefficients, values, strict=True):
                total += c * v
            return total

        def command(cycle: int, time: float, y: Matrix) -> list[float]:
            nonlocal x
            measured, wanted = y.tolist(), reference[cycle]
            e = [r - v for r, v in zip(wanted, measured, strict=True)]
            if at is not None:
                turn = attitude_error([measured[i] for i in at], [wanted[i] for i in at])
                for i, value in zip(at[1:], turn, strict=True):
                    e[i] = value
            u = [
                row(row(0.0, c, x), d, e) + f
                for c, d, f in zip(C, D, feedforward[cycle], strict=True)
            ]
            x = [row(row(0.0, a, x), b, e) for a, b in zip(A, B, strict=True)]
            return u

        return command


def attitude_error(q: list[float], r: list[float]) -> list[float]:
    """Return the vector part of q⁻¹ ⊗ r, of the sign that makes the scalar part positive."""
    scalar = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3]
    sign = -1.0 if scalar < 0 else 1.0
    return [
        sign * (q[0] * r[1] - q[1] * r[0] - q[2] * r[3] + q[3] * r[2]),
        sign * (q[0] * r[2] + q[1] * r[3] - q[2] * r[0] - q[3] * r[1]),
        sign * (q[0] * r[3] - q[1] * r[2] + q[2] * r[1] - q[3] * r[0]),
    ]


@dataclass
class Feedback:
    """The loop around a run of ``cycles`` · ``parts`` + 1 rows.

    At every ``parts``-th row a cycle begins. What the controller computes from the measurements
    there is set ``latency`` cycles and ``switch`` rows later, and held until the next command is.
    """

    controller: "Linear | Callable[[int, float, Matrix], Any]"
    """Type of a controller function: cycle, time (s) and measurements to one number per command."""
    measured: NDArray[np.uint32]
    """Value references."""
    command: NDArray[np.uint32]
    """Value references."""
    cycles: int
    parts: int
    switch: int
    latency: int
    error: BaseException | None = field(default=None, init=False)
    """Exception that the controller raised."""

    def __post_init__(self) -> None:
        """Make room for the commands."""
        self.commands: Matrix = np.zeros((self.cycles * self.parts + 1, len(self.command)))
        """The commands in force from each row on; the last row is not set."""

    def structure(self) -> "tuple[Structure, Any]":
        """Return what the library takes, and what must live as long as it is used."""
        arrays: list[Any] = [self.measured, self.command, self.commands]
        places = [array.ctypes.data for array in arrays]
        law, linear = _LAW(), [0, None, None, None, None, None, None, None]
        if isinstance(self.controller, Linear):
            c = self.controller
            kept = [
                np.ascontiguousarray(m, float)
                for m in (c.A, c.B, c.C, c.D, c.reference, c.feedforward)
            ]
            arrays += kept
            linear = [len(c.A), *(m.ctypes.data for m in kept), None]
            if c.quaternion is not None:
                arrays.append(c.quaternion)
                linear[-1] = c.quaternion.ctypes.data
        else:
            law = _LAW(self._call)
        structure = _Feedback(
            self.cycles, self.parts, self.switch, self.latency,
            len(self.measured), places[0], len(self.command), places[1], places[2],
            law, *linear,
        )  # fmt: skip
        return structure, (arrays, law)

    def _call(self, cycle: int, time: float, measured: Any, command: Any) -> int:
        """Call the controller for the library; an exception must not leave a function of C's."""
        try:
            values = np.ctypeslib.as_array(measured, (len(self.measured),)).copy()
            given = np.ctypeslib.as_array(command, (len(self.command),))
            given[:] = self.controller(cycle, time, values)  # type: ignore[operator]
        except BaseException as error:
            self.error = error
            return 1
        return 0


class _Feedback(Structure):
    _fields_ = (
        ("cycles", c_size_t),
        ("parts", c_size_t),
        ("switch", c_size_t),
        ("latency", c_size_t),
        ("measured", c_size_t),
        ("measured_references", c_void_p),
        ("commanded", c_size_t),
        ("command_references", c_void_p),
        ("commands", c_void_p),
        ("law", _LAW),
        ("states", c_size_t),
        ("a", c_void_p),
        ("b", c_void_p),
        ("c", c_void_p),
        ("d", c_void_p),
        ("reference", c_void_p),
        ("feedforward", c_void_p),
        ("quaternion", c_void_p),
    )
