"""Figures of runs and responses with matplotlib (``pip install hubslosh[plot]``).

Each function draws into the axes it is given, or into a new figure, and returns the axes.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .fmu import FmuError, did_you_mean

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .linearization import LinearModel

# Okabe and Ito's palette: distinct for colour-blind readers
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of series, in turn."""


def _subplots(rows: int, **options: Any) -> "Sequence[Axes]":
    """Return the axes of a new figure, one above the other."""
    try:
        import matplotlib.pyplot as plt
    except ModuleNotFoundError:
        raise FmuError("plots need matplotlib: pip install hubslosh[plot]") from None
    height = 1.2 + 1.9 * rows
    _, axes = plt.subplots(
        rows, squeeze=False, figsize=(8, height), layout="constrained", **options
    )
    column: Sequence[Axes] = axes[:, 0]
    return column


def _check(table: pd.DataFrame, names: Sequence[str]) -> None:
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
    """Draw columns of a run over time, one above the other; by default all of them."""
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
    """Draw the slosh mass's path from above: ``slosh_angle`` over ``slosh_angle_radial``, deg."""
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

    Estimates of `frequency_response` are dots with their standard deviation; linear models, of
    their first input to their first output, are lines over the same band.
    """
    frames = [r for r in responses if isinstance(r, pd.DataFrame)]
    for frame in frames:
        _check(frame, ["frequency", "gain", "phase", "gain_std"])
    if not frames and responses:
        raise FmuError("bode needs an estimate beside linear models, for the band")
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
            low = min(frame["frequency"].min() for frame in frames)
            high = max(frame["frequency"].max() for frame in frames)
            line = np.geomspace(low, high, 2000)
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
    if labels:
        gain.legend()
    return gain, phase
