"""Table of a run: a pandas.DataFrame with ``view()`` and ``out_of_range``."""

from pathlib import Path
from typing import Any

from .short import ShortTable
from .viewing import View, view


class Noted(dict[str, Any]):
    """Dictionary in the ``attrs`` of a run, whose values are never changed.

    Pandas makes a deep copy of ``attrs`` for each selection of a table. Because the values never
    change, a shallow copy is enough; it takes a hundredth of the time.
    """

    def __deepcopy__(self, _memo: Any) -> "Noted":
        """Return a shallow copy."""
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
        """One sentence for each tank that left the range of its model.

        The sentence states why, for which share of the time, and when for the first time. The list
        is empty if all tanks stayed in range, or if the FMU has no variable for this. A selection
        of a run has the sentences of the whole run.

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
