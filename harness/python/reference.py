"""Writes book/api.md: every public name of the package, from the signatures and docstrings.

    reference.py            write the page
    reference.py --check    exit with 1 if the page is not what the docstrings say

griffe (``.ci/requirements-style.txt``) reads the sources without importing them. Docstrings are
Markdown; a name in single backquotes becomes a link to its heading.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import griffe

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "book" / "api.md"
WIDTH = 88
"""Longest line of a signature."""
HEAD = """# API reference

What does each public name of the package `hubslosh` take and return?

By purpose, with explanations: [Python](python.md). With an example of each task: [work in
Python](python_howto.md). `harness/python/reference.py` makes this page from the docstrings.
"""


class Reference:
    """The page, and the names that lack a docstring."""

    def __init__(self, package: griffe.Module) -> None:
        """Write the page of a package."""
        self.parts: list[tuple[str, str]] = []
        self.slugs: dict[str, str] = {}
        self.undocumented: list[str] = []
        self.types: dict[str, griffe.Attribute] = {}
        exported = {str(name) for name in package.exports or ()}
        for name in sorted(exported, key=lambda name: (name.lower(), name)):
            found = package[name]
            self.add(name, found.final_target if found.is_alias else found, 2)
        self.parts.append(("", "## Types\n\nNames of types in the signatures above.\n"))
        for name in sorted(set(self.types) - exported):
            self.add(name, self.types[name], 3)

    def add(self, name: str, item: griffe.Object, level: int) -> None:
        """Add a heading with signature, docstring and members."""
        if item.docstring is None:
            self.undocumented.append(name)
            return
        slug = "".join(c for c in name.lower() if c.isalnum() or c in " -_")
        before = sum(slug == re.sub(r"-\d+$", "", other) for other in self.slugs.values())
        self.slugs[name] = f"{slug}-{before}" if before else slug
        head = self.declaration(name, item)
        text = f"{'#' * level} `{name}`\n\n"
        text += f"```python\n{head}\n```\n\n" if head else ""
        text += item.docstring.value + "\n"
        members = list(public(item)) if item.is_class or item.is_module else []
        if item.is_class and (made := item.members.get("__init__")) and made.docstring:
            # its first line says that it makes one
            text += made.docstring.value.partition("\n")[2].rstrip() + "\n"
        fields = ""
        for key, field in members:
            if not field.is_attribute or f"``{key}``" in item.docstring.value:
                continue
            if field.docstring is None:
                self.undocumented.append(f"{name}.{key}")
                continue
            kind = f": {self.type_of(field, field.annotation)}" if field.annotation else ""
            fields += f"* ``{key}{kind}``: {' '.join(field.docstring.value.split())}\n"
        self.parts.append((name, text + ("\n" + fields if fields else "")))
        for key, member in members:
            if not member.is_attribute:
                self.add(f"{name}.{key}", member, level + 1)

    def declaration(self, name: str, item: griffe.Object) -> str:
        """Return how a name is called, or what it stands for."""
        if item.is_attribute:
            value = str(item.value or "")
            return "" if "_native" in value else f"{name} = {value}"
        call = item.all_members.get("__init__") if item.is_class else item
        bases = [str(base) for base in item.bases] if item.is_class else []
        if not isinstance(call, griffe.Function) or bases == ["FmuError"]:
            return ""
        parameters = [one for one in call.parameters if one.name not in ("self", "cls")]
        if any(one.name.startswith("_") for one in parameters):
            return ""  # the package makes it, not its user
        kinds = griffe.ParameterKind
        stars = {kinds.var_positional: "*", kinds.var_keyword: "**"}
        texts = []
        for place, one in enumerate(parameters):
            before = [other.kind for other in parameters[:place]]
            if one.kind is kinds.keyword_only and not {one.kind, kinds.var_positional} & {*before}:
                texts.append("*")
            kind = self.type_of(call, one.annotation)
            text = f"{stars.get(one.kind, '')}{one.name}: {kind}"
            if one.default is not None and one.kind not in stars:
                text += f" = {one.default}"
            texts.append(text.replace("'", '"'))
        result = "" if item.is_class else f" -> {self.type_of(call, call.returns)}"
        line = f"{name}({', '.join(texts)}){result}"
        if len(line) > WIDTH:
            line = "\n    ".join([f"{name}(", *(f"{text}," for text in texts)]) + f"\n){result}"
        return line

    def type_of(self, item: griffe.Object, annotation: object) -> str:
        """Return an annotation; names of the package without docstring give way to their values."""

        def meaning(word: re.Match[str]) -> str:
            found = item.module.members.get(word[0])
            try:
                found = found.final_target if found is not None and found.is_alias else found
            except griffe.AliasResolutionError:  # of another package
                return word[0]
            if found is None or not found.is_attribute:
                return word[0]
            if found.docstring is None:
                return str(found.value)
            self.types[word[0]] = found
            return word[0]

        return re.sub(r"\b[A-Z]\w+", meaning, str(annotation))

    def text(self) -> str:
        """Return the page with its links."""
        plain = re.compile(r"(?<!`)`([\w.]+)`(?!`)")

        def linked(name: str, part: str) -> str:
            def link(found: re.Match[str]) -> str:
                word = found[1].removeprefix("hubslosh.")
                near = (f"{name}.{word}", f"{name.rpartition('.')[0]}.{word}", word)
                slug = next((self.slugs[one] for one in near if one in self.slugs), None)
                return found[0] if slug is None or word == name else f"[`{word}`](#{slug})"

            return "\n".join(
                line if line.startswith("#") else plain.sub(link, line) for line in part.split("\n")
            )

        parts = [HEAD, *(linked(name, part) for name, part in self.parts)]
        return "\n".join(parts).rstrip() + "\n"


def public(item: griffe.Object) -> Iterator[tuple[str, griffe.Object]]:
    """Yield the members of a class or module that belong on the page, inherited ones last."""
    inherited = item.inherited_members if item.is_class else {}
    for key, member in {**item.members, **inherited}.items():
        if item.is_module and (member.is_alias or not member.is_function):
            continue
        if not key.startswith("_"):
            yield key, member.final_target if member.is_alias else member


def main() -> None:
    """Write or check the page."""
    folder = ROOT / "harness" / "python"
    package = griffe.load("hubslosh", search_paths=[folder], allow_inspection=False)
    reference = Reference(package)
    if reference.undocumented:
        sys.exit(f"error: without docstring: {', '.join(reference.undocumented)}")
    text = reference.text()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
    elif not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != text:
        sys.exit(f"error: {PAGE} is out of date: run {Path(__file__).relative_to(ROOT)}")


if __name__ == "__main__":
    main()
