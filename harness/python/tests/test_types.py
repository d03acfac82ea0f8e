"""Types: type checkers run on scripts of users, and on the declarations of the compiled part."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT, TARGET, run_with_wheel

import environment
import hubslosh

HERE = Path(__file__).parent
USERS = sorted((HERE / "users").glob("*.py"))


@pytest.fixture(scope="module")
def checkers() -> Path:
    """Return the Python of a virtual environment with mypy and pyright."""
    return environment.ensure(TARGET / "python" / "types", ROOT / ".ci" / "requirements-types.txt")


def check(checkers: Path, name: str, scripts: list[Path], folder: Path) -> tuple[int, str]:
    """Return exit code and output of the type checker ``name`` for ``scripts``.

    It sees the package as installed.
    """
    package = str(HERE.parent)
    if name == "mypy":
        command = [checkers, "-m", "mypy", "--strict", "--follow-imports=silent"]
        command += ["--cache-dir", TARGET / "python" / "mypy"]
    else:
        settings = {"typeCheckingMode": "standard", "extraPaths": [package]}
        settings |= {"reportMissingModuleSource": False, "include": [str(s) for s in scripts]}
        (folder / "pyrightconfig.json").write_text(json.dumps(settings))
        command = [checkers, "-m", "basedpyright", "--project", folder, "--pythonpath", checkers]
        scripts = []
    done = subprocess.run(
        [*command, *scripts], env=os.environ | {"MYPYPATH": package, "PYTHONPATH": ""},
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", ["mypy", "pyright"])
def test_type_checkers_accept_scripts_of_users(checkers: Path, name: str, tmp_path: Path) -> None:
    """The scripts use a craft, margins, Monte Carlo, identification and figures."""
    assert len(USERS) == 5
    code, output = check(checkers, name, USERS, tmp_path)
    assert code == 0, output


@pytest.mark.long
@pytest.mark.parametrize("script", USERS, ids=[script.stem for script in USERS])
def test_a_script_of_a_user_runs(script: Path, tmp_path: Path, wheel: Path, request) -> None:
    """The script runs with the wheel in an empty folder."""
    run_with_wheel([script], wheel, tmp_path, request)


MISTAKES = {
    "hubslosh.simulat(stop=1)": "simulat",
    "hubslosh.simulate(stopp=1)": "stopp",
    'hubslosh.simulate(stop="1 s")': "stop",
    "hubslosh.plot.bodee()": "bodee",
    'hubslosh.Fmu.open("HubSlosh").variable("tank.h").causalty': "causalty",
    "hubslosh.FmuError().time": "time",
    'hubslosh.identify("bench.csv", method="drag")': "method",
}
"""Lines with a mistake, each with the word that a type checker must name."""


@pytest.mark.long
@pytest.mark.parametrize("name", ["mypy", "pyright"])
def test_type_checkers_find_mistakes_of_users(checkers: Path, name: str, tmp_path: Path) -> None:
    """Each line has an error that a checker misses if a type of the package is Any by mistake."""
    script = tmp_path / "mistakes.py"
    script.write_text("\n".join(["import hubslosh", *MISTAKES, ""]))
    code, output = check(checkers, name, [script], tmp_path)
    assert code == 1, output
    for line, word in enumerate(MISTAKES.values(), 2):
        about = [text for text in output.splitlines() if f"mistakes.py:{line}:" in text]
        assert any(word in text for text in about), f"line {line} ({word}):\n{output}"


def test_the_stub_declares_exactly_the_names_of_the_compiled_module() -> None:
    """The stub is ``_native.pyi``; names of methods and attributes are compared, too."""
    tree = ast.parse(Path(hubslosh.__file__).with_name("_native.pyi").read_text())
    module = sys.modules["hubslosh._native"]
    declared = {
        node.name: node for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)
    }
    assert declared.keys() == {name for name in dir(module) if not name.startswith("_")}
    for name, node in declared.items():
        if not isinstance(node, ast.ClassDef) or issubclass(getattr(module, name), Exception):
            continue
        members = {
            each.target.id if isinstance(each, ast.AnnAssign) else each.name
            for each in node.body
            if isinstance(each, ast.AnnAssign | ast.FunctionDef)
        }
        real = {each for each in vars(getattr(module, name)) if not each.startswith("_")}
        assert {each for each in members if not each.startswith("_")} == real, name
