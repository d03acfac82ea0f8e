"""`import hubslosh` imports no large package, and has the names that type checkers see."""

import ast
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest

import hubslosh

LARGE = {"numpy", "pandas", "scipy", "fmpy", "lxml", "matplotlib", "control", "pyarrow"}


def test_importing_the_package_imports_no_large_packages() -> None:
    """Large packages are imported on first use, which saves about 1 s of CPU time at each start."""
    code = (
        "import sys, hubslosh\n"
        "print(*{name.partition('.')[0] for name in sys.modules})\n"
        "hubslosh.simulate, hubslosh.plot.time_histories\n"
        "print(*{name.partition('.')[0] for name in sys.modules})\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(hubslosh.__file__).parents[1], capture_output=True, text=True, check=True,
    )  # fmt: skip
    before, after = (set(line.split()) for line in done.stdout.splitlines())
    assert not before & LARGE
    # `simulate` needs pandas, which imports pyarrow if it is installed, but no package for transfer
    # functions or figures
    assert after & LARGE <= {"numpy", "pandas", "pyarrow"}


STUB = Path(hubslosh.__file__).with_name("__init__.pyi")


def test_every_name_of_the_stub_is_imported_when_it_is_used() -> None:
    """The package has the names of ``__init__.pyi``, which are sorted by module, and a version."""
    lines = [line for line in STUB.read_text().splitlines() if line.startswith("from .")]
    assert lines == sorted(lines, key=lambda line: line.split()[1::2])
    assert len(hubslosh.__all__) == len(lines) == len(set(lines))
    for name in hubslosh.__all__:
        assert getattr(hubslosh, name) is not None and name in dir(hubslosh)
    assert isinstance(hubslosh.__version__, str)


def imports(path: Path) -> set[str]:
    """Return the modules of the package that the module in ``path`` imports, also in functions.

    Imports for type checkers are left out, because they are not executed.
    """
    tree = ast.parse(path.read_text())
    typing = [
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    ]
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node not in typing:
            found |= {node.module} if node.module else {alias.name for alias in node.names}
    return found


def test_imports_between_modules_have_no_cycles() -> None:
    """The test removes modules that import no other module until none is left.

    Modules that remain import each other in a cycle.
    """
    files = Path(hubslosh.__file__).parent.glob("*.py")
    left = {file.stem: imports(file) for file in files if file.stem != "__init__"}
    while free := {name for name, used in left.items() if not used & left.keys()}:
        left = {name: used for name, used in left.items() if name not in free}
    assert not left


def test_every_name_is_in_the_books_reference() -> None:
    """``book/python.md`` lists each public name once; Sphinx makes a page from each docstring."""
    page = Path(__file__).parents[3] / "book" / "python.md"
    listed = re.findall(r"^(?:   |\.\. autodata:: hubslosh\.\w+\.)(\w+)$", page.read_text(), re.M)
    assert sorted(listed) == sorted(hubslosh.__all__)


def public() -> Iterator[tuple[str, Any]]:
    """Yield name and value of each public function and class, also of `attitude` and `plot`."""
    for name in hubslosh.__all__:
        item = getattr(hubslosh, name)
        for part, value in vars(item).items() if inspect.ismodule(item) else ((name, item),):
            path = f"{name}.{part}" if inspect.ismodule(item) else name
            callable_here = inspect.isclass(value) or inspect.isfunction(value)
            if part.startswith("_") or not callable_here:
                continue
            if path == name or value.__module__ == f"hubslosh.{name}":
                yield path, value


def own_methods(item: type) -> Iterator[tuple[str, Any]]:
    """Yield name and function of each public method of a class that is written in Python."""
    for name, value in vars(item).items():
        value = getattr(value, "__func__", value)
        if inspect.isfunction(value) and not name.startswith("_"):
            yield name, value


def section(text: str, title: str) -> str:
    """Return the section ``title`` of a numpydoc docstring, or an empty string."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w[\w ]*\n---|\Z)", text, re.DOTALL | re.MULTILINE)
    return found[1] if found else ""


def entries(text: str, title: str) -> list[str]:
    """Return the names of the parameters or attributes in the section ``title`` of a docstring."""
    named = re.findall(r"^(\S.*?)(?: : .*)?$", section(text, title), re.MULTILINE)
    return [one.lstrip("*") for names in named for one in names.split(", ")]


def check_function(path: str, function: Any) -> None:
    """Check that the docstring describes all parameters in their order, and the result.

    ``path`` is the function's name in messages.
    """
    text = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    parameters = [name for name in signature.parameters if name not in ("self", "cls")]
    assert entries(text, "Parameters") == parameters, path
    returns = signature.return_annotation in (None, "None")
    assert returns or section(text, "Returns") or section(text, "Yields"), path


def test_functions_have_docstrings_of_numpydoc_with_examples() -> None:
    """Each docstring describes the parameters in order and the result, and has an example.

    ``test_wheel.py`` runs the examples.
    """
    count = 0
    for path, item in public():
        text = inspect.getdoc(item) or ""
        assert ">>> " in section(text, "Examples"), path
        count += 1
        if inspect.isfunction(item):
            check_function(path, item)
            continue
        if is_dataclass(item):
            shown = [field.name for field in fields(item) if not field.name.startswith("_")]
            told = entries(text, "Parameters") + entries(text, "Attributes")
            assert [name for name in shown if name not in told] == [], path
        for name, method in own_methods(item):
            check_function(f"{path}.{name}", method)
            own = section(inspect.getdoc(method) or "", "Examples")
            assert ">>> " in own or f".{name}(" in section(text, "Examples"), f"{path}.{name}"
    assert count > 50


def test_a_misspelt_name_is_an_error_to_type_checkers() -> None:
    """Type checkers must not see the module's `__getattr__` (PEP 562).

    With it, they would accept every name and give it the type Any.
    """
    assert "__getattr__" not in STUB.read_text()
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = hubslosh.simulat
