"""The posterior of an identification by Markov chain Monte Carlo, as a check of its intervals.

emcee (Foreman-Mackey et al., PASP 125, 2013) samples the likelihood that ``hubslosh identify``
maximises, with the noise that it has estimated. ``pip install emcee`` brings emcee.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from . import temporary
from .command import call, find_program, settings_flags
from .fmu import FmuError, fmu_path
from .program import Free, Identification, Table, _asked, _file


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
    """Sample the posterior of a result of `identify` with ``free=``.

    * ``found``: The result. The arguments of `identify` are repeated unchanged.
    * ``walkers``: Number of walkers, at least twice the number of unknowns; by default four times.
    * ``steps``: Steps of each walker; the first ``burn`` are dropped. The walkers start from the
      normal distribution of the result.

    Returns a row for each sample and a column for each unknown; ``table.quantile([0.025, 0.975])``
    gives 95 % intervals. ``.attrs["autocorrelation"]`` has the chains' correlation times in steps.
    If ``steps - burn`` is less than ten correlation times, the intervals are rough.
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
        raise FmuError("an unknown is not determined: there is nothing to start the walkers from")
    walkers = walkers or 4 * len(names)
    path = find_program(program)
    with temporary.folder() as folder:
        result, points = Path(folder) / "result.json", Path(folder) / "points.csv"
        result.write_text(json.dumps(found.all), encoding="utf-8")
        tables = [data] if isinstance(data, pd.DataFrame | str | Path) else list(data)
        files = [_file(t, (), Path(folder) / f"data{k}.csv") for k, t in enumerate(tables, 1)]
        flags = ["--fmu", str(fmu_path(fmu)), *_asked(free, inputs, outputs, prior or {})]
        flags += [*settings_flags(settings), *arguments]
        flags += ["--points", str(points), "--found", str(result)]

        def log_likelihood(x: np.ndarray) -> np.ndarray:
            pd.DataFrame(x, columns=names).to_csv(points, index=False)
            deviance = call(path, "identify", [*files, *flags])
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
