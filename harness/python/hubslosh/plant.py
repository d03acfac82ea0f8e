"""Instances of an FMU, and the HubSlosh FMU driven through a torque history.

The torque comes as rows of time (s) and ``tau_cmd`` (N·m). At every row the FMU is given the
torque and the slope of the chord to the next row, so that it sees straight lines; this is what
``hubslosh run`` does. All variables have their FMU names and SI units.
"""

import atexit
import contextlib
import copy
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from ctypes import byref
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from fmpy import calloc, fmi2, free, platform_tuple, sharedLibraryExtension
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.logging import addLoggerProxy

from . import batch, fmi3
from .batch import Rows, Signals
from .feedback import Feedback
from .fmu import PLATFORM, Fmu, FmuError, FmuWarning, Quantity

TORQUE = "tau_cmd"
"""The input that carries the torque, N·m."""

COLUMNS = ("omega", "omega_imu", "slosh_angle", "slosh_angle_radial")
"""Default record of `drive` in addition to time and torque."""

_INSTANCE = "hubslosh"
"""Name of our instances, by which the logger knows them."""


class _Messages(threading.local):
    """Messages of FMUs during the present call of this thread."""

    def __init__(self) -> None:
        self.said: list[str] = []


_messages = _Messages()


def _log(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
    """Keep the messages of our instances; print those of others, as fmpy does."""
    if name.decode() == _INSTANCE:
        _messages.said.append(message.decode(errors="replace"))
    else:
        printLogMessage(environment, name, status, category, message)


def _say(text: str) -> None:
    """Keep a message of an FMU 3.0, which tells its instance's own logger."""
    _messages.said.append(text)


# fmpy fills in the messages' arguments with a C function that remembers one logger for all
# instances, the last it was told of: that logger must live as long as the program.
_CALLBACKS = fmi2.fmi2CallbackFunctions()
_CALLBACKS.logger = fmi2.fmi2CallbackLoggerTYPE(_log)
_CALLBACKS.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
_CALLBACKS.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
addLoggerProxy(byref(_CALLBACKS))


class RunError(FmuError):
    """A run that stopped on its way."""

    def __init__(self, sentence: str, time: float, columns: dict[str, np.ndarray]) -> None:
        """Take what is said of it."""
        super().__init__(sentence)
        self.time = time
        """Start of the last step, s."""
        self.columns = columns
        """Record up to the failure."""


_LOADING = threading.Lock()
_libraries: dict[tuple[type, Path], Any] = {}
"""fmpy's objects without an instance, for each library that has been loaded."""


def _loaded(kind: type, fmu: Fmu, identifier: str, binary: Path) -> Any:
    """Return fmpy's object for a new instance; the library stays loaded until the program ends.

    fmpy changes the working directory while it loads one, which threads share: it is done once.
    """
    with _LOADING:
        if (kind, binary) not in _libraries:
            library = kind(
                guid=fmu.description.guid,
                modelIdentifier=identifier,
                unzipDirectory=fmu.directory,
                instanceName=_INSTANCE,
                libraryPath=str(binary),
            )
            # later than the folder's removal, hence called before it
            atexit.register(library.freeLibrary)
            _libraries[kind, binary] = library
        instance = copy.copy(_libraries[kind, binary])
    instance.freeLibrary = lambda: None
    return instance


# Start values by which the package's FMUs move when nobody sets anything, for a host's first plot.
_STARTS = {
    "HubSlosh": ["init.slosh_angle"],
    "Spacecraft": ["init.omega[1]", "init.omega[3]"],
    "SloshTank": ["a[1]", "a[3]"],
}


class Instance:
    """An instance of an FMU, from fmi2Instantiate to fmi2FreeInstance; variables by name.

    Those of FMI 3.0 have the calls of FMI 2.0 (`fmi3`).

    Use it in a ``with`` statement. Calls from several threads follow one another. The package's
    FMUs start at rest here: what moves was asked for.
    """

    def __init__(self, fmu: Fmu, kind: type) -> None:
        """Instantiate for Co-Simulation (``FMU2Slave``) or Model Exchange (``FMU2Model``)."""
        self._instance: Any = None
        # Held during every call, for the FMU must not be freed within one.
        self._lock = threading.RLock()
        self._depth = 0
        self.fmu = fmu
        description = fmu.description
        if kind is fmi2.FMU2Slave:
            interface, name = description.coSimulation, "Co-Simulation"
        else:
            interface, name = description.modelExchange, "Model Exchange"
        if interface is None:
            raise FmuError(f"{fmu.path} offers no {name}")
        folder = Path(fmu.directory) / "binaries"
        platform = platform_tuple if fmu.is_fmi3 else PLATFORM
        binary = folder / platform / f"{interface.modelIdentifier}{sharedLibraryExtension}"
        if not binary.is_file():
            there = ", ".join(sorted(path.name for path in folder.glob("*"))) or "none"
            raise FmuError(f"{fmu.path} has no binary for {platform} (platforms in it: {there})")
        try:
            if fmu.is_fmi3:
                kind = fmi3.Slave if kind is fmi2.FMU2Slave else fmi3.Model
            instance = _loaded(kind, fmu, interface.modelIdentifier, binary)
        except Exception as error:  # fmpy raises nothing more special
            raise FmuError(f"{fmu.path} cannot be loaded: {error}") from None
        _messages.said.clear()
        try:
            if fmu.is_fmi3:
                update = batch.intermediate_update()
                instance.instantiate(fmu.variables, fmu.intermediate, _say, update)
            else:
                instance.instantiate(callbacks=_CALLBACKS)
        except Exception as error:
            instance.freeLibrary()
            raise FmuError(" ".join([str(error), *_messages.said])) from None
        self._instance = instance
        for start in _STARTS.get(fmu.name.partition("_")[0], []):
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
        with self._lock:
            if self._depth:
                raise FmuError("the instance is in a call: close it after its end")
            if self._instance is not None:
                self._instance.freeInstance()
                self._instance = None

    @contextlib.contextmanager
    def _held(self) -> Iterator[Any]:
        """Yield fmpy's instance, which nobody else calls or frees meanwhile."""
        with self._lock:
            if self._instance is None:
                raise FmuError("the instance is closed")
            self._depth += 1
            try:
                yield self._instance
            finally:
                self._depth -= 1

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with these causalities ("output", "local", …)."""
        return self.fmu.names(*causalities)

    def set(self, name: str, value: Quantity) -> None:
        """Set a parameter or an input: a value as `Fmu.convert` takes it."""
        converted = self.fmu.convert(name, value)
        kind = self.fmu.kind(name)
        setter = "setInteger" if kind == "Enumeration" else f"set{kind}"
        self._call(setter, [self.fmu.variable(name).valueReference], [converted])

    def get(self, names: Sequence[str]) -> list[float]:
        """Return the present values of numeric variables; booleans as 0 and 1."""
        values: dict[str, float] = {}
        for getter, some in self._by_type(names).items():
            references = [self.fmu.variables[n].valueReference for n in some]
            if some:
                values.update(zip(some, self._call(getter, references), strict=True))
        return [float(values[n]) for n in names]

    def _by_type(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return which of the variables are read by which function of fmpy's."""
        by_type: dict[str, list[str]] = {"getReal": [], "getInteger": [], "getBoolean": []}
        texts = []
        for name in names:
            kind = self.fmu.kind(name)
            if kind not in ("Real", "Integer", "Enumeration", "Boolean"):
                texts.append(name)
            else:
                by_type["getInteger" if kind == "Enumeration" else f"get{kind}"].append(name)
        if texts:
            raise FmuError(f"{', '.join(texts)}: only numbers can be read")
        return by_type

    def _call(self, function: str, *args: Any, **kwargs: Any) -> Any:
        """Call a function of fmpy's instance; an error or a warning carries what the FMU logged."""
        with self._held() as instance:
            _messages.said.clear()
            try:
                result = getattr(instance, function)(*args, **kwargs)
            except FMICallException as error:
                raise FmuError(" ".join([str(error), *_messages.said])) from None
        for message in _messages.said:
            warnings.warn(message, FmuWarning, stacklevel=5)
        return result


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

        fmu: the packed FMU, or the name of one of this package's. settings: values of parameters
        and inputs by name. tolerance: relative, for the FMU's solver; None: its own choice. start,
        stop: s. inputs: values at the start. torque: ``tau_cmd`` among them, N·m.
        """
        super().__init__(Fmu.open(fmu), fmi2.FMU2Slave)
        self.time = start
        if torque is not None:
            inputs = {TORQUE: torque, **(inputs or {})}
        try:
            for name, value in (settings or {}).items():
                self.set(name, value)
            self._call("setupExperiment", tolerance=tolerance, startTime=start, stopTime=stop)
            self._call("enterInitializationMode")
            for name, value in (inputs or {}).items():
                self.set(name, value)
            self._call("exitInitializationMode")
        except BaseException:
            self.close()
            raise

    def step(self, end: float, torque: float | None = None, slope: float | None = None) -> None:
        """Go on to the time ``end`` (s).

        torque: at the beginning of the step, N·m; None: as it is. slope: its derivative during
        the step, N·m/s; None: the torque is held.
        """
        if torque is not None:
            self.set(TORQUE, torque)
        if slope is not None:
            self.set_slope(TORQUE, slope)
        self._call("doStep", self.time, end - self.time)
        self.time = end

    def set_slope(self, name: str, slope: float) -> None:
        """Set the derivative of a Real input for the next step, per s."""
        self._call(
            "setRealInputDerivatives", [self.fmu.variable(name).valueReference], [1], [slope]
        )

    def run(
        self,
        time: np.ndarray,
        inputs: Mapping[str, np.ndarray],
        slopes: Mapping[str, np.ndarray] | None,
        columns: Sequence[str],
        feedback: Feedback | None = None,
    ) -> dict[str, np.ndarray]:
        """Step from row to row in one call and return ``columns`` at every row.

        time: communication points, s, from the present one on, growing. inputs: by name, their
        values from each row to the next. slopes: the derivatives of the Real ones, per s; None:
        inputs are held. feedback: a controller, of other inputs. Returns an array per column:
        floats, integers (enumerations by number) or bools. An output that follows an input at once
        shows its jump in the next row: rows are read before inputs are set.
        """
        rows = len(time)
        numbers: dict[str, list[str]] = {"Real": [], "Integer": [], "Boolean": []}
        for name in inputs:
            kind = self.fmu.kind(name)
            numbers["Integer" if kind == "Enumeration" else kind].append(name)

        def signals(names: list[str], kind: type, given: Mapping[str, Any] | None) -> Signals:
            values: np.ndarray = np.empty((rows, len(names)), kind)
            if given is not None:
                for j, name in enumerate(names):
                    values[:, j] = given[name]
            return Signals([self.fmu.variables[n].valueReference for n in names], values)

        outputs = self._by_type(columns)
        whole = np.intc
        run = Rows(
            time=np.ascontiguousarray(time, float),
            reals=signals(numbers["Real"], float, inputs),
            slopes=None if slopes is None else signals(numbers["Real"], float, slopes).values,
            integers=signals(numbers["Integer"], whole, inputs),
            booleans=signals(numbers["Boolean"], whole, inputs),
            real_outputs=signals(outputs["getReal"], float, None),
            integer_outputs=signals(outputs["getInteger"], whole, None),
            boolean_outputs=signals(outputs["getBoolean"], whole, None),
        )
        with self._held() as instance:
            _messages.said.clear()
            stop = batch.run(instance, run, feedback)
        recorded = dict(zip(outputs["getReal"], run.real_outputs.values.T, strict=True))
        recorded |= zip(outputs["getInteger"], run.integer_outputs.values.T, strict=True)
        recorded |= zip(outputs["getBoolean"], run.boolean_outputs.values.T != 0, strict=True)
        result = {name: recorded[name] for name in columns}
        if stop is None:
            self.time = float(time[-1])
            for message in _messages.said:
                warnings.warn(message, FmuWarning, stacklevel=3)
            return result
        self.time = float(time[stop.row])
        if feedback is not None and feedback.error is not None:
            raise feedback.error
        said = " ".join(_messages.said)
        sentence = f"the run stopped at t = {self.time} s: {stop.function} returned "
        known = 0 <= stop.status < len(batch.STATUS)
        status = batch.STATUS[stop.status] if known else str(stop.status)
        sentence += status.replace("fmi2", stop.function[:4])
        sentence += f": {said}" if said else " without a message"
        if stop.function == "fmi2DoStep" and batch.STATUS[stop.status] == "fmi2Discard":
            with contextlib.suppress(FmuError):
                if self._call("getBooleanStatus", fmi2.fmi2Terminated):
                    sentence += "; the FMU wants the simulation to end"
        whole_rows = stop.row + (stop.function[4:7] != "Get")
        before = {name: values[:whole_rows] for name, values in result.items()}
        raise RunError(sentence, self.time, {"time": run.time[:whole_rows]} | before)

    def save(self) -> tuple[float, bytes]:
        """Return the time (s) and the serialized state, for `restore` of any instance."""
        with self._held():
            state = self._call("getFMUstate")
            try:
                return self.time, self._call("serializeFMUstate", state)
            finally:
                self._call("freeFMUstate", state)

    def restore(self, saved: tuple[float, bytes]) -> None:
        """Go back to what `save` returned, here or in another instance."""
        with self._held():
            state = self._call("deSerializeFMUstate", saved[1])
            try:
                self._call("setFMUstate", state)
            finally:
                self._call("freeFMUstate", state)
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

    time: communication points, s, growing. torque: ``tau_cmd`` there, N·m. slope: its derivative
    from each row to the next, N·m/s; None: straight lines between the rows. hold: the torque is
    held from row to row, whatever the slope. settings, tolerance: as for `Plant`.

    Returns the columns ``time``, ``tau_cmd`` and ``columns`` as floats, one row per communication
    point.
    """
    t, tau = np.asarray(time, float), np.asarray(torque, float)
    if len(t) != len(tau) or len(t) < 2:
        raise FmuError(f"a torque history needs two rows or more, not {len(t)} and {len(tau)}")
    if hold:
        slopes = None
    elif slope is None:
        slopes = {TORQUE: np.append(np.diff(tau) / np.diff(t), 0.0)}
    else:
        slopes = {TORQUE: np.asarray(slope, float)}
        if len(slopes[TORQUE]) != len(t):
            raise FmuError(f"a slope for each of the {len(t)} rows is needed, not {len(slope)}")
    start, stop = float(t[0]), float(t[-1])
    with Plant(
        fmu, settings, tolerance=tolerance, start=start, stop=stop, torque=float(tau[0])
    ) as plant:
        run = plant.run(t, {TORQUE: tau}, slopes, columns)
    return {"time": t, TORQUE: tau} | {name: run[name].astype(float) for name in columns}
