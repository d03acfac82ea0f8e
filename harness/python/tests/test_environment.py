"""The virtual environment in which scripts and tests run."""

import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import environment

REQUIREMENTS = sorted(Path(environment.__file__).parent.glob("requirements*.in"))


@pytest.mark.long
def test_simultaneous_requests_for_an_environment_get_a_complete_one(tmp_path: Path) -> None:
    """One process creates the environment, and the other processes wait until it is complete."""
    requirements = tmp_path / "requirements.txt"
    requirements.write_text("# nothing\n")
    command = [sys.executable, environment.__file__, tmp_path / "made", requirements]
    asking = []
    for _ in range(3):
        asking.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        time.sleep(0.3)  # by now the first process has started, but is far from its end
    said = [one.communicate()[0].strip() for one in asking]
    assert [one.returncode for one in asking] == [0, 0, 0]
    assert len(set(said)) == 1
    # two processes that create the environment at once would leave an incomplete one
    subprocess.run([said[0], "-m", "pip", "check"], check=True)


@pytest.mark.long
def test_a_package_without_a_hash_is_refused(tmp_path: Path) -> None:
    """The wheel exists and has no other fault, so only the missing hash can be the reason."""
    wheel = tmp_path / "thing-1-py3-none-any.whl"
    wheel.touch()
    requirements = tmp_path / "requirements.txt"
    requirements.write_text(f"thing @ {wheel.as_uri()}\n")
    command = [sys.executable, environment.__file__, tmp_path / "made", requirements]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "--require-hashes" in done.stderr, done.stderr


@pytest.mark.parametrize("asked", REQUIREMENTS, ids=lambda path: path.stem)
def test_the_requirements_file_pins_each_package_by_version_and_hash(asked: Path) -> None:
    """The .txt with versions and hashes agrees with the .in from which it was made."""
    locked = asked.with_suffix(".txt").read_text()
    pinned = re.findall(
        r"^([\w.-]+==[\w.]+)(?: ;[^\\]*)? \\\n    --hash=sha256:[0-9a-f]{64}", locked, re.M
    )
    lines = [line for line in locked.splitlines() if line and not line.startswith((" ", "#"))]
    assert len(pinned) == len(lines) > 0
    wanted = [line for line in asked.read_text().splitlines() if not line.startswith("#")]
    wanted = [re.sub(r"\[.*\]", "", line) for line in wanted]  # without names of extras
    assert set(wanted) <= set(pinned)
