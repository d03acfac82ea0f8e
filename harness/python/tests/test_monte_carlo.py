"""Monte Carlo studies: random draws, resumed studies, errors and quantiles."""

import threading
from concurrent import futures
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from hubslosh import FmuError, Loop, closed_loop, draw, monte_carlo, quantiles, sampling, simulate

RANGES = {
    "tank.h": (0.04, 0.14),
    "hub.I": stats.norm(0.32, 0.01),
    "slosh.model": ["linear", "planar"],
}


def largest_rate(fmu: Path):
    """Return the outcome function of a study: the largest rate of a controlled hub in 2 s."""

    def outcome(values: dict) -> dict[str, float]:
        parameters = {"friction.model": "viscous", "init.slosh_angle": 0.05} | values
        run = closed_loop([[0.4, 0.6]], 0.1, 2, fmu, parameters, delay=0.05, outputs=["omega"])
        return {"rate": run["omega"].abs().max()}

    return outcome


def test_a_draw_depends_only_on_seed_and_run() -> None:
    """A drawn value depends on neither the number of runs nor the quantities listed after it.

    The draws have the stated distributions.
    """
    table = monte_carlo(RANGES, 400, 7)
    pd.testing.assert_frame_equal(monte_carlo(RANGES, 10, 7), table[:10])
    assert draw(RANGES, 5, 7) == table.iloc[5, 1:].to_dict()
    assert draw(RANGES | {"tank.r": (0, 1)}, 5, 7).items() > draw(RANGES, 5, 7).items()
    assert not monte_carlo(RANGES, 10, 8)["tank.h"].equals(table["tank.h"][:10])
    # the Kolmogorov–Smirnov test of correct draws fails for one of a thousand seeds
    assert stats.kstest(table["tank.h"], stats.uniform(0.04, 0.1).cdf).pvalue > 1e-3
    assert stats.kstest(table["hub.I"], RANGES["hub.I"].cdf).pvalue > 1e-3
    assert stats.binomtest(int((table["slosh.model"] == "planar").sum()), 400).pvalue > 1e-3


def test_a_study_gives_the_results_of_single_runs_with_any_workers(
    fmu: Path, tmp_path: Path
) -> None:
    """Studies with threads, and a study that was stopped and resumed, are bit-identical."""
    outcome = largest_rate(fmu)
    table = monte_carlo(RANGES, 12, 1, outcome)
    assert table["rate"][3] == outcome(draw(RANGES, 3, 1))["rate"]

    class StoppedError(Exception):
        """Simulates a user who stops the study."""

    count, lock = [0], threading.Lock()

    def stops(values: dict) -> dict[str, float]:
        with lock:
            count[0] += 1
            if count[0] > 5:
                raise StoppedError
        return outcome(values)

    with pytest.raises(StoppedError):
        monte_carlo(RANGES, 12, 1, stops, folder=tmp_path, workers=2)
    there = list((tmp_path / "runs").iterdir())
    # The other worker may not have finished one of the five calls before the call that raises.
    assert 4 <= len(there) <= 5
    with (tmp_path / "manifest.sha256").open("a") as cut:  # as a killed process leaves the file
        cut.write("0123")
    called: list[dict] = []

    def counted(values: dict) -> dict[str, float]:
        called.append(values)
        return outcome(values)

    whole = monte_carlo(RANGES, 12, 1, counted, folder=tmp_path)
    assert len(called) == 12 - len(there)
    pd.testing.assert_frame_equal(whole.drop(columns="refused", errors="ignore"), table)
    again = monte_carlo(RANGES, 12, 1, counted, folder=tmp_path)
    assert len(called) == 12 - len(there)
    pd.testing.assert_frame_equal(again, whole)

    with pytest.raises(FmuError, match=r"another study, different in seed, tank.h; give another"):
        monte_carlo(RANGES | {"tank.h": (0.04, 0.1)}, 4, 2, outcome, folder=tmp_path)


@pytest.mark.long
def test_a_study_on_dask_gives_the_results_of_single_runs(fmu: Path) -> None:
    """The results of workers of a Dask cluster are bit-identical."""
    from distributed import Client

    outcome = largest_rate(fmu)
    table = monte_carlo(RANGES, 4, 1, outcome)
    with Client(
        processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None
    ) as client:
        pd.testing.assert_frame_equal(monte_carlo(RANGES, 4, 1, outcome, client=client), table)


def test_a_programming_error_ends_a_study_after_the_finished_runs(
    tmp_path: Path, monkeypatch
) -> None:
    """The thread that collects results may be late, as on a busy machine."""

    def outcome(values: dict) -> dict[str, float]:
        return {"twice": 2 * values["a"] / (values["a"] != third)}

    third = draw({"a": (0, 1)}, 3, 1)["a"]
    monkeypatch.setattr(sampling, "wait", lambda runs, return_when: futures.wait(runs))
    with pytest.raises(ZeroDivisionError):
        monte_carlo({"a": (0, 1)}, 40, 1, outcome, folder=tmp_path, workers=4)
    # Twice as many runs as workers are in progress at once.
    stored = sorted(int(file.stem) for file in (tmp_path / "runs").iterdir())
    assert stored == [0, 1, 2, 4, 5, 6, 7]


def test_a_study_with_threads_does_not_change_the_working_directory(
    fmu: Path, tmp_path: Path, monkeypatch
) -> None:
    """Loading the library of an FMU changes the working directory, which must be restored."""
    monkeypatch.chdir(tmp_path)
    Path("mine.fmu").write_bytes(fmu.read_bytes())
    Path("bench.toml").write_text('"friction.model" = "viscous"\n')
    simulate("mine.fmu", "bench.toml", stop=0.1)

    def outcome(values: dict) -> dict[str, float]:
        loop = Loop([[0.4, 0.6]], 0.1, "mine.fmu", "bench.toml")
        return {"rate": loop.simulate(1, values)["omega"].iloc[-1], "here": Path.cwd() == tmp_path}

    table = monte_carlo({"init.slosh_angle": (0.01, 0.1)}, 60, 1, outcome, workers=8)
    assert table["here"].all() and "refused" not in table and Path.cwd() == tmp_path


def test_a_refused_run_is_a_row_and_a_programming_error_ends_the_study(
    fmu: Path, tmp_path: Path
) -> None:
    """A negative depth, which the FMU refuses, becomes a row with the error.

    An outcome that returns no numbers is a mistake in the script and ends the study.
    """
    ranges = {"tank.h": (-0.1, 0.1)}

    def outcome(values: dict) -> dict[str, float]:
        return {"rate": simulate(fmu, values, stop=0.1)["omega"].iloc[-1]}

    table = monte_carlo(ranges, 8, 1, outcome, folder=tmp_path)
    failed = table["tank.h"] < 0
    assert 0 < failed.sum() < 8 and table["rate"].isna().equals(failed)
    assert table.loc[failed, "refused"].str.contains("tank.h").all()
    assert (table.loc[~failed, "refused"] == "").all()
    pd.testing.assert_frame_equal(monte_carlo(ranges, 8, 1, outcome, folder=tmp_path), table)
    with pytest.raises(FmuError, match=r"every run failed; the first: .*tank.h"):
        monte_carlo({"tank.h": (-0.2, -0.1)}, 2, 1, outcome)
    with pytest.raises(FmuError, match="outcome must return numbers by name"):
        monte_carlo(ranges, 2, 1, lambda values: 3)
    with pytest.raises(FmuError, match=r"returns tank.h, which the table has already"):
        monte_carlo(ranges, 2, 1, lambda values: values)
    with pytest.raises(FmuError) as error:
        monte_carlo({"a": (2, 1), "b": 3, "c": []}, 0, -1, 5)
    for part in ("a cannot be (2, 1)", "b cannot be 3", "c cannot be []", "runs must", "seed must",
                 "outcome must"):  # fmt: skip
        assert part in str(error.value), part


def test_a_range_in_per_cent_is_relative_to_the_nominal_value(tmp_path: Path) -> None:
    """A share gives the same draws and the same stored study as (low, high).

    A share needs a nominal value.
    """
    ranges, nominal = {"a": "10%", "b": "± 5 %", "c": ["x", "y"]}, {"a": 2.0, "b": -4.0}
    ends = {"a": (1.8, 2.2), "b": (-4.2, -3.8), "c": ["x", "y"]}
    table = monte_carlo(ranges, 40, 3, nominal=nominal)
    pd.testing.assert_frame_equal(table, monte_carlo(ends, 40, 3))
    assert draw(ranges, 7, 3, nominal=nominal) == draw(ends, 7, 3)

    def double(values: dict) -> dict[str, float]:
        return {"twice": 2 * values["a"]}

    first = monte_carlo(ranges, 5, 3, double, folder=tmp_path, nominal=nominal)
    pd.testing.assert_frame_equal(monte_carlo(ends, 5, 3, double, folder=tmp_path), first)
    for given, text in {
        None: r"b is given as ± 5 % of its nominal value, which is not known: give nominal=",
        ("b", 0.0): "b is 0, so that ± 5 % of it is no range",
        ("b", "4 m"): r"nominal\['b'\] must be a finite number, not '4 m'",
    }.items():
        values = {"a": 2.0} | dict([given] if given else [])
        with pytest.raises(FmuError, match=text):
            monte_carlo(ranges, 5, 3, nominal=values)
    with pytest.raises(FmuError, match="a cannot be '10'"):
        monte_carlo({"a": "10"}, 5, nominal=nominal)


def test_intervals_of_quantiles_have_their_stated_coverage() -> None:
    """For the median of 50 numbers the interval must contain the true value in 96.7 % of samples.

    600 samples determine this share to ± 0.7 %.
    """
    random = np.random.default_rng(1)
    inside = 0
    for _ in range(600):
        row = quantiles(pd.DataFrame({"x": random.exponential(size=50)}), at=[0.5]).iloc[0]
        inside += row["low"] <= np.log(2) <= row["high"]
    assert 0.945 < inside / 600 < 0.985
    few = quantiles(pd.DataFrame({"run": range(10), "x": range(10)}), at=[0.99])
    assert few["high"].iloc[0] == np.inf and few["result"].tolist() == ["x"]
    with pytest.raises(FmuError, match="no column y"):
        quantiles(pd.DataFrame({"x": [1.0]}), ["y"])
