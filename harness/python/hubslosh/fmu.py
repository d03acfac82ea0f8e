"""A packed FMU, 2.0 or 3.0: where it is, what it says of itself, values in its variables' types."""

import difflib
import math
import threading
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree

from fmpy import extract, platform, platform_tuple, read_model_description
from fmpy.model_description import ModelDescription, ScalarVariable

from .fmi3 import KINDS
from .opening import DESCRIPTION, faults, is_file_name
from .temporary import until_the_end

PLATFORM = platform_tuple if platform_tuple == "aarch64-linux" else platform
"""Folder of the binaries for this platform, as the program ``hubslosh`` names it.

FMI 2.0's linux64 is for x86-64, but fmpy looks there on ARM too.
"""

Value = float | int | bool | str
"""A value in SI units, or with its unit, ``"50 mm"``; of an enumeration also an item's name."""

INTEGERS = range(-(2**31), 2**31)
"""Numbers that fmi2Integer has."""

Quantity = Value | tuple[float, str]
"""A value, or a number with its unit, such as ``(50, "mm")``."""


class DefinedUnit(str):
    """A unit's name with its definition by SI base units, as a file has it."""

    EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
    """Base units, by their names in FMI and SSP."""

    exponents: dict[str, int]
    factor: float
    offset: float

    def __new__(
        cls, name: str, exponents: dict[str, int], factor: float, offset: float
    ) -> "DefinedUnit":
        """Take a unit: a number in it is factor · number + offset in SI base units."""
        unit = super().__new__(cls, name)
        unit.exponents, unit.factor, unit.offset = exponents, factor, offset
        return unit

    def __getnewargs__(self) -> tuple[str, dict[str, int], float, float]:  # type: ignore[override]
        """Return what a copy is made from."""
        return str(self), self.exponents, self.factor, self.offset


class FmuError(Exception):
    """An error, with the FMU's own message if it has one."""


class FmuWarning(UserWarning):
    """A warning of an FMU, such as parameters beyond the known range of its model."""


def source_tree() -> Path | None:
    """Return the project's root if this package lies in its source tree."""
    root = Path(__file__).resolve().parents[3]
    return root if (root / "harness" / "python").is_dir() else None


def find(model: str | Path) -> Path:
    """Return the FMU of a model: a file ``….fmu``, or the name of one that is in this package."""
    if not isinstance(model, str | Path):
        raise FmuError(
            f'model must be the name of an FMU, such as "Spacecraft", or a file, not {model!r}'
        )
    if isinstance(model, Path) or model.endswith(".fmu"):
        path = Path(model)
        if not path.is_file():
            raise FmuError(f"there is no FMU at {path}; cargo run --release -- pack makes it")
        return path.resolve()
    folders = [Path(__file__).with_name("fmus")]
    if root := source_tree():
        folders.append(root / "dist")
    for folder in folders:
        path = folder / f"{model}.fmu"
        if path.is_file():
            return path
    names = sorted({path.stem for folder in folders for path in folder.glob("*.fmu")})
    raise FmuError(
        f'there is no FMU "{model}" here (there are: {", ".join(names) or "none"})'
        f"{did_you_mean(model, names)}; for another FMU give its file, ….fmu"
    )


def did_you_mean(wrong: str, names: Iterable[str]) -> str:
    """Return "; did you mean …?" with the most similar name, or nothing."""
    close = difflib.get_close_matches(str(wrong), list(names), n=1)
    return f"; did you mean {close[0]}?" if close else ""


class Fmu:
    """An FMU, unpacked when its binary is first wanted.

    `open` reads a file once per program, as long as it does not change.
    """

    _opened: ClassVar[dict[tuple[Path, int, int], "Fmu"]] = {}

    def __init__(self, path: Path) -> None:
        """Read modelDescription.xml."""
        self._unpacking = threading.Lock()
        self._directory: str | None = None
        self.path = path
        if why := next(faults(path), None):
            raise FmuError(f"{path} is not an FMU: {why}")
        try:
            self.description: ModelDescription = read_model_description(str(path))
        except Exception as error:  # fmpy has no class of its own for what is wrong with a file
            raise FmuError(f"{path} is not an FMU that fmpy can read: {error}") from None
        if self.description.fmiVersion not in ("2.0", "3.0"):
            version = self.description.fmiVersion
            raise FmuError(f"{path} is of FMI {version}; 2.0 or 3.0 is expected")
        self.is_fmi3 = self.description.fmiVersion == "3.0"
        """True for FMI 3.0."""
        self.intermediate: frozenset[str] = frozenset()
        """Names of the variables that take part in intermediate update."""
        if self.is_fmi3:
            self.intermediate, directional = _of_fmi3(path)
            if self.description.modelExchange is not None:
                # the name that fmpy has of FMI 2.0
                self.description.modelExchange.providesDirectionalDerivative = directional
        for interface in (self.description.coSimulation, self.description.modelExchange):
            if interface is not None and not is_file_name(interface.modelIdentifier):
                raise FmuError(
                    f"{path}: modelIdentifier {interface.modelIdentifier!r} leads out of its "
                    "folder (allowed: letters, digits, underscores)"
                )
        self.name: str = self.description.modelName
        self.variables: dict[str, ScalarVariable] = {
            v.name: v for v in self.description.modelVariables
        }
        self._units: dict[str, dict[str, Any]] = {
            unit.name: {shown.name: shown for shown in unit.displayUnits}
            for unit in self.description.unitDefinitions
        }
        self._bases = {unit.name: unit.baseUnit for unit in self.description.unitDefinitions}

    @classmethod
    def open(cls, model: str | Path) -> "Fmu":
        """Return the FMU of a model; see `find`."""
        path = find(model)
        stat = path.stat()
        key = (path, stat.st_mtime_ns, stat.st_size)
        if key not in cls._opened:
            cls._opened[key] = cls(path)
        return cls._opened[key]

    @property
    def directory(self) -> str:
        """Folder of the unpacked FMU, kept until the program ends."""
        with self._unpacking:
            if self._directory is None:
                try:
                    self._directory = str(extract(str(self.path), str(until_the_end())))
                except Exception as error:  # as in reading
                    raise FmuError(f"{self.path} cannot be unpacked: {error}") from None
            return self._directory

    def names(self, *causalities: str) -> list[str]:
        """Return the names of the variables with these causalities ("output", "local", …)."""
        return [v.name for v in self.variables.values() if v.causality in causalities]

    def variable(self, name: str) -> ScalarVariable:
        """Return a variable by its name."""
        if name not in self.variables:
            hint = did_you_mean(name, self.variables)
            raise FmuError(f"the FMU has no variable {name}{hint}")
        return self.variables[name]

    def kind(self, name: str) -> str:
        """Return a variable's type as FMI 2.0 calls it, or FMI 3.0 if 2.0 has none."""
        variable = self.variable(name)
        if variable.dimensions:
            return f"array of {variable.type}"
        return KINDS.get(variable.type, variable.type)

    def unit(self, name: str) -> str:
        """Return the unit in which a variable is exchanged; empty if it has none."""
        variable = self.variable(name)
        declared = variable.declaredType.unit if variable.declaredType else None
        return variable.unit or declared or ""

    def convert(self, name: str, value: Quantity) -> Value:
        """Return a value in the type and unit of a variable.

        Enumerations take an item's name or number, Booleans also the texts true and false, Reals
        also a number with its unit, ``(50, "mm")`` or ``"50 mm"``: the variable's own or one of its
        display units.
        """
        variable, kind = self.variable(name), self.kind(name)
        converters: dict[str, Callable[[Any], Value]] = {
            "Real": lambda v: self._real(name, v),
            "Integer": _integer,
            "Enumeration": lambda v: _item(variable, v),
            "Boolean": _boolean,
            "String": str,
        }
        try:
            if isinstance(value, tuple) and kind != "Real":
                raise ValueError(f"a value of type {kind} has no unit")
            if kind not in converters:
                raise ValueError(f"it is an {kind}" if " " in kind else f"it is of type {kind}")
            return converters[kind](value)
        except (TypeError, ValueError, OverflowError) as error:
            raise FmuError(f"{name} cannot be {value!r}: {error}") from None

    def _real(self, name: str, value: Quantity) -> float:
        if isinstance(value, str):
            value = _with_unit(value)
        if not isinstance(value, tuple):
            return _finite(value)
        if len(value) != 2:
            raise ValueError("a number and its unit are expected")
        factor, offset = self.scale(name, value[1])
        return _finite((float(value[0]) - offset) / factor)

    def scale(self, name: str, unit: str) -> tuple[float, float]:
        """Return (factor, offset) of a unit: a number in it is factor · value + offset."""
        base = self.unit(name)
        if isinstance(unit, DefinedUnit) and (known := self._bases.get(base)) is not None:
            exponents = {key: getattr(known, key) for key in DefinedUnit.EXPONENTS}
            if exponents != unit.exponents:
                raise ValueError(f"the unit {unit} of the file is no unit of its kind, {base}")
            return known.factor / unit.factor, (known.offset - unit.offset) / unit.factor
        if unit == base:
            return 1.0, 0.0
        shown = self._units.get(base, {})
        if unit not in shown:
            units = ", ".join(u for u in (base, *shown) if u)
            raise ValueError(f"it has no unit {unit} (units: {units or 'none'})")
        return float(shown[unit].factor), float(shown[unit].offset)


def _of_fmi3(path: Path) -> tuple[frozenset[str], bool]:
    """Return what fmpy does not read of an FMU 3.0.

    The names of the variables with ``intermediateUpdate``, and whether Model Exchange
    ``providesDirectionalDerivatives``.
    """
    true = ("true", "1")
    intermediate, directional = set(), False
    with zipfile.ZipFile(path) as archive, archive.open(DESCRIPTION) as file:
        for _, element in ElementTree.iterparse(file):
            if element.get("intermediateUpdate") in true:
                intermediate.add(element.attrib["name"])
            if element.tag == "ModelExchange":
                directional = element.get("providesDirectionalDerivatives") in true
    return frozenset(intermediate), directional


def _with_unit(text: str) -> Quantity:
    """Return the number and the unit of ``"50 mm"`` or ``"50mm"``; a text without unit as it is."""
    for end in range(len(text), 0, -1):
        try:
            number = float(text[:end])
        except ValueError:
            continue
        unit = text[end:].strip()
        return (number, unit) if unit else number
    return text


def _item(variable: ScalarVariable, value: Any) -> int:
    """Return the number of an enumeration's item."""
    items = {item.name: int(item.value) for item in variable.declaredType.items}
    if value in items:
        return items[value]
    try:
        return _integer(value)
    except ValueError:
        raise ValueError(f"there are {', '.join(items)}") from None


def _finite(value: Any) -> float:
    """Return a number that is neither NaN nor infinite."""
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("a finite number is expected")
    return number


def _integer(value: Any) -> int:
    """Return a whole number that FMI can hand over; C would wrap another one silently."""
    whole = int(value)
    if whole != float(value):
        raise ValueError("a whole number is expected")
    if whole not in INTEGERS:
        raise ValueError(f"whole numbers from {INTEGERS[0]} to {INTEGERS[-1]} are expected")
    return whole


def _boolean(value: Any) -> bool:
    """Return a truth value; texts are true or false."""
    if not isinstance(value, str):
        return bool(value)
    if value not in ("true", "false"):
        raise ValueError("there are true, false")
    return value == "true"
