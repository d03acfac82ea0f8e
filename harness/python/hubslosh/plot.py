"""Figures of runs and responses with matplotlib (``pip install matplotlib``).

Each function draws into the axes it is given, or into a new figure, and returns the axes.
"""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from .arguments import check_columns, check_table
from .curves import curves_of, draw_bode, draw_nichols, draw_nyquist
from .fmu import FmuError
from .stability import _broken_at, band, frequencies, margins_and_gain

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from .curves import Curve, Curves
    from .linearization import LinearModel
    from .stability import Margins

# Colours of the lines in a diagram, one after the other: the palette of Okabe and Ito, which
# colour-blind readers can distinguish.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def _subplots(rows: int, height: float | None = None, **options: Any) -> "Sequence[Axes]":
    """Return the axes of a new figure, one above the other; ``height`` is in inches."""
    try:
        import matplotlib.pyplot as plt
    except ModuleNotFoundError:
        raise FmuError("plots need matplotlib: pip install matplotlib") from None
    height = 1.2 + 1.9 * rows if height is None else height
    _, axes = plt.subplots(
        rows, squeeze=False, figsize=(8, height), layout="constrained", **options
    )
    column: Sequence[Axes] = axes[:, 0]
    return column


def _label(table: pd.DataFrame, name: str) -> str:
    unit = table.attrs.get("units", {}).get(name)
    return f"{name} ({unit})" if unit and unit != "1" else name


def _line(ax: "Axes", x: Any, y: Any, label: str | None) -> None:
    ax.plot(x, y, color=COLORS[len(ax.lines) % len(COLORS)], linewidth=0.9, label=label)
    ax.grid(alpha=0.3)
    if label is not None:
        ax.legend(fontsize=8)


def _panels(
    run: pd.DataFrame,
    panels: Mapping[str, Sequence[tuple[str | None, Any]]],
    axes: "Sequence[Axes] | None",
) -> "Sequence[Axes]":
    """Draw lines over the time of ``run``, and return the axes.

    For each title, ``panels`` has the lines of one diagram as pairs (label, values).
    """
    axes = _subplots(len(panels), sharex=True) if axes is None else axes
    for ax, (title, lines) in zip(axes, panels.items(), strict=True):
        for label, values in lines:
            _line(ax, run["time"], values, label)
        ax.set_ylabel(title)
    axes[-1].set_xlabel("time (s)")
    return axes


def time_histories(
    run: pd.DataFrame, *names: str, axes: "Sequence[Axes] | None" = None, label: str | None = None
) -> "Sequence[Axes]":
    """Draw columns of a run over time, each in its own panel.

    Parameters
    ----------
    run : DataFrame
        Table with the column ``time`` (s), as `simulate` returns it.
    *names : str
        Columns to draw; by default all of them.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each column; by default the axes of a new figure.
    label : str, optional
        Name of this run in the legend.

    Returns
    -------
    sequence of matplotlib Axes
        One for each column.

    Raises
    ------
    FmuError
        If a column is missing, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
    >>> axes = hubslosh.plot.time_histories(run, "omega", "slosh_angle")
    >>> [ax.get_ylabel() for ax in axes]
    ['omega (rad/s)', 'slosh_angle (rad)']
    """
    check_table(run, "the table")
    columns = list(names) or [str(c) for c in run.columns if c != "time"]
    check_columns(run, ["time", *columns], "the table")
    return _panels(run, {_label(run, name): [(label, run[name])] for name in columns}, axes)


def path(run: pd.DataFrame, ax: "Axes | None" = None, label: str | None = None) -> "Axes":
    """Draw the path of HubSlosh's slosh mass seen from above, in degrees.

    Parameters
    ----------
    run : DataFrame
        Table with the columns ``slosh_angle`` and ``slosh_angle_radial`` (rad).
    ax : matplotlib Axes, optional
        Axes to draw into; by default the axes of a new figure.
    label : str, optional
        Name of this run in the legend.

    Returns
    -------
    matplotlib Axes
        The axes: radial angle along x, tangential angle along y.

    Raises
    ------
    FmuError
        If a column is missing, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> start = {"slosh.model": "spherical", "init.slosh_angle": 0.1}
    >>> run = hubslosh.simulate(parameters=start, stop=2)
    >>> hubslosh.plot.path(run).get_xlabel()
    'radial angle (deg), positive outwards'
    """
    check_columns(run, ["slosh_angle", "slosh_angle_radial"], "the table")
    ax = _subplots(1)[0] if ax is None else ax
    _line(ax, *(np.degrees(run[name]) for name in ("slosh_angle_radial", "slosh_angle")), label)
    ax.set_xlabel("radial angle (deg), positive outwards")
    ax.set_ylabel("tangential angle (deg)")
    ax.set_aspect("equal", adjustable="datalim")
    return ax


def bode(
    *responses: "pd.DataFrame | LinearModel",
    labels: Sequence[str] | None = None,
    axes: "Sequence[Axes] | None" = None,
) -> "Sequence[Axes]":
    """Draw gain and phase of frequency responses, one above the other.

    Estimates are dots with their standard deviation. Linear models are lines over the frequency
    band of the estimates. Without an estimate, the band reaches from a fifth of the lowest pole or
    zero to five times the highest, but not beyond half the sampling rate.

    Parameters
    ----------
    *responses : DataFrame or LinearModel
        Estimates of `frequency_response`, and linear models, of which the response from the first
        input to the first output is drawn.
    labels : sequence of str, optional
        Name of each response in the legend.
    axes : sequence of two matplotlib Axes, optional
        Axes for gain and phase; by default the axes of a new figure.

    Returns
    -------
    sequence of matplotlib Axes
        Axes of the gain (SI units) and of the phase (deg).

    Raises
    ------
    FmuError
        If a response is neither a table nor a LinearModel, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> model = hubslosh.linearize(
    ...     parameters={"friction.model": "viscous"}, inputs="tau_cmd", outputs="omega")
    >>> gain, phase = hubslosh.plot.bode(model, labels=["bench"])
    >>> phase.get_xlabel()
    'frequency (Hz)'
    """
    frames = [r for r in responses if isinstance(r, pd.DataFrame)]
    for frame in frames:
        check_columns(frame, ["frequency", "gain", "phase", "gain_std"], "the table")
    models = [r for r in responses if not isinstance(r, pd.DataFrame)]
    if wrong := [r for r in models if not hasattr(r, "response")]:
        raise FmuError(
            f"bode draws tables of frequency_response and LinearModels, not {wrong[0]!r}"
        )
    gain, phase = _subplots(2, sharex=True) if axes is None else axes
    for k, response in enumerate(responses):
        color = COLORS[k % len(COLORS)]
        label = labels[k] if labels else None
        if isinstance(response, pd.DataFrame):
            f = response["frequency"]
            gain.errorbar(
                f, response["gain"], response["gain_std"],
                fmt=".", color=color, markersize=4, linewidth=0.6, label=label,
            )  # fmt: skip
            phase.plot(f, response["phase"], ".", color=color, markersize=4)
        else:
            if frames:
                low = min(frame["frequency"].min() for frame in frames)
                high = max(frame["frequency"].max() for frame in frames)
            else:
                lows, highs = zip(*(band(model) for model in models), strict=True)
                low, high = min(lows), max(highs)
            line = frequencies(response, low, high, 2000)
            h = response.response(line)[:, 0, 0]
            # draw the line above the dots, which would hide it
            style: dict[str, Any] = {"color": color, "linewidth": 1.2, "zorder": 3}
            gain.plot(line, np.abs(h), label=label, **style)
            phase.plot(line, np.degrees(np.unwrap(np.angle(h))), **style)
    gain.set_yscale("log")
    gain.set_ylabel("gain")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (Hz)")
    for ax in (gain, phase):
        ax.grid(alpha=0.3, which="both")
    if not frames:
        gain.set_xscale("log")
    if labels:
        gain.legend()
    return gain, phase


def margins(
    loop: Any,
    parameters: Mapping[str, Any] | None = None,
    axes: "Sequence[Axes] | None" = None,
) -> "Sequence[Axes]":
    """Draw the Bode diagram of a loop, with its crossings and, in the title, its margins.

    There is a curve for the loop gain of each command, in a colour of its own, computed with the
    loops of the other commands closed, as `hubslosh.margins` does. Gain crossings are dots, phase
    crossings are squares. Labels show the smallest margins and the margins near slosh modes.

    Parameters
    ----------
    loop : Loop, LinearModel or system of python-control
        The loop, as for `hubslosh.margins`.
    parameters : mapping, optional
        Parameters of the FMU in addition to the parameters of the loop; only for a `Loop`.
    axes : sequence of two matplotlib Axes, optional
        Axes for gain and phase; by default the axes of a new figure.

    Returns
    -------
    sequence of matplotlib Axes
        Axes of the gain (dB, around 0 dB and the gain margins) and of the phase (deg).

    Raises
    ------
    FmuError
        If `hubslosh.margins` refuses the loop, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
    >>> gain, phase = hubslosh.plot.margins(loop)
    >>> gain.get_title().partition(",")[0]
    'phase margin 45°'
    """
    found, curves = _loop_curves(loop, parameters)
    gain, phase = _subplots(2, sharex=True) if axes is None else axes
    draw_bode(gain, phase, curves)
    labels = []
    for curve, mark in _marks(found, curves):
        # mark a gain crossing in the phase diagram, and a phase crossing in the gain diagram
        ax, y = (phase, mark.phase) if mark.symbol == "o" else (gain, mark.decibels)
        labels.append(_mark(ax, mark.frequency, y, mark.symbol, mark.text, curve.color))
    _finish(gain, found, labels)
    phase.grid(alpha=0.3, which="both")
    return gain, phase


def nichols(
    loop: Any, parameters: Mapping[str, Any] | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Draw the Nichols chart of a loop: gain over phase, for each command in its own colour.

    Each loop gain is computed with the loops of the other commands closed. Crosses mark the point
    -1, at all odd multiples of 180°; the contour around it contains the loop gains at the distance
    0.5 from -1. Dots are the gain crossings of `hubslosh.margins`, squares the phase crossings.
    Labels show the smallest margins and the margins near slosh modes.

    Parameters
    ----------
    loop : Loop, LinearModel or system of python-control
        The loop, as for `hubslosh.margins`.
    parameters : mapping, optional
        Parameters of the FMU in addition to the parameters of the loop; only for a `Loop`.
    ax : matplotlib Axes, optional
        Axes to draw into; by default the axes of a new figure.

    Returns
    -------
    matplotlib Axes
        The axes: phase (deg) along x, gain (dB) along y.

    Raises
    ------
    FmuError
        If `hubslosh.margins` refuses the loop, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
    >>> hubslosh.plot.nichols(loop).get_ylabel()
    'loop gain (dB)'
    """
    ax = _subplots(1, 5.5)[0] if ax is None else ax
    return _diagram(loop, parameters, ax, draw_nichols, lambda mark: (mark.phase, mark.decibels))


def nyquist(
    loop: Any, parameters: Mapping[str, Any] | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Draw the Nyquist plot of a loop near -1, for each command in its own colour.

    Each loop gain is drawn at positive frequencies, with the loops of the other commands closed. A
    cross marks the point -1; the circle around it has the radius 0.5. The dotted circle is the unit
    circle. Dots are the gain crossings of `hubslosh.margins`, squares the phase crossings. Labels
    show the smallest margins and the margins near slosh modes.

    Parameters
    ----------
    loop : Loop, LinearModel or system of python-control
        The loop, as for `hubslosh.margins`.
    parameters : mapping, optional
        Parameters of the FMU in addition to the parameters of the loop; only for a `Loop`.
    ax : matplotlib Axes, optional
        Axes to draw into; by default the axes of a new figure.

    Returns
    -------
    matplotlib Axes
        The axes: real part along x, imaginary part along y.

    Raises
    ------
    FmuError
        If `hubslosh.margins` refuses the loop, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
    >>> hubslosh.plot.nyquist(loop).get_xlabel()
    'Re L'
    """

    def place(mark: _Mark) -> tuple[float, float]:
        z = 10 ** (mark.decibels / 20) * np.exp(1j * np.radians(mark.phase))
        return z.real, z.imag

    ax = _subplots(1, 7.0)[0] if ax is None else ax
    return _diagram(loop, parameters, ax, draw_nyquist, place)


def _diagram(
    loop: Any,
    parameters: Mapping[str, Any] | None,
    ax: "Axes",
    draw: "Callable[[Axes, Curves], None]",
    place: "Callable[[_Mark], tuple[float, float]]",
) -> "Axes":
    """Draw the loop gains and mark their crossings; return the axes.

    ``draw`` draws the curves, and ``place`` returns the coordinates of a crossing in the diagram.
    """
    found, curves = _loop_curves(loop, parameters)
    draw(ax, curves)
    labels = [
        _mark(ax, *place(mark), mark.symbol, mark.at, curve.color)
        for curve, mark in _marks(found, curves)
    ]
    _finish(ax, found, labels)
    return ax


def _loop_curves(loop: Any, parameters: Mapping[str, Any] | None) -> "tuple[Margins, Curves]":
    """Return the margins of ``loop``, and the curve of the loop gain of each command."""
    found, gain = margins_and_gain(loop, parameters)
    names = gain.inputs or ("loop gain",)
    gains = [
        (name, COLORS[i % len(COLORS)], "-", _broken_at(gain, i)) for i, name in enumerate(names)
    ]
    return found, curves_of(gains, found.crossings)


class _Mark(NamedTuple):
    """A crossing in a diagram: a dot where the gain is 0 dB, a square where the phase is ±180°."""

    symbol: str
    frequency: float
    phase: float
    decibels: float
    text: str
    """Text of the label, with the margin; empty for a crossing without label."""

    @property
    def at(self) -> str:
        """Return the text of the label with the frequency of the crossing."""
        return f"{self.text} at {self.frequency:.3g} Hz" if self.text else ""


def _marks(found: "Margins", curves: "Curves") -> "list[tuple[Curve, _Mark]]":
    """Return each crossing in ``found`` with its curve; the smallest margins come first.

    Labels are placed in this order. Only the smallest margins and the crossings of slosh modes have
    a label.
    """
    table = found.crossings[found.crossings["frequency"] > 0]
    marks = []
    for curve in curves.every:
        for row in table[table["loop"] == curve.name].itertuples():
            phase = float(np.interp(row.frequency, curve.frequency, curve.phase))
            slosh = " slosh" if "slosh" in row.near else ""
            if row.crossing == "gain":
                shown = row.phase_margin == found.phase_margin or slosh
                text, level = f"{row.phase_margin:.0f}°{slosh}", 0.0
                ease = abs(row.phase_margin) / 45  # 45° counts as much as 6 dB
            else:
                phase = 360 * np.round((phase - 180) / 360) + 180
                shown = row.gain_margin in found.gain_margins
                text, level = f"{row.gain_margin:.1f} dB", -row.gain_margin
                ease = abs(row.gain_margin) / 6
            symbol = "o" if row.crossing == "gain" else "s"
            text = text.replace("-", "−") if shown else ""
            marks.append((ease, curve, _Mark(symbol, row.frequency, phase, level, text)))
    marks.sort(key=lambda row: row[0])
    return [(curve, mark) for _, curve, mark in marks]


def _mark(ax: "Axes", x: float, y: float, symbol: str, text: str, color: str) -> "_Label":
    ax.plot(x, y, symbol, color=color, markersize=4)
    return ax, x, y, text, color


def _finish(ax: "Axes", found: "Margins", labels: "list[_Label]") -> None:
    """Add a title with the margins ``found``, a legend if there are several curves, and labels."""
    delay = f"delay margin {found.delay_margin:.3g} s" if found.stable else "UNSTABLE"
    table = found.crossings
    crossed = table.loc[
        (table["crossing"] == "gain") & table["near"].str.contains("slosh"), "frequency"
    ]
    values = list(dict.fromkeys(f"{f:.3g}" for f in crossed))
    more = f" and {len(values) - 4} more" if len(values) > 4 else ""
    slosh = f"; slosh crosses 0 dB at {', '.join(values[:4])}{more} Hz" if values else ""
    margin = f"{found.phase_margin:.0f}°" if np.isfinite(found.phase_margin) else "none"
    title = f"phase margin {margin}, {delay}{slosh}"
    # number of characters in a line; a character of 10-point type is about 5.5 points wide
    wide = ax.get_window_extent().width * 72 / ax.figure.dpi / 5.5
    ax.set_title("\n".join(textwrap.wrap(title, int(wide))), fontsize=10)
    ax.grid(alpha=0.3, which="both")
    names = [line for line in ax.lines if not str(line.get_label()).startswith("_")]
    if len(names) > 1:
        ax.legend(fontsize=8)
    _annotate([label for label in labels if label[3]])


_Label = tuple[Any, float, float, str, str]  # Axes, coordinates, text and colour of a label


def _annotate(labels: list[_Label]) -> None:
    """Write labels next to their points; leave out labels that would cover an earlier label."""
    if not labels:
        return
    from matplotlib.transforms import Bbox

    labels[0][0].figure.draw_without_rendering()  # lays out the axes, which moves the points
    taken: list[Bbox] = []
    for ax, x, y, text, color in labels:
        at, unit = ax.transData.transform((x, y)), ax.figure.dpi / 72
        back = -5.0 * len(text) - 4
        for dx, dy in ((4, 4), (4, -12), (back, 4), (back, -12), (4, 14), (4, -22)):
            corner = at[0] + dx * unit, at[1] + dy * unit
            box = Bbox.from_bounds(*corner, 5.0 * len(text) * unit, 12.0 * unit)
            is_inside = ax.bbox.contains(*box.min) and ax.bbox.contains(*box.max)
            if is_inside and not box.count_overlaps(taken):
                taken.append(box)
                ground = {"facecolor": ax.get_facecolor(), "alpha": 0.75, "pad": 0.5, "lw": 0}
                ax.annotate(text, (x, y), (dx, dy), textcoords="offset points", fontsize=7.5,
                            color=color, bbox=ground)  # fmt: skip
                break


def closed_loop(
    run: pd.DataFrame,
    reference: pd.DataFrame | None = None,
    axes: "Sequence[Axes] | None" = None,
    label: str | None = None,
) -> "Sequence[Axes]":
    """Draw attitude (deg), rates (deg/s) and torques (N·m) of a run in a closed loop.

    The attitude of Spacecraft is drawn as roll, pitch and yaw, the attitude of HubSlosh as the
    angle of the hub.

    Parameters
    ----------
    run : DataFrame
        Table of `hubslosh.closed_loop`.
    reference : DataFrame, optional
        Commanded attitude over ``time``, with the columns ``q[1]`` to ``q[4]`` or ``theta`` (rad).
        If given, the remaining rotation is also drawn.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each quantity; by default the axes of a new figure.
    label : str, optional
        Name of this run in the legend.

    Returns
    -------
    sequence of matplotlib Axes
        One for each drawn quantity.

    Raises
    ------
    FmuError
        If the run has neither attitude, rates nor torques, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"init.theta": 0.1})
    >>> axes = hubslosh.plot.closed_loop(loop.simulate(stop=5.0))
    >>> [ax.get_ylabel() for ax in axes]
    ['attitude (deg)', 'rate (deg/s)', 'torque (N·m)']
    """
    from .attitude import NAMES, angles, error

    check_columns(run, ["time"], "the table")
    panels: dict[str, Mapping[Any, Any]] = {}
    if all(name in run.columns for name in NAMES):
        panels["attitude (deg)"] = dict(np.degrees(angles(run)).items())
    elif "theta" in run.columns:
        panels["attitude (deg)"] = {"theta": np.degrees(run["theta"])}
    if reference is not None:
        check_columns(reference, ["time"], "the table")
        wanted = {
            str(n): np.interp(run["time"], reference["time"], reference[n])
            for n in reference.columns
        }
        if all(name in run.columns and name in wanted for name in NAMES):
            left = np.degrees(error(run, pd.DataFrame(wanted)))
            named = zip("xyz", left, strict=True)
            panels["left to turn (deg)"] = {f"about {x}": left[n] for x, n in named}
        elif "theta" in run.columns and "theta" in wanted:
            panels["left to turn (deg)"] = {"theta": np.degrees(wanted["theta"] - run["theta"])}
    rates = [n for n in run.columns if n == "omega" or n.startswith("omega[")]
    panels["rate (deg/s)"] = {n: np.degrees(run[n]) for n in rates}
    torques = [n for n in run.columns if n == "tau_cmd" or n.startswith("torque[")]
    panels["torque (N·m)"] = {n: run[n] for n in torques}
    end = "" if label is None else f", {label}"
    drawn = {
        title: [(f"{name}{end}", values) for name, values in lines.items()]
        for title, lines in panels.items()
        if lines
    }
    if not drawn:
        raise FmuError("the run has neither an attitude, rates nor torques; see time_histories")
    return _panels(run, drawn, axes)


def monte_carlo(
    table: pd.DataFrame, *columns: str, axes: "Sequence[Axes] | None" = None, at: float = 0.95
) -> "Sequence[Axes]":
    """Draw the cumulative distribution of each result of a Monte Carlo study.

    A vertical line shows a quantile, and a band its 95 % confidence interval.

    Parameters
    ----------
    table : DataFrame
        Result of `hubslosh.monte_carlo`, or its file ``runs.csv``.
    *columns : str
        Results to draw; by default all numbers that ``outcome`` has returned. If ``table`` was read
        from a file, the default is all columns without a dot or bracket in their names.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each result; by default the axes of a new figure.
    at : float
        Probability of the quantile, between 0 and 1.

    Returns
    -------
    sequence of matplotlib Axes
        One for each result.

    Raises
    ------
    FmuError
        If the table has no such column or no results, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> runs = hubslosh.monte_carlo(
    ...     {"tank.h": (0.05, 0.1)}, 20, outcome=lambda values: {"volume": 0.02 * values["tank.h"]})
    >>> (ax,) = hubslosh.plot.monte_carlo(runs)
    >>> ax.get_xlabel()
    'volume'
    """
    from .sampling import quantiles

    check_table(table, "the table")
    drawn = table.attrs.get("drawn")
    if drawn is None:  # a table that was read from a file, such as runs.csv
        drawn = [c for c in table.columns if "." in str(c) or "[" in str(c)]
    numbers = [str(c) for c in table.select_dtypes("number").columns if c != "run"]
    names = list(columns) or [n for n in numbers if n not in drawn]
    check_columns(table, names, "the table")
    if not names:
        raise FmuError("the table has no results to draw")
    axes = _subplots(len(names)) if axes is None else axes
    for ax, row in zip(axes, quantiles(table, names, at=[at]).itertuples(), strict=True):
        values = np.sort(table[row.result].dropna().to_numpy(float))
        share = 100 * np.arange(1, len(values) + 1) / len(values)
        ax.step(values, share, where="post", color=COLORS[0], linewidth=1.2)
        right = row.high if np.isfinite(row.high) else values[-1]
        left = row.low if np.isfinite(row.low) else values[0]
        ax.axvspan(left, right, color=COLORS[1], alpha=0.2, linewidth=0)
        text = f"{100 * at:g} % below {row.value:.4g}"
        ax.axvline(row.value, color=COLORS[1], linewidth=1, label=text)
        ax.set_ylabel("runs (%)")
        ax.set_xlabel(_label(table, row.result))
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
    return axes


def save(figure: "Figure | SubFigure", path: "str | Path") -> None:
    """Write a figure to a file; the same figure always gives the same bytes, also as SVG.

    Parameters
    ----------
    figure : matplotlib Figure
        The figure to write, such as ``axes[0].figure``. If a SubFigure is given, the whole figure
        that contains it is written.
    path : str or Path
        File in a format of matplotlib, such as .png, .svg or .pdf.

    Examples
    --------
    >>> import hubslosh
    >>> run = hubslosh.simulate(parameters={"init.slosh_angle": 0.1}, stop=2)
    >>> axes = hubslosh.plot.time_histories(run, "omega")
    >>> hubslosh.plot.save(axes[0].figure, "rate.svg")
    """
    import matplotlib

    metadata = {"Date": None} if str(path).endswith(".svg") else None
    with matplotlib.rc_context({"svg.hashsalt": "hubslosh"}):
        figure.figure.savefig(path, metadata=metadata)
