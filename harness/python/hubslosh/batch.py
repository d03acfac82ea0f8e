"""A whole run of a Co-Simulation instance in one call.

The loop over the communication points is done by a small C library, ``hubslosh_batch``
(``harness/batch``), which calls the FMU's functions itself. Where there is no such library for this
platform, the same calls are made from here one by one: same numbers, some thirty times slower.
"""

import ctypes
import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from ctypes import POINTER, Structure, c_double, c_int, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import sharedLibraryExtension
from fmpy.fmi1 import FMICallException

from .feedback import Feedback, Linear
from .fmi3 import Slave, Step, Within
from .fmu import PLATFORM, FmuError, source_tree

FUNCTIONS = (
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetRealInputDerivatives",
    "fmi2DoStep",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
)
"""The functions of FMI 2.0 that a run calls; the library knows them by their places here."""

FUNCTIONS_3 = (
    "fmi3SetFloat64",
    "fmi3SetInt32",
    "fmi3SetInt64",
    "fmi3SetBoolean",
    "fmi3DoStep",
    "fmi3GetFloat64",
    "fmi3GetInt32",
    "fmi3GetInt64",
    "fmi3GetBoolean",
)
"""The functions of FMI 3.0 that a run calls."""

_NAMES_3 = (
    "fmi3SetFloat64",
    "fmi3SetInt32 or fmi3SetInt64",
    "fmi3SetBoolean",
    "fmi3SetFloat64",
    "fmi3DoStep",
    "fmi3GetFloat64",
    "fmi3GetInt32 or fmi3GetInt64",
    "fmi3GetBoolean",
)
"""Functions of FMI 3.0 in the order of FUNCTIONS."""

CONTROLLER = "controller"
"""In the place of a function's name: the controller of a closed loop ended the run."""

STATUS = ("fmi2OK", "fmi2Warning", "fmi2Discard", "fmi2Error", "fmi2Fatal", "fmi2Pending")


class Signals:
    """Variables of one type, with one row of values per communication point."""

    def __init__(self, references: Sequence[int], values: np.ndarray) -> None:
        """Take value references and as many columns of values."""
        self.references = np.array(references, np.uint32)
        self.values = np.ascontiguousarray(values)
        assert self.values.shape[1] == len(self.references)


@dataclass
class Rows:
    """A run: what goes in at each communication point, and the places for what comes out."""

    time: np.ndarray
    """s; the instance is at the first."""
    reals: Signals
    """Inputs, from each row to the next."""
    slopes: np.ndarray | None
    """Derivatives of the Real inputs from each row to the next; None: they are held."""
    integers: Signals
    """Inputs."""
    booleans: Signals
    """Inputs, 0 and 1."""
    real_outputs: Signals
    integer_outputs: Signals
    boolean_outputs: Signals


@dataclass(frozen=True)
class Stop:
    """Point at which a run stopped."""

    row: int
    """Communication point, from 0; outputs are there for all rows before it, and for its own too
    unless the function is one that gets."""
    function: str
    status: int


class _Instance(Structure):
    _fields_ = (("component", c_void_p), *((name, c_void_p) for name in FUNCTIONS))


class _Instance3(Structure):
    _fields_ = (
        ("component", c_void_p),
        *((name, c_void_p) for name in FUNCTIONS_3),
        ("enumerations", c_size_t),
        ("enumeration_references", c_void_p),
        ("step", POINTER(Step)),
    )


class _Signals(Structure):
    _fields_ = (("count", c_size_t), ("references", c_void_p), ("values", c_void_p))

    @classmethod
    def of(cls, signals: Signals) -> "_Signals":
        """Point to arrays, which must outlive this."""
        values = signals.values.ctypes.data
        return cls(len(signals.references), signals.references.ctypes.data, values)


class _Run(Structure):
    _fields_ = (
        ("rows", c_size_t),
        ("time", c_void_p),
        ("reals", _Signals),
        ("slopes", c_void_p),
        ("integers", _Signals),
        ("booleans", _Signals),
        ("real_outputs", _Signals),
        ("integer_outputs", _Signals),
        ("boolean_outputs", _Signals),
    )


class _Stop(Structure):
    _fields_ = (("row", c_size_t), ("function", c_int), ("status", c_int))


@cache
def library() -> ctypes.CDLL | None:
    """Return the library for this platform, or None if there is none.

    It is looked for at the environment variable HUBSLOSH_BATCH (empty: use none), in this package,
    and, in the source tree, where Cargo puts it.
    """
    if (named := os.environ.get("HUBSLOSH_BATCH")) is not None:
        return _load(Path(named)) if named else None
    prefix = "" if os.name == "nt" else "lib"
    name = f"{prefix}hubslosh_batch{sharedLibraryExtension}"
    packed = resources.files(__package__) / "lib" / PLATFORM / name
    if packed.is_file():
        # the package may be in a zip; a library must be a file
        return _load(_kept.enter_context(resources.as_file(packed)))
    if root := source_tree():
        target = root / os.environ.get("CARGO_TARGET_DIR", "target")
        for path in (target / "fmu" / name, target / "release" / name):
            if path.is_file():
                return _load(path)
    return None


_kept = ExitStack()
"""Files that live as long as the program."""

_VERSION = 4
"""Version of the library's interface."""


def _load(path: Path) -> ctypes.CDLL:
    try:
        loaded = ctypes.CDLL(str(path))
        version = loaded.hubslosh_batch_version()
    except (OSError, AttributeError) as error:
        raise FmuError(f"the library {path} cannot be used: {error}") from None
    if version != _VERSION:
        raise FmuError(f"the library {path} has interface {version}, not {_VERSION}; build it anew")
    loaded.hubslosh_batch_run.restype = c_int
    loaded.hubslosh_batch_loop.restype = c_int
    return loaded


def intermediate_update() -> Within | None:
    """Return the library's intermediateUpdate, for `Slave`; None without a library."""
    loaded = library()
    if loaded is None:
        return None
    address = ctypes.cast(loaded.hubslosh_batch_intermediate_update, c_void_p).value
    return Within(address, loaded.hubslosh_batch_begin_step, loaded.hubslosh_batch_end_step)


def run(fmu: Any, rows: Rows, feedback: Feedback | None = None) -> Stop | None:
    """Drive an instance through a run, by the library if there is one.

    fmu: ``fmpy.fmi2.FMU2Slave`` or `Slave`.

    At every communication point the outputs are read, then the inputs set and the step made; after
    the last step outputs are read once more. A controller acts between the two. Returns None at the
    end, or where it stopped: at the first call that answers neither fmi2OK nor fmi2Warning.
    """
    loaded = library()
    if loaded is None:
        return step_by_step(fmu, rows, feedback)
    slopes = None if rows.slopes is None else rows.slopes.ctypes.data
    arguments = _Run(
        len(rows.time),
        rows.time.ctypes.data,
        _Signals.of(rows.reals),
        slopes,
        _Signals.of(rows.integers),
        _Signals.of(rows.booleans),
        _Signals.of(rows.real_outputs),
        _Signals.of(rows.integer_outputs),
        _Signals.of(rows.boolean_outputs),
    )
    stop = _Stop()
    fmi, instance, names = _instance(fmu)
    if feedback is None:
        pointers = [ctypes.byref(item) for item in (instance, arguments, stop)]
        answer = loaded.hubslosh_batch_run(fmi, *pointers)
    else:
        structure, _kept = feedback.structure()
        pointers = [ctypes.byref(item) for item in (instance, arguments, structure, stop)]
        answer = loaded.hubslosh_batch_loop(fmi, *pointers)
    if answer == 0:
        return None
    assert answer == 1, "the arrays of a run have the lengths that they say"
    function = (*names, CONTROLLER)[stop.function]
    if function == "fmi3DoStep":
        fmu.explain()
    return Stop(stop.row, function, stop.status)


def _instance(fmu: Any) -> tuple[int, Structure, Sequence[str]]:
    """Return the version of FMI, the instance for the library, and the names of FUNCTIONS there."""

    def functions(names: Sequence[str]) -> list[c_void_p]:
        return [ctypes.cast(fmu._functions[name], c_void_p) for name in names]

    if not isinstance(fmu, Slave):
        return 2, _Instance(fmu.component, *functions(FUNCTIONS)), FUNCTIONS
    instance = _Instance3(
        fmu.component,
        *functions(FUNCTIONS_3),
        len(fmu.enumerations),
        fmu.enumerations.ctypes.data,
        ctypes.pointer(fmu.made),
    )
    return 3, instance, _NAMES_3


def step_by_step(fmu: Any, rows: Rows, feedback: Feedback | None = None) -> Stop | None:
    """Like `run`, with each call made from Python."""
    c = fmu.component

    def calls(name: str, signals: Signals, kind: Any, *more: Any, values: Any = None) -> Any:
        """Return a function that calls one of fmpy's for a row."""
        width = len(signals.references)
        array = signals.values if values is None else values
        start = array.ctypes.data
        size = array.itemsize * width
        references = signals.references.ctypes.data_as(POINTER(c_uint32))
        function = getattr(fmu, name)

        def call(k: int) -> None:
            place = ctypes.cast(start + k * size, POINTER(kind))
            function(c, references, width, *more, place)

        return call if width else None

    first = (c_int * len(rows.reals.references))(*([1] * len(rows.reals.references)))
    gets = [
        calls("fmi2GetReal", rows.real_outputs, c_double),
        calls("fmi2GetInteger", rows.integer_outputs, c_int),
        calls("fmi2GetBoolean", rows.boolean_outputs, c_int),
    ]
    sets = [
        calls("fmi2SetReal", rows.reals, c_double),
        calls("fmi2SetInteger", rows.integers, c_int),
        calls("fmi2SetBoolean", rows.booleans, c_int),
    ]
    if rows.slopes is not None:
        name = "fmi2SetRealInputDerivatives"
        sets.append(calls(name, rows.reals, c_double, first, values=rows.slopes))
    gets, sets = ([call for call in calls if call] for calls in (gets, sets))
    act = None if feedback is None else _closed(fmu, rows, feedback)
    time = rows.time.tolist()
    last = len(time) - 1
    for k, now in enumerate(time):
        try:
            for call in gets:
                call(k)
            if k < last:
                if act is not None and not act(k):
                    return Stop(k, CONTROLLER, 1)
                for call in sets:
                    call(k)
                fmu.fmi2DoStep(c, now, time[k + 1] - now, 1)
        except FMICallException as error:
            return Stop(k, error.function, error.status)
    return None


def _closed(fmu: Any, rows: Rows, feedback: Feedback) -> Callable[[int], bool]:
    """Return what a controller does at a row, and whether the run goes on."""
    c, width = fmu.component, len(feedback.command)
    controller = feedback.controller
    law = controller.law() if isinstance(controller, Linear) else controller
    measured, command = np.empty(len(feedback.measured)), np.empty(width)
    on_the_way = np.zeros((feedback.latency + 1, width))

    def exchange(function: Any, references: np.ndarray, values: np.ndarray) -> None:
        pointer = references.ctypes.data_as(POINTER(c_uint32))
        function(c, pointer, len(references), values.ctypes.data_as(POINTER(c_double)))

    def act(k: int) -> bool:
        cycle, part = divmod(k, feedback.parts)
        if k:
            feedback.commands[k] = feedback.commands[k - 1]
        if part == 0:
            exchange(fmu.fmi2GetReal, feedback.measured, measured)
            try:
                on_the_way[cycle % len(on_the_way)] = law(cycle, float(rows.time[k]), measured)
            except BaseException as error:
                feedback.error = error
                return False
        if part == feedback.switch and cycle >= feedback.latency:
            command[:] = on_the_way[(cycle - feedback.latency) % len(on_the_way)]
            feedback.commands[k] = command
            exchange(fmu.fmi2SetReal, feedback.command, command)
        return True

    return act
