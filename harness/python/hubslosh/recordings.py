"""Recordings of loggers as tables of signals in SI units.

    python -m hubslosh.recordings bench.mf4 bench.csv

The compiled part of the package reads text in columns and Parquet. For each other kind of file, a
function of this module returns the columns, which are written as text and then read by the compiled
part, so that only one parser interprets units and times. The program ``hubslosh`` calls the command
above for such files.
"""

import csv
import gc
import sys
import warnings
from collections.abc import Callable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import native, temporary
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

# Largest number of values in a file, including unused columns; 20 million rows of three signals.
MOST_VALUES = 60_000_000
WIDEST = 100  # Largest number of columns of a matrix; a wider matrix is no table of signals
DEEPEST = 8  # Largest depth of nested structures


def read_recording(
    path: str | Path, columns: str | None = None, *, rate: float | None = None
) -> "pd.DataFrame":
    r"""Read a recording of a data logger as a table in SI units; time starts at the first sample.

    Parameters
    ----------
    path : str or Path
        Text in columns, Parquet, MATLAB's .mat (5 and 7.3, with timetables), HDF5, TDMS, MDF4 or
        Excel's .xlsx. Kinds other than text and plain Parquet need
        ``pip install hubslosh[recordings]``.
    columns : str, optional
        Columns of the signals with their units, such as
        ``"time=t:ms,tau_cmd=T:mNm,omega=gyro_z:deg/s"``. A signal that is not named here is read
        from the column with its own name.
    rate : float, optional
        Sampling rate, Hz, of a file without times.

    Returns
    -------
    DataFrame
        The signals by name: ``time`` (s), ``tau_cmd`` (N·m), ``omega`` (rad/s) and others; NaN
        where a row has no value. ``.attrs["units"]`` has their units. ``.attrs["notes"]`` says
        how the file was read: columns, units that the file does not state, origin of the clock.

    Raises
    ------
    FmuError
        If the file cannot be read, a column is missing, or a unit is not known. The message lists
        the columns of the file.

    Examples
    --------
    >>> from pathlib import Path
    >>> import hubslosh
    >>> _ = Path("bench.csv").write_text("t_ms,rate\n0,1.5\n20,1.8\n")
    >>> hubslosh.read_recording("bench.csv", "time=t_ms:ms,omega=rate:deg/s").round(4)
       time   omega
    0  0.00  0.0262
    1  0.02  0.0314
    """
    import pandas as pd

    if not isinstance(path, str | Path):
        raise FmuError(f"path must be the path of a file, not {type(path).__name__}")
    path = Path(path)
    found = native.read_recording(path, path, columns, rate)
    if found is None:
        with temporary.folder() as folder:
            text = folder / "recording.csv"
            try:
                convert(path, text)
            except FmuError as error:
                raise FmuError(f"the file {path} cannot be used: {error}") from None
            found = native.read_recording(text, path, columns, rate)
    signals, notes = found
    table = pd.DataFrame({name: np.frombuffer(values) for name, _, values in signals})
    table.attrs["units"] = {name: unit for name, unit, _ in signals}
    table.attrs["notes"] = notes
    return table


class Column(NamedTuple):
    """A column of a recording: name, values, and unit if the file states one."""

    name: str
    values: Any
    """Numbers, dates, durations or strings; a matrix has one signal in each column."""
    unit: str = ""
    time: np.ndarray | None = None
    """Times of the values, s, if each signal of the file has its own sampling times."""


def _matlab(path: Path) -> Iterator[Column]:
    import matio

    for _, (shape, _) in matio.whosmat(str(path)).items():
        _check_size(int(np.prod(shape)))
    for name, value in matio.load_from_mat(str(path), add_table_attrs=True).items():
        yield from _matlab_value(name, value)


def _matlab_value(name: str, value: Any, depth: int = 0) -> Iterator[Column]:
    """Yield the columns in the MATLAB variable ``name``.

    ``value`` is an array, a structure (whose fields are read in turn), or a timetable. ``depth`` is
    the number of structures around it.
    """
    if hasattr(value, "columns"):
        units = value.attrs.get("varUnits", ())
        if value.index.name:
            yield Column(f"{name}.{value.index.name}", value.index.to_numpy())
        for k, label in enumerate(value.columns):
            unit = str(units[k]) if k < len(units) else ""
            yield Column(f"{name}.{label}", value[label].to_numpy(), unit)
    elif getattr(value, "dtype", None) is not None and value.dtype.names and depth < DEEPEST:
        for k, element in enumerate(value.flat, 1):
            stem = f"{name}({k})" if value.size > 1 else name
            for field in value.dtype.names:
                yield from _matlab_value(f"{stem}.{field}", element[field], depth + 1)
    elif isinstance(value, np.ndarray):
        yield Column(name, value)


def _hdf5(path: Path) -> Iterator[Column]:
    import h5py

    with h5py.File(path) as file:
        names: list[str] = []
        file.visit(names.append)
        for name in names:
            item = file[name]
            if not isinstance(item, h5py.Dataset) or not item.shape:
                continue
            _check_size(item.size)
            unit = item.attrs.get("units", item.attrs.get("unit", ""))
            unit = unit.decode() if isinstance(unit, bytes) else str(unit)
            for field in item.dtype.names or [None]:
                values = item[field] if field else item[()]
                if h5py.check_string_dtype(values.dtype):
                    values = np.array([each.decode() for each in values.flat])
                yield Column(f"{name}.{field}" if field else name, values, unit)


def _tdms(path: Path) -> Iterator[Column]:
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        for channel in (channel for group in file.groups() for channel in group.channels()):
            _check_size(len(channel))
            known = channel.properties
            # the increment is 0 if the channel is no waveform
            time = channel.time_track() if known.get("wf_increment") else None
            name = f"{channel.group_name}/{channel.name}"
            yield Column(name, channel[:], str(known.get("unit_string", "")), time)


def _mdf(path: Path) -> Iterator[Column]:
    from asammdf import MDF

    with MDF(path) as file:
        _check_size(sum(group.channel_group.cycles_nr for group in file.groups))
        for signal in file.iter_channels():
            yield Column(signal.name, signal.samples, signal.unit or "", signal.timestamps)


def _parquet(path: Path) -> Iterator[Column]:
    import pyarrow.parquet
    from pyarrow import types

    _check_size(pyarrow.parquet.read_metadata(path).num_rows)
    table = pyarrow.parquet.read_table(path).flatten()
    for name, values in zip(table.column_names, table.columns, strict=True):
        if types.is_decimal(values.type):
            values = values.cast("float64")
        elif types.is_time(values.type):
            values = values.cast("time64[ns]").cast("int64").cast("duration[ns]")
        if types.is_primitive(values.type):
            yield Column(name, values.to_numpy())


def _excel(path: Path) -> Iterator[Column]:
    """Yield the columns of the first sheet; its header is found as in a text file."""
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True, data_only=True)
    rows = list(book.worksheets[0].iter_rows(values_only=True))
    for cells in zip_longest(*rows):
        texts = [each.isoformat(" ") if hasattr(each, "year") else each for each in cells]
        yield Column(str(texts[0] or ""), np.array(texts[1:], object))


class Kind(NamedTuple):
    """A file format that `read_recording` can read."""

    name: str
    start: bytes
    """First bytes of every file of this format."""
    endings: tuple[str, ...]
    columns: Callable[[Path], Iterator[Column]]


KINDS = (
    Kind("a .mat file", b"MATLAB", (".mat",), _matlab),
    Kind("HDF5", b"\x89HDF", (".h5", ".hdf5", ".hdf", ".nc"), _hdf5),
    Kind("TDMS", b"TDSm", (".tdms",), _tdms),
    Kind("MDF", b"MDF ", (".mf4", ".mdf"), _mdf),
    Kind("Parquet", b"PAR1", (".parquet",), _parquet),
    Kind("Excel's .xlsx", b"PK\x03\x04", (".xlsx", ".xlsm"), _excel),
)


def convert(path: Path, out: Path) -> None:
    """Write the columns of a recording as text in columns.

    Raises FmuError if the file cannot be read or has no columns. The message does not contain the
    file's name.
    """
    with path.open("rb") as file:
        start = file.read(16)
    named = [kind for kind in KINDS if path.suffix.lower() in kind.endings]
    signed = [kind for kind in KINDS if start.startswith(kind.start)]
    if not named and not signed:
        allowed = ", ".join(kind.name for kind in KINDS)
        raise FmuError(f"the format of the file is not known (allowed: text in columns, {allowed})")
    # a .mat file of version 7.3 is HDF5, but begins like .mat files of version 5
    kind = (signed or named)[0]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parts = [part for column in kind.columns(path) for part in _parts(column)]
        header, columns = _aligned(parts)
        words = ""
    except ModuleNotFoundError as error:
        words = f"{kind.name} needs the package {error.name}: pip install 'hubslosh[recordings]'"
    except Exception as error:  # libraries raise any exception if a file is damaged
        words = str(error) or type(error).__name__
    if words:
        # An incomplete MDF object raises an error when it is destroyed. Destroy it here, so that
        # the error does not appear later in other code.
        gc.collect()
        raise FmuError(words)
    with temporary.output(out) as new, new.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(zip_longest(*columns))


def _check_size(values: int) -> None:
    if values > MOST_VALUES:
        raise FmuError(f"the file holds {values} values (allowed: up to {MOST_VALUES})")


def _parts(column: Column) -> Iterator[Column]:
    """Yield the signals of ``column``, each with a list of values.

    A matrix has one signal for each column. Data that cannot be a signal are left out.
    """
    values = np.asarray(column.values)
    if values.ndim == 2 and values.shape[1] > values.shape[0]:
        values = values.T
    if not (0 < values.ndim < 3 and len(values) > 1 and np.size(values[0]) <= WIDEST):
        return
    values = values.reshape(len(values), -1)
    for k in range(values.shape[1]):
        name = f"{column.name}({k + 1})" if values.shape[1] > 1 else column.name
        cells = _cells(values[:, k])
        if cells is not None:
            yield column._replace(name=name, values=cells)


def _duration(ns: int) -> str:
    seconds, rest = divmod(ns, 10**9)
    days, left = divmod(seconds, 86400)
    return f"{days} days {left // 3600:02}:{left // 60 % 60:02}:{left % 60:02}.{rest:09}"


def _cells(values: np.ndarray) -> list | None:
    """Return the values of a signal as cells of a text file, or None if they are no signal."""
    if values.dtype.kind in "fiu":
        return values.tolist()
    if values.dtype.kind == "b":
        return [str(each).lower() for each in values.tolist()]
    if values.dtype.kind == "M":
        return np.datetime_as_string(values, unit="ns").tolist()
    if values.dtype.kind == "m":
        count = values.astype("timedelta64[ns]").astype(np.int64)
        return [_duration(n) for n in (count - min(count.min(), 0)).tolist()]
    if values.dtype.kind in "UO" and not any(isinstance(v, np.ndarray | dict) for v in values):
        return [None if each is None else str(each) for each in values.tolist()]
    return None


def _aligned(columns: list[Column]) -> tuple[list[str], list[list]]:
    """Return one table for all ``columns``: its header, and the cells of each row.

    If the columns have times of their own, the rows are all these times; otherwise row n has the
    value n of each column.
    """
    if not columns:
        raise FmuError("the file holds no vector or matrix of numbers")
    names = [
        " ".join(f"{name} [{unit}]".split()) if unit and not name.endswith("]") else name
        for name, _, unit, _ in columns
    ]
    rows = max(len(column.values) for column in columns)
    clocks = [column.time for column in columns if column.time is not None]
    if not clocks:
        _check_size(rows * len(columns))
        end = "no value: the column ends here, before others"
        return names, [
            [*column.values, end] if len(column.values) < rows else column.values
            for column in columns
        ]
    time = np.unique(np.concatenate(clocks))
    _check_size(len(time) * (len(columns) + 1))
    header, cells = ["time [s]"], [time.tolist()]
    for name, column in zip(names, columns, strict=True):
        if column.time is None:
            continue
        if not (np.diff(column.time) > 0).all():
            raise FmuError(f"the times of {name} do not increase")
        own = np.full(len(time), None, object)
        own[np.searchsorted(time, column.time)] = column.values
        header.append(name)
        cells.append(own.tolist())
    return header, cells


def main() -> None:
    """Convert a recording to text for the command ``hubslosh``, which calls this function."""
    if len(sys.argv) != 3:
        sys.exit("usage: python -m hubslosh.recordings FILE OUT.csv")
    try:
        convert(Path(sys.argv[1]), Path(sys.argv[2]))
    except FmuError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
