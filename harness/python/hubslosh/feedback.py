"""A sampled controller between the outputs and the inputs of a run: see `Plant.run`."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass
class Linear:
    """Sampled controller u = C x + D e + f, x⁺ = A x + B e, with the control error e = r - y."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    reference: Matrix
    """r, a row per cycle."""
    feedforward: Matrix
    """f, a row per cycle."""
    quaternion: list[int] | None = None
    """Indices of a quaternion in y, scalar first. The error of its vector part is that of
    q⁻¹ ⊗ r, half the remaining rotation about each body axis, the short way."""


@dataclass
class Feedback:
    """A sampled controller and the times at which it acts in a simulation.

    The simulation has ``cycles`` · ``parts`` + 1 rows. A cycle begins at every ``parts``-th row,
    where the controller computes commands from the measurements. The commands are set ``latency``
    cycles and ``switch`` rows later, and held until the next commands are set.
    """

    controller: Linear | Callable[[int, float, list[float]], Any]
    """Type of a controller function: cycle, time (s) and measurements to one number per command."""
    measured: list[str]
    command: list[str]
    cycles: int
    parts: int
    switch: int
    latency: int
    wheels: list[tuple[int, list[float], float, float, float, float]] = field(default_factory=list)
    """Column of the torque in ``command``, axis, inertia, largest torque and speed, and speed of
    each wheel."""
    momentum: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Momentum of the wheels at the start, N·m·s. A wheel that reaches its largest speed between
    two rows gives its torque until then, and none from then on."""

    def __post_init__(self) -> None:
        """Allocate the arrays of commands and of wheel speeds."""
        rows = self.cycles * self.parts + 1
        self.commands: Matrix = np.zeros((rows, len(self.command)))
        """The commands in force from each row on; the last row is not set."""
        self.speeds: Matrix = np.zeros((rows, len(self.wheels)))
        """Speed of each wheel at each row, rad/s."""
