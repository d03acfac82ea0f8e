"""Fixtures of the tests of the examples: packed FMUs.

Run the tests by hand with:

    cargo run --release -- pack
    cargo run --release -p one-loop -- dist/HubSlosh.fmu dist
    pytest -c harness/python/pyproject.toml examples

``cargo test --release`` runs the tests with the FMUs that it packs.
"""

from pathlib import Path

import pytest


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("filterwarnings", "error::hubslosh.FmuWarning")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--fmu", default="HubSlosh", help="FMU file, or name of an FMU of the package")
    parser.addoption("--folder", type=Path, default=Path("dist"))


@pytest.fixture(scope="session")
def fmu(request: pytest.FixtureRequest) -> str:
    name: str = request.config.getoption("--fmu")
    return str(Path(name).absolute()) if name.endswith(".fmu") else name


@pytest.fixture(scope="session")
def spacecraft(fmu: str) -> str:
    """Return the path of Spacecraft.fmu; SloshTank.fmu is in the same folder."""
    return str(Path(fmu).with_name("Spacecraft.fmu")) if fmu.endswith(".fmu") else "Spacecraft"
