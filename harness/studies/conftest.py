"""Fixtures of the tests of the studies: packed FMUs and the program.

Run the tests by hand with:

    for model in HubSlosh Spacecraft SloshTank; do
        cargo run --release -- pack --model $model --out dist/$model.fmu
    done
    pytest -c harness/python/pyproject.toml harness/studies

``cargo test --release`` runs test_analysis.py and test_benchmark.py with the FMUs that it packs;
``.ci/long-tests --nightly`` runs all files.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
NUMBER = re.compile(r"-?\d+\.?\d*")


def pytest_addoption(parser: pytest.Parser) -> None:
    exe = "hubslosh.exe" if os.name == "nt" else "hubslosh"
    parser.addoption("--fmu", type=Path, default=ROOT / "dist" / "HubSlosh.fmu")
    parser.addoption("--hubslosh", type=Path, default=TARGET / "release" / exe)
    parser.addoption("--long", action="store_true", help="all tests, as .ci/long-tests --nightly")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "long: takes seconds; --long runs it")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--long"):
        items[:] = [item for item in items if item.get_closest_marker("long") is None]


@pytest.fixture(scope="session")
def fmu(request: pytest.FixtureRequest) -> Path:
    """Return the path of HubSlosh.fmu; Spacecraft.fmu and SloshTank.fmu are in the same folder."""
    path: Path = request.config.getoption("--fmu").absolute()
    return path


@pytest.fixture(scope="session", autouse=True)
def program(request: pytest.FixtureRequest) -> Path:
    """Return the path of the program ``hubslosh``, and make the package use it."""
    path: Path = request.config.getoption("--hubslosh").absolute()
    os.environ["HUBSLOSH"] = os.fspath(path)
    return path


def same_picture(drawing: str, committed: Path) -> None:
    """Check that a drawing equals a committed drawing: equal texts, and positions within 0.2 px."""
    texts = (drawing, committed.read_text(encoding="utf-8"))
    assert NUMBER.sub("0", texts[0]) == NUMBER.sub("0", texts[1])
    places = [np.array(NUMBER.findall(text), float) for text in texts]
    np.testing.assert_allclose(*places, atol=0.2)
