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
from pathlib import Path
from typing import Any

# numpy, pandas and scipy take 0.3 to 1.2 s to import: each module comes on the first use of one of
# its names (PEP 562). The lines "from .MODULE import NAME as NAME" of __init__.pyi, which type
# checkers read, say where the names are.
_LINES = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8").splitlines()
_WORDS = [line.split() for line in _LINES if line.startswith("from .")]
_MODULE_OF = {name: module[1:] for _, module, _, name, *_ in _WORDS if module != "."}

# Removed names, and what does the same.
_REMOVED = {
    "COLUMNS": "the argument outputs of hubslosh.simulate",
    "drive": "hubslosh.simulate",
    "read_table": "hubslosh.read_recording",
    "setting": "str.partition",
    "write_table": "hubslosh.to_csv or hubslosh.to_parquet",
}

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
