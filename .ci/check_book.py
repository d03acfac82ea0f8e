"""Check the book in a browser: its search, and its pages on wide and narrow screens.

This needs Playwright (``requirements-browser.txt``) and Debian's Chromium; ``.ci/browser`` installs
both.
"""

import argparse
import re
from pathlib import Path
from urllib.parse import quote

from playwright.sync_api import Browser, Page

from pages import chromium

ANSWERS = {
    "install": "python_howto.html#install",
    "Simulink": "host_setup.html#simulink",
    "damping": "which_damping.html",
    "fill fraction": "conventions.html",
    "sign convention": "conventions.html#sign-convention",
    "Monte Carlo": "6_monte_carlo/README.html",
    "Nichols": "python.html#nichols-chart",
    "notch": "is_it_slosh.html",
    "PMD": "pmd.html",
    "diaphragm": "pmd.html",
    "ullage": "choosing.html",
    "baffle": "pmd.html",
    "minimum damping": "which_damping.html#minimum-damping",
    "units of inertia": "conventions.html#units-of-inertia",
    "LFT": "uncertain.html",
    "linearise": "python_howto.html#linearise",
    "linearize": "#hubslosh.linearize",
    "simulate": "#hubslosh.simulate",
    "check FMU": "check.html",
    "getting started": "start.html",
    "OpenModelica": "host_setup.html#openmodelica",
    "macOS": "hosts.html",
    "spinner": "10_spinner/README.html",
    "real time": "real_time.html",
    "gyro": "gyro.html",
    "Allan": "gyro.html",
    "slosh frequency": "glossary.html#term-slosh-frequency",
    "units": "conventions.html",
    "resume": "campaign_howto.html",
    "exit code": "check.html",
    "FMU": "glossary.html#term-FMU",
    "bob": "glossary.html#term-bob",
    "draining tank": "glossary.html#term-draining-tank",
    "zero gravity": "glossary.html#term-zero-gravity",
    "microgravity": "glossary.html#term-microgravity",
    "hydrazine": "glossary.html#term-hydrazine",
    "spherical tank": "glossary.html#term-spherical-tank",
    "two tanks": "glossary.html#term-two-tanks",
    "step size": "glossary.html#term-step-size",
    "transfer function": "glossary.html#term-transfer-function",
    "phase margin": "spacecraft.html",
    "licence": "documentation/index.html#licence",
    "s and kappa": "glossary.html#term-s-and-kappa",
    "damping law": "which_damping.html",
    "maximum slosh angle": "glossary.html#term-maximum-slosh-angle",
}
"""Words that readers search for, and the end of an address that the first hits must contain."""
HITS = 3

LOOKED_AT = (
    "book/index.html",
    "book/howto.html",
    "book/api/hubslosh.simulate.html",
    "modelDescription/HubSlosh/documentation/model.html",
)


def open_page(browser: Browser, file: Path, width: int, scheme: str) -> Page:
    """Open a page of the book; fail if it requests anything outside the book's folder.

    ``width`` is the width of the window, px; ``scheme`` is "light" or "dark".
    """
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    fetched: list[str] = []
    page.on("request", lambda request: fetched.append(request.url))
    page.goto(file.absolute().as_uri())
    outside = [url for url in fetched if not url.startswith(("file:", "data:"))]
    assert not outside, f"{file}: the page fetches from outside the book: {outside}"
    return page


def search(page: Page, book: Path, words: str) -> list[str]:
    """Type ``words`` into the search of the ``book``; return the addresses of the first hits."""
    page.goto(f"{(book / 'search.html').absolute().as_uri()}?q={quote(words)}")
    page.wait_for_function("/finished|did not match/.test(document.body.innerText)")
    links = page.locator("ul.search > li > a").evaluate_all("all => all.map(a => a.href)")
    # An address is file?highlight=words#place or file#place?highlight=words#place.
    files = [re.split("[?#]", link)[0] for link in links[:HITS]]
    places = [link.partition("#")[1] + link.rpartition("#")[2] for link in links[:HITS]]
    return [file + place * ("#" in place) for file, place in zip(files, places, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("book", type=Path, help="output folder of `hubslosh book --out`")
    parser.add_argument("--pictures", type=Path, help="folder for pictures of the pages")
    arguments = parser.parse_args()
    with chromium() as browser:
        page = browser.new_page()
        for words, answer in ANSWERS.items():
            found = search(page, arguments.book, words)
            assert any(hit.endswith(answer) for hit in found), f"{words}: {found} lacks {answer}"
        for name in LOOKED_AT:
            for width in (1400, 500):
                for scheme in ("light", "dark"):
                    page = open_page(browser, arguments.book / name, width, scheme)
                    place = f"{name}, {width} px, {scheme}"
                    wide = page.evaluate("document.documentElement.scrollWidth")
                    assert wide <= width, f"{place}: the page is {wide} px wide"
                    if arguments.pictures:
                        arguments.pictures.mkdir(parents=True, exist_ok=True)
                        stem = f"{Path(name).stem}-{width}-{scheme}.png"
                        page.screenshot(path=arguments.pictures / stem)
        equations = page.locator("math").evaluate_all("all => all.map(m => m.clientHeight)")
        assert len(equations) > 50 and min(equations) > 0, "equations are not drawn"
    print(f"{arguments.book}: {len(ANSWERS)} words found, {len(LOOKED_AT)} pages fit the screen")


if __name__ == "__main__":
    main()
