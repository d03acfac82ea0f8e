"""The posterior of an identification by Markov chain Monte Carlo, as a check of its intervals."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from . import temporary
from .command import call, find_program, settings_flags
from .fmu import FmuError, fmu_path
from .program import Free, Identification, Table, _files, _free_flags


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

    emcee (Foreman-Mackey et al., PASP 125, 2013) samples the likelihood that `identify`
    maximises, with the noise that it has estimated. Each step simulates the recordings once for
    each walker. Needs the package emcee.

    Parameters
    ----------
    found : Identification
        Result of `identify`. The walkers start from its normal distribution.
    data, *arguments, fmu, free, inputs, outputs, prior, settings
        Arguments of the call of `identify` that has given ``found``, unchanged.
    walkers : int, optional
        Number of walkers, at least twice the number of unknowns; by default four times.
    steps : int
        Number of steps of each walker.
    burn : int
        Number of first steps that are dropped.
    seed : int
        Seed of the random numbers; the same seed gives the same samples.
    program : str or Path, optional
        The program ``hubslosh``; by default the one that comes with this package.

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
        If emcee is not installed, ``found`` was not found with ``free=``, or an unknown is not
        determined.

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
