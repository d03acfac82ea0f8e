"""Temporary folders, and output files that are never left incomplete.

A folder that remains because Python was killed is removed when the next folder is created. An
output is first written to a temporary file, which replaces the output when it is complete.
"""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .native import FmuError, Folder, destination, put


def folder(parent: Path | None = None, *, hidden: bool = False) -> Folder:
    """Return a temporary folder for a ``with`` statement, which removes the folder at its end.

    By default the new folder is in the system's folder for temporary files. First, this function
    removes folders that killed processes of Python or of the program have left.
    """
    return Folder(Path(tempfile.gettempdir()) if parent is None else parent, hidden)


@contextmanager
def output(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces the output ``path`` after it was written completely.

    Links are followed. If ``path`` leads to a device or a pipe, the bytes are written to it
    instead.
    """
    place = destination(path)
    # a device has no folder in which a temporary file could be created
    parent = None if place is None else Path(place).parent
    if parent is not None and not parent.is_dir():
        raise FmuError(f"{path} cannot be written: there is no folder {parent}")
    try:
        with folder(parent, hidden=parent is not None) as there:
            new = there / path.name
            yield new
            put(new, path)
    except OSError as error:
        raise FmuError(f"{path} cannot be written: {error}") from None


def check_path(path: Any, ending: str) -> Path:
    """Return the path of a file whose name must have this ending, such as ``.mat``."""
    if not isinstance(path, str | os.PathLike):
        raise FmuError(f"the name of a file must be a str or a Path, not {path!r}")
    path = Path(path)
    if path.suffix.lower() != ending:
        raise FmuError(f"{path}: the name must end in {ending}")
    return path


def write_file(path: str | Path, ending: str, content: Callable[[], str | bytes]) -> None:
    """Write text or bytes to a file, after checking that the file's name has the ending.

    ``content`` is a function that returns the text or the bytes; it is called after the check.
    """
    path = check_path(path, ending)
    with output(path) as new:
        made = content()
        new.write_bytes(made.encode() if isinstance(made, str) else made)
