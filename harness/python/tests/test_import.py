"""`import hubslosh` imports nothing large, and offers what its type checkers see."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hubslosh

LARGE = {"numpy", "pandas", "scipy", "fmpy", "lxml", "matplotlib", "control", "pyarrow"}


def test_importing_the_package_imports_nothing_large() -> None:
    """Half a second to a second and a half of CPU time of every program that imports it."""
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
    # simulating needs tables, and pandas imports pyarrow where it is installed; transfer functions
    # and figures are other functions' business
    assert after & LARGE <= {"numpy", "pandas", "pyarrow"}


def test_what_comes_on_first_use_is_what_type_checkers_see() -> None:
    """The imports under TYPE_CHECKING, the names by module, and ``__all__``."""
    tree = ast.parse(Path(hubslosh.__file__).read_text())
    imported = {
        (node.module or alias.name, alias.name)
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    modules = {name for module, name in imported if module == name}
    assert {(m, n) for n, m in hubslosh._MODULE_OF.items()} == {
        (module, name) for module, name in imported if module != name
    }
    assert sorted(hubslosh.__all__) == sorted({*hubslosh._MODULE_OF, *modules})
    for name in hubslosh.__all__:
        assert getattr(hubslosh, name) is not None and name in dir(hubslosh)
    assert isinstance(hubslosh.__version__, str)


def test_every_name_is_in_the_books_reference() -> None:
    """``book/python.md`` lists each public name once; Sphinx makes its page from the docstring."""
    page = Path(__file__).parents[3] / "book" / "python.md"
    listed = re.findall(r"^(?:   |\.\. autodata:: hubslosh\.\w+\.)(\w+)$", page.read_text(), re.M)
    assert sorted(listed) == sorted(hubslosh.__all__)


PENDING = (
    "fitting", "liquid", "mcmc", "modes", "plot", "program", "recordings", "review", "sampling",
    "tanks", "uncertainty", "viewing",
)  # fmt: skip
"""Modules whose docstrings do not yet have the form of numpydoc."""


def test_functions_have_docstrings_of_numpydoc_with_examples() -> None:
    """Parameters in their order, the result, and an example, which ``test_wheel.py`` runs."""
    for name in hubslosh.__all__:
        item = getattr(hubslosh, name)
        if not inspect.isfunction(item) or item.__module__.rpartition(".")[2] in PENDING:
            continue
        text = inspect.getdoc(item) or ""
        assert "\nExamples\n--------\n" in text, name
        signature = inspect.signature(item)
        section = text.partition("\nParameters\n----------\n")[2].partition("\n\n")[0]
        described = re.findall(r"^(\*{0,2}\w+(?:, \w+)*) : ", section, re.M)
        found = [one.lstrip("*") for names in described for one in names.split(", ")]
        assert found == list(signature.parameters), name
        returns = signature.return_annotation in (None, "None")
        assert returns or "\nReturns\n-------\n" in text, name


def test_a_misspelt_name_is_an_error_to_type_checkers() -> None:
    """A module `__getattr__` that they see would make every name of the type Any (PEP 562)."""
    tree = ast.parse(Path(hubslosh.__file__).read_text())
    named = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert "__getattr__" not in {node.name for node in named}
    (hidden,) = (
        block
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "not TYPE_CHECKING"
    )
    assert [node.name for node in hidden.body] == ["__getattr__"]
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = hubslosh.simulat
