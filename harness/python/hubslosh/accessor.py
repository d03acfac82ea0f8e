"""What a run's table can do itself: ``run.hubslosh.view()``.

pandas lets a package add a name to its tables. A subclass of DataFrame would read ``run.view()``,
but pandas gives it up in many operations, or keeps it where the table is no run any more; the name
is there for every table, also for one that was read from a file.
"""

from pathlib import Path
from typing import Any

import pandas as pd

from .viewing import View, view


@pd.api.extensions.register_dataframe_accessor("hubslosh")
class Run:
    """A run's table, as ``simulate`` and ``closed_loop`` return it."""

    def __init__(self, table: pd.DataFrame) -> None:
        """Take the table."""
        self._table = table

    def view(self, out: str | Path | None = None, **options: Any) -> View:
        """Show the run in 3-D, as `hubslosh.view` does: the same options."""
        return view(self._table, out, **options)
