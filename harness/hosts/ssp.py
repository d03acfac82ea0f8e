"""Packs a system with one HubSlosh.fmu as SSP 1.0, for OMSimulator, libcosim and other masters.

    python harness/hosts/ssp.py dist/HubSlosh.fmu dist/HubSlosh.ssp

The folder ssp/ next to this file has the content of the archive without the FMU; edit its files for
a system of your own. The program needs only Python.
"""

import sys
import zipfile
from pathlib import Path

TEXTS = Path(__file__).resolve().parent / "ssp"


def pack(fmu: Path, archive: Path) -> None:
    """Write the system's description, its parameters and the FMU into one archive."""
    if not zipfile.is_zipfile(fmu):
        sys.exit(f"error: {fmu} is not an FMU; cargo run --release -- pack builds one")
    members = {path.relative_to(TEXTS).as_posix(): path for path in TEXTS.rglob("*.ss?")}
    members["resources/HubSlosh.fmu"] = fmu
    archive.parent.mkdir(parents=True, exist_ok=True)
    part = archive.with_name(archive.name + ".part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as out:
            for name, path in sorted(members.items()):
                # Entries have no date, so that the same files always give the same bytes.
                entry = zipfile.ZipInfo(name)
                entry.compress_type = zipfile.ZIP_DEFLATED
                out.writestr(entry, path.read_bytes())
        part.replace(archive)
    finally:
        part.unlink(missing_ok=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python ssp.py FMU SSP")
    try:
        pack(Path(sys.argv[1]), Path(sys.argv[2]))
    except OSError as error:
        sys.exit(f"error: {error}")
    print(sys.argv[2])
