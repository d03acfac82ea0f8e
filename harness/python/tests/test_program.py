"""What the package has the program ``hubslosh`` do."""

from pathlib import Path

import pytest
from conftest import option

import hubslosh
from hubslosh import FmuError

PLAN = """
title = "Two pulses"
profile = "pulse:amplitude=0.05,start=1,width=1,duration=10"
[vary]
slosh.model = ["linear", "spherical"]
"""


def test_a_campaign_comes_back_as_a_table(fmu: Path, tmp_path: Path, request) -> None:
    """A row per run, and the report beside it."""
    binary = option(request, "--hubslosh")
    table = hubslosh.campaign(PLAN, tmp_path / "out", model=fmu, program=binary)
    assert len(table) == 2
    assert (table.attrs["directory"] / "report.html").is_file()


def test_what_the_program_refuses_is_told_in_its_words(fmu: Path, tmp_path: Path, request) -> None:
    """A plan that is none."""
    binary = option(request, "--hubslosh")
    with pytest.raises(FmuError, match=r"(?s)hubslosh campaign: .*sewer"):
        hubslosh.campaign("sewer=1\n", tmp_path, model=fmu, program=binary)


def test_a_missing_program_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """With how to get it."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CARGO_TARGET_DIR", "nowhere")
    monkeypatch.delenv("HUBSLOSH", raising=False)
    for call in (lambda: hubslosh.campaign("thesis"), lambda: hubslosh.identify("data.csv")):
        with pytest.raises(FmuError, match=r"not found.*cargo build --release"):
            call()
    with pytest.raises(FmuError, match="there is no program at elsewhere"):
        hubslosh.campaign("thesis", program="elsewhere")
