"""The wheel runs docstrings and notebooks in an empty environment (pages: .ci/check_pages.py)."""

import base64
import csv
import hashlib
import subprocess
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT, TARGET, run_with_wheel
from packaging.tags import sys_tags
from packaging.utils import parse_wheel_filename

import environment

HERE = ROOT / "harness" / "python"
MODELS = ("HubSlosh", "Spacecraft", "SloshTank")
NOTEBOOKS = sorted((HERE / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory) -> Path:
    """Return the Python of an environment with the wheel and the packages that it requires.

    The environment is created again if these packages change; otherwise only the wheel is replaced.
    """
    with zipfile.ZipFile(wheel) as archive:
        metadata = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        text = archive.read(metadata).decode()
    needed = [line for line in text.splitlines() if "Requires-Dist" in line and "extra" not in line]
    requirements = tmp_path_factory.mktemp("wheel") / "requirements.txt"
    names = [line.removeprefix("Requires-Dist: ") for line in needed]
    requirements.write_text("\n".join([*names, ""]))
    python = environment.ensure(TARGET / "python" / "wheel", requirements, hashes=False)
    pip = [python, "-m", "pip", "--disable-pip-version-check"]
    for arguments in (["install", "--force-reinstall", "--no-deps", wheel], ["check"]):
        done = subprocess.run([*pip, *arguments], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    return python


@pytest.mark.long
def test_the_record_of_the_wheel_lists_every_file_with_its_hash(wheel: Path) -> None:
    """The test checks the file RECORD as an installer does."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        record = names[-1]
        rows = list(csv.reader(archive.read(record).decode().splitlines()))
        assert [row[0] for row in rows] == names
        for name, hashed, size in rows[:-1]:
            data = archive.read(name)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
            assert (hashed, int(size)) == (f"sha256={digest}", len(data)), name
    assert rows[-1] == [record, "", ""]
    models = [f"{model}{fmi}" for model in MODELS for fmi in ("", "-fmi3", "-fmi3-arrays")]
    fmus = {f"hubslosh/fmus/{model}.fmu" for model in models}
    assert {"hubslosh/py.typed", *fmus} <= set(names)
    examples = {name for name in names if name.startswith("hubslosh/examples/")}
    assert "hubslosh/examples/12_spacecraft/spacecraft.py" in examples
    assert not any("/test_" in name or name.endswith((".svg", ".toml")) for name in examples)


@pytest.mark.long
def test_the_fmus_of_fmi_3_are_found_by_name(installed: Path, tmp_path: Path) -> None:
    """The FMUs are found outside the source tree; results are bit-identical to FMI 2.0."""
    program = """
from hubslosh import simulate
for model in ("HubSlosh", "Spacecraft", "SloshTank"):
    two, three, arrays = (simulate(model + fmi, stop=0.1) for fmi in ("", "-fmi3", "-fmi3-arrays"))
    assert two.equals(three), model
    shared = [name for name in two if name in arrays]
    assert len(shared) > 10 and two[shared].equals(arrays[shared]), model
    print(three.attrs["model"], arrays.attrs["model"])
"""
    done = subprocess.run(
        [installed, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    every = [f"{model}{fmi}" for model in MODELS for fmi in ("-fmi3", "-fmi3-arrays")]
    assert done.stdout.split() == every


@pytest.mark.long
def test_the_wheel_tag_names_only_this_machine(wheel: Path) -> None:
    """The tags in the name of the file and in the metadata of the wheel agree."""
    tags = parse_wheel_filename(wheel.name)[3]
    assert set(tags) & set(sys_tags())
    with zipfile.ZipFile(wheel) as archive:
        said = next(n for n in archive.namelist() if n.endswith(".dist-info/WHEEL"))
        lines = archive.read(said).decode().splitlines()
    assert {f"Tag: {tag}" for tag in tags} <= set(lines) and "Root-Is-Purelib: false" in lines
    assert all(tag.platform != "any" for tag in tags)


DOCTESTS = """
import doctest, importlib, pkgutil, hubslosh
found = doctest.TestResults(0, 0)
names = [info.name for info in pkgutil.iter_modules(hubslosh.__path__, "hubslosh.")]
every = [getattr(hubslosh, name) for name in hubslosh.__all__]  # imports the compiled names
for name in ["hubslosh", *names]:
    if not name.rpartition(".")[2].startswith("_"):
        more = doctest.testmod(importlib.import_module(name), globs={})
        found = doctest.TestResults(found.failed + more.failed, found.attempted + more.attempted)
assert not found.failed and found.attempted > 100, found
"""
"""Program that runs the examples of every docstring; they must import all names that they use."""


@pytest.mark.long
def test_the_examples_in_docstrings_give_the_shown_results(
    wheel: Path, tmp_path: Path, request
) -> None:
    """The examples run in an empty folder, with the installed wheel."""
    run_with_wheel(["-c", DOCTESTS], wheel, tmp_path, request)


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "parameters", "moves"),
    [
        ("HubSlosh", {"init.slosh_angle": (10, "deg")}, "omega"),
        ("Spacecraft", {"tank[1].p_dot_0[1,1]": 0.3}, "omega[2]"),
        ("SloshTank", {"tank.p_dot_0[1,1]": 0.3}, "force[1]"),
    ],
)
def test_every_fmu_of_the_wheel_runs(
    installed: Path, tmp_path: Path, model: str, parameters: dict, moves: str
) -> None:
    """Each FMU is found by name and simulated for a second; its initial slosh moves it."""
    code = (
        "import hubslosh\n"
        f"run = hubslosh.simulate({model!r}, {parameters!r}, stop=1)\n"
        "assert run['time'].iloc[-1] == 1 and run.notna().all(axis=None)\n"
        f"assert abs(run[{moves!r}]).max() > 1e-6\n"
    )
    done = subprocess.run(
        [installed, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_craft_of_one_or_two_tanks_have_uncertain_models(installed: Path, tmp_path: Path) -> None:
    """`Craft.uncertain` works in the wheel, which contains one Spacecraft FMU for any craft."""
    code = """
import numpy as np
import hubslosh
sphere = {"density": 1000.0, "shape": {"sphere": {"radius": 0.3}}}
for places in ({"a": (0, 0, 0.2)}, {"a": (0.4, 0, 0.2), "b": (-0.4, 0, 0.2)}):
    for modes in (1, 2):
        tanks = {name: hubslosh.MountedTank(sphere, at, modes=modes, nu=1e-6)
                 for name, at in places.items()}
        craft = hubslosh.Craft(900.0, (300, 400, 500), tanks=tanks, thrust=200.0)
        model = craft.uncertain("50%", {"a.frequency[1]": "10%", "a.zeta[1]": "interval"})
        loop = craft.loop(np.hstack([40 * np.eye(3), 300 * np.eye(3)]), 0.1, "50%")
        assert model.model == loop.model == craft.model == "Spacecraft"
        assert len(model.at({}).states) and hubslosh.margins(loop).phase_margin
"""
    done = subprocess.run(
        [installed, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_functions_name_the_optional_package_that_is_missing(
    installed: Path, tmp_path: Path
) -> None:
    """Plots and python-control need optional dependencies."""
    code = (
        "import hubslosh, pandas\n"
        "run = hubslosh.simulate(stop=1)\n"
        "assert hubslosh.__version__[0].isdigit()\n"
        "model = hubslosh.linearize(parameters={'friction.model': 'viscous'})\n"
        "for call in (lambda: hubslosh.plot.time_histories(run), model.to_control):\n"
        "    try: call()\n"
        "    except hubslosh.FmuError as error: print(error)\n"
    )
    done = subprocess.run(
        [installed, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "pip install matplotlib" in done.stdout and "pip install control" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_each_notebook_runs_without_an_error(
    wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: Path
) -> None:
    """All cells run in order with the files of the wheel, including their figures."""
    import nbformat
    from nbclient import NotebookClient

    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "wheel")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "wheel"))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "outputs are not stored"
    client = NotebookClient(
        notebook, timeout=120, kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )  # fmt: skip
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert any("image/png" in output.get("data", {}) for output in outputs), "it draws something"


def test_notebooks_exist() -> None:
    """The list of notebooks is not empty."""
    assert len(NOTEBOOKS) == 3
