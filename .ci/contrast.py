"""Findings of axe-core on a page in a browser, by the rules of WCAG 2 A and AA.

The lock file in ``harness/web/axe`` sets axe-core's version; ``.ci/browser`` installs it.
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

# Axe does not measure text in SVG, whose colour is `fill`, and text over a canvas, such as the
# picture's legend. This script compares them with the nearest opaque background.
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
    """Return what axe-core finds wrong with contrast on the page, and how many texts pass.

    ``axe`` is the file of axe-core.
    """
    page.evaluate(f"{axe.read_text(encoding='utf-8')}; null")
    wrong, passed = page.evaluate(RUN)
    return [*wrong, *page.evaluate(OVER)], passed


def demand(page: Page, axe: Path, name: str) -> int:
    """Fail if axe-core has findings on the page; return the number of texts that it measured."""
    wrong, passed = findings(page, axe)
    assert not wrong, f"{name}: {json.dumps(wrong, indent=1, ensure_ascii=False)}"
    assert passed > 5, f"{name}: axe-core measured only {passed} texts"
    return passed
