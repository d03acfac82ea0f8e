"""A run's table: pandas' own, with ``view()``."""

from pathlib import Path
from typing import Any

from .short import ShortTable
from .viewing import View, view


class Run(ShortTable):
    """Time histories of one run, as `simulate` and `closed_loop` return them.

    Everything that a pandas.DataFrame is: parts of it (``run[run["time"] < 1]``) are runs too, a
    column is a Series. A part without the columns that are drawn by is refused by `view`, by name.
    """

    def view(self, out: str | Path | None = None, **options: Any) -> View:
        """Show the run in 3-D, as `hubslosh.view` does: the same options."""
        return view(self, out, **options)
