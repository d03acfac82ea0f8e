"""Search the book in a browser and say what is not found.

Needs Playwright (``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` gets both.
"""

import argparse
from pathlib import Path

from playwright.sync_api import Page

from pages import chromium

ALIKE = (
    ("linearise", "linearize", "linearisation", "linearized"),
    ("behaviour", "behavior"),
    ("controller", "controler"),
    ("manoeuvre", "maneuver"),
    ("centre", "center"),
)
"""Words that must find the same sections, one at least: spellings, endings, a common mistake."""
MEANT = {
    "dampign": "damping",
    "frequncy response": "frequency response",
    "spherical pendulm": "spherical pendulum",
}
"""Suggestions shown if a search finds nothing."""


def titles(page: Page, text: str) -> list[str]:
    """Return the titles of what a search finds."""
    page.fill("#search", text)
    return page.locator("#found a").all_text_contents()


def main() -> None:
    """Check one book; exit with 1 and a sentence if something is not found."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("book", type=Path, help="the folder with index.html")
    arguments = parser.parse_args()
    with chromium() as browser:
        page = browser.new_page()
        page.goto((arguments.book / "index.html").absolute().as_uri())
        for words in ALIKE:
            found = {word: sorted(titles(page, word)) for word in words}
            first = found[words[0]]
            assert first and all(other == first for other in found.values()), found
        for wrong, right in MEANT.items():
            assert not titles(page, wrong)
            page.locator("#found button").click()
            assert page.input_value("#search") == right
            assert page.locator("#found a").count()
        for nonsense in ("ttt", "xyzzy"):
            assert not titles(page, nonsense)
            assert f"No page has “{nonsense}”" in page.inner_text("#found")
            assert not page.locator("#found button").count()
        # the last pages of the list are far below the sidebar's first screen
        page.set_viewport_size({"width": 1400, "height": 800})
        page.goto((arguments.book / "work_precision.html").absolute().as_uri())
        box = page.locator("nav [aria-current]").bounding_box()
        assert 0 < box["y"] < 700, f"the present page is outside the sidebar: {box}"
    print(f"{arguments.book}: spellings, endings, mistakes")


if __name__ == "__main__":
    main()
