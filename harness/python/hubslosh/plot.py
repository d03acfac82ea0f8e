"""Figures of runs and responses with matplotlib (``pip install matplotlib``).

Each function draws into the axes it is given, or into a new figure, and returns the axes.
"""

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .arguments import check_table
from .fmu import FmuError, did_you_mean

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from .linearization import LinearModel

# Okabe and Ito's palette: distinct for colour-blind readers
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of series, in turn."""

FLOOR = 80.0
"""Attenuation down to which `margins` draws the loop gain, dB."""


def _subplots(rows: int, **options: Any) -> "Sequence[Axes]":
    """Return the axes of a new figure, one above the other."""
    try:
        import matplotlib.pyplot as plt
    except ModuleNotFoundError:
        raise FmuError("plots need matplotlib: pip install matplotlib") from None
    height = 1.2 + 1.9 * rows
    _, axes = plt.subplots(
        rows, squeeze=False, figsize=(8, height), layout="constrained", **options
    )
    column: Sequence[Axes] = axes[:, 0]
    return column


def _check(table: pd.DataFrame, names: Sequence[str]) -> None:
    check_table(table, "what is drawn")
    there = [str(name) for name in table.columns]
    missing = [f"{name}{did_you_mean(name, there)}" for name in names if name not in there]
    if missing:
        raise FmuError(f"the table has no column {', '.join(missing)}")


def _label(table: pd.DataFrame, name: str) -> str:
    unit = table.attrs.get("units", {}).get(name)
    return f"{name} ({unit})" if unit and unit != "1" else name


def time_histories(
    run: pd.DataFrame, *names: str, axes: "Sequence[Axes] | None" = None, label: str | None = None
) -> "Sequence[Axes]":
    """Draw columns of a run over time, one above the other.

    Parameters
    ----------
    run : DataFrame
        Table with the column ``time`` (s), as `simulate` returns it.
    *names : str
        Columns to draw; by default all of them.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each column; by default those of a new figure.
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
    check_table(run, "what is drawn")
    columns = list(names) or [str(c) for c in run.columns if c != "time"]
    _check(run, ["time", *columns])
    axes = _subplots(len(columns), sharex=True) if axes is None else axes
    for ax, name in zip(axes, columns, strict=True):
        color = COLORS[len(ax.lines) % len(COLORS)]
        ax.plot(run["time"], run[name], color=color, linewidth=0.9, label=label)
        ax.set_ylabel(_label(run, name))
        ax.grid(alpha=0.3)
        if label is not None:
            ax.legend()
    axes[-1].set_xlabel("time (s)")
    return axes


def path(run: pd.DataFrame, ax: "Axes | None" = None, label: str | None = None) -> "Axes":
    """Draw the path of HubSlosh's slosh mass seen from above, in degrees.

    Parameters
    ----------
    run : DataFrame
        Table with the columns ``slosh_angle`` and ``slosh_angle_radial`` (rad).
    ax : matplotlib Axes, optional
        Axes to draw into; by default those of a new figure.
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
    _check(run, ["slosh_angle", "slosh_angle_radial"])
    ax = _subplots(1)[0] if ax is None else ax
    color = COLORS[len(ax.lines) % len(COLORS)]
    x, y = (np.degrees(run[name]) for name in ("slosh_angle_radial", "slosh_angle"))
    ax.plot(x, y, color=color, linewidth=0.7, label=label)
    ax.set_xlabel("radial angle (deg), positive outwards")
    ax.set_ylabel("tangential angle (deg)")
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(alpha=0.3)
    if label is not None:
        ax.legend()
    return ax


def bode(
    *responses: "pd.DataFrame | LinearModel",
    labels: Sequence[str] | None = None,
    axes: "Sequence[Axes] | None" = None,
) -> "Sequence[Axes]":
    """Draw gain and phase of frequency responses, one above the other.

    Estimates are dots with their standard deviation. Linear models are lines over the band of the
    estimates; without an estimate, from a fifth of the lowest pole or zero to five times the
    highest, but not above half the sampling rate.

    Parameters
    ----------
    *responses : DataFrame or LinearModel
        Estimates of `frequency_response`, and linear models, of which the response from the first
        input to the first output is drawn.
    labels : sequence of str, optional
        Name of each response in the legend.
    axes : sequence of two matplotlib Axes, optional
        Axes for gain and phase; by default those of a new figure.

    Returns
    -------
    sequence of matplotlib Axes
        Axes of the gain (SI units) and of the phase (deg).

    Raises
    ------
    FmuError
        If a response is neither, or matplotlib is not installed.

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
        _check(frame, ["frequency", "gain", "phase", "gain_std"])
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
                low, high = _band(*models)
            line = _frequencies(response, low, high)
            h = response.response(line)[:, 0, 0]
            # above the dots, which would hide it
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


def _band(*models: "LinearModel") -> tuple[float, float]:
    """Return the band of the models' poles and zeros, Hz, from a fifth of the lowest one on."""
    from scipy.linalg import eigvals

    found, highest = [], np.inf
    for model in models:
        n = len(model.A)
        system = np.block([[model.A, model.B[:, :1]], [model.C[:1], model.D[:1, :1]]])
        with np.errstate(all="ignore"):
            zeros = eigvals(system, np.diag([1.0] * n + [0.0]))
        values = np.concatenate([model.poles, zeros[np.isfinite(zeros)]])
        if model.period is not None:
            values = np.log(values[values != 0].astype(complex)) / model.period
            highest = min(highest, 0.5 / model.period)
        sizes = np.abs(values) / (2 * np.pi)
        found += [float(f) for f in sizes if 1e-6 < f < 1e6]
    low, high = min(found, default=0.1) / 5, max(found, default=10.0) * 5
    high = min(high, highest)
    return min(low, high / 100), high


def _frequencies(model: "LinearModel", low: float, high: float) -> np.ndarray:
    """Return 2000 frequencies between two, Hz, and more about each lightly damped pole."""
    line = [np.geomspace(low, high, 2000)]
    for mode in model.modes(0.3).itertuples():
        width = max(mode.zeta, 1e-6) * mode.frequency
        about = width * np.concatenate([[0], np.geomspace(0.05, 50, 60)])
        line.append(mode.frequency + np.concatenate([-about, about]))
    every = np.unique(np.concatenate(line))
    return every[(every >= low) & (every <= high)]


def margins(
    loop: Any,
    parameters: Mapping[str, Any] | None = None,
    axes: "Sequence[Axes] | None" = None,
) -> "Sequence[Axes]":
    """Draw the loop gain of a loop with all its crossings, and its margins in the title.

    The loop gain at each command has its own colour and is taken while the other loops are
    closed, as `hubslosh.margins` does. Gain crossings are dots and phase crossings squares; the
    smallest margins and those near slosh modes have labels.

    Parameters
    ----------
    loop : Loop, LinearModel or system of python-control
        The loop, as for `hubslosh.margins`.
    parameters : mapping, optional
        Parameters of the FMU in addition to the loop's own; only for a `Loop`.
    axes : sequence of two matplotlib Axes, optional
        Axes for gain and phase; by default those of a new figure.

    Returns
    -------
    sequence of matplotlib Axes
        Axes of the gain (dB, down to -80 dB or the smallest gain margin) and of the phase (deg).

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
    from .stability import _broken_at, margins_and_gain

    found, loop_gain = margins_and_gain(loop, parameters)
    table = found.crossings
    known = table.loc[table["frequency"] > 0, "frequency"]
    gain, phase = _subplots(2, sharex=True) if axes is None else axes
    lows, highs = zip(
        *(_band(_broken_at(loop_gain, i)) for i in range(len(loop_gain.D))), strict=True
    )
    low = min(known.min() / 5 if len(known) else np.inf, max(lows))
    high = max(known.max() * 2 if len(known) else 0, min(highs))
    if loop_gain.period is not None:
        high = min(high, 0.5 / loop_gain.period)
    lowest, labels = 0.0, list[_Label]()
    for i in range(len(loop_gain.D)):
        one = _broken_at(loop_gain, i)
        name = one.inputs[0] if one.inputs else "loop gain"
        line = _frequencies(one, low, high)
        h = one.response(line)[:, 0, 0]
        angle = np.degrees(np.unwrap(np.angle(h)))
        angle -= 360 * np.round((np.median(angle[: max(len(angle) // 4, 1)]) + 90) / 360)
        lowest = min(lowest, angle.min())
        style: dict[str, Any] = {"color": COLORS[i % len(COLORS)], "linewidth": 1.1}
        gain.plot(line, 20 * np.log10(np.abs(h)), label=name, **style)
        phase.plot(line, angle, **style)
        for row in table[table["loop"] == name].itertuples():
            if row.frequency <= 0:
                continue
            level = float(np.interp(row.frequency, line, angle))
            if row.crossing == "gain":
                phase.plot(row.frequency, level, "o", color=style["color"], markersize=4)
                if row.phase_margin != found.phase_margin and "slosh" not in row.near:
                    continue
                text = f"{row.phase_margin:.0f}°" + (" slosh" if "slosh" in row.near else "")
                labels.append((phase, row.frequency, level, text, style["color"]))
            else:
                gain.plot(row.frequency, -row.gain_margin, "s", color=style["color"], markersize=4)
                if row.gain_margin not in found.gain_margins:
                    continue
                text = f"{row.gain_margin:.1f} dB"
                labels.append((gain, row.frequency, -row.gain_margin, text, style["color"]))
    gain.axhline(0, color="black", linewidth=0.8)
    for turn in (-180, -540):
        if turn == -180 or lowest < turn:
            phase.axhline(turn, color="black", linewidth=0.8)
    gain.set_xscale("log")
    gain.set_xlim(low, high)
    finite = [abs(margin) for margin in found.gain_margins if np.isfinite(margin)]
    floor = -max(FLOOR, 1.2 * min(finite, default=0.0))
    bottom, top = gain.get_ylim()
    gain.set_ylim(max(bottom, floor), top)
    phase.margins(y=0.15)
    gain.set_ylabel("loop gain (dB)")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (Hz)")
    delay = f"delay margin {found.delay_margin:.3g} s" if found.stable else "UNSTABLE"
    crossed = table.loc[
        (table["crossing"] == "gain") & table["near"].str.contains("slosh"), "frequency"
    ]
    values = list(dict.fromkeys(f"{f:.3g}" for f in crossed))
    more = f" and {len(values) - 4} more" if len(values) > 4 else ""
    slosh = ", ".join(values[:4]) + more
    margin = f"{found.phase_margin:.0f}°" if np.isfinite(found.phase_margin) else "none"
    answer = f"phase margin {margin}, {delay}"
    answer += f"; slosh crosses 0 dB at {slosh} Hz" if slosh else ""
    gain.set_title("\n".join(textwrap.wrap(answer, 80)), fontsize=10)
    for ax in (gain, phase):
        ax.grid(alpha=0.3, which="both")
    if len(loop_gain.D) > 1:
        gain.legend()
    _annotate(labels)
    return gain, phase


_Label = tuple[Any, float, float, str, str]
"""Axes, place, text and colour of a label."""


def _annotate(labels: list[_Label]) -> None:
    """Write labels next to their places; those that would cover another one are left out."""
    if not labels:
        return
    labels[0][0].figure.draw_without_rendering()  # the layout moves the axes
    taken: list[tuple[float, float, float, float]] = []
    for ax, x, y, text, color in labels:
        at, unit = ax.transData.transform((x, y)), ax.figure.dpi / 72
        width, height, box = 4.8 * len(text), 11.0, ax.bbox
        for dx, dy in ((4, 4), (4, -12), (-width - 4, 4), (-width - 4, -12), (4, 14), (4, -22)):
            left, low = at[0] + dx * unit, at[1] + dy * unit
            right, high = left + width * unit, low + height * unit
            inside = left >= box.x0 and right <= box.x1 and low >= box.y0 and high <= box.y1
            if inside and all(
                right < other[0] or left > other[2] or high < other[1] or low > other[3]
                for other in taken
            ):
                taken.append((left, low, right, high))
                ax.annotate(text, (x, y), (dx, dy), textcoords="offset points", fontsize=7,
                            color=color)  # fmt: skip
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
        Commanded attitude over ``time``, with ``q[1]`` to ``q[4]`` or ``theta`` (rad). With it the
        remaining rotation is drawn too.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each quantity; by default those of a new figure.
    label : str, optional
        Name of this run in the legend.

    Returns
    -------
    sequence of matplotlib Axes
        One for each quantity that the run has.

    Raises
    ------
    FmuError
        If the run has no such quantity, or matplotlib is not installed.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"init.theta": 0.1})
    >>> axes = hubslosh.plot.closed_loop(loop.simulate(stop=5.0))
    >>> [ax.get_ylabel() for ax in axes]
    ['attitude (deg)', 'rate (deg/s)', 'torque (N·m)']
    """
    from .attitude import NAMES, angles, error

    _check(run, ["time"])
    panels: list[tuple[str, dict[str, pd.Series]]] = []
    if all(name in run.columns for name in NAMES):
        turned = np.degrees(angles(run))
        panels.append(("attitude (deg)", {name: turned[name] for name in turned.columns}))
    elif "theta" in run.columns:
        panels.append(("attitude (deg)", {"theta": np.degrees(run["theta"])}))
    if reference is not None:
        _check(reference, ["time"])
        wanted = {
            str(n): np.interp(run["time"], reference["time"], reference[n])
            for n in reference.columns
        }
        if all(name in run.columns and name in wanted for name in NAMES):
            left = np.degrees(error(run, pd.DataFrame(wanted)))
            panels.append(
                (
                    "left to turn (deg)",
                    {f"about {x}": left[n] for x, n in zip("xyz", left, strict=True)},
                )
            )
        elif "theta" in run.columns and "theta" in wanted:
            panels.append(
                ("left to turn (deg)", {"theta": np.degrees(wanted["theta"] - run["theta"])})
            )
    rates = [n for n in run.columns if n == "omega" or n.startswith("omega[")]
    if rates:
        panels.append(("rate (deg/s)", {n: np.degrees(run[n]) for n in rates}))
    torques = [n for n in run.columns if n == "tau_cmd" or n.startswith("torque[")]
    if torques:
        panels.append(("torque (N·m)", {n: run[n] for n in torques}))
    if not panels:
        raise FmuError("the run has neither an attitude, rates nor torques; see time_histories")
    axes = _subplots(len(panels), sharex=True) if axes is None else axes
    for ax, (title, lines) in zip(axes, panels, strict=True):
        for name, values in lines.items():
            text = name if label is None else f"{name}, {label}"
            color = COLORS[len(ax.lines) % len(COLORS)]
            ax.plot(run["time"], values, color=color, linewidth=0.9, label=text)
        ax.set_ylabel(title)
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
    axes[-1].set_xlabel("time (s)")
    return axes


def monte_carlo(
    table: pd.DataFrame, *columns: str, axes: "Sequence[Axes] | None" = None, at: float = 0.95
) -> "Sequence[Axes]":
    """Draw the cumulative distribution of results of a Monte Carlo study.

    A vertical line and a band show a quantile with its 95 % interval.

    Parameters
    ----------
    table : DataFrame
        Result of `hubslosh.monte_carlo`, or its file ``runs.csv``.
    *columns : str
        Results to draw; by default all numbers that ``outcome`` has returned. Of a file these are
        the columns without a dot or bracket in their names.
    axes : sequence of matplotlib Axes, optional
        Axes to draw into, one for each result; by default those of a new figure.
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

    check_table(table, "what is drawn")
    drawn = table.attrs.get("drawn")
    if drawn is None:  # a table from elsewhere, such as runs.csv
        drawn = [c for c in table.columns if "." in str(c) or "[" in str(c)]
    numbers = [str(c) for c in table.select_dtypes("number").columns if c != "run"]
    names = list(columns) or [n for n in numbers if n not in drawn]
    _check(table, names)
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
    """Write a figure so that the same figure gives the same bytes, as SVG too.

    Parameters
    ----------
    figure : matplotlib Figure
        The figure, such as ``axes[0].figure``; of a part, the whole figure.
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
