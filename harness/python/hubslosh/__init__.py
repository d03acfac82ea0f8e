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
`view` shows a run in 3-D, `plot` draws. `Plant` and `drive` are for those who step an instance
themselves.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import attitude, plot
    from .certificate import Certificate, WorstCase
    from .checking import Checked, CheckedRule, Finding, check
    from .comparison import compare
    from .craft import Craft, MassProperties, MountedTank
    from .engines import Engine
    from .files import to_csv, to_mat, to_parquet
    from .fitting import TransferFunction, fit
    from .fmu import Fmu, FmuError, FmuWarning, Quantity, Value, fmu_path
    from .inertia import bottom_up
    from .linearization import LinearModel, linearize
    from .liquid import LiquidModes, liquid_modes
    from .loop import Law, Loop, closed_loop
    from .mcmc import posterior
    from .modes import mode_errors
    from .operating_point import OperatingPoint
    from .plant import COLUMNS, TORQUE, Plant, RunError, drive
    from .program import Estimated, Identification, analyse, campaign, identify
    from .project import Project
    from .recordings import read_recording
    from .review import Review
    from .run import Run
    from .sampling import draw, monte_carlo, quantiles
    from .simulation import simulate
    from .spectrum import frequency_response
    from .stability import Margins, margins
    from .tables import read_parameters, read_table, setting, write_table
    from .tanks import Tank, tank
    from .uncertainty import UncertainModel, uncertain
    from .viewing import View, view

    __version__: str

# numpy, pandas and scipy take 0.3 to 1.2 s to import: each module comes on the first use of
# one of its names (PEP 562). The same as above, for Python itself; a test compares.
_MODULES = {
    "certificate": ("Certificate", "WorstCase"),
    "checking": ("Checked", "CheckedRule", "Finding", "check"),
    "comparison": ("compare",),
    "craft": ("Craft", "MassProperties", "MountedTank"),
    "engines": ("Engine",),
    "files": ("to_csv", "to_mat", "to_parquet"),
    "fitting": ("TransferFunction", "fit"),
    "fmu": ("Fmu", "FmuError", "FmuWarning", "Quantity", "Value", "fmu_path"),
    "inertia": ("bottom_up",),
    "linearization": ("LinearModel", "linearize"),
    "liquid": ("LiquidModes", "liquid_modes"),
    "loop": ("Law", "Loop", "closed_loop"),
    "mcmc": ("posterior",),
    "modes": ("mode_errors",),
    "operating_point": ("OperatingPoint",),
    "plant": ("COLUMNS", "TORQUE", "Plant", "RunError", "drive"),
    "program": ("Estimated", "Identification", "analyse", "campaign", "identify"),
    "project": ("Project",),
    "recordings": ("read_recording",),
    "review": ("Review",),
    "run": ("Run",),
    "sampling": ("draw", "monte_carlo", "quantiles"),
    "simulation": ("simulate",),
    "spectrum": ("frequency_response",),
    "stability": ("Margins", "margins"),
    "tables": ("read_parameters", "read_table", "setting", "write_table"),
    "tanks": ("Tank", "tank"),
    "uncertainty": ("UncertainModel", "uncertain"),
    "viewing": ("View", "view"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "COLUMNS",
    "TORQUE",
    "Certificate",
    "Checked",
    "CheckedRule",
    "Craft",
    "Engine",
    "Estimated",
    "Finding",
    "Fmu",
    "FmuError",
    "FmuWarning",
    "Identification",
    "Law",
    "LinearModel",
    "LiquidModes",
    "Loop",
    "Margins",
    "MassProperties",
    "MountedTank",
    "OperatingPoint",
    "Plant",
    "Project",
    "Quantity",
    "Review",
    "Run",
    "RunError",
    "Tank",
    "TransferFunction",
    "UncertainModel",
    "Value",
    "View",
    "WorstCase",
    "analyse",
    "attitude",
    "bottom_up",
    "campaign",
    "check",
    "closed_loop",
    "compare",
    "draw",
    "drive",
    "fit",
    "fmu_path",
    "frequency_response",
    "identify",
    "linearize",
    "liquid_modes",
    "margins",
    "mode_errors",
    "monte_carlo",
    "plot",
    "posterior",
    "quantiles",
    "read_parameters",
    "read_recording",
    "read_table",
    "setting",
    "simulate",
    "tank",
    "to_csv",
    "to_mat",
    "to_parquet",
    "uncertain",
    "view",
    "write_table",
]


if not TYPE_CHECKING:  # a type checker would take every misspelt name for Any

    def __getattr__(name: str) -> Any:
        """Import what is used for the first time."""
        if name == "__version__":
            value: Any = _version()
        elif name in _MODULE_OF:
            value = getattr(import_module(f".{_MODULE_OF[name]}", __name__), name)
        elif name in __all__:
            value = import_module(f".{name}", __name__)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
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
