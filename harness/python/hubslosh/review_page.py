"""The page of a design review: one HTML file that needs no network and can be printed."""

import html
import io
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .curves import Curves, curves_of, draw_bode, draw_nichols
from .fmu import FmuError
from .plot import COLORS
from .quantities import short_name
from .stability import _broken_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .review import Review
    from .worst_case import Confirmation

WIDTH = 4.8  # Width of a figure, inches; on a telephone it is shrunk only a little

# Placeholder colours in figures and in review_page.mplstyle. The page replaces them by the colours
# of its light or dark mode.
INK, SOFT, LINE, BAD = "#010203", "#595a5b", "#cfd0d1", "#b30102"

MOST_CURVES = 12  # Largest number of fills that are drawn in Nichols and Bode diagrams

MOST_UNSTABLE = 12  # Largest number of rows in the table of unstable points

GAINS = (-50.0, 40.0)  # Range of the peak loop gain in the diagram of slosh modes, dB

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")


def page(review: "Review") -> str:
    """Return the review as a complete HTML page with figures and tables."""
    title = f"Design review over {len(review.fills)} fills and {len(review.points)} points"
    bad = "" if review.passed else " bad"
    figures = "\n".join(_figures(review))
    return document(
        title,
        f'<p class="answer{bad}">{html.escape(review.summary)}</p>\n{_facts(review)}\n'
        f'<div class="figures">\n{figures}\n</div>\n{_tables(review)}',
    )


def document(title: str, body: str) -> str:
    """Return an HTML page with ``title`` as title and heading, and with ``body``."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
        f"<h1>{html.escape(title)}</h1>\n{body}\n</main>\n</body>\n</html>\n"
    )


def _facts(review: "Review") -> str:
    lines = review.stabilisation()
    if review.uncertain:
        lines.append("Uncertain: " + "; ".join(f"{u.name} {u.text}" for u in review.uncertain))
    lines.append(review.suggestion.text)
    lines.append(
        "Each loop is broken at one command while the others are closed. The thrust acts through "
        "the centre of mass."
    )
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return f'<ul class="facts">{items}</ul>'


def _figures(review: "Review") -> Iterator[str]:
    """Yield each figure of a review's page as HTML; its title is the question that it answers."""
    from .fmu import Fmu

    unit = "fill (% of the volume)" if review.unit == "%" else "liquid (kg)"
    limits = " Red: required of all points (dashed), of nominal points (dotted)."
    yield figure_of(
        "How do the margins change as the tanks empty?",
        f"Line: nominal. Band: all points within the uncertainty{_marked(review)}."
        + limits * bool(review.limits),
        5.6, lambda figure: _margins(figure, review, unit),
    )  # fmt: skip
    if len(review.slosh):
        yield figure_of(
            "Is each slosh mode stabilised by phase or by gain?",
            "A dot per nominal fill and command. Below 0 dB gain stabilises the mode; within ±90° "
            "closing the loop adds damping. In the upper outer parts neither does. Large crosses: "
            "the mode is unstable with all loops closed.",
            3.6, lambda figure: _stabilisation(figure, review),
        )  # fmt: skip
        yield figure_of(
            "Where are the slosh modes, and what does the loop do to their damping?",
            "Dots: pole with this loop open. Crosses: damping ratio with all loops closed; large "
            "ones are unstable.",
            4.4, lambda figure: _modes(figure, review, unit),
        )  # fmt: skip
    commands = review.nominal[0].gain.inputs
    curves = _curves(review)
    for i, name in enumerate(commands):
        yield figure_of(
            f"How close does the loop of {name} come to −1?",
            "Nichols diagram. Cross: −1. Closed contour: modulus margin 0.5.",
            3.9, lambda figure, i=i: _nichols(figure, curves[i]),
        )  # fmt: skip
        yield figure_of(
            f"Which frequencies cross 0 dB in the loop of {name}?",
            "Bode diagram of the sampled loop gain, delay included. Dashed: −180°.",
            4.6, lambda figure, i=i: _bode(figure, curves[i]),
        )  # fmt: skip
    drawn = review.points.query("kind == 'draw'")
    if len(drawn) > 1:
        yield figure_of(
            "How likely is a small margin?",
            f"{len(drawn)} random points, uniform within the ranges, over all fills; an unstable "
            "one has the margin 0.",
            3.6, lambda figure: _draws(figure, drawn),
        )  # fmt: skip
    found = review.confirmation
    own = review.nominal[0].loop._units()
    unit = own.get(commands[0]) or Fmu.open(review.craft.model).unit(commands[0])
    unit_of = unit.replace(".", "·")
    yield figure_of(
        "Does the nonlinear craft agree at the worst case?",
        f"{_what_is_drawn(found)}, from a small rotation on. "
        f"{str(found)[0].upper()}{str(found)[1:]}.",
        3.0, lambda figure: _simulated(figure, review, unit_of),
    )  # fmt: skip


def figure_of(title: str, caption: str, height: float, draw: "Callable[[Figure], None]") -> str:
    """Return a figure as inline SVG, whose colours follow the light or dark scheme of the page.

    ``draw`` draws into the empty figure; ``height`` is its height in inches.
    """
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise FmuError("the page of a review needs matplotlib: pip install matplotlib") from None
    style = Path(__file__).with_suffix(".mplstyle")
    with matplotlib.rc_context({"svg.hashsalt": title}, style):
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        draw(figure)
        out = io.StringIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    svg = out.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = re.sub(r'<svg [^>]*viewBox="([^"]*)"[^>]*>',
                 rf'<svg viewBox="\1" role="img" aria-label="{html.escape(title)}" '
                 'xmlns:xlink="http://www.w3.org/1999/xlink">', svg, count=1)  # fmt: skip
    names = {INK: "ink", SOFT: "soft", LINE: "line", BAD: "bad"}
    names |= {color.lower(): f"c{k}" for k, color in enumerate(COLORS)}
    for color, name in names.items():
        svg = svg.replace(color, f"var(--{name})")
    svg = re.sub(r"'DejaVu Sans'[^;\"]*", "system-ui, sans-serif", svg)
    return (
        f"<figure><h2>{html.escape(title)}</h2>{svg}"
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )


def _signs(margin: str, drawn: tuple[str, ...]) -> tuple[int, ...]:
    """Return the signs with which a required margin is drawn: + and - for a gain margin, else +.

    ``margin`` is the margin's column, and ``drawn`` has the margins that the figure shows. The
    result is empty if the figure does not show this margin.
    """
    if margin == "gain_margin":
        return (1, -1) if "gain_up" in drawn else ()
    return (1,) if margin in drawn else ()


def _margins(figure: "Figure", review: "Review", unit: str) -> None:
    bands = review.bands().sort_values("at")
    axes: Any = figure.subplots(4, sharex=True)
    panels = (("modulus_margin",), ("phase_margin",), ("gain_up", "gain_down"), ("delay_margin",))
    labels = ("modulus (1)", "phase (deg)", "gain (dB)", "delay (s)")
    for ax, names, label in zip(axes, panels, labels, strict=True):
        for name in names:
            low, nominal, high = (
                bands[f"{name}_{end}"].replace([np.inf, -np.inf], np.nan)
                for end in ("low", "nominal", "high")
            )
            ax.fill_between(bands["at"], low, high, color=COLORS[0], alpha=0.25, linewidth=0)
            ax.plot(bands["at"], nominal, ".-", color=COLORS[0], markersize=4)
        for limit in review.limits:
            style = "--" if limit.points == "all" else ":"
            for sign in _signs(limit.margin, names):
                ax.axhline(sign * limit.limit, color=BAD, linewidth=0.9, linestyle=style)
        _mark_unstable(ax, bands)
        ax.set_ylabel(label)
        ax.margins(y=0.15)
        low, high = _widened(*ax.get_ylim())
        ax.set_ylim(low, high)
        if low < 0.5 * high or names == ("gain_up", "gain_down"):
            ax.set_ylim(min(low, 0), max(high, 0))
    axes[-1].set_xlabel(unit)
    figure.align_ylabels(axes)
    key_of(figure, 1)


def _marked(review: "Review") -> str:
    """Return text that explains the marks of unstable fills, or an empty string if none."""
    bands = review.bands()
    if not bands["unstable"].any():
        return ""
    return (
        " that are stable, because an unstable point has no margin. Solid red line: fill with an "
        "unstable nominal point. Dashed red line: fill with another unstable point"
    )


def _mark_unstable(ax: "Axes", bands: pd.DataFrame) -> None:
    """Draw a line at each fill with unstable points, solid if the nominal point is unstable.

    ``bands`` has a row for each fill.
    """
    nominal = bands["modulus_margin_nominal"].isna()
    for chosen, style, label in (
        (nominal, "-", "nominal loop unstable"),
        ((bands["unstable"] > 0) & ~nominal, "--", "unstable within the uncertainty"),
    ):
        for k, at in enumerate(bands.loc[chosen, "at"]):
            ax.axvline(at, color=BAD, linestyle=style, linewidth=1.4, alpha=0.8,
                       label=label if k == 0 else None)  # fmt: skip


def _widened(low: float, high: float) -> tuple[float, float]:
    """Return limits of an axis at least 1 % apart, so that it does not magnify rounding errors."""
    least = 0.01 * max(abs(low), abs(high))
    more = max(least - (high - low), 0) / 2
    return low - more, high + more


def _by_mode(review: "Review") -> list[tuple[str, str, pd.DataFrame]]:
    """Return colour, name and table rows of each slosh mode of a review.

    If there are more modes than colours, the remaining modes share one colour.
    """
    groups = list(review.slosh.groupby("mode", sort=False))
    last = len(COLORS) - 1
    if len(groups) > len(COLORS):
        rest = pd.concat([rows for _, rows in groups[last:]])
        groups = [*groups[:last], ("other modes", rest)]
    return [(COLORS[k], str(mode), rows) for k, (mode, rows) in enumerate(groups)]


def _stabilisation(figure: "Figure", review: "Review") -> None:
    ax = figure.subplots()
    low, high = GAINS
    ax.axhspan(0, high, xmin=0, xmax=0.25, color=COLORS[1], alpha=0.15, linewidth=0)
    ax.axhspan(0, high, xmin=0.75, xmax=1, color=COLORS[1], alpha=0.15, linewidth=0)
    ax.axhline(0, color=SOFT, linewidth=0.8)
    for color, mode, rows in _by_mode(review):
        y = rows["peak"].clip(low + 1, high - 1)
        ax.plot(rows["phase"], y, "o", color=color, markersize=3.5, alpha=0.8, label=mode)
        grows = rows["stabilised"] == "unstable"
        ax.plot(rows["phase"][grows], y[grows], "x", color=BAD, markersize=7)
    words = {"phase": (0, 34), "gain and phase": (0, -46)}
    words |= {"gain alone": (135, -46), "neither": (135, 34)}
    places = [(x * sign, y, text) for text, (x, y) in words.items() for sign in {1, -1 if x else 1}]
    for x, y, text in places:
        ax.text(x, y, text, ha="center", va="center", fontsize=9, color=SOFT)
    ax.set(xlim=(-187, 187), ylim=GAINS, xticks=range(-180, 181, 90))
    ax.set(xlabel="direction of the resonance, 0° away from −1 (deg)", ylabel="peak loop gain (dB)")
    key_of(figure)


def key_of(figure: "Figure", columns: int = 2, shown: Sequence[int] | None = None) -> None:
    """Move the legend of a figure below its axes, where it hides no curve.

    ``shown`` has the indices of the lines in the legend; by default it has all lines.
    """
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if handles:
        rows = range(len(labels)) if shown is None else shown
        figure.legend([handles[k] for k in rows], [labels[k] for k in rows],
                      loc="outside lower center", ncols=columns)  # fmt: skip


def _modes(figure: "Figure", review: "Review", unit: str) -> None:
    axes: Any = figure.subplots(2, sharex=True)
    for color, mode, rows in _by_mode(review):
        at = review.at[rows["fill"].to_numpy(int)]
        axes[0].plot(at, rows["frequency"], "o", color=color, markersize=3, label=mode)
        axes[1].plot(at, 100 * rows["zeta"], "o", color=color, markersize=3)
        axes[1].plot(at, 100 * rows["zeta_closed"], "x", color=color, markersize=5)
        grows = (rows["stabilised"] == "unstable").to_numpy()
        axes[1].plot(at[grows], 100 * rows["zeta_closed"][grows], "x", color=BAD, markersize=8)
    axes[0].set_ylabel("frequency (Hz)")
    axes[1].set(ylabel="damping ratio (%)", xlabel=unit)
    zetas = review.slosh[["zeta", "zeta_closed"]].to_numpy(float)
    if np.nanmin(zetas) > 0 and np.nanmax(zetas) > 10 * np.nanmin(zetas):
        axes[1].set_yscale("log", subs=[2, 5])
        axes[1].yaxis.set_major_formatter("{x:g}")
        axes[1].yaxis.set_minor_formatter("{x:g}")
    figure.align_ylabels(axes)
    key_of(figure)


def _curves(review: "Review") -> list[Curves]:
    """Return, for each command, the loop gain at some fills and at the worst case.

    The fills are up to ``MOST_CURVES`` equally spaced fills, and as many fills at which the nominal
    point is unstable.
    """
    count = len(review.fills)
    chosen = sorted(set(np.linspace(0, count - 1, min(count, MOST_CURVES)).round().astype(int)))
    unstable = [k for k, point in enumerate(review.nominal) if not point.margins.stable]
    chosen = sorted({*chosen, *unstable[:MOST_CURVES]})
    points = [
        (review.fills[k] + (" unstable" if k in unstable else ""), _shade(k / max(count - 1, 1)),
         "-", review.nominal[k])
        for k in chosen
    ]  # fmt: skip
    worst = "worst case" + ("" if review.worst.margins.stable else ", unstable")
    points.append((worst, INK, "--", review.worst))
    tables = [point.margins.crossings for *_, point in points]
    found = []
    for i, name in enumerate(review.worst.gain.inputs):
        gains = [(*words, _broken_at(point.gain, i)) for *words, point in points]
        crossings = pd.concat([table[table["loop"] == name] for table in tables])
        found.append(curves_of(gains, crossings))
    return found


def _shade(share: float) -> str:
    """Return a colour between the palette's first two, which suit both light and dark mode.

    ``share`` is 0 for the first colour and 1 for the second.
    """
    ends = np.array([[0x00, 0x82, 0xC8], [0xE0, 0x6A, 0x10]])
    r, g, b = (ends[0] + share * (ends[1] - ends[0])).round().astype(int)
    return f"#{r:02x}{g:02x}{b:02x}"


def _key(figure: "Figure") -> None:
    """Add a legend with the colours of the first fill, last fill, unstable fills and worst case."""
    _, labels = figure.axes[0].get_legend_handles_labels()
    unstable = [k for k, label in enumerate(labels[:-1]) if label.endswith("unstable")]
    last = len(labels) - 1
    shown = sorted({0, (last - 1) // 2, last - 1, last, *unstable[:4]})
    key_of(figure, 2 if any("unstable" in label for label in labels) else 4, shown)


def _nichols(figure: "Figure", curves: Curves) -> None:
    draw_nichols(figure.subplots(), curves)
    _key(figure)


def _bode(figure: "Figure", curves: Curves) -> None:
    axes: Any = figure.subplots(2, sharex=True)
    draw_bode(*axes, curves)
    figure.align_ylabels(axes)
    _key(figure)


def _draws(figure: "Figure", drawn: pd.DataFrame) -> None:
    axes: Any = figure.subplots(2)
    labels = {"modulus_margin": "modulus margin (1)", "delay_margin": "delay margin (s)"}
    for ax, (name, label) in zip(axes, labels.items(), strict=True):
        margin = drawn[name].where(drawn["stable"], 0.0)
        values = np.sort(margin.replace(np.inf, np.nan).dropna().to_numpy(float))
        share = 100 * np.arange(1, len(values) + 1) / len(drawn)
        ax.step(values, share, where="post", color=COLORS[0])
        ax.set(xlabel=label, ylabel="points below (%)", ylim=(0, 102))
        ax.set_xlim(*_widened(*ax.get_xlim()))


def _what_is_drawn(found: "Confirmation") -> str:
    what = "Largest command" if found.command else "Largest value of each command"
    each = "period of the oscillation" if found.frequency else "fortieth of the run"
    return f"{what} in each {each}"


def _simulated(figure: "Figure", review: "Review", unit: str) -> None:
    """Draw the peaks of the commands (in ``unit``) in the simulation of the worst case."""
    found = review.confirmation
    ax = figure.subplots()
    commands = [found.command] if found.command else list(review.worst.gain.inputs)
    lines = [(factor, run, name) for factor, run in found.runs.items() for name in commands]
    last = max(run[name].abs().iloc[len(run) // 2 :].max() for _, run, name in lines)
    for k, (factor, run, name) in enumerate(lines):
        time, signal = run["time"].to_numpy(), run[name].abs().to_numpy()
        window = 1 / found.frequency if found.frequency else time[-1] / 40
        groups = (time / window).astype(int)
        peaks = pd.Series(signal).groupby(groups).max().iloc[:-1]
        times = pd.Series(time).groupby(groups).mean().iloc[:-1]
        if peaks.iloc[len(peaks) // 2 :].max() > 1e-6 * last:  # leave out axes that are at rest
            text = f"gain × {factor:.4g}" if found.command else name
            ax.plot(times, peaks, "-", color=COLORS[k % len(COLORS)], label=text)
    name = found.command or "size of the command"
    ax.set(yscale="log", xlabel="time (s)", ylabel=f"{name} ({unit})")
    key_of(figure)


def _tables(review: "Review") -> str:
    bands = review.bands()
    head = ("fill", "unstable", "modulus", "phase, deg", "gain up, dB", "gain down, dB", "delay, s")
    names = ("modulus_margin", "phase_margin", "gain_up", "gain_down", "delay_margin")
    # sort fills with an unstable nominal point first, then other fills with unstable points
    first = np.isnan(bands["modulus_margin_nominal"]) * 2 + (bands["unstable"] > 0)
    bands = bands.loc[first.sort_values(ascending=False, kind="stable").index]
    rows = [
        [review.fills[int(row["fill"])], _unstable(row), *(_range(row, name) for name in names)]
        for _, row in bands.iterrows()
    ]
    bad = sum(row["unstable"] > 0 for _, row in bands.iterrows())
    title = "What are the margins at each fill? Nominal (least to largest)"
    parts = [_requirements(review), _unstable_points(review), table_of(title, head, rows, bad)]
    if len(review.slosh):
        head = ("mode", "frequency, Hz", "ζ open, %", "ζ closed, %", "peak, dB", "stabilised by")
        rows, words = [], review.modes()
        for mode in words:  # unstable modes come first
            of = review.slosh[review.slosh["mode"] == mode]
            columns = (of["frequency"], 100 * of["zeta"], 100 * of["zeta_closed"], of["peak"])
            spans = [f"{c.min():.3g} to {c.max():.3g}" for c in columns]
            rows.append([mode, *spans, words[mode]])
        bad = sum(how.startswith("unstable") for how in words.values())
        parts.append(table_of("What do the slosh modes look like over all fills?", head, rows, bad))
    worst = review.worst
    rows = [["fill", review.fills[worst.fill], ""]]
    for quantity, share in zip(review.uncertain, worst.shares, strict=True):
        for name, value in quantity.values(worst.fill, float(share)).items() if share else ():
            shown = short_name(name, worst.loop.tanks)
            rows.append([shown, f"{value:.5g}", f"{quantity.ends[worst.fill][name][1]:.5g}"])
    parts.append(table_of("Where is the worst case?", ("quantity", "worst", "nominal"), rows))
    if review.warnings:
        items = "".join(f"<li>{html.escape(text)}</li>" for text in review.warnings[:8])
        parts.append(f"<section><h2>What do the tanks warn of?</h2><ul>{items}</ul></section>")
    return f'<div class="tables">{"".join(parts)}</div>'


def _requirements(review: "Review") -> str:
    """Return the table of requirements as HTML; empty if there are none."""
    rows, units = [], {str(limit): limit.unit for limit in review.limits}
    for row in review.requirements().itertuples():
        least = f"{row.least:.3g}{units[row.requirement]}" if row.least > -np.inf else "unstable"
        points = f"{row.failing} of {row.points}"
        verdict = "pass" if row.passed else "FAIL"
        rows.append([row.requirement, verdict, least, review.fills[row.fill], points])
    bad = sum(row[1] == "FAIL" for row in rows)
    title = f"Which requirements are met? {len(rows) - bad} of {len(rows)}"
    head = ("requirement", "verdict", "least", "at fill", "points that fail")
    return table_of(title, head, rows, bad) if rows else ""


def _unstable(row: Any) -> str:
    """Return the number of unstable points of a fill, for example "nominal, 3 of 20 points".

    The text begins with "nominal" if the nominal point is unstable.
    """
    if not row["unstable"]:
        return "no"
    nominal = "nominal, " if np.isnan(row["modulus_margin_nominal"]) else ""
    return f"{nominal}{int(row['unstable'])} of {int(row['points'])} points"


def _unstable_points(review: "Review") -> str:
    """Return the table of unstable points as HTML; empty if all points are stable."""
    table = review.unstable()
    if table.empty:
        return ""
    rows = []
    for _, row in table.head(MOST_UNSTABLE).iterrows():
        fill = int(row["fill"])
        values: dict[str, float] = {}
        for quantity in review.uncertain:
            if share := float(row[quantity.name]):
                values |= quantity.values(fill, share)
        named = {short_name(name, review.worst.loop.tanks): x for name, x in values.items()}
        where = ", ".join(f"{name} = {value:.4g}" for name, value in named.items()) or "nominal"
        twice = f"{np.log(2) / row['growth']:.3g}" if row["growth"] > 0 else "never"
        rows.append([review.fills[fill], f"{row['growth']:.3g}", twice, where])
    count = f"{len(table)} of {len(review.points)}"
    shown = f", the {MOST_UNSTABLE} fastest" if len(table) > MOST_UNSTABLE else ""
    title = f"Which points are unstable? {count}{shown}"
    return table_of(title, ("fill", "growth, 1/s", "doubles in, s", "where"), rows, len(rows))


def _range(row: Any, name: str) -> str:
    nominal, low, high = (row[f"{name}_{end}"] for end in ("nominal", "low", "high"))
    if np.isnan(nominal):
        return f"– ({low:.3g} to {high:.3g})" if np.isfinite([low, high]).all() else "none"
    if not np.isfinite([low, high]).all():
        return f"{nominal:.3g}" if np.isfinite(nominal) else "none"
    return f"{nominal:.3g} ({low:.3g} to {high:.3g})"


def table_of(title: str, head: tuple[str, ...], rows: list[list[str]], bad: int = 0) -> str:
    """Return an HTML table.

    The first ``bad`` rows are marked, for example as failed.
    """
    names = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    text, marked = ' class="text"', ' class="bad"'
    body = "".join(
        f"<tr{marked if number < bad else ''}>"
        + "".join(
            f"<td{text if k == len(row) - 1 and len(value) > 40 else ''}>{html.escape(value)}</td>"
            for k, value in enumerate(row)
        )
        + "</tr>"
        for number, row in enumerate(rows)
    )
    return (
        f'<section><h2>{html.escape(title)}</h2><div class="scroll"><table><thead><tr>{names}'
        f"</tr></thead><tbody>{body}</tbody></table></div></section>"
    )
