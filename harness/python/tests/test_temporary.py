"""Temporary folders of killed processes are removed at the next start of Python or the program."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import option

from hubslosh import temporary

KILLED = """
import os, signal, sys
import hubslosh
from hubslosh import temporary

hubslosh.Plant(sys.argv[1]).close()
with temporary.folder():
    if sys.argv[2] == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
"""


def started(fmu: Path, how: str, folder: Path) -> int:
    """Unpack an FMU in a process that ends in the way ``how``; return the process's exit code."""
    environment = os.environ | {
        "PYTHONPATH": str(Path(__file__).parents[1]),
        "TMPDIR": str(folder),
    }
    command = [sys.executable, "-c", KILLED, fmu, how]
    return subprocess.run(command, env=environment, check=False).returncode


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_folders_of_a_killed_process_are_removed_at_the_next_start(
    fmu: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """Python and the program remove temporary folders of processes that no longer exist.

    Folders of running processes, and folders of other programs, are not removed.
    """
    kept = tmp_path / "hubslosh-of-somebody"
    kept.mkdir()
    pipe = tmp_path / "hubslosh-pipe"
    pipe.mkdir()
    os.mkfifo(pipe / "alive")
    with temporary.folder(tmp_path) as living:
        there = {kept.name, pipe.name, living.parent.name}
        for program in ("python", "hubslosh"):
            assert started(fmu, "kill", tmp_path) == -signal.SIGKILL
            assert len(list(tmp_path.iterdir())) == len(there) + 2
            if program == "python":
                assert started(fmu, "end", tmp_path) == 0
            else:
                command = [option(request, "--hubslosh"), "run", "--fmu", fmu, "--stop", "0.1"]
                command += ["--profile", "zero", "--out", tmp_path.parent / "run.csv"]
                environment = os.environ | {"TMPDIR": str(tmp_path)}
                subprocess.run(command, env=environment, check=True, capture_output=True)
            assert {path.name for path in tmp_path.iterdir()} == there
    assert not living.parent.exists()


def test_an_incomplete_table_is_removed_when_the_next_table_is_written(tmp_path: Path) -> None:
    """The table is first written to a temporary file in the same folder and then renamed."""
    import pandas as pd

    from hubslosh.files import to_csv

    dead = tmp_path / ".hubslosh-dead"
    (dead / "files").mkdir(parents=True)
    (dead / "files" / "a.csv").write_text("half")
    (dead / "alive").touch()
    to_csv(pd.DataFrame({"a": [1.0]}), tmp_path / "a.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


FORKED = """
import os, sys
import hubslosh

with hubslosh.Plant(sys.argv[1]):
    if (child := os.fork()) == 0:
        sys.exit()
    assert os.waitpid(child, 0)[1] == 0
    assert len(os.listdir(os.environ["TMPDIR"])) == 1
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no forks")
def test_the_end_of_a_forked_process_does_not_remove_the_folder_of_its_parent(
    fmu: Path, tmp_path: Path
) -> None:
    """The parent removes the folder when it ends."""
    environment = os.environ | {
        "PYTHONPATH": str(Path(__file__).parents[1]),
        "TMPDIR": str(tmp_path),
    }
    subprocess.run([sys.executable, "-c", FORKED, fmu], env=environment, check=True)
    assert list(tmp_path.iterdir()) == []
