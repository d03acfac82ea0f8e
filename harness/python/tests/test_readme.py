"""The Python in the READMEs runs as it stands there."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

HERE = ROOT / "harness" / "python"


@pytest.mark.parametrize("readme", [ROOT / "README.md", HERE / "README.md"])
def test_the_code_in_a_readme_runs(fmu: Path, tmp_path: Path, readme: Path) -> None:
    """In a directory with dist/HubSlosh.fmu, as at the project's root."""
    (tmp_path / "dist").mkdir()
    shutil.copy(fmu, tmp_path / "dist" / "HubSlosh.fmu")
    blocks = re.findall(r"^```python\n(.*?)^```", readme.read_text(), re.DOTALL | re.MULTILINE)
    assert blocks, f"{readme} has no Python"
    for code in blocks:
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True,
            env=os.environ | {"PYTHONPATH": str(HERE)}, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{code}\n{done.stderr}"
