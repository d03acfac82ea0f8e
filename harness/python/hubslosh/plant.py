"""Instances of FMUs, whose variables are set and read by name, in SI units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from . import native
from .feedback import Feedback
from .fmu import Fmu, FmuError, Parameters, Quantity

TORQUE = "tau_cmd"  # Input of HubSlosh that carries the torque, N·m


class RunError(FmuError):
    """Raised if a run stops before its end, because the FMU refuses a step.

    Parameters
    ----------
    sentence : str
        The message.
    time : float
        Start of the step that failed, s.
    columns : dict of ndarray
        Time histories up to this time, by name, with the column ``time``.

    Examples
    --------
    >>> import hubslosh
    >>> try:
    ...     hubslosh.simulate(parameters={"solver.max_steps": 1}, stop=1)
    ... except hubslosh.RunError as error:
    ...     print(error.time, len(error.columns["time"]))
    0.0 1
    """

    def __init__(self, sentence: str, time: float, columns: dict[str, np.ndarray]) -> None:
        super().__init__(sentence)
        self.time = time
        """Start of the last step, s."""
        self.columns = columns
        """Time histories up to the failure, by name."""


# Start values that are not 0 by default, so that a user's first plot in a host shows a motion.
_STARTS = {"HubSlosh": ["init.slosh_angle"]}


class Instance:
    """An instance of an FMU, whose variables are set and read by name.

    Use the instance in a ``with`` statement, which frees it at the end. If several threads call the
    instance, each call waits until the call before has ended. FMUs of this package start at rest
    unless parameters set an initial motion.
    """

    def __init__(self, fmu: Fmu, *, exchange: bool = False) -> None:
        self.fmu = fmu
        """The FMU."""
        self.native = native.Instance(fmu.native, exchange)
        """The instance in the compiled part of this package."""
        for start in _STARTS.get(fmu.name, []):
            self.set(start, 0.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the instance, after a call in another thread has ended.

        Raises
        ------
        FmuError
            If a controller calls this method during a run.

        Examples
        --------
        >>> import hubslosh
        >>> plant = hubslosh.Plant("HubSlosh")
        >>> plant.close()
        """
        self.native.close()

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with one of these causalities.

        Parameters
        ----------
        *causalities : str
            Causalities of FMI: "parameter", "input", "output", "local", ….

        Returns
        -------
        list of str
            Names, in the order of modelDescription.xml.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh") as plant:
        ...     plant.names("input")
        ['tau_cmd', 'tau_ext', 'g_axial']
        """
        return self.fmu.names(*causalities)

    def set(self, name: str, value: Quantity) -> None:
        """Set an input or a tunable parameter.

        Parameters
        ----------
        name : str
            Name of the variable.
        value : float, int, bool, str or tuple
            Its value, as `Fmu.convert` takes it.

        Raises
        ------
        FmuError
            If the value is refused.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh") as plant:
        ...     plant.set("tau_cmd", 0.1)
        ...     plant.get(["tau_cmd"])
        [0.1]
        """
        self.native.set(name, self.fmu.convert(name, value))

    def get(self, names: Sequence[str]) -> list[float]:
        """Return the present values of numeric variables.

        Parameters
        ----------
        names : sequence of str
            Names of variables.

        Returns
        -------
        list of float
            Values in the variables' own units; Booleans as 0 and 1, enumerations by number.

        Raises
        ------
        FmuError
            If a variable does not exist, or is a string.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh", {"tank.h": (50, "mm")}) as plant:
        ...     plant.get(["tank.h", "omega"])
        [0.05, 0.0]
        """
        self._must_be_numbers(names)
        return self.native.get(list(names))

    def _must_be_numbers(self, names: Sequence[str]) -> None:
        if texts := [name for name in names if self.fmu.kind(name) not in _DTYPES]:
            raise FmuError(f"{', '.join(texts)}: only numbers can be read")


# NumPy type of a column of a table for each type of variable.
_DTYPES = {"Real": float, "Integer": np.intc, "Enumeration": np.intc, "Boolean": bool}


class Plant(Instance):
    """An instance of an FMU for Co-Simulation that is initialised and ready for its first step.

    Use it in a ``with`` statement, which frees the instance. If several threads call it, each call
    waits until the call before has ended. The FMUs of this package start at rest, unless
    ``settings`` contain an initial motion.

    Parameters
    ----------
    fmu : str, Path or Fmu
        File of an FMU, the name of one of this package, or an FMU that is already open.
    settings : mapping, optional
        Values of parameters and start values by name, as `Fmu.convert` takes them.
    tolerance : float, optional
        Relative tolerance of the FMU's solver; by default the FMU chooses it.
    start : float
        Start time, s.
    stop : float, optional
        Stop time that the FMU is given, s; by default none.
    inputs : mapping of float, optional
        Values of inputs at the start by name, in the unit of each input.
    torque : float, optional
        Value of ``tau_cmd`` at the start, N·m; for HubSlosh.

    Attributes
    ----------
    time : float
        Present time, s.
    fmu : Fmu
        The FMU.
    native : object
        The instance in the compiled part of this package.

    Raises
    ------
    FmuError
        If a setting is refused, or the FMU cannot be instantiated or initialised.

    Examples
    --------
    >>> import hubslosh
    >>> with hubslosh.Plant("HubSlosh", {"friction.model": "none"}, torque=0.1) as plant:
    ...     plant.step(1.0)
    ...     rate = plant.get(["omega"])[0]
    >>> round(rate, 4)
    0.234
    """

    def __init__(
        self,
        fmu: Path | str | Fmu,
        settings: Parameters | None = None,
        *,
        tolerance: float | None = None,
        start: float = 0.0,
        stop: float | None = None,
        inputs: Mapping[str, float] | None = None,
        torque: float | None = None,
    ) -> None:
        """Instantiate the FMU and initialise it."""
        super().__init__(fmu if isinstance(fmu, Fmu) else Fmu.open(fmu))
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
        """Advance the FMU by one step.

        Parameters
        ----------
        end : float
            Time after the step, s.
        torque : float, optional
            Value of ``tau_cmd`` at the beginning of the step, N·m; by default unchanged. Other
            inputs are set with `set`.
        slope : float, optional
            Derivative of ``tau_cmd`` during the step, N·m/s; by default the torque is held.

        Raises
        ------
        FmuError
            If the FMU refuses the step.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh", {"friction.model": "none"}) as plant:
        ...     for k in range(50):
        ...         plant.step(0.02 * (k + 1), torque=0.1)
        ...     round(plant.get(["omega"])[0], 4)
        0.234
        """
        if torque is not None:
            self.set(TORQUE, torque)
        if slope is not None:
            self.set_slope(TORQUE, slope)
        self.native.step(self.time, end - self.time)
        self.time = end

    def set_slope(self, name: str, slope: float) -> None:
        """Set the derivative of a Real input during the next step.

        Parameters
        ----------
        name : str
            Name of the input.
        slope : float
            Derivative of the input, in the input's unit per s.

        Raises
        ------
        FmuError
            If the FMU does not interpolate this input.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh", {"friction.model": "none"}) as plant:
        ...     plant.set_slope("tau_cmd", 0.1)
        ...     plant.step(1.0)
        ...     round(plant.get(["omega"])[0], 4)
        0.117
        """
        self.native.set_slope(name, slope)

    def run(
        self,
        time: np.ndarray,
        inputs: Mapping[str, np.ndarray],
        slopes: Mapping[str, np.ndarray] | None,
        columns: Sequence[str],
        feedback: Feedback | None = None,
        wanted: np.ndarray | None = None,
    ) -> dict[str, np.ndarray]:
        """Step through all communication points in one call, and record variables at each point.

        At each point the outputs are recorded before the inputs of this point are set. An output
        that depends directly on an input therefore shows a jump of the input one row later.

        Parameters
        ----------
        time : ndarray, shape (n,)
            Communication points from the present time on, ascending, s.
        inputs : mapping of ndarray, shape (n,)
            Values of inputs by name; each value applies from its row to the next row.
        slopes : mapping of ndarray, shape (n,), or None
            Derivatives of Real inputs by name from each row to the next, in the unit of the input
            per s; None holds the inputs constant between rows.
        columns : sequence of str
            Numeric variables to record.
        feedback : Feedback, optional
            Controller that sets further inputs; `closed_loop` makes it.
        wanted : ndarray of bool, shape (n,), optional
            Mask of the rows to record, by default all. The other rows repeat the row before, which
            saves the time to compute their outputs.

        Returns
        -------
        dict of ndarray
            A column of n values for each name: floats, integers (enumerations by number) or bools.

        Raises
        ------
        RunError
            If the FMU stops the run; the error has the time histories up to that time.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> time = np.linspace(0, 1, 51)
        >>> with hubslosh.Plant("HubSlosh", {"friction.model": "none"}) as plant:
        ...     run = plant.run(time, {"tau_cmd": np.full(51, 0.1)}, None, ["omega"])
        >>> run["omega"].shape, round(float(run["omega"][-1]), 4)
        ((51,), 0.234)
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
            (time, None if wanted is None else wanted.tobytes()),
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
        record = {"time": time[rows]} | result
        if wanted is not None:
            record = {name: values[wanted[rows]] for name, values in record.items()}
        raise RunError(sentence, self.time, record)

    def save(self) -> tuple[float, bytes]:
        """Return the present time and the state of the FMU.

        Returns
        -------
        tuple of float and bytes
            Time, s, and the FMU's serialized state, for `restore` of this or another instance.

        Raises
        ------
        FmuError
            If the FMU cannot serialize its state.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh") as plant:
        ...     plant.step(1.0, torque=0.1)
        ...     saved = plant.save()
        ...     plant.step(2.0)
        ...     plant.restore(saved)
        ...     plant.time
        1.0
        """
        return self.time, self.native.save()

    def restore(self, saved: tuple[float, bytes]) -> None:
        """Go back to a saved time and state.

        Parameters
        ----------
        saved : tuple of float and bytes
            Result of `save`, of this or another instance of the same FMU with the same parameters.

        Raises
        ------
        FmuError
            If the FMU refuses the state.

        Examples
        --------
        >>> import hubslosh
        >>> with hubslosh.Plant("HubSlosh") as plant:
        ...     saved = plant.save()
        ...     plant.step(1.0, torque=0.1)
        ...     plant.restore(saved)
        ...     plant.get(["omega"])
        [0.0]
        """
        self.native.restore(saved[1])
        self.time = saved[0]


def read_vector(plant: Instance, name: str, count: int = 3) -> np.ndarray:
    """Return the elements ``name[1]`` to ``name[count]`` of a vector variable."""
    return np.array(plant.get([f"{name}[{i}]" for i in range(1, count + 1)]))
