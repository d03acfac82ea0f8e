"""Folder of a study: one file per run, checked by SHA-256, held by one process at a time.

The layout is that of a campaign's directory (``harness/experiments/src/campaign/folder.rs``)::

    study.json          seed and ranges
    runs/000017.json    one run, complete as soon as it has this name
    runs.csv            the table, written when the last run is there
    manifest.sha256     SHA-256 of all of these, as ``sha256sum --check`` reads it
    .lock               locked by the process that holds the folder, with its number
    .unfinished/        files that are being written; removed at the next start

A run's line is added to the manifest before the run gets its name. Therefore a run without a line,
or with another SHA-256 than its last line, has been changed from outside.
"""

import errno
import hashlib
import json
import math
import os
import re
import shutil
import time
from collections.abc import Mapping
from io import RawIOBase
from pathlib import Path, PurePath
from typing import Any, BinaryIO, Self

import numpy as np

from .fmu import FmuError
from .native import put
from .temporary import try_lock

FORMAT = 2
"""Format of the files; 1: ``runs.csv`` without types and hashes (HubSlosh 0.5.0)."""

STUDY, TABLE, RUNS, MANIFEST = "study.json", "runs.csv", "runs", "manifest.sha256"
LOCK, UNFINISHED = ".lock", ".unfinished"

_LINE = re.compile(r"([0-9a-f]{64})  (.+)")
"""A line of the manifest."""

_NAMED = 3
"""Damaged runs that a message names."""


def encoded(value: Any) -> Any:
    """Return a value for JSON; two values have the same JSON only if type and value are equal.

    Raises TypeError for a value that has no such form.
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


def decoded(value: Any) -> float:
    """Return a number from its JSON."""
    return float(value["float"] if isinstance(value, dict) else value)


def read_manifest(path: Path) -> dict[str, str]:
    """Return the last SHA-256 of each file; a last line that a kill cut off does not count.

    Raises FmuError if another line is not one of a manifest.
    """
    *lines, _cut = path.read_text(encoding="utf-8").split("\n")
    found = {}
    for number, line in enumerate(lines, 1):
        if not (parts := _LINE.fullmatch(line)):
            raise FmuError(
                f"line {number} of {path} is damaged: {line!r:.120} (allowed: SHA-256, two "
                "spaces, name); restore the file, or use another folder"
            )
        found[parts[2]] = parts[1]
    return found


class Store:
    """A study's folder, held from ``with`` to its end."""

    def __init__(self, folder: str | Path, seed: int, ranges: Mapping[str, Any]) -> None:
        """Store the definition of the study: its seed, and a text for each range."""
        # Absolute: loading an FMU changes the working directory for a moment.
        self.path = Path(folder).absolute()
        self.study = {"format": FORMAT, "seed": seed, "ranges": dict(ranges)}
        self._sums: dict[str, str] = {}
        self._manifest: RawIOBase | None = None
        self._lock: BinaryIO | None = None

    def __enter__(self) -> Self:
        """Lock the folder and read what is there."""
        try:
            self._refuse_others()
            (self.path / RUNS).mkdir(parents=True, exist_ok=True)
            self._hold()
            self._open()
        except (OSError, ValueError) as error:
            self.__exit__()
            raise FmuError(f"the study's folder {self.path}: {error}") from None
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Release the folder."""
        if self._manifest is not None:
            self._manifest.close()
        if self._lock is not None:
            shutil.rmtree(self.path / UNFINISHED, ignore_errors=True)
            self._lock.close()
        self._manifest = self._lock = None

    def _refuse_others(self) -> None:
        """Raise FmuError if the folder holds something else than a study of this format."""
        if (self.path / "plan.toml").exists() or any((self.path / RUNS).glob("*.parquet")):
            raise FmuError(f"{self.path} holds a campaign; give another folder")
        if (self.path / STUDY).exists():
            there = json.loads((self.path / STUDY).read_text(encoding="utf-8"))
            if not isinstance(there, dict) or there.get("format") != FORMAT:
                raise FmuError(
                    f"{self.path} holds a study of another version of HubSlosh, without types and "
                    "hashes; give another folder"
                )
        elif (self.path / TABLE).exists() or any((self.path / RUNS).glob("*")):
            raise FmuError(
                f"{self.path} has {TABLE} or {RUNS}/ but no {STUDY}: it is not a study's folder, "
                f"or {STUDY} was removed; give another folder"
            )

    def _hold(self) -> None:
        """Lock the folder, or say who holds it."""
        self._lock = (self.path / LOCK).open("a+b")
        if not try_lock(self._lock):
            who, age = "", 0.0
            try:
                who = (self.path / LOCK).read_text(encoding="utf-8").strip()
                age = time.time() - (self.path / LOCK).stat().st_mtime
            except (OSError, ValueError):
                pass  # Windows lets nobody read a locked file
            self._lock.close()
            self._lock = None
            raise FmuError(
                f"{self.path} is held by another study{': ' if who else ''}{who}, for {age:.0f} s; "
                "wait for its end, or give another folder"
            )
        self._lock.truncate(0)
        self._lock.write(f"process {os.getpid()}, monte_carlo".encode())
        self._lock.flush()

    def _open(self) -> None:
        """Read the manifest and the study, and prepare for writing."""
        shutil.rmtree(self.path / UNFINISHED, ignore_errors=True)
        (self.path / UNFINISHED).mkdir()
        study, manifest = self.path / STUDY, self.path / MANIFEST
        text = (json.dumps(self.study, indent=2) + "\n").encode()
        if study.exists() and (data := study.read_bytes()) != text:
            self._compare(json.loads(data))
        if manifest.exists():
            found = read_manifest(manifest)
            self._sums = {
                name: sum_ for name, sum_ in found.items() if (self.path / name).is_file()
            }
            if study.exists():
                self._sums[STUDY] = hashlib.sha256(text).hexdigest()
            self._write_manifest()
        elif study.exists():
            raise FmuError(
                f"{manifest} is missing: without it nothing verifies the stored runs; restore it, "
                "or give another folder"
            )
        self._manifest = manifest.open("ab", buffering=0)
        if not study.exists():
            self._publish(STUDY, text)

    def _write_manifest(self) -> None:
        """Replace the manifest by one with a line for each file."""
        text = "".join(f"{self._sums[name]}  {name}\n" for name in sorted(self._sums))
        draft = self.path / UNFINISHED / MANIFEST
        _write(draft, text.encode())
        put(draft, self.path / MANIFEST)

    def _publish(self, name: str, data: bytes) -> None:
        """Write a file: its line in the manifest first, then under its name."""
        assert self._manifest is not None
        draft = self.path / UNFINISHED / Path(name).name
        _write(draft, data)
        sum_ = hashlib.sha256(data).hexdigest()
        line = f"{sum_}  {name}\n".encode()
        end = self._manifest.seek(0, os.SEEK_END)
        try:
            if self._manifest.write(line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path / MANIFEST))
            os.fsync(self._manifest.fileno())
        except OSError:
            self._manifest.truncate(end)  # half a line would damage the next one
            raise
        put(draft, self.path / name)
        self._sums[name] = sum_

    def _compare(self, there: dict[str, Any]) -> None:
        """Raise FmuError with what differs between the study there and this one."""
        names = ["seed"] if there.get("seed") != self.study["seed"] else []
        mine, other = self.study["ranges"], there.get("ranges", {})
        names += [n for n in (*mine, *other) if mine.get(n) != other.get(n)]
        what = ", ".join(dict.fromkeys(names)) or "the order of the names"
        raise FmuError(f"{self.path} holds another study, different in {what}; give another folder")

    def rows(self, draws: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
        """Return the results of each stored run, by number; draws: the values by the seed.

        Raises FmuError if a stored run was changed, or if its values are not the draws.
        """
        found, wrong = {}, []
        for path in sorted((self.path / RUNS).iterdir()):
            try:
                run, row, why = self._row(path, draws)
            except OSError as error:
                raise FmuError(f"{path} cannot be read: {error}") from None
            if why:
                wrong.append(f"{RUNS}/{path.name} {why}")
            elif row is not None:
                found[run] = row
        if wrong:
            more = f"; and {len(wrong) - _NAMED} more" if len(wrong) > _NAMED else ""
            raise FmuError(
                f"{self.path}: stored runs were changed from outside: "
                f"{'; '.join(wrong[:_NAMED])}{more}. Remove these files to simulate their runs "
                "again"
            )
        return found

    def _row(
        self, path: Path, draws: list[dict[str, Any]]
    ) -> tuple[int, dict[str, Any] | None, str]:
        """Return the number of a stored run, what was found, and what is wrong with the file."""
        number = re.fullmatch(r"([0-9]{6,})\.json", path.name)
        name = f"{RUNS}/{path.name}"
        if not number or not path.is_file() or path.name != _file(int(number[1])):
            return 0, None, "is not a run of a study"
        run = int(number[1])
        if run >= len(draws) and name in self._sums:
            return run, None, ""  # of a longer study, which verifies it
        data = path.read_bytes()
        same = self._sums.get(name) == hashlib.sha256(data).hexdigest()
        try:
            stored = json.loads(data)
            drawn = stored["drawn"]
            changed = [
                f"{key} is {json.dumps(drawn.get(key))}, the seed gives {json.dumps(value)}"
                for key, value in _drawn(draws[run] if run < len(draws) else {}).items()
                if json.dumps(drawn.get(key)) != json.dumps(value)
            ]
            row = {key: decoded(value) for key, value in stored["found"].items()}
            row |= {key: stored[key] for key in stored if key not in ("run", "drawn", "found")}
        except (ValueError, TypeError, KeyError, AttributeError):
            same, changed, row = False, [], {}
        if changed:
            return run, None, f"is not run {run} of this seed: {'; '.join(changed)}"
        if name not in self._sums:
            return run, None, f"has no line in {MANIFEST}"
        if not same:
            return run, None, f"has another SHA-256 than {MANIFEST} says"
        return run, row, ""

    def add(
        self, run: int, drawn: Mapping[str, Any], found: Mapping[str, float], **more: Any
    ) -> None:
        """Store a run; it is on the disk when this returns."""
        numbers = {name: encoded(value) for name, value in found.items()}
        row = {"run": run, "drawn": _drawn(drawn), "found": numbers} | more
        try:
            self._publish(f"{RUNS}/{_file(run)}", (json.dumps(row) + "\n").encode())
        except OSError as error:
            raise FmuError(f"{self.path}: run {run} cannot be stored: {error}") from None

    def finish(self, table: str) -> None:
        """Write the table of all runs, as CSV."""
        try:
            self._publish(TABLE, table.encode())
            assert self._manifest is not None
            self._manifest.close()  # Windows replaces no open file
            self._manifest = None
            self._write_manifest()
        except OSError as error:
            raise FmuError(f"{self.path / TABLE} cannot be written: {error}") from None


def _file(run: int) -> str:
    return f"{run:06}.json"


def _drawn(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: encoded(value) for name, value in values.items()}


def _write(path: Path, data: bytes) -> None:
    """Write a file to the disk."""
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
