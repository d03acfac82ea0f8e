"""A project file: craft, controller, cases, uncertainty and requirements of a design.

The command ``hubslosh review`` calls ``python -m hubslosh.project PROJECT.toml …``. The keys of the
file are the arguments of `Craft.review`. The table ``craft`` has the arguments of `Craft`, each
table of ``craft.tanks`` the arguments of `MountedTank`, each table of ``craft.engines`` the
arguments of `Engine`, each table of ``craft.wheels`` the arguments of `Wheel`, and each table of
``craft.appendages`` the arguments of `Appendage`.

``controller`` is a matrix of gains, a table with the matrices ``A``, ``B``, ``C``, ``D``, or a
table with ``num`` and ``den`` of transfer functions; a table of a controller in discrete time also
has ``period``. Or it is ``"FILE.py:NAME"``: the file is run, and the name is a controller, or a
function without arguments that returns a controller. Each table of ``cases`` has the arguments that
differ in this case, and a table ``craft`` with the arguments of `Craft` that differ.
"""

import argparse
import inspect
import os
import runpy
import sys
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from .appendages import Appendage
from .comparison import compare
from .craft import Craft, MountedTank
from .engines import Engine
from .fmu import FmuError, did_you_mean
from .linearization import LinearModel
from .loop import Loop, _from_control
from .review import Review
from .tanks import toml_key, toml_of
from .temporary import write_file
from .wheels import Wheel

# Classes of the named parts of a craft, each of which has a table of its own in the file.
PARTS = {"tanks": MountedTank, "engines": Engine, "wheels": Wheel, "appendages": Appendage}
OWN = ("controller", "craft", "cases")  # Keys of a project that are no arguments of `Craft.review`


@dataclass(frozen=True, eq=False, repr=False)
class Project:
    """A craft with its controller, cases, uncertainty and requirements, stored as a TOML file.

    Parameters
    ----------
    craft : Craft
        The craft.
    controller : array_like, LinearModel or system of python-control
        Linear controller, as for `Loop`.
    settings : mapping
        ``period`` (s) and further arguments of `Craft.review`, such as ``fills``, ``delay``,
        ``uncertain`` and ``requirements``.
    cases : mapping of mappings
        Cases by name. Each case is a mapping of the settings that differ from ``settings``; its key
        ``craft`` is a mapping of the values of the craft that differ from ``craft``.
    name : str
        Name of the design on the pages of reviews.
    controller_file : str, optional
        ``"FILE.py:NAME"``, the Python object that `save` writes as the controller. Without this
        name `save` writes the matrices of the controller.

    Examples
    --------
    >>> import numpy as np
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
    >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
    >>> gains = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
    >>> settings = {"period": 0.1, "fills": ["50%"], "draws": 0}
    >>> hubslosh.Project(craft, gains, settings).save("design.toml")
    >>> again = hubslosh.Project.read("design.toml")
    >>> again, hubslosh.margins(again.loop("50%")).stable
    (Project(design: Craft(900 kg dry, tanks: main)), True)
    >>> [review.passed for review in again.reviews().values()]
    [True]
    """

    craft: Craft
    controller: Any
    settings: Mapping[str, Any]
    cases: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    name: str = "design"
    controller_file: str | None = None

    @classmethod
    def read(cls, path: str | Path) -> "Project":
        """Read a project from a file; the Python file of its controller is run.

        Parameters
        ----------
        path : str or Path
            The file, .toml. Paths in the project file are relative to the folder of the project
            file.

        Returns
        -------
        Project
            The project. Its name is the name of the file without .toml.

        Raises
        ------
        FmuError
            If the file cannot be read, or a key or value is wrong.
        """
        path = Path(path)
        try:
            with path.open("rb") as file:
                given = tomllib.load(file)
        except OSError as error:
            raise FmuError(f"{path} cannot be read: {error}") from None
        except tomllib.TOMLDecodeError as error:
            raise FmuError(f"{path}: {error}") from None
        try:
            craft = _craft(_table(given, "craft"), path.parent)
            cases = _table(given, "cases", {})
            settings = {name: value for name, value in given.items() if name not in OWN}
            for of in (settings, *cases.values()):
                if isinstance(of, dict) and "fills" in of:
                    of["fills"] = _masses(of["fills"])
            for where, of in {"the project": settings, **_named("cases", cases)}.items():
                _check_names(Craft.review, of, where, {"self", "controller"})
            controller = _controller(given.get("controller"), path.parent)
            text = given.get("controller")
            file = str(path.parent.absolute() / text) if isinstance(text, str) else None
            found = cls(craft, controller, settings, cases, path.stem, file)
            found._each()
        except FmuError as error:
            raise FmuError(f"{path}: {error}") from None
        return found

    def save(self, path: str | Path) -> None:
        """Write the project as a file.

        Parameters
        ----------
        path : str or Path
            The file, .toml.

        Raises
        ------
        FmuError
            If the file cannot be written, or a project file cannot contain this kind of controller.
        """
        write_file(path, ".toml", lambda: self._text(Path(path).absolute().parent))

    def _text(self, folder: Path) -> str:
        given = {name: value for name, value in self.settings.items() if value is not None}
        top = {"controller": self._controller_text(folder), **given}
        craft = {
            of.name: getattr(self.craft, of.name)
            for of in fields(Craft)
            if of.init and of.name not in PARTS
        }
        parts = [toml_of(top), f"\n[craft]\n{toml_of(_set(Craft, craft))}"]
        for kind, of in PARTS.items():
            for name, one in getattr(self.craft, kind).items():
                values = _set(of, {f.name: getattr(one, f.name) for f in fields(of)})
                if "source" in values and not isinstance(values["source"], Mapping):
                    values["source"] = _relative(Path(values["source"]), folder)
                parts.append(f"\n[craft.{kind}.{toml_key(name)}]\n{toml_of(values)}")
        parts += [
            f"\n[cases.{toml_key(name)}]\n{toml_of(case)}" for name, case in self.cases.items()
        ]
        return "".join(parts)

    def _controller_text(self, folder: Path) -> Any:
        """Return the value of the key ``controller`` of a project file in ``folder``."""
        if self.controller_file is not None:
            file, _, name = self.controller_file.rpartition(":")
            return f"{_relative(Path(file), folder)}:{name}"
        law = self.controller
        if callable(law) and not hasattr(law, "dt"):
            raise FmuError(
                f"the controller {law!r} cannot be written to a project file: "
                'give controller_file="FILE.py:NAME"'
            )
        if hasattr(law, "dt"):  # a system of python-control
            law = _from_control(law)
        if isinstance(law, LinearModel):
            period = {} if law.period is None else {"period": law.period}
            return {name: getattr(law, name).tolist() for name in "ABCD"} | period
        return np.asarray(law, float).tolist()

    def _each(self) -> "dict[str, tuple[Craft, dict[str, Any]]]":
        """Return craft and settings of each case by name; a project without cases is one case."""
        if not self.cases:
            return {self.name: (self.craft, dict(self.settings))}
        found = {}
        for name, case in self.cases.items():
            changes = dict(_table(case, "craft", {}))
            allowed = {f.name for f in fields(Craft) if f.init} - set(PARTS)
            if wrong := [key for key in changes if key not in allowed]:
                names = ", ".join(sorted(allowed))
                raise FmuError(f"cases.{name}.craft has {', '.join(wrong)} (allowed: {names})")
            settings = {key: value for key, value in case.items() if key != "craft"}
            found[f"{self.name}, {name}"] = (
                replace(self.craft, **changes), dict(self.settings) | settings,
            )  # fmt: skip
        return found

    def loop(self, fill: Any) -> Loop:
        """Return the loop around the craft at a fill; see `Craft.loop`.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `Craft.fills`.

        Returns
        -------
        Loop
            The loop with the settings of the project; the settings of cases are ignored.
        """
        names = inspect.signature(Craft.loop).parameters
        options = {name: value for name, value in self.settings.items() if name in names}
        return self.craft.loop(self.controller, fill=fill, **options)

    def reviews(self) -> dict[str, Review]:
        """Return the design review of each case by its name; see `Craft.review`.

        Returns
        -------
        dict of Review
            Reviews by the names of the cases; without cases, one review by the project's name.

        Raises
        ------
        FmuError
            If a setting is wrong.
        """
        return {
            name: craft.review(self.controller, **settings)
            for name, (craft, settings) in self._each().items()
        }

    def __repr__(self) -> str:
        return f"Project({self.name}: {self.craft!r})"


def _set(of: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of ``values`` that a project file needs, as types that TOML knows.

    These are the fields of the dataclass ``of`` that differ from their defaults.
    """
    found = {}
    for item in fields(of):
        if item.name not in values:
            continue
        value = values[item.name]
        if isinstance(value, np.ndarray | np.generic):
            value = value.tolist()
        if not (value is None or (type(value) is type(item.default) and value == item.default)):
            found[item.name] = str(value) if isinstance(value, Path) else value
    return found


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path.absolute(), folder)).as_posix()
    except ValueError:  # on Windows, if the file is on another drive than the folder
        return str(path.absolute())


def _named(kind: str, tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables by full names: "slow" of the kind "cases" is "cases.slow".

    The key "craft" of each table is left out.
    """
    found = {}
    for name, of in tables.items():
        if not isinstance(of, Mapping):
            raise FmuError(f"{kind}.{name} must be a table, not {of!r}")
        found[f"{kind}.{name}"] = {key: value for key, value in of.items() if key != "craft"}
    return found


def _masses(fills: Any) -> Any:
    """Return ``fills`` with each mass, ``[120, "kg"]`` in TOML, as the pair ``(120, "kg")``."""
    if isinstance(fills, Mapping):
        return {name: _masses(fill) for name, fill in fills.items()}
    if isinstance(fills, list):
        return (*fills,) if fills[1:] == ["kg"] else [_masses(fill) for fill in fills]
    return fills


def _craft(given: Mapping[str, Any], folder: Path) -> Craft:
    parts: dict[str, Any] = {}
    for kind, of in PARTS.items():
        parts[kind] = {}
        for name, values in _table(given, kind, {}).items():
            if isinstance(values, Mapping) and isinstance(values.get("source"), str):
                values = {**values, "source": folder / values["source"]}
            parts[kind][name] = _call(of, values, f"craft.{kind}.{name}")
    return _call(Craft, {**given, **parts}, "craft")  # type: ignore[no-any-return]


_MISSING: dict[str, Any] = {}


def _table(of: Mapping[str, Any], name: str, default: dict[str, Any] = _MISSING) -> dict[str, Any]:
    found = of.get(name, None if default is _MISSING else default)
    if not isinstance(found, dict):
        wrong = f"must be a table, not {found!r}" if name in of else "is missing"
        raise FmuError(f"the table [{name}] {wrong}")
    return found


def _check_names(
    function: Callable[..., Any],
    given: Any,
    where: str,
    without: set[str] = frozenset(),  # type: ignore[assignment]
) -> None:
    """Raise FmuError if the table ``given`` has a key that is no argument of ``function``.

    ``where`` is the table's name in messages; arguments in ``without`` are not allowed.
    """
    if not isinstance(given, Mapping):
        raise FmuError(f"{where} must be a table, not {given!r}")
    allowed = [name for name in inspect.signature(function).parameters if name not in without]
    for name in given:
        if name not in allowed:
            hint = did_you_mean(name, allowed)
            raise FmuError(f"{where} has {name} (allowed: {', '.join(allowed)}){hint}")


def _call(function: Callable[..., Any], given: Any, where: str) -> Any:
    """Call ``function`` with the entries of the TOML table ``given`` as arguments.

    ``where`` is the table's name in error messages.
    """
    _check_names(function, given, where)
    parameters = inspect.signature(function).parameters
    missing = [name for name, p in parameters.items() if p.default is p.empty and name not in given]
    if missing:
        raise FmuError(f"{where} needs {', '.join(missing)}")
    return function(**given)


def _controller(given: Any, folder: Path) -> Any:
    if isinstance(given, Mapping):
        period = given.get("period")
        names = tuple("ABCD") if "A" in given else ("num", "den")
        if not {*names} <= set(given) <= {*names, "period"}:
            raise FmuError(
                "the table controller needs A, B, C and D, or num and den; in discrete time also "
                "period"
            )
        try:
            if "num" in given:
                return _from_transfer_functions(given["num"], given["den"], period)
            A, B, C, D = (np.atleast_2d(np.array(given[name], float)) for name in names)
        except (TypeError, ValueError) as error:
            raise FmuError(f"controller: {error}") from None
        return LinearModel(A, B, C, D, (), (), (), period)
    if given is None:
        raise FmuError("the project has no controller: give the key controller")
    if not isinstance(given, str):
        return given
    file, _, name = given.rpartition(":")
    if not file.endswith(".py") or not (folder / file).is_file():
        raise FmuError(f'controller = "{given}" must be "FILE.py:NAME" with a file that exists')
    found = runpy.run_path(str(folder / file)).get(name)
    if found is None:
        raise FmuError(f"{file} has no {name}")
    return found() if callable(found) and not hasattr(found, "dt") else found


def _from_transfer_functions(num: Any, den: Any, period: float | None) -> LinearModel:
    """Return a matrix of transfer functions as a state-space model.

    ``num`` and ``den`` have a row for each command and a column for each measurement; each entry is
    a list of coefficients, the highest power first. ``period`` is the sampling period, s, or None.
    """
    from scipy.linalg import block_diag
    from scipy.signal import tf2ss

    shape = [len(row) for row in num]
    if not shape or len(set(shape)) != 1 or shape != [len(row) for row in den]:
        raise FmuError(
            "controller: num and den must be matrices of polynomials, a row for each command and a "
            "column for each measurement, such as num = [[[1.0, 2.0]]]"
        )
    A, B, C, D = [], [], [], np.zeros((len(shape), shape[0]))
    for i, row in enumerate(zip(num, den, strict=True)):
        for j, polynomials in enumerate(zip(*row, strict=True)):
            a, b, c, d = tf2ss(*polynomials)
            A.append(a)
            B.append(b * (np.arange(D.shape[1]) == j))
            C.append(c * (np.arange(len(D)) == i)[:, None])
            D[i, j] = d[0, 0]
    return LinearModel(block_diag(*A), np.vstack(B), np.hstack(C), D, (), (), (), period)


def main() -> None:
    """Print the reviews of one or several projects and write their page (``hubslosh review``)."""
    parser = argparse.ArgumentParser(description="Reviews the control loop of a project file.")
    parser.add_argument("projects", type=Path, nargs="+", metavar="PROJECT", help=".toml")
    parser.add_argument("--out", type=Path, metavar="FILE", help="page to write, .html")
    arguments = parser.parse_args()
    first = arguments.projects[0]
    try:
        found: dict[str, Review] = {}
        for path in arguments.projects:
            new = Project.read(path).reviews()
            if twice := found.keys() & new:
                raise FmuError(f"two projects are named {', '.join(twice)}: rename a file")
            found |= new
        if len(found) == 1:
            (one,) = found.values()
            one.save(out := arguments.out or first.with_suffix(".html"))
            print(one)
        else:
            out = arguments.out or first.with_name("comparison.html")
            print(compare(found, out).to_string())
    except FmuError as error:
        sys.exit(f"error: {error}")
    print(out)
    if failing := [name for name, one in found.items() if not one.requirements()["passed"].all()]:
        sys.exit("error: " + "; ".join(f"{name}: {found[name].summary}" for name in failing))


if __name__ == "__main__":
    main()
