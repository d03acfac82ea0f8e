"""Check a campaign's report in a browser by using its figures and links.

This needs Playwright (``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` installs
both.
"""

import argparse
import csv
import re
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Page

from pages import chromium, open_page

RANGE = "document.querySelector('.plot').layout.xaxis.range.map(Number)"


def clicks(page: Page) -> None:
    """Check that hover, legend, zoom, reset and table of contents of a report work."""
    plot = page.locator(".plot").first
    plot.scroll_into_view_if_needed()
    point = plot.locator(".points path, .point path")
    target = point.first if point.count() else plot.locator(".nsewdrag").first
    box = target.bounding_box()
    assert box, "the first figure has neither points nor lines"
    label = plot.locator(".hoverlayer .hovertext")
    # In a figure without points the pointer moves down its middle until a line is near.
    for part in (0.5,) if point.count() else (k / 20 for k in range(1, 20)):
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * part)
        page.wait_for_timeout(200)
        if label.count():
            break
    label.first.wait_for(timeout=10_000)
    text = label.first.text_content() or ""
    assert re.search(r"\d", text), f"the label at the pointer has no value: {text!r}"

    # A figure with names at the ends of its lines has no legend.
    legend = page.locator(".plot:has(.legendtoggle)").first
    shown = "document.querySelector('.plot:has(.legendtoggle)').data[0].visible"
    assert page.evaluate(shown) in (None, True)
    legend.scroll_into_view_if_needed()
    legend.locator(".legendtoggle").first.click()
    page.wait_for_function(f"{shown} === 'legendonly'", timeout=10_000)
    # Two quick clicks would be a double click, which hides all other lines.
    page.wait_for_timeout(600)
    legend.locator(".legendtoggle").first.click()
    page.wait_for_function(f"{shown} === true", timeout=10_000)
    plot.scroll_into_view_if_needed()

    before = page.evaluate(RANGE)
    area = plot.locator(".nsewdrag").first.bounding_box()
    assert area
    left, top = area["x"] + area["width"] * 0.3, area["y"] + area["height"] * 0.3
    page.mouse.move(left, top)
    page.mouse.down()
    page.mouse.move(left + area["width"] * 0.3, top + area["height"] * 0.3, steps=8)
    page.mouse.up()
    page.wait_for_timeout(500)
    zoomed = page.evaluate(RANGE)
    assert zoomed[1] - zoomed[0] < 0.5 * (before[1] - before[0]), f"no zoom of {before}: {zoomed}"
    page.mouse.dblclick(left, top)
    page.wait_for_timeout(700)
    reset = page.evaluate(RANGE)
    span = before[1] - before[0]
    assert all(abs(a - b) < 1e-6 * span for a, b in zip(before, reset, strict=True)), reset

    link = page.locator("nav a").last
    target = link.get_attribute("href") or ""
    page.locator("nav summary").click()
    link.click()
    # The page scrolls as fast as the machine draws it; the timeout fails if it never arrives.
    top = f"document.querySelector('{target}').getBoundingClientRect().top"
    page.wait_for_function(f"{top} < 900", timeout=20_000)
    assert page.evaluate("location.hash") == target


FAULTS = """
() => [...document.querySelectorAll(".plot")].flatMap((place, i) => {
  const rects = (what) => [...place.querySelectorAll(what)].map((e) => e.getBoundingClientRect())
    .filter((r) => r.width && r.height);
  const cut = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2;
  const panels = rects(".nsewdrag"), titles = rects("[class^=g-x], [class^=g-y]");
  const legend = rects(".legend")[0], box = place.getBoundingClientRect();
  const lowest = Math.max(...panels.map((r) => r.bottom), ...titles.map((r) => r.bottom));
  const much = 40 * Math.max(1, box.width / place._fullLayout.width), faults = [];
  if (titles.some((t) => panels.some((p) => cut(t, p)))) faults.push("an axis title in the plot");
  if (legend && [...panels, ...titles].some((r) => cut(legend, r))) faults.push("legend over plot");
  if (legend && legend.top - lowest > much) faults.push("a blank band above the legend");
  if (box.bottom - (legend ? legend.bottom : lowest) > much) faults.push("a blank band below");
  return faults.map((fault) => `figure ${i + 1}: ${fault}`);
})
"""
"""Script that returns faults in the layout of the drawn figures."""


def background(page: Page) -> int:
    """Return the lightness of the page's background, from 0 (black) to 765 (white)."""
    color = page.evaluate("getComputedStyle(document.body).backgroundColor")
    return sum(int(part) for part in re.findall(r"\d+", color)[:3])


def view(browser: Browser, report: Path) -> str:
    """Follow the report's link to the run with the largest radial slosh angle.

    Check the page of this run, and return the run's name.
    """
    with (report.parent / "runs.csv").open(newline="") as table:
        runs = [row for row in csv.DictReader(table) if float(row["peak_radial_angle_deg"]) > 0]
    largest = max(runs, key=lambda row: float(row["peak_radial_angle_deg"]))
    page = browser.new_page()
    page.goto(report.absolute().as_uri())
    page.click("a[href='view.html']")
    page.wait_for_url("**/view.html")
    page.wait_for_function("document.documentElement.dataset.drawn === 'yes'", timeout=180_000)
    assert page.inner_text("h1") == largest["name"], page.inner_text("h1")
    assert page.evaluate("hubsloshView.read().length") == 1, "the view does not draw one tank"
    page.close()
    return largest["name"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("report", type=Path)
    parser.add_argument("--pages", type=int, help="largest number of printed pages")
    arguments = parser.parse_args()
    with chromium() as browser, tempfile.TemporaryDirectory() as directory:
        has_view = (arguments.report.parent / "view.html").exists()
        shown = view(browser, arguments.report) if has_view else "nothing"
        page = open_page(browser, arguments.report, 1400)
        clicks(page)
        assert background(page) > 700
        assert not (faults := page.evaluate(FAULTS)), f"faults on a wide screen: {faults[:5]}"
        # The icon of the active tool is included.
        icons = "[...document.querySelectorAll('.modebar-btn path')].map(p => p.style.fill)"
        for fill in set(page.evaluate(icons)):
            assert sum(int(part) for part in re.findall(r"\d+", fill)[:3]) < 400, f"icons {fill}"
        page.emulate_media(media="print")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert not (faults := page.evaluate(FAULTS)), f"on paper: {faults[:5]}"
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        page.emulate_media(media="null")
        pdf = Path(directory) / "report.pdf"
        page.pdf(path=pdf, prefer_css_page_size=True)
        pages = len(re.findall(rb"/Type\s*/Page[^s]", pdf.read_bytes()))
        if arguments.pages:
            assert pages <= arguments.pages, f"the report prints on {pages} pages"
        page.close()
        dark = open_page(browser, arguments.report, 1400, "dark")
        assert background(dark) < 150, "the page is light in dark mode"
        ink = "document.querySelector('.plot').layout.font.color"
        assert dark.evaluate(ink) == "#e6eaee", "the text of figures is dark in dark mode"
        dark.close()
        phone = open_page(browser, arguments.report, 400)
        width = phone.evaluate("document.documentElement.scrollWidth")
        assert width <= 400, f"text is {width} px wide on a phone of 400 px"
        assert not (faults := phone.evaluate(FAULTS)), f"on a phone: {faults[:5]}"
    print(
        f"{arguments.report}: hover, legend, zoom, reset, contents, dark, phone; {pages} pages; "
        f"{shown} in 3-D"
    )


if __name__ == "__main__":
    main()
