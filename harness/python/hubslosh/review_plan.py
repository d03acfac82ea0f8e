"""Reviews a loop by a plan: ``python -m hubslosh.review_plan PLAN.toml``, for ``hubslosh review``.

The keys of the plan are the arguments of `Craft.review`; the table ``craft`` has those of `Craft`,
each table of ``craft.tanks`` those of `MountedTank`. ``controller`` is a matrix of gains, a table
with the matrices ``A``, ``B``, ``C``, ``D`` (in discrete time also ``period``), or
``"FILE.py:NAME"``: a controller, or a function without arguments that returns one, which is run.
"""

import argparse
import inspect
import runpy
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .craft import Craft, MountedTank
from .fmu import FmuError, did_you_mean
from .linearization import LinearModel
from .review import Review


def review_plan(path: str | Path) -> Review:
    """Return the review of a plan file."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            plan = tomllib.load(file)
    except OSError as error:
        raise FmuError(f"{path} cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise FmuError(f"{path}: {error}") from None
    try:
        given = _table(plan, "craft")
        tanks = {}
        for name, of in _table(given, "tanks", {}).items():
            if isinstance(of, Mapping) and isinstance(of.get("source"), str):
                of = {**of, "source": path.parent / of["source"]}
            tanks[name] = _call(MountedTank, of, f"craft.tanks.{name}")
        craft = _call(Craft, {**given, "tanks": tanks}, "craft")
        plan["controller"] = _controller(plan.get("controller"), path.parent)
        arguments = {name: value for name, value in plan.items() if name != "craft"}
        return _call(craft.review, arguments, "the plan")
    except FmuError as error:
        raise FmuError(f"{path}: {error}") from None


_MISSING: dict[str, Any] = {}


def _table(of: Mapping[str, Any], name: str, default: dict[str, Any] = _MISSING) -> dict[str, Any]:
    found = of.get(name, None if default is _MISSING else default)
    if not isinstance(found, dict):
        raise FmuError(f"the table [{name}] is missing")
    return found


def _call(function: Callable[..., Any], given: Any, where: str) -> Any:
    """Call a function with what stands in a table."""
    if not isinstance(given, Mapping):
        raise FmuError(f"{where} must be a table, not {given!r}")
    parameters = inspect.signature(function).parameters
    for name in given:
        if name not in parameters:
            hint = did_you_mean(name, parameters)
            raise FmuError(f"{where} has {name} (allowed: {', '.join(parameters)}){hint}")
    missing = [name for name, p in parameters.items() if p.default is p.empty and name not in given]
    if missing:
        raise FmuError(f"{where} needs {', '.join(missing)}")
    return function(**given)


def _controller(given: Any, folder: Path) -> Any:
    if isinstance(given, Mapping):
        matrices = [given.get(name) for name in "ABCD"]
        if any(matrix is None for matrix in matrices) or not set(given) <= {*"ABCD", "period"}:
            raise FmuError("the table controller needs A, B, C and D, in discrete time also period")
        try:
            A, B, C, D = (np.atleast_2d(np.array(matrix, float)) for matrix in matrices)
        except ValueError as error:
            raise FmuError(f"controller: {error}") from None
        return LinearModel(A, B, C, D, (), (), (), given.get("period"))
    if not isinstance(given, str):
        return given
    file, _, name = given.rpartition(":")
    if not file.endswith(".py") or not (folder / file).is_file():
        raise FmuError(f'controller = "{given}" must be "FILE.py:NAME" with a file that exists')
    found = runpy.run_path(str(folder / file)).get(name)
    if found is None:
        raise FmuError(f"{file} has no {name}")
    return found() if callable(found) and not hasattr(found, "dt") else found


def main() -> None:
    """Write the page of a plan, and print the review."""
    parser = argparse.ArgumentParser(description="Reviews a loop around a craft by a plan.")
    parser.add_argument("plan", type=Path, metavar="PLAN", help="plan file, .toml")
    parser.add_argument("--out", type=Path, metavar="FILE", help="page to write, .html")
    arguments = parser.parse_args()
    out = arguments.out or arguments.plan.with_suffix(".html")
    try:
        found = review_plan(arguments.plan)
        found.save(out)
    except FmuError as error:
        sys.exit(f"error: {error}")
    print(f"{found}\n{out}")
    if not found.requirements()["passed"].all():
        sys.exit(f"error: {found.summary}")


if __name__ == "__main__":
    main()
