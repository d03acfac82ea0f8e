"""Propellant slosh as FMUs, from Python.

    import hubslosh

    start = {"tank.h": (50, "mm"), "init.slosh_angle": (10, "deg")}
    run = hubslosh.simulate(parameters=start, stop=60)

`simulate` returns a table of time histories, `closed_loop` one under a sampled controller,
`margins` how far that loop is from instability, `monte_carlo` many runs with drawn parameters,
`linearize` a state-space model, `uncertain` one with uncertain parameters, `frequency_response` an
estimate from a history, `fit` a transfer function through such an estimate. `analyse`, `campaign`,
`check`, `identify` and `view` call the program ``hubslosh``. `tank` and `liquid_modes` find slosh
modes, `mode_errors` says how many a model needs, `posterior` samples the result of `identify`.
`read_recording` reads the files of loggers.
`view` shows a run in 3-D, `plot` draws. `Plant` is for those who step an instance themselves.
"""

from importlib import import_module
from typing import Any

# numpy, pandas and scipy take 0.3 to 1.2 s to import: each module comes on the first use of
# one of its names (PEP 562). Type checkers read __init__.pyi, which tests/test_import.py writes.
_MODULES = {
    "appendages": ("Appendage",),
    "certificate": ("Certificate", "WorstCase"),
    "comparison": ("compare",),
    "craft": ("Craft", "MassProperties", "MountedTank"),
    "engines": ("Engine",),
    "files": ("to_csv", "to_mat", "to_parquet"),
    "fitting": ("TransferFunction", "fit"),
    "fmu": ("Fmu", "FmuError", "FmuWarning", "Quantity", "Value", "fmu_path", "read_parameters"),
    "inertia": ("bottom_up",),
    "linearization": ("LinearModel", "linearize"),
    "liquid": ("LiquidModes", "liquid_modes"),
    "loop": ("Law", "Loop", "closed_loop"),
    "modes": ("mode_errors",),
    "operating_point": ("OperatingPoint",),
    "plant": ("TORQUE", "Plant", "RunError"),
    "program": (
        "Checked", "CheckedRule", "Estimated", "Finding", "Identification", "analyse", "campaign",
        "check", "identify", "posterior",
    ),
    "project": ("Project",),
    "recordings": ("read_recording",),
    "review": ("Review",),
    "run": ("Run",),
    "sampling": ("draw", "monte_carlo", "quantiles"),
    "simulation": ("simulate",),
    "spectrum": ("frequency_response",),
    "stability": ("Margins", "margins"),
    "tanks": ("Tank", "tank"),
    "uncertainty": ("UncertainModel", "uncertain"),
    "viewing": ("View", "view"),
    "wheels": ("Wheel",),
}  # fmt: skip
# Removed names, and what does the same.
_REMOVED = {
    "COLUMNS": "the argument outputs of hubslosh.simulate",
    "drive": "hubslosh.simulate",
    "read_table": "hubslosh.read_recording",
    "setting": "str.partition",
    "write_table": "hubslosh.to_csv or hubslosh.to_parquet",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [*sorted(_MODULE_OF), "attitude", "plot"]


def __getattr__(name: str) -> Any:
    """Import a name of the package when it is used for the first time."""
    if name == "__version__":
        value: Any = _version()
    elif name in _MODULE_OF:
        value = getattr(import_module(f".{_MODULE_OF[name]}", __name__), name)
    elif name in __all__:
        value = import_module(f".{name}", __name__)
    else:
        use = f"; use {_REMOVED[name]} instead" if name in _REMOVED else ""
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{use}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names that there are, imported or not."""
    return sorted({*globals(), *__all__, "__version__"})


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("hubslosh")
    except PackageNotFoundError:
        return "source tree"
