"""Functions that all implementations share: reading parameters and inputs, writing results.csv."""

import csv
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(HERE))

import score  # noqa: E402

INTERVAL = {"bench_linear": 0.1, "bench_spherical": 0.1, "thrust": 0.1, "weightless": 0.5,
            "draining": 0.2, "spinner": 0.5}  # fmt: skip
"""Time between the rows of results.csv, s."""


def parameters(case: str) -> dict:
    """Return the parameters of a case, vectors as arrays."""

    def arrays(value):
        if isinstance(value, dict):
            return {name: arrays(x) for name, x in value.items()}
        if isinstance(value, list) and value and isinstance(value[0], dict):
            return [arrays(x) for x in value]
        return np.array(value) if isinstance(value, list) else value

    text = HERE.joinpath(case, "parameters.toml").read_text(encoding="utf-8")
    return arrays(tomllib.loads(text))


def inputs(case: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of the inputs; each row is held until the next row."""
    with HERE.joinpath(case, "input.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    values = np.array(rows[1:], float)
    return values[:, 0], values[:, 1:]


def segments(case: str) -> list[tuple[float, float, np.ndarray]]:
    """Return the pieces of time in which the inputs are constant: begin, end and inputs."""
    p = parameters(case)
    if case == "draining":
        return [(0.0, p["end"], np.hstack([p["force"], p["torque"]]))]
    time, values = inputs(case)
    return list(zip(time[:-1].tolist(), time[1:].tolist(), values[:-1], strict=True))


def row_times(case: str) -> np.ndarray:
    """Return the times of the rows of results.csv, s."""
    every = INTERVAL[case]
    end = parameters(case)["end"] if "end" in parameters(case) else inputs(case)[0][-1]
    return np.arange(round(end / every) + 1) * every


def inertia(p: dict) -> np.ndarray:
    """Return the inertia of the rigid part about its centre of mass."""
    return np.array([
        [p["J_xx"], p["J_xy"], p["J_xz"]],
        [p["J_xy"], p["J_yy"], p["J_yz"]],
        [p["J_xz"], p["J_yz"], p["J_zz"]],
    ])  # fmt: skip


def linearised_craft() -> dict:
    """Return the parameters of the case "linearisation" under the names of the six-axis cases."""
    p = parameters("linearisation")
    tank = {"hinge": np.array([0, 0, p["hinge"]]), "axis": np.array([0, 0, 1.0]), "m": p["m"],
            "l": p["l"], "c": p["c"], "k": 0.0, "p_0": np.array([0, 0, -1.0]),
            "p_dot_0": np.zeros(3)}  # fmt: skip
    return {"mass": p["mass"], "center": np.array([0, 0, p["z_c"]]), "J_xx": p["J"],
            "J_yy": p["J"], "J_zz": 500.0, "J_xy": 0, "J_xz": 0, "J_yz": 0,
            "omega_0": np.zeros(3), "tank": [tank]}  # fmt: skip


def frequencies() -> np.ndarray:
    """Return the frequencies at which the case "linearisation" is evaluated, rad/s."""
    return np.round(np.geomspace(0.05, 20.0, 131), 6)


def write(folder: Path, case: str, rows: np.ndarray, comment: str = "") -> None:
    columns = score.specification()[case]["columns"]
    path = folder / case / "results.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        if comment:
            file.write(f"# {comment}\n")
        file.write(",".join(score.header(*column) for column in columns.items()) + "\n")
        for row in rows:
            cells = [f"{row[0]:.9g}"]
            cells += ["" if np.isnan(x) else f"{x + 0.0:.16g}" for x in row[1:]]
            file.write(",".join(cells) + "\n")


def run(cases: Mapping[str, Callable[[], np.ndarray]]) -> None:
    """Run the cases that the command line names, FOLDER [CASE …], and write their results."""
    for name in sys.argv[2:] or cases:
        write(Path(sys.argv[1]), name, cases[name]())
        print(f"{name}: written", flush=True)


def inputs_of_backbones() -> list[tuple[float, float, float, float]]:
    """Return the rows of the case "backbones": depth over radius, angle (deg), s and kappa.

    s and kappa are the coefficients of third order of the slosh frequency.
    """
    return [tuple(row[1:]) for row in _numbers("backbones")]


def _numbers(case: str) -> list[list[float]]:
    """Return the rows of the case's input.csv as an array."""
    with HERE.joinpath(case, "input.csv").open(encoding="utf-8") as file:
        lines = [line for line in file if not line.startswith("#")]
    return [[float(x) for x in row] for row in csv.reader(lines[1:])]
