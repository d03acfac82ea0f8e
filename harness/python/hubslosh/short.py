"""Short texts for ``print``, of at most 20 lines."""

from collections.abc import Sequence
from typing import Any

import pandas as pd

MOST = 10  # Rows of a table that are printed


class ShortTable(pd.DataFrame):
    """A pandas.DataFrame of which ``print`` shows at most ten rows and eight columns."""

    @property
    def _constructor(self) -> Any:
        """Return the class of selections of the table, so that pandas keeps this class."""
        return type(self)

    def __repr__(self) -> str:
        options: list[Any] = ["display.max_rows", MOST, "display.min_rows", MOST]
        options += ["display.max_columns", 8, "display.expand_frame_repr", False]
        with pd.option_context(*options):
            return super().__repr__()


def rows(table: pd.DataFrame, most: int = MOST) -> str:
    """Return the first rows of a table as text, and the number of rows that are left out."""
    text = table.head(most).to_string(index=False, na_rep="", float_format=lambda x: f"{x:.4g}")
    left = len(table) - most
    return f"{text}\nand {left} more" if left > 0 else text


def names(of: Sequence[str], most: int = 6) -> str:
    """Return names separated by commas; of many names, the first ones and the total number."""
    left = len(of) - most
    return ", ".join(of[:most]) + (f" and {left} more" if left > 0 else "")
