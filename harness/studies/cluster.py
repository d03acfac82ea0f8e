"""Makes the runs of a campaign's plan on a Dask cluster, with the package hubslosh as host.

    PYTHONPATH=harness/python python3 harness/studies/cluster.py --plan monte_carlo --workers 4
    PYTHONPATH=harness/python python3 harness/studies/cluster.py --plan mine.toml --scheduler tcp://head:8786

needs dist/HubSlosh.fmu and the program hubslosh (``cargo run --release -- pack`` makes both) and
Python 3.11 or newer; the first start makes a virtual environment in the target directory and
needs the network. Without ``--scheduler`` the workers are processes of this machine.

``hubslosh campaign --list`` says what is to be run, ``hubslosh torque`` with which torque. A worker
gets the FMU once, and torque and settings with every run; it sends the signals back: no disk is
shared. This side writes runs/<name>.parquet, each whole or not at all. In the end ``hubslosh
campaign`` reads the runs and writes tables and report: the same as if it had made them.

Start the same command again after an interruption: runs that are stored are reused. A run
whose worker dies is given to another worker. Workers of a real cluster need ``--nthreads 1``, the
system and processor of this machine, and the packages of requirements-cluster.txt.
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

# workers have no file of ours but those that `prepare` sends: what they call travels with the call
cloudpickle.register_pickle_by_value(sys.modules[__name__])

Run = dict[str, Any]
"""One run of ``hubslosh campaign --list``; its keys are in campaigns.md."""

TORQUE_COLUMNS = ("time", hubslosh.TORQUE, "tau_slope")


class CampaignError(Exception):
    """Reason why the runs cannot start, or cannot go on."""


class Harness:
    """The program ``hubslosh`` with an FMU, a plan, and a directory for the results."""

    def __init__(self, program: Path, fmu: Path, plan: str, out: Path) -> None:
        """Store the paths; `listing` checks whether they exist."""
        self.program, self.fmu, self.plan, self.out = program, fmu, plan, out

    def listing(self) -> dict[str, Any]:
        """Return the list of the plan's runs that are to be simulated."""
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
        """Write tables and report from the stored runs.

        Return True if all runs are in them. The program's output goes to the terminal. It also
        simulates runs that are not stored, as always.
        """
        return subprocess.run([self.program, *self._campaign()]).returncode == 0

    def _campaign(self) -> list[str]:
        return ["campaign", "--plan", self.plan, "--fmu", str(self.fmu), "--out", str(self.out)]

    def _say(self, *arguments: str) -> str:
        try:
            done = subprocess.run([self.program, *arguments], capture_output=True, text=True)
        except OSError as error:
            raise CampaignError(
                f"{self.program} cannot be started ({error}); cargo run --release -- pack "
                "makes it, or say where it is with --hubslosh"
            ) from None
        if done.returncode != 0:
            raise CampaignError(done.stderr.strip().removeprefix("error: "))
        return done.stdout


def why_not_stored(path: Path, run: Run, columns: list[str]) -> str | None:
    """Return the reason why a file is not this run, complete; None if it is.

    The harness judges the stored runs by the same rules when it reads them.
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
    """Simulate one run on a worker.

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
    """The package hubslosh without FMUs, as a folder: compiled code cannot be loaded from a zip."""

    def __init__(self) -> None:
        """Read the package's files; the compiled half gets the name that Python looks for."""
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
        import hubslosh.simulation  # noqa: F401 - it may lack a package


def prepare(client: Client, fmu: Path, sha256: str) -> str:
    """Give every worker, also those that start later, the FMU and the package hubslosh.

    Return the FMU's file name there. Workers that cannot host the FMU are refused.
    """
    threads = client.nthreads()
    if not threads:
        raise CampaignError("the cluster has no workers")
    many = [address for address, count in threads.items() if count != 1]
    if many:
        raise CampaignError(
            f"start the workers with --nthreads 1, one per core: {', '.join(many)} "
            "would make several runs in turns, as Python runs one thread at a time"
        )
    data = fmu.read_bytes()
    if hashlib.sha256(data).hexdigest() != sha256:
        raise CampaignError(f"{fmu} has changed while it was read; start the command again")
    with tempfile.TemporaryDirectory() as directory:
        copy = Path(directory) / f"{sha256}.fmu"
        copy.write_bytes(data)
        try:
            client.register_plugin(UploadFile(str(copy), load=False), name=copy.name)
            client.register_plugin(Package(), name="hubslosh")
        except ImportError as error:
            raise CampaignError(
                f"the workers lack a package ({error}); requirements-cluster.txt says which "
                "they need"
            ) from None
    return copy.name


def make_runs(
    client: Client, harness: Harness, made: Callable[[Run], None] = lambda run: None
) -> dict[str, str]:
    """Simulate all runs of the plan that are not stored yet.

    Return by name why runs have failed. A run is written as soon as its worker returns it, and then
    `made` is called with it.
    """
    store = Store.campaign(harness.out, "cluster.py")
    try:
        return make_runs_in(store, client, harness, made)
    finally:
        store.close()


def make_runs_in(
    store: Store, client: Client, harness: Harness, made: Callable[[Run], None]
) -> dict[str, str]:
    """`make_runs` in a locked directory."""
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
    runs = {}  # by key, those that are under way

    def futures() -> Iterator[Any]:
        torque, torque_of = [], None
        for run in missing:
            of = (run["profile"], run["step"], run["sample"], run["stop"], run["hold"])
            if of != torque_of:
                torque, torque_of = harness.torque(run), of
            key = f"{run['name']}-{os.urandom(8).hex()}"  # the scheduler must not know it already
            runs[key] = run
            yield client.submit(drive_here, fmu, run, torque, columns, key=key)

    coming = futures()
    under_way = as_completed()

    def fill() -> None:
        # One run per worker at a time: a run that kills its worker takes no other with it, and
        # torques and signals do not pile up on the scheduler.
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
                    "the scheduler is gone; start the same command again to go on from here"
                ) from None
            except Exception as error:  # whatever went wrong on the worker, with this run alone
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
    """Return the reason of a run's failure other than a message of the FMU, in words for users."""
    if isinstance(error, KilledWorker):
        return f"{error.allowed_failures + 1} workers died while they made it"
    return f"{type(error).__name__}: {error}"


@contextmanager
def cluster(workers: int, scheduler: str | None) -> Iterator[Client]:
    """Yield a client of the cluster at that address, or of one of this machine's processes."""
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
    """Return the flags that say which program, FMU, plan and workers."""
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
    """Return a number of workers."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f'"{text}" is not a number of workers, 1 or more')
    return int(text)


def main() -> None:
    """Make the runs, then have the harness analyse them."""
    parser = arguments("Makes a plan's runs on a Dask cluster.")
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
        harness.listing()  # what is wrong with the plan is said before any worker starts
        with cluster(args.workers, args.scheduler) as client:
            failed = make_runs(client, harness)
    except (CampaignError, hubslosh.FmuError) as error:
        sys.exit(f"error: {error}")
    for name, why in failed.items():
        print(f"{name} failed on the cluster: {why}", file=sys.stderr)
    sys.exit(0 if harness.analyse() else 1)


if __name__ == "__main__":
    main()
