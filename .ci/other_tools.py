"""Counts the faults that fmpy, fmutool and VDMCheck2 report in FMUs 2.0 with one fault each.

    HUBSLOSH_KEEP_MUTANTS=target/mutants cargo test --release -p check --test all
    python3 harness/python/environment.py target/python/importers .ci/requirements-importers.txt
    target/python/importers/bin/python .ci/other_tools.py target/mutants

VDMCheck2 runs if VDMCHECK2 is the path of its script (`VDMCheck2.sh` of a release of
FMI-VDM-Model).

The script prints a table in Markdown. The tests of `check` write the FMUs and require that `check`
finds each fault by the intended rule. A fault counts as reported if a tool reports anything; no
tool reports anything on the faultless FMUs. Faults are in the archive (`zip`), the description
(`xml`), the files of the binaries (`bin`), or the behaviour of the binary.
"""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

from fmpy.validation import validate_fmu

from importers import fmutool_findings

IN_FILES = ("zip", "xml", "bin")


def fmpy_reports(fmu: Path) -> bool:
    """Return True if ``fmpy.validation.validate_fmu`` reports anything."""
    try:
        return bool(validate_fmu(str(fmu)))
    except Exception:
        return True


def fmutool_reports(fmu: Path) -> bool:
    """Return True if ``fmutool -check`` reports anything."""
    return bool(fmutool_findings(fmu, 2))


def vdmcheck_reports(fmu: Path) -> bool:
    """Return True if VDMCheck2 reports anything, without the line "No errors found."."""
    done = subprocess.run(
        [os.environ["VDMCHECK2"], fmu.resolve()], capture_output=True, text=True, check=False
    )
    return "No errors found." not in done.stdout.splitlines()


TOOLS = {"`fmpy validate`": fmpy_reports, "`fmutool -check`": fmutool_reports}
if "VDMCHECK2" in os.environ:
    TOOLS["VDMCheck2"] = vdmcheck_reports


def main() -> None:
    folder = Path(sys.argv[1])
    rows = [
        row.split("\t") for row in (folder / "index.tsv").read_text(encoding="utf-8").splitlines()
    ]
    total: Counter[str] = Counter()
    reported: Counter[tuple[str, str]] = Counter()
    for file, name, rules in rows:
        found = {tool: of(folder / file) for tool, of in TOOLS.items()}
        if not rules:
            assert not any(found.values()), f"a tool reports the faultless {file} ({name}): {found}"
            continue
        group = rules.split(".")[0]
        group = f"`{group}`" if group in IN_FILES else "behaviour"
        total[group] += 1
        for tool, is_found in found.items():
            reported[tool, group] += is_found
        print(
            file, name, rules, *(tool for tool in TOOLS if found[tool]), sep="\t", file=sys.stderr
        )
    print(f"| faults | FMUs | {' | '.join(TOOLS)} |")
    print("| --- |" + " --- |" * (1 + len(TOOLS)))
    for group in sorted(total):
        cells = [total[group], *(reported[tool, group] for tool in TOOLS)]
        print(f"| {group} | {' | '.join(map(str, cells))} |")


if __name__ == "__main__":
    main()
