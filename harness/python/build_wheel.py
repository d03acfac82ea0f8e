"""Build backend for pip (PEP 517): runs Cargo and ``hubslosh pack``."""

import subprocess
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def build_wheel(wheel_directory: str, *_: Any, **__: Any) -> str:
    """Build the wheel for this platform, and return the name of its file."""
    return _pack("--python", wheel_directory)


def build_sdist(sdist_directory: str, *_: Any, **__: Any) -> str:
    """Build the source archive, and return the name of its file."""
    return _pack("--sdist", sdist_directory)


def _pack(what: str, directory: str) -> str:
    command = ["cargo", "run", "--release", "--locked", "--", "pack", what, "--out"]
    out = Path(directory).resolve()
    try:
        done = subprocess.run([*command, out], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    except FileNotFoundError:
        raise SystemExit(
            "error: building hubslosh from source needs Rust 1.89 or newer and a C compiler; "
            "wheels are for Linux (glibc 2.17 or newer; x86-64, ARM), Windows (x86-64) and macOS"
        ) from None
    if done.returncode:
        raise SystemExit(done.returncode)
    # the last line is "packed DIRECTORY/NAME (… bytes)"
    return Path(done.stdout.splitlines()[-1].removeprefix("packed ").rpartition(" (")[0]).name
