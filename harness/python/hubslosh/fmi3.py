# ruff: noqa: N802, N803, N815 - the names of FMI and of fmpy
"""An instance of an FMU 3.0 with the calls of FMI 2.0, as the rest of the package makes them.

In Co-Simulation neither event mode nor early return is used: the FMU handles its events within its
steps, as FMI 2.0 has it. What FMI 3.0 no longer has, derivatives of inputs, are lines that the FMU
hears of in intermediate update.
"""

import ctypes
from collections.abc import Callable, Collection, Mapping, Sequence
from ctypes import Structure, byref, c_double, c_int, c_size_t, c_uint8, c_void_p
from typing import Any, NamedTuple

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3Slave, fmi3Boolean, fmi3Float64
from fmpy.model_description import ScalarVariable

KINDS = {"Float64": "Real", "Int32": "Integer"}
"""Types that FMI 2.0 has under another name; Boolean, Enumeration and String have the same."""

_WARNING = 1
_DISCARD = 2
_ERROR = 3


class Step(Structure):
    """Data and result of a step; the environment with which `Slave` instantiates.

    The library ``hubslosh_batch`` has the same structure (``CStep``).
    """

    _fields_ = (
        ("component", c_void_p),
        ("set_float64", c_void_p),
        ("taken", c_size_t),
        ("taken_references", c_void_p),
        ("count", c_size_t),
        ("references", c_void_p),
        ("values", c_void_p),
        ("slopes", c_void_p),
        ("at", c_void_p),
        ("start", c_double),
        ("status", c_int),
        ("event", c_uint8),
        ("terminate", c_uint8),
        ("early_return", c_uint8),
        ("reached", c_double),
    )


class _Calls:
    """Interface of the instances of both interface types; a part of one of fmpy's classes."""

    _enumerations: Collection[int]
    _experiment: dict[str, Any]

    def _begin(self, variables: Mapping[str, ScalarVariable]) -> None:
        """Remember of an FMU's variables what the calls need; no experiment is set up yet."""
        self._enumerations = {
            v.valueReference for v in variables.values() if v.type == "Enumeration"
        }
        self._experiment = {}

    # by name of fmpy.fmi2, with lists

    def setupExperiment(self, **experiment: Any) -> None:
        """Keep tolerance, start and stop for `enterInitializationMode`."""
        self._experiment = experiment

    def enterInitializationMode(self) -> None:
        """Enter initialization mode with what `setupExperiment` was given."""
        super().enterInitializationMode(**self._experiment)  # type: ignore[misc]

    def setReal(self: Any, vr: Sequence[int], values: Sequence[float]) -> None:
        """Set Float64s."""
        self.setFloat64(vr, values)

    def getReal(self: Any, vr: Sequence[int]) -> list[float]:
        """Return Float64s."""
        return self.getFloat64(vr)

    def setInteger(self: Any, vr: Sequence[int], values: Sequence[int]) -> None:
        """Set Int32s and enumerations."""
        for reference, value in zip(vr, values, strict=True):
            wide = reference in self._enumerations
            (self.setInt64 if wide else self.setInt32)([reference], [value])

    def getInteger(self: Any, vr: Sequence[int]) -> list[int]:
        """Return Int32s and enumerations."""
        return [
            (self.getInt64 if reference in self._enumerations else self.getInt32)([reference])[0]
            for reference in vr
        ]


class Within(NamedTuple):
    """The library's functions for a step with inputs that go in lines."""

    address: int
    """Address of intermediateUpdate."""

    begin: Callable[[Any], Any]
    """Called with a pointer to the `Step` before fmi3DoStep: no other pointer is followed."""

    end: Callable[[Any], Any]
    """Called with the same pointer after fmi3DoStep."""


def _logger(say: Callable[[str], None]) -> Callable[..., None]:
    """Return a callback that hands the texts of messages on."""
    return lambda environment, status, category, text: say(text.decode(errors="replace"))


class Model(_Calls, FMU3Model):
    """A Model Exchange instance of ``fmpy.fmi3`` that is called like one of ``fmpy.fmi2``."""

    def instantiate(
        self,
        variables: Mapping[str, ScalarVariable],
        intermediate: Collection[str],
        say: Callable[[str], None],
        update: Within | None = None,
    ) -> None:
        """Instantiate, as `Slave.instantiate`; nothing is intermediate here."""
        self._begin(variables)
        super().instantiate(logMessage=_logger(say))

    def newDiscreteStates(self) -> tuple[Any, ...]:
        """Return what fmi3UpdateDiscreteStates says: that it is needed once more, and so on."""
        return tuple(self.updateDiscreteStates())


class Slave(_Calls, FMU3Slave):
    """A Co-Simulation instance of ``fmpy.fmi3`` that is called like one of ``fmpy.fmi2``."""

    def instantiate(
        self,
        variables: Mapping[str, ScalarVariable],
        intermediate: Collection[str],
        say: Callable[[str], None],
        update: Within | None = None,
    ) -> None:
        """Instantiate; ``say`` is given what the FMU logs.

        variables: of the FMU by name. intermediate: those that take part in intermediate update.
        update: functions of C that do what `_update` does, faster; None: there are none.
        """
        self._say = say
        self._within = update
        self._begin(variables)
        taken = sorted(
            variables[name].valueReference
            for name in intermediate
            if variables[name].causality == "input"
        )
        self._taken = np.array(taken, np.uint32)
        self.enumerations = np.array(sorted(self._enumerations), np.uint32)
        self._references = np.zeros(len(taken), np.uint32)
        self._values, self._slopes, self._at = np.zeros((3, len(taken)))
        self.made = Step(
            set_float64=ctypes.cast(self._functions["fmi3SetFloat64"], c_void_p),
            taken=len(taken),
            taken_references=self._taken.ctypes.data,
            references=self._references.ctypes.data,
            values=self._values.ctypes.data,
            slopes=self._slopes.ctypes.data,
            at=self._at.ctypes.data,
        )
        super().instantiate(
            logMessage=_logger(say),
            intermediateUpdate=(self._update if update is None else update.address)
            if taken
            else None,
            requiredIntermediateVariables=taken,
        )
        self.made.component = self.component

    def _call(self, name: str, *arguments: Any) -> Any:
        """Call a function of the FMU; `made` is the environment, for which fmpy has no argument."""
        if name == "fmi3InstantiateCoSimulation":
            environment = c_void_p(ctypes.addressof(self.made))
            arguments = (*arguments[:9], environment, *arguments[10:])
        return super()._call(name, *arguments)

    def _update(
        self,
        environment: Any,
        time: float,
        set_requested: bool,
        get_allowed: bool,
        step_finished: bool,
        can_return_early: bool,
        early_return_requested: Any,
        early_return_time: Any,
    ) -> None:
        """Set the inputs that go in lines to their values at ``time``, s; ask for no early return.

        As ``hubslosh_batch_intermediate_update``, for where there is no such library.
        """
        early_return_requested[0], early_return_time[0] = False, time
        made, n = self.made, self.made.count
        if not set_requested or not n:
            return
        at = self._values[:n] + self._slopes[:n] * (time - made.start)
        try:
            self.setFloat64(self._references[:n].tolist(), at.tolist())
        except FMICallException as error:  # nothing leaves a callback; the step's end says it
            made.status = max(made.status, error.status)

    # by name of fmpy.fmi2, with lists

    def setRealInputDerivatives(
        self, vr: Sequence[int], order: Sequence[int], values: Sequence[float]
    ) -> None:
        """Have inputs go with these slopes, per s, through the next step; others hold."""
        assert set(order) <= {1}, "lines alone"
        if untaken := [reference for reference in vr if reference not in self._taken]:
            self._say(f"inputs {untaken} (value references) are not set within a step")
            raise FMICallException(function="fmi3SetFloat64", status=_ERROR)
        n = len(vr)
        self._references[:n], self._values[:n], self._slopes[:n] = vr, self.getFloat64(vr), values
        self.made.count = n

    def doStep(
        self, currentCommunicationPoint: float, communicationStepSize: float, *_: Any
    ) -> None:
        """Make a step, to its end."""
        made = self.made
        made.start, made.status = currentCommunicationPoint, 0
        event, terminate, early = fmi3Boolean(), fmi3Boolean(), fmi3Boolean()
        reached = fmi3Float64()
        within = self._within if made.count else None
        if within:
            within.begin(byref(made))
        try:
            self.fmi3DoStep(
                self.component,
                currentCommunicationPoint,
                communicationStepSize,
                fmi3Boolean(True),
                byref(event),
                byref(terminate),
                byref(early),
                byref(reached),
            )
        finally:
            made.count = 0
            if within:
                within.end(byref(made))
        made.terminate, made.early_return = terminate.value, early.value
        made.reached = reached.value
        if made.status > _WARNING:
            raise FMICallException(function="fmi3SetFloat64", status=made.status)
        if made.terminate or made.early_return:
            self.explain()
            status = _DISCARD if made.terminate else _ERROR
            raise FMICallException(function="fmi3DoStep", status=status)

    def explain(self) -> None:
        """Say why the last step, which the FMU made, is no whole one."""
        if self.made.terminate:
            self._say("the FMU wants the simulation to end")
        elif self.made.early_return:
            reached = self.made.reached
            self._say(f"it returned early, at {reached} s, which it was not allowed to")

    getFMUstate = FMU3Slave.getFMUState
    setFMUstate = FMU3Slave.setFMUState
    freeFMUstate = FMU3Slave.freeFMUState
    serializeFMUstate = FMU3Slave.serializeFMUState
    deSerializeFMUstate = FMU3Slave.deserializeFMUState

    # by name of FMI 2.0, with C arrays

    def fmi2SetReal(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Set Float64s."""
        self.fmi3SetFloat64(c, vr, count, values, count)

    def fmi2GetReal(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Read Float64s."""
        self.fmi3GetFloat64(c, vr, count, values, count)

    def fmi2SetInteger(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Set Int32s and enumerations."""
        self.setInteger(vr[:count], values[:count])

    def fmi2GetInteger(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Read Int32s and enumerations."""
        for k, value in enumerate(self.getInteger(vr[:count])):
            values[k] = value

    def fmi2SetBoolean(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Set Booleans."""
        self.setBoolean(vr[:count], [value != 0 for value in values[:count]])

    def fmi2GetBoolean(self, c: Any, vr: Any, count: int, values: Any) -> None:
        """Read Booleans."""
        for k, value in enumerate(self.getBoolean(vr[:count])):
            values[k] = int(value)

    def fmi2SetRealInputDerivatives(
        self, c: Any, vr: Any, count: int, order: Any, values: Any
    ) -> None:
        """Have inputs go with these slopes through the next step, those that it takes there."""
        lines = zip(vr[:count], values[:count], strict=True)
        taken = {reference: slope for reference, slope in lines if reference in self._taken}
        self.setRealInputDerivatives(list(taken), [1] * len(taken), list(taken.values()))

    def fmi2DoStep(self, c: Any, time: float, step: float, *_: Any) -> None:
        """Make a step, to its end."""
        self.doStep(time, step)
