"""A sampled controller between the outputs and the inputs of a run: see `Plant.run`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass
class Linear:
    """Sampled linear controller of the error e = r - y, with the matrices A, B, C and D.

    In each cycle it computes the commands u = C x + D e + f and its next state A x + B e from its
    state x, the reference r, the measurements y and the feedforward f.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    reference: Matrix
    """Reference r, one row per cycle."""
    feedforward: Matrix
    """Feedforward f, one row per cycle."""
    quaternion: list[int] | None = None
    """Indices of a quaternion q in y, scalar first. The error of its vector part is the vector part
    of q⁻¹ ⊗ r, which is about half the remaining rotation about each body axis."""


@dataclass
class Feedback:
    """A sampled controller and the times at which it acts in a simulation.

    The simulation has ``cycles`` · ``parts`` + 1 rows. A cycle begins at every ``parts``-th row,
    where the controller computes commands from the measurements. The commands are set ``latency``
    cycles and ``switch`` rows later, and held until the next commands are set.
    """

    controller: Linear | Callable[[int, float, list[float]], Any]
    """A function gets the cycle, the time (s) and the measurements; it returns the commands."""
    measured: list[str]
    command: list[str]
    cycles: int
    parts: int
    switch: int
    latency: int
    wheels: list[tuple[int, list[float], float, float, float, float]] = field(default_factory=list)
    """For each wheel: the column of its torque in ``command``, its axis, inertia (kg·m²), largest
    torque (N·m), largest speed (rad/s) and speed at the start (rad/s)."""
    momentum: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Angular momentum of the wheels at the start, N·m·s. If a wheel reaches its largest speed
    between two rows, its torque is 0 from that moment on."""

    def __post_init__(self) -> None:
        rows = self.cycles * self.parts + 1
        self.commands: Matrix = np.zeros((rows, len(self.command)))
        """Commands that act from each row to the next; the last row is not set."""
        self.speeds: Matrix = np.zeros((rows, len(self.wheels)))
        """Speed of each wheel at each row, rad/s."""
