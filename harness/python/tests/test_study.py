"""Folders of Monte Carlo studies: stored runs are reused unchanged, or reported as damaged."""

import hashlib
import json
import multiprocessing
import os
import random
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import option
from scipy import stats

from hubslosh import FmuError, FmuWarning, draw, monte_carlo, quantiles
from hubslosh.store import encoded

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

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
"""Ranges with one name for each type of value."""


def outcome(values: dict) -> dict[str, float]:
    """Return the results of a draw in a study; some are finite and some are not."""
    ratio = values["tank.h"] / 3
    limits = (ratio, np.float64(np.nan), np.inf, -0.0)
    return {"ratio": ratio, "limit found": limits[int(1e6 * ratio) % 4], "on found": values["on"]}


def cells(table: pd.DataFrame) -> list[str]:
    """Return a string for each cell; two strings are equal only if types and values are equal."""
    return [f"{name} {json.dumps(encoded(cell))}" for name in table for cell in table[name]]


def study(folder: Path | None, runs: int = 40, **more) -> pd.DataFrame:
    """Run a study with the outcome function `outcome`, and store its runs in ``folder``."""
    return monte_carlo(RANGES, runs, 3, more.pop("outcome", outcome), folder=folder, **more)


def not_called(values: dict) -> dict[str, float]:
    """Fail, because a run that is stored must not be simulated again."""
    raise AssertionError(values)


def test_a_resumed_study_returns_every_value_with_its_type(tmp_path: Path) -> None:
    """Rows stored by an earlier call with fewer runs are included."""
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


def test_different_values_are_stored_as_different_strings() -> None:
    """Equal values of different types, such as 1 and True, also have different strings."""
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


def test_seed_and_runs_may_be_integers_of_numpy(tmp_path: Path) -> None:
    """They give the same study as integers of Python, stored or not."""
    table = monte_carlo(RANGES, np.int32(5), np.int64(3), outcome, folder=tmp_path)
    assert cells(table) == cells(study(tmp_path, 5, outcome=not_called))


def edited(path: Path, change) -> None:
    """Apply the function ``change`` to the text of the stored run ``path``."""
    stored = json.loads(path.read_text())
    change(stored)
    path.write_text(json.dumps(stored) + "\n")


def test_an_edited_stored_run_is_named_and_simulated_again(tmp_path: Path) -> None:
    """A run with values that the seed does not give, or with a wrong SHA-256, is simulated again.

    A warning names the run.
    """
    whole = study(tmp_path)
    file = tmp_path / "runs" / "000007.json"
    original = file.read_bytes()
    value = draw(RANGES, 7, 3)["tank.h"]
    edited(file, lambda stored: stored["drawn"].update({"tank.h": 0.08}))
    said = rf"re-running run 7: tank.h is 0.08, but the seed gives {value}"
    forged = file.read_bytes()
    with pytest.warns(FmuWarning, match=said):
        assert cells(study(tmp_path)) == cells(whole)
    assert file.read_bytes() == original
    # The edited run is also noticed if the manifest was changed to match it.
    file.write_bytes(forged)
    sums = (tmp_path / "manifest.sha256").read_text().splitlines()
    new = hashlib.sha256(forged).hexdigest()
    lines = [f"{new}  runs/000007.json" if "000007" in line else line for line in sums]
    (tmp_path / "manifest.sha256").write_text("\n".join(lines) + "\n")
    with pytest.warns(FmuWarning, match=said):
        assert cells(study(tmp_path)) == cells(whole)
    assert file.read_bytes() == original
    file.unlink()
    with pytest.warns(FmuWarning, match="re-running run 7: the file of the run is missing"):
        assert cells(study(tmp_path)) == cells(whole)

    edited(file, lambda stored: stored["found"].update(ratio=1.0))
    file.with_name("000008.json").write_bytes(original)  # another run's file
    file.with_name("000009.json").write_bytes(original[:50])
    file.with_name("000010.json").write_bytes(b"")
    with pytest.warns(FmuWarning) as warned:
        assert cells(study(tmp_path)) == cells(whole)
    (warning,) = warned
    for words in (
        f"{tmp_path}: re-running run 7: the SHA-256 of the file differs from the one in",
        "re-running run 8: tank.h is ",
        "re-running run 9: the SHA-256 of the file differs from the one in manifest.sha256",
        "; and 1 more",
    ):
        assert words in str(warning.message), warning.message
    assert warning.filename == __file__


def test_a_damaged_manifest_is_an_error_and_a_line_that_a_kill_cut_off_is_not(
    tmp_path: Path,
) -> None:
    """Damaged manifests are missing, empty, cut off, not text, or have a wrong or missing line."""
    study(tmp_path)
    manifest = tmp_path / "manifest.sha256"
    good = manifest.read_bytes()
    lines = good.splitlines(keepends=True)
    twice = b"0" * 64 + lines[5][64:]
    for data, again in (
        (b"", 40),
        (good[: len(good) // 2], 20),
        (b"".join(lines[:3] + lines[4:]), 1),
        (good[:-1], 0),  # the cut last line is the line of study.json, which is verified otherwise
        (good + twice, 1),
        (twice + good, 0),  # if a name has two lines, the last line counts
    ):
        manifest.write_bytes(data)
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", FmuWarning)
            assert len(simulated(tmp_path)) == again, data
        assert len(warned) == (again > 0) and manifest.read_bytes() == good
    for data, said in (
        (None, "nothing verifies the stored runs; restore it, or remove .*runs .*it is missing"),
        (good.replace(b"  runs/000005", b" runs/000005"), "is damaged or missing, so .*line 7 is"),
        (good.replace(b"\n", b"\nxx\n", 1), 'is damaged or missing, so .*line 2 is "xx"'),
        (b"\xff" + good, "is damaged or missing, so nothing verifies .*byte 1 is not UTF-8"),
    ):
        if data is None:
            manifest.unlink()
        else:
            manifest.write_bytes(data)
        with pytest.raises(FmuError, match=said):
            study(tmp_path, outcome=not_called)
        manifest.write_bytes(good)
    # The last line is cut off: its run is simulated again, and the other runs are reused.
    last = tmp_path / "runs" / "000039.json"
    last.unlink()
    manifest.write_bytes(
        good.replace(next(li for li in lines if b"000039" in li), b"") + lines[0][:20]
    )
    assert len(simulated(tmp_path)) == 1 and manifest.read_bytes() == good


def simulated(folder: Path) -> list[dict]:
    """Run the study in ``folder``, and return the draws that were not yet stored."""
    called: list[dict] = []
    study(folder, outcome=lambda values: called.append(values) or outcome(values))
    return called


def test_a_second_study_in_a_folder_is_refused_while_the_first_one_runs(tmp_path: Path) -> None:
    """The message names the process that locks the folder; a killed process locks nothing."""

    def second(values: dict) -> dict[str, float]:
        with pytest.raises(FmuError) as error:
            study(tmp_path)
        assert f"is in use by another study: process {os.getpid()}, monte_carlo" in str(error.value)
        assert "give another folder" in str(error.value)
        return outcome(values)

    study(tmp_path, 2, outcome=second, workers=1)
    study(tmp_path, 4)


def test_folders_of_campaigns_and_of_older_studies_are_refused(tmp_path: Path) -> None:
    """The files in such a folder are not changed."""
    old = {"seed": 3, "ranges": {}}
    for name, text, said in (
        ("plan.toml", "", "holds a campaign"),
        ("runs/a.parquet", "", "holds a campaign"),
        ("runs.csv", "run\n", "has runs.csv or runs/ but no study.json"),
        ("study.json", json.dumps(old), "a study of another version of HubSlosh"),
        ("study.json", "{", "study.json is damaged; restore it, or give another folder"),
    ):
        folder = tmp_path / name.replace("/", "_") / str(len(text))
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text)
        with pytest.raises(FmuError, match=said):
            study(folder)
        assert [path for path in folder.rglob("*") if path.is_file()] == [folder / name]


Door = Callable[[Path], tuple[bool, str]]
"""Function that stores two runs in a folder; it returns success, and errors and warnings."""


@pytest.fixture
def doors(request: pytest.FixtureRequest, fmu: Path, tmp_path: Path) -> dict[str, Door]:
    """Return two functions that open a folder with stored runs.

    One is the command's campaign, the other is the package's study.
    """
    program = option(request, "--hubslosh")
    plan = tmp_path / "plan.toml"
    plan.write_text('profile = "sine:duration=0.2"\n[vary]\nhub.I = [0.3, 0.31]\n')

    def campaign(folder: Path) -> tuple[bool, str]:
        command = [program, "campaign", "--plan", plan, "--fmu", fmu, "--out", folder]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done.returncode == 0, done.stderr

    def of_python(folder: Path) -> tuple[bool, str]:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", FmuWarning)
            try:
                study(folder, 2)
            except FmuError as error:
                return False, str(error)
        return True, "".join(str(warning.message) for warning in warned)

    return {"campaign": campaign, "study": of_python}


def test_campaigns_and_studies_accept_and_refuse_the_same_folders(
    doors: dict[str, Door], tmp_path: Path
) -> None:
    """A folder is locked, has a damaged manifest or an incomplete run, or is of the other kind."""
    for kind, door in doors.items():
        folder = tmp_path / kind
        assert door(folder) == (True, ""), kind
        assert door(folder) == (True, ""), kind
        manifest = folder / "manifest.sha256"
        good = manifest.read_bytes()
        first = min((folder / "runs").iterdir())
        whole = first.read_bytes()
        lines = good.splitlines(keepends=True)
        row = next(line for line in lines if first.name.encode() in line)

        def says(succeeds: bool, *words: str) -> None:
            succeeded, text = door(folder)  # noqa: B023 - called in this turn of the loop
            assert succeeded is succeeds, (kind, text)  # noqa: B023
            for word in words:
                assert re.search(word, text), (kind, word, text)  # noqa: B023
            assert bool(words) == bool(text), (kind, text)  # noqa: B023

        with (folder / ".lock").open("a+b") as lock:
            if sys.platform == "win32":
                msvcrt.locking(lock.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            says(
                False, rf"is in use by another {kind}: process \d+, .*, for \d+ s; wait for its end"
            )
        says(True)
        changed = "re-running .*: the SHA-256 of the file differs from the one in manifest.sha256"
        for data in (whole[: len(whole) // 2], b"", whole + b" "):
            first.write_bytes(data)
            says(True, changed)
            assert first.read_bytes() == whole
        first.unlink()
        says(True, "re-running .*: the file of the run is missing")
        unlisted = "re-running .*: the run has no line in manifest.sha256: the manifest is damaged"
        unverified = (
            "manifest.sha256 is damaged or missing, so nothing verifies the stored runs; restore it"
        )
        for data, succeeds, words in (
            (good + row[:30], True, []),  # as a kill leaves it
            (good.replace(row, b""), True, [unlisted]),
            (b"", True, [unlisted]),
            (good + b"0" * 64 + row[64:], True, [changed]),
            (good.replace(row, row.replace(b"  ", b" ")), False, [unverified, r"line \d is "]),
            (good.replace(b"\n", b"\nxx\n", 1), False, [unverified, 'line 2 is "xx"']),
            (b"\xff" + good, False, [unverified, "byte 1 is not UTF-8"]),
            (None, False, [unverified, "it is missing"]),
        ):
            manifest.write_bytes(data) if data is not None else manifest.unlink()
            says(succeeds, *words)
            if succeeds:
                assert manifest.read_bytes() == good, kind
            manifest.write_bytes(good)
        says(True)
    for kind, other in (("campaign", "study"), ("study", "campaign")):
        before = sorted(tmp_path.joinpath(other).rglob("*"))
        succeeded, text = doors[kind](tmp_path / other)
        assert not succeeded and re.search(rf"{other} holds a {other}.*; (put|give)", text), text
        assert sorted(tmp_path.joinpath(other).rglob("*")) == before


def test_values_that_cannot_be_stored_are_refused_before_the_first_run(tmp_path: Path) -> None:
    """Some values have no string form; results that are strings must not count as numbers."""
    with pytest.raises(FmuError, match=r"law has .*of type function.* cannot store"):
        monte_carlo({"law": [not_called]}, 2, 1, not_called, folder=tmp_path)
    with pytest.raises(FmuError, match="outcome must return numbers by name"):
        monte_carlo({"a": (0, 1)}, 2, 1, lambda values: {"label": "007"})


RUNS, KILLS = 200, 20

DRIVER = "from test_study import killed; import sys; killed(sys.argv[1], int(sys.argv[2]))"


def slow(values: dict) -> dict[str, float]:
    """Simulate a run that lasts long enough for the process to be killed."""
    time.sleep(0.001)
    return outcome(values)


def killed(folder: str, seed: int) -> None:
    """Start a study of 200 runs, kill it 20 times at random moments, and edit a run halfway.

    Each start is a fork of a process that has already imported everything.
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
            with pytest.warns(FmuWarning) as warned, pytest.raises(AssertionError):
                study(folder, RUNS, outcome=not_called)
            (text,) = {str(warning.message) for warning in warned}
            assert f"re-running run {int(file.stem)}: tank.h is 0.1, but the seed" in text, text
            file.unlink()
    print(stored())


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="Windows has no fork")
def test_a_study_killed_20_times_and_edited_once_equals_an_uninterrupted_one(
    tmp_path: Path,
) -> None:
    """Every cell is bit-identical although the process is killed at random moments."""
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
