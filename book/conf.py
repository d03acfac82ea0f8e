"""Settings of Sphinx for the book, which `hubslosh book` builds.

The source folder is the project's root, so that pages stay where they belong and their links lead
to the same places on GitHub.
"""

import re
import sys
from pathlib import Path

import math_core
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "harness" / "python"))
sys.dont_write_bytecode = True

project = "HubSlosh"
version = re.search(r'^version = "(.+)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
root_doc = "book/index"
include_patterns = [
    "*.md",
    "book/**.md",
    "book/api/*.rst",
    "examples/**README.md",
    "harness/benchmark/*/page.md",
    "harness/**README.md",
    "modelDescription/*/documentation/*.md",
]
exclude_patterns = [".*", "**/.*", "target", "dist", "README.md", "harness/report"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
default_role = "py:obj"
templates_path = [str(ROOT / "book" / "_templates")]  # autosummary looks from the source folder
numpydoc_show_class_members = False
autodoc_typehints = "none"  # the docstrings have the types
python_maximum_signature_line_length = 88
html_math_renderer = "mathml"

html_theme = "pydata_sphinx_theme"
html_title = f"HubSlosh {version}"
html_favicon = "../modelDescription/icon/icon.png"
html_additional_pages = {"index": "index.html"}
html_static_path = ["_static"]
html_css_files = ["book.css"]
html_context = {"default_mode": "auto"}
html_copy_source = False
html_theme_options = {
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": [],
    "footer_end": [],
}

PARTS = "index tutorials howto reference explanation developers"
CONTENTS = [*(f"book/{name}" for name in PARTS.split()), "harness/benchmark/README"]
"""Pages whose lists of links are the book's table of contents."""


def add_toctrees(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add a toctree for the links below each heading of a page of contents."""
    if docname not in CONTENTS:
        return
    trees = []
    for part in re.split(r"^#+ ", source[0], flags=re.MULTILINE)[1:]:
        caption = part.partition("\n")[0]
        links = re.findall(r"^- \[(.+?)\]\((.+?\.md)\)", part, re.MULTILINE)
        if links:
            pages = "\n".join(f"{title} <{page}>" for title, page in links)
            trees.append(f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{pages}\n```\n")
    source[0] += "\n" + "\n".join(trees)


def add_terms(app: Sphinx, docname: str, source: list[str]) -> None:
    """Make terms of the glossary's list, which the search finds by their names."""
    if docname != "book/glossary":
        return
    item = re.compile(r"^\* \*\*([^*]+)\*\*: ([^\n]+(?:\n  [^\n]+)*)\n", re.MULTILINE)

    def entry(found: re.Match) -> str:
        return "\n".join(found[1].replace("\n ", "").split(", ")) + f"\n  {found[2]}\n\n"

    items = re.compile(rf"(?:{item.pattern})+", re.MULTILINE)
    source[0] = items.sub(
        lambda found: f"```{{glossary}}\n{item.sub(entry, found[0])}```\n", source[0]
    )


def leave_out_of_search(app: Sphinx, docname: str, source: list[str]) -> None:
    """Keep the history and the page for developers out of the search of the book."""
    if docname in ("CHANGELOG", "ARCHITECTURE"):
        source[0] = f"---\nnosearch: true\n---\n\n{source[0]}"


RULES = ROOT / "harness" / "check" / "src" / "rules"
RULE = re.compile(r'rule\("([\w.]+)", (\w+), "((?:\\.|[^"\\])*)", "((?:\\.|[^"\\])*)"')


def add_rules(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add the rules of `hubslosh check`, from their tables in Rust, to the page of the check."""
    if docname != "book/check":
        return
    for version in ("2.0", "3.0"):
        text = (RULES / f"fmi{version[0]}.rs").read_text()
        rules = RULE.findall(text)
        if len(rules) != text.count('    rule("'):
            raise ValueError(f"fmi{version[0]}.rs: RULE in conf.py does not find every rule")
        source[0] += f"\n## The rules for FMI {version}\n\n| rule | what must hold | source | |\n"
        source[0] += "| --- | --- | --- | --- |\n"
        for name, severity, title, origin in rules:
            source[0] += f"| `{name}` | {title} | {origin} | {severity.lower()} |\n"


def mathml(html: HTML5Translator, node: nodes.math | nodes.math_block) -> None:
    """Write an equation as MathML, which browsers draw without a script."""
    is_block = isinstance(node, nodes.math_block)
    try:
        equation = math_core.LatexToMathML().convert_with_local_state(
            node.astext(), displaystyle=is_block
        )
    except math_core.LatexError as error:
        logging.getLogger(__name__).warning("equation %s: %s", node.astext(), error, location=node)
    else:
        html.body.append(f'<div class="equation">{equation}</div>' if is_block else equation)
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Connect the functions above."""
    app.connect("source-read", add_toctrees)
    app.connect("source-read", add_rules)
    app.connect("source-read", add_terms)
    app.connect("source-read", leave_out_of_search)
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
