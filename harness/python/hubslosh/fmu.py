"""An FMU file of FMI 2.0 or 3.0: its path, its variables, and conversion of values to their types.

A value is in SI units, or has a unit, such as ``"50 mm"``.
"""

import atexit
import difflib
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from .native import Fmu as _Fmu
from .native import FmuError, FmuWarning, Variable, source_tree
from .native import read_parameters as _read_parameters

__all__ = [
    "Fmu", "FmuError", "FmuWarning", "Parameters", "Quantity", "Value", "did_you_mean", "fmu_path",
    "read_parameters", "source_tree", "text_of",
]  # fmt: skip

# Value of a variable: in SI units, or a string with a unit, such as ``"50 mm"``. The value of an
# enumeration may also be the name of an item.
Value = float | int | bool | str

_INDICES = re.compile(r"\[\d+(,\d+)*\]$")  # Indices at the end of an element's name: "[1]", "[1,2]"

INTEGERS = range(-(2**31), 2**31)  # Range of fmi2Integer

Quantity = Value | tuple[float, str]  # A value, or a number with its unit, such as ``(50, "mm")``

# Values of variables by name, each a `Quantity`. The type is Any, because mypy infers
# ``dict[str, object]`` for a dict that mixes numbers and strings.
Parameters = Mapping[str, Any]


class DefinedUnit(str):
    """Unit that a parameter file defines: its name, and its conversion to SI base units."""

    base: tuple[Sequence[int], float, float]
    """Exponents of kg, m, s, A, K, mol, cd and rad; factor; offset. The value in SI base units is
    factor · (value in this unit) + offset."""

    def __new__(cls, name: str, base: tuple[Sequence[int], float, float]) -> "DefinedUnit":
        """Create a unit: SI value = factor · value + offset.

        ``base`` has the exponents of the SI base units, then factor and offset.
        """
        unit = super().__new__(cls, name)
        unit.base = base
        return unit

    def __getnewargs__(self) -> tuple[str, Any]:  # type: ignore[override]
        return str(self), self.base


def fmu_path(model: str | Path) -> Path:
    """Return the file of an FMU by its name, for other simulators and tools.

    This package contains ``HubSlosh``, ``SloshTank`` and ``Spacecraft``, each for FMI 2.0 and,
    with ``-fmi3`` at the end of its name, for FMI 3.0. In ``-fmi3-arrays`` each vector and matrix
    is one variable.

    Parameters
    ----------
    model : str or Path
        Name of an FMU of this package, or a file ``….fmu``.

    Returns
    -------
    Path
        The file; for a given file its absolute path.

    Raises
    ------
    FmuError
        If no such FMU exists; the message lists the FMUs that exist.

    Examples
    --------
    >>> import hubslosh
    >>> hubslosh.fmu_path("Spacecraft").name
    'Spacecraft.fmu'
    """
    if not isinstance(model, str | Path):
        raise FmuError(
            f'model must be the name of an FMU, such as "Spacecraft", or a file, not {model!r}'
        )
    if isinstance(model, Path) or model.endswith(".fmu"):
        path = Path(model)
        if not path.is_file():
            raise FmuError(f"there is no FMU at {path}; cargo run --release -- pack builds it")
        return path.resolve()
    folders = [Path(__file__).with_name("fmus")]
    if root := source_tree():
        folders.append(root / "dist")
    for folder in folders:
        path = folder / f"{model}.fmu"
        if path.is_file():
            return path
    names = sorted({path.stem for folder in folders for path in folder.glob("*.fmu")})
    there = f'there is no FMU "{model}" here (there are: {", ".join(names) or "none"})'
    if own := re.fullmatch(r"(HubSlosh|SloshTank|Spacecraft)(-fmi3)?(-arrays)?", model):
        raise FmuError(
            f"{there}; to build the FMU, run in the folder of the project's source, with Rust: "
            f"cargo run --release -- pack --model {own[1]}{' --fmi 3' if own[2] else ''}"
            f"{' --arrays' if own[3] else ''}"
        )
    raise FmuError(f"{there}{did_you_mean(model, names)}; for another FMU give its file, ….fmu")


def text_of(value: object) -> str:
    """Return a value as a string, with its unit if it has one, for command lines and files."""
    if isinstance(value, tuple):
        return "".join(map(str, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def did_you_mean(wrong: str, names: Iterable[str]) -> str:
    """Return "; did you mean …?" with the name most similar to ``wrong``, or an empty string.

    A name without its group, such as ``rho`` for ``fluid.rho``, counts as the most similar.
    """
    known = list(names)
    close = [name for name in known if name.rpartition(".")[2] == str(wrong)]
    close = close or difflib.get_close_matches(str(wrong), known, n=1)
    return f"; did you mean {close[0]}?" if close else ""


class Fmu:
    """An FMU: its file and its variables.

    Create an Fmu by `open`, which reads a file again only if it has changed. The archive is
    unpacked when the first instance is created; the unpacked files are removed when Python ends.

    Parameters
    ----------
    path : Path
        File of an FMU 2.0 or 3.0.

    Attributes
    ----------
    path : Path
        The file.
    native : object
        The FMU in the compiled half of this package.
    is_fmi3 : bool
        True for FMI 3.0.
    name : str
        ``modelName`` of the FMU.
    variables : dict
        Variables by name, in the order of modelDescription.xml.

    Raises
    ------
    FmuError
        If the file is no FMU that can be read.

    Examples
    --------
    >>> import hubslosh
    >>> fmu = hubslosh.Fmu.open("HubSlosh")
    >>> fmu.name, fmu.is_fmi3, len(fmu.names("input"))
    ('HubSlosh', False, 3)
    """

    _opened: ClassVar[dict[tuple[Path, int, int], "Fmu"]] = {}

    def __init__(self, path: Path) -> None:
        self.path = path
        """The file."""
        self.native = _Fmu(path)
        """The FMU in the compiled half of this package."""
        self.is_fmi3: bool = self.native.is_fmi3
        """True for FMI 3.0."""
        self.name: str = self.native.name
        """``modelName`` of the FMU."""
        self.variables: dict[str, Variable] = {v.name: v for v in self.native.variables}
        """Variables by name, in the order of modelDescription.xml."""
        atexit.register(self.native.close)

    def __repr__(self) -> str:
        return f"Fmu {self.name}: {len(self.variables)} variables, {self.path}"

    @classmethod
    def open(cls, model: str | Path) -> "Fmu":
        """Return an FMU by its name or file; the file is read again only if it has changed.

        Parameters
        ----------
        model : str or Path
            Name or file of the FMU, as for `fmu_path`.

        Returns
        -------
        Fmu
            The FMU.

        Raises
        ------
        FmuError
            If no such FMU exists, or it cannot be read.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("SloshTank").names("input")[:3]
        ['a[1]', 'a[2]', 'a[3]']
        """
        path = fmu_path(model)
        stat = path.stat()
        key = (path, stat.st_mtime_ns, stat.st_size)
        if key not in cls._opened:
            cls._opened[key] = cls(path)
        return cls._opened[key]

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with one of these causalities.

        Parameters
        ----------
        *causalities : str
            Causalities of FMI: "parameter", "input", "output", "local", ….

        Returns
        -------
        list of str
            Names, in the order of modelDescription.xml.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("HubSlosh").names("input")
        ['tau_cmd', 'tau_ext', 'g_axial']
        """
        if causalities not in self._by_causality:
            self._by_causality[causalities] = [
                v.name for v in self.variables.values() if v.causality in causalities
            ]
        return self._by_causality[causalities].copy()

    def components(self, names: Iterable[str]) -> list[str]:
        """Replace the names of vectors and matrices by the names of their elements.

        Parameters
        ----------
        names : iterable of str
            Names of variables, or of vectors and matrices without their brackets.

        Returns
        -------
        list of str
            The name of each vector or matrix is replaced by one name for each element, a matrix row
            by row. Other names are unchanged.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("Spacecraft").components(["omega", "mass"])
        ['omega[1]', 'omega[2]', 'omega[3]', 'mass']
        """
        parts: list[str] = []
        for name in names:
            parts += [name] if name in self.variables else self._elements.get(name, [name])
        return parts

    @cached_property
    def _by_causality(self) -> dict[tuple[str, ...], list[str]]:
        """Cache of the results of `names`, by its arguments."""
        return {}

    @cached_property
    def by_reference(self) -> dict[int, Variable]:
        """First variable of each value reference."""
        return {v.reference: v for v in reversed(self.variables.values())}

    @cached_property
    def _elements(self) -> dict[str, list[str]]:
        """Names of the elements of each vector and matrix."""
        found: dict[str, list[str]] = {}
        for name in self.variables:
            if end := _INDICES.search(name):
                found.setdefault(name[: end.start()], []).append(name)
        return found

    def variable(self, name: str) -> Variable:
        """Return a variable by its name.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        Variable
            An object with ``name``, ``reference``, ``kind``, ``causality``, ``variability``,
            ``unit``, ``start`` and other attributes.

        Raises
        ------
        FmuError
            If the FMU has no such variable; the message suggests a similar name.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("HubSlosh").variable("tank.h").causality
        'parameter'
        """
        if name not in self.variables:
            hint = did_you_mean(name, self.variables)
            raise FmuError(f"the FMU has no variable {name}{hint}")
        return self.variables[name]

    def kind(self, name: str) -> str:
        """Return the type of a variable.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        str
            "Real", "Integer", "Boolean", "String" or "Enumeration".

        Raises
        ------
        FmuError
            If the FMU has no such variable.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("HubSlosh").kind("slosh.model")
        'Enumeration'
        """
        return self.variable(name).kind

    def unit(self, name: str) -> str:
        """Return the unit in which a variable is exchanged with the FMU.

        Parameters
        ----------
        name : str
            Name of the variable.

        Returns
        -------
        str
            The unit's name in the FMU, such as "N.m"; empty if the variable has no unit.

        Raises
        ------
        FmuError
            If the FMU has no such variable.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("HubSlosh").unit("tau_cmd")
        'N.m'
        """
        return self.variable(name).unit

    def convert(self, name: str, value: Quantity) -> Value:
        """Return a value in the type and the unit of a variable, as the FMU receives it.

        Parameters
        ----------
        name : str
            Name of the variable.
        value : float, int, bool, str or tuple
            For a Real: a number in the variable's own unit, or a number with a unit, ``(50, "mm")``
            or ``"50 mm"``, which must be the variable's own unit or one of its display units. For
            an Enumeration an item's name or number. For a Boolean also the texts "true" and
            "false".

        Returns
        -------
        float, int, bool or str
            The value as the FMU receives it.

        Raises
        ------
        FmuError
            If the FMU has no such variable, or the value cannot be converted to its type.

        Examples
        --------
        >>> import hubslosh
        >>> fmu = hubslosh.Fmu.open("HubSlosh")
        >>> fmu.convert("tank.h", "50 mm"), fmu.convert("slosh.model", "spherical")
        (0.05, 4)
        """
        self.variable(name)
        number, unit = value if isinstance(value, tuple) and len(value) == 2 else (value, None)
        try:
            return self.native.convert(name, number, unit, getattr(unit, "base", None))
        except TypeError:
            raise FmuError(
                f"{name} cannot be {value!r} (allowed: a number, a Boolean, a text, or a number "
                "with its unit)"
            ) from None

    def scale(self, name: str, unit: str) -> tuple[float, float]:
        """Return the factor and the offset that convert a variable's values to another unit.

        A value in this unit is factor · (value in the variable's own unit) + offset.

        Parameters
        ----------
        name : str
            Name of the variable.
        unit : str
            The variable's own unit, or one of its display units.

        Returns
        -------
        tuple of float
            Factor and offset.

        Raises
        ------
        FmuError
            If the FMU has no such variable.
        ValueError
            If the variable has no such unit.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Fmu.open("HubSlosh").scale("tank.h", "mm")
        (1000.0, 0.0)
        """
        variable = self.variable(name)
        base = variable.unit
        if unit == base:
            return 1.0, 0.0
        shown = {name: scale for name, *scale in variable.shown}
        if unit not in shown:
            units = ", ".join(u for u in (base, *shown) if u)
            raise ValueError(f"the variable has no unit {unit} (units: {units or 'none'})")
        factor, offset = shown[unit]
        return factor, offset


def read_parameters(path: str | Path) -> dict[str, Quantity]:
    r"""Read a file of parameters: .toml, .ssv or .json.

    A .toml file has lines ``"name" = value``; nested tables give names with dots. An .ssv file is a
    parameter set of SSP 1.0. A .json file is a result of ``hubslosh identify --out``. ``hubslosh
    tank --parameters`` writes the first two kinds.

    Parameters
    ----------
    path : str or Path
        The file. The format follows from the extension of its name.

    Returns
    -------
    dict
        Values by name, for `simulate` and `Loop`. A parameter of a .ssv with a unit is a pair
        (number, unit), where the unit is defined by the file, or else by the FMU. `Fmu.convert`
        converts or refuses the value.

    Raises
    ------
    FmuError
        If the file cannot be read, or is not a file of parameters.

    Examples
    --------
    >>> from pathlib import Path
    >>> import hubslosh
    >>> _ = Path("bench.toml").write_text('tank.h = 0.05\n"slosh.model" = "spherical"\n')
    >>> hubslosh.read_parameters("bench.toml")
    {'tank.h': 0.05, 'slosh.model': 'spherical'}
    """
    if not isinstance(path, str | Path):
        raise FmuError(f"the file of parameters must be a path, not {path!r}")
    found, texts = _read_parameters(Path(path))
    for text in texts:
        warnings.warn(f"{path}: {text}", FmuWarning, stacklevel=2)
    parameters: dict[str, Quantity] = {}
    for name, value, unit, base in found:
        if unit is None or isinstance(value, str):
            parameters[name] = value
        else:
            parameters[name] = value, DefinedUnit(unit, base) if base else unit
    return parameters
