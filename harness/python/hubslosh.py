"""Drives the HubSlosh FMU through fmpy with the torque that the harness uses.

The torque comes as rows of time (s) and ``tau_cmd`` (N·m). At every row the FMU is given the
torque and the slope of the chord to the next row, so that it sees straight lines; this is what
``hubslosh run`` does. All variables have their FMU names and SI units.

As a program::

    python hubslosh.py --fmu dist/HubSlosh.fmu --input torque.csv --out answer.csv \
        --set slosh.model=spherical --columns omega,slosh_angle
"""

import argparse
import difflib
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from ctypes import byref
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from fmpy import calloc, extract, fmi2, free, read_model_description
from fmpy.fmi1 import FMICallException, printLogMessage
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ScalarVariable

TORQUE = "tau_cmd"
"""The input that carries the torque, N·m."""

COLUMNS = ("omega", "omega_imu", "slosh_angle", "slosh_angle_radial")
"""What is recorded beside time and torque, unless asked otherwise."""

Value = float | int | bool | str

_INSTANCE = "hubslosh.Plant"
"""Name of our instances, by which the logger knows them."""

_messages: list[str] = []
"""What the FMU said during the present call."""


def _log(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
    """Keep the messages of our instances; print those of others, as fmpy does."""
    if name.decode() == _INSTANCE:
        _messages.append(message.decode(errors="replace"))
    else:
        printLogMessage(environment, name, status, category, message)


# fmpy fills in the messages' arguments with a C function that remembers one logger for all
# instances, the last it was told of: that logger must live as long as the program.
_CALLBACKS = fmi2.fmi2CallbackFunctions()
_CALLBACKS.logger = fmi2.fmi2CallbackLoggerTYPE(_log)
_CALLBACKS.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
_CALLBACKS.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
addLoggerProxy(byref(_CALLBACKS))


class FmuError(Exception):
    """What went wrong, in the FMU's own words where it has any."""


class Plant:
    """One co-simulation instance of the FMU, ready for its first step; its variables by name.

    Use it in a ``with`` statement: the unpacked FMU is removed at the end.
    """

    def __init__(
        self,
        fmu: Path | str,
        settings: Mapping[str, Value] | None = None,
        *,
        tolerance: float | None = None,
        start: float = 0.0,
        stop: float | None = None,
        torque: float = 0.0,
    ) -> None:
        """Unpack, instantiate and initialise.

        fmu: the packed FMU. settings: values of parameters and inputs by name, enumerations also
        by their items' names. tolerance: relative, for the FMU's solver; None: its own choice.
        start, stop: s. torque: ``tau_cmd`` at the start, N·m.
        """
        if not Path(fmu).is_file():
            raise FmuError(f"there is no FMU at {fmu}; cargo run --release -- pack makes it")
        self.time = start
        self._instance: Any = None
        self._directory = extract(str(fmu))
        try:
            description = read_model_description(str(fmu))
            self._variables = {v.name: v for v in description.modelVariables}
            if description.fmiVersion != "2.0" or description.coSimulation is None:
                raise FmuError(f"{fmu} is not an FMU for co-simulation by FMI 2.0")
            self._instance = fmi2.FMU2Slave(
                guid=description.guid,
                modelIdentifier=description.coSimulation.modelIdentifier,
                unzipDirectory=self._directory,
                instanceName=_INSTANCE,
            )
            self._call("instantiate", callbacks=_CALLBACKS)
            for name, value in (settings or {}).items():
                self.set(name, value)
            self._call("setupExperiment", tolerance=tolerance, startTime=start, stopTime=stop)
            self._call("enterInitializationMode")
            self.set(TORQUE, torque)
            self._call("exitInitializationMode")
        except BaseException:
            self.close()
            raise

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
        """Free the instance and remove the unpacked FMU."""
        if self._instance is not None:
            self._instance.freeInstance()
            self._instance = None
        shutil.rmtree(self._directory, ignore_errors=True)

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with these causalities ("output", "local", …)."""
        return [v.name for v in self._variables.values() if v.causality in causalities]

    def set(self, name: str, value: Value) -> None:
        """Set a parameter or an input, in SI units; an enumeration by item or number."""
        variable = self._variable(name)
        setter, convert = {
            "Real": ("setReal", float),
            "Integer": ("setInteger", int),
            "Enumeration": ("setInteger", lambda v: _item(variable, v)),
            "Boolean": ("setBoolean", _boolean),
            "String": ("setString", str),
        }[variable.type]
        try:
            converted = convert(value)
        except ValueError as error:
            raise FmuError(f"{name} cannot be {value!r}: {error}") from None
        self._call(setter, [variable.valueReference], [converted])

    def get(self, names: Sequence[str]) -> list[float]:
        """Return the present values of numeric variables; booleans as 0 and 1."""
        values: dict[str, float] = {}
        for kinds, getter in (
            (("Real",), "getReal"),
            (("Integer", "Enumeration"), "getInteger"),
            (("Boolean",), "getBoolean"),
        ):
            some = [n for n in names if self._variable(n).type in kinds]
            if some:
                references = [self._variables[n].valueReference for n in some]
                values.update(zip(some, self._call(getter, references), strict=True))
        missing = [n for n in names if n not in values]
        if missing:
            raise FmuError(f"{', '.join(missing)}: only numbers can be read")
        return [float(values[n]) for n in names]

    def step(self, end: float, torque: float | None = None, slope: float | None = None) -> None:
        """Go on to the time ``end`` (s).

        torque: at the beginning of the step, N·m; None: as it is. slope: its derivative during
        the step, N·m/s; None: the torque is held.
        """
        reference = [self._variables[TORQUE].valueReference]
        if torque is not None:
            self._call("setReal", reference, [torque])
        if slope is not None:
            self._call("setRealInputDerivatives", reference, [1], [slope])
        self._call("doStep", self.time, end - self.time)
        self.time = end

    def follow(
        self,
        time: Sequence[float],
        torque: Sequence[float],
        slope: Sequence[float] | None,
        columns: Sequence[str],
    ) -> np.ndarray:
        """Go from row to row of a torque history and return ``columns`` at every row.

        time: s, from the present time on, growing. torque: ``tau_cmd`` there, N·m. slope: its
        derivative until the next row, N·m/s; None: the torque is held. Returns one row per time.

        These are the calls of `set`, `step` and `get`, with arguments made once for all rows.
        """
        kinds = {name: self._variable(name).type for name in columns}
        reals = [name for name in columns if kinds[name] == "Real"]
        others = [name for name in columns if kinds[name] != "Real"]
        fmu, c = self._instance, self._instance.component
        wanted = (fmi2.fmi2ValueReference * len(reals))(
            *(self._variables[name].valueReference for name in reals)
        )
        values = (fmi2.fmi2Real * len(reals))()
        read = np.frombuffer(values)
        place = (fmi2.fmi2ValueReference * 1)(self._variables[TORQUE].valueReference)
        first = (fmi2.fmi2Integer * 1)(1)
        tau, rise = (fmi2.fmi2Real * 1)(), (fmi2.fmi2Real * 1)()
        answer = np.empty((len(time), len(columns)))
        last = len(time) - 1
        for k, now in enumerate(time):
            _messages.clear()
            try:
                fmu.fmi2GetReal(c, wanted, len(reals), values)
                answer[k, : len(reals)] = read
                if others:
                    answer[k, len(reals) :] = self.get(others)
                if k == last:
                    break
                tau[0] = torque[k]
                fmu.fmi2SetReal(c, place, 1, tau)
                if slope is not None:
                    rise[0] = slope[k]
                    fmu.fmi2SetRealInputDerivatives(c, place, 1, first, rise)
                fmu.fmi2DoStep(c, now, time[k + 1] - now, fmi2.fmi2True)
            except FMICallException as error:
                said = " ".join([str(error), *_messages])
                raise FmuError(f"the run stopped at t = {now} s: {said}") from None
            self.time = time[k + 1]
        order = [*reals, *others]
        return answer[:, [order.index(name) for name in columns]]

    def save(self) -> tuple[float, bytes]:
        """Return the time (s) and the serialized state, for `restore` of any instance."""
        state = self._call("getFMUstate")
        try:
            return self.time, self._call("serializeFMUstate", state)
        finally:
            self._call("freeFMUstate", state)

    def restore(self, saved: tuple[float, bytes]) -> None:
        """Go back to what `save` returned, here or in another instance."""
        state = self._call("deSerializeFMUstate", saved[1])
        try:
            self._call("setFMUstate", state)
        finally:
            self._call("freeFMUstate", state)
        self.time = saved[0]

    def _variable(self, name: str) -> ScalarVariable:
        if name not in self._variables:
            close = difflib.get_close_matches(name, self._variables, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            raise FmuError(f"the FMU has no variable {name}{hint}")
        return self._variables[name]

    def _call(self, function: str, *args: Any, **kwargs: Any) -> Any:
        """Call a function of fmpy's instance; an error carries what the FMU logged."""
        _messages.clear()
        try:
            return getattr(self._instance, function)(*args, **kwargs)
        except FMICallException as error:
            raise FmuError(" ".join([str(error), *_messages])) from None


def _item(variable: ScalarVariable, value: Value) -> int:
    """Return the number of an enumeration's item."""
    items = {item.name: int(item.value) for item in variable.declaredType.items}
    if value in items:
        return items[str(value)]
    try:
        return int(value)
    except ValueError:
        raise ValueError(f"there are {', '.join(items)}") from None


def _boolean(value: Value) -> bool:
    """Return a truth value; texts are true or false."""
    if not isinstance(value, str):
        return bool(value)
    if value not in ("true", "false"):
        raise ValueError("there are true, false")
    return value == "true"


def drive(
    fmu: Path | str,
    time: Sequence[float] | np.ndarray,
    torque: Sequence[float] | np.ndarray,
    settings: Mapping[str, Value] | None = None,
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

    Returns the columns ``time``, ``tau_cmd`` and ``columns``, one row per communication point.
    """
    t, tau = np.asarray(time, float).tolist(), np.asarray(torque, float).tolist()
    if len(t) != len(tau) or len(t) < 2:
        raise FmuError(f"a torque history needs two rows or more, not {len(t)} and {len(tau)}")
    if hold:
        rise = None
    elif slope is None:
        rise = (np.diff(tau) / np.diff(t)).tolist()
    else:
        rise = np.asarray(slope, float).tolist()
        if len(rise) != len(t):
            raise FmuError(f"a slope for each of the {len(t)} rows is needed, not {len(rise)}")
    with Plant(fmu, settings, tolerance=tolerance, start=t[0], stop=t[-1], torque=tau[0]) as plant:
        values = plant.follow(t, tau, rise, columns).T
    return {"time": np.array(t), TORQUE: np.array(tau)} | dict(zip(columns, values, strict=True))


def read_table(path: Path, columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Read columns of numbers from a .csv or .parquet file."""
    import pyarrow.csv
    import pyarrow.parquet

    try:
        if _format(path) == "csv":
            table = pyarrow.csv.read_csv(path)
        else:
            table = pyarrow.parquet.read_table(path)
    except (OSError, pyarrow.ArrowInvalid) as error:
        raise FmuError(f"{path} cannot be read: {error}") from None
    missing = [name for name in columns if name not in table.column_names]
    if missing:
        there = ", ".join(table.column_names)
        raise FmuError(f"{path} has no column {', '.join(missing)} (columns in it: {there})")
    return {name: table[name].to_numpy().astype(float) for name in columns}


def write_table(
    path: Path, table: Mapping[str, np.ndarray], notes: Mapping[str, str] | None = None
) -> None:
    """Write columns of numbers to a .csv or .parquet file; every digit comes back.

    notes: for a Parquet file's key-value metadata. The file appears whole or not at all: it is
    written beside its place under another name, then renamed.
    """
    import pyarrow.csv
    import pyarrow.parquet

    columns = pyarrow.table(dict(table)).replace_schema_metadata(dict(notes or {}))
    ending = _format(path)
    try:
        handle, name = tempfile.mkstemp(prefix=".hubslosh-", dir=path.parent)
        os.close(handle)
        beside = Path(name)
        try:
            if ending == "csv":
                pyarrow.csv.write_csv(columns, beside)
            else:
                pyarrow.parquet.write_table(columns, beside, compression="zstd")
            # mkstemp's permissions are for secrets; give it those of any new file
            mask = os.umask(0)
            os.umask(mask)
            beside.chmod(0o666 & ~mask)
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise FmuError(f"{path} cannot be written: {error}") from None


def _format(path: Path) -> str:
    """Return csv or parquet."""
    ending = path.suffix.lower().lstrip(".")
    if ending not in ("csv", "parquet"):
        raise FmuError(f"{path}: the name must end in .csv or .parquet")
    return ending


def setting(text: str) -> tuple[str, str]:
    """Return name and value of an argument NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f'"{text}" is not of the form name=value')
    return name.strip(), value.strip()


def main() -> None:
    """Read a torque history, drive the FMU, write the answer."""
    parser = argparse.ArgumentParser(description="Drives the HubSlosh FMU through fmpy.")
    parser.add_argument("--fmu", type=Path, default=Path("dist/HubSlosh.fmu"), metavar="FILE")
    parser.add_argument(
        "--input", type=Path, required=True, metavar="FILE",
        help="columns time (s) and tau_cmd (N.m), .csv or .parquet",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    parser.add_argument(
        "--set", type=setting, action="append", default=[], metavar="NAME=VALUE", dest="settings",
        help="a parameter or an input by its FMU name, SI units",
    )  # fmt: skip
    parser.add_argument("--tolerance", type=float, help="relative, for the FMU's solver")
    parser.add_argument("--hold", action="store_true", help="hold the torque from row to row")
    parser.add_argument("--columns", default=",".join(COLUMNS), metavar="NAME,…")
    args = parser.parse_args()
    try:
        _format(args.out)
        torque = read_table(args.input, ["time", TORQUE])
        answer = drive(
            args.fmu, torque["time"], torque[TORQUE], dict(args.settings),
            tolerance=args.tolerance, hold=args.hold, columns=args.columns.split(","),
        )  # fmt: skip
        write_table(args.out, answer)
    except FmuError as error:
        sys.exit(f"error: {error}")
    print(f"{len(answer['time'])} rows in {args.out}")


if __name__ == "__main__":
    main()
