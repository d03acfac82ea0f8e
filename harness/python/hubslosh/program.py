"""Calls of the program ``hubslosh``: campaigns, recordings and identification."""

import json
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
    """Simulate the runs of a plan by ``hubslosh campaign``, and return the table of the runs.

    Parameters
    ----------
    plan : str or Path
        A TOML file, the name of a built-in plan such as ``"thesis"``, or the text of a plan.
        A text is recognised by its line breaks.
    out : str or Path, optional
        Directory for runs, tables and report.html. By default ``dist/NAME`` with the name of the
        plan; a text needs ``out``.
    model : str or Path
        Name of the FMU, or its file.
    force : bool
        Simulate all runs, including those that the directory already contains. By default stored
        runs are reused if plan and FMU are unchanged.
    progress : bool or callable, optional
        True shows a line on stderr, which is the default on a terminal and in a notebook; a
        function receives the line as text.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    DataFrame
        Content of ``runs.csv``: a row for each run with its settings and results.
        ``.attrs["directory"]`` is the directory.

    Raises
    ------
    FmuError
        If the plan is wrong or a run is refused, with the message of the program.

    Examples
    --------
    >>> import hubslosh
    >>> plan = '''
    ... profile = "pulse:amplitude=0.05,start=1,width=1,duration=10"
    ... [vary]
    ... slosh.model = ["linear", "spherical"]
    ... '''
    >>> runs = hubslosh.campaign(plan, "two-pulses")
    >>> len(runs), (runs.attrs["directory"] / "report.html").is_file()
    (2, True)
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
        call(path, "campaign", arguments, progress, names={f"the plan {plan}": "the plan"})
    return _runs_in(directory)


def analyse(
    recordings: str | Path | Sequence[str | Path],
    out: str | Path,
    *arguments: str,
    columns: str | None = None,
    settings: Mapping[str, object] | None = None,
    fmu: str | Path = "HubSlosh",
    progress: Progress = None,
    program: str | Path | None = None,
) -> pd.DataFrame:
    """Find resonance and antiresonance in recordings of a bench by ``hubslosh analyse``.

    Parameters
    ----------
    recordings : str, Path or sequence of them
        Files, as `read_recording` reads them, with torque and one to three rates.
    out : str or Path
        Directory for runs, tables and report.html.
    *arguments : str
        Further flags of ``hubslosh analyse``.
    columns : str, optional
        Columns of the signals, with units, such as
        ``"time=t:ms,tau_cmd=T:mNm,omega=gyro_z:deg/s"``.
    settings : mapping, optional
        Known parameters of the bench by their names in the FMU, such as ``{"tank.h": 0.1}``.
    fmu : str or Path
        Name of the FMU, or its file.
    progress : bool or callable, optional
        As for `campaign`.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    DataFrame
        Content of ``runs.csv``: a row for each recording, with the columns of `campaign`; its
        column ``model`` is "recording". ``.attrs["directory"]`` is ``out``.

    Raises
    ------
    FmuError
        If a recording cannot be read or analysed, with the message of the program.

    Examples
    --------
    A simulated sweep takes the place of a recording:

    >>> import numpy as np
    >>> import pandas as pd
    >>> import hubslosh
    >>> time, growth = np.arange(0, 60, 0.02), np.log(3.5 / 1.25) / 60
    >>> sweep = 0.1 * np.sin(2 * np.pi * 1.25 * np.expm1(growth * time) / growth)
    >>> run = hubslosh.simulate(
    ...     inputs=pd.DataFrame({"time": time, "tau_cmd": sweep}), outputs=["tau_cmd", "omega"])
    >>> run.to_csv("sweep.csv", index=False)
    >>> runs = hubslosh.analyse(
    ...     "sweep.csv", "sweep", "--profile", "exp-sweep:f0=1.25,f1=3.5,duration=60",
    ...     "--model", "linear")
    >>> runs["model"].tolist()
    ['recording', 'linear']
    """
    files = [recordings] if isinstance(recordings, str | Path) else list(recordings)
    flags = ["--columns", columns] if columns else []
    where: list[str | Path] = ["--fmu", fmu_path(fmu), "--out", out]
    flags += [*settings_flags(settings), *arguments]
    call(find_program(program), "analyse", [*files, *flags, *where], progress)
    return _runs_in(Path(out))


def _runs_in(directory: Path) -> pd.DataFrame:
    """Return runs.csv of a campaign's ``directory`` as a table."""
    table = pd.read_csv(directory / "runs.csv")
    table.attrs["directory"] = directory
    return table


@dataclass(frozen=True)
class Estimated:
    """An estimate of one number with its uncertainty, in SI units.

    Attributes
    ----------
    value : float
        Estimate, in ``unit``.
    std : float
        Standard deviation due to all sources of error: noise and tolerances of known parameters.
        Infinite if the recording does not determine the number.
    std_noise : float
        Standard deviation due to noise only.
    interval : tuple of float
        Ends of the 95 % confidence interval. An end is infinite if the recording does not limit
        the number on this side.
    unit : str
        SI unit as FMI writes it, such as ``kg.m2``.
    determined : bool
        True if the interval has both ends and ``std`` is below half the value.

    Examples
    --------
    >>> from hubslosh import Estimated
    >>> estimate = Estimated(0.32, 0.01, 0.008, (0.30, 0.34), "kg.m2")
    >>> estimate.interval, estimate.determined
    ((0.3, 0.34), True)
    """

    value: float
    std: float
    std_noise: float
    interval: tuple[float, float]
    unit: str
    determined: bool = True

    @classmethod
    def _read(cls, found: Mapping[str, Any]) -> "Estimated":
        """Return an estimate from an entry of result.json, in which null means infinity."""
        ends = zip(found["interval"], (-np.inf, np.inf), strict=True)
        low, high = (limit if end is None else float(end) for end, limit in ends)
        spread = {
            name: np.inf if found[name] is None else float(found[name])
            for name in ("std", "std_noise")
        }
        return cls(**{**found, **spread, "interval": (low, high)})


Method = Literal["bench", "friction", "decay"]  # Kinds of recordings of ``hubslosh identify``


@dataclass(frozen=True)
class Identification:
    """Result of `identify`; ``print`` shows the verdict and the estimates.

    Attributes
    ----------
    parameters : dict of str to Estimated
        Estimates of parameters of the FMU, by name.
    measurement : dict of str to Estimated
        Estimates that are not parameters of the FMU: delay, scale and bias of the gyro;
        frequency and damping ratio of a free decay.
    model : str or None
        Chosen slosh model, if the method chooses one.
    settings : dict of str to str
        Settings of the FMU for which the parameters were estimated.
    converged : bool
        True if the optimisation ended at a minimum of the residual.
    fits : bool or None
        True if the residual is noise. If it is False, the model is invalidated and no interval can
        be trusted. None if the method does not test the fit.
    verdict : tuple of str
        Verdict about model and fit, in sentences.
    all : dict
        Content of the file that ``hubslosh identify --out`` writes.

    Examples
    --------
    >>> import numpy as np
    >>> import hubslosh
    >>> bench = {"friction.model": "viscous", "init.slosh_angle": 0.1}
    >>> run = hubslosh.simulate(parameters=bench, stop=4, step=0.05, outputs="omega")
    >>> run["omega"] += np.random.default_rng(1).normal(0, 1e-5, len(run))  # noise of a gyro
    >>> found = hubslosh.identify(
    ...     run, free={"friction.b": 0.03}, outputs=["omega"], settings=bench)
    >>> found.fits, round(found.parameters["friction.b"].value, 3)
    (True, 0.038)
    """

    parameters: dict[str, Estimated]
    measurement: dict[str, Estimated]
    model: str | None
    settings: dict[str, str]
    converged: bool
    fits: bool | None
    verdict: tuple[str, ...]
    all: dict[str, Any]

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the unknowns in ``free=`` due to noise only, SI units, by name.

        `Estimated.std` also includes tolerances. To use the covariance in `uncertain`, pass the
        whole result: ``covariance=found``.

        Raises
        ------
        FmuError
            If the result was found without ``free=``.
        """
        if "covariance" not in self.all:
            raise FmuError("only a result of identify with free= has a covariance")
        names = list(self.all["correlations"][0])
        return pd.DataFrame(np.array(self.all["covariance"], float), names, names)

    def __repr__(self) -> str:
        every = self.parameters | self.measurement
        lines = [
            f"{name} = {e.value:.6g} ± {e.std:.2g} {e.unit}".rstrip() for name, e in every.items()
        ]
        most = 12
        more = [f"and {len(lines) - most} more"] if len(lines) > most else []
        words = [textwrap.shorten(line, 200, placeholder=" …") for line in self.verdict[:5]]
        return "\n".join([f"Identification, model {self.model}", *words, *lines[:most], *more])


def _files(
    data: "Table | Sequence[Table]", needed: Sequence[str], folder: Path
) -> tuple[list[Path], dict[str, str]]:
    """Write tables of recordings to ``folder``; recordings that are files stay where they are.

    Each table must have the columns ``needed``. Return the files of all recordings and, for each
    written file, a name that error messages show instead.
    """
    tables = [data] if isinstance(data, pd.DataFrame | str | Path) else list(data)
    files: list[Path] = []
    names: dict[str, str] = {}
    for k, table in enumerate(tables):
        if not isinstance(table, pd.DataFrame):
            files.append(Path(table))
            continue
        name = "data" if len(tables) == 1 else f"data[{k}]"
        if missing := [column for column in needed if column not in table.columns]:
            raise FmuError(f"{name} has no column {', '.join(missing)}")
        files.append(folder / f"data{k + 1}.csv")
        names[str(files[-1])] = name
        table.to_csv(files[-1], index=False)
    return files, names


def _free_flags(
    free: "Mapping[str, Free]",
    inputs: Sequence[str],
    outputs: Sequence[str],
    prior: Mapping[str, tuple[float, float]],
) -> list[str]:
    """Return the options of ``hubslosh identify fmu`` for unknowns and signals.

    ``free`` has the start value or range of each unknown, ``prior`` the mean and standard deviation
    of its prior; ``inputs`` and ``outputs`` are names of the recorded signals.
    """
    flags = []
    for name, start in free.items():
        numbers = start if isinstance(start, tuple) else (start,)
        flags += ["--free", f"{name}=" + ":".join(repr(float(number)) for number in numbers)]
    for name, (mean, std) in prior.items():
        flags += ["--prior", f"{name}={mean!r}:{std!r}"]
    flags += ["--inputs", ",".join(inputs)] if inputs else []
    return [*flags, *(["--outputs", ",".join(outputs)] if outputs else [])]


Table = pd.DataFrame | str | Path  # A table, or a file that contains a table
# Initial guess of an unknown, or (initial guess, lower bound, upper bound).
Free = float | tuple[float, float, float]


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
    """Estimate parameters of an FMU from recordings, by ``hubslosh identify``.

    Without ``free`` the unknowns are the parameters of the slosh bench, and ``method`` is the kind
    of recordings. With ``free`` the output-error method fits any FMU, also FMUs that are not from
    this project. To simulate the FMU with the estimates, pass
    ``{n: e.value for n, e in found.parameters.items()} | found.settings`` as ``parameters`` to
    `simulate`, or the file written by ``out``: ``simulate(parameters="result.json")``.

    Parameters
    ----------
    data : DataFrame, str, Path or sequence of them
        Tables, or files as `read_recording` reads them, with the columns ``time`` (s),
        ``tau_cmd`` (N·m) and ``omega`` (rad/s); ``--columns`` among the ``arguments`` names
        other columns.
    model : str, optional
        Slosh model to try, or several, such as ``"linear,spherical"``; by default frozen, linear,
        planar and spherical. Not with ``free``.
    *arguments : str
        Further flags of ``hubslosh identify``.
    method : str
        Kind of recordings. "bench": torque and rate of the slosh bench. "friction": torque and
        rate with an empty tank. "decay": ``wave_height`` (m), ``force`` (N), ``theta`` (rad) or
        ``omega`` without torque. Not with ``free``.
    fmu : str or Path
        Name of an FMU of this package, or its file.
    free : mapping, optional
        Unknowns: Real parameters and start values of the FMU with an initial guess,
        ``{"mu": 1.0}``, or with initial guess, lower and upper bound, ``{"mu": (1.0, 0.1, 5.0)}``,
        SI units. ``"x0@each"`` is estimated separately for each recording.
    inputs, outputs : sequence of str
        With ``free``: columns of the data, by the names of the FMU's inputs and outputs.
    prior : mapping, optional
        With ``free``: mean and standard deviation of unknowns of which estimates exist already.
    settings : mapping, optional
        Values of known parameters by their names in the FMU, such as ``{"tank.h": 0.1}``.
    out : str or Path, optional
        File for the result, .json.
    progress : bool or callable, optional
        As for `campaign`.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    Identification
        Estimates with intervals, and the verdict about the fit.

    Raises
    ------
    FmuError
        If arguments contradict each other, a recording cannot be used, or the optimisation fails.
        A model that does not fit is not an error.

    Examples
    --------
    A simulated decay takes the place of a recording:

    >>> import numpy as np
    >>> import hubslosh
    >>> bench = {"friction.model": "viscous", "init.slosh_angle": 0.1}
    >>> run = hubslosh.simulate(parameters=bench, stop=4, step=0.05, outputs="omega")
    >>> run["omega"] += np.random.default_rng(1).normal(0, 1e-5, len(run))  # noise of a gyro
    >>> found = hubslosh.identify(
    ...     run, free={"friction.b": 0.03}, outputs=["omega"], settings=bench)
    >>> found.fits, round(found.parameters["friction.b"].value, 3)
    (True, 0.038)
    """
    if any(argument.split("=")[0] == "--method" for argument in arguments):
        raise FmuError("give method= instead of the flag --method")
    if free is None and (inputs or outputs or prior):
        raise FmuError("inputs=, outputs= and prior= can be given only together with free=")
    if free is not None and (model is not None or method != "bench"):
        raise FmuError("free= cannot be combined with model= or method=")
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
        flags += _free_flags(free, inputs, outputs, prior or {})
    flags += [*settings_flags(settings), *arguments]
    flags += [] if out is None else ["--out", str(out)]
    with temporary.folder() as folder:
        files, names = _files(data, needed, Path(folder))
        asked = [kind, *files, *flags]
        loaded: dict[str, Any] = call(path, "identify", asked, progress, names=names)
    estimates = {
        kind: {name: Estimated._read(found) for name, found in loaded[kind].items()}
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


def posterior(
    found: Identification,
    data: Table | Sequence[Table],
    *arguments: str,
    fmu: str | Path,
    free: Mapping[str, Free],
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    prior: Mapping[str, tuple[float, float]] | None = None,
    settings: Mapping[str, object] | None = None,
    walkers: int | None = None,
    steps: int = 300,
    burn: int = 100,
    seed: int = 1,
    program: str | Path | None = None,
) -> pd.DataFrame:
    """Sample the posterior of the unknowns that `identify` has estimated with ``free=``.

    The package emcee (Foreman-Mackey et al., PASP 125, 2013), which must be installed, samples the
    likelihood that `identify` maximises, with the noise that `identify` has estimated. Each step
    simulates the recordings once for each walker.

    Parameters
    ----------
    found : Identification
        Result of `identify`. Its normal distribution gives the start values of the walkers.
    data, *arguments, fmu, free, inputs, outputs, prior, settings
        Arguments of the call of `identify` that has given ``found``, unchanged.
    walkers : int, optional
        Number of walkers, at least twice the number of unknowns; by default four times.
    steps : int
        Number of steps of each walker.
    burn : int
        Number of steps at the beginning that are discarded.
    seed : int
        Seed of the random numbers; the same seed gives the same samples.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    DataFrame
        A row for each of ``(steps - burn) * walkers`` samples and a column for each unknown, SI
        units. ``table.quantile([0.025, 0.975])`` gives 95 % intervals.
        ``.attrs["autocorrelation"]`` has the correlation time of each unknown in steps; if
        ``steps - burn`` is less than ten correlation times, the intervals are inaccurate.

    Raises
    ------
    FmuError
        If emcee is not installed, ``found`` was estimated without ``free=``, or the recordings do
        not determine an unknown.

    Examples
    --------
    Two seconds of a free decay from a known angle; a useful chain has 300 steps or more:

    >>> import numpy as np
    >>> import hubslosh
    >>> bench = {"friction.model": "viscous", "init.slosh_angle": 0.1}
    >>> run = hubslosh.simulate(parameters=bench, stop=4, step=0.05, outputs="omega")
    >>> run["omega"] += np.random.default_rng(1).normal(0, 1e-5, len(run))  # noise of a gyro
    >>> question = {"fmu": "HubSlosh", "free": {"friction.b": 0.03}, "outputs": ["omega"],
    ...             "settings": bench}
    >>> found = hubslosh.identify(run, **question)
    >>> samples = hubslosh.posterior(found, run, **question, walkers=4, steps=5, burn=3)
    >>> len(samples), list(samples.columns)
    (8, ['friction.b'])
    """
    try:
        import emcee
    except ImportError:
        raise FmuError("posterior() needs emcee: pip install emcee") from None
    table = found.covariance
    names, covariance = list(table.index), table.to_numpy()
    estimates = found.parameters | found.measurement
    middle = np.array([estimates[name].value for name in names])
    if not np.isfinite(covariance).all():
        raise FmuError(
            "the recordings do not determine every unknown, so that the walkers have no range "
            "in which to start"
        )
    walkers = walkers or 4 * len(names)
    path = find_program(program)
    with temporary.folder() as folder:
        result, points = Path(folder) / "result.json", Path(folder) / "points.csv"
        result.write_text(json.dumps(found.all), encoding="utf-8")
        files, named = _files(data, (), Path(folder))
        named |= {str(result): "found", str(points): "the samples"}
        flags = ["--fmu", str(fmu_path(fmu)), *_free_flags(free, inputs, outputs, prior or {})]
        flags += [*settings_flags(settings), *arguments]
        flags += ["--points", str(points), "--found", str(result)]

        def log_likelihood(x: np.ndarray) -> np.ndarray:
            pd.DataFrame(x, columns=names).to_csv(points, index=False)
            deviance = call(path, "identify", [*files, *flags], names=named)
            return np.array([-np.inf if d is None else -0.5 * d for d in deviance])

        random = np.random.default_rng(seed)
        start = random.multivariate_normal(middle, covariance, size=walkers, method="eigh")
        sampler = emcee.EnsembleSampler(walkers, len(names), log_likelihood, vectorize=True)
        sampler.random_state = np.random.RandomState(seed).get_state()
        sampler.run_mcmc(start, steps)
    samples = pd.DataFrame(sampler.get_chain(discard=burn, flat=True), columns=names)
    samples.attrs["autocorrelation"] = dict(
        zip(names, sampler.get_autocorr_time(quiet=True, tol=0), strict=True)
    )
    return samples
