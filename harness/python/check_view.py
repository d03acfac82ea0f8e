"""Compare pages of ``hubslosh view`` with the tables that they show, in a browser.

Makes three runs: a sweep with rotary slosh, a slew in six axes with two tanks, a tank that drains.
Of each, at three instants, the bobs that are drawn are read back and compared with where the
table's numbers put them; so is the wave at the wall. Contrast and the rest of WCAG 2 AA are
axe-core's to judge. Leaves nine screenshots.

Needs Playwright (``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` gets both.
"""

import argparse
import csv
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

import contrast

Row = dict[str, float]
Vector = Sequence[float]

XI = 1.8411837813406595
"""First zero of J1'."""

SINGLE = 1e-6
"""m per m of reach: a page holds numbers of 32 bits."""

VIEWS = ((1400, "light"), (400, "light"), (1400, "dark"))
"""Width, px, and colours at the three instants."""


@dataclass(frozen=True)
class Drawn:
    """What one tank's mode should look like, body axes, m."""

    hinge: Vector
    bob: Vector
    level: float
    wall: tuple[float, float] | None
    """Elevation at the wall along the tank's x and y."""


@dataclass(frozen=True)
class Case:
    """A run, how it is shown, and where its bobs are by the table's numbers."""

    name: str
    fmu: str
    run: list[str]
    instants: tuple[float, float, float]
    expected: Callable[[Row], list[list[Drawn]]]
    inputs: Callable[[float], Row] | None = None


def sweep(row: Row) -> list[list[Drawn]]:
    """Sines of the slosh angles are displacements over the pendulum's length."""
    radius, depth, arm = 0.163 / 2, 0.1, 0.225
    u = XI * depth / radius
    length = radius / (XI * math.tanh(u))
    hinge = depth - radius / XI * (math.tanh(u / 2) - 1 / math.sinh(u))
    angles = row["slosh_angle_radial"], row["slosh_angle"]
    x, y = map(math.sin, angles)
    bob = arm + length * x, length * y, hinge - length * math.sqrt(1 - x * x - y * y)
    wave = 2 * radius / (XI**2 - 1)
    wall = wave * angles[0], wave * angles[1]
    return [[Drawn((arm, 0, hinge), bob, depth, wall)]]


def slew(row: Row) -> list[list[Drawn]]:
    """Two tanks: one of known modes, one by diameter and depth, above it and turned by 90°."""
    lower = modes(row, "tank[1]", [(0.136534, 0.248039, 0.376618)], (0, 0, -0.55), 0.3)
    radius, depth = 0.4, 0.35
    upper = []
    for xi in (XI, 5.3314427735250325):
        u = xi * depth / radius
        length = radius / (xi * math.tanh(u))
        hinge = depth - radius / xi * (math.tanh(u / 2) - 1 / math.sinh(u))
        upper.append((hinge, length, 2 * radius / (xi**2 - 1)))
    turned = modes(row, "tank[2]", upper, (0, 0, 0), depth)

    def place(r: Vector) -> Vector:
        # q = (1, 0, 0, 1), normalised, turns x to y
        return (-r[1], r[0], r[2] + 0.45)

    upper_drawn = [Drawn(place(d.hinge), place(d.bob), d.level, d.wall) for d in turned]
    return [lower, upper_drawn]


def modes(
    row: Row, prefix: str, data: list[tuple[float, float, float]], at: Vector, level: float
) -> list[Drawn]:
    """Return a tank's modes, each with hinge, length and wave; the wall has all of them."""
    p = [[row[f"{prefix}.p[{n},{i}]"] for i in (1, 2, 3)] for n in range(1, len(data) + 1)]
    wall = [sum(w * math.asin(p[n][i]) for n, (_, _, w) in enumerate(data)) for i in (0, 1)]
    found = []
    for (hinge, length, _), direction in zip(data, p, strict=True):
        top = (at[0], at[1], at[2] + hinge)
        bob = [a + length * b for a, b in zip(top, direction, strict=True)]
        found.append(Drawn(top, bob, level, (wall[0], wall[1])))
    return found


def drain(row: Row) -> list[list[Drawn]]:
    """Take the table with which the FMU starts: a cylinder of 0.9 m, its bottom at -0.3 m."""
    radius = 0.45
    depth = row["tank.liquid"] / (1000 * math.pi * radius**2)
    u = XI * depth / radius
    length = radius / (XI * math.tanh(u))
    hinge = depth - radius / XI * (math.tanh(u / 2) - 1 / math.sinh(u)) - 0.3
    data = [(hinge, length, 2 * radius / (XI**2 - 1))]
    return [modes(row, "tank", data, (0, 0, -0.45), depth - 0.3)]


def pulse(t: float, begin: float, end: float) -> float:
    """Return a smooth pulse, 0 to 1."""
    return math.sin(math.pi * (t - begin) / (end - begin)) ** 2 if begin < t < end else 0.0


def torques(t: float) -> Row:
    """Return the torques of a slew about three axes, under thrust."""
    return {
        "torque[1]": 24 * (pulse(t, 2, 14) - pulse(t, 14, 26)),
        "torque[2]": 16 * (pulse(t, 5, 17) - pulse(t, 17, 29)),
        "torque[3]": 8 * (pulse(t, 2, 20) - pulse(t, 20, 38)),
        "force[3]": 600.0,
    }


def shaken(t: float) -> Row:
    """Return what shakes a tank sideways while it drains."""
    flow = 4.5 if 2 < t < 58 else 0.0
    return {"mass_flow": flow, "a[1]": 0.25 * math.sin(4.4 * t)}


COLUMNS = {
    "sweep": "theta,omega,slosh_angle,slosh_angle_radial,wave_height,tau_actuator,tau_friction,"
    "tau_fluid,F_radial,F_tangential,wheel_speed",
    "slew": "q[1],q[2],q[3],q[4],omega[1],omega[2],omega[3],slosh_torque[1],slosh_torque[2],"
    "slosh_torque[3],tank[1].p[1,1],tank[1].p[1,2],tank[1].p[1,3],tank[2].p[1,1],tank[2].p[1,2],"
    "tank[2].p[1,3],tank[2].p[2,1],tank[2].p[2,2],tank[2].p[2,3],tank[1].wave_height,"
    "tank[2].wave_height,tank[1].force[1],tank[1].force[2],tank[1].force[3],tank[2].force[1],"
    "tank[2].force[2],tank[2].force[3]",
    "drain": "force[1],force[2],force[3],torque[1],torque[2],torque[3],tank.p[1,1],tank.p[1,2],"
    "tank.p[1,3],tank.wave_height,tank.liquid",
}
"""What is recorded."""

TWO_TANKS = (
    "tanks=2 tank[1].position[3]=-0.55 tank[2].position[3]=0.45 tank[2].q[1]=1 tank[2].q[4]=1 "
    "tank[2].diameter=0.8 tank[2].depth=0.35 tank[2].modes=2"
)


def settings(text: str) -> list[str]:
    """Return flags that set what stands between spaces."""
    return [part for name in text.split() for part in ("--set", name)]


CASES = (
    Case(
        "sweep",
        "HubSlosh",
        ["--profile", "exp-sweep:amplitude=0.25,duration=600", *settings("slosh.model=spherical")],
        (300.0, 420.02, 460.5),
        sweep,
    ),
    Case("slew", "Spacecraft", settings(TWO_TANKS), (9.0, 22.5, 47.98), slew, torques),
    Case(
        "drain",
        "SloshTank",
        settings("tank.fill.points=12 a[3]=2.5"),
        (4.0, 30.0, 56.5),
        drain,
        shaken,
    ),
)


def rows(file: Path) -> list[Row]:
    """Return a table's rows."""
    with file.open(newline="") as text:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(text)]


def record(case: Case, binary: Path, fmus: Path, folder: Path) -> tuple[Path, Path]:
    """Make the run and its page; return its table as CSV and the page."""
    run, page = folder / f"{case.name}.parquet", folder / f"{case.name}.html"
    drive = []
    if case.inputs:
        table = folder / f"{case.name}_inputs.csv"
        times = [0.02 * k for k in range(3001)]
        lines = [case.inputs(t) for t in times]
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time", *lines[0]])
            writer.writerows([t, *line.values()] for t, line in zip(times, lines, strict=True))
        drive = ["--input", table]
    common = [
        binary,
        "run",
        *case.run,
        *drive,
        "--columns",
        COLUMNS[case.name],
        "--fmu",
        fmus / f"{case.fmu}.fmu",
        "--out",
    ]
    for out in (run, run.with_suffix(".csv")):
        subprocess.run([*common, out], check=True)
    subprocess.run(
        [binary, "view", run, "--fmu", fmus / f"{case.fmu}.fmu", "--out", page], check=True
    )
    return run.with_suffix(".csv"), page


def opened(browser: Browser, page: Path, width: int, scheme: str) -> Page:
    """Open a page and wait until it is drawn; anything fetched is an error."""
    found = browser.new_page(
        viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
    )
    faults: list[str] = []
    found.on("pageerror", lambda error: faults.append(str(error)))
    found.on(
        "request",
        lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else faults.append(r.url),
    )
    found.goto(page.absolute().as_uri())
    found.wait_for_function("document.documentElement.dataset.drawn === 'yes'", timeout=180_000)
    assert not faults, f"faults or fetched: {faults[:3]}"
    assert not found.evaluate("hubsloshView.playing"), "it plays by itself"
    return found


def compare(page: Page, case: Case, row: Row, reach: float) -> float:
    """Return the largest distance between what is drawn and the table's numbers, m."""
    page.evaluate(f"hubsloshView.seek({row['time']!r})")
    tanks = page.evaluate("hubsloshView.read()")
    wanted = case.expected(row)
    assert len(tanks) == len(wanted), f"{case.name}: {len(tanks)} tanks"
    # the numbers of the table over the fill have six digits and are interpolated; from six digits
    # of masses follows the level of a tank whose outline nobody knows
    allowed = reach * (2e-3 if case.name == "drain" else SINGLE)
    of_level = reach * (2e-3 if case.name == "drain" else 1e-4)
    worst = 0.0
    for tank, modes_ in zip(tanks, wanted, strict=True):
        assert len(tank["modes"]) == len(modes_)
        for found, mode in zip(tank["modes"], modes_, strict=True):
            worst = max(worst, math.dist(found["hinge"], mode.hinge))
            worst = max(worst, math.dist(found["bob"], mode.bob))
        off = abs(tank["level"] - modes_[0].level)
        assert off < of_level, f"{case.name} at {row['time']} s: the level is {off} m off"
        worst = max(worst, math.dist(tank["wall"], modes_[0].wall or tank["wall"]))
    assert worst < allowed, f"{case.name} at {row['time']} s: {worst} m off (allowed: {allowed})"
    return worst


def keys(page: Page) -> None:
    """Play, pause, step, jump, turn the view, all by keyboard."""
    now = "hubsloshView.now"
    page.keyboard.press("Home")
    assert page.evaluate(f"{now} === hubsloshView.first")
    page.keyboard.press("ArrowRight")
    assert page.evaluate(f"{now} === hubsloshView.timeOf(1)")
    page.keyboard.press("Space")
    page.wait_for_function(f"{now} > hubsloshView.timeOf(3)", timeout=20_000)
    page.keyboard.press("Space")
    assert not page.evaluate("hubsloshView.playing")
    page.focus("#scene canvas")
    before = page.evaluate("hubsloshView.scene.canvas.toDataURL()")
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(500)
    assert page.evaluate(f"{now}") < page.evaluate("hubsloshView.last")
    assert before is not None
    reached = []
    page.evaluate("document.activeElement.blur()")
    for _ in range(12):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    assert {"CANVAS", "play", "time", "speed", "wave", "window"} <= set(reached), reached
    page.click(".plot >> nth=0", position={"x": 150, "y": 50})
    span = page.evaluate("[hubsloshView.now, hubsloshView.first, hubsloshView.last]")
    assert span[1] < span[0] < span[2], "a click on a plot goes nowhere"


def main() -> None:
    """Check all cases; exit with 1 and a sentence if one is not drawn as its table says."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("binary", type=Path, help="the program hubslosh")
    parser.add_argument("fmus", type=Path, help="the folder with the packed FMUs")
    parser.add_argument("axe", type=Path, help="axe.min.js of npm's axe-core")
    parser.add_argument("out", type=Path, help="a folder for runs, pages and screenshots")
    arguments = parser.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no chromium: .ci/browser installs it")
    arguments.out.mkdir(parents=True, exist_ok=True)
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=flags)
        for case in CASES:
            table, file = record(case, arguments.binary, arguments.fmus, arguments.out)
            data = rows(table)
            text = file.read_text(encoding="utf-8")
            assert len(text) < 9e6, f"{case.name}: {len(text)} bytes"
            found = re.search(r'id="run">(.*?)</script>', text, re.DOTALL)
            assert found
            reach = json.loads(found[1])["scene"]["geometry"]["reach"]
            worst = 0.0
            for instant, (width, scheme) in zip(case.instants, VIEWS, strict=True):
                page = opened(browser, file, width, scheme)
                row = min(data, key=lambda row: abs(row["time"] - instant))
                worst = max(worst, compare(page, case, row, reach))
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                contrast.demand(page, arguments.axe, f"{case.name}, {scheme}, {width} px")
                page.wait_for_timeout(300)
                shot = f"{case.name}_{instant:g}s_{width}_{scheme}.png"
                page.screenshot(path=arguments.out / shot)
                if width == VIEWS[0][0] and scheme == "dark":
                    keys(page)
                page.close()
            times = ", ".join(f"{t:g}" for t in case.instants)
            print(f"{case.name}: at {times} s bobs and waves are within {worst:.1e} m of the table")
        browser.close()


if __name__ == "__main__":
    main()
