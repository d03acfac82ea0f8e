"""Try the live pages of the book in a browser: bits, controls, link, margins, contrast, sizes.

A page's plant answers the inputs of its FMU's example with the bits of ``hubslosh run --hold`` on
this machine; the margins of "Slew" are those of ``slew_margins.py``. Needs Playwright
(``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` gets both. Chromium draws
without a graphics processor here, so frames per second are a lower bound.
"""

import argparse
import csv
import gzip
import json
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import Browser, Page

import contrast
from pages import chromium

SHARED = ("three.js", "scene.js", "fmu.js", "live.js")
PAGES = {
    "swirl": ("swirl.js", "HubSlosh.fmu.js"),
    "slew": ("loop.js", "slew.js", "Spacecraft.fmu.js"),
    "your_tank": ("your_tank.js", "tank.wasm.js"),
}
"""Live pages and their own scripts."""

REPLAY = """([page, start, times, inputs, names]) => {
  const plant = globalThis[page].fmu.instantiate();
  plant.set(start);
  plant.setupExperiment();
  plant.enterInitializationMode();
  plant.set(inputs[0]);
  plant.exitInitializationMode();
  const rows = [[...plant.reals(names)]];
  for (let n = 0; n + 1 < times.length; n++) {
    plant.set(inputs[n]);
    plant.doStep(times[n], times[n + 1] - times[n]);
    rows.push([...plant.reals(names)]);
  }
  return rows;
}"""

TIMED = """(() => {
  const next = requestAnimationFrame.bind(globalThis);
  globalThis.spent = [];
  globalThis.requestAnimationFrame = (draw) => next((time) => {
    const start = performance.now();
    draw(time);
    spent.push(performance.now() - start);
  });
})();"""
"""Keeps how long the page's scripts take for each frame, ms."""

LETTERS = """[...document.querySelectorAll(".live svg text")].map((text) => {
  const { a, b } = text.getScreenCTM();
  return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
})"""
"""Size of the letters in plots, px."""

FRAME = 1000 / 60
"""Time budget of scripts in a frame, ms, at 60 frames a second."""

TORQUE = "swirl.settings.values.torque"
TABBED = "document.activeElement.name || document.activeElement.textContent"

MARGINS = """(settings) => {
  for (const { key, start } of slew.settings.all) slew.settings.set(key, settings[key] ?? start);
  slew.restart();
  return slew.found.map(({ curve, ...rest }) => rest);
}"""

TOLERANCE = 1e-6
"""Tolerance, relative for frequencies and delays, else in dB, degrees, 1: both find a crossing
to rounding, of a linear model whose eigenvalues rounding moves by 1e-9 of their size (double
poles at 0)."""

AFTER = """([settings, from, to]) => {
  for (const { key, start } of slew.settings.all) slew.settings.set(key, settings[key] ?? start);
  slew.restart();
  const most = [0, 0];
  for (let n = 0; n < 10 * (to + 50); n++) {
    slew.step();
    const error = Math.abs(slew.off[slew.axis]), at = slew.time;
    if (at > from && at <= from + 50) most[0] = Math.max(most[0], error);
    if (at > to) most[1] = Math.max(most[1], error);
  }
  return most;
}"""


TANKS = (
    {"shape": "domed_cylinder"},
    {"shape": "torus", "fill": 30, "density": 870},
    {"shape": "drawn", "fill": 71},
)
"""Settings of "Your tank" that are solved by `hubslosh tank` as well."""

SET_TANK = """(settings) => {
  for (const { key, start } of your_tank.settings.all) {
    your_tank.settings.set(key, settings[key] ?? start);
  }
  your_tank.changed();
  return [your_tank.file, your_tank.answer.modal];
}"""

LAST_DIGITS = 1e-9
"""Part by which the solver may differ here and there: their sines and logarithms are not one
library's, and small modes are small differences of large numbers."""


def replay(page: Page, name: str, native: Path, start: dict[str, float]) -> str:
    """Compare the page's plant with a run of the command line; every output, every row."""
    with native.open() as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    held = page.evaluate(
        f"[...{name}.fmu.description.variables.values()]"
        ".filter(v => v.causality === 'input').map(v => v.name)"
    )
    inputs = [{key: row[key] for key in row if key in held} for row in rows]
    names = [key for key in rows[0] if key != "time" and key not in held]
    times = [row["time"] for row in rows]
    answer = page.evaluate(REPLAY, [name, start, times, inputs, names])
    expected = [[row[key] for key in names] for row in rows]
    assert answer == expected, next(
        (time, a, b) for time, a, b in zip(times, answer, expected, strict=True) if a != b
    )
    return f"{len(rows)} rows of {', '.join(names)}"


def opened(browser: Browser, address: str, **options: object) -> Page:
    """Return the page, live; an error in a script, or something fetched, is an error here."""
    page = browser.new_context(**options).new_page()
    page.add_init_script(TIMED)
    page.on("pageerror", lambda error: sys.exit(f"error in the page: {error}"))
    local = ("file:", "data:", "blob:")
    page.on(
        "request",
        lambda r: None if r.url.startswith(local) else sys.exit(f"fetched: {r.url}"),
    )
    page.goto(address)
    name = Path(address.partition("#")[0]).stem
    page.wait_for_function(f"globalThis.{name}?.frames >= 1", timeout=60_000)
    return page


def speed(page: Page, name: str) -> str:
    """Say when the first frame stood, how many follow in a second, and the scripts' part of one."""
    before = page.evaluate(f"[{name}.frames, performance.now(), spent.length = 0]")
    page.wait_for_timeout(3000)
    after = page.evaluate(f"[{name}.frames, {name}.first, performance.now()]")
    rate = 1000 * (after[0] - before[0]) / (after[2] - before[1])
    spent = sorted(page.evaluate("spent"))
    median, most = spent[len(spent) // 2], spent[-1]
    return (
        f"{name}: first frame after {after[1]:.0f} ms, {rate:.0f} frames a second; "
        f"scripts take {median:.1f} ms of each (median), {most:.1f} ms at most, of {FRAME:.1f} ms"
    )


def said(page: Page) -> dict[str, str]:
    """Return the settings that the address has."""
    return dict(pair.split("=") for pair in page.url.partition("#")[2].split("&"))


def swirl(browser: Browser, address: str, native: Path) -> None:
    """Try the page "Swirl"."""
    page = opened(browser, address, viewport={"width": 1400, "height": 1000})
    bits = replay(page, "swirl", native, {"init.slosh_angle": 0})
    print(f"swirl: bits of this machine's binary: {bits}")

    # it moves, and the plots grow
    page.wait_for_function("swirl.lines[0].points.length > 3", timeout=60_000)
    print(speed(page, "swirl"))
    assert not page.is_visible("img[src='swirl.png']")
    page.click("text=Pause")
    time = page.evaluate("swirl.time")
    page.wait_for_timeout(300)
    assert page.evaluate("swirl.time") == time > 0

    # by keyboard alone: a slider, the address that keeps it, the page that this address opens
    page.focus("input[name=torque]")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Tab")
    assert page.evaluate(TABBED) == "frequency"
    page.select_option("select[name=model]", "planar")
    assert (said(page)["torque"], said(page)["model"]) == ("105", "planar"), page.url
    again = opened(browser, page.url)
    assert again.evaluate(f"[{TORQUE}, swirl.plant.get('slosh.model')]") == [105, 3]
    again.context.close()
    wrong = opened(browser, f"{address}#torque=9999&model=none&fill=x")
    kept = f"[{TORQUE}, swirl.settings.values.model, swirl.settings.values.fill]"
    assert wrong.evaluate(kept) == [250, "spherical", 100]
    wrong.context.close()

    # every choice is one that the FMU takes
    for name in ("model", "bearing"):
        choices = page.eval_on_selector_all(
            f"select[name={name}] option", "all => all.map(o => o.value)"
        )
        for choice in choices:
            page.select_option(f"select[name={name}]", choice)
            page.evaluate("for (let n = 0; n < 200; n++) swirl.step()")
    assert page.evaluate("swirl.time") > 1.9
    page.context.close()


def close(name: str, ours: float | None, theirs: float | None, size: float) -> float:
    """Return the difference of two numbers in parts of what is allowed; neither may be missing."""
    infinite = theirs is None or ours is None or abs(theirs) == float("inf")
    if infinite:
        assert ours == theirs, f"{name}: {ours}, not {theirs}"
        return 0.0
    off = abs(ours - theirs)
    assert off <= TOLERANCE * size, f"{name}: {ours}, not {theirs}"
    return off / size


def margins(page: Page, file: Path) -> None:
    """Compare all crossings and margins of the three loops with those of `hubslosh.margins`."""
    worst, count = 0.0, 0
    for case in json.loads(file.read_text()):
        settings = case["settings"]
        found = page.evaluate(MARGINS, settings)
        assert all(one["stable"] for one in found) == case["stable"], settings
        for axis, one in enumerate(found, 1):
            theirs = [c for c in case["crossings"] if c["loop"] == f"torque[{axis}]"]
            ours = one["crossings"]
            kinds = [[c["kind"] for c in ours], [c["crossing"] for c in theirs]]
            assert kinds[0] == kinds[1], f"{settings}, axis {axis}: {kinds}"
            for a, b in zip(ours, theirs, strict=True):
                where = f"{settings}, axis {axis}, {a['frequency']:.4g} Hz"
                off = [close(where, a["frequency"], b["frequency"], b["frequency"])]
                off.append(close(where, a.get("gainMargin"), b["gain_margin"], 1.0))
                off.append(close(where, a.get("phaseMargin"), b["phase_margin"], 1.0))
                worst, count = max(worst, *off), count + 1
        modulus = min(one["modulusMargin"] for one in found)
        delay = min(one["delayMargin"] for one in found)
        worst = max(worst, close(f"{settings}: modulus", modulus, case["modulus"], 1.0))
        worst = max(worst, close(f"{settings}: delay", delay, case["delay"], case["delay"] or 1.0))
    print(f"slew: {count} crossings and the margins as hubslosh.margins has them, to {worst:.1e}")


def slew(browser: Browser, address: str, native: Path, expected: Path) -> None:
    """Try the page "Slew"."""
    page = opened(browser, address, viewport={"width": 1400, "height": 1000})
    still = {f"init.omega[{i}]": 0.0 for i in (1, 2, 3)}
    print(f"slew: bits of this machine's binary: {replay(page, 'slew', native, still)}")
    page.wait_for_function("slew.traces.at(-1).points.length > 30", timeout=60_000)
    print(speed(page, "slew"))
    assert not page.is_visible("img[src='slew.png']")
    page.click("text=Pause")
    margins(page, expected)

    # the delay margin is where the plant itself begins to swing up: after a slew, over 250 s
    start = page.evaluate(MARGINS, {})[2]["delayMargin"]
    for more, grows in ((0.9 * start, False), (1.1 * start, True)):
        first, last = page.evaluate(AFTER, [{"delay": 0.15 + more, "angle": 5}, 50, 300])
        print(
            f"slew: {more:.2f} s later (margin {start:.2f} s): {first:.2g}° at 50 s, "
            f"{last:.2g}° at 300 s"
        )
        assert (last > first) == grows

    # by keyboard alone: a slider, the address that keeps it, the page that this address opens
    page.reload()
    page.wait_for_function("globalThis.slew?.frames >= 1", timeout=60_000)
    page.focus("input[name=bandwidth]")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Tab")
    assert page.evaluate(TABBED) == "ratio"
    page.select_option("select[name=notch]", "on")
    page.select_option("select[name=axis]", "x")
    assert said(page) == {"bandwidth": "0.031", "notch": "on", "axis": "x"}, page.url
    again = opened(browser, page.url)
    both = [one.evaluate("[slew.axis, slew.gains, slew.filter]") for one in (page, again)]
    assert both[0] == both[1]
    assert both[1][0] == 0
    again.context.close()
    page.context.close()


def your_tank(browser: Browser, address: str, program: Path, folder: Path, axe: Path) -> None:
    """Try the page "Your tank"."""
    page = opened(browser, address, viewport={"width": 1400, "height": 1000})
    print(speed(page, "your_tank"))
    assert not page.is_visible("img[src='your_tank.png']")
    page.click("text=Pause")
    worst = 0.0
    for settings in TANKS:
        text, found = page.evaluate(SET_TANK, settings)
        file, out = folder / "tank.toml", folder / "tank.json"
        file.write_text(text, encoding="utf-8")
        fill = f"{settings.get('fill', 50)}%"
        made = [program, "tank", file, "--fill", fill, "--modes", "3", "--json"]
        out.write_text(subprocess.run(made, check=True, capture_output=True, text=True).stdout)
        native = json.loads(out.read_text())
        assert len(found["modes"]) == len(native["modes"]) == 3
        for ours, theirs in zip(found["modes"], native["modes"], strict=True):
            for key in ("lambda", "m", "l", "H", "hinge", "wave"):
                size = max(abs(theirs[key]), 1e-3)
                worst = max(worst, abs(ours[key] - theirs[key]) / size)
                assert worst < LAST_DIGITS, (settings, key, ours[key], theirs[key])
    print(f"your_tank: {len(TANKS)} tanks as from hubslosh tank, to {worst:.1e}")

    # every shape is solved; a wrong one is refused in words and the next one solved
    for shape in page.evaluate("your_tank.settings.all[0].options.map(([key]) => key)"):
        page.select_option("select[name=shape]", shape)
        assert page.evaluate("your_tank.problems ?? your_tank.answer.modal.modes.length") == 3
    page.evaluate("location.hash = 'shape=torus&ring=0.1&tube=0.3'")
    page.wait_for_function("your_tank.problems?.length > 0")
    assert page.inner_text(".live-says")
    contrast.demand(page, axe, "your_tank, refused")

    # a drawing by keyboard alone, and the page that its address opens
    page.evaluate("location.hash = 'shape=drawn'")
    page.wait_for_function("your_tank.drawn && !your_tank.problems")
    before = page.evaluate("your_tank.answer.modal.modes[0].lambda")
    contrast.demand(page, axe, "your_tank, drawn")
    page.focus(".point >> nth=2")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("+")
    page.keyboard.press("ArrowRight")
    contour = page.evaluate("your_tank.settings.values.contour")
    assert contour.startswith("0,0_0.2,0.05_0.37,0.25_0.37,0.42_0.35,0.6_"), contour
    assert page.evaluate("your_tank.answer.modal.modes[0].lambda") != before
    again = opened(browser, page.url)
    assert again.evaluate("your_tank.settings.values.contour") == contour
    again.context.close()
    page.context.close()


def looks(browser: Browser, address: str, name: str, axe: Path, pictures: Path | None) -> None:
    """Nothing moves by itself where it should not; no page is wider than a phone, or too faint."""
    wide, phone = {"width": 1400, "height": 1000}, {"width": 400, "height": 860}
    kinds: dict[str, dict] = {
        "wide": {"viewport": wide},
        "still": {"viewport": wide, "reduced_motion": "reduce"},
        "phone": {"viewport": phone, "device_scale_factor": 2},
        "dark": {"viewport": wide, "color_scheme": "dark"},
    }
    for look, options in kinds.items():
        one = opened(browser, address, **options)
        one.wait_for_timeout(1500)
        assert (one.evaluate(f"{name}.time") == 0) == (look == "still")
        width = options["viewport"]["width"]
        assert one.evaluate("document.documentElement.scrollWidth") <= width, (name, look)
        letters = one.evaluate(LETTERS)
        assert min(letters, default=12) > 10, f"{name}, {look}: letters of {min(letters)} px"
        passed = contrast.demand(one, axe, f"{name}, {look}")
        print(f"{name}, {look}: {passed} texts with contrast for WCAG AA, no finding of axe-core")
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
            one.wait_for_timeout(4000)
            one.screenshot(path=pictures / f"{name}_{look}.png", full_page=True)
        one.context.close()
    # without JavaScript the picture stands there
    plain = browser.new_context(java_script_enabled=False).new_page()
    plain.goto(address)
    assert plain.is_visible(f"img[src='{name}.png']")
    plain.context.close()


def main() -> None:
    """Check one book; exit with 1 and a sentence if something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("book", type=Path, help="the folder of the book, made with --live")
    parser.add_argument(
        "native",
        type=Path,
        help="a folder: HubSlosh.csv and Spacecraft.csv of hubslosh run --hold, margins.json",
    )
    parser.add_argument("program", type=Path, help="the program hubslosh")
    parser.add_argument("axe", type=Path, help="axe.min.js of npm's axe-core")
    parser.add_argument("--pictures", type=Path, help="folder for pictures of the pages")
    arguments = parser.parse_args()
    address = {name: (arguments.book / f"{name}.html").absolute().as_uri() for name in PAGES}
    native = arguments.native
    with chromium() as browser:
        swirl(browser, address["swirl"], native / "HubSlosh.csv")
        slew(browser, address["slew"], native / "Spacecraft.csv", native / "margins.json")
        your_tank(browser, address["your_tank"], arguments.program, native, arguments.axe)
        for name in PAGES:
            looks(browser, address[name], name, arguments.axe, arguments.pictures)
    # other pages load nothing of this
    for other in arguments.book.glob("*.html"):
        assert ('src="live.js"' in other.read_text()) == (other.stem in PAGES), other
    sizes = {
        script: (arguments.book / script).read_bytes()
        for scripts in (SHARED, *PAGES.values())
        for script in scripts
    }
    for script, data in sizes.items():
        print(f"{script}: {len(data)} bytes, {len(gzip.compress(data, 9))} compressed")
    for name, own in PAGES.items():
        print(f"{name}.html: {sum(len(sizes[s]) for s in (*SHARED, *own))} bytes of scripts")


if __name__ == "__main__":
    main()
