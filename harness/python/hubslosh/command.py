"""Calls of the program ``hubslosh``, which comes with the wheel or from a build of the source.

The program runs each FMU in a process of its own, so that an FMU that crashes does not end Python.
It sends progress and results over its standard output as JSON text sequences (RFC 7464).
"""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from threading import Thread
from typing import Any

from .fmu import FmuError, source_tree, text_of
from .progress import Line, Progress


def find_program(path: str | Path | None = None) -> Path:
    """Return the path of the program ``hubslosh``.

    The search order is ``path``, the environment variable HUBSLOSH, the folder in which pip
    installs scripts, PATH, and the source tree.
    """
    exe = "hubslosh.exe" if os.name == "nt" else "hubslosh"
    named = path or os.environ.get("HUBSLOSH")
    if named:
        found = shutil.which(str(named))
        if found is None:
            raise FmuError(f"there is no program at {named}")
        return Path(found)
    root = source_tree()
    if not root and (packed := next(filter(os.path.isfile, _scripts(exe)), None)):
        return packed
    if found := shutil.which(exe):
        return Path(found)
    if root:
        built = root / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / exe
        if built.is_file():
            return built
    raise FmuError(
        "the program hubslosh was not found. The wheel of this package contains it; in the "
        "project's source, cargo build --release builds it. Put it on PATH, set the environment "
        "variable HUBSLOSH to its path, or give program="
    )


def _scripts(exe: str) -> Iterator[Path]:
    """Yield the paths at which pip may have installed the program named ``exe``.

    These are in the scripts of this environment, the scripts of the user, and the folder next to
    this package, for ``pip install --target``.
    """
    yield Path(sysconfig.get_path("scripts")) / exe
    yield Path(sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user"))) / exe
    yield Path(__file__).resolve().parents[1] / "bin" / exe


def call(
    program: Path,
    command: str,
    arguments: Sequence[str | Path],
    progress: Progress = False,
    codes: Sequence[int] = (0,),
    names: Mapping[str, str] | None = None,
) -> Any:
    """Run a command of the program and return its result, or None if it has none.

    * ``codes``: exit codes that count as success.
    * ``names``: texts that replace the paths of temporary files in error messages.

    KeyboardInterrupt, and any exception that a function ``progress`` raises, ends the program and
    the processes in which it runs FMUs; incomplete files are removed. Raises FmuError with the
    program's message.
    """
    try:
        child = subprocess.Popen(
            [program, command, "--messages", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            env=os.environ | {"HUBSLOSH_PYTHON": sys.executable},
        )
    except OSError as error:
        raise FmuError(f"{program} cannot be started: {error}") from None
    printed: list[str] = []
    reader = Thread(target=lambda: printed.extend(child.stderr or ()), daemon=True)
    line, result = Line(progress), None
    with child:
        reader.start()
        try:
            for text in child.stdout or ():
                if not text.startswith("\x1e"):
                    continue
                message = json.loads(text[1:])
                if "progress" in message:
                    line.show(message["progress"])
                result = message.get("result", result)
        except BaseException:
            _end(child)
            raise
        finally:
            line.close()
    reader.join()
    if child.returncode not in codes or (child.returncode and result is None):
        # the program prints notes and warnings before its error
        text = re.split(r"^error: ", "".join(printed), maxsplit=1, flags=re.MULTILINE)[-1].strip()
        for temporary, name in (names or {}).items():
            text = text.replace(temporary, name)
        raise FmuError(f"hubslosh {command}: {text}")
    return result


def _end(child: "subprocess.Popen[str]") -> None:
    """End the program ``child``, which first ends the processes in which it runs FMUs.

    The program is killed if it does not end in five seconds.
    """
    child.terminate()
    try:
        child.wait(5)
    except subprocess.TimeoutExpired:
        child.kill()


def settings_flags(settings: Mapping[str, object] | None) -> list[str]:
    """Return settings as flags ``--set NAME=VALUE`` of the command line."""
    flags = []
    for name, value in (settings or {}).items():
        flags += ["--set", f"{name}={text_of(value)}"]
    return flags
