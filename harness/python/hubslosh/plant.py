"""Instances of an FMU, and the HubSlosh FMU driven through a torque history.

The torque comes as rows of time (s) and ``tau_cmd`` (N·m). At every row the package sets the torque
and the slope of the chord to the next row, as ``hubslosh run`` does: the FMU receives straight
lines. All variables have their FMU names and SI units.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from . import native
from .arguments import floats
from .feedback import Feedback
from .fmu import Fmu, FmuError, Quantity

TORQUE = "tau_cmd"
"""The input that carries the torque, N·m."""

COLUMNS = ("omega", "omega_imu", "slosh_angle", "slosh_angle_radial")
"""Default record of `drive` in addition to time and torque."""


class RunError(FmuError):
    """A run that stopped on its way."""

    def __init__(self, sentence: str, time: float, columns: dict[str, np.ndarray]) -> None:
        """Store the message, the time and the record."""
        super().__init__(sentence)
        self.time = time
        """Start of the last step, s."""
        self.columns = columns
        """Record up to the failure."""


# Start values by which the package's FMUs move when nobody sets anything, for a host's first plot.
_STARTS = {"HubSlosh": ["init.slosh_angle"]}


class Instance:
    """An instance of an FMU, from fmi2Instantiate to fmi2FreeInstance; variables by name.

    Use it in a ``with`` statement. Calls from several threads follow one another. The package's
    FMUs start at rest here: what moves was asked for.
    """

    def __init__(self, fmu: Fmu, *, exchange: bool = False) -> None:
        """Instantiate for Co-Simulation, or for Model Exchange."""
        self.fmu = fmu
        """The FMU."""
        self.native = native.Instance(fmu.native, exchange)
        """The instance in the compiled half of this package."""
        for start in _STARTS.get(fmu.name, []):
            self.set(start, 0.0)

    def __enter__(self) -> Self:
        """Return the instance itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Free the instance."""
        self.close()

    def close(self) -> None:
        """Free the instance; a call in another thread ends first.

        Raises FmuError within a run, where a controller might call it.
        """
        self.native.close()

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with these causalities ("output", "local", …)."""
        return self.fmu.names(*causalities)

    def set(self, name: str, value: Quantity) -> None:
        """Set a parameter or an input: a value as `Fmu.convert` takes it."""
        self.native.set(name, self.fmu.convert(name, value))

    def get(self, names: Sequence[str]) -> list[float]:
        """Return the present values of numeric variables; booleans as 0 and 1."""
        self._must_be_numbers(names)
        return self.native.get(list(names))

    def _must_be_numbers(self, names: Sequence[str]) -> None:
        if texts := [name for name in names if self.fmu.kind(name) not in _DTYPES]:
            raise FmuError(f"{', '.join(texts)}: only numbers can be read")


_DTYPES = {"Real": float, "Integer": np.intc, "Enumeration": np.intc, "Boolean": bool}
"""Types of a table's columns."""


class Plant(Instance):
    """One Co-Simulation instance of an FMU, ready for its first step."""

    def __init__(
        self,
        fmu: Path | str,
        settings: Mapping[str, Quantity] | None = None,
        *,
        tolerance: float | None = None,
        start: float = 0.0,
        stop: float | None = None,
        inputs: Mapping[str, float] | None = None,
        torque: float | None = None,
    ) -> None:
        """Instantiate and initialise.

        * ``fmu``: File of an FMU, or the name of one in this package.
        * ``settings``: Values of parameters and inputs by name.
        * ``tolerance``: Relative tolerance of the FMU's solver; None: its own choice.
        * ``start``, ``stop``: Start and stop time, s.
        * ``inputs``: Values at the start.
        * ``torque``: Value of ``tau_cmd`` at the start, N·m.
        """
        super().__init__(Fmu.open(fmu))
        self.time = start
        """Present time, s."""
        if torque is not None:
            inputs = {TORQUE: torque, **(inputs or {})}
        try:
            for name, value in (settings or {}).items():
                self.set(name, value)
            self.native.initialize(tolerance, start, stop)
            for name, value in (inputs or {}).items():
                self.set(name, value)
            self.native.start()
        except BaseException:
            self.close()
            raise

    def step(self, end: float, torque: float | None = None, slope: float | None = None) -> None:
        """Go on to the time ``end`` (s).

        * ``torque``: Value at the beginning of the step, N·m; None: unchanged.
        * ``slope``: Its derivative during the step, N·m/s; None: the torque is held.
        """
        if torque is not None:
            self.set(TORQUE, torque)
        if slope is not None:
            self.set_slope(TORQUE, slope)
        self.native.step(self.time, end - self.time)
        self.time = end

    def set_slope(self, name: str, slope: float) -> None:
        """Set the derivative of a Real input for the next step, per s."""
        self.native.set_slope(name, slope)

    def run(
        self,
        time: np.ndarray,
        inputs: Mapping[str, np.ndarray],
        slopes: Mapping[str, np.ndarray] | None,
        columns: Sequence[str],
        feedback: Feedback | None = None,
    ) -> dict[str, np.ndarray]:
        """Step from row to row in one call and return ``columns`` at every row.

        * ``time``: Communication points from the present one on, ascending, s.
        * ``inputs``: By name, their values from each row to the next.
        * ``slopes``: Derivatives of the Real inputs, per s; None: inputs are held.
        * ``feedback``: Controller that sets other inputs.

        Returns an array per column: floats, integers (enumerations by number) or bools. Rows are
        read before inputs are set, so an output with direct feedthrough shows a jump of an input
        in the next row.
        """
        self._must_be_numbers(columns)
        time = np.ascontiguousarray(time, float)
        names = list(inputs)

        def table(given: Mapping[str, np.ndarray]) -> np.ndarray:
            values = np.zeros((len(time), len(names)))
            for j, name in enumerate(names):
                values[:, j] = given.get(name, 0.0)
            return values

        recorded = np.empty((len(time), len(columns)))
        stop = self.native.run(
            time,
            (names, table(inputs)),
            None if slopes is None else table(slopes),
            (list(columns), recorded),
            feedback,
        )
        kinds = [_DTYPES[self.fmu.kind(name)] for name in columns]
        rows = slice(stop[1] if stop else None)
        result = {
            name: values[rows].astype(kind, copy=False)
            for name, kind, values in zip(columns, kinds, recorded.T, strict=True)
        }
        if stop is None:
            self.time = float(time[-1])
            return result
        self.time = float(time[stop[0]])
        sentence = f"the run stopped at t = {self.time} s: {stop[2]}"
        raise RunError(sentence, self.time, {"time": time[rows]} | result)

    def save(self) -> tuple[float, bytes]:
        """Return the time (s) and the serialized state, for `restore` of any instance."""
        return self.time, self.native.save()

    def restore(self, saved: tuple[float, bytes]) -> None:
        """Go back to what `save` returned, here or in another instance."""
        self.native.restore(saved[1])
        self.time = saved[0]


def drive(
    fmu: Path | str,
    time: Sequence[float] | np.ndarray,
    torque: Sequence[float] | np.ndarray,
    settings: Mapping[str, Quantity] | None = None,
    *,
    slope: Sequence[float] | np.ndarray | None = None,
    tolerance: float | None = None,
    hold: bool = False,
    columns: Sequence[str] = COLUMNS,
) -> dict[str, np.ndarray]:
    """Drive a new instance through a torque history, one step from row to row.

    * ``time``: Communication points, ascending, s.
    * ``torque``: ``tau_cmd`` there, N·m.
    * ``slope``: Its derivative from each row to the next, N·m/s; None: straight lines between the
      rows.
    * ``hold``: The torque is held from row to row, whatever the slope.
    * ``settings``, ``tolerance``: As for `Plant`.

    Returns the columns ``time``, ``tau_cmd`` and ``columns`` as floats, one row per communication
    point.
    """
    t, tau = floats(time), floats(torque)
    if len(t) != len(tau) or len(t) < 2:
        raise FmuError(f"a torque history needs two rows or more, not {len(t)} and {len(tau)}")
    if hold:
        slopes = None
    elif slope is None:
        slopes = {TORQUE: np.append(np.diff(tau) / np.diff(t), 0.0)}
    else:
        slopes = {TORQUE: floats(slope)}
        if len(slopes[TORQUE]) != len(t):
            raise FmuError(f"a slope for each of the {len(t)} rows is needed, not {len(slope)}")
    start, stop = float(t[0]), float(t[-1])
    with Plant(
        fmu, settings, tolerance=tolerance, start=start, stop=stop, torque=float(tau[0])
    ) as plant:
        run = plant.run(t, {TORQUE: tau}, slopes, columns)
    return {"time": t, TORQUE: tau} | {name: run[name].astype(float) for name in columns}
