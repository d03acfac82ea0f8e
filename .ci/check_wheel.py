"""Installs a wheel of this package without Rust, as a user does, and uses all its parts.

    python3 .ci/check_wheel.py dist/hubslosh-….whl [--find-links FOLDER]

It creates a virtual environment; PATH has only this environment and the system's programs. It
measures the CPU time to the first plot. It runs ``import hubslosh``, the command ``hubslosh`` with
the wheel's FMUs (run, check, tank, identify, the campaign and its report), the package's
``campaign``, and every example that needs no further package. With --find-links pip installs
packages from that folder, without a network. The script needs Python 3.11 or newer and its
standard library.

The exit code is 0 if everything runs within the printed CPU times.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

IMPORT = 0.2
"""Allowed CPU time of ``import hubslosh``, s."""

FIRST_PLOT = 30.0
"""Allowed CPU time from the downloaded wheels to the first plot, s."""

REPORT = 60.0
"""Allowed CPU time of the campaign with its report, s."""

NEEDS_MORE = {"6_monte_carlo": "distributed", "7_one_loop": "the crate one-loop"}
"""Examples with the packages that the wheel's extras do not install."""


FMUS = ("HubSlosh", "Spacecraft", "SloshTank")
"""FMUs of the wheel, each in both versions of FMI."""


class Machine:
    """A virtual environment with only the wheel and the system's programs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        venv = folder / "venv"
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        self.scripts = venv / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.scripts / ("python.exe" if os.name == "nt" else "python")
        system = (
            [str(Path(os.environ["SYSTEMROOT"]) / "System32")]
            if os.name == "nt"
            else ["/usr/bin", "/bin"]
        )
        path = os.pathsep.join([str(self.scripts), *system])
        for tool in ("cargo", "rustc"):
            if found := shutil.which(tool, path=path):
                sys.exit(f"error: {found} exists; this check needs an environment without Rust")
        keep = ("SYSTEMROOT", "TEMP", "TMP", "TMPDIR", "LANG", "LC_ALL", "PIP_CACHE_DIR")
        self.environment = {name: os.environ[name] for name in keep if name in os.environ} | {
            "PATH": path,
            "HOME": str(folder),
            "USERPROFILE": str(folder),
            "MPLBACKEND": "agg",
            "MPLCONFIGDIR": str(folder / "matplotlib"),
        }

    def run(self, *command: str | Path) -> tuple[str, float]:
        """Run a command; return its output and CPU time (s), or end the program if it fails."""
        begin = children_cpu()
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, text=True, encoding="utf-8",
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        )  # fmt: skip
        if done.returncode:
            line = " ".join(map(str, command))
            sys.exit(f"{done.stdout}\nerror: {line}: exit code {done.returncode}")
        return done.stdout, children_cpu() - begin


def children_cpu() -> float:
    """Return the CPU time (s) of all ended child processes; 0 on Windows, which does not count it.

    Elapsed time would depend on what else runs on the machine.
    """
    times = os.times()
    return times.children_user + times.children_system


def within(what: str, seconds: float, limit: float) -> None:
    """Print a CPU time in s; end the program with an error if it is above ``limit``, s.

    ``what`` says what took this time.
    """
    print(f"{what}: {seconds:.2f} s of CPU time (allowed: {limit:g} s)", flush=True)
    if seconds > limit:
        sys.exit(f"error: {what}: more than {limit:g} s")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--find-links", type=Path, metavar="FOLDER")
    parser.add_argument("--no-examples", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="wheel-", ignore_cleanup_errors=True) as folder:
        check(Machine(Path(folder)), args)
    print("the wheel works")


def check(machine: Machine, args: argparse.Namespace) -> None:
    """Use every part of the wheel once: its command, its FMUs, the package and its examples."""
    run, python = machine.run, machine.python
    begin = children_cpu()
    source = (
        []
        if args.find_links is None
        else ["--no-index", "--find-links", args.find_links.absolute()]
    )
    wheel = f"{args.wheel.absolute()}[plot,control,robust]"
    run(python, "-m", "pip", "install", "--disable-pip-version-check", *source, wheel)
    shutil.copytree(ROOT / "examples", machine.folder / "examples")
    tank = machine.folder / "examples" / "0_your_own_tank" / "my_tank.py"
    run(python, tank)
    picture = next(machine.folder.rglob("my_tank.png"))
    within(f"installed, and {picture.name} drawn", children_cpu() - begin, FIRST_PLOT)

    code = "import time; import hubslosh; print(time.process_time())"
    bare = float(run(python, "-c", "import time; print(time.process_time())")[0])
    within("import hubslosh", float(run(python, "-c", code)[0]) - bare, IMPORT)

    program = shutil.which("hubslosh", path=machine.environment["PATH"])
    if program is None:
        sys.exit("error: the wheel installs no command hubslosh")
    print(run(program, "--version")[0].strip(), "at", program)
    fmus = [Path(line).stem for line in run(program, "fmus")[0].splitlines()]
    kinds = ("", "-fmi3", "-fmi3-arrays")
    if sorted(fmus) != sorted(f"{name}{kind}" for name in FMUS for kind in kinds):
        sys.exit(f"error: the wheel has the FMUs {', '.join(fmus)}")
    for fmu in fmus:
        print(run(program, "check", fmu)[0].strip().splitlines()[-1])
    for command in ([program], [python, "-m", "hubslosh"]):
        address = run(*command, "book")[0].splitlines()[0]
        if not address.endswith("/book/index.md"):
            sys.exit(f"error: hubslosh book does not print the book's address: {address}")
    drawing = ROOT / "harness" / "tank" / "examples" / "capsule.toml"
    run(program, "tank", drawing, "--fill", "1.2", "--out", "tank.json")
    run(program, "run", "--profile", "exp-sweep:amplitude=0.1,duration=300", "--out", "sweep.csv")
    _, seconds = run(program, "identify", "sweep.csv", "--out", "result.json")
    print(f"identify: {seconds:.1f} s of CPU time", flush=True)
    _, seconds = run(program, "campaign")
    report = machine.folder / "dist" / "campaign" / "report.html"
    if report.stat().st_size < 1_000_000:
        sys.exit(f"error: {report} has {report.stat().st_size} bytes")
    within("the campaign and its report", seconds, REPORT)

    # the package finds the command that pip installed with it
    plan = (
        'title = "Two pulses"\\nprofile = "pulse:amplitude=0.05,start=1,width=1,duration=10"\\n'
        '[vary]\\nslosh.model = ["linear", "spherical"]\\n'
    )
    machine.environment["PATH"] = machine.environment["PATH"].split(os.pathsep, 1)[1]
    code = f"import hubslosh\nassert len(hubslosh.campaign('''{plan}''', 'two')) == 2"
    run(python, "-c", code)
    if args.no_examples:
        return
    for script in sorted((machine.folder / "examples").glob("*/*.py")):
        name = script.parent.name
        if script.name.startswith("test_") or name in NEEDS_MORE:
            continue
        _, seconds = run(python, script)
        print(f"example {name}: {seconds:.1f} s of CPU time", flush=True)
    for name, what in NEEDS_MORE.items():
        print(f"example {name} is not run: it needs {what}")


if __name__ == "__main__":
    main()
