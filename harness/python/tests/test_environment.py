"""The virtual environment that the scripts and the tests run in."""

import subprocess
import sys
import time
from pathlib import Path

import environment


def test_those_who_want_one_environment_at_once_get_one_that_works(tmp_path: Path) -> None:
    """One process makes it, the others wait."""
    requirements = tmp_path / "requirements.txt"
    requirements.write_text("# nothing\n")
    command = [sys.executable, environment.__file__, tmp_path / "made", requirements]
    asking = []
    for _ in range(3):
        asking.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        time.sleep(0.3)  # the first is at it by now, and far from its end
    said = [one.communicate()[0].strip() for one in asking]
    assert [one.returncode for one in asking] == [0, 0, 0]
    assert len(set(said)) == 1
    # a maker who came in between would have left a half-made one
    subprocess.run([said[0], "-m", "pip", "check"], check=True)
