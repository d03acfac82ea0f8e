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
    r"""Read columns of numbers from a .csv or .parquet file; needs pyarrow.

    A column ``time`` of dates or durations is read in seconds, dates as seconds since the first
    row. Integers in the column ``time`` of a Parquet file are refused, because their unit is not
    known.

    Parameters
    ----------
    path : Path
        File whose name ends in .csv or .parquet.
    columns : sequence of str
        Names of the columns to read.

    Returns
    -------
    dict of ndarray
        Columns as floats by name.

    Raises
    ------
    FmuError
        If the file cannot be read, lacks a column, or a column is not of numbers.

    Examples
    --------
    >>> from pathlib import Path
    >>> import hubslosh
    >>> _ = Path("log.csv").write_text("time,omega\n0,0.1\n0.02,0.2\n")
    >>> hubslosh.read_table(Path("log.csv"), ["time", "omega"])
    {'time': array([0.  , 0.02]), 'omega': array([0.1, 0.2])}
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
    r"""Read a file of parameters: .toml, .ssv or .json.

    A .toml file has lines ``"name" = value``; nested tables give names with dots. An .ssv file is a
    parameter set of SSP 1.0. A .json file is a result of ``hubslosh identify --out``. ``hubslosh
    tank --parameters`` writes the first two kinds.

    Parameters
    ----------
    path : str or Path
        The file; the ending of the file's name states the format.

    Returns
    -------
    dict
        Values by name, for `simulate` and `Loop`. A parameter of a .ssv with a unit is a pair
        (number, unit), where the unit is defined by the file, or else by the FMU. `Fmu.convert`
        converts or refuses the value.

    Raises
    ------
    FmuError
        If the file cannot be read, or is not a file of parameters.

    Examples
    --------
    >>> from pathlib import Path
    >>> import hubslosh
    >>> _ = Path("bench.toml").write_text('tank.h = 0.05\n"slosh.model" = "spherical"\n')
    >>> hubslosh.read_parameters("bench.toml")
    {'tank.h': 0.05, 'slosh.model': 'spherical'}
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
    """Write columns of numbers to a .csv or .parquet file, with all digits; needs pyarrow.

    The file appears complete or not at all, because it is written to a temporary folder next to its
    place and then moved.

    Parameters
    ----------
    path : Path
        File whose name ends in .csv or .parquet.
    table : mapping of ndarray
        Columns of one length by name.
    notes : mapping of str, optional
        Key-value metadata of a Parquet file; a .csv has none.

    Raises
    ------
    FmuError
        If the name has another ending, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import hubslosh
    >>> hubslosh.write_table(Path("rate.csv"), {"time": np.arange(3) / 2, "omega": np.zeros(3)})
    >>> Path("rate.csv").read_text().splitlines()[-1]
    '1,0'
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
    """Return the ending of a table's file name, csv or parquet.

    Raises FmuError for other endings.
    """
    ending = path.suffix.lower().lstrip(".")
    if ending not in ("csv", "parquet"):
        raise FmuError(f"{path}: the name must end in .csv or .parquet")
    return ending


def setting(text: str) -> tuple[str, str]:
    """Return the name and the value in an argument NAME=VALUE of the command line.

    Parameters
    ----------
    text : str
        The argument.

    Returns
    -------
    tuple of str
        Name and value, without blanks around them.

    Raises
    ------
    argparse.ArgumentTypeError
        If the argument has no equals sign.

    Examples
    --------
    >>> import hubslosh
    >>> hubslosh.setting("tank.h=50 mm")
    ('tank.h', '50 mm')
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f'"{text}" is not of the form name=value')
    return name.strip(), value.strip()
