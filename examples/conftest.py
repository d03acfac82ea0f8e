"""Fixtures of the examples' tests: the packed FMU.

    cargo run --release -- pack
    cargo run --release -p one-loop -- dist/HubSlosh.fmu dist
    pytest -c harness/python/pyproject.toml examples

``cargo test --release`` runs them with the FMU that it packs.
"""

from pathlib import Path

import pytest


def pytest_configure(config: pytest.Config) -> None:
    """Make a warning that an example leaves the range of its model an error."""
    config.addinivalue_line("filterwarnings", "error::hubslosh.FmuWarning")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for the paths of the FMU and of the harness's files of example 7."""
    parser.addoption("--fmu", default="HubSlosh", help="file, or the name of a packed one")
    parser.addoption("--folder", type=Path, default=Path("dist"))


@pytest.fixture(scope="session")
def fmu(request: pytest.FixtureRequest) -> str:
    """Return the path of HubSlosh.fmu."""
    name: str = request.config.getoption("--fmu")
    return str(Path(name).absolute()) if name.endswith(".fmu") else name


@pytest.fixture(scope="session")
def spacecraft(fmu: str) -> str:
    """Return Spacecraft.fmu; SloshTank.fmu is in the same folder."""
    return str(Path(fmu).with_name("Spacecraft.fmu")) if fmu.endswith(".fmu") else "Spacecraft"
