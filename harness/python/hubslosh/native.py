"""The compiled part of this package (``harness/native``), from the wheel or from Cargo's folder."""

import os
import sys
from importlib import import_module
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[3]


def source_tree() -> Path | None:
    """Return the root folder of the project if this package runs from its source; else None."""
    return _ROOT if (_ROOT / "harness" / "python").is_dir() else None


def _built() -> Any:
    """Load the native library that ``cargo build`` has made in this source tree."""
    name = {"win32": "hubslosh_native.dll", "darwin": "libhubslosh_native.dylib"}
    file = name.get(sys.platform, "libhubslosh_native.so")
    path = _ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / file
    if not path.is_file():
        raise ImportError(f"{path} is missing: cargo build --release -p hubslosh-native builds it")
    loader = ExtensionFileLoader(f"{__package__}._native", str(path))
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


try:
    import_module("._native", __package__)
except ImportError:
    if source_tree() is None:
        raise
    sys.modules[f"{__package__}._native"] = _built()

from ._native import *  # noqa: E402, F403
