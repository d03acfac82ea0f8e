"""Tables of numbers as files, .csv or .parquet by their names' endings, and files of parameters."""

import argparse
import json
import os
import tempfile
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from .fmu import FmuError, Value


def read_table(path: Path, columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Read columns of numbers from a .csv or .parquet file."""
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
    return {name: table[name].to_numpy().astype(float) for name in columns}


def read_parameters(path: str | Path) -> dict[str, Value]:
    """Read a file of parameters: .toml, .ssv or .json.

    ``"name" = value`` as TOML (nested tables are names with dots), SSP 1.0's parameter set
    (``hubslosh tank --parameters`` writes both), or what ``hubslosh identify --out`` writes.
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
    wrong = [n for n, value in found.items() if not isinstance(value, bool | int | float | str)]
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


def _parameters_of(root: ET.Element) -> Iterator[tuple[str, Value]]:
    convert = {"Real": float, "Integer": int, "Boolean": lambda text: text in ("true", "1")}
    space = root.tag[: root.tag.find("}") + 1]
    for parameter in root.iterfind(f"{space}Parameters/{space}Parameter"):
        value = next(iter(parameter), None)
        if value is None or "value" not in value.attrib or "name" not in parameter.attrib:
            raise FmuError("a Parameter without name or value")
        kind = value.tag.removeprefix(space)
        yield parameter.attrib["name"], convert.get(kind, str)(value.attrib["value"])


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
    ending = ending_of(path)
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
