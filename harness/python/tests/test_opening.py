"""Refused FMU archives: too large, incomplete, or with paths that lead out of the archive."""

import re
import stat
import zipfile
from pathlib import Path

import pytest

from hubslosh import Fmu, FmuError, Plant

BROKEN = '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"/>'


def packed(folder: Path, files: dict[str | zipfile.ZipInfo, bytes | str]) -> Path:
    """Write a ZIP file with these files to ``folder``, and return its path."""
    path = folder / "hostile.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def link() -> zipfile.ZipInfo:
    """Return an entry for a ZIP file that is a symbolic link."""
    entry = zipfile.ZipInfo("resources/link")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    return entry


@pytest.mark.parametrize(
    ("files", "why"),
    [
        ({"resources/zeros": bytes(80 << 20)}, "the archive unpacks to 83886"),
        ({"../outside": ""}, "leads out of the archive"),
        ({link(): "/etc/hostname"}, "symbolic link"),
        ({}, "the archive has no modelDescription.xml"),
        ({"modelDescription.xml": "<a " + " b=''" * 700_001}, "attributes"),
    ],
)
def test_an_archive_that_breaks_a_limit_of_the_host_is_refused(tmp_path, files, why) -> None:
    """Each limit of the Rust host on archives has a case here."""
    with pytest.raises(FmuError, match=re.escape(why)):
        Fmu(packed(tmp_path, files))


def test_a_library_outside_the_archive_is_refused(tmp_path, fmu) -> None:
    """The attribute modelIdentifier, which becomes a file name, contains a path."""
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("modelDescription.xml").decode()
    text = text.replace('modelIdentifier="HubSlosh"', 'modelIdentifier="../../outside"')
    with pytest.raises(FmuError, match="leads out of the folder of its binary"):
        Plant(packed(tmp_path, {"modelDescription.xml": text}))
