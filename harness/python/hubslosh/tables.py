"""Tables of numbers as files, .csv or .parquet by their names' endings, and files of parameters."""

import argparse
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import native, temporary
from .fmu import DefinedUnit, FmuError, Quantity, Value


def read_table(path: Path, columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Read columns of numbers from a .csv or .parquet file.

    A column ``time`` of dates or durations is read in seconds, dates from the first row. Integers
    of a Parquet file are refused as times: their unit is not known.
    """
    import pyarrow.csv
    import pyarrow.parquet

    try:
        if ending_of(path) == "csv":
            table = pyarrow.csv.read_csv(path)
        else:
            table = pyarrow.parquet.read_table(path)
    except (OSError, pyarrow.ArrowInvalid) as error:
        raise FmuError(f"{path} cannot be read: {error}") from None
    missing = [name for name in columns if name not in table.column_names]
    if missing:
        there = ", ".join(table.column_names)
        raise FmuError(f"{path} has no column {', '.join(missing)} (columns in it: {there})")
    return {name: _numbers(path, name, table[name]) for name in columns}


def _numbers(path: Path, name: str, column: Any) -> np.ndarray:
    """Return the numbers in a column of Arrow, times in s."""
    import pyarrow.compute
    import pyarrow.types

    kind, of = column.type, pyarrow.types
    if of.is_temporal(kind):
        if name != "time":
            raise FmuError(f"{path}: column {name} holds {kind} (allowed: numbers)")
        if of.is_date(kind) or of.is_timestamp(kind):
            first = pyarrow.compute.min_max(column.slice(0, 1))["min"]
            column = pyarrow.compute.subtract(column, first)
        elif of.is_time(kind):
            column = column.cast("time64[ns]").cast("int64").cast("duration[ns]")
        return column.cast("duration[ns]").cast("int64").to_numpy() / 1e9
    if name == "time" and of.is_integer(kind) and ending_of(path) == "parquet":
        raise FmuError(
            f"{path}: column time holds integers, and their unit is not known (allowed: "
            "floating-point numbers in s, dates, durations)"
        )
    if not (of.is_integer(kind) or of.is_floating(kind) or of.is_decimal(kind)):
        raise FmuError(f"{path}: column {name} holds {kind} (allowed: numbers)")
    return column.cast("float64").to_numpy()


def read_parameters(path: str | Path) -> dict[str, Quantity]:
    """Read a file of parameters: .toml, .ssv or .json.

    ``"name" = value`` as TOML (nested tables are names with dots), SSP 1.0's parameter set
    (``hubslosh tank --parameters`` writes both), or what ``hubslosh identify --out`` writes.

    A parameter of a .ssv with a unit is a pair (number, unit). The unit is that of the file's
    definitions, otherwise one of the FMU's; `Fmu.convert` converts it or refuses it.
    """
    if not isinstance(path, str | Path):
        raise FmuError(f"the file of parameters must be a path, not {path!r}")
    found, texts = native.read_parameters(Path(path))
    for text in texts:
        warnings.warn(f"{path}: {text}", native.FmuWarning, stacklevel=2)
    return {name: _with_unit(value, unit, base) for name, value, unit, base in found}


def _with_unit(value: Value, unit: str | None, base: tuple | None) -> Quantity:
    if unit is None or isinstance(value, str):
        return value
    if base is None:
        return value, unit
    exponents = dict(zip(DefinedUnit.EXPONENTS, base[0], strict=True))
    return value, DefinedUnit(unit, exponents, *base[1:])


def write_table(
    path: Path, table: Mapping[str, np.ndarray], notes: Mapping[str, str] | None = None
) -> None:
    """Write columns of numbers to a .csv or .parquet file without loss of digits.

    * ``notes``: Key-value metadata of a Parquet file. The file appears complete or not at all: it
      is written to a temporary folder next to its place, then moved.
    """
    import pyarrow.csv
    import pyarrow.parquet

    columns = pyarrow.table(dict(table)).replace_schema_metadata(dict(notes or {}))
    with temporary.output(path) as new:
        if ending_of(path) == "csv":
            pyarrow.csv.write_csv(columns, new)
        else:
            pyarrow.parquet.write_table(columns, new, compression="zstd")


def ending_of(path: Path) -> str:
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
