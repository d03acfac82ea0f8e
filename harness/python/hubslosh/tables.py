"""Tables of numbers as files, .csv or .parquet by their names' endings, and files of parameters."""

import argparse
import json
import math
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import temporary
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
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".toml":
            found = dict(_flatten("", tomllib.loads(text)))
        elif path.suffix == ".ssv":
            found = dict(_parameters_of(ET.fromstring(text)))
        elif path.suffix == ".json":
            found = _identified(json.loads(text), path)
        else:
            raise FmuError(f"{path}: the name must end in .toml, .ssv or .json")
    except (OSError, ValueError, ET.ParseError) as error:
        raise FmuError(f"{path} cannot be read: {error}") from None
    allowed = bool | int | float | str | tuple  # a tuple is a number with its unit
    wrong = [n for n, value in found.items() if not isinstance(value, allowed)]
    if wrong or not found:
        what = f"{', '.join(wrong)} must be numbers, true, false or texts" if wrong else "is empty"
        raise FmuError(f"{path}: {what}")
    return found


def _identified(result: object, path: Path) -> dict[str, Value]:
    """Return settings and estimates of a result of ``hubslosh identify``."""
    try:
        estimates = {name: e["value"] for name, e in result["parameters"].items()}
        return dict(result.get("settings", {})) | estimates
    except (KeyError, TypeError, AttributeError):
        raise FmuError(f"{path} is not a result of hubslosh identify") from None


def _flatten(prefix: str, table: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else key
        if isinstance(value, Mapping):
            yield from _flatten(name, value)
        else:
            yield name, value


_KINDS: Mapping[str, Callable[[str], Value]] = {
    "Real": float,
    "Integer": int,
    "Boolean": lambda text: _TRUTHS[text.strip()],
}
"""Converts the text of a parameter of this kind; others are texts."""

_TRUTHS = {"true": True, "1": True, "false": False, "0": False}
"""Values of xs:boolean."""


def _parameters_of(root: ET.Element) -> Iterator[tuple[str, Quantity]]:
    """Yield the parameters of SSP's parameter set, those with a unit as (number, unit)."""
    space = root.tag[: root.tag.find("}") + 1]
    units = dict(_units_of(root))
    seen = set()
    for parameter in root.iterfind(f"{space}Parameters/{space}Parameter"):
        value = next(iter(parameter), None)
        if value is None or "value" not in value.attrib or "name" not in parameter.attrib:
            raise FmuError("a Parameter without name or value")
        name, kind = parameter.attrib["name"], value.tag.removeprefix(space)
        if name in seen:
            raise FmuError(f"{name} is given twice")
        seen.add(name)
        try:
            number = _KINDS.get(kind, str)(value.attrib["value"])
        except (ValueError, KeyError):
            text = value.attrib["value"]
            raise FmuError(f"{name} cannot be {text!r} (allowed: a value of type {kind})") from None
        unit = value.get("unit")
        yield name, number if unit is None else (number, units.get(unit, unit))


def _units_of(root: ET.Element) -> Iterator[tuple[str, DefinedUnit]]:
    """Yield the units that a parameter set defines (SSP 1.0, section 4.5.3)."""
    for unit in root.iterfind("{*}Units/{*}Unit"):
        name, base = unit.get("name"), unit.find("{*}BaseUnit")
        if name is None or base is None:
            raise FmuError("a Unit without name or BaseUnit")
        try:
            exponents = {key: int(base.get(key, "0")) for key in DefinedUnit.EXPONENTS}
            factor, offset = (float(base.get(key, default)) for key, default in _SCALE.items())
        except ValueError as error:
            raise FmuError(f"the unit {name}: {error}") from None
        if not (math.isfinite(factor) and factor and math.isfinite(offset)):
            raise FmuError(f"the unit {name}: factor and offset must be finite, and factor not 0")
        yield name, DefinedUnit(name, exponents, factor, offset)


_SCALE = {"factor": "1", "offset": "0"}
"""Attributes of a BaseUnit, with their defaults."""


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
    ending = ending_of(path)
    try:
        with temporary.folder(path.parent, ".hubslosh-") as folder:
            beside = folder / path.name
            if ending == "csv":
                pyarrow.csv.write_csv(columns, beside)
            else:
                pyarrow.parquet.write_table(columns, beside, compression="zstd")
            beside.replace(path)
    except OSError as error:
        raise FmuError(f"{path} cannot be written: {error}") from None


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
