"""A run's table: pandas' own, with ``view()``."""

from pathlib import Path
from typing import Any

from .short import ShortTable
from .viewing import View, view


class Noted(dict[str, Any]):
    """Values by name among a run's ``attrs``; each value, such as a number, is never changed.

    Pandas copies ``attrs`` with all that is in them for each part of a table. A copy of the
    dictionary itself is enough here, and takes a hundredth of the time.
    """

    def __deepcopy__(self, _memo: Any) -> "Noted":
        """Return a copy with the same values."""
        return Noted(self)


class Run(ShortTable):
    """Time histories of one run, as `simulate` and `closed_loop` return them.

    A Run is a pandas.DataFrame: a selection of its rows or columns (``run[run["time"] < 1]``) is
    also a Run, and one column is a Series. If columns that `view` needs are missing in a selection,
    `view` raises an error that names them.

    Examples
    --------
    >>> import hubslosh
    >>> run = hubslosh.simulate(stop=1.0, step=0.5, outputs="omega")
    >>> len(run), run.attrs["units"]
    (3, {'time': 's', 'omega': 'rad/s'})
    """

    @property
    def out_of_range(self) -> list[str]:
        """Sentences about the tanks that left the range of their model, one for each.

        Each sentence states the reasons, the share of the time and the first time at which the tank
        was out of range. The list is empty if the whole run stayed in range, or if the FMU has no
        variable that says so. A selection of a run has the sentences of the whole run.

        Examples
        --------
        >>> import hubslosh
        >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.5}, stop=1, step=0.1)
        >>> [text.split(":")[0] for text in run.out_of_range]
        ['out of range for 80.0 % of the time']
        """
        return list(self.attrs.get("out_of_range", []))

    def view(self, out: str | Path | None = None, **options: Any) -> View:
        """Show the run in 3-D, with plots that follow the time; see `hubslosh.view`.

        Parameters
        ----------
        out : str or Path, optional
            Also write the page to this .html file.
        **options
            ``model``, ``parameters``, ``tanks``, ``start``, ``stop`` and ``program``, as for
            `hubslosh.view`.

        Returns
        -------
        View
            The page; a notebook shows the page.

        Raises
        ------
        FmuError
            If the run lacks columns that are needed to draw it.

        Examples
        --------
        >>> import hubslosh
        >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
        >>> page = run.view("run.html")
        >>> page.path.name
        'run.html'
        """
        return view(self, out, **options)
