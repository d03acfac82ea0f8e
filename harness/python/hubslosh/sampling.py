"""Monte Carlo studies, which can be resumed after a stop, and quantiles of their results."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .arguments import (
    check_columns,
    check_numbers,
    check_table,
    cores,
    floats,
    names_of,
    out_of_range,
    parse_share,
    range_ends,
    refuse,
)
from .fmu import FmuError
from .native import uniforms
from .progress import Line, Progress
from .store import Store, encoded

if TYPE_CHECKING:
    import pandas as pd

# Function that evaluates one draw: it takes the drawn values by name and returns numbers by name.
Outcome = Callable[[dict[str, Any]], Mapping[str, float]]

# Range of a random value: (low, high) or a share of a nominal value, such as "10%", for a uniform
# distribution; a list, of which one item is drawn; or a frozen distribution of ``scipy.stats``.
Range = Any

FAILED = "refused"  # Column with the error message if the FMU refuses a run

# Number of runs that a Dask cluster has at a time. A larger number would not keep more workers
# busy, and would slow down the collection of results, which searches all these runs.
ON_DASK = 1000


def draw(
    ranges: Mapping[str, Range],
    run: int,
    seed: int = 1,
    *,
    nominal: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Return the values of one run of `monte_carlo`.

    A value depends only on the seed, on the number of the run, and on the names in ``ranges`` up to
    its own name; it does not depend on the number of runs in the study.

    Parameters
    ----------
    ranges : mapping
        Range of each name, as in `monte_carlo`.
    run : int
        Number of the run, counted from 0.
    seed : int, default 1
        Seed of the study.
    nominal : mapping, optional
        Nominal values by name, as in `monte_carlo`.

    Returns
    -------
    dict
        Values by name, in the order of ``ranges``.

    Raises
    ------
    FmuError
        If a range has none of the allowed forms, or a number is out of range.

    Examples
    --------
    >>> import hubslosh
    >>> hubslosh.draw({"tank.h": (0.04, 0.14), "slosh.model": ["linear", "planar"]}, run=0)
    {'tank.h': 0.09583574388883317, 'slosh.model': 'linear'}
    """
    ranges, wrong = _resolved(ranges, nominal)
    refuse(wrong + out_of_range(run=run, seed=seed))
    return _drawn(ranges, run, seed)


def _drawn(ranges: Mapping[str, Range], run: int, seed: int) -> dict[str, Any]:
    """Return the random values of run number ``run`` of a study with the seed ``seed``.

    ``ranges`` has no shares such as "10%" (see `_resolved`).
    """
    shares = iter(uniforms(int(seed), int(run), len(ranges)))
    return {name: _value(of, next(shares)) for name, of in ranges.items()}


def _value(of: Range, share: float) -> Any:
    """Return the value that the uniform random number ``share`` in [0, 1) selects from a range.

    For example, 0.25 selects 3.0 from the range (2, 6), and the first quartile of a distribution.
    """
    if hasattr(of, "ppf"):
        value = of.ppf(share)
    elif isinstance(of, list):
        return of[int(share * len(of))]
    else:
        low, high = of
        value = low + share * (high - low)
    return float(value)


def _resolved(ranges: Any, nominal: Any) -> tuple[dict[str, Range], list[str]]:
    """Return ``ranges`` with (low, high) in place of shares, and all error messages.

    A share such as "10%" is relative to the value that ``nominal`` has for this name.
    """
    if not isinstance(ranges, Mapping) or not ranges:
        return {}, ["ranges must be (low, high), a share, a list or a distribution for each name"]
    if not isinstance(nominal, Mapping | None):
        return {}, [f"nominal must be nominal values by name, not {nominal!r}"]
    found, problems = {}, []
    for name, of in ranges.items():
        found[name] = of
        if hasattr(of, "ppf") or (isinstance(of, list) and of):
            continue
        try:
            middle = float((nominal or {})[name]) if parse_share(of) else 0.0
            if not np.isfinite(middle):
                raise ValueError
        except KeyError:
            problems.append(
                f"{name} is given as {of} of its nominal value, which is not known: give "
                f"nominal={{{name!r}: …}}, or use Craft.monte_carlo, which computes it"
            )
            continue
        except (TypeError, ValueError):
            problems.append(f"nominal[{name!r}] must be a finite number, not {nominal[name]!r}")
            continue
        try:
            found[name] = range_ends(of, middle)
        except ValueError as error:
            problems.append(f"{name} {error}{ALSO}")
    return found, problems


# End of the error messages of `range_ends`: further forms of ranges that are allowed here.
ALSO = "; or a list of values, or a distribution such as scipy.stats.norm(650, 10)"


def monte_carlo(
    ranges: Mapping[str, Range],
    runs: int,
    seed: int = 1,
    outcome: Outcome | None = None,
    *,
    folder: str | Path | None = None,
    client: Any = None,
    workers: int | None = None,
    progress: Progress = None,
    nominal: Mapping[str, float] | None = None,
) -> "pd.DataFrame":
    """Run a Monte Carlo study: draw random values for each run, and simulate each run.

    Parameters
    ----------
    ranges : mapping
        Range of each name: (low, high) for a uniform distribution, a share such as "10%" of the
        value in ``nominal`` on both sides, a list of values, or a frozen distribution of
        ``scipy.stats``. Items of a list keep their type. The values of a run depend only on the
        seed and the number of the run, so that the first 200 of 400 runs are the same as the runs
        of a study with 200 runs.
    runs : int
        Number of runs.
    seed : int, default 1
        Seed of the draws.
    outcome : callable, optional
        Function of the drawn values (a dict by name) that makes the run and returns numbers by
        name. By default nothing is simulated, and the table has only the drawn values. Ranges may
        have the names of parameters of a `Craft`, such as ``NTO.frequency[1]`` and ``delay``; then
        pass the drawn values to ``craft.loop(law, period, fill, parameters=values)``.
        `Craft.monte_carlo` also computes their nominal values.
    folder : path, optional
        Folder in which each run is stored as soon as it is done, so that the same call continues a
        stopped study, even after kill -9. Stored runs are verified by their SHA-256 in
        ``manifest.sha256`` and by the seed. A stored run that was changed is simulated again, with
        a warning. ``runs.csv`` is written at the end. Only one process at a time can use the
        folder. A change of the function ``outcome`` is not detected: use another folder if you
        change it.
    client : distributed.Client, optional
        Client of a Dask cluster, on whose workers this package must be installed. Without a client
        the study uses threads.
    workers : int, optional
        Number of threads, by default one per core. `simulate` and loops with a linear controller
        run in parallel; a controller in Python runs on one core at a time.
    progress : bool or callable, optional
        Shows a line on stderr with finished runs and remaining time, by default on a terminal and
        in a notebook; or a function that takes the line.
    nominal : mapping, optional
        Nominal values by name, of which ranges such as "10%" are shares.

    Returns
    -------
    pandas.DataFrame
        A row for each run with the columns ``run``, the names of the ranges, and the names of the
        outcomes. If the FMU refuses a run, its outcomes are NaN, and the column ``refused`` has
        the reason. ``.attrs["drawn"]`` names the drawn columns. `quantiles` summarises the table.

    Raises
    ------
    FmuError
        If an argument is wrong, the FMU refuses every run, another process uses the folder, the
        folder belongs to another study or to a campaign, or its manifest is damaged. Any other
        exception of ``outcome`` also ends the study; stored runs are kept.

    Examples
    --------
    >>> import hubslosh
    >>> table = hubslosh.monte_carlo(
    ...     {"tank.h": (0.05, 0.12)}, 20, outcome=lambda drawn: {"twice": 2 * drawn["tank.h"]}
    ... )
    >>> table.shape
    (20, 3)
    >>> bool((table["twice"] == 2 * table["tank.h"]).all())
    True
    """
    from .short import ShortTable

    ranges, problems = _resolved(ranges, nominal)
    problems += out_of_range(runs=runs, seed=seed)
    problems += [] if workers is None else out_of_range(workers=workers)
    if not isinstance(folder, str | Path | None):
        problems.append(f"folder must be a path, not {folder!r}")
    if client is not None and not hasattr(client, "submit"):
        problems.append(f"client must be a distributed.Client, not {client!r}")
    if outcome is not None and not callable(outcome):
        problems.append(f"outcome must be a function of the drawn values, not {outcome!r}")
    refuse(problems)
    runs, seed = int(runs), int(seed)  # convert integers of NumPy
    draws = [_drawn(ranges, run, seed) for run in range(runs)]
    if outcome is None:
        table = ShortTable([{"run": run} | values for run, values in enumerate(draws)])
        table.attrs["drawn"] = list(ranges)
        return table
    texts = {name: _text(name, of) for name, of in ranges.items()}
    with nullcontext() if folder is None else Store(folder, seed, texts) as store:
        stored = store.rows(draws) if store else {}
        rows = {run: {"run": run} | draws[run] | row for run, row in stored.items()}
        missing = [run for run in range(runs) if run not in rows]
        line, failed, there = Line(progress), 0, runs - len(missing)
        jobs = ((run, draws[run]) for run in missing)
        count = workers or cores()
        pool = client.get_executor(pure=False) if client else ThreadPoolExecutor(count)
        made = _results(pool, ON_DASK if client else 2 * count, outcome, jobs)
        try:
            for done, (run, found) in enumerate(made, 1):
                rows[run] = {"run": run} | draws[run] | found
                if store:
                    refused = {FAILED: found[FAILED]} if FAILED in found else {}
                    numbers = {name: value for name, value in found.items() if name != FAILED}
                    store.add(run, draws[run], numbers, **refused)
                failed += FAILED in found
                text = f"{done} of {len(missing)} runs, {line.left(done / len(missing)):.0f} s left"
                text += f", {failed} refused" if failed else ""
                line.show(text + (f", {there} were there already" if there else ""))
        finally:
            line.close()
            made.close()
        table = ShortTable([rows[run] for run in sorted(rows)])
        table.attrs["drawn"] = list(ranges)
        if FAILED in table:
            table[FAILED] = table[FAILED].fillna("")
        if store:
            store.finish(table.to_csv(index=False, lineterminator="\n"))
    if FAILED in table and (table[FAILED] != "").all():
        raise FmuError(f"every run failed; the first: {table[FAILED].iloc[0]}")
    return table


def _one(outcome: Outcome, values: dict[str, Any]) -> dict[str, Any]:
    """Return the results of ``outcome`` for ``values``, or the message if the FMU fails."""
    try:
        found = outcome(dict(values))
    except FmuError as error:
        return {FAILED: str(error)}
    try:
        numbers = {str(name): _result(value) for name, value in dict(found).items()}
    except (TypeError, ValueError):
        raise FmuError(
            f'outcome must return numbers by name, such as {{"error": 0.1}}, not {found!r}'
        ) from None
    if FAILED in numbers:
        raise FmuError(
            f"outcome returns a value named {FAILED}, which is the column for the errors of "
            "failed runs: choose another name"
        )
    return numbers


def _result(value: Any) -> float:
    """Return a result of the user's outcome function as a float.

    A string raises TypeError, even if it consists of digits.
    """
    if isinstance(value, str | bytes | bytearray):
        raise TypeError
    return float(value)


def _checked(found: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    if twice := [name for name in found if name in values or name == "run"]:
        raise FmuError(f"outcome returns {', '.join(twice)}, which the table has already")
    return found


def _results(
    pool: Executor, most: int, outcome: Outcome, jobs: Iterator[tuple[int, dict[str, Any]]]
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield each run's number and results when it is done.

    ``jobs`` yields the number and the drawn values of each run. The workers of ``pool``, which are
    threads or workers of a Dask cluster, call ``outcome``; up to ``most`` runs are in progress.
    """
    with pool:
        under_way: dict[Future[dict[str, Any]], tuple[int, dict[str, Any]]] = {}
        try:
            while True:
                while len(under_way) < most and (job := next(jobs, None)):
                    under_way[pool.submit(_one, outcome, job[1])] = job
                if not under_way:
                    return
                done = wait(under_way, return_when=FIRST_COMPLETED).done
                # A run with an exception ends the study. Yield the other finished runs first.
                for future in sorted(done, key=lambda future: future.exception() is not None):
                    run, values = under_way.pop(future)
                    yield run, _checked(future.result(), values)
        finally:
            for future in under_way:
                future.cancel()


def _text(name: str, of: Range) -> str:
    """Return a string that identifies a range; stored runs are reused only if it is unchanged."""
    if hasattr(of, "ppf"):
        shape = ", ".join(f"{of.ppf(share):.17g}" for share in (0.01, 0.2, 0.5, 0.8, 0.99))
        kind = getattr(getattr(of, "dist", None), "name", type(of).__name__)
        return f"{kind} with quantiles {shape}"
    if isinstance(of, list):
        try:
            text = json.dumps(encoded(of))
        except TypeError as error:
            raise FmuError(
                f"{name} has {error}, which a study's folder cannot store (allowed: numbers, also "
                "of NumPy, Booleans, strings, paths, and lists, tuples and dictionaries of these); "
                "draw a number or a string instead, and look the value up in outcome"
            ) from None
        return text if len(text) < 200 else hashlib.sha256(text.encode()).hexdigest()
    low, high = of
    return f"{float(low)!r} to {float(high)!r}"


def quantiles(
    table: "pd.DataFrame",
    columns: Sequence[str] | str | None = None,
    at: Sequence[float] = (0.05, 0.5, 0.95, 0.99),
    confidence: float = 0.95,
) -> "pd.DataFrame":
    """Return quantiles of a study's results with their confidence intervals.

    The true quantile lies between ``low`` and ``high`` with at least the probability
    ``confidence``, for any distribution of the results (binomial; Conover, Practical Nonparametric
    Statistics, section 3.2). The bounds are infinite if there are too few runs.

    Parameters
    ----------
    table : pandas.DataFrame
        Result of `monte_carlo`; runs with NaN are left out.
    columns : str or sequence of str, optional
        Names of results, by default all columns of numbers except ``run``.
    at : sequence of float, default (0.05, 0.5, 0.95, 0.99)
        Quantiles, between 0 and 1.
    confidence : float, default 0.95
        Probability of the intervals.

    Returns
    -------
    pandas.DataFrame
        A row for each result and quantile. ``result`` is the name of the result, ``quantile`` the
        probability, and ``value`` the estimated quantile, interpolated linearly between the sorted
        results. ``low`` and ``high`` are the ends of its confidence interval, and ``runs`` is the
        number of runs that have this result.

    Raises
    ------
    FmuError
        If a column is not in the table, or a number is out of range.

    Examples
    --------
    >>> import hubslosh
    >>> table = hubslosh.monte_carlo({"tank.h": (0.05, 0.12)}, 200)
    >>> found = hubslosh.quantiles(table, at=[0.5])
    >>> bool(found["low"][0] < 0.085 < found["high"][0])
    True
    """
    from scipy.stats import binom

    from .short import ShortTable

    check_table(table, "the table")
    check_numbers(confidence=confidence)
    if columns is None:
        numeric = table.select_dtypes("number").columns
        names = [str(name) for name in numeric if name != "run"]
    else:
        problems: list[str] = []
        names = names_of(columns, "columns", problems)
        refuse(problems)
    check_columns(table, names, "the table")
    try:
        shares = [float(share) for share in np.atleast_1d(floats(at))]
    except (TypeError, ValueError):
        raise FmuError(f"at must be numbers between 0 and 1, not {at!r}") from None
    if not all(0 < share < 1 for share in shares) or not 0 < confidence < 1:
        raise FmuError("quantiles and confidence lie between 0 and 1")
    rows = []
    for name in names:
        values = np.sort(table[name].dropna().to_numpy(float))
        n = len(values)
        bounded = np.concatenate([[-np.inf], values, [np.inf]])
        for share in shares:
            low = int(binom.ppf((1 - confidence) / 2, n, share))
            high = int(binom.ppf((1 + confidence) / 2, n, share)) + 1
            value = float(np.quantile(values, share)) if n else np.nan
            rows.append((name, share, value, bounded[low], bounded[min(high, n + 1)], n))
    return ShortTable(rows, columns=["result", "quantile", "value", "low", "high", "runs"])
