"""Checks of arguments, with messages for wrong ones."""

from typing import Any

import numpy as np

from .fmu import FmuError


def names_of(names: Any, what: str, problems: list[str]) -> list[str]:
    """Return names of variables as a list, a single one too; what is wrong goes to ``problems``."""
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
    """Return which arguments are neither numbers nor None."""
    kinds = (int, float, np.integer, np.floating)
    return [
        f"{name} must be a number, not {value!r}"
        for name, value in values.items()
        if value is not None and not isinstance(value, kinds)
    ]


def check_numbers(**values: Any) -> None:
    """Raise FmuError if an argument is neither a number nor None."""
    if wrong := not_numbers(**values):
        raise FmuError("; ".join(wrong))


def check_table(table: Any, what: str) -> None:
    """Raise FmuError if an argument is not a pandas.DataFrame."""
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        raise FmuError(f"{what} must be a pandas.DataFrame, not {table!r}")


def column_of(table: Any, name: Any, what: str, problems: list[str]) -> np.ndarray | None:
    """Return a column of finite numbers; what is wrong goes to ``problems``."""
    try:
        values = table[name].to_numpy(float)
    except (TypeError, ValueError) as error:
        problems.append(f"the column {name} of {what} is not of numbers: {error}")
        return None
    if len(bad := np.flatnonzero(~np.isfinite(values))):
        problems.append(f"the column {name} of {what} is not finite in row {bad[0]}")
    return values


def vector(values: Any, length: int, what: str) -> np.ndarray:
    """Return so many finite numbers as an array."""
    try:
        found = np.asarray(values, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (length,) or not np.isfinite(found).all():
        raise FmuError(f"{what} must be {length} finite numbers, not {values!r}")
    return found
