"""Looks at a packed FMU before fmpy reads or unpacks it.

The budgets are those of the program ``hubslosh`` (``harness/host/src/archive.rs``, ``xml.rs``): no
archive shall fill the disk or the memory, or write outside the folder that it is unpacked to.
"""

import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path

DESCRIPTION = "modelDescription.xml"

ENTRIES = 20_000
"""Most entries of an archive."""

NAME = 1024
"""Bytes that a name may have."""

UNPACKED = 64 << 20
"""Bytes that all files together may unpack to, whatever the archive's size."""

UNPACKED_PER_BYTE = 8
"""Further bytes that they may unpack to for each byte of the archive."""

XML = 24 << 20
"""Bytes of the description."""

ELEMENTS = 300_000
"""Most elements of the description."""

ATTRIBUTES = 700_000
"""Most attributes of the description."""

NAMESPACES = 100
"""Most namespaces that the description declares."""


def faults(path: Path) -> Iterator[str]:
    """Yield why an FMU should not be opened, if it should not."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield from _of_archive(archive, path.stat().st_size)
    except (OSError, zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        yield f"it is not a zip archive that can be unpacked: {error}"


def _of_archive(archive: zipfile.ZipFile, size: int) -> Iterator[str]:
    entries = archive.infolist()
    if len(entries) > ENTRIES:
        yield f"it has {len(entries)} entries (allowed: {ENTRIES})"
        return
    places: dict[str, zipfile.ZipInfo] = {}
    for entry in entries:
        # zipfile changes what stands in `filename`
        name = entry.orig_filename
        if len(name.encode(errors="replace")) > NAME:
            yield f"a name in it has {len(name)} characters (allowed: {NAME} bytes)"
        elif way := _way_out(name, entry):
            yield f"{name!r}: {way} (allowed: files and folders with relative names)"
        other = places.setdefault(_place(name), entry)
        # two entries of one folder overwrite nothing
        if other is not entry and not (entry.is_dir() and other.is_dir()):
            yield (
                f"{name!r} and {other.orig_filename!r} have the same place on Windows or macOS "
                "(allowed: names that differ in more than capitals, full stops and spaces at the "
                "end, and what follows a colon)"
            )
    most = UNPACKED + UNPACKED_PER_BYTE * size
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > most:
        yield f"it unpacks to {unpacked} bytes (allowed for an archive of {size} bytes: {most})"
        return
    described = [entry for entry in entries if entry.filename == DESCRIPTION]
    if not described:
        yield f"it has no {DESCRIPTION}"
    elif described[0].file_size > XML:
        yield f"{DESCRIPTION} has {described[0].file_size} bytes (allowed: {XML})"
    else:
        yield from _of_description(archive.read(described[0]))


def _place(name: str) -> str:
    """Return the place that a file system may give a name (`place` in ``archive.rs``)."""
    parts = name.rstrip("/").split("/")
    return "/".join(part.split(":")[0].rstrip(". ").lower() for part in parts)


def _way_out(name: str, entry: zipfile.ZipInfo) -> str | None:
    if name.startswith("/") or name[1:2] == ":":
        return "its name is absolute"
    if ".." in name.split("/"):
        return 'its name leads out of the archive by ".."'
    if not name or "\\" in name or "\0" in name:
        return "its name is empty, or has a backslash or a zero"
    if {"", "."} & set(name.rstrip("/").split("/")):
        return 'its name has an empty part or "."'
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "it is a symbolic link"
    return None


def _of_description(text: bytes) -> Iterator[str]:
    counts = {
        "elements": (text.count(b"<") - text.count(b"</"), ELEMENTS),
        "attributes": (text.count(b'="') + text.count(b"='"), ATTRIBUTES),
        "namespaces": (text.count(b"xmlns"), NAMESPACES),
    }
    for what, (count, most) in counts.items():
        if count > most:
            yield f"{DESCRIPTION} has {count} {what} (allowed: {most})"
    if b"<!doctype" in text.lower():
        yield f"{DESCRIPTION} has a document type declaration (allowed: none)"


def is_file_name(identifier: str) -> bool:
    """Return whether a modelIdentifier names a file in the folder of the binaries."""
    return not any(separator in identifier for separator in "/\\:\0")
