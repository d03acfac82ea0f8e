"""Refused archives and descriptions: over budget, or with paths that lead outside."""

import re
import stat
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT

from hubslosh import Fmu, FmuError, opening

BROKEN = '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"/>'


def packed(folder: Path, files: dict[str | zipfile.ZipInfo, bytes | str]) -> Path:
    """Return an archive of these files."""
    path = folder / "hostile.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def link() -> zipfile.ZipInfo:
    """Return an entry that is a symbolic link."""
    entry = zipfile.ZipInfo("resources/link")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    return entry


@pytest.mark.parametrize(
    ("files", "why"),
    [
        ({"resources/zeros": bytes(80 << 20)}, "it unpacks to 83886"),
        ({f"resources/{n}": "" for n in range(20_001)}, "entries (allowed: 20000)"),
        ({"n" * 1025: ""}, "1025 characters"),
        ({"../outside": ""}, "leads out of the archive"),
        ({"/outside": ""}, "absolute"),
        ({"a\\b": ""}, "backslash"),
        ({link(): "/etc/hostname"}, "symbolic link"),
        ({"./a": ""}, 'has an empty part or "."'),
        ({"b//a": ""}, 'has an empty part or "."'),
        ({"b/../a": ""}, "leads out of the archive"),
        ({"b/a": "1", "B/A": "2"}, "'B/A' and 'b/a' have the same place"),
        ({"b/a": "1", "b/a. ": "2"}, "'b/a. ' and 'b/a' have the same place"),
        ({"b/a": "1", "b/a::$DATA": "2"}, "'b/a::$DATA' and 'b/a' have the same place"),
        ({}, "it has no modelDescription.xml"),
        ({"modelDescription.xml": "<a>" + "\n" * (24 << 20)}, "bytes (allowed: 25165824)"),
        ({"modelDescription.xml": "<a>" * 300_001}, "300001 elements"),
        ({"modelDescription.xml": "<a " + " b=''" * 700_001}, "attributes"),
        ({"modelDescription.xml": "xmlns:a=''" * 101}, "101 namespaces"),
        ({"modelDescription.xml": "<!DOCTYPE a>" + BROKEN}, "document type declaration"),
    ],
)
def test_an_archive_beyond_the_budgets_is_refused(tmp_path, files, why) -> None:
    """Before fmpy sees it."""
    with pytest.raises(FmuError, match=re.escape(why)):
        Fmu(packed(tmp_path, files))


def test_a_wrong_size_in_a_header_is_refused(tmp_path, fmu) -> None:
    """The directory says 4 GB of what is much smaller."""
    data = bytearray(fmu.read_bytes())
    first = data.index(b"PK\x01\x02")
    data[first + 24 : first + 28] = (0xFFFF_FFFE).to_bytes(4, "little")
    path = tmp_path / "liar.fmu"
    path.write_bytes(data)
    with pytest.raises(FmuError, match="it unpacks to 42"):
        Fmu(path)


def test_a_library_outside_the_archive_is_refused(tmp_path, fmu) -> None:
    """The path comes from modelIdentifier."""
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("modelDescription.xml").decode()
    text = text.replace('modelIdentifier="HubSlosh"', 'modelIdentifier="../../outside"')
    with pytest.raises(FmuError, match="leads out of its folder"):
        Fmu(packed(tmp_path, {"modelDescription.xml": text}))


def test_the_budgets_are_those_of_the_program() -> None:
    """One number in two languages."""
    host = ROOT / "harness" / "host" / "src"
    rust = "".join((host / name).read_text() for name in ("archive.rs", "xml.rs"))

    def of(name: str) -> int:
        found = re.search(rf"pub const {name}: \w+ = ([\d_]+)(?: << (\d+))?;", rust)
        assert found, name
        return int(found[1]) << int(found[2] or 0)

    assert of("MOST_ENTRIES") == opening.ENTRIES
    assert of("LONGEST_NAME") == opening.NAME
    assert of("UNPACKED") == opening.UNPACKED
    assert of("UNPACKED_PER_BYTE") == opening.UNPACKED_PER_BYTE
    assert of("LONGEST") == opening.XML
    assert of("MOST") == opening.ELEMENTS
    assert of("MOST_ATTRIBUTES") == opening.ATTRIBUTES
    assert of("MOST_NAMESPACES") == opening.NAMESPACES
