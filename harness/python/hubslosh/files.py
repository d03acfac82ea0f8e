"""Writing of tables and models to files for other programs."""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from . import temporary
from .arguments import check_table
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

    from .linearization import LinearModel


@runtime_checkable
class AsDict(Protocol):
    """A model that returns its content by name, such as an `UncertainModel`."""

    def as_dict(self) -> dict[str, Any]:
        """Return the content of the model by name: numbers, arrays, names and texts."""


def _check_table(table: Any, path: Any, ending: str) -> Path:
    if isinstance(table, str | os.PathLike):
        raise FmuError(
            "the arguments are exchanged: give the table first, then the file: "
            f"(table, {str(table)!r})"
        )
    check_table(table, "the table")
    return temporary.check_path(path, ending)


def _columns(table: "pd.DataFrame") -> dict[str, Any]:
    return {str(name): table[name].to_numpy() for name in table.columns}


def to_csv(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a table as .csv, with all digits of each number.

    The file is complete or, if writing fails, does not exist.

    Parameters
    ----------
    table : DataFrame
        The table, for example the result of `simulate`.
    path : str or Path
        File whose name ends in .csv.

    Raises
    ------
    FmuError
        If the arguments are exchanged, the name has another ending, or the file cannot be
        written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import hubslosh
    >>> run = hubslosh.simulate(stop=1, step=0.5, outputs="omega")
    >>> hubslosh.to_csv(run, "run.csv")
    >>> Path("run.csv").read_text().splitlines()[:2]
    ['time,omega', '0.0,0.0']
    """
    path = _check_table(table, path, ".csv")
    with temporary.output(path) as new:
        table.to_csv(new, index=False)


def to_parquet(table: "pd.DataFrame", path: str | Path) -> None:
    """Write a table as .parquet; needs pyarrow.

    Units are in the file's metadata as ``unit:NAME``. The file is complete or, if writing fails,
    does not exist.

    Parameters
    ----------
    table : DataFrame
        The table, for example the result of `simulate`.
    path : str or Path
        File whose name ends in .parquet.

    Raises
    ------
    FmuError
        If the arguments are exchanged, the name has another ending, or the file cannot be
        written.

    Examples
    --------
    >>> import pandas as pd
    >>> import hubslosh
    >>> run = hubslosh.simulate(stop=1, step=0.5, outputs="omega")
    >>> hubslosh.to_parquet(run, "run.parquet")
    >>> pd.read_parquet("run.parquet")["time"].tolist()
    [0.0, 0.5, 1.0]
    """
    import pyarrow.parquet

    path = _check_table(table, path, ".parquet")
    units = {f"unit:{name}": str(unit) for name, unit in table.attrs.get("units", {}).items()}
    columns = pyarrow.table(_columns(table)).replace_schema_metadata(units)
    with temporary.output(path) as new:
        pyarrow.parquet.write_table(columns, new, compression="zstd")


def to_mat(
    table: "pd.DataFrame | LinearModel | Sequence[LinearModel] | AsDict | Mapping",
    path: str | Path,
) -> None:
    """Write a table or a model as .mat (version 5) for MATLAB and Octave.

    * A table: one column vector for each column, and ``units``, a struct of the units.
    * Parameters by name, as `Craft.parameters` returns them: a variable for each.
    * A `LinearModel`: ``A``, ``B``, ``C``, ``D``, the names ``states``, ``inputs`` and
      ``outputs``, and ``period`` (s; 0: continuous time).
    * A family: several models in a sequence, or by name, which MATLAB's ``ss`` takes as an
      array. Each matrix has a third dimension; ``points`` are the names.
    * An `UncertainModel`: see `UncertainModel.as_dict`.

    Brackets, commas and dots of names become underscores, so ``q[1]`` is ``q_1``.

    Parameters
    ----------
    table : DataFrame, mapping, LinearModel, sequence of LinearModel, or UncertainModel
        The table, the parameters or the models.
    path : str or Path
        File whose name ends in .mat.

    Raises
    ------
    FmuError
        If the arguments are exchanged, the name has another ending, two names become the same,
        or the file cannot be written.

    Examples
    --------
    >>> from scipy.io import loadmat
    >>> import hubslosh
    >>> model = hubslosh.linearize(parameters={"friction.model": "viscous"})
    >>> hubslosh.to_mat(model, "bench.mat")
    >>> loadmat("bench.mat")["A"].shape == model.A.shape
    True
    """
    from .linearization import LinearModel

    models: list[Any] = []
    if isinstance(table, LinearModel):
        models = [table]
    elif isinstance(table, Mapping | list | tuple):
        models = [*(table.values() if isinstance(table, Mapping) else table)]
    if models and all(isinstance(model, LinearModel) for model in models):
        names = {"points": [*map(str, table)]} if isinstance(table, Mapping) else {}
        arrays = _family(models) | names
    elif isinstance(table, AsDict):
        arrays = table.as_dict()
    elif isinstance(table, Mapping):
        values = {name: of[0] if isinstance(of, tuple) else of for name, of in table.items()}
        units = {name: of[1] for name, of in table.items() if isinstance(of, tuple)}
        arrays = _distinct_names(values, units)
    else:
        path = _check_table(table, path, ".mat")
        arrays = _distinct_names(_columns(table), table.attrs.get("units", {}))
    from scipy.io import savemat

    with temporary.output(temporary.check_path(path, ".mat")) as new:
        savemat(new, _in_mat(arrays), oned_as="column", do_compression=False)


def _distinct_names(values: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    """Return ``values`` and their ``units`` under variable names that MATLAB allows.

    For example, "q[1]" becomes "q_1". Raises FmuError if two names would become equal.
    """
    names = {name: re.sub(r"\W+", "_", name).strip("_") for name in values}
    twice = [name for name in names if list(names.values()).count(names[name]) > 1]
    if twice or any(not re.fullmatch(r"[A-Za-z]\w{0,62}", name) for name in names.values()):
        wrong = twice or [n for n, m in names.items() if not re.fullmatch(r"[A-Za-z]\w{0,62}", m)]
        raise FmuError(f"these columns would have the same name in MATLAB: {', '.join(wrong)}")
    units = {names[n]: u for n, u in units.items() if n in names}
    arrays = {names[name]: of for name, of in values.items()}
    return arrays | ({"units": units} if units else {})


def _family(models: "Sequence[LinearModel]") -> dict[str, Any]:
    """Return linear models as arrays (row, column, model) for a .mat file.

    The models must have the same states, inputs, outputs and period. The arrays of one model are
    matrices.
    """
    import numpy as np

    first = models[0]
    same = ("states", "inputs", "outputs", "period")
    for model in models:
        if wrong := [name for name in same if getattr(model, name) != getattr(first, name)]:
            raise FmuError(f"all models of a family must have the same {', '.join(wrong)}")
    matrices = {name: np.stack([getattr(model, name) for model in models], axis=-1)
                for name in "ABCD"}  # fmt: skip
    if len(models) == 1:
        matrices = {name: matrix[..., 0] for name, matrix in matrices.items()}
    names = {name: list(getattr(first, name)) for name in ("states", "inputs", "outputs")}
    return matrices | names | {"period": float(first.period or 0.0)}


def _in_mat(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``values`` for SciPy's writer of .mat files: lists of strings become cell arrays."""
    import numpy as np

    return {
        key: np.array(of, object) if isinstance(of, list) and of and isinstance(of[0], str) else of
        for key, of in values.items()
    }
