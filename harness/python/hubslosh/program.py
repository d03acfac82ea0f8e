"""Calls of the program ``hubslosh``: campaigns, recordings and identification."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from . import temporary
from .command import call, find_program, settings_flags
from .fmu import FmuError, fmu_path
from .progress import Progress


def campaign(
    plan: str | Path,
    out: str | Path | None = None,
    *,
    model: str | Path = "HubSlosh",
    force: bool = False,
    progress: Progress = None,
    program: str | Path | None = None,
) -> pd.DataFrame:
    """Simulate a plan with the program ``hubslosh`` and return its table of runs.

    * ``plan``: A TOML file, the name of a built-in plan, or the TOML text itself (several lines).
    * ``out``: Directory for runs, tables and report.html; by default dist/ and the plan's name.
      Stored runs are reused, unless ``force``.
    * ``progress``: Shows a line on stderr, by default on a terminal and in a notebook; or a
      function that takes the line.

    Returns ``runs.csv``: a row per run with its settings and results. ``.attrs["directory"]`` is
    the directory.
    """
    path = find_program(program)
    with temporary.folder() as folder:
        text = str(plan)
        if "\n" in text:
            if out is None:
                raise FmuError("a plan given as text needs out=, a directory for its results")
            plan = Path(folder) / "plan.toml"
            plan.write_text(text, encoding="utf-8")
        directory = Path(out) if out is not None else Path("dist") / Path(plan).stem
        arguments: list[str | Path] = ["--plan", plan, "--fmu", fmu_path(model)]
        arguments += ["--out", directory, *(["--force"] if force else [])]
        call(path, "campaign", arguments, progress)
    table = pd.read_csv(directory / "runs.csv")
    table.attrs["directory"] = directory
    return table


def analyse(
    recordings: str | Path | Sequence[str | Path],
    out: str | Path,
    *arguments: str,
    columns: str | None = None,
    settings: dict[str, object] | None = None,
    fmu: str | Path = "HubSlosh",
    progress: Progress = None,
    program: str | Path | None = None,
) -> pd.DataFrame:
    """Analyse recordings of a bench with ``hubslosh analyse``, and return its table of runs.

    * ``recordings``: Files, as `read_recording` reads them, with torque and one to three rates.
    * ``out``: Directory for runs, tables and report.html.
    * ``columns``: Columns of the signals, with units, such as
      ``"time=t:ms,tau_cmd=T:mNm,omega=gyro_z:deg/s"``.
    * ``settings``: Known parameters of the bench by FMU name, ``{"tank.h": 0.1}``.
    * ``arguments``: Further flags of the command.
    * ``progress``: As `campaign` has it.

    Returns ``runs.csv``, as `campaign` does; the model of a recording is ``recording``.
    """
    files = [recordings] if isinstance(recordings, str | Path) else list(recordings)
    flags = ["--columns", columns] if columns else []
    where: list[str | Path] = ["--fmu", fmu_path(fmu), "--out", out]
    flags += [*settings_flags(settings), *arguments]
    call(find_program(program), "analyse", [*files, *flags, *where], progress)
    table = pd.read_csv(Path(out) / "runs.csv")
    table.attrs["directory"] = Path(out)
    return table


@dataclass(frozen=True)
class Estimated:
    """An estimated number, in SI units."""

    value: float
    """The estimate, in `unit`."""
    std: float
    """Standard deviation from all sources of error."""
    std_noise: float
    """Standard deviation from the noise alone."""
    interval: tuple[float, float | None]
    """95 % interval; None: the recording sets no upper end."""
    unit: str
    """SI unit, as FMI writes it, such as ``kg.m2``."""
    determined: bool = True
    """True if the interval has both ends and the standard deviation is below half the value."""


Method = Literal["bench", "friction", "decay"]
"""Kinds of recordings of ``hubslosh identify``."""


@dataclass(frozen=True)
class Identification:
    """Result of ``hubslosh identify``; `all` is its result.json."""

    parameters: dict[str, Estimated]
    """Estimates of the FMU's parameters, by name."""
    measurement: dict[str, Estimated]
    """Delay, gyro scale and bias; frequency and damping of a free decay."""
    model: str | None
    """The chosen slosh model, of a method that has one."""
    settings: dict[str, str]
    """Settings of the FMU that belong to the parameters."""
    converged: bool
    """True if the search ended at a minimum."""
    fits: bool | None
    """True if the model fits: the residual is the gyro's noise. If False, the model is
    invalidated and no interval can be trusted. None: not tested."""
    verdict: tuple[str, ...]
    """The verdict in words."""
    all: dict[str, Any]
    """The whole result.json."""

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the unknowns of ``free=``, their names as index and columns, SI units.

        It is that of the noise; `Estimated.std` includes tolerances too.
        `uncertain` converts it to its own parameters: ``covariance=found``.
        """
        if "covariance" not in self.all:
            raise FmuError("a result of identify has a covariance if it was found with free=")
        names = list(self.all["correlations"][0])
        return pd.DataFrame(np.array(self.all["covariance"], float), names, names)

    def __repr__(self) -> str:
        """Return verdict and estimates."""
        every = self.parameters | self.measurement
        lines = [
            f"{name} = {e.value:.6g} ± {e.std:.2g} {e.unit}".rstrip() for name, e in every.items()
        ]
        most = 12
        more = [f"and {len(lines) - most} more"] if len(lines) > most else []
        words = [textwrap.shorten(line, 200, placeholder=" …") for line in self.verdict[:5]]
        return "\n".join([f"Identification, model {self.model}", *words, *lines[:most], *more])


def _file(table: "Table", needed: Sequence[str], path: Path) -> Path:
    """Return the file of a table, which is written if it is none."""
    if not isinstance(table, pd.DataFrame):
        return Path(table)
    missing = [name for name in needed if name not in table.columns]
    if missing:
        raise FmuError(f"data has no column {', '.join(missing)}")
    table.to_csv(path, index=False)
    return path


def _asked(
    free: "Mapping[str, Free]",
    inputs: Sequence[str],
    outputs: Sequence[str],
    prior: Mapping[str, tuple[float, float]],
) -> list[str]:
    """Return the flags that ask for any FMU's parameters."""
    flags = []
    for name, start in free.items():
        numbers = start if isinstance(start, tuple) else (start,)
        flags += ["--free", f"{name}=" + ":".join(repr(float(number)) for number in numbers)]
    for name, (mean, std) in prior.items():
        flags += ["--prior", f"{name}={mean!r}:{std!r}"]
    flags += ["--inputs", ",".join(inputs)] if inputs else []
    return [*flags, *(["--outputs", ",".join(outputs)] if outputs else [])]


Table = pd.DataFrame | str | Path
"""A table, or the file of one."""
Free = float | tuple[float, float, float]
"""Start of an unknown, or start, lowest and highest value."""


def identify(
    data: Table | Sequence[Table],
    model: str | None = None,
    *arguments: str,
    method: Method = "bench",
    fmu: str | Path = "HubSlosh",
    free: Mapping[str, Free] | None = None,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    prior: Mapping[str, tuple[float, float]] | None = None,
    settings: Mapping[str, object] | None = None,
    out: str | Path | None = None,
    progress: Progress = None,
    program: str | Path | None = None,
) -> Identification:
    """Estimate an FMU's parameters from recordings, with the program ``hubslosh identify``.

    * ``data``: A table, or a file as `read_recording` reads it, with the columns ``time`` (s),
      ``tau_cmd`` (N·m) and ``omega`` (rad/s), or others by the flag ``--columns``.
    * ``model``: The slosh model.
    * ``arguments``: Further flags of the command.
    * ``fmu``: The name of an FMU of this package, or the file of a HubSlosh.
    * ``out``: File for the result, .json.
    * ``progress``: Shows the search in a line on stderr, by default on a terminal and in a
      notebook; or a function that takes the line.

    The parameters with ``settings`` simulate the bench:
    ``{n: e.value for n, e in found.parameters.items()} | found.settings``, and so does the file:
    ``simulate(parameters="result.json")``.

    * ``method``: The kind of recordings. "bench": torque and rate of the slosh bench. "friction":
      the same with an empty tank. "decay": ``wave_height`` (m), ``force`` (N), ``theta`` (rad) or
      ``omega`` without torque; `all` has its frequency and damping.

    * ``free``: Unknowns of any FMU, for ``fmu`` of other makers too. They are Real parameters and
      start values with a start, ``{"mu": 1.0}``, or with start and bounds, ``{"mu": (1.0, 0.1,
      5.0)}``. ``"x0@each"`` has a value of its own in each recording.
    * ``inputs``, ``outputs``: Columns of the data, by the FMU's names.
    * ``prior``: Mean and standard deviation of an unknown.
    * ``settings``: Values of other parameters.
    """
    if any(argument.split("=")[0] == "--method" for argument in arguments):
        raise FmuError("--method is given as method=")
    if free is None and (inputs or outputs or prior):
        raise FmuError("inputs=, outputs= and prior= go with free=")
    if free is not None and (model is not None or method != "bench"):
        raise FmuError("free= fits any FMU by output error: model= and method= are not for it")
    path = find_program(program)
    needed: Sequence[str] = ("time",) if method == "decay" else ("time", "tau_cmd", "omega")
    flags = ["--model", model] if model is not None else []
    flags += [] if method == "decay" else ["--fmu", str(fmu_path(fmu))]
    kind: str = method
    if free is not None:
        kind = "fmu"
        needed = (
            ()
            if any(a.split("=")[0] == "--columns" for a in arguments)
            else ("time", *inputs, *outputs)
        )
        flags += _asked(free, inputs, outputs, prior or {})
    flags += [*settings_flags(settings), *arguments]
    flags += [] if out is None else ["--out", str(out)]
    with temporary.folder() as folder:
        tables = [data] if isinstance(data, pd.DataFrame | str | Path) else list(data)
        files = [
            _file(table, needed, Path(folder) / f"data{k}.csv") for k, table in enumerate(tables, 1)
        ]
        loaded: dict[str, Any] = call(path, "identify", [kind, *files, *flags], progress)
    estimates = {
        kind: {
            name: Estimated(**e | {"interval": tuple(e["interval"])})
            for name, e in loaded[kind].items()
        }
        for kind in ("parameters", "measurement")
    }
    return Identification(
        **estimates,
        model=loaded.get("models", [{}])[0].get("model") or loaded["settings"].get("slosh.model"),
        settings=loaded["settings"],
        converged=loaded["converged"],
        fits=loaded.get("fits"),
        verdict=tuple(loaded["verdict"]),
        all=loaded,
    )
