"""Findings of axe-core on a page in a browser: contrast, and the rest of WCAG 2 A and AA.

``harness/web/axe`` has axe-core's version in npm's lock file; ``.ci/browser`` installs it.
"""

import json
from pathlib import Path

from playwright.sync_api import Page

RUN = """async () => {
  const runOnly = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"];
  const { violations, passes } = await axe.run(document, { runOnly });
  const found = violations.flatMap(({ id, nodes }) => nodes.map(({ target, any }) =>
    `${id}: ${target.join(" ")}: ${any[0]?.message ?? ""}`));
  return [found, passes.find(({ id }) => id === "color-contrast")?.nodes.length ?? 0];
}"""

# Axe leaves out text in SVG, whose colour is `fill`, and what lies over a canvas, as the picture's
# legend does: these against the background of the nearest element that has one. Curves and dots
# need 3 : 1 (WCAG 1.4.11).
OVER = """() => {
  const channel = (c) => (c <= 10 ? c / 3294.6 : ((c / 255 + 0.055) / 1.055) ** 2.4);
  const luminance = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
  const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = numbers(getComputedStyle(e).backgroundColor);
      if (color.length < 4 || color[3] > 0.8) return color;
    }
    return [255, 255, 255];
  };
  const seen = (e) => e.getClientRects().length > 0;
  const check = (e, key, least) => {
    const color = getComputedStyle(e)[key];
    if (!/^rgb/.test(color)) return [];
    const [one, two] = [numbers(color), behind(e)].map(luminance).sort((a, b) => a - b);
    const ratio = (two + 0.05) / (one + 0.05);
    const name = `${e.tagName} ${e.getAttribute("class") ?? ""} "${e.textContent.slice(0, 20)}"`;
    return ratio < least ? [`${name}: ${ratio.toFixed(2)} (least: ${least})`] : [];
  };
  const words = "h1, p, span, b, label, output, button, summary, li, kbd, select";
  const said = [...document.querySelectorAll(words)].filter((e) => e.textContent.trim() && seen(e));
  const texts = [...document.querySelectorAll("svg text")].filter(seen);
  return [
    ...said.flatMap((e) => check(e, "color", 4.5)),
    ...texts.flatMap((e) => check(e, "fill", 4.5)),
  ];
}"""


def findings(page: Page, axe: Path) -> tuple[list[str], int]:
    """Return what is wrong with the page as it is, and how many texts have enough contrast."""
    page.evaluate(f"{axe.read_text(encoding='utf-8')}; null")
    wrong, passed = page.evaluate(RUN)
    return [*wrong, *page.evaluate(OVER)], passed


def demand(page: Page, axe: Path, name: str) -> int:
    """Fail if axe-core has findings on the page; return how many texts it has measured."""
    wrong, passed = findings(page, axe)
    assert not wrong, f"{name}: {json.dumps(wrong, indent=1, ensure_ascii=False)}"
    assert passed > 5, f"{name}: axe-core has measured {passed} texts"
    return passed
