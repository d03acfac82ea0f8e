"""The page of measurements equals the page that the command writes."""

from pathlib import Path

import pytest

import measured
from conftest import ROOT, same_picture

pytestmark = pytest.mark.long


@pytest.fixture
def built(fmu: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = {name: fmu.with_name(f"{name}.fmu") for name in measured.FMUS}
    monkeypatch.setattr(measured, "FMUS", built)


@pytest.mark.usefixtures("built")
def test_the_page_of_measured_comparisons_equals_the_stored_results() -> None:
    """Page, README and verification state how many of the stored comparisons pass."""
    rows = measured.read_results()
    assert measured.PAGE.read_text(encoding="utf-8") == measured.page(rows)
    for page in ("README.md", "book/verification.md"):
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert measured.verdict(rows) in text


@pytest.mark.usefixtures("built")
@pytest.mark.parametrize("name", measured.QUICK)
def test_comparisons_with_measurements_reproduce_the_stored_values_and_pictures(name: str) -> None:
    """The stored values are reproduced to 1e-4, and the pictures to 0.2 px."""
    rows, drawing = measured.EXPERIMENTS[name]()
    kept = {(row.experiment, row.quantity): row for row in measured.read_results()}
    for row in rows:
        before = kept[row.experiment, row.quantity]
        assert row.passed == before.passed
        for value in ("measured", "error", "ours", "band"):
            assert getattr(row, value) == pytest.approx(getattr(before, value), rel=1e-4, abs=1e-9)
    if drawing:
        same_picture(drawing, measured.BOOK / f"measured_{name}.svg")


def test_every_measurement_has_its_source() -> None:
    """Each file of numbers states its source, its licence and its error."""
    files = [file for file in measured.DATA.glob("*.csv") if file != measured.RESULTS]
    assert len(files) >= 6
    for file in files:
        head = "".join(line for line in file.open(encoding="utf-8") if line.startswith("#"))
        assert "Source:" in head
        assert "Licence:" in head
        assert "Error:" in head
