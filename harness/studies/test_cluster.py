"""Runs on a Dask cluster equal runs of the harness, also if runs fail or workers are killed."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import Client

import cluster
import hubslosh
from cluster_comparison import Killer, compare, difference, maker

pytestmark = pytest.mark.long

PLAN = """
title = "Sweeps and a pulse"
profile = "exp-sweep:f0=2.1,f1=2.8,duration=120"
[set]
imu.enabled = true
[[run]]
profile = "exp-sweep:f0=2.1,f1=2.8,duration=120,amplitude=0.05"
[[run]]
profile = "exp-sweep:f0=2.1,f1=2.8,duration=120,amplitude=0.2"
[[run]]
profile = "pulse:amplitude=0.2,start=1,width=1,duration=60"
[vary]
slosh.model = ["linear", "spherical"]
[count]
imu.seed = 2
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    """Return a client of a Dask cluster of two local workers."""
    with cluster.cluster(2, None) as client:
        yield client


@pytest.fixture
def harness(program: Path, fmu: Path, tmp_path: Path):
    """Return a function from the text of a plan and a directory name to a `cluster.Harness`."""

    def make(plan: str, out: str) -> cluster.Harness:
        path = tmp_path / "plan.toml"
        path.write_text(plan)
        return cluster.Harness(program, fmu, str(path), tmp_path / out)

    return make


@pytest.fixture
def long_runs(monkeypatch) -> None:
    """Make each run last half a second, so that a worker can be killed in the middle of a run."""
    right = cluster.drive_here

    def drive_here(fmu, run, torque, columns):
        import time

        time.sleep(0.5)
        return right(fmu, run, torque, columns)

    monkeypatch.setattr(cluster, "drive_here", drive_here)


@pytest.mark.usefixtures("long_runs")
def test_runs_of_a_cluster_with_a_killed_worker_equal_runs_of_the_harness(client, harness) -> None:
    """The results are bit-identical to those of `hubslosh campaign`."""
    theirs = harness(PLAN, "theirs")
    worst, killer = compare(client, harness(PLAN, "ours"), theirs)
    assert len(worst) > 80
    assert max(worst.values()) == 0.0, worst
    again = maker(theirs.out / "runs" / f"{killer.interrupted}.parquet")
    assert again.startswith("hubslosh ")
    assert not again.endswith(f" {killer.process}"), "the run was not interrupted"


@pytest.mark.usefixtures("long_runs")
def test_a_new_worker_receives_fmu_and_torque_after_the_only_worker_was_killed(harness) -> None:
    """The new worker receives FMU and torque again, because no other worker has them."""
    plan = 'profile = "exp-sweep:duration=60"\n[vary]\nprofile.amplitude = [0.05, 0.1, 0.2]\n'
    with cluster.cluster(1, None) as client:
        assert len(client.nthreads()) == 1
        killer = Killer(client)
        assert cluster.make_runs(client, harness(plan, "c"), killer.made) == {}
    assert killer.interrupted


def test_a_refused_run_and_a_run_that_kills_its_workers_do_not_affect_other_runs(
    client, harness, monkeypatch
) -> None:
    """A second start simulates only runs that are missing, damaged, or have other settings."""
    plan = 'profile = "sine:duration=2"\n[vary]\ntank.h = [0.05, -1, 0.07, 0.09, 0.11]\n'
    ours = harness(plan, "c")
    right = cluster.drive_here

    def drive_here(fmu, run, torque, columns):
        if run["settings"]["tank.h"] == 0.07:
            import os

            os._exit(1)
        return right(fmu, run, torque, columns)

    # give up after one killed worker instead of four, which saves time
    monkeypatch.setattr(client.cluster.scheduler, "allowed_failures", 0)
    monkeypatch.setattr(cluster, "drive_here", drive_here)
    made: list[str] = []
    failed = cluster.make_runs(client, ours, lambda run: made.append(run["name"]))
    assert sorted(made) == ["linear_110mm_100", "linear_50mm_100", "linear_90mm_100"]
    assert sorted(failed) == ["linear_-1000mm_100", "linear_70mm_100"]
    assert "tank.h = -1" in failed["linear_-1000mm_100"]
    assert failed["linear_70mm_100"] == "1 workers died while they simulated it"
    monkeypatch.undo()

    whole = ours.out / "runs" / "linear_50mm_100.parquet"
    whole.write_bytes(whole.read_bytes()[:-100])
    flipped = ours.out / "runs" / "linear_90mm_100.parquet"
    right_data = flipped.read_bytes()
    flipped.write_bytes(right_data[:500] + bytes([right_data[500] ^ 1]) + right_data[501:])
    made.clear()
    failed = cluster.make_runs(client, ours, lambda run: made.append(run["name"]))
    assert sorted(made) == ["linear_50mm_100", "linear_70mm_100", "linear_90mm_100"]
    store = cluster.Store.campaign(ours.out, "a test")
    with pytest.raises(hubslosh.FmuError, match=r"is in use by another campaign: .*a test"):
        cluster.make_runs(client, ours)
    store.close()
    assert list(failed) == ["linear_-1000mm_100"]
    assert not list(ours.out.rglob(".hubslosh-*"))
    changed = harness(plan.replace("duration=2", "duration=3"), "c")
    made.clear()
    cluster.make_runs(client, changed, lambda run: made.append(run["name"]))
    assert len(made) == 4


def test_errors_are_reported_before_workers_are_started(monkeypatch, capsys, fmu, tmp_path) -> None:
    """A wrong plan, program or number of workers gives one sentence, and no file is written."""
    monkeypatch.chdir(tmp_path)
    for flags, words in (
        (["--hubslosh", "nowhere"], "nowhere cannot be started"),
        (["--workers", "0"], '"0" is not a number of workers'),
    ):
        arguments = ["cluster.py", "--plan", "thesis", "--fmu", str(fmu), *flags]
        monkeypatch.setattr(sys, "argv", arguments)
        with pytest.raises(SystemExit) as left:
            cluster.main()
        assert left.value.code != 0
        assert words in f"{left.value.code} {capsys.readouterr().err}"
    assert not list(tmp_path.iterdir())


def test_differences_of_numbers_are_relative_and_of_texts_zero_or_infinite() -> None:
    """The difference between an empty cell and a number is infinite."""
    assert difference("1.5", "1.50") == 0.0
    assert difference("2.0", "2.000000002") == pytest.approx(1e-9)
    assert difference("", "0.1") == difference("a", "b") == float("inf")
