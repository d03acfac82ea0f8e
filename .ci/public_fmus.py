"""Compares findings of `hubslosh check` on public FMUs with the reviewed findings.

`.ci/public-fmus` describes it.
"""

import argparse
import csv
import hashlib
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

LIST = Path("harness/check/public/fmus.csv")
CACHE = Path(os.environ.get("CARGO_TARGET_DIR", "target")) / "public-fmus"
# Texts of findings that depend on the load of the machine or on licences. The column of_machine
# names these findings and, by hand, random findings of FMUs that write into memory of others.
OF_MACHINE = ("no end after", "license")
# Rules that check files only, with equal findings on every machine.
OF_FILES = ("zip.", "xml.", "bin.")
# True on the platform of the record; on others only the rules of files are compared.
IS_PLATFORM = (sys.platform, platform.machine()) == ("linux", "x86_64")
SECONDS_OF_GIT = 600


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def git(folder: Path, *arguments: str) -> bytes | None:
    """Return the output of git in ``folder``, or None if git fails."""
    environment = {**os.environ, "GIT_TERMINAL_PROMPT": "0", "GIT_LFS_SKIP_SMUDGE": "1"}
    command = ["git", "-C", str(folder), *arguments]
    try:
        done = subprocess.run(
            command, capture_output=True, env=environment, timeout=SECONDS_OF_GIT, check=False
        )
    except subprocess.TimeoutExpired:
        return None
    return done.stdout if done.returncode == 0 else None


def fetch(repository: str, rows: list[dict]) -> None:
    """Download the FMUs of one repository, the ``rows`` of the list, into the cache.

    FMUs that cannot be reached are left out.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        git(folder, "init", "--quiet", "--bare")
        git(folder, "remote", "add", "origin", repository)
        git(folder, "config", "remote.origin.promisor", "true")
        git(folder, "config", "remote.origin.partialclonefilter", "blob:none")
        for commit in {row["commit"] for row in rows}:
            arguments = ["fetch", "--quiet", "--depth=1", "--filter=blob:none", "origin", commit]
            if git(folder, *arguments) is None:
                continue
            for row in rows:
                content = git(folder, "cat-file", "blob", f"{commit}:{row['path']}")
                is_whole = content is not None and row["commit"] == commit
                if is_whole and hashlib.sha256(content).hexdigest() == row["sha256"]:
                    (CACHE / f"{row['sha256']}.fmu").write_bytes(content)


def findings(fmu: Path) -> tuple[dict[str, set[str]], set[str]]:
    """Return the rules that ``hubslosh check`` reports for an FMU.

    The three results are the rules with errors, the rules with warnings, and the rules whose
    findings may differ between machines.
    """
    with tempfile.TemporaryDirectory() as name:
        report = Path(name) / "report.json"
        command = [os.environ["HUBSLOSH"], "check", str(fmu), f"--json={report}"]
        done = subprocess.run(
            [*command, "--quiet", "--limit", "60"], capture_output=True, text=True, check=False
        )
        if not report.exists():
            sys.exit(f"error: {fmu}: {done.stderr.strip()}")
        rules = json.loads(report.read_text(encoding="utf-8"))["rules"]
    found = {"error": set(), "warning": set()}
    machine = set()
    for rule in rules:
        for finding in rule["findings"]:
            found[finding["severity"]].add(rule["rule"])
            if any(text in finding["text"] for text in OF_MACHINE):
                machine.add(rule["rule"])
    return found, machine


def main() -> None:
    """Check all FMUs that can be downloaded; exit with 1 if a finding differs from the record."""
    parser = argparse.ArgumentParser(prog=".ci/public-fmus", description=__doc__)
    parser.add_argument("--folder", type=Path, action="append", default=[])
    parser.add_argument("--offline", action="store_true")
    parser.add_argument("--complete", action="store_true")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    with LIST.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    CACHE.mkdir(parents=True, exist_ok=True)
    wanted = {row["sha256"] for row in rows}
    files = (path for folder in [CACHE, *options.folder] for path in folder.rglob("*.fmu"))
    there = {digest: path for path in files if (digest := sha256(path)) in wanted}
    missing = [row for row in rows if row["sha256"] not in there]
    if not options.offline:
        for repository in sorted({row["repository"] for row in missing}):
            fetch(repository, [row for row in missing if row["repository"] == repository])
        there |= {digest: path for path in CACHE.glob("*.fmu") if (digest := path.stem) in wanted}
    differences, by_rule, seconds = [], Counter(), []
    for row in (row for row in rows if row["sha256"] in there):
        start = time.monotonic()
        found, machine = findings(there[row["sha256"]])
        seconds.append(time.monotonic() - start)
        by_rule.update(found["error"])
        skip = machine | set(row["of_machine"].split())
        loads = "load.opens" not in found["error"]
        is_callable = IS_PLATFORM and loads == ("load.opens" not in row["errors"].split())
        for severity in ("error", "warning"):
            recorded = set(row[f"{severity}s"].split())
            for rule in sorted((found[severity] ^ recorded) - skip):
                if not is_callable and not rule.startswith(OF_FILES):
                    continue
                kind = "not in the record" if rule in found[severity] else "no longer found"
                place = f"{row['repository']} {row['path']}"
                differences.append(f"{place}: {severity} {rule}: {kind}")
            if options.record:
                row[f"{severity}s"] = " ".join(sorted(found[severity]))
        if options.record:
            row["of_machine"] = " ".join(sorted(skip))
    if options.record:
        with LIST.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    for rule, count in sorted(by_rule.items()):
        print(f"{rule}: errors in {count} FMUs")
    print("\n".join(differences))
    absent = [row for row in rows if row["sha256"] not in there]
    for repository, count in sorted(Counter(row["repository"] for row in absent).items()):
        print(f"unreachable: {count} FMUs of {repository}")
    if not there:
        print("no public FMU can be reached: nothing is compared")
    else:
        print(f"{len(there)} of {len(rows)} FMUs compared, {len(differences)} differences")
        print(f"{sum(seconds) / len(seconds):.1f} s per FMU, {max(seconds):.1f} s at most")
    sys.exit(1 if differences or (options.complete and absent) else 0)


if __name__ == "__main__":
    main()
