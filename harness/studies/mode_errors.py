"""Draws the error of the slosh force over the number of modes, book/mode_errors.svg.

    PYTHONPATH=harness/python python3 harness/studies/mode_errors.py

It needs dist/HubSlosh.fmu (``cargo run --release -- pack``) and the packages in requirements.txt.
The picture is figure 4.4 of Rubaga's thesis for both fills of the bench. It also has the error
within the frequency band of the sweeps.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

import hubslosh
from hubslosh import plot

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "dist" / "HubSlosh.fmu"
PICTURE = ROOT / "book" / "mode_errors.svg"
BELOW = 3.5  # Hz, the end of the sweeps


def draw(picture: Path) -> None:
    """Compute the errors, print them, and draw the picture."""
    mpl.rcParams["svg.hashsalt"] = "hubslosh"
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    for fill, color in ((0.1, plot.COLORS[0]), (0.05, plot.COLORS[1])):
        errors = hubslosh.mode_errors({"tank.h": fill}, BELOW, FMU)
        fewer = errors.iloc[:-1]
        label = f"{100 * fill:g} cm"
        axes.semilogy(
            fewer.index,
            100 * fewer["impulse"],
            "o-",
            color=color,
            label=f"after an impulse, {label}",
        )
        axes.semilogy(
            fewer.index, 100 * fewer["band"], "s--", color=color,
            label=f"below {BELOW} Hz, of the liquid's mass, {label}",
        )  # fmt: skip
        print(label, errors.attrs["needed"], errors.to_string(), sep="\n")
    for percent in (5, 1):
        axes.axhline(percent, color="#888888", linewidth=0.8)
        axes.annotate(f"{percent} %", (9, percent), textcoords="offset points", xytext=(-4, 3))
    axes.set_xlabel("slosh modes kept (reference: 10)")
    axes.set_ylabel("error of the force on the tank, %")
    axes.set_title("What fewer modes cost: much after an impulse, little in a band")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=9)
    figure.savefig(picture, metadata={"Date": None, "Creator": None})
    print(f"wrote {picture}")


if __name__ == "__main__":
    draw(PICTURE)
