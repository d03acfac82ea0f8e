"""Draws the damping ratio of a sphere and a capsule over the fill, book/damping.svg.

    PYTHONPATH=harness/python python3 harness/studies/damping_over_fill.py

It needs the program ``hubslosh`` and matplotlib. It computes 90 fills of each tank in a minute.
"""

import io
import subprocess
import tempfile
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pandas as pd

from hubslosh.command import find_program

PICTURE = Path(__file__).resolve().parents[2] / "book" / "damping.svg"
RADIUS = 0.3  # m
DOMES = f"bottom = {RADIUS}, top = {RADIUS}"
SHAPES = {
    "sphere": f"sphere = {{ radius = {RADIUS} }}",
    "capsule, cylinder of 0.4 m": (
        f"domed_cylinder = {{ radius = {RADIUS}, height = 0.4, {DOMES} }}"
    ),
}
NU, GRAVITY = 1e-6, 0.3  # m²/s, m/s²


def damping(shape: str, fills: list[str]) -> pd.DataFrame:
    """Return the damping ratio of mode 1 at each fill, with its interval, by ``hubslosh tank``.

    ``shape`` is the shape in the notation of a tank file.
    """
    with tempfile.TemporaryDirectory() as folder:
        tank = Path(folder) / "tank.toml"
        tank.write_text(f"density = 1000\nshape = {{ {shape} }}\n", encoding="utf-8")
        command = [find_program(None), "tank", tank, "--modes=1", f"--sweep={','.join(fills)}"]
        command += [f"--nu={NU}", f"--gravity={GRAVITY}"]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return pd.read_csv(io.StringIO(done.stdout))


def main() -> None:
    mpl.rcParams["svg.hashsalt"] = "hubslosh"
    percent = list(range(5, 95))
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    for (name, shape), color in zip(SHAPES.items(), ("#0072b2", "#d55e00"), strict=True):
        found = damping(shape, [f"{share}%" for share in percent])
        axes.plot(percent, 100 * found["zeta_1"], color=color, label=name)
        ends = (100 * found["zeta_low_1"], 100 * found["zeta_high_1"])
        axes.fill_between(percent, *ends, color=color, alpha=0.15, linewidth=0)
        fall = found["zeta_1"].pct_change().min()
        print(f"{name}: largest fall {100 * fall:.1f} % per 1 % of the volume")
    axes.set_xlabel("fill, % of the volume")
    axes.set_ylabel("damping ratio of mode 1, %")
    axes.set_ylim(0, 2.5)
    axes.set_title("A capsule leaves the sphere's damping without a step")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)
    figure.savefig(PICTURE, metadata={"Date": None, "Creator": None})
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
