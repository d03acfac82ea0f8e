"""Try a live page of the book in a browser: bits, controls, link, sizes; print what it takes.

The page's plant answers the inputs of the FMU's example with the bits of ``hubslosh run --hold``
on this machine. Needs Playwright (``requirements-browser.txt``) and Debian's Chromium;
``.ci/browser`` gets both. Chromium draws without a graphics processor here, so frames per second
are a lower bound.
"""

import argparse
import csv
import gzip
import shutil
import sys
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

SCRIPTS = ("three.js", "scene.js", "fmu.js", "live.js", "swirl.js", "HubSlosh.fmu.js")

REPLAY = """([names, times, inputs]) => {
  const plant = swirl.fmu.instantiate();
  plant.set({ "init.slosh_angle": 0 });
  plant.setupExperiment();
  plant.enterInitializationMode();
  plant.set({ tau_cmd: inputs[0] });
  plant.exitInitializationMode();
  const rows = [[...plant.reals(names)]];
  for (let n = 0; n + 1 < times.length; n++) {
    plant.set({ tau_cmd: inputs[n] });
    plant.doStep(times[n], times[n + 1] - times[n]);
    rows.push([...plant.reals(names)]);
  }
  return rows;
}"""

TORQUE = "swirl.settings.values.torque"
TABBED = "document.activeElement.name || document.activeElement.textContent"


def replay(page: Page, native: Path) -> str:
    """Compare the page's plant with a run of the command line; every output, every row."""
    with native.open() as file:
        rows = list(csv.DictReader(file))
    names = [name for name in rows[0] if name not in ("time", "tau_cmd")]
    times, inputs = ([float(row[name]) for row in rows] for name in ("time", "tau_cmd"))
    answer = page.evaluate(REPLAY, [names, times, inputs])
    expected = [[float(row[name]) for name in names] for row in rows]
    assert answer == expected, next(
        (time, a, b) for time, a, b in zip(times, answer, expected, strict=True) if a != b
    )
    return f"{len(rows)} rows of {', '.join(names)}"


def opened(browser: Browser, address: str, **options: object) -> Page:
    """Return the page, live; an error in a script is an error here."""
    page = browser.new_context(**options).new_page()
    page.on("pageerror", lambda error: sys.exit(f"error in the page: {error}"))
    page.goto(address)
    page.wait_for_function("globalThis.swirl?.frames >= 1", timeout=60_000)
    return page


def main() -> None:
    """Check one book; exit with 1 and a sentence if something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("book", type=Path, help="the folder with swirl.html, made with --live")
    parser.add_argument("native", type=Path, help="the table of hubslosh run --hold")
    parser.add_argument("--pictures", type=Path, help="folder for pictures of the page")
    arguments = parser.parse_args()
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no chromium: .ci/browser installs it")
    address = (arguments.book / "swirl.html").absolute().as_uri()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium,
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
        )
        page = opened(browser, address, viewport={"width": 1400, "height": 1000})
        first = page.evaluate("swirl.first")
        print(f"bits of this machine's binary: {replay(page, arguments.native)}")

        # it moves, and the plots grow
        before = page.evaluate("[swirl.frames, performance.now()]")
        page.wait_for_function("swirl.lines[0].points.length > 3", timeout=60_000)
        page.wait_for_timeout(3000)
        after = page.evaluate("[swirl.frames, performance.now()]")
        rate = 1000 * (after[0] - before[0]) / (after[1] - before[1])
        print(f"first frame after {first:.0f} ms, {rate:.0f} frames a second")
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
        said = dict(pair.split("=") for pair in page.url.partition("#")[2].split("&"))
        assert (said["torque"], said["model"]) == ("105", "planar"), page.url
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

        # nothing moves by itself where it should not; no page is wider than a phone
        wide, phone = {"width": 1400, "height": 1000}, {"width": 400, "height": 860}
        looks: dict[str, dict] = {
            "still": {"viewport": wide, "reduced_motion": "reduce"},
            "phone": {"viewport": phone, "device_scale_factor": 2},
            "dark": {"viewport": wide, "color_scheme": "dark"},
        }
        for name, options in looks.items():
            one = opened(browser, address, **options)
            one.wait_for_timeout(1500)
            assert (one.evaluate("swirl.time") == 0) == (name == "still")
            width = options["viewport"]["width"]
            assert one.evaluate("document.documentElement.scrollWidth") <= width
            if arguments.pictures:
                arguments.pictures.mkdir(parents=True, exist_ok=True)
                one.screenshot(path=arguments.pictures / f"{name}.png", full_page=name == "phone")
            one.context.close()

        # without JavaScript the picture stands there; other pages load nothing of this
        plain = browser.new_context(java_script_enabled=False).new_page()
        plain.goto(address)
        assert plain.is_visible("img[src='swirl.png']")
        for other in arguments.book.glob("*.html"):
            is_live = 'src="live.js"' in other.read_text()
            assert is_live == (other.name == "swirl.html"), other
        browser.close()
    sizes = {name: (arguments.book / name).read_bytes() for name in SCRIPTS}
    for name, data in sizes.items():
        print(f"{name}: {len(data)} bytes, {len(gzip.compress(data, 9))} compressed")
    print(f"{arguments.book / 'swirl.html'}: {sum(map(len, sizes.values()))} bytes of scripts")


if __name__ == "__main__":
    main()
