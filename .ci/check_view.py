"""Compare pages of ``hubslosh view`` in a browser with the tables that they show.

Five runs are made: a sweep with rotary slosh, a run with four modes, a slew in six axes with two
tanks, a tank that drains, and a sphere. At three instants of each page the positions of the drawn
bobs and the waves at the wall are compared with the table, and the waves also with the FMU's
wave_height. The drawn surface must move the liquid's centre of mass as far as the pendulums do.
axe-core checks contrast and the other rules of WCAG 2 AA. A unit of the FMU that looks like markup
must be shown as text. Fifteen screenshots are written.

This needs Playwright (``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` installs
both.
"""

import argparse
import csv
import html
import json
import math
import re
import subprocess
import tomllib
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Page

import contrast
from pages import chromium, open_page

Row = dict[str, float]
Vector = Sequence[float]

XI = (1.8411837813406593, 5.3314427735250325, 8.536316366346285, 11.706004902592063)
"""Zeros of J1'."""

SINGLE = 1e-6
"""Tolerance in m per m of the scene's size: a page stores 32-bit numbers."""

HIDDEN = """() => {
  const legend = document.querySelector(".hs-legend").getBoundingClientRect();
  return [...document.querySelectorAll(".hs-axis")].filter((letter) => {
    const { left, right, top, bottom } = letter.getBoundingClientRect();
    const beside = right < legend.left || left > legend.right;
    return !(beside || bottom < legend.top || top > legend.bottom);
  }).map((letter) => letter.textContent);
}"""
"""Script that returns the axes whose letters lie under the legend."""

VIEWS = ((1400, "light"), (400, "light"), (1400, "dark"))
"""Width (px) and colour scheme at each of the three instants."""


@dataclass(frozen=True)
class Drawn:
    """Expected position of one slosh mode's bob (the drawn slosh mass) in body axes, m."""

    hinge: Vector
    bob: Vector
    level: float
    wall: tuple[float, float]
    """Elevation of the wave at the wall along the tank's x and y, all modes together, m."""
    moved: tuple[float, float]
    """m l times this mode's slosh angle along x and y, over the density, m⁴."""


@dataclass(frozen=True)
class Mode:
    """Data of one slosh mode: heights and lengths in m, ``wave`` in m/rad, ``moment`` in m⁴."""

    hinge: float
    length: float
    wave: float
    moment: float
    """m l over the density, which is the first moment of the surface per slosh angle."""


def cylinder(n: int, radius: float, depth: float) -> Mode:
    """Return mode ``n`` (from 0) of an upright cylinder (NASA SP-106); heights from its bottom.

    ``radius`` and ``depth`` (of the liquid) are in m.
    """
    xi = XI[n]
    u = xi * depth / radius
    length = radius / (xi * math.tanh(u))
    hinge = depth - radius / xi * (math.tanh(u / 2) - 1 / math.sinh(u))
    moment = 2 * math.pi * radius**4 / (xi**2 * (xi**2 - 1))
    return Mode(hinge, length, 2 * radius / (xi**2 - 1), moment)


@dataclass(frozen=True)
class Case:
    """A run, the options of its page, and a function from a row of its table to expected bobs."""

    name: str
    fmu: str
    run: list[str]
    columns: str
    """Recorded columns, separated by commas."""
    instants: tuple[float, float, float]
    expected: Callable[[Row], list[list[Drawn]]]
    radii: tuple[float, ...]
    """Radii of the free surfaces at rest, m."""
    inputs: Callable[[float], Row] | None = None
    tank: Path | None = None
    """File of the tank by which it is drawn."""


def bench(row: Row, sines: list[tuple[float, float]]) -> list[list[Drawn]]:
    """Return the bob of the bench's tank at one row of the table.

    ``sines`` has, for each mode, the sines of both slosh angles, which are displacements over
    length.
    """
    radius, depth, arm = 0.163 / 2, 0.1, 0.225
    data = [cylinder(n, radius, depth) for n in range(len(sines))]
    p = [(x, y, -math.sqrt(1 - x * x - y * y)) for x, y in sines]
    return [draw_modes(data, p, (arm, 0, 0), depth)]


def sweep(row: Row) -> list[list[Drawn]]:
    """Return the bob of the sweep, which has one mode, at one row of the table."""
    return bench(row, [(math.sin(row["slosh_angle_radial"]), math.sin(row["slosh_angle"]))])


def four(row: Row) -> list[list[Drawn]]:
    """Return the bobs of four spherical pendulums, whose coordinates are stereographic."""
    sines = []
    for n in range(1, 5):
        x, y = row[f"slosh.q_radial[{n}]"], row[f"slosh.q_tangential[{n}]"]
        k = 2 / (1 + x * x + y * y)
        sines.append((k * x, k * y))
    return bench(row, sines)


def slew(row: Row) -> list[list[Drawn]]:
    """Return the bobs of two tanks at one row of the table.

    The lower tank is given by its modes, the upper one by diameter and depth, and turned by 90°.
    """
    # m l of the first tank follows from the cylinder to which its wave and length belong.
    given = Mode(0.136534, 0.248039, 0.376618, cylinder(0, 0.45, 0.6).moment)
    lower = modes(row, "tank[1]", [given], (0, 0, -0.55), 0.3)
    upper = [cylinder(n, 0.4, 0.35) for n in (0, 1)]
    turned = modes(row, "tank[2]", upper, (0, 0, 0), 0.35)

    def place(r: Vector) -> Vector:
        # q = (1, 0, 0, 1), normalised, turns x into y.
        return (-r[1], r[0], r[2] + 0.45)

    upper_drawn = [Drawn(place(d.hinge), place(d.bob), d.level, d.wall, d.moved) for d in turned]
    return [lower, upper_drawn]


def modes(row: Row, prefix: str, data: list[Mode], at: Vector, level: float) -> list[Drawn]:
    """Return the bobs of a tank, computed from the directions of its pendulums in ``row``.

    ``prefix`` is the tank's name in the table. ``data`` has its modes, ``at`` its position, and
    ``level`` the height of its free surface, m.
    """
    p = [[row[f"{prefix}.p[{n},{i}]"] for i in (1, 2, 3)] for n in range(1, len(data) + 1)]
    return draw_modes(data, p, at, level)


def draw_modes(data: list[Mode], p: Sequence[Vector], at: Vector, level: float) -> list[Drawn]:
    """Return the bobs of a tank's modes from the directions ``p`` of their pendulums.

    The tank is at ``at``, and its free surface at the height ``level``, m. The wave at the wall is
    the sum over all modes.
    """
    angles = [(math.asin(one[0]), math.asin(one[1])) for one in p]
    wall = [sum(mode.wave * a[i] for mode, a in zip(data, angles, strict=True)) for i in (0, 1)]
    found = []
    for mode, direction, a in zip(data, p, angles, strict=True):
        top = (at[0], at[1], at[2] + mode.hinge)
        bob = [x + mode.length * y for x, y in zip(top, direction, strict=True)]
        moved = (mode.moment * a[0], mode.moment * a[1])
        found.append(Drawn(top, bob, level, (wall[0], wall[1]), moved))
    return found


def drain(row: Row) -> list[list[Drawn]]:
    """Return the bobs of the FMU's default tank, a cylinder of 0.9 m with its bottom at -0.3 m."""
    depth = row["tank.liquid"] / (1000 * math.pi * 0.45**2)
    mode = cylinder(0, 0.45, depth)
    mode = Mode(mode.hinge - 0.3, mode.length, mode.wave, mode.moment)
    return [modes(row, "tank", [mode], (0, 0, -0.45), depth - 0.3)]


def pulse(t: float, begin: float, end: float) -> float:
    """Return a smooth pulse at the time ``t``: 0 before ``begin`` and after ``end``, 1 halfway."""
    return math.sin(math.pi * (t - begin) / (end - begin)) ** 2 if begin < t < end else 0.0


def torques(t: float) -> Row:
    """Return the torques, N·m, of a slew about three axes under thrust at the time ``t``, s."""
    return {
        "torque[1]": 24 * (pulse(t, 2, 14) - pulse(t, 14, 26)),
        "torque[2]": 16 * (pulse(t, 5, 17) - pulse(t, 17, 29)),
        "torque[3]": 8 * (pulse(t, 2, 20) - pulse(t, 20, 38)),
        "force[3]": 600.0,
    }


def shaken(t: float) -> Row:
    """Return the force, N, that shakes a tank sideways while it drains, at the time ``t``, s."""
    flow = 4.5 if 2 < t < 58 else 0.0
    return {"mass_flow": flow, "a[1]": 0.25 * math.sin(4.4 * t)}


def pushed(t: float) -> Row:
    """Return the force, N, that shakes a tank in two directions one after the other."""
    return {
        "a[1]": 0.06 * math.sin(3.9 * t) * pulse(t, 0, 8),
        "a[2]": 0.2 * pulse(t, 5, 6) - 0.2 * pulse(t, 6, 7),
    }


COLUMNS = {
    "sweep": "theta,omega,slosh_angle,slosh_angle_radial,wave_height,tau_actuator,tau_friction,"
    "tau_fluid,F_radial,F_tangential,wheel_speed",
    "modes": "theta,omega,slosh_angle,slosh_angle_radial,wave_height,"
    + ",".join(f"slosh.q_{a}[{n}]" for n in (1, 2, 3, 4) for a in ("radial", "tangential")),
    "slew": "q[1],q[2],q[3],q[4],omega[1],omega[2],omega[3],slosh_torque[1],slosh_torque[2],"
    "slosh_torque[3],tank[1].p[1,1],tank[1].p[1,2],tank[1].p[1,3],tank[2].p[1,1],tank[2].p[1,2],"
    "tank[2].p[1,3],tank[2].p[2,1],tank[2].p[2,2],tank[2].p[2,3],tank[1].wave_height,"
    "tank[2].wave_height,tank[1].force[1],tank[1].force[2],tank[1].force[3],tank[2].force[1],"
    "tank[2].force[2],tank[2].force[3]",
    "drain": "force[1],force[2],force[3],torque[1],torque[2],torque[3],tank.p[1,1],tank.p[1,2],"
    "tank.p[1,3],tank.wave_height,tank.liquid",
}
"""Recorded columns of each case."""

TWO_TANKS = (
    "tanks=2 tank[1].position[3]=-0.55 tank[2].position[3]=0.45 tank[2].q[1]=1 tank[2].q[4]=1 "
    "tank[2].diameter=0.8 tank[2].depth=0.35 tank[2].modes=2"
)


def settings(text: str) -> list[str]:
    """Return the options of the command for settings ``NAME=VALUE`` that spaces separate."""
    return [part for name in text.split() for part in ("--set", name)]


SPHERICAL = settings("slosh.model=spherical")

CASES = (
    Case(
        "sweep",
        "HubSlosh",
        ["--profile", "exp-sweep:amplitude=0.25,duration=600", *SPHERICAL],
        COLUMNS["sweep"],
        (300.0, 420.02, 460.5),
        sweep,
        (0.0815,),
    ),
    Case(
        "modes",
        "HubSlosh",
        [
            *("--profile", "exp-sweep:amplitude=0.3,f0=1.5,f1=5.5,duration=60"),
            *SPHERICAL,
            *settings("slosh.modes=4 init.slosh_angle_radial=0.02"),
        ],
        COLUMNS["modes"],
        (25.76, 45.8, 52.34),
        four,
        (0.0815,),
    ),
    Case(
        "slew",
        "Spacecraft",
        settings(TWO_TANKS),
        COLUMNS["slew"],
        (9.0, 22.5, 47.98),
        slew,
        (0.45, 0.4),
        torques,
    ),
    Case(
        "drain",
        "SloshTank",
        settings("tank.fill.points=12 a[3]=2.5"),
        COLUMNS["drain"],
        (4.0, 30.0, 56.5),
        drain,
        (0.45,),
        shaken,
    ),
)


def in_sphere(binary: Path, folder: Path) -> Case:
    """Return the case of a sphere filled to 0.14 m, with modes of the tank solver."""
    tank = Path(__file__).parents[1] / "harness/tank/examples/sphere.toml"
    file, fill, radius, density = folder / "sphere.toml", 0.14, 0.3, 1004.0
    command = [binary, "tank", tank, "--fill", str(fill), "--modes", "2", "--parameters", file]
    subprocess.run([*command, "--model", "SloshTank"], check=True, stdout=subprocess.DEVNULL)
    found = tomllib.loads(file.read_text(encoding="utf-8"))
    data = [
        Mode(
            found[f"tank.hinge[{n}]"],
            found[f"tank.length[{n}]"],
            found[f"tank.wave[{n}]"],
            found[f"tank.mass[{n}]"] * found[f"tank.length[{n}]"] / density,
        )
        for n in (1, 2)
    ]
    surface = math.sqrt(radius**2 - (radius - fill) ** 2)
    columns = "force[1],force[2],force[3],tank.wave_height," + ",".join(
        f"tank.p[{n},{i}]" for n in (1, 2) for i in (1, 2, 3)
    )
    return Case(
        "sphere",
        "SloshTank",
        ["--parameters", str(file), *settings("a[3]=2.5")],
        columns,
        (5.0, 7.0, 12.0),
        lambda row: [modes(row, "tank", data, (0, 0, -0.45), fill)],
        (surface,),
        pushed,
        tank,
    )


def rows(file: Path) -> list[Row]:
    with file.open(newline="") as text:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(text)]


def record(case: Case, binary: Path, fmus: Path, folder: Path) -> tuple[Path, Path]:
    """Simulate the case and write its page; return the paths of the CSV table and the page.

    ``binary`` is the program, and ``fmus`` the folder of FMUs.
    """
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
        case.columns,
        "--fmu",
        fmus / f"{case.fmu}.fmu",
        "--out",
    ]
    for out in (run, run.with_suffix(".csv")):
        subprocess.run([*common, out], check=True)
    shape = ["--tank", case.tank] if case.tank else []
    view = [binary, "view", run, "--fmu", fmus / f"{case.fmu}.fmu", *shape, "--out", page]
    subprocess.run(view, check=True)
    return run.with_suffix(".csv"), page


def first_moment(section: list[list[float]], radius: float) -> float:
    """Return the integral of elevation times x over the surface at rest, m4, by Simpson's rule.

    ``section`` is the surface above the x axis, (r, elevation) at equal steps from the axis; around
    the axis it varies as a cosine. At a sloping wall it ends at another radius than ``radius``,
    where linear theory ends it.
    """
    last = len(section) - 1
    weights = [1 if k in (0, last) else 2 + 2 * (k % 2) for k in range(last + 1)]
    terms = (w * section[k][1] * (k / last) ** 2 for k, w in enumerate(weights))
    return math.pi * radius**3 * sum(terms) / (3 * last)


def compare(page: Page, case: Case, row: Row, reach: float) -> tuple[float, float]:
    """Return two errors of the scene that a page draws at one row of the table.

    The first is the largest distance of a bob from its position according to the table, m. The
    second is the relative difference between the liquid's shift by the drawn surface and its shift
    by the pendulums. Allowed distances are relative to ``reach``, the size of the scene, m.
    """
    page.evaluate(f"hubsloshView.seek({row['time']!r})")
    tanks = page.evaluate("hubsloshView.read()")
    wanted = case.expected(row)
    assert len(tanks) == len(wanted), f"{case.name}: {len(tanks)} tanks"
    # The table over the fill has six digits and is interpolated. The level of a tank without
    # a known outline follows from masses with six digits.
    allowed = reach * (2e-3 if case.name == "drain" else SINGLE)
    of_level = reach * (2e-3 if case.name == "drain" else 1e-4)
    worst = carried = 0.0
    for tank, modes_, radius in zip(tanks, wanted, case.radii, strict=True):
        assert len(tank["modes"]) == len(modes_)
        for found, mode in zip(tank["modes"], modes_, strict=True):
            worst = max(worst, math.dist(found["hinge"], mode.hinge))
            worst = max(worst, math.dist(found["bob"], mode.bob))
        off = abs(tank["level"] - modes_[0].level)
        assert off < of_level, f"{case.name} at {row['time']} s: error of the level {off} m"
        worst = max(worst, math.dist(tank["wall"], modes_[0].wall))
        moved = [sum(mode.moved[i] for mode in modes_) for i in (0, 1)]
        shown = [first_moment(section, radius) for section in tank["sections"]]
        carried = max(carried, math.dist(moved, shown) / math.hypot(*moved))
    assert worst < allowed, f"{case.name} at {row['time']} s: error {worst} m (allowed: {allowed})"
    # Simpson's rule has 16 rings, or 8 for each mode.
    assert carried < 1e-3, f"{case.name} at {row['time']} s: error of the surface {carried}"
    names = [name for name in row if name.split(".")[-1] == "wave_height"]
    for tank, name in zip(tanks, sorted(names), strict=True):
        off = abs(math.hypot(*tank["wall"]) - row[name])
        assert off < allowed, f"{case.name} at {row['time']} s: error of {name} {off} m"
    return worst, carried


def keys(page: Page) -> None:
    """Check that keys play, pause, step and jump in the page, and turn the view."""
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
    assert span[1] < span[0] < span[2], "a click on a plot does not move the time"


def hostile_unit(browser: Browser, binary: Path, fmu: Path, folder: Path) -> str:
    """Check the page of an FMU with a unit that contains "<!--" and "<script>".

    The page must show both as text. If a browser read them as markup, it would not find the end of
    the page's data and would draw nothing.
    """
    unit, hostile = "<!--<script>rad/s", folder / "hostile_unit.fmu"
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(hostile, "w") as out:
        for name in source.namelist():
            data = source.read(name)
            if name == "modelDescription.xml":
                assert b'"rad/s"' in data
                data = data.replace(b'"rad/s"', f'"{html.escape(unit)}"'.encode())
            out.writestr(name, data)
    run, file = hostile.with_suffix(".parquet"), hostile.with_suffix(".html")
    of = ["--fmu", hostile, "--out"]
    drive = ["--profile", "sine:duration=10", "--columns", "theta,omega,slosh_angle"]
    subprocess.run([binary, "run", *drive, *of, run], check=True)
    subprocess.run([binary, "view", run, *of, file], check=True)
    page = open_page(browser, file, *VIEWS[0], reduced_motion="reduce")
    shown = page.evaluate("document.body.innerText")
    page.close()
    assert unit in shown, f"the page does not show the unit {unit}"
    return f"the unit {unit} of a hostile FMU is shown as text"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("binary", type=Path, help="the program hubslosh")
    parser.add_argument("fmus", type=Path, help="folder of the packed FMUs")
    parser.add_argument("axe", type=Path, help="axe.min.js of npm's axe-core")
    parser.add_argument("out", type=Path, help="folder for runs, pages and screenshots")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with chromium() as browser:
        for case in (*CASES, in_sphere(arguments.binary, arguments.out)):
            table, file = record(case, arguments.binary, arguments.fmus, arguments.out)
            data = rows(table)
            text = file.read_text(encoding="utf-8")
            assert len(text) < 9e6, f"{case.name}: the page has {len(text)} bytes"
            found = re.search(r'id="run">(.*?)</script>', text, re.DOTALL)
            assert found
            reach = json.loads(found[1])["scene"]["geometry"]["reach"]
            worst = (0.0, 0.0)
            for instant, (width, scheme) in zip(case.instants, VIEWS, strict=True):
                page = open_page(browser, file, width, scheme, reduced_motion="reduce")
                assert not page.evaluate("hubsloshView.playing"), "the page plays without a click"
                row = min(data, key=lambda row: abs(row["time"] - instant))
                worst = tuple(map(max, worst, compare(page, case, row, reach)))
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                contrast.demand(page, arguments.axe, f"{case.name}, {scheme}, {width} px")
                if width == 400:
                    # On a wide screen the legend must not cover the letters of the axes.
                    hidden = page.evaluate(HIDDEN)
                    assert not hidden, f"{case.name}: the legend lies over {hidden}"
                page.wait_for_timeout(300)
                shot = f"{case.name}_{instant:g}s_{width}_{scheme}.png"
                page.screenshot(path=arguments.out / shot)
                if width == VIEWS[0][0] and scheme == "dark":
                    keys(page)
                page.close()
            times = ", ".join(f"{t:g}" for t in case.instants)
            print(
                f"{case.name}: at {times} s bobs and waves agree within {worst[0]:.1e} m with the "
                f"table, shifts of the liquid by surface and pendulums to {worst[1]:.1e}"
            )
        hub = arguments.fmus / "HubSlosh.fmu"
        print(hostile_unit(browser, arguments.binary, hub, arguments.out))


if __name__ == "__main__":
    main()
