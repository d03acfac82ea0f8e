"""Compares a host's results with what fmpy gets from the FMU for the same motion.

    python harness/hosts/compare.py RESULTS.csv dist/HubSlosh.fmu init.slosh_angle=0.3

The table needs the columns time, omega and slosh_angle, with or without the host's path before
the name. A column tau_cmd is taken as held from each row to the next. Prints the largest
differences; 1e-6 is what to expect of Model Exchange at a tolerance of 1e-9.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "python"))
from hubslosh import TORQUE, FmuError, drive, read_table

SIGNALS = ["omega", "slosh_angle"]

Signals = Mapping[str, np.ndarray]
"""Histories by the names of the FMU's variables, SI units."""


def compare(here: Signals, there: Signals, allowed: float = np.inf) -> None:
    """Print the largest difference of each of a host's signals from fmpy's.

    allowed: leave with 1 beyond this part of the signal's largest value.
    """
    for name, values in here.items():
        largest, difference = np.abs(there[name]).max(), np.abs(values - there[name]).max()
        print(f"{name}: up to {largest:.4f}, differs from fmpy's by up to {difference:.1e}")
        if not difference <= allowed * largest:
            sys.exit(f"error: {name} differs by {difference:.1e}")


def main() -> None:
    """Compare a table."""
    if len(sys.argv) < 3:
        sys.exit("usage: python compare.py RESULTS FMU [PARAMETER=VALUE]…")
    with Path(sys.argv[1]).open() as file:
        header = [name.strip(' "\n') for name in file.readline().split(",")]
    found = {name.split(".")[-1]: name for name in reversed(header)}
    wanted = ["time", *SIGNALS, *([TORQUE] if TORQUE in found else [])]
    columns = {name: found.get(name, name) for name in wanted}
    results = read_table(Path(sys.argv[1]), list(columns.values()))
    # Hosts write a row before and one after an event: the last of a time counts.
    _, last = np.unique(results[columns["time"]][::-1].round(6), return_index=True)
    results = {name: results[column][::-1][last] for name, column in columns.items()}
    time = results["time"]
    torque = results.get(TORQUE, np.zeros(len(time)))
    here = {name: results[name] for name in SIGNALS}
    settings = dict(text.split("=", 1) for text in sys.argv[3:])
    there = drive(
        Path(sys.argv[2]), time, torque, settings, hold=True, tolerance=1e-12,
        columns=SIGNALS,
    )  # fmt: skip
    compare(here, there)


if __name__ == "__main__":
    try:
        main()
    except (OSError, FmuError) as error:
        sys.exit(f"error: {error}")
