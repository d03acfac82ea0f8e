"""Tables as files for other programs: the table first, then the file, as pandas has it."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import temporary
from .fmu import FmuError
from .tables import write_table

if TYPE_CHECKING:
    import pandas as pd


def _checked(table: Any, path: Any, ending: str) -> Path:
    import pandas as pd

    if isinstance(table, str | os.PathLike):
        raise FmuError(f"the table comes first, then the file: (table, {str(table)!r})")
    if not isinstance(table, pd.DataFrame):
        raise FmuError(f"a pandas.DataFrame is expected, not {type(table).__name__}")
    if not isinstance(path, str | os.PathLike):
        raise FmuError(f"the file's name is expected, not {path!r}")
    path = Path(path)
    if path.suffix.lower() != ending:
        raise FmuError(f"{path}: the name must end in {ending}")
    return path


def _columns(table: "pd.DataFrame") -> dict[str, Any]:
    return {str(name): table[name].to_numpy() for name in table.columns}


@contextmanager
def _beside(path: Path) -> "Iterator[Path]":
    """Yield a file in the same folder that takes the place of ``path`` when all is written."""
    try:
        with temporary.folder(path.parent, ".hubslosh-") as folder:
            new = folder / path.name
            yield new
            new.replace(path)
    except OSError as error:
        raise FmuError(f"{path} cannot be written: {error}") from None


def to_csv(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a table as .csv, every digit; the file appears complete or not at all."""
    path = _checked(table, path, ".csv")
    with _beside(path) as new:
        table.to_csv(new, index=False)


def to_parquet(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a table as .parquet, its units in the metadata as ``unit:NAME``; needs pyarrow."""
    path = _checked(table, path, ".parquet")
    units = {f"unit:{name}": str(unit) for name, unit in table.attrs.get("units", {}).items()}
    write_table(path, _columns(table), units)


def to_mat(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a table as .mat for MATLAB and Octave: one column vector per column.

    Brackets and dots of names become underscores (``q[1]`` is ``q_1``); ``units`` is a struct of
    the units under the same names.
    """
    path = _checked(table, path, ".mat")
    from scipy.io import savemat

    names = {name: re.sub(r"\W+", "_", name).strip("_") for name in _columns(table)}
    twice = [name for name in names if list(names.values()).count(names[name]) > 1]
    if twice or any(not re.fullmatch(r"[A-Za-z]\w{0,62}", name) for name in names.values()):
        wrong = twice or [n for n, m in names.items() if not re.fullmatch(r"[A-Za-z]\w{0,62}", m)]
        raise FmuError(f"columns cannot be named apart in MATLAB: {', '.join(wrong)}")
    units = {names[n]: u for n, u in table.attrs.get("units", {}).items() if n in names}
    arrays = {names[name]: values for name, values in _columns(table).items()}
    with _beside(path) as new:
        savemat(new, arrays | ({"units": units} if units else {}), oned_as="column")
