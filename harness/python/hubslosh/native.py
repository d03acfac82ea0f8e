"""The compiled half of this package (``harness/native``), in a wheel or in Cargo's folder."""

import os
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[3]


def source_tree() -> Path | None:
    """Return the project's root if this package lies in its source tree."""
    return _ROOT if (_ROOT / "harness" / "python").is_dir() else None


def _built() -> Any:
    """Load the library that ``cargo build`` has made."""
    name = {"win32": "hubslosh_native.dll", "darwin": "libhubslosh_native.dylib"}
    file = name.get(sys.platform, "libhubslosh_native.so")
    path = _ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / file
    if not path.is_file():
        raise ImportError(f"{path} is missing: cargo build --release -p hubslosh-native makes it")
    loader = ExtensionFileLoader(f"{__package__}._native", str(path))
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


try:
    from . import _native
except ImportError:
    if source_tree() is None:
        raise
    _native = _built()

Fmu, Instance, Variable = _native.Fmu, _native.Instance, _native.Variable
FmuError = _native.FmuError
"""Error in the arguments of a call, of an FMU or of the program ``hubslosh``."""
FmuWarning = _native.FmuWarning
"""Python warning that passes on a warning of an FMU or of the program ``hubslosh``."""
Model = _native.Model
destination, put, read_parameters = _native.destination, _native.put, _native.read_parameters
read_recording = _native.read_recording
History = _native.History
check_interpolation = _native.check_interpolation
communication_points, pairing = _native.communication_points, _native.pairing
Liquid, Tank, solve, table = _native.Liquid, _native.Tank, _native.solve, _native.table
