"""Display of runs: the page of ``hubslosh view`` in a notebook or a browser."""

import html
import os
import tempfile
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import temporary
from .arguments import check_table
from .command import call, find_program, settings_flags
from .fmu import DefinedUnit, Fmu, FmuError, Parameters, fmu_path
from .tanks import _tank_source, toml_of

if TYPE_CHECKING:
    import pandas as pd

Source = str | Path | Mapping[str, Any]  # A tank file, or a dict with its content

HEIGHT = 760  # Height of the page in a notebook, px


@dataclass(frozen=True)
class View:
    """A page that shows a run in 3-D, as `view` returns it.

    A notebook shows the page if it is the value of a cell.

    Attributes
    ----------
    html : str
        The page, which refers to no other files, so that it can be shown without a network.
    path : Path or None
        File of the page, if `view` was given ``out``.

    Examples
    --------
    >>> import hubslosh
    >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
    >>> page = hubslosh.view(run, "run.html")
    >>> page.path.name
    'run.html'
    """

    html: str = field(repr=False)
    path: Path | None = None

    def _repr_html_(self) -> str:
        """Return the page in an HTML frame, which notebooks show."""
        return (
            f'<iframe title="A run of an FMU" style="width:100%;height:{HEIGHT}px;border:0" '
            f'srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def open(self) -> None:
        """Show the page in the web browser.

        If the page has no file, it is written to a temporary file first.

        Examples
        --------
        >>> import hubslosh
        >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
        >>> hubslosh.view(run).open()  # doctest: +SKIP
        """
        path = self.path
        if path is None:
            handle, name = tempfile.mkstemp(prefix="hubslosh-", suffix=".html")
            os.close(handle)
            path = Path(name)
            path.write_text(self.html, encoding="utf-8")
        webbrowser.open(path.absolute().as_uri())


def view(
    run: "pd.DataFrame | str | Path",
    out: str | Path | None = None,
    *,
    model: str | Path | None = None,
    parameters: Parameters | None = None,
    tanks: Sequence[Source] | Mapping[int, Source] = (),
    start: float | None = None,
    stop: float | None = None,
    program: str | Path | None = None,
) -> View:
    """Show a run: bench or spacecraft in 3-D with its liquid, and plots that follow the time.

    The page draws the columns of the run; nothing is simulated. A run of HubSlosh needs ``theta``
    or ``omega``, ``slosh_angle`` and ``slosh_angle_radial``; its second and later modes are drawn
    if the run has ``slosh.q_radial[n]`` and ``slosh.q_tangential[n]``. A run of Spacecraft needs
    ``q[1]`` to ``q[4]``, for each tank the slosh angles or the directions ``p`` of the pendulums,
    and for each draining tank also ``liquid``. `simulate` and `closed_loop` record these columns by
    default.

    Parameters
    ----------
    run : DataFrame, str or Path
        Table of a run, as `simulate` and `closed_loop` return it, or a file of ``hubslosh run``.
    out : str or Path, optional
        Also write the page to this .html file.
    model : str or Path, optional
        FMU of the run; by default the FMU that ``.attrs`` of the table or the file names.
    parameters : mapping, optional
        Parameters of the run in addition to the parameters in ``.attrs`` of the table or in the
        file.
    tanks : sequence or mapping
        Tank files with the contours to draw, or dicts with their content, as for `tank`, in the
        order of the tanks, or by the number of the tank from 1.
    start, stop : float, optional
        First and last time to show, s.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    View
        The page; a notebook shows it.

    Raises
    ------
    FmuError
        If columns are missing, which the message names, or a file cannot be read or written.

    Examples
    --------
    >>> import hubslosh
    >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
    >>> page = hubslosh.view(run, stop=1.0)
    >>> len(page.html) > 100_000
    True
    """
    path = find_program(program)
    if out is not None and Path(out).suffix != ".html":
        raise FmuError(f"{out}: the name must end in .html")
    numbered = tanks if isinstance(tanks, Mapping) else dict(enumerate(tanks, 1))
    with temporary.folder() as folder:
        if isinstance(run, str | os.PathLike):
            file, known = Path(run), {}
        else:
            check_table(run, "what is shown")
            file = Path(folder) / f"{Path(out).stem if out else 'run'}.csv"
            run.to_csv(file, index=False)
            model = model or run.attrs.get("model")
            known = run.attrs.get("parameters", {})
        page = Path(out) if out is not None else Path(folder) / "run.html"
        arguments: list[str | Path] = [file, "--out", page]
        arguments += ["--fmu", fmu_path(model)] if model is not None else []
        for name, value in {**known, **(parameters or {})}.items():
            if isinstance(value, tuple) and isinstance(value[-1], DefinedUnit):
                value = Fmu.open(model or "HubSlosh").convert(name, value)
            arguments += settings_flags({name: value})
        names = {} if isinstance(run, str | os.PathLike) else {str(file): "the run"}
        for number, source in numbered.items():
            drawn = _tank_source(source)
            if isinstance(drawn, dict):
                path_of_tank = Path(folder) / f"tank{number}.toml"
                path_of_tank.write_text(toml_of(drawn), encoding="utf-8")
                names[str(path_of_tank)] = f"tank {number}"
                drawn = path_of_tank
            arguments += ["--tank", f"{number}:{drawn}"]
        arguments += [] if start is None else ["--from", str(start)]
        arguments += [] if stop is None else ["--to", str(stop)]
        call(path, "view", arguments, names=names)
        return View(page.read_text(encoding="utf-8"), None if out is None else Path(out))
