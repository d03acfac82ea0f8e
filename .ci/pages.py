"""Access to pages in Debian's Chromium by Playwright; ``.ci/browser`` installs both."""

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright


@contextmanager
def chromium() -> Iterator[Browser]:
    """Yield the browser Chromium, set to draw without a graphics processor."""
    program = shutil.which("chromium")
    if program is None:
        sys.exit("error: chromium is missing: .ci/browser installs it")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=flags)
        yield browser
        browser.close()


def open_page(browser: Browser, file: Path, width: int, scheme: str = "light", **more: str) -> Page:
    """Open a page and wait until it is drawn.

    An error in the page's script fails, and so does a request to the network. ``width`` is the
    width of the window, px; ``scheme`` is "light" or "dark".
    """
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme, **more)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on(
        "request",
        lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else faults.append(r.url),
    )
    page.goto(file.absolute().as_uri())
    page.wait_for_function("document.documentElement.dataset.drawn === 'yes'", timeout=180_000)
    assert not faults, f"errors and requests of the page: {faults[:3]}"
    return page
