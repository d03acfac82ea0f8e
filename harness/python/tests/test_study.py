"""A study's folder: what is stored comes back as it was, or the difference is named."""

import hashlib
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from hubslosh import FmuError, draw, monte_carlo, quantiles
from hubslosh.store import encoded

RANGES = {
    "tank.h": (0.04, 0.14),
    "hub.I": stats.norm(0.32, 0.01),
    "grid": [np.float64(0.075), np.float64(0.1)],
    "on": [True, False],
    "label": ["007", "7", "1e3", "nan", ""],
    "mixed": [1, 1.0, "1", None, np.int64(1), np.float32(1.0), np.bool_(True)],
    "size": [(50, "mm"), [50, "mm"], (50.0, "mm")],
    "vector": [np.array([1.0, np.nan]), np.array([1, 2])],
    "limit": [float("inf"), float("-inf"), float("nan"), -0.0, 0.0],
    "place": [Path("a/b"), {"a": 1}, b"a", 1j],
}
"""One name for each kind of value."""


def outcome(values: dict) -> dict[str, float]:
    """Return finite and non-finite numbers of a draw."""
    ratio = values["tank.h"] / 3
    limits = (ratio, np.float64(np.nan), np.inf, -0.0)
    return {"ratio": ratio, "limit found": limits[int(1e6 * ratio) % 4], "on found": values["on"]}


def cells(table: pd.DataFrame) -> list[str]:
    """Return a text for each cell: two are equal only if types and values are."""
    return [f"{name} {json.dumps(encoded(cell))}" for name in table for cell in table[name]]


def study(folder: Path | None, runs: int = 40, **more) -> pd.DataFrame:
    """Make the study of this file."""
    return monte_carlo(RANGES, runs, 3, more.pop("outcome", outcome), folder=folder, **more)


def not_called(values: dict) -> dict[str, float]:
    """Say that a stored run was simulated again."""
    raise AssertionError(values)


def test_a_resumed_study_returns_every_kind_of_value_with_its_type(tmp_path: Path) -> None:
    """Also in the rows that were stored by an earlier call with fewer runs."""
    whole = study(None)
    study(tmp_path, 17)
    resumed = study(tmp_path)
    again = study(tmp_path, outcome=not_called)
    assert cells(resumed) == cells(whole) == cells(again)
    pd.testing.assert_frame_equal(resumed, whole, check_exact=True)
    assert set(quantiles(again)["result"]) == set(quantiles(whole)["result"])
    assert {"grid", "tank.h", "limit found"} <= set(quantiles(again)["result"])
    sums = subprocess.run(
        ["sha256sum", "--check", "--strict", "manifest.sha256"], cwd=tmp_path, capture_output=True
    )
    assert sums.returncode == 0, sums.stdout
    assert len(pd.read_csv(tmp_path / "runs.csv")) == 40


def test_different_values_have_different_texts() -> None:
    """Values that are equal but of another type too."""
    values = [item for of in RANGES.values() if isinstance(of, list) for item in of]
    values += [
        np.array([[1, 2]]),
        np.array([[1], [2]]),
        np.array([1, 2], "f4"),
        "1j",
        {"float": "nan"},
    ]
    texts = [json.dumps(encoded(value)) for value in values]
    assert len(set(texts)) == len(texts)


def test_integers_of_numpy_count_as_seed_and_runs(tmp_path: Path) -> None:
    """They give the study of the same Python integers, stored or not."""
    table = monte_carlo(RANGES, np.int32(5), np.int64(3), outcome, folder=tmp_path)
    assert cells(table) == cells(study(tmp_path, 5, outcome=not_called))


def edited(path: Path, change) -> None:
    """Change what a stored run says."""
    stored = json.loads(path.read_text())
    change(stored)
    path.write_text(json.dumps(stored) + "\n")


def test_an_edited_run_is_named_and_not_used(tmp_path: Path) -> None:
    """The store compares values with the seed, then the SHA-256; a missing run is simulated."""
    whole = study(tmp_path)
    file = tmp_path / "runs" / "000007.json"
    original = file.read_bytes()
    value = draw(RANGES, 7, 3)["tank.h"]
    edited(file, lambda stored: stored["drawn"].update({"tank.h": 0.08}))
    said = rf"runs/000007.json is not run 7 of this seed: tank.h is 0.08, the seed gives {value}"
    with pytest.raises(FmuError, match=said):
        study(tmp_path, outcome=not_called)
    # The manifest may have been changed along with it.
    sums = (tmp_path / "manifest.sha256").read_text().splitlines()
    new = hashlib.sha256(file.read_bytes()).hexdigest()
    lines = [f"{new}  runs/000007.json" if "000007" in line else line for line in sums]
    (tmp_path / "manifest.sha256").write_text("\n".join(lines) + "\n")
    with pytest.raises(FmuError, match=said):
        study(tmp_path, outcome=not_called)
    file.unlink()
    assert cells(study(tmp_path)) == cells(whole)
    assert file.read_bytes() == original

    edited(file, lambda stored: stored["found"].update(ratio=1.0))
    file.with_name("000008.json").write_bytes(original)  # another run's file
    file.with_name("000009.json").write_bytes(original[:50])
    file.with_name("000010.json").write_bytes(b"")
    with pytest.raises(FmuError) as error:
        study(tmp_path, outcome=not_called)
    for words in (
        "runs/000007.json has another SHA-256 than manifest.sha256 says",
        "runs/000008.json is not run 8 of this seed",
        "runs/000009.json has another SHA-256",
        "and 1 more. Remove these files",
    ):
        assert words in str(error.value), error.value


def test_a_damaged_manifest_is_an_error_and_a_line_that_a_kill_cut_off_is_not(
    tmp_path: Path,
) -> None:
    """Missing, empty, cut short, without a line, with a wrong line, with bytes that are no text."""
    study(tmp_path)
    manifest = tmp_path / "manifest.sha256"
    good = manifest.read_bytes()
    lines = good.splitlines(keepends=True)
    twice = b"0" * 64 + lines[5][64:]
    for data, said in (
        (None, "manifest.sha256 is missing: without it nothing verifies the stored runs"),
        (b"", "runs/000000.json has no line in manifest.sha256"),
        (good[: len(good) // 2], "has no line in manifest.sha256"),
        (b"".join(lines[:3] + lines[4:]), "runs/000002.json has no line"),
        (good[:-1], None),  # the last line is that of study.json, which the call verifies
        (good.replace(b"  runs/000005", b" runs/000005"), "line 7 of .* is damaged"),
        (good.replace(b"\n", b"\nxx\n", 1), "line 2 of .* is damaged: 'xx'"),
        (b"\xff" + good, "utf-8"),
        (good + twice, "has another SHA-256"),
        (twice + good, None),  # the last line of a name counts
    ):
        if data is None:
            manifest.unlink()
        else:
            manifest.write_bytes(data)
        if said is None:
            study(tmp_path, outcome=not_called)
            assert manifest.read_bytes() == good
        else:
            with pytest.raises(FmuError, match=said):
                study(tmp_path, outcome=not_called)
        manifest.write_bytes(good)
    # A cut line: the run before it is stored, its own is simulated again.
    last = tmp_path / "runs" / "000039.json"
    last.unlink()
    manifest.write_bytes(
        good.replace(next(li for li in lines if b"000039" in li), b"") + lines[0][:20]
    )
    called = []
    study(tmp_path, outcome=lambda values: called.append(values) or outcome(values))
    assert len(called) == 1 and manifest.read_bytes() == good


def test_a_second_study_is_refused_while_one_holds_the_folder(tmp_path: Path) -> None:
    """It hears which process holds it; a process that is killed holds nothing."""

    def second(values: dict) -> dict[str, float]:
        with pytest.raises(FmuError) as error:
            study(tmp_path)
        assert f"is held by another study: process {os.getpid()}, monte_carlo" in str(error.value)
        assert "give another folder" in str(error.value)
        return outcome(values)

    study(tmp_path, 2, outcome=second, workers=1)
    study(tmp_path, 4)


def test_folders_of_campaigns_and_of_older_studies_are_refused(tmp_path: Path) -> None:
    """Nothing in them is changed."""
    old = {"seed": 3, "ranges": {}}
    for name, text, said in (
        ("plan.toml", "", "holds a campaign"),
        ("runs/a.parquet", "", "holds a campaign"),
        ("runs.csv", "run\n", "has runs.csv or runs/ but no study.json"),
        ("study.json", json.dumps(old), "a study of another version of HubSlosh"),
        ("study.json", "{", "the study's folder"),
    ):
        folder = tmp_path / name.replace("/", "_") / str(len(text))
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text)
        with pytest.raises(FmuError, match=said):
            study(folder)
        assert [path for path in folder.rglob("*") if path.is_file()] == [folder / name]


def test_what_cannot_be_stored_is_refused_before_the_first_run(tmp_path: Path) -> None:
    """Values without a text, and texts as results, which read like numbers."""
    with pytest.raises(FmuError, match=r"law has .*of type function.* cannot store"):
        monte_carlo({"law": [not_called]}, 2, 1, not_called, folder=tmp_path)
    with pytest.raises(FmuError, match="outcome must return numbers by name"):
        monte_carlo({"a": (0, 1)}, 2, 1, lambda values: {"label": "007"})


RUNS, KILLS = 200, 20

DRIVER = "from test_study import killed; import sys; killed(sys.argv[1], int(sys.argv[2]))"


def slow(values: dict) -> dict[str, float]:
    """Leave a moment in which a process can be killed."""
    time.sleep(0.001)
    return outcome(values)


def killed(folder: str, seed: int) -> None:
    """Start the study of 200 runs, and kill it 20 times at random; change a run half way.

    Each start is a fork of a process that has loaded everything.
    """
    chance = random.Random(seed)
    runs = Path(folder) / "runs"

    def stored() -> int:
        return len(list(runs.iterdir())) if runs.exists() else 0

    for kill in range(KILLS):
        before = stored()
        target = before + chance.randint(0, max((RUNS - 20 - before) // (KILLS - kill), 0))
        child = multiprocessing.get_context("fork").Process(
            target=study, args=(folder, RUNS), kwargs={"outcome": slow, "workers": 2}
        )
        child.start()
        while stored() < target and child.is_alive():
            time.sleep(0.0002)
        time.sleep(chance.uniform(0, 0.003))
        child.kill()
        child.join()
        assert child.exitcode == -signal.SIGKILL, "the study was not stopped"
        if kill == KILLS // 2:
            file = chance.choice(sorted(runs.iterdir()))
            edited(file, lambda stored: stored["drawn"].update({"tank.h": 0.1}))
            try:
                study(folder, RUNS, outcome=not_called)
            except FmuError as error:
                assert f"runs/{file.name} is not run {int(file.stem)}" in str(error), error
                assert "tank.h is 0.1" in str(error), error
                file.unlink()
            else:
                raise AssertionError("the change was not noticed")
    print(stored())


@pytest.mark.skipif(os.name == "nt", reason="Windows has no fork")
def test_a_study_killed_20_times_and_edited_once_equals_an_uninterrupted_one(
    tmp_path: Path,
) -> None:
    """Bit by bit, in every cell; the kills come at random moments of storing."""
    whole = study(None, RUNS)
    seed = int(os.environ.get("HUBSLOSH_FUZZ_SEED", "1"))
    command = [sys.executable, "-c", DRIVER, tmp_path, str(seed)]
    here = Path(__file__).parent
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (here, here.parent)))}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 0 < int(done.stdout) < RUNS
    called: list[dict] = []
    resumed = study(tmp_path, RUNS, outcome=lambda v: called.append(v) or outcome(v))
    assert len(called) == RUNS - int(done.stdout)
    assert cells(resumed) == cells(whole)
    assert not (tmp_path / ".unfinished").exists()
