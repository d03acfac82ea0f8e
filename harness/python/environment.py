"""Creates a virtual environment, or reuses it if it is up to date; needs only Python.

As a program: ``python3 environment.py DIRECTORY REQUIREMENTS`` prints the interpreter's path.

``requirements*.in`` list the packages that the project's scripts need. ``requirements*.txt``, which
are made from them, list all packages with version and SHA-256, also for other systems and versions
of Python, so that a package index cannot deliver other files. After a change of a
``requirements*.in``, run the uv command in the first lines of the ``requirements*.txt``, from the
project's root.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

OLDEST = (3, 11)
"""Oldest version of Python on which the project's scripts run."""


def target() -> Path:
    """Return the directory for files that are built: Cargo's target directory."""
    root = Path(__file__).resolve().parents[2]
    return root / os.environ.get("CARGO_TARGET_DIR", "target")


def ensure(directory: Path, requirements: Path, *, hashes: bool = True) -> Path:
    """Return the interpreter of the virtual environment in ``directory``.

    Packages must have the SHA-256 that ``requirements`` lists, unless ``hashes`` is false. The
    environment is created again if the requirements file or the version of Python has changed. One
    process creates the environment, and other processes wait for it. If it cannot be created, the
    program exits with an error message.
    """
    with _alone(directory.with_name(directory.name + ".lock")):
        return _ensure(directory, requirements, hashes)


def run_again_in(name: str, missing: ModuleNotFoundError) -> NoReturn:
    """Run this program again in the environment of the ``requirements-<name>.txt`` next to it.

    ``missing`` is the error of the import of a package. If the program already runs in that
    environment, the environment is damaged, and the program exits with an error message.
    """
    here = target() / "python" / name
    if Path(sys.prefix) == here:
        sys.exit(f"error: {here} is damaged ({missing}); delete it and try again")
    python = ensure(here, Path(sys.argv[0]).with_name(f"requirements-{name}.txt"))
    sys.exit(subprocess.run([python, *sys.argv]).returncode)


def _ensure(directory: Path, requirements: Path, hashes: bool) -> Path:
    python = directory / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = directory / "made-from.txt"
    made_from = f"{sys.executable} {sys.version}\n{requirements.read_text()}"
    if python.exists() and stamp.exists() and stamp.read_text() == made_from:
        return python
    if sys.version_info < OLDEST:
        wanted, there = ".".join(map(str, OLDEST)), sys.version.split()[0]
        sys.exit(f"error: Python {wanted} or newer is needed; {sys.executable} is {there}")
    shutil.rmtree(directory, ignore_errors=True)
    _run(
        [sys.executable, "-m", "venv", str(directory)],
        f"the virtual environment {directory} could not be created; "
        "is Python's module venv installed (Debian: python3-venv)?",
    )
    _run(
        [
            str(python),
            "-m",
            "pip",
            "install",
            "--disable-pip-version-check",
            "--no-compile",  # most modules are never imported; Python compiles a module on import
            *(["--require-hashes"] if hashes else []),
            "-r",
            str(requirements),
        ],
        f"the packages of {requirements} could not be installed (see the output of pip)",
    )
    stamp.write_text(made_from)
    return python


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Lock the environment for a ``with`` statement, after waiting for other processes.

    The operating system also releases the lock if the process is killed.
    """
    lock.parent.mkdir(parents=True, exist_ok=True)
    with lock.open("a") as file:
        if os.name == "nt":
            import msvcrt

            while True:
                try:
                    msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
                    break
                except OSError:
                    time.sleep(0.1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _run(command: list[str], sentence: str) -> None:
    """Run ``command``. If it fails, print its output and exit with the message ``sentence``."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\nerror: {sentence}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python3 environment.py DIRECTORY REQUIREMENTS")
    print(ensure(Path(sys.argv[1]).absolute(), Path(sys.argv[2])))
