"""Propellant slosh as FMUs, from Python.

    import hubslosh

    start = {"tank.h": (50, "mm"), "init.slosh_angle": (10, "deg")}
    run = hubslosh.simulate(parameters=start, stop=60)

`simulate` returns a table of time histories, `closed_loop` returns such a table for an FMU under a
sampled controller, and `margins` returns the stability margins of this control loop. `monte_carlo`
repeats a simulation with parameters drawn at random. `linearize` returns a state-space model,
`uncertain` a state-space model with uncertain parameters. `frequency_response` estimates a
frequency response from a time history; `fit` fits a transfer function to the estimate. `tank` and
`liquid_modes` compute slosh modes; `mode_errors` shows how many modes a model needs.
`read_recording` reads recordings of data loggers, `identify` fits parameters to them, and
`posterior` samples the parameters from their posterior distribution. `view` shows a run in 3-D, and
the module `plot` draws diagrams. `Plant` is an FMU instance that you advance step by step yourself.
`analyse`, `campaign`, `check`, `identify` and `view` call the program ``hubslosh``.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

# numpy, pandas and scipy take 0.3 to 1.2 s to import, so each module of this package is imported
# when one of its names is first used (PEP 562). The lines "from .MODULE import NAME as NAME" of
# __init__.pyi, which type checkers read, give the module of each name.
_LINES = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8").splitlines()
_WORDS = [line.split() for line in _LINES if line.startswith("from .")]
_MODULE_OF = {name: module[1:] for _, module, _, name, *_ in _WORDS if module != "."}

# Names that existed in earlier versions, each with its replacement.
_REMOVED = {
    "COLUMNS": "the argument outputs of hubslosh.simulate",
    "drive": "hubslosh.simulate",
    "read_table": "hubslosh.read_recording",
    "setting": "str.partition",
    "write_table": "hubslosh.to_csv or hubslosh.to_parquet",
}

__all__ = [*sorted(_MODULE_OF), "attitude", "plot"]


def __getattr__(name: str) -> Any:
    """Import a public name of the package when it is used for the first time."""
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
    """Return all public names, including names whose module has not been imported yet."""
    return sorted({*globals(), *__all__, "__version__"})


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("hubslosh")
    except PackageNotFoundError:
        return "source tree"
