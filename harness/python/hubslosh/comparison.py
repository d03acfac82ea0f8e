"""Comparison of designs: the margins of several design reviews in one table and on one page."""

import html
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .curves import curves_of, draw_nichols
from .fmu import FmuError
from .plot import COLORS
from .requirements import margins_of
from .review import Review
from .review_page import document, figure_of, key_of, table_of
from .short import ShortTable
from .stability import _broken_at
from .temporary import write_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = len(COLORS)  # Largest number of designs on a page, because each needs its own colour

# Margins that are compared, with their labels. The gain margin is the smaller of the margins for an
# increase and for a decrease of the gain.
MARGINS = {
    "modulus_margin": "modulus (1)", "phase_margin": "phase (deg)", "gain_margin": "gain (dB)",
    "delay_margin": "delay (s)",
}  # fmt: skip


def compare(reviews: Mapping[str, Review], out: str | Path | None = None) -> pd.DataFrame:
    """Return the smallest margins of several designs; optionally write a page of comparison.

    Parameters
    ----------
    reviews : mapping of Review
        Reviews by the names of the designs, or of the cases of one design; two to six.
    out : str or Path, optional
        Also write the page to this .html file; needs matplotlib.

    Returns
    -------
    DataFrame
        A row for each design. ``passed`` is true if all operating points are stable and all
        requirements are met. ``points`` is the number of operating points, and ``unstable`` the
        number of unstable ones. ``modulus_margin``, ``phase_margin`` (deg), ``gain_margin`` (dB)
        and ``delay_margin`` (s) are the smallest margins over all operating points; they are NaN
        if a point is unstable. ``fill`` is the fill of the worst operating point in words, and
        ``failing`` the number of requirements that fail.

    Raises
    ------
    FmuError
        If there are fewer than two or more than six reviews, or the page cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
    >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
    >>> gains = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
    >>> designs = {name: craft.review(k * gains, 0.1, ["50%"], draws=0)
    ...            for name, k in {"slow": 1, "fast": 4}.items()}
    >>> hubslosh.compare(designs, "comparison.html")["passed"].to_dict()
    {'slow': True, 'fast': True}
    """
    given = isinstance(reviews, Mapping) and all(isinstance(r, Review) for r in reviews.values())
    if not given or not 2 <= len(reviews) <= MOST:
        raise FmuError(
            f'compare takes two to {MOST} reviews by name, such as {{"PD": first, "notch": second}}'
        )
    rows = {str(name): _row(review) for name, review in reviews.items()}
    table = ShortTable.from_dict(rows, orient="index")
    if out is not None:
        write_file(out, ".html", lambda: _page(reviews, table))
    return table


def _margins_of(review: Review) -> pd.DataFrame:
    return review.points[["kind", "fill", "stable"]].join(margins_of(review.points))


def _row(review: Review) -> dict[str, Any]:
    points = _margins_of(review)
    stable = bool(points["stable"].all())
    least = {name: float(points[name].min()) if stable else np.nan for name in MARGINS}
    return {
        "passed": review.passed, "unstable": int((~points["stable"]).sum()), "points": len(points),
        **least, "fill": review.fills[review.worst.fill],
        "failing": int((~review.requirements()["passed"].astype(bool)).sum()),
    }  # fmt: skip


def _page(reviews: Mapping[str, Review], table: pd.DataFrame) -> str:
    title = f"Comparison of {len(reviews)} designs"
    answers = "".join(
        f'<p class="answer{"" if review.passed else " bad"}"><b>{html.escape(name)}</b>: '
        f"{html.escape(review.summary)}</p>"
        for name, review in reviews.items()
    )
    figures = [
        figure_of(
            "Which design has more margin at each fill?",
            "Line: nominal case. Dashed: smallest margin of all points, drawn only while all are "
            "stable.",
            5.6, lambda figure: _over_fills(figure, reviews),
        ),
        figure_of(
            "How likely is a small margin?",
            "All points of each design; an unstable one has the margin 0.",
            3.2, lambda figure: _shares(figure, reviews),
        ),
    ]  # fmt: skip
    commands = {review.worst.gain.inputs for review in reviews.values()}
    for i, name in enumerate(commands.pop() if len(commands) == 1 else ()):
        figures.append(
            figure_of(
                f"How close does the loop of {name} come to −1 at the worst case?",
                "Nichols diagram of each design's worst case. Cross: −1. Closed contour: modulus "
                "margin 0.5.",
                3.9,
                lambda figure, i=i: _worst(figure, reviews, i),
            )
        )
    head = ("design", "verdict", "unstable", "modulus", "phase, deg", "gain, dB", "delay, s",
            "worst fill", "requirements that fail")  # fmt: skip
    order = table.sort_values(["passed", "unstable"], ascending=[True, False], kind="stable")
    rows = [
        [str(name), "pass" if row["passed"] else "FAIL", f"{row['unstable']} of {row['points']}",
         *("unstable" if np.isnan(row[m]) else f"{row[m]:.3g}" for m in MARGINS), row["fill"],
         f"{row['failing']} of {len(reviews[str(name)].limits)}"]
        for name, row in order.iterrows()
    ]  # fmt: skip
    bad = int((~table["passed"].astype(bool)).sum())
    least = table_of("What are the least margins over all points?", head, rows, bad)
    facts = [
        [name, "; ".join(f"{u.name} {u.text}" for u in review.uncertain) or "nothing"]
        for name, review in reviews.items()
    ]
    varied = table_of("What is uncertain?", ("design", "ranges"), facts)
    body = (
        f'{answers}\n<div class="figures">\n{"".join(figures)}\n</div>\n'
        f'<div class="tables">{least}{varied}</div>'
    )
    return document(title, body)


def _colored(reviews: Mapping[str, Review]) -> "zip[tuple[str, str, Review]]":
    return zip(COLORS, reviews, reviews.values(), strict=False)


def _over_fills(figure: "Figure", reviews: Mapping[str, Review]) -> None:
    axes: Any = figure.subplots(len(MARGINS), sharex=True)
    units = {review.unit for review in reviews.values()}
    for color, name, review in _colored(reviews):
        points = _margins_of(review)
        groups = points.groupby("fill")
        nominal = points[points["kind"] == "nominal"].set_index("fill")
        stable = groups["stable"].all()
        order = np.argsort(review.at)
        at = review.at[order]
        for ax, margin in zip(axes, MARGINS, strict=True):
            least = groups[margin].min().where(stable).replace(np.inf, np.nan)
            line = nominal[margin].replace(np.inf, np.nan)
            ax.plot(at, line.to_numpy()[order], ".-", color=color, markersize=4, label=name)
            ax.plot(at, least.to_numpy()[order], "--", color=color, linewidth=1)
    for ax, label in zip(axes, MARGINS.values(), strict=True):
        ax.set_ylabel(label)
        ax.margins(y=0.15)
    percent = units == {"%"}
    axes[-1].set_xlabel("fill (% of the volume)" if percent else "fill (as each design has it)")
    figure.align_ylabels(axes)
    key_of(figure)


def _shares(figure: "Figure", reviews: Mapping[str, Review]) -> None:
    ax = figure.subplots()
    for color, name, review in _colored(reviews):
        points = review.points
        values = np.sort(points["modulus_margin"].where(points["stable"], 0.0).to_numpy(float))
        share = 100 * np.arange(1, len(values) + 1) / len(values)
        ax.step(values, share, where="post", color=color, label=name)
    ax.set(xlabel="modulus margin (1)", ylabel="points below (%)", ylim=(0, 102))
    key_of(figure)


def _worst(figure: "Figure", reviews: Mapping[str, Review], command: int) -> None:
    gains, tables = [], []
    for color, name, review in _colored(reviews):
        point = review.worst
        text = name + ("" if point.margins.stable else ", unstable")
        gains.append((text, color, "-", _broken_at(point.gain, command)))
        table = point.margins.crossings
        tables.append(table[table["loop"] == point.gain.inputs[command]])
    draw_nichols(figure.subplots(), curves_of(gains, pd.concat(tables)))
    key_of(figure)
