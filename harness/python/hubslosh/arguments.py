"""Checks of arguments, with messages for wrong ones."""

import os
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuError, did_you_mean

# Allowed range of each argument that is a time, s.
SECONDS: dict[str, tuple[float, float]] = {
    "period": (1e-6, 1e6), "delay": (0.0, 1e6), "stop": (1e-9, 1e12),
}  # fmt: skip

# Allowed range of each argument that is a whole number.
WHOLE: Mapping[str, tuple[int, int]] = {
    "latency": (0, 1_000_000), "substeps": (1, 1_000_000), "draws": (0, 100_000),
    "runs": (1, 100_000_000), "run": (0, 100_000_000), "workers": (1, 4096),
    "seed": (0, 2**63 - 1), "most": (1, 1_000_000),
}  # fmt: skip

# Allowed range of each argument that is a number without unit.
PLAIN: dict[str, tuple[float, float]] = {"largest": (1e-3, 1e3), "sigmas": (1e-3, 1e2)}

MOST_FILLS = 1000  # Largest number of fills in a design review

# Largest number of states of a sampled loop gain, including delayed commands. The poles of a loop
# gain of this size take seconds.
MOST_STATES = 1000

# Largest product of the number of points of a design review and the squared number of states of its
# loop gain. A review of this size takes minutes on two cores.
MOST_WORK = 1e8


def caller() -> int:
    """Return the ``stacklevel`` with which `warnings.warn` names the line of the user's script.

    The level is the number of stack frames up to the first line outside this package.
    """
    folder, level = str(Path(__file__).parent), 1
    frame = sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith(folder):
        frame, level = frame.f_back, level + 1
    return level


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def refuse(problems: Sequence[str]) -> None:
    """Raise one FmuError that lists all problems, if there are any."""
    if problems:
        raise FmuError("; ".join(problems))


def is_number(value: Any) -> bool:
    """Return True for a real number of Python or NumPy, and False for a Boolean."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def out_of_range(**values: Any) -> list[str]:
    """Return a sentence for each argument that is outside its allowed range.

    The keyword is the argument's name, for example ``out_of_range(period=0.0)``. The tables
    `SECONDS`, `WHOLE` and `PLAIN` have the allowed range of each name.
    """
    found = []
    for name, value in values.items():
        if name in WHOLE:
            least, most = WHOLE[name]
            if not (is_number(value) and least <= value <= most and value == int(value)):
                found.append(f"{name} must be a whole number from {least} to {most}, not {value!r}")
            continue
        low, high = (SECONDS | PLAIN)[name]
        if not (is_number(value) and low <= value <= high):
            unit = " of seconds" if name in SECONDS else ""
            found.append(f"{name} must be a number{unit} from {low:g} to {high:g}, not {value!r}")
    return found


def check_ranges(**values: Any) -> None:
    """Raise FmuError if an argument is outside the range that `out_of_range` allows."""
    refuse(out_of_range(**values))


def floats(values: Any) -> NDArray[np.float64]:
    """Return values as an array of floats; arrays with masked values are refused.

    Raises FmuError if a value is masked, and TypeError or ValueError if a value is not a number.
    """
    parts = values if isinstance(values, list | tuple) else [values]
    for part in parts:
        if isinstance(part, np.ma.MaskedArray) and np.ma.getmaskarray(part).any():
            where = tuple(int(k) for k in np.argwhere(np.ma.getmaskarray(part))[0])
            raise FmuError(
                f"a masked array has no value at {', '.join(map(str, where)) or 'its place'}: fill "
                "the masked values (numpy.ma.filled) or remove them first"
            )
    return np.asarray(values, float)


def array(values: Any) -> NDArray[np.float64]:
    """Return values as an array of floats, which is empty if the values are not numbers.

    Raises FmuError if a value is masked.
    """
    try:
        return floats(values)
    except (TypeError, ValueError):
        return np.empty(0)


def names_of(names: Any, what: str, problems: list[str]) -> list[str]:
    """Return one name, or a sequence of names, as a list of names.

    If ``names`` is neither, a sentence about the argument ``what`` is appended to ``problems``.
    """
    if isinstance(names, str):
        return [names]
    try:
        listed = list(names)
    except TypeError:
        listed = [names]
    wrong = [name for name in listed if not isinstance(name, str)]
    if wrong:
        problems.append(f'{what} must be names of variables, such as ["omega"], not {names!r}')
        return []
    return listed


def not_numbers(**values: Any) -> list[str]:
    """Return one error sentence for each argument that is neither a number nor None."""
    return [
        f"{name} must be a number, not {value!r}"
        for name, value in values.items()
        if value is not None and not is_number(value)
    ]


def not_positive(name: str, value: Any, unit: str = "", *, finite: bool = True) -> list[str]:
    """Return one error sentence if a value is not a number above 0; otherwise none.

    ``unit`` is part of the sentence. ``finite`` is False for a limit that may be infinite.
    """
    if is_number(value) and value > 0 and not (finite and value == np.inf):
        return []
    return [f"{name} must be a number above 0{unit and ', ' + unit}, not {value!r}"]


def check_numbers(**values: Any) -> None:
    """Raise FmuError if an argument is neither a number nor None."""
    refuse(not_numbers(**values))


def wrong_parts(
    kind: str, given: Any, of: Any, reserved: re.Pattern[str] | None = None, example: str = ""
) -> list[str]:
    """Return one sentence for each problem of a craft's named parts, such as its engines.

    ``given`` should map names to objects of the class ``of``. ``reserved`` matches names that a
    part must not have. ``example`` is shown in the message about a value that is not a mapping.
    """
    if not isinstance(given, Mapping):
        return [f"{kind}s must be a dict of {of.__name__} by name{example}, not {given!r}"]
    found = []
    for name, part in given.items():
        if not isinstance(name, str) or not name:
            found.append(f"the name of each {kind} must be a text, not {name!r}")
        elif reserved and reserved.fullmatch(name):
            found.append(
                f"the {kind} cannot have the name {name!r}: parameters of the FMU begin with it"
            )
        if isinstance(part, of):
            found += [f"{kind} {name}: {problem}" for problem in part.problems()]
        else:
            article = "an" if of.__name__[0] in "AEIOU" else "a"
            found.append(f"{kind} {name} must be {article} {of.__name__}, not {part!r}")
    return found


def check_table(table: Any, what: str) -> None:
    """Raise FmuError if the argument ``table``, named ``what``, is not a pandas.DataFrame."""
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        advice = ""
        if isinstance(table, pd.Series):
            advice = f": give the whole table instead of its column {table.name!r}"
        raise FmuError(f"{what} must be a pandas.DataFrame, not {type(table).__name__}{advice}")


def not_columns(table: Any, names: Iterable[str], what: str) -> list[str]:
    """Return one error sentence if ``table`` does not have a column for each of ``names``.

    ``what`` is the name of the table in the sentence.
    """
    there = [str(name) for name in table.columns]
    missing = [f"{name}{did_you_mean(name, there)}" for name in names if name not in there]
    return [f"{what} has no column {', '.join(missing)}"] if missing else []


def check_columns(table: Any, names: Iterable[str], what: str) -> None:
    """Raise FmuError if an argument is not a pandas.DataFrame with columns of these names."""
    check_table(table, what)
    refuse(not_columns(table, names, what))


def numbers_in(table: Any, names: Sequence[str], what: str) -> list[NDArray[np.float64]]:
    """Return the columns ``names`` of ``table`` as arrays of finite numbers.

    Raises FmuError if a column is missing or has other values; ``what`` is the name of the table in
    the error message.
    """
    check_columns(table, names, what)
    problems: list[str] = []
    found = [column_of(table, name, what, problems) for name in names]
    refuse(problems)
    return found  # type: ignore[return-value]


def column_of(table: Any, name: Any, what: str, problems: list[str]) -> np.ndarray | None:
    """Return the column ``name`` of a table as finite numbers.

    If the column has other values, a sentence about the argument ``what`` is appended
    to ``problems``.
    """
    try:
        values = table[name].to_numpy(float)
    except (TypeError, ValueError) as error:
        problems.append(f"the column {name} of {what} is not of numbers: {error}")
        return None
    if len(bad := np.flatnonzero(~np.isfinite(values))):
        problems.append(f"the column {name} of {what} is not finite in row {bad[0]}")
    return values


def percent_of(text: Any) -> float | None:
    """Return 60.0 for the text "60%", and None for anything that is not a number with "%"."""
    if not isinstance(text, str) or not text.strip().endswith("%"):
        return None
    try:
        return float(text.strip()[:-1])
    except ValueError:
        return None


def parse_share(text: Any) -> float | None:
    """Return the number that a share such as "5%" or "± 5%" stands for, if it is above 0.

    Anything else, such as a number or a text without "%", gives None.
    """
    part = percent_of(text.strip().lstrip("±")) if isinstance(text, str) else None
    return part / 100 if part and 0 < part < np.inf else None


# Ranges that `range_ends` reads, for messages.
RANGES = '(low, high) with low < high, or a share of the nominal value such as "5%"'


def range_ends(given: Any, nominal: float) -> tuple[float, float]:
    """Return the ends of a range: (low, high), or a share such as "5%" of the nominal value.

    Raises ValueError if the range is neither. The message completes a sentence that begins with the
    name of the quantity.
    """
    if isinstance(given, str):
        if (part := parse_share(given)) is None:
            raise ValueError(f"cannot be {given!r} (allowed: {RANGES})")
        if nominal == 0:
            raise ValueError(f"is 0, so that {given} of it is no range: give (low, high)")
        half = part * abs(nominal)
        return float(nominal - half), float(nominal + half)
    try:
        low, high = (float(end) for end in given)
    except (TypeError, ValueError):
        low = high = np.nan
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"cannot be {given!r} (allowed: {RANGES})")
    return low, high


def not_vectors(of: Any, length: int, *names: str) -> list[str]:
    """Return one error sentence for each wrong attribute of the object ``of``.

    The attributes ``names`` must be vectors of ``length`` finite numbers.
    """
    found = []
    for name in names:
        try:
            vector(getattr(of, name), length, name)
        except FmuError as error:
            found.append(str(error))
    return found


def vector(values: Any, length: int, what: str) -> np.ndarray:
    """Return ``values`` as an array of ``length`` finite numbers, or raise FmuError.

    ``what`` is the name of the argument in the error message.
    """
    try:
        found = array(values)
    except FmuError as error:
        raise FmuError(f"{what}: {error}") from None
    if found.shape != (length,) or not np.isfinite(found).all():
        raise FmuError(f"{what} must be {length} finite numbers, not {values!r}")
    return found
