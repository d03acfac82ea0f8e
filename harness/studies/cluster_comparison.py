"""Simulates the runs of a plan both by the harness and by Dask, and compares the results.

    export PYTHONPATH=harness/python
    python3 harness/studies/cluster_comparison.py --plan thesis_models --workers 2

The Dask workers host the FMU by the Python package. After the first run is finished, one worker is
killed in the middle of another run. The program compares all columns of features.csv,
features_spa.csv and runs.csv, and all signals of all runs. It ends with an error if a relative
difference exceeds 1e-9.

It needs what cluster.py needs. The 88 runs of thesis_models take some minutes on two cores.
"""

import csv
import math
import os
import shutil
import sys
import time
from pathlib import Path

import cluster  # import first, because it restarts this program in a virtual environment

# isort: split
import numpy as np
import psutil
import pyarrow.parquet
from distributed import Client

import hubslosh

MOST = 1e-9
"""Largest allowed relative difference."""


class Killer:
    """Kills one local worker in the middle of a run, after the first run is finished."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.process: int | None = None
        """Process of the killed worker."""
        self.interrupted = ""
        """Name of the run that the worker was simulating."""

    def made(self, run: cluster.Run) -> None:
        """Kill a busy worker after the first run; Dask's runs call this method when they end."""
        if self.process is not None:
            return
        for address, process in self.client.run(os.getpid).items():
            # stop the worker first, so that it cannot finish its run before it is killed
            worker = psutil.Process(process)
            worker.suspend()
            time.sleep(0.2)  # wait until messages that the worker has sent have arrived
            busy = self.client.processing().get(address, ())
            if busy:
                self.process, self.interrupted = process, busy[0].rpartition("-")[0]
                worker.kill()
                return
            worker.resume()


def difference(a: str, b: str) -> float:
    """Return the relative difference of two numbers; for texts, 0 if equal and infinity if not."""
    if a == b:
        return 0.0
    try:
        x, y = float(a), float(b)
    except ValueError:
        return math.inf
    return abs(x - y) / max(abs(x), abs(y))


def table_differences(one: Path, other: Path) -> dict[str, float]:
    """Return the largest difference in each column of two CSV files of the same shape."""
    tables = []
    for path in (one, other):
        with path.open(newline="") as file:
            tables.append(list(csv.reader(file)))
    if tables[0][0] != tables[1][0] or len(tables[0]) != len(tables[1]):
        sys.exit(f"error: {one} and {other} do not have the same columns and rows")
    rows = list(zip(*(table[1:] for table in tables), strict=True))
    return {
        name: max((difference(a[i], b[i]) for a, b in rows), default=0.0)
        for i, name in enumerate(tables[0][0])
    }


def signal_differences(one: Path, other: Path, columns: list[str]) -> dict[str, float]:
    """Return the largest difference in each column of two runs, relative to its largest value."""
    a, b = (pyarrow.parquet.read_table(path, columns=columns).to_pandas() for path in (one, other))
    largest = {name: np.abs(a[name]).max() for name in columns}
    return {
        name: float(np.abs(a[name] - b[name]).max() / (largest[name] or 1.0)) for name in columns
    }


def maker(path: Path) -> str:
    """Return the name of the program that simulated a stored run, from the run's metadata."""
    return (pyarrow.parquet.read_schema(path).metadata or {}).get(b"made_by", b"").decode()


def compare(
    client: Client, ours: cluster.Harness, theirs: cluster.Harness
) -> tuple[dict[str, float], Killer]:
    """Simulate the runs of the plan in both ways; return the largest difference of every column.

    ``ours`` has the directory for the harness, and ``theirs`` the directory for Dask, which is
    emptied first. Columns are named file:column; names of signals begin with runs:. A worker of
    Dask is killed during the runs.
    """
    shutil.rmtree(theirs.out, ignore_errors=True)
    killer = Killer(client)
    failed = cluster.make_runs(client, theirs, killer.made)
    for harness in (theirs, ours):
        if not harness.analyse() or failed:
            sys.exit(f"error: not all runs of {harness.plan} could be simulated")
    worst: dict[str, float] = {}

    def note(file: str, columns: dict[str, float]) -> None:
        for name, value in columns.items():
            worst[f"{file}:{name}"] = max(value, worst.get(f"{file}:{name}", 0.0))

    for file in ("features.csv", "features_spa.csv", "runs.csv"):
        note(file, table_differences(ours.out / file, theirs.out / file))
    todo = theirs.listing()
    for run in todo["runs"]:
        pair = (harness.out / run["file"] for harness in (ours, theirs))
        note("runs", signal_differences(*pair, todo["columns"]))
    return worst, killer


def main() -> None:
    parser = cluster.arguments("Compares the runs of a plan by the harness with runs by Dask.")
    parser.add_argument(
        "--out", type=Path, metavar="DIRECTORY",
        help="for both campaigns [default: dist/cluster_comparison/ and the plan's name]",
    )  # fmt: skip
    args = parser.parse_args()
    out = args.out or Path("dist") / "cluster_comparison" / Path(args.plan).stem
    ours, theirs = (
        cluster.Harness(args.hubslosh, args.fmu, args.plan, out / name)
        for name in ("harness", "dask")
    )
    try:
        theirs.listing()  # report errors in the plan before workers are started
        with cluster.cluster(args.workers, None) as client:
            worst, killer = compare(client, ours, theirs)
    except (cluster.CampaignError, hubslosh.FmuError) as error:
        sys.exit(f"error: {error}")
    again = maker(theirs.out / "runs" / f"{killer.interrupted}.parquet")
    print(f"process {killer.process} was killed while it simulated {killer.interrupted},")
    print(f"which was simulated again by {again}")
    column = max(worst, key=lambda name: worst[name])
    print(f"worst of {len(worst)} columns: {worst[column]:.1e} ({column})")
    sys.exit(0 if worst[column] <= MOST else f"error: more than {MOST:.0e}")


if __name__ == "__main__":
    main()
