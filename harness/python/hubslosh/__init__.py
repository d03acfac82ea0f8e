"""Propellant slosh as FMUs, from Python.

    import hubslosh

    start = {"tank.h": (50, "mm"), "init.slosh_angle": (10, "deg")}
    run = hubslosh.simulate(parameters=start, stop=60)

`simulate` returns a table of time histories, `closed_loop` one under a sampled controller,
`linearize` a state-space model, `frequency_response` an estimate from a history, `fit` a transfer
function through such an estimate; `campaign` and `identify` call the program ``hubslosh``. `plot`
draws. `Plant` and `drive` are for those who step an instance themselves.
"""

from importlib.metadata import PackageNotFoundError, version

from . import batch, plot
from .fitting import TransferFunction, fit
from .fmu import Fmu, FmuError, FmuWarning, Quantity, Value
from .linearization import LinearModel, linearize
from .loop import Law, closed_loop
from .plant import COLUMNS, TORQUE, Plant, RunError, drive
from .program import Estimated, Identification, campaign, identify
from .simulation import simulate
from .spectrum import frequency_response
from .tables import read_parameters, read_table, setting, write_table

try:
    __version__ = version("hubslosh")
except PackageNotFoundError:
    __version__ = "source tree"

__all__ = [
    "COLUMNS",
    "TORQUE",
    "Estimated",
    "Fmu",
    "FmuError",
    "FmuWarning",
    "Identification",
    "Law",
    "LinearModel",
    "Plant",
    "Quantity",
    "RunError",
    "TransferFunction",
    "Value",
    "batch",
    "campaign",
    "closed_loop",
    "drive",
    "fit",
    "frequency_response",
    "identify",
    "linearize",
    "plot",
    "read_parameters",
    "read_table",
    "setting",
    "simulate",
    "write_table",
]
