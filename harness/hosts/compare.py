"""Compares the results of a host with a simulation of the same motion by fmpy.

    pip install -r harness/python/requirements.txt
    python harness/hosts/compare.py RESULTS.csv dist/HubSlosh.fmu init.slosh_angle=0.3

The table needs the columns time, omega and slosh_angle. The program prints the largest differences.
With Model Exchange and a tolerance of 1e-9, differences of about 1e-6 are normal.
"""

import argparse
import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
from hubslosh import TORQUE, FmuError, Plant

SIGNALS = ["omega", "slosh_angle"]

STEP = 0.02
"""Communication step of hosts that are driven by `sine`, s."""

Signals = Mapping[str, np.ndarray]
"""Histories by the names of the FMU's variables, SI units."""


def sine(duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times (s) and a held torque (N·m), a sine near the slosh frequency."""
    time = np.arange(round(duration / STEP) + 1) * STEP
    return time, 0.05 * np.sin(2 * math.pi * 2.4 * time)


def drive(
    fmu: Path | str,
    time: np.ndarray,
    torque: np.ndarray,
    settings: Mapping[str, object],
    columns: list[str],
    tolerance: float | None = None,
) -> Signals:
    """Simulate the FMU by fmpy under a held torque (N·m); return ``columns`` at the times (s).

    ``tolerance`` is the tolerance of the FMU's solver; by default the FMU chooses it.
    """
    start, stop = float(time[0]), float(time[-1])
    with Plant(
        fmu, settings, tolerance=tolerance, start=start, stop=stop, torque=float(torque[0])
    ) as plant:
        return plant.run(time, {TORQUE: torque}, None, columns)


def compare(here: Signals, there: Signals, allowed: float | None = None) -> None:
    """Print the largest difference between signals of a host (``there``) and fmpy (``here``).

    If a difference exceeds ``allowed`` times the largest value of its signal, exit with an error.
    """
    for name, values in here.items():
        largest, difference = np.abs(there[name]).max(), np.abs(values - there[name]).max()
        print(f"{name}: up to {largest:.4f}, differs from fmpy's by up to {difference:.1e}")
        if allowed is not None and not difference <= allowed * largest:
            sys.exit(f"error: {name} differs by {difference:.1e}")


def main() -> None:
    """Compare the table of a host with a simulation by fmpy."""
    parser = argparse.ArgumentParser(description="Compares a host's results with fmpy's.")
    parser.add_argument("results", type=Path, help="table of the host, .csv or .parquet")
    parser.add_argument("fmu", type=Path, help="the FMU that it ran")
    parser.add_argument("settings", nargs="*", metavar="NAME=VALUE")
    parser.add_argument("--prefix", default="", help="text before the FMU's names in the columns")
    parser.add_argument(
        "--driven", action="store_true",
        help=f"the table has {TORQUE}, held from row to row; else nothing drives the hub",
    )  # fmt: skip
    args = parser.parse_intermixed_args()
    names = [*SIGNALS, TORQUE] if args.driven else SIGNALS
    try:
        columns = ["time", *(args.prefix + name for name in names)]
        read = pd.read_parquet if args.results.suffix == ".parquet" else pd.read_csv
        table = {name: values.to_numpy() for name, values in read(args.results)[columns].items()}
        # Hosts write a row before and a row after an event; use the last row of each time.
        _, last = np.unique(table["time"][::-1].round(6), return_index=True)
        time = table["time"][::-1][last]
        found = {name: table[args.prefix + name][::-1][last] for name in names}
        torque = found.pop(TORQUE, np.zeros(len(time)))
        settings = dict(text.split("=", 1) for text in args.settings)
        there = drive(args.fmu, time, torque, settings, SIGNALS, tolerance=1e-12)
    except (FmuError, KeyError, OSError, ValueError) as error:
        sys.exit(f"error: {error}")
    compare(found, there)


if __name__ == "__main__":
    main()
