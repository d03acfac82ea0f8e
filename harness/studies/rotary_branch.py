"""Draws the effect of rotary slosh on the bench, book/rotary.svg, the picture in the README.

    PYTHONPATH=harness/python python3 harness/studies/rotary_branch.py

It needs dist/HubSlosh.fmu (``cargo run --release -- pack``) and the packages in requirements.txt.
It simulates one sine sweep of 0.2 N·m, 1.25 to 3.5 Hz in 2700 s, with the linear and the spherical
model, in some seconds.
"""

from pathlib import Path

import numpy as np
import pandas as pd

import hubslosh

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "dist" / "HubSlosh.fmu"
PICTURE = ROOT / "book" / "rotary.svg"

AMPLITUDE = 0.2  # N·m
FIRST, LAST, DURATION = 1.25, 3.5, 2700.0  # Hz, Hz, s
STEP = 0.02  # s
WINDOW = 2.0  # window of several cycles, s, in which the frequency changes by 2 mHz
SHOWN = (2.2, 3.1)  # frequency range of the picture, Hz
PATHS = (2.3, 2.6, 2.85, 3.05)  # frequencies at which paths of the liquid are drawn, Hz

SIZE = (880, 560)
STYLE = """
svg{font:13px system-ui,sans-serif}
svg{--ink:#1b2530;--page:#fff;--grid:#8884;--a:#0072b2;--b:#d55e00;--c:#6b7785}
@media(prefers-color-scheme:dark){
svg{--ink:#dfe6ee;--page:#141b23;--a:#56b4e9;--b:#f0a04b;--c:#9aa7b5}
}
rect{fill:var(--page)}text{fill:var(--ink)}path{fill:none;stroke-linejoin:round}
.grid{stroke:var(--grid)}.frame{stroke:var(--ink);stroke-width:.8}
.a{stroke:var(--a);stroke-width:1.8}.b{stroke:var(--b);stroke-width:1.8}
.c{stroke:var(--c);stroke-width:1.8;stroke-dasharray:5 3}
text.a{fill:var(--a);stroke:none}text.b{fill:var(--b);stroke:none}text.c{fill:var(--c);stroke:none}
.small{font-size:11.5px}.end{text-anchor:end}.middle{text-anchor:middle}
"""


def sweep(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return frequency (Hz) and torque (N·m) of the sweep, whose frequency grows exponentially."""
    rate = np.log(LAST / FIRST) / DURATION
    phase = 2 * np.pi * FIRST * np.expm1(rate * time) / rate
    return FIRST * np.exp(rate * time), AMPLITUDE * np.sin(phase)


def drive(model: str, inputs: pd.DataFrame) -> pd.DataFrame:
    outputs = ["omega", "slosh_angle", "slosh_angle_radial"]
    return hubslosh.simulate(FMU, parameters={"slosh.model": model}, inputs=inputs, outputs=outputs)


def envelope(signal: pd.Series) -> np.ndarray:
    """Return the largest magnitude of a signal in each window."""
    count = round(WINDOW / STEP)
    whole = len(signal) // count * count
    return np.abs(signal.to_numpy()[:whole]).reshape(-1, count).max(axis=1)


class Panel:
    """A pair of linear axes in an SVG drawing."""

    def __init__(self, box: tuple, x: tuple, y: tuple, ticks: tuple, labels: tuple):
        """Create the axes in ``box`` (left, top, right, bottom, px).

        ``x`` and ``y`` are the ranges; ``ticks`` and ``labels`` have entries for both axes.
        """
        (self.left, self.top, self.right, self.bottom), self.x, self.y = box, x, y
        self.parts = []
        for value in ticks[0]:
            at, _ = self.at(value, y[0])
            self.parts.append(f'<path class="grid" d="M{at:.1f} {self.top}V{self.bottom}"/>')
            below = f'x="{at:.1f}" y="{self.bottom + 16}"'
            self.parts.append(f'<text class="small middle" {below}>{value:g}</text>')
        for value in ticks[1]:
            _, at = self.at(x[0], value)
            self.parts.append(f'<path class="grid" d="M{self.left} {at:.1f}H{self.right}"/>')
            beside = f'x="{self.left - 6}" y="{at + 4:.1f}"'
            self.parts.append(f'<text class="small end" {beside}>{value:g}</text>')
        middle = (self.left + self.right) / 2
        if labels[0]:
            self.text(middle, self.bottom + 34, labels[0], "middle")
        if labels[1]:
            self.text(self.left, self.top - 8, labels[1], "")
        frame = f"M{self.left} {self.top}V{self.bottom}H{self.right}"
        self.parts.append(f'<path class="frame" d="{frame}"/>')

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the coordinates of a point in the drawing, px."""
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        width, height = self.right - self.left, self.bottom - self.top
        return self.left + across * width, self.bottom - up * height

    def line(self, x: np.ndarray, y: np.ndarray, style: str) -> None:
        """Draw a curve."""
        points = (self.at(*point) for point in zip(x, y, strict=True))
        path = "L".join(f"{px:.1f} {py:.1f}" for px, py in points)
        self.parts.append(f'<path class="{style}" d="M{path}"/>')

    def text(self, x: float, y: float, words: str, style: str) -> None:
        """Write text at the coordinates ``x`` and ``y``, px."""
        self.parts.append(f'<text class="{style}" x="{x:.1f}" y="{y:.1f}">{words}</text>')


def picture(frequency: np.ndarray, linear: pd.DataFrame, spherical: pd.DataFrame) -> str:
    """Return the picture of both sweeps as SVG text."""
    middle = frequency[round(WINDOW / STEP / 2) :: round(WINDOW / STEP)]
    seen = (middle >= SHOWN[0]) & (middle <= SHOWN[1])

    def curve(signal: pd.Series, scale: float = 1.0) -> np.ndarray:
        return envelope(signal)[: len(middle)][seen] * scale

    degrees = np.degrees(1.0)
    axis, marks = middle[: len(seen)][seen], (2.2, 2.4, 2.6, 2.8, 3.0)
    angles = Panel(
        (58, 62, 600, 290), SHOWN, (0, 75), (marks, (0, 20, 40, 60)), ("", "slosh amplitude, °")
    )
    angles.line(axis, curve(linear["slosh_angle"], degrees), "c")
    angles.line(axis, curve(spherical["slosh_angle"], degrees), "a")
    angles.line(axis, curve(spherical["slosh_angle_radial"], degrees), "b")
    for i, (words, style) in enumerate(
        [
            ("spherical, tangential", "a"),
            ("spherical, radial: rotary slosh", "b"),
            ("linear", "c"),
        ]
    ):
        angles.text(592, 80 + 17 * i, words, f"{style} end")
    gain = Panel(
        (58, 330, 600, 510),
        SHOWN,
        (-45, 25),
        (marks, (-40, -20, 0, 20)),
        ("frequency of the sweep, Hz", "hub rate over torque, dB re 1 rad/s per N·m"),
    )
    for run, style in ((linear, "c"), (spherical, "a")):
        gain.line(axis, 20 * np.log10(curve(run["omega"]) / AMPLITUDE), style)
    parts = angles.parts + gain.parts
    side = 96
    for i, at in enumerate(PATHS):
        left, top = 640 + (i % 2) * 122, 72 + (i // 2) * 150
        limit = 55.0
        box = (left, top, left + side, top + side)
        panel = Panel(box, (-limit, limit), (-limit, limit), ((), ()), ("", f"{at} Hz"))
        start = int(np.searchsorted(frequency, at))
        part = spherical.iloc[start : start + round(3 / STEP)] * degrees
        panel.line(part["slosh_angle_radial"].to_numpy(), part["slosh_angle"].to_numpy(), "a")
        parts += panel.parts
    words = [
        "Path of the liquid seen from above,",
        "radial across, tangential up, ±55°:",
        "planar below the slosh frequency,",
        "then rotary up to a jump back.",
    ]
    for i, line in enumerate(words):
        parts.append(f'<text class="small" x="640" y="{368 + 17 * i}">{line}</text>')
    title = f"Sine sweep of {AMPLITUDE} N·m upwards through the slosh frequency, 10 cm of water"
    parts.append(f'<text x="58" y="26" style="font-weight:600;font-size:15px">{title}</text>')
    width, height = SIZE
    opening = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">'
    background = f'<rect width="{width}" height="{height}"/>'
    return f"{opening}<style>{STYLE}</style>{background}{''.join(parts)}</svg>\n"


def draw() -> str:
    """Simulate both sweeps, and return the picture as SVG text."""
    time = np.arange(round(DURATION / STEP) + 1) * STEP
    frequency, torque = sweep(time)
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    return picture(frequency, drive("linear", inputs), drive("spherical", inputs))


if __name__ == "__main__":
    PICTURE.write_text(draw(), encoding="utf-8")
    print(f"wrote {PICTURE}")
