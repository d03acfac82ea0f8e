"""Shows runs: the page of ``hubslosh view``, in a notebook or a browser."""

import html
import os
import tempfile
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from . import temporary
from .arguments import check_table
from .command import call, find_program
from .fmu import DefinedUnit, Fmu, FmuError, Quantity, fmu_path

if TYPE_CHECKING:
    import pandas as pd

HEIGHT = 760
"""Height of the page in a notebook, px."""


@dataclass(frozen=True)
class View:
    """A page that shows a run; a notebook shows it below the cell that it is the value of."""

    html: str = field(repr=False)
    """The page: it needs nothing else, no network either."""
    path: Path | None = None
    """Path of the page, if ``out`` was given."""

    def _repr_html_(self) -> str:
        """Return it in a frame of its own, which IPython shows."""
        return (
            f'<iframe title="A run of an FMU" style="width:100%;height:{HEIGHT}px;border:0" '
            f'srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def open(self) -> None:
        """Show it in the web browser."""
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
    parameters: Mapping[str, Quantity] | None = None,
    tanks: Sequence[str | Path] | Mapping[int, str | Path] = (),
    start: float | None = None,
    stop: float | None = None,
    program: str | Path | None = None,
) -> View:
    """Show a run: bench or spacecraft in 3-D with its liquid, and plots that follow the time.

    * ``run``: A table, as ``simulate`` and ``closed_loop`` return it, or a file of ``hubslosh
      run``.
    * ``out``: Also write the page to this .html file.
    * ``model``, ``parameters``: FMU and parameters of the run; by default those in the table's
      ``.attrs`` or in the file.
    * ``tanks``: Files of tanks (the format of ``hubslosh tank``) to draw them by, in their order or
      by number from 1.
    * ``start``, ``stop``: Ends of the part to show, s.

    Nothing is simulated. The table of HubSlosh needs ``theta`` or ``omega``, ``slosh_angle`` and
    ``slosh_angle_radial``; that of Spacecraft ``q[1]`` to ``q[4]``. Tanks need slosh angles or the
    directions ``p``, draining tanks also ``liquid``. ``simulate`` and ``closed_loop`` record these
    by default. HubSlosh's modes after the first are drawn if the table has ``slosh.q_radial[n]``
    and ``slosh.q_tangential[n]``.

    Raises FmuError with the columns that are missing.
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
            arguments += ["--set", f"{name}={_text(value)}"]
        for number, tank in numbered.items():
            arguments += ["--tank", f"{number}:{tank}"]
        arguments += [] if start is None else ["--from", str(start)]
        arguments += [] if stop is None else ["--to", str(stop)]
        call(path, "view", arguments)
        return View(page.read_text(encoding="utf-8"), None if out is None else Path(out))


def _text(value: Quantity) -> str:
    """Return a value as the program reads it: with its unit, if it has one."""
    match value:
        case bool():
            return str(value).lower()
        case (number, unit):
            return f"{number}{unit}"
        case _:
            return str(value)
