r"""Fixtures of all tests, such as the packed FMU.

Run the tests by hand with:

    cargo run --release -- pack
    cargo run --release -- pack --python
    pytest harness/python --fmu dist/HubSlosh.fmu --hubslosh target/release/hubslosh \
        --wheel dist/hubslosh-0.7.0-cp311-abi3-….whl

``cargo test --release`` runs the last command with an FMU and a wheel that it packs itself.
"""

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hubslosh import TORQUE, Plant, simulate

# Columns of a recording of HubSlosh, besides time and torque.
COLUMNS = ("omega", "omega_imu", "slosh_angle", "slosh_angle_radial")

ROOT = Path(__file__).resolve().parents[3]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")

Harness = Callable[..., dict[str, np.ndarray]]


def pytest_addoption(parser: pytest.Parser) -> None:
    exe = "hubslosh.exe" if os.name == "nt" else "hubslosh"
    parser.addoption("--fmu", type=Path, default=ROOT / "dist" / "HubSlosh.fmu")
    wheels = sorted((ROOT / "dist").glob("hubslosh-*.whl"))
    parser.addoption("--wheel", type=Path, default=wheels[-1] if wheels else ROOT / "dist" / "none")
    parser.addoption("--hubslosh", type=Path, default=TARGET / "release" / exe)
    parser.addoption("--octave", action="store_true", help="also the tests that need Octave")
    parser.addoption("--long", action="store_true", help="only the tests that .ci/long-tests runs")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "octave: needs Octave; --octave (.ci/octave) runs it")
    config.addinivalue_line("markers", "long: takes seconds; --long (.ci/long-tests) runs it")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests that need Octave without --octave, and either the long or the short tests."""
    if not config.getoption("--octave"):
        items[:] = [item for item in items if item.get_closest_marker("octave") is None]
    long = config.getoption("--long")
    items[:] = [item for item in items if (item.get_closest_marker("long") is not None) == long]


def option(request: pytest.FixtureRequest, name: str) -> Path:
    """Return the path of the file that an option of pytest names."""
    path: Path = request.config.getoption(name).absolute()
    if not path.is_file():
        pytest.exit(f"{name}: there is no file {path}; cargo run --release -- pack", returncode=4)
    return path


@pytest.fixture(scope="session")
def fmu(request: pytest.FixtureRequest) -> Path:
    return option(request, "--fmu")


@pytest.fixture(scope="session")
def wheel(request: pytest.FixtureRequest) -> Path:
    return option(request, "--wheel")


def run_with_wheel(arguments: list[str | Path], wheel: Path, folder: Path, request) -> str:
    """Run Python in a folder with the wheel, matplotlib and the program, and return its output."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "wheel")
    surroundings = os.environ | {
        "PYTHONPATH": str(folder / "wheel"),
        "HUBSLOSH": str(option(request, "--hubslosh")),
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": str(folder),
    }
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder, env=surroundings, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def harness(request: pytest.FixtureRequest, fmu: Path, tmp_path_factory) -> Harness:
    """Return a function that simulates with ``hubslosh run`` and reads the written table."""
    binary = option(request, "--hubslosh")

    def run(*arguments: str, columns: tuple[str, ...] = COLUMNS) -> dict[str, np.ndarray]:
        out = tmp_path_factory.mktemp("harness") / "run.parquet"
        command = [binary, "run", *arguments, "--columns", ",".join(columns)]
        done = subprocess.run(
            [*command, "--fmu", fmu, "--out", out], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        table = pd.read_parquet(out)
        return {name: table[name].to_numpy(float) for name in ("time", TORQUE, *columns)}

    return run


def drive(
    fmu: Path, time: Sequence, torque: Sequence, settings: dict | None = None, *,
    slope: Sequence | None = None, columns: Sequence[str] = COLUMNS, **options,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Simulate HubSlosh under a torque history, and return the columns as arrays by name.

    ``time`` (s) and ``torque`` (N·m) are interpolated linearly, or with ``slope`` (N·m/s).
    """
    inputs = pd.DataFrame({"time": np.asarray(time), TORQUE: np.asarray(torque)})
    if slope is not None:
        inputs["tau_slope"] = np.asarray(slope)
    run = simulate(fmu, settings, inputs, outputs=list(columns), **options)
    return {name: run[name].to_numpy(float) for name in ("time", TORQUE, *columns)}


def single_calls(
    fmu: Path, parameters: dict, inputs: pd.DataFrame, columns: list[str], hold: bool
) -> pd.DataFrame:
    """Return what `simulate` returns, computed by one call for each input, step and output.

    ``hold`` says whether inputs are held from row to row.
    """
    time, names = inputs["time"].to_numpy(), list(inputs)[1:]
    start = {name: inputs[name][0] for name in names}
    rows = []
    with Plant(fmu, parameters, stop=time[-1], inputs=start) as plant:
        for k, now in enumerate(time):
            rows.append(plant.get(columns))
            if k == len(time) - 1:
                break
            for name in names:
                plant.set(name, inputs[name][k])
            for name in [] if hold else names:
                rise = inputs[name][k + 1] - inputs[name][k]
                plant.set_slope(name, rise / (time[k + 1] - now))
            plant.step(time[k + 1])
    return inputs.join(pd.DataFrame(rows, columns=columns))
