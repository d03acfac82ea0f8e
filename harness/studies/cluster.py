"""Simulates the runs of a campaign's plan on a Dask cluster, with the Python package as host.

    PYTHONPATH=harness/python python3 harness/studies/cluster.py --plan thesis_models --workers 4
    PYTHONPATH=harness/python python3 harness/studies/cluster.py --plan mine.toml --scheduler tcp://head:8786

It needs dist/HubSlosh.fmu and the program hubslosh (``cargo run --release -- pack`` builds both)
and Python 3.11 or newer. The first start creates a virtual environment in the target directory and
needs the network. Without ``--scheduler`` the workers are processes on this machine.

``hubslosh campaign --list`` lists the runs, and ``hubslosh torque`` computes their torques. A
worker receives the FMU once, and torque and settings for each run. It sends the signals back, so
that no shared disk is needed. This program writes them to runs/<name>.parquet; a file is never
incomplete. Finally ``hubslosh campaign`` reads the runs and writes the same tables and report as if
it had simulated the runs itself.

After an interruption start the same command again: stored runs are reused. If a worker dies,
another worker repeats its run. Workers of a real cluster need ``--nthreads 1``, the same operating
system and processor type as this machine, and the packages of requirements-cluster.txt.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import environment

try:
    import cloudpickle
    import dask
    import numpy as np
    import pyarrow
    import pyarrow.parquet
    from distributed import Client, KilledWorker, LocalCluster, Worker, as_completed, get_worker
    from distributed.client import FutureCancelledError
    from distributed.diagnostics.plugin import UploadFile, WorkerPlugin
    from tqdm import tqdm

    import hubslosh
    import hubslosh.native
    from hubslosh.native import Store
except ModuleNotFoundError as missing:
    environment.run_again_in("cluster", missing)

# Send functions of this module by value, because workers have only the files that `prepare` sends.
cloudpickle.register_pickle_by_value(sys.modules[__name__])

Run = dict[str, Any]
"""One run of ``hubslosh campaign --list``; its keys are in campaigns.md."""

TORQUE_COLUMNS = ("time", hubslosh.TORQUE, "tau_slope")


class CampaignError(Exception):
    """Raised if the runs of a campaign cannot start or cannot continue."""


class Harness:
    """The program ``hubslosh`` with an FMU, a plan, and a directory for the results."""

    def __init__(self, program: Path, fmu: Path, plan: str, out: Path) -> None:
        self.program, self.fmu, self.plan, self.out = program, fmu, plan, out

    def listing(self) -> dict[str, Any]:
        """Return the list of the plan's runs, from ``hubslosh campaign --list``."""
        return json.loads(self._say(*self._campaign(), "--list"))

    def torque(self, run: Run) -> list[np.ndarray]:
        """Return a run's torque: time (s), ``tau_cmd`` (N·m), its slope to the next row (N·m/s)."""
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "torque.parquet"
            times = ("step", "sample", "stop")
            numbers = [text for name in times for text in (f"--{name}", repr(run[name]))]
            hold = ["--hold"] if run["hold"] else []
            self._say("torque", "--profile", run["profile"], *numbers, *hold, "--out", str(path))
            table = pyarrow.parquet.read_table(path)
            return [table[name].to_numpy() for name in TORQUE_COLUMNS]

    def analyse(self) -> bool:
        """Write tables and report from the stored runs by ``hubslosh campaign``.

        Return True if the stored runs are all runs of the plan. The output of the program goes to
        the terminal. The program also simulates runs that are not stored.
        """
        return subprocess.run([self.program, *self._campaign()]).returncode == 0

    def _campaign(self) -> list[str]:
        return ["campaign", "--plan", self.plan, "--fmu", str(self.fmu), "--out", str(self.out)]

    def _say(self, *arguments: str) -> str:
        try:
            done = subprocess.run([self.program, *arguments], capture_output=True, text=True)
        except OSError as error:
            raise CampaignError(
                f"{self.program} cannot be started ({error}); build it by cargo run --release -- "
                "pack, or give its path with --hubslosh"
            ) from None
        if done.returncode != 0:
            raise CampaignError(done.stderr.strip().removeprefix("error: "))
        return done.stdout


def why_not_stored(path: Path, run: Run, columns: list[str]) -> str | None:
    """Return the reason why a file is not a complete record of a run, or None if it is one.

    ``columns`` are the signals that it must have. The command ``hubslosh campaign`` applies the
    same rules to stored runs.
    """
    try:
        file = pyarrow.parquet.ParquetFile(path)
        notes = file.schema_arrow.metadata or {}
        for key, wanted in run["notes"].items():
            found = notes.get(key.encode(), b"").decode(errors="replace")
            if found != wanted:
                return f"the {key} of the file differs"
        table = file.read(columns)
    except (OSError, pyarrow.ArrowException) as error:
        return f"the file is incomplete: {error}"
    if missing := set(columns) - set(table.column_names):
        return f"the file is incomplete: it has no column {', '.join(sorted(missing))}"
    times = table["time"].to_numpy()
    if len(times) != run["steps"] + 1 or times[-1] != run["stop"]:
        return f"the file has {len(times)} rows, but the run needs {run['steps'] + 1}"
    return None


def drive_here(
    fmu: str, run: Run, torque: list[np.ndarray], columns: list[str]
) -> tuple[dict[str, np.ndarray] | None, str]:
    """Simulate one run on a worker of the cluster.

    Return its columns and the worker's name, or None and the reason of the failure.
    """
    import os
    from pathlib import Path

    import pandas as pd

    import hubslosh

    inputs = pd.DataFrame(dict(zip(TORQUE_COLUMNS, torque, strict=True)))
    try:
        made = hubslosh.simulate(
            Path(get_worker().local_directory) / fmu,
            run["settings"],
            inputs.drop(columns="tau_slope") if run["hold"] else inputs,
            outputs=[name for name in columns if name not in ("time", hubslosh.TORQUE)],
            tolerance=run["tolerance"],
            hold=run["hold"],
        )
    except hubslosh.FmuError as error:
        return None, str(error)
    # the torque also has rows at its edges, which the result does not have
    steps = (torque[0] - torque[0][0]) / run["step"]
    wanted = np.abs(steps - np.round(steps)) <= 1e-6
    wanted[-1] = True
    table = {name: made[name].to_numpy(float)[wanted] for name in columns}
    return table, f"hubslosh {hubslosh.__version__}, Dask, process {os.getpid()}"


class Package(WorkerPlugin):
    """Installs the package hubslosh on workers, without FMUs.

    It is sent as a folder, because compiled code cannot be loaded from a ZIP file.
    """

    def __init__(self) -> None:
        """Read the files of the package; the compiled part gets the name that Python expects."""
        source = Path(hubslosh.__file__).parent
        native = Path(str(sys.modules["hubslosh._native"].__file__))
        self.files = {file.name: file.read_bytes() for file in source.iterdir() if file.is_file()}
        ending = ".pyd" if os.name == "nt" else ".abi3.so"
        self.files[f"_native{ending}"] = native.read_bytes()

    def setup(self, worker: Worker) -> None:
        """Write the package to a worker's folder, and import it there."""
        folder = Path(worker.local_directory) / "package"
        (folder / "hubslosh").mkdir(parents=True, exist_ok=True)
        for name, content in self.files.items():
            (folder / "hubslosh" / name).write_bytes(content)
        sys.path.insert(0, str(folder))
        import hubslosh.simulation  # noqa: F401 - fails here if the worker lacks a package


def prepare(client: Client, fmu: Path, sha256: str) -> str:
    """Give every worker, also those that start later, the FMU and the package hubslosh.

    Return the path of the FMU on the workers. Raise CampaignError if workers cannot host the FMU.
    """
    threads = client.nthreads()
    if not threads:
        raise CampaignError("the cluster has no workers")
    many = [address for address, count in threads.items() if count != 1]
    if many:
        raise CampaignError(
            f"start the workers with --nthreads 1, one per core: {', '.join(many)} have several "
            "threads, of which Python runs only one at a time"
        )
    data = fmu.read_bytes()
    if hashlib.sha256(data).hexdigest() != sha256:
        raise CampaignError(f"{fmu} changed while it was read; start the command again")
    with tempfile.TemporaryDirectory() as directory:
        copy = Path(directory) / f"{sha256}.fmu"
        copy.write_bytes(data)
        try:
            client.register_plugin(UploadFile(str(copy), load=False), name=copy.name)
            client.register_plugin(Package(), name="hubslosh")
        except ImportError as error:
            raise CampaignError(
                f"the workers lack a package ({error}); install the packages of "
                "requirements-cluster.txt"
            ) from None
    return copy.name


def make_runs(
    client: Client, harness: Harness, made: Callable[[Run], None] = lambda run: None
) -> dict[str, str]:
    """Simulate all runs of the plan that are not stored yet.

    Return the reason of each failure by the name of the run. A run is written as soon as its worker
    returns it, and then `made` is called with the run.
    """
    store = Store.campaign(harness.out, "cluster.py")
    try:
        return make_runs_in(store, client, harness, made)
    finally:
        store.close()


def make_runs_in(
    store: Store, client: Client, harness: Harness, made: Callable[[Run], None]
) -> dict[str, str]:
    """Do the work of `make_runs` in a directory that this process has locked already."""
    todo = harness.listing()
    columns = todo["columns"]
    missing = []
    for run in todo["runs"]:
        path = harness.out / run["file"]
        why = why_not_stored(path, run, todo["kept"]) if path.exists() else ""
        if why is None:
            why = store.damage(run["name"])
        if why:
            print(f"re-running {run['name']}: {why}")
        if why is not None:
            missing.append(run)
    fmu = prepare(client, harness.fmu, todo["fmu"]["sha256"])
    there = len(todo["runs"]) - len(missing)
    print(f"{len(missing)} runs to simulate, {there} reused; {len(client.nthreads())} workers")

    failed: dict[str, str] = {}
    runs = {}  # runs in progress, by key

    def futures() -> Iterator[Any]:
        torque, torque_of = [], None
        for run in missing:
            of = (run["profile"], run["step"], run["sample"], run["stop"], run["hold"])
            if of != torque_of:
                torque, torque_of = harness.torque(run), of
            # a new key, because the scheduler would reuse the result of a known key
            key = f"{run['name']}-{os.urandom(8).hex()}"
            runs[key] = run
            yield client.submit(drive_here, fmu, run, torque, columns, key=key)

    coming = futures()
    under_way = as_completed()

    def fill() -> None:
        # Give each worker one run at a time, so that a run that kills its worker affects no other
        # run, and torques and signals do not accumulate on the scheduler.
        while len(runs) < max(1, len(client.nthreads())):
            future = next(coming, None)
            if future is None:
                return
            under_way.add(future)

    with tqdm(
        total=sum(run["steps"] for run in missing), unit=" steps", unit_scale=True, smoothing=0.05,
        bar_format="{percentage:3.0f} % {bar:40} {elapsed} gone, {remaining} to go", disable=None,
    ) as bar:  # fmt: skip
        fill()
        for future in under_way:
            run = runs.pop(future.key)
            fill()
            try:
                table, said = future.result()
            except FutureCancelledError:
                raise CampaignError(
                    "the scheduler has ended; start the same command again to continue"
                ) from None
            except Exception as error:  # any error on the worker concerns only this run
                table, said = None, reason(error)
            if table is None:
                failed[run["name"]] = said
            else:
                notes = run["notes"] | {"made_by": said}
                whole = {name: table[name] for name in columns}
                with tempfile.TemporaryDirectory() as directory:
                    draft = Path(directory) / "run.parquet"
                    whole = pyarrow.table(whole).replace_schema_metadata(notes)
                    pyarrow.parquet.write_table(whole, draft, compression="zstd")
                    store.add(run["name"], draft.read_bytes())
                made(run)
            bar.update(run["steps"])
    return failed


def reason(error: BaseException) -> str:
    """Return the reason of a run's failure as text, for an error that is no message of the FMU."""
    if isinstance(error, KilledWorker):
        return f"{error.allowed_failures + 1} workers died while they simulated it"
    return f"{type(error).__name__}: {error}"


@contextmanager
def cluster(workers: int, scheduler: str | None) -> Iterator[Client]:
    """Yield a client of the cluster at the address ``scheduler``, or of local processes."""
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout="10s")
        except (OSError, ValueError) as error:
            raise CampaignError(f"no scheduler answers at {scheduler}: {error}") from None
        with client:
            yield client
        return
    with (
        tempfile.TemporaryDirectory() as directory,
        dask.config.set({"temporary-directory": directory}),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address="localhost:0"
        ) as local,
        Client(local) as client,
    ):
        yield client


def arguments(description: str) -> argparse.ArgumentParser:
    """Return a parser of the flags for program, FMU, plan and workers."""
    program = environment.target() / "release" / ("hubslosh.exe" if os.name == "nt" else "hubslosh")
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(
        "--plan", required=True, metavar="FILE", help="a plan file, or the name of a built-in plan"
    )
    parser.add_argument("--fmu", type=Path, default=Path("dist/HubSlosh.fmu"), metavar="FILE")
    parser.add_argument(
        "--hubslosh", type=Path, default=program, metavar="FILE", help="the harness's program"
    )
    parser.add_argument(
        "--workers", type=positive, default=os.cpu_count(), metavar="N",
        help="processes on this machine [default: one per core]",
    )  # fmt: skip
    return parser


def positive(text: str) -> int:
    """Return the positive integer in ``text``, a number of workers."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number of workers, 1 or more')
    return int(text)


def main() -> None:
    parser = arguments("Simulates the runs of a plan on a Dask cluster.")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="of a running Dask cluster, tcp://HOST:PORT [default: workers on this machine]",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIRECTORY",
        help="for runs, tables and report [default: dist/ and the plan's name]",
    )  # fmt: skip
    args = parser.parse_args()
    out = args.out or Path("dist") / Path(args.plan).stem
    harness = Harness(args.hubslosh, args.fmu, args.plan, out)
    try:
        harness.listing()  # report errors in the plan before workers are started
        with cluster(args.workers, args.scheduler) as client:
            failed = make_runs(client, harness)
    except (CampaignError, hubslosh.FmuError) as error:
        sys.exit(f"error: {error}")
    for name, why in failed.items():
        print(f"{name} failed on the cluster: {why}", file=sys.stderr)
    sys.exit(0 if harness.analyse() else 1)


if __name__ == "__main__":
    main()
