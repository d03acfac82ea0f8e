"""Monte Carlo: parameters drawn at random, one run each, resumable; quantiles of what comes out."""

import csv
import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .arguments import check_numbers, check_table, names_of
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

Outcome = Callable[[dict[str, Any]], Mapping[str, float]]
"""What is found of one draw: numbers by name, from values by name."""

Range = Any
"""(low, high): uniform; a list: one of its items; a frozen distribution of ``scipy.stats``."""

DRAWS, STUDY = "runs.csv", "study.json"
"""Files of a study's folder."""

FAILED = "refused"
"""Column that says what the FMU refused."""


def draw(ranges: Mapping[str, Range], run: int, seed: int = 1) -> dict[str, Any]:
    """Return the values of one run, counted from 0; see `monte_carlo`.

    They depend on the seed, the run and the order of the names, on nothing else: not on how many
    runs there are, nor on names that follow.
    """
    if wrong := _wrong(ranges) + _not_whole(run=(run, 0), seed=(seed, 0)):
        raise FmuError("; ".join(wrong))
    random = np.random.default_rng([seed, run])
    return {name: _value(name, of, random.random()) for name, of in ranges.items()}


def _value(name: str, of: Range, share: float) -> Any:
    """Return the value that a uniform number in [0, 1) stands for."""
    if hasattr(of, "ppf"):
        value = of.ppf(share)
    elif isinstance(of, list):
        return of[int(share * len(of))]
    else:
        low, high = of
        value = low + share * (high - low)
    return float(value)


def _wrong(ranges: Any) -> list[str]:
    """Return what is wrong with ranges."""
    if not isinstance(ranges, Mapping) or not ranges:
        return ["ranges must be (low, high), a list or a distribution for each name"]
    found = []
    for name, of in ranges.items():
        if hasattr(of, "ppf") or (isinstance(of, list) and of):
            continue
        try:
            low, high = (float(bound) for bound in of)
            if np.isfinite([low, high]).all() and low < high:
                continue
        except (TypeError, ValueError):
            pass
        found.append(
            f"{name} cannot be {of!r} (allowed: (low, high) with low < high, a list of values, a "
            "distribution such as scipy.stats.norm(650, 10))"
        )
    return found


def _not_whole(**values: tuple[Any, int]) -> list[str]:
    """Return which arguments are no whole numbers from a least one on."""
    return [
        f"{name} must be a whole number from {least} on, not {value!r}"
        for name, (value, least) in values.items()
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least
    ]


def monte_carlo(
    ranges: Mapping[str, Range],
    runs: int,
    seed: int = 1,
    outcome: Outcome | None = None,
    *,
    folder: str | Path | None = None,
    client: Any = None,
    workers: int | None = None,
    progress: bool | None = None,
) -> "pd.DataFrame":
    """Draw values at random, make a run with each, and return a row for each.

    ranges: by name, (low, high) for a uniform distribution, a list of values, or a frozen
    distribution of ``scipy.stats``. A run's values depend on seed and run alone: 400 runs begin
    with the 200 that there were.
    outcome: a function of the values (by name) that makes the run and returns numbers by name.
    Without it the draws alone are returned.
    folder: for a study that can be stopped: each run's row is written there at once, ``runs.csv``.
    The same call goes on where it was stopped; another study is refused there. The function may
    not be compared: name the folder anew when you change it.
    client: of dask.distributed; its workers need this package. Otherwise ``workers`` threads, by
    default one per core: closed loops with a linear controller and `simulate` run in compiled code
    side by side, a controller in Python runs on one core at a time.
    progress: a line on stderr with runs done and time left; by default on a terminal.

    Returns a table with the columns ``run``, the names of the ranges, and what the outcomes have. A
    run that the FMU refuses has NaN there, and the reason in the column ``refused``. Any other
    exception ends the study; what is in the folder stays. `quantiles` sums it up.
    """
    import pandas as pd

    problems = _wrong(ranges) + _not_whole(runs=(runs, 1), seed=(seed, 0))
    problems += [] if workers is None else _not_whole(workers=(workers, 1))
    if not isinstance(folder, str | Path | None):
        problems.append(f"folder must be a path, not {folder!r}")
    if client is not None and not hasattr(client, "submit"):
        problems.append(f"client must be a distributed.Client, not {client!r}")
    if outcome is not None and not callable(outcome):
        problems.append(f"outcome must be a function of the drawn values, not {outcome!r}")
    if problems:
        raise FmuError("; ".join(problems))
    draws = [draw(ranges, run, seed) for run in range(runs)]
    if outcome is None:
        return pd.DataFrame([{"run": run} | values for run, values in enumerate(draws)])
    with _Store(folder, ranges, seed) as store:
        rows = {run: row for run, row in store.rows.items() if run < runs}
        missing = [run for run in range(runs) if run not in rows]
        shown = sys.stderr.isatty() if progress is None else progress
        bar = _Progress(len(missing), runs - len(missing), shown)
        jobs = ((run, draws[run]) for run in missing)
        made = _on_dask(client, outcome, jobs) if client else _in_threads(workers, outcome, jobs)
        try:
            for run, found in made:
                rows[run] = {"run": run} | draws[run] | found
                store.add(rows[run])
                bar.step(FAILED in found)
        finally:
            bar.close()
            made.close()
    table = pd.DataFrame([rows[run] for run in sorted(rows)])
    if FAILED in table:
        table[FAILED] = table[FAILED].fillna("")
        failed = (table[FAILED] != "").sum()
        if failed == len(table):
            raise FmuError(f"every run failed; the first: {table[FAILED].iloc[0]}")
    return table


def _one(outcome: Outcome, values: dict[str, Any]) -> dict[str, Any]:
    """Return what is found of one draw."""
    try:
        found = outcome(dict(values))
    except FmuError as error:
        return {FAILED: str(error)}
    try:
        numbers = {str(name): float(value) for name, value in dict(found).items()}
    except (TypeError, ValueError):
        raise FmuError(
            f'outcome must return numbers by name, such as {{"error": 0.1}}, not {found!r}'
        ) from None
    if FAILED in numbers:
        raise FmuError(f"outcome returns {FAILED}, the column for what the FMU says")
    return numbers


def _checked(found: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    if twice := [name for name in found if name in values or name == "run"]:
        raise FmuError(f"outcome returns {', '.join(twice)}, which the table has already")
    return found


def _in_threads(
    workers: int | None, outcome: Outcome, jobs: Iterator[tuple[int, dict[str, Any]]]
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield runs and what is found of them, as they are done."""
    count = workers or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
    count = workers or count or os.cpu_count() or 1
    with ThreadPoolExecutor(count) as pool:
        under_way: dict[Future[dict[str, Any]], tuple[int, dict[str, Any]]] = {}
        try:
            while True:
                while len(under_way) < 2 * count and (job := next(jobs, None)):
                    under_way[pool.submit(_one, outcome, job[1])] = job
                if not under_way:
                    return
                done = wait(under_way, return_when=FIRST_COMPLETED).done
                # A run that raised ends the study: after those that were done with it.
                for future in sorted(done, key=lambda future: future.exception() is not None):
                    run, values = under_way.pop(future)
                    yield run, _checked(future.result(), values)
        finally:
            for future in under_way:
                future.cancel()


def _on_dask(
    client: Any, outcome: Outcome, jobs: Iterator[tuple[int, dict[str, Any]]]
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield runs and what is found of them, as the cluster has them done."""
    from distributed import as_completed

    under_way = {}
    for run, values in jobs:
        future = client.submit(_one, outcome, values, pure=False, key=f"hubslosh-{id(jobs)}-{run}")
        under_way[future] = run, values
    try:
        for future in as_completed(list(under_way)):
            run, values = under_way.pop(future)
            yield run, _checked(future.result(), values)
    finally:
        client.cancel(list(under_way))


class _Store:
    """The folder of a study: what it is, and a row for each run that is done."""

    def __init__(self, folder: str | Path | None, ranges: Mapping[str, Range], seed: int) -> None:
        self.rows: dict[int, dict[str, Any]] = {}
        self.file: Any = None
        self.columns: list[str] | None = None
        self.waiting: list[dict[str, Any]] = []
        self.path = None if folder is None else Path(folder)
        self.study = {"seed": seed, "ranges": {name: _text(of) for name, of in ranges.items()}}

    def __enter__(self) -> "_Store":
        if self.path is None:
            return self
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            study, table = self.path / STUDY, self.path / DRAWS
            if study.exists():
                self._compare(json.loads(study.read_text(encoding="utf-8")))
            else:
                if table.exists():
                    raise FmuError(f"{self.path} has a {DRAWS} but no {STUDY}: not a study of ours")
                text = json.dumps(self.study, indent=2) + "\n"
                study.write_text(text, encoding="utf-8")
            self._read(table)
            self.file = table.open("a", newline="", encoding="utf-8")
        except (OSError, ValueError) as error:
            raise FmuError(f"the study's folder {self.path}: {error}") from None
        return self

    def __exit__(self, *_: object) -> None:
        if self.file is not None:
            self.file.close()

    def _compare(self, there: Any) -> None:
        if there != self.study:
            names = ["seed"] if there.get("seed") != self.study["seed"] else []
            mine, other = self.study["ranges"], there.get("ranges", {})
            names += [n for n in (*mine, *other) if mine.get(n) != other.get(n)]
            if not names:
                names = ["the order of the names"]
            raise FmuError(
                f"{self.path} holds another study, different in {', '.join(dict.fromkeys(names))}; "
                "give another folder"
            )

    def _read(self, path: Path) -> None:
        """Take the rows that are there; a last line that was cut off is dropped."""
        if not path.exists():
            return
        text = path.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            path.write_text(whole, encoding="utf-8")
        lines = list(csv.reader(whole.splitlines()))
        if not lines:
            return
        self.columns = lines[0]
        kinds = self.study["ranges"]
        for line in lines[1:]:
            row: dict[str, Any] = {}
            for name, text in zip(self.columns, line, strict=True):
                if name == FAILED:
                    if text:
                        row[name] = text
                elif name == "run":
                    row[name] = int(text)
                elif text:
                    row[name] = _number(text) if name in kinds else float(text)
            self.rows[row["run"]] = row

    def add(self, row: dict[str, Any]) -> None:
        """Write a row; it is on the disk when this returns."""
        if self.file is None:
            return
        names = [name for name in row if name != FAILED]
        if self.columns is None and FAILED in row and len(names) == 1 + len(self.study["ranges"]):
            self.waiting.append(row)  # until a run says what it finds
            return
        try:
            writer = csv.writer(self.file, lineterminator="\n")
            if self.columns is None:
                self.columns = [*names, FAILED]
                writer.writerow(self.columns)
            if more := [name for name in names if name not in self.columns]:
                raise FmuError(f"outcome returns {', '.join(more)}, which earlier runs have not")
            for one in (*self.waiting, row):
                cells = [one.get(name, "") for name in self.columns]
                writer.writerow([repr(c) if isinstance(c, float) else c for c in cells])
            self.waiting.clear()
            self.file.flush()
        except OSError as error:
            raise FmuError(f"{self.path}: {error}") from None


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _text(of: Range) -> str:
    """Return what tells one range from another."""
    if hasattr(of, "ppf"):
        shape = ", ".join(f"{of.ppf(share):.17g}" for share in (0.01, 0.2, 0.5, 0.8, 0.99))
        name = getattr(getattr(of, "dist", None), "name", type(of).__name__)
        return f"{name} with quantiles {shape}"
    if isinstance(of, list):
        text = json.dumps(of, default=str)
        return text if len(text) < 200 else hashlib.sha256(text.encode()).hexdigest()
    low, high = of
    return f"{float(low)!r} to {float(high)!r}"


class _Progress:
    """A line on stderr."""

    def __init__(self, runs: int, there: int, shown: bool) -> None:
        import time

        self.runs, self.shown, self.done, self.failed = runs, shown and runs > 0, 0, 0
        self.clock, self.start = time.monotonic, time.monotonic()
        self.last = 0.0
        if self.shown and there:
            print(f"{there} runs are there already", file=sys.stderr)

    def step(self, failed: bool) -> None:
        self.done += 1
        self.failed += failed
        now = self.clock()
        if self.shown and (now - self.last > 0.2 or self.done == self.runs):
            self.last = now
            left = (now - self.start) / self.done * (self.runs - self.done)
            text = f"\r{self.done} of {self.runs} runs, {left:.0f} s left"
            text += f", {self.failed} refused" if self.failed else ""
            print(f"{text}   ", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self.shown and self.done:
            print(file=sys.stderr)


def quantiles(
    table: "pd.DataFrame",
    columns: Sequence[str] | str | None = None,
    at: Sequence[float] = (0.05, 0.5, 0.95, 0.99),
    confidence: float = 0.95,
) -> "pd.DataFrame":
    """Return quantiles of a study's results with their confidence intervals.

    table: of `monte_carlo`; runs without a number are left out. columns: by default all but
    ``run``. Columns: ``result``, ``quantile``, ``value`` (linear between order statistics), ``low``
    and ``high``: order statistics between which the true quantile lies with ``confidence`` or more,
    whatever the distribution (binomial; Conover, Practical Nonparametric Statistics, section 3.2);
    infinite where there are too few runs to say; and ``runs``, their number.
    """
    import pandas as pd
    from scipy.stats import binom

    check_table(table, "the table")
    check_numbers(confidence=confidence)
    if columns is None:
        numeric = table.select_dtypes("number").columns
        names = [str(name) for name in numeric if name != "run"]
    else:
        problems: list[str] = []
        names = names_of(columns, "columns", problems)
        if problems:
            raise FmuError("; ".join(problems))
    if missing := [name for name in names if name not in table.columns]:
        raise FmuError(f"the table has no column {', '.join(missing)}")
    try:
        shares = [float(share) for share in np.atleast_1d(np.asarray(at, float))]
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
    return pd.DataFrame(rows, columns=["result", "quantile", "value", "low", "high", "runs"])
