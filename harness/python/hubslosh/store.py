"""Stored runs of a Monte Carlo study, as JSON files in a folder.

``native.Store`` locks the folder and verifies the files.
"""

import json
import math
import warnings
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any, Self

import numpy as np

from .native import FmuWarning
from .native import Store as NativeStore

_NAMED = 3  # Largest number of damaged runs that a warning lists


def encoded(value: Any) -> Any:
    """Return a value in a form that JSON can store.

    Two values have the same JSON only if both type and value are equal. Raises TypeError for a
    value that cannot be stored.
    """
    match value:
        case np.generic() | np.ndarray() if not value.dtype.hasobject:
            array = np.asarray(value)
            kind = "array" if isinstance(value, np.ndarray) else "number"
            text = array.tobytes().hex()
            return {f"numpy {kind}": [array.dtype.descr, list(array.shape), text]}
        case None | bool() | int() | str() if type(value) in (type(None), bool, int, str):
            return value
        case float() if type(value) is float:
            return value if math.isfinite(value) else {"float": repr(value)}
        case complex() if type(value) is complex:
            return {"complex": [encoded(value.real), encoded(value.imag)]}
        case bytes() if type(value) is bytes:
            return {"bytes": value.hex()}
        case list() if type(value) is list:
            return [encoded(item) for item in value]
        case tuple() if type(value) is tuple:
            return {"tuple": [encoded(item) for item in value]}
        case dict() if type(value) is dict:
            return {"dict": [[encoded(key), encoded(item)] for key, item in value.items()]}
        case PurePath():
            return {"path": str(value)}
    raise TypeError(f"{value!r} of type {type(value).__name__}")


class Store:
    """The folder of a study, which is locked within a ``with`` statement."""

    def __init__(self, folder: str | Path, seed: int, ranges: Mapping[str, str]) -> None:
        # an absolute path, because the working directory changes while an FMU is loaded
        self.path = Path(folder).absolute()
        self._store = NativeStore.study(self.path, seed, list(ranges.items()))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._store.close()

    def rows(self, draws: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
        """Return the results of the stored runs by the numbers of the runs.

        ``draws`` has the values that the seed gives. A stored run that has other values, or that is
        damaged, is left out with a warning.
        """
        found, damaged = {}, []
        for run, drawn in enumerate(draws):
            data, damage = self._store.read(_name(run))
            row, why = ({}, damage) if data is None else _row(data, drawn, damage)
            if why:
                damaged.append(f"re-running run {run}: {why}")
            elif data is not None:
                found[run] = row
        if damaged:
            more = f"; and {len(damaged) - _NAMED} more" if len(damaged) > _NAMED else ""
            text = f"{self.path}: {'; '.join(damaged[:_NAMED])}{more}"
            warnings.warn(text, FmuWarning, stacklevel=3)
        return found

    def add(
        self, run: int, drawn: Mapping[str, Any], found: Mapping[str, float], **more: Any
    ) -> None:
        """Store the result of a run; the run is on the disk when the method returns."""
        row = {"run": run, "drawn": _texts(drawn), "found": _texts(found)} | more
        self._store.add(_name(run), (json.dumps(row) + "\n").encode())

    def finish(self, table: str) -> None:
        """Write the table of all runs, as CSV, and unlock the folder."""
        self._store.publish([("runs.csv", table.encode())])


def _row(
    data: bytes, draw: Mapping[str, Any], damage: str | None
) -> tuple[dict[str, Any], str | None]:
    """Return the results of a stored run, and None; or the reason why it cannot be used.

    The reason is a stored value that differs from the drawn value in ``draw`` or, if there is none,
    the ``damage`` of the file whose content is ``data``.
    """
    try:
        stored = json.loads(data)
        drawn = stored["drawn"]
        changed = [
            f"{name} is {json.dumps(drawn.get(name))}, but the seed gives {json.dumps(value)}"
            for name, value in _texts(draw).items()
            if json.dumps(drawn.get(name)) != json.dumps(value)
        ]
        row = {
            name: float(value["float"] if isinstance(value, dict) else value)
            for name, value in stored["found"].items()
        }
        more = {key: stored[key] for key in stored if key not in ("run", "drawn", "found")}
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        return {}, damage or f"the file is not the file of a run: {error!r}"
    return row | more, "; ".join(changed) or damage


def _name(run: int) -> str:
    return f"{run:06}"


def _texts(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: encoded(value) for name, value in values.items()}
