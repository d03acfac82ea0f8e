"""Temporary folders that go however the program ends; after a kill, at the next start.

The scheme is that of the program ``hubslosh`` (``harness/files/src/temporary.rs``). A folder
``hubslosh-…`` contains the folder ``files`` and a file ``alive``, which is locked while its process
lives. Either program removes the folders of both.
"""

import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from .native import FmuError, destination, put

PREFIX, ALIVE, FILES = "hubslosh-", "alive", "files"

if sys.platform == "win32":
    import msvcrt

    def try_lock(file: BinaryIO) -> bool:
        """Lock a file as ``std::fs::File::try_lock`` does; return whether nobody else has it."""
        try:
            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def try_lock(file: BinaryIO) -> bool:
        """Lock a file as ``std::fs::File::try_lock`` does; return whether nobody else has it."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


class _Folder:
    """A temporary folder and the lock that keeps it."""

    def __init__(self, parent: Path, prefix: str) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        draft = self.folder / "draft"
        self._alive = draft.open("wb")
        # Locked before it has its name, so that nobody finds it unlocked. Where there are no
        # locks, nobody takes it for dead either.
        with suppress(OSError):
            try_lock(self._alive)
        if sys.platform == "win32":
            self._alive.close()
            draft.replace(self.folder / ALIVE)
            self._alive = (self.folder / ALIVE).open("r+b")
            try_lock(self._alive)
        else:
            draft.replace(self.folder / ALIVE)
        self.files = self.folder / FILES
        self.files.mkdir()
        self._process = os.getpid()

    def remove(self) -> None:
        self._alive.close()
        if os.getpid() != self._process:
            return  # a fork has it from its parent
        shutil.rmtree(self.folder, ignore_errors=True)


@contextmanager
def folder(parent: Path | None = None, prefix: str = PREFIX) -> Iterator[Path]:
    """Yield a temporary folder, by default in the system's; it goes at the end.

    Folders there that killed processes have left are removed first.
    """
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    sweep(parent, prefix)
    made = _Folder(parent, prefix)
    try:
        yield made.files
    finally:
        made.remove()


@contextmanager
def output(path: Path) -> Iterator[Path]:
    """Yield a file that becomes the output ``path`` when all of it is written.

    Links of ``path`` are followed. A plain file is replaced; a device or a pipe gets the bytes.
    """
    place = destination(path)
    parent, prefix = (None, PREFIX) if place is None else (Path(place).parent, f".{PREFIX}")
    try:
        with folder(parent, prefix) as there:
            new = there / path.name
            yield new
            put(new, path)
    except OSError as error:
        raise FmuError(f"{path} cannot be written: {error}") from None


def sweep(parent: Path, prefix: str = PREFIX) -> None:
    """Remove the folders in ``parent`` whose processes no longer live."""
    with suppress(OSError):
        for path in parent.glob(f"{prefix}*"):
            with suppress(OSError):
                _remove_dead(path)


def _remove_dead(path: Path) -> None:
    alive = path / ALIVE
    # Opening a pipe could take for ever; a link could lead elsewhere.
    kinds = [os.lstat(each).st_mode for each in (path, alive)]
    if not stat.S_ISDIR(kinds[0]) or not stat.S_ISREG(kinds[1]):
        return
    with alive.open("rb+") as file:
        dead = try_lock(file)
    if dead:
        shutil.rmtree(path, ignore_errors=True)


def check_path(path: Any, ending: str) -> Path:
    """Return the path of a file whose name must have this ending, such as ``.mat``."""
    if not isinstance(path, str | os.PathLike):
        raise FmuError(f"the file's name is expected, not {path!r}")
    path = Path(path)
    if path.suffix.lower() != ending:
        raise FmuError(f"{path}: the name must end in {ending}")
    return path


def write_file(path: str | Path, ending: str, content: Callable[[], str | bytes]) -> None:
    """Write a text or bytes, which are made after the file's name was checked."""
    path = check_path(path, ending)
    with output(path) as new:
        made = content()
        new.write_bytes(made.encode() if isinstance(made, str) else made)
