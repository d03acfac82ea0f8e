"""Runs every `sh` and `python` block of the pages with the installed wheel, like a reader.

    python3 .ci/check_pages.py WHEEL [PAGE …] [--find-links FOLDER] [--slow] [--keep FOLDER]

Pages are README, the book, the READMEs of the examples and of the package, and the documentation
of the FMUs. Each page runs in its own folder, without the project's source. Its commands run one by
one, its Python runs as one program. `GIVEN` creates the files that a page expects, such as the
reader's recording. `LEFT_OUT` lists commands that need the source or change the machine, with the
reason. Commands in `SLOW` run only with --slow (`.ci/run --nightly`). An entry of these lists that
matches no command is an error.

Each failure is printed as PAGE:LINE with the command or code; the exit code is then 1.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

PAGES = ("README.md", "book/**/*.md", "examples/**/README.md", "harness/python/README.md",
         "modelDescription/*/documentation/*.md")  # fmt: skip

INDENTED = r" {4}(hubslosh|python3?|pip|cargo) "
"""Pattern of the first line of a shell block that is indented instead of fenced."""

LEFT_OUT = {
    r"cargo (run|test|build|install)\b": "needs the source and Rust; .ci/run and CI's workflows",
    r"hubslosh pack\b": "needs the source and Rust; .ci/run packs",
    r"pip install\b": "this script and .ci/wheels install the wheel",
    r"python3 -m venv\b": "creates an environment, as this script does",
    r"\. \.venv/bin/activate": "as above",
    r"hubslosh analyse --bench-day (tuesday|target/day)": "a day's logs; tests of `bench_day`",
    r"(PYTHONPATH=harness/python )?python3? harness/studies/": "tests/python.rs",
    r"python examples/(6|7|11)_": "needs dask, libcosimpy or bsk; tests/python.rs",
    r"hubslosh identify (shaken|friction ramp)\.csv": "recordings of others, which have tests",
    r"hubslosh (identify (a|flight)|design slew)\.csv": "others' recordings; tests of `any_fmu`",
    r"hubslosh check my\.fmu --strict": "FMUs built here need a newer glibc, an error; .ci/run",
    r"python3 -m hubslosh\.recordings": "needs the extra recordings; test_recordings.py",
    r"pytest\b": "tests of the source; tests/python.rs",
}
"""Commands that do not run here, with the reason, or with what runs them."""

PYTHON_LEFT_OUT = {
    "book/liquid.md": "needs the extra fem (gmsh and libGLU); test_liquid.py",
}
"""Pages whose Python does not run here, with the reason."""

SLOW = (
    r"hubslosh campaign( |$)",
    r"hubslosh identify .*--free",
    r"hubslosh design .*--optimal",
    r"python examples/(3|9|12|13|14)_",
)
"""Commands that take more than ten seconds; they run with --slow."""

EXIT_CODES = {r"hubslosh check broken\.fmu": 1}
"""Commands that must fail, with their exit codes."""

FOLLOWS = {
    "book/which_damping.md": ("book/spacecraft.md",),
    "book/how_many_modes.md": ("book/spacecraft.md",),
    "book/is_it_slosh.md": ("book/spacecraft.md",),
}
"""Pages whose Python continues the Python of other pages."""

RECORDING = """
import numpy as np, pandas as pd, hubslosh
time = np.arange(0, 300, 0.02)
torque = 0.05 * np.sin(2 * np.pi * (2.1 * time + 0.001 * time**2))
inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
run = hubslosh.simulate(parameters={"tank.h": 0.1}, inputs=inputs, outputs=["omega"])
rate = np.degrees(run["omega"]) + 0.003 * np.random.default_rng(1).standard_normal(len(run))
run.assign(tau_cmd=torque)[["time", "tau_cmd", "omega"]].to_csv("recording.csv", index=False)
inputs.to_csv("torque.csv", index=False)
logs = {"bench": "T_cmd", "bench_050": "T_cmd", "bench_100": "T_cmd", "torque_bench": "T"}
for name, command in logs.items():
    log = pd.DataFrame({"t": 1e3 * time, command: 1e3 * torque, "gyro_z": rate})
    log.to_csv(f"{name}.csv", index=False)
"""
GIVEN = {
    "README.md": RECORDING,
    "harness/python/README.md": RECORDING,
    "book/identification.md": RECORDING
    + "\nimport shutil; shutil.move('torque_bench.csv', 'bench.csv')\n",
    "book/recordings.md": RECORDING
    + """
import subprocess
for number in ("050", "100"):
    profile = f"exp-sweep:amplitude=0.{number},f0=1.25,f1=3.5,duration=2700"
    arguments = ["--profile", profile, "--set", "tank.h=0.1", "--columns", "omega"]
    subprocess.run(["hubslosh", "run", *arguments, "--out", "sweep.csv"], check=True)
    sweep = pd.read_csv("sweep.csv")
    table = {"t": 1e3 * sweep["time"], "T_cmd": 1e3 * sweep["tau_cmd"],
             "gyro_z": np.degrees(sweep["omega"])}
    pd.DataFrame(table).to_csv(f"bench_{number}.csv", index=False)
""",
    "book/readers.md": RECORDING
    + "\nimport shutil; shutil.move('torque_bench.csv', 'bench.csv')\n",
    "book/check_ci.md": """
import shutil, zipfile
with zipfile.ZipFile("my.fmu") as whole, zipfile.ZipFile("broken.fmu", "w") as broken:
    for name in whole.namelist():
        data = whole.read(name)
        if name == "modelDescription.xml":
            data = data.replace(b'unit="kg.m2"', b'unit="kg.m3"', 1)
        broken.writestr(name, data)
""",
    "book/campaign_howto.md": """
from pathlib import Path
Path("mine.toml").write_text('''title = "Two pulses"
profile = "pulse:amplitude=0.05,start=1,width=1,duration=10"
[vary]
slosh.model = ["linear", "spherical"]
''')
""",
    "book/hosts.md": """
import shutil
every = ROOT.glob("dist/release/HubSlosh-*.fmu")
shutil.copy(next(path for path in every if "-fmi3" not in path.name), "HubSlosh.fmu")
""",
    "book/gyro.md": """
import numpy as np, pandas as pd
rate = 4e-4 * np.random.default_rng(1).standard_normal(180_000)
pd.DataFrame({"time": 0.02 * np.arange(len(rate)), "omega": rate}).to_csv("rest.csv", index=False)
""",
    "book/view.md": """
import numpy as np, pandas as pd, hubslosh
time = np.arange(0, 20, 0.02)
sweep = pd.DataFrame({"time": time, "tau_cmd": 0.05 * np.sin(15 * time)})
""",
    "book/uncertain.md": """
import sys
import numpy as np, pandas as pd, hubslosh
sys.path.insert(0, "examples/14_telecom_satellite")
known = {"force[3]": 2400.0, "init.omega[1]": 0.0, "init.omega[3]": 0.0}
time = np.arange(0, 120, 0.1)
chirp = 30 * np.sin(0.3 * time + 0.004 * time**2)
inputs = pd.DataFrame({"time": time, "torque[2]": chirp})
flight = hubslosh.simulate("Spacecraft", known, inputs=inputs, outputs=["omega[2]"])
flight["omega[2]"] += 1e-5 * np.random.default_rng(1).standard_normal(len(flight))
flight["torque[2]"] = chirp
""",
    "book/design_review.md": """
import sys
sys.path.insert(0, "examples/14_telecom_satellite")
""",
    "modelDescription/SloshTank/documentation/coupling.md": """
import numpy as np
impulse, taken = np.arange(6.0), np.zeros(6)
M_host, C, V, omega = np.eye(6), np.eye(3), np.zeros(3), np.zeros(3)
""",
}
"""Python that creates the files and names that a page expects; the page's Python continues it."""


@dataclass
class Block:
    """A block of code of a page with its language and line."""

    page: str
    line: int
    """Line number of its first line of code."""
    language: str
    code: str


def blocks(page: str) -> list[Block]:
    """Return the blocks of a page that contain commands or Python."""
    found, lines = [], (ROOT / page).read_text().splitlines()
    begin = None
    for n, line in enumerate(lines):
        if begin is None and (mark := re.match(r"\s*```(\w*)\s*$", line)):
            begin, language = n, mark[1]
        elif begin is None and re.match(INDENTED, line) and not lines[n - 1].strip():
            end = next((k for k in range(n, len(lines)) if lines[k][:4].strip()), len(lines))
            code = textwrap.dedent("\n".join(lines[n:end]))
            found.append(Block(page, n + 1, "sh", code.rstrip()))
        elif begin is not None and line.strip() == "```":
            code = textwrap.dedent("\n".join(lines[begin + 1 : n]))
            if language in ("sh", "python", "toml"):
                found.append(Block(page, begin + 2, language, code))
            begin = None
    return found


def commands(block: Block) -> list[tuple[int, str]]:
    """Return the commands of a shell block with their lines; a backslash continues a command."""
    found: list[tuple[int, str]] = []
    whole, first = "", block.line
    for n, line in enumerate(block.code.splitlines(), block.line):
        first = first if whole else n
        whole += line
        if whole.endswith("\\"):
            whole = whole[:-1]
        else:
            if whole.strip():
                found.append((first, re.sub(r"\s+#\s.*$", "", whole).strip()))
            whole = ""
    return found


class Reader:
    """The machine of a reader who follows the pages: the wheel and the system's programs."""

    def __init__(self, folder: Path, wheel: Path, find_links: Path | None) -> None:
        self.folder = folder
        venv = folder / "venv"
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        scripts = venv / ("Scripts" if os.name == "nt" else "bin")
        self.python = scripts / "python"
        source = ["--no-index", "--find-links", find_links] if find_links else []
        subprocess.run(
            [self.python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
             *source, f"{wheel.absolute()}[plot,control,robust]", "fmpy", "pyarrow"],
            check=True,
        )  # fmt: skip
        keep = ("SYSTEMROOT", "TEMP", "TMP", "TMPDIR", "LANG", "LC_ALL")
        self.environment = {name: os.environ[name] for name in keep if name in os.environ} | {
            "PATH": os.pathsep.join((str(scripts), "/usr/bin", "/bin")),
            "HOME": str(folder),
            "MPLBACKEND": "agg",
            "MPLCONFIGDIR": str(folder / "matplotlib"),
            "BROWSER": "true",
        }
        listed = subprocess.run(
            [scripts / "hubslosh", "fmus"], env=self.environment, cwd=folder,
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
        self.fmus = [Path(line) for line in listed.split()]

    def prepare(self, page: str) -> Path:
        """Create a folder for a page, with the files that the page names, and return it."""
        folder = self.folder / page.replace("/", "-").removesuffix(".md")
        (folder / "dist").mkdir(parents=True)
        for fmu in self.fmus:
            (folder / "dist" / fmu.name).symlink_to(fmu)
        own = next(fmu for fmu in self.fmus if fmu.name == "HubSlosh.fmu")
        for name in ("my.fmu", "other.fmu", "some.fmu"):
            shutil.copy(own, folder / name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        shutil.copytree(ROOT / "harness/tank/examples", folder / "harness/tank/examples")
        for name in ("tank.toml", "TANK.toml"):
            shutil.copy(ROOT / "harness/tank/examples/capsule.toml", folder / name)
        return folder

    def run(self, arguments: list, folder: Path) -> tuple[int, str]:
        done = subprocess.run(
            arguments, cwd=folder, env=self.environment, text=True, encoding="utf-8",
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, check=False,
        )  # fmt: skip
        return done.returncode, done.stdout


PROGRAM = """
import json, sys, traceback
from pathlib import Path
ROOT = Path(sys.argv[2])
names = {"__name__": "__main__", "ROOT": ROOT}
for page, line, code in json.loads(Path(sys.argv[1]).read_text()):
    try:
        exec(compile("\\n" * (line - 1) + code, page, "exec"), names)
    except BaseException as error:
        frames = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == page]
        line = frames[-1] if frames else getattr(error, "lineno", None) or line
        traceback.print_exc()
        sys.exit(f"AT {page}:{line}")
"""
"""Program that runs blocks of Python as one, and reports errors at the lines of the pages."""


class Check:
    """Runs the code of pages, and counts failures and the list entries that matched a command."""

    def __init__(self, reader: Reader, include_slow: bool) -> None:
        self.reader, self.include_slow = reader, include_slow
        self.failures: list[str] = []
        self.used: set[str] = set()
        self.durations: list[tuple[float, str]] = []

    def matches(self, patterns: object, command: str) -> str | None:
        """Return the first of ``patterns`` that matches the command, and record it as used."""
        found = next((p for p in patterns if re.match(p, command)), None)
        self.used |= {found} if found else set()
        return found

    def page(self, page: str) -> None:
        folder = self.reader.prepare(page)
        own = blocks(page)
        prelude = [Block(page, 1, "python", GIVEN[page])] if page in GIVEN else []
        for block in own:
            name = re.search(r"`(\w+\.toml)`", self._before(block))
            if block.language == "toml" and name and not (folder / name[1]).exists():
                (folder / name[1]).write_text(block.code + "\n")
        if prelude and not self._python(page, prelude, folder):
            return
        for block in own:
            if block.language == "sh":
                self._shell(block, folder)
        python = [block for block in own if block.language == "python"]
        if python and page in PYTHON_LEFT_OUT:
            self.used.add(page)
        elif python:
            before = [
                b
                for other in FOLLOWS.get(page, ())
                for b in blocks(other)
                if b.language == "python"
            ]
            self._python(page, [*prelude, *before, *python], folder)

    def _before(self, block: Block) -> str:
        """Return the paragraph before a block, which says what the block is for."""
        lines = (ROOT / block.page).read_text().splitlines()[: block.line - 2]
        return " ".join(lines[-4:])

    def _shell(self, block: Block, folder: Path) -> None:
        """Run a block of shell commands in one shell until one fails."""
        script, lines = ["set -uo pipefail"], []
        for line, command in commands(block):
            if self.matches(LEFT_OUT, command):
                continue
            if self.matches(SLOW, command) and not self.include_slow:
                continue
            expected = EXIT_CODES.get(self.matches(EXIT_CODES, command) or "", 0)
            script += [
                f'printf "@@ {len(lines)} %s\\n" "$EPOCHREALTIME"', command,
                f'code=$?; [ "$code" = {expected} ] || {{',
                f'echo "exit code $code (expected {expected})"; exit 1; }}',
            ]  # fmt: skip
            lines.append((line, command))
        if not lines:
            return
        script.append('printf "@@ end %s\\n" "$EPOCHREALTIME"')
        code, said = self.reader.run(["bash", "-c", "\n".join(script)], folder)
        marks = list(re.finditer(r"^@@ (\w+) ([\d.]+)$", said, re.MULTILINE))
        for (line, command), begin, end in zip(lines, marks, marks[1:], strict=False):
            seconds = float(end[2]) - float(begin[2])
            self.durations.append((seconds, f"{block.page}:{line}: {command}"))
        if code:
            line, command = lines[int(marks[-1][1])]
            self._fail(f"{block.page}:{line}", command, said[marks[-1].end() :])

    def _python(self, page: str, run: list[Block], folder: Path) -> bool:
        """Run the Python blocks of a page as one program."""
        import json

        (folder / ".blocks.json").write_text(json.dumps([(b.page, b.line, b.code) for b in run]))
        (folder / ".blocks.py").write_text(PROGRAM)
        begin = time.monotonic()
        program = [self.reader.python, ".blocks.py", ".blocks.json", str(ROOT)]
        code, said = self.reader.run(program, folder)
        self.durations.append((time.monotonic() - begin, f"{page}: Python"))
        if code:
            place = re.search(r"^AT (.*)$", said, re.MULTILINE)
            self._fail(place[1] if place else page, "Python", said)
        return code == 0

    def _fail(self, place: str, what: str, said: str) -> None:
        tail = "\n".join(said.strip().splitlines()[-12:])
        self.failures.append(f"{place}: {what}\n{textwrap.indent(tail, '    ')}")
        print(self.failures[-1], flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("wheel", type=Path)
    parser.add_argument("pages", nargs="*")
    parser.add_argument("--find-links", type=Path, metavar="FOLDER")
    parser.add_argument("--slow", action="store_true", help="run SLOW commands too")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="run here and keep the files")
    args = parser.parse_args()
    every = [
        p.relative_to(ROOT).as_posix() for pattern in PAGES for p in sorted(ROOT.glob(pattern))
    ]
    pages = args.pages or [page for page in every if blocks(page)]
    folder = args.keep or Path(tempfile.mkdtemp(prefix="pages-"))
    folder.mkdir(exist_ok=True)
    try:
        check = Check(Reader(folder.absolute(), args.wheel, args.find_links), args.slow)
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(check.page, pages))
    finally:
        if not args.keep:
            shutil.rmtree(folder, ignore_errors=True)
    lists = [*LEFT_OUT, *SLOW, *EXIT_CODES, *PYTHON_LEFT_OUT]
    if not args.pages:
        unused = [entry for entry in lists if entry not in check.used]
        check.failures += [
            f"no command matches {entry}: remove it from .ci/check_pages.py" for entry in unused
        ]
        unknown = [page for page in (*GIVEN, *FOLLOWS) if page not in pages]
        check.failures += [
            f"{page} has no code: remove it from .ci/check_pages.py" for page in unknown
        ]
    for seconds, what in sorted(check.durations, reverse=True)[:12]:
        print(f"{seconds:6.1f} s  {what}")
    if check.failures:
        sys.exit("\n".join(["", *check.failures, f"{len(check.failures)} failures"]))
    print(f"{len(pages)} pages run")


if __name__ == "__main__":
    main()
