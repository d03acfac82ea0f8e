"""Runs the slosh benchmark with SciPy, heyoka, Basilisk and HubSlosh; writes the table of scores.

    PYTHONPATH=harness/python python3 harness/benchmark/compare.py

It needs the FMUs in dist/ (``cargo run --release -- pack``), the compiled part of the package
(``cargo build --release -p hubslosh-native``) and Python 3.11 or newer. The first run creates a
virtual environment in the target directory and needs the network. It takes a minute of CPU time.

``--only NAME`` runs one implementation, and takes the results of the others from the last run.
``--references`` writes new references, the means of the results of SciPy and heyoka.
"""

import argparse
import csv
import math
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "harness" / "python"), str(HERE)]

import environment  # noqa: E402
import score  # noqa: E402

SCORES = HERE / "scores.csv"
PAGE = HERE / "README.md"
MARKS = ("<!-- scores: written by harness/benchmark/compare.py -->", "<!-- end of scores -->")
IMPLEMENTATIONS = {
    "HubSlosh": ["hubslosh_fmus.py", "--fmus", str(ROOT / "dist")],
    "SciPy": ["plain.py"],
    "heyoka": ["heyoka_taylor.py"],
    "Basilisk": ["basilisk.py"],
}
INDEPENDENT = ("SciPy", "heyoka")
"""Implementations whose mean is the reference of a trajectory or response."""
AGREEING = ("HubSlosh", *INDEPENDENT)
PUBLISHED = ("backbones", "forced", "measured")
"""Cases whose references are published computations or measurements."""


def run(name: str, folder: Path) -> None:
    """Run the implementation ``name``, which writes its results below ``folder``."""
    script, *options = IMPLEMENTATIONS[name]
    command = [sys.executable, HERE / "implementations" / script, folder / name, *options]
    if subprocess.run(command, check=False).returncode:
        sys.exit(f"error: the implementation {name} failed")


def write_references(folder: Path) -> None:
    """Write the references, the means of the independent implementations."""
    for case, specified in score.specification().items():
        if case in PUBLISHED:
            continue
        columns = specified["columns"]
        tables = [score.read(folder / n / case / "results.csv", columns) for n in INDEPENDENT]
        lines = ["# Mean of a SciPy and a heyoka implementation.",
                 ",".join(score.header(*column) for column in columns.items())]  # fmt: skip
        key, *names = columns
        for rows in zip(*(table.rows for table in tables), strict=True):
            values = [math.fsum(row[name] for row in rows) / len(rows) for name in names]
            lines.append(",".join([f"{rows[0][key]:.9g}", *(f"{x + 0.0:.16g}" for x in values)]))
        (HERE / case / "results.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def agreement(case: str, folder: Path) -> float:
    """Return the number of digits to which HubSlosh agrees with the independent implementations.

    The results of ``case`` are in ``folder``.
    """
    specified = score.specification()[case]
    if specified["kind"] == "intervals":
        return math.nan
    columns, worst = specified["columns"], 0.0
    tables = [score.read(folder / n / case / "results.csv", columns) for n in AGREEING]
    for i, exact in enumerate(tables):
        for other in tables[:i]:
            worst = max(worst, score.largest_error(other.rows, exact, specified["scale"])[0])
    return min(score.MOST_DIGITS, -math.log10(worst)) if worst else score.MOST_DIGITS


def write_scores(folder: Path) -> None:
    """Score the results, and write the scores to scores.csv."""
    agreed = {case: agreement(case, folder) for case in score.specification()}
    with SCORES.open("w", newline="", encoding="utf-8") as file:
        file.write("# Written by harness/benchmark/compare.py.\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["case", "agreement", "implementation", "digits", "passed"])
        for name in IMPLEMENTATIONS:
            scores, errors = score.collect(folder / name)
            if errors:
                sys.exit("error: " + "; ".join(errors))
            for each in scores:
                digits = f"{each.digits:.1f}"
                writer.writerow([each.case, f"{agreed[each.case]:.1f}", name, digits, each.passed])


def read_scores() -> list[dict[str, str]]:
    with SCORES.open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def table(rows: Iterable[dict[str, str]]) -> str:
    """Return the table of scores in Markdown."""
    kept = {(row["case"], row["implementation"]): row for row in rows}
    names = list(IMPLEMENTATIONS)
    lines = [
        f"| case | a pass needs | {' | '.join(names)} | HubSlosh, SciPy, heyoka agree to |",
        "| --- | --- |" + " --- |" * (len(names) + 1),
    ]
    for case, specified in score.specification().items():
        intervals = specified["kind"] == "intervals"
        cells = []
        for name in names:
            row = kept.get((case, name))
            if row is None:
                cells.append("–")
            else:
                digits = f"{float(row['digits']):.0f} of 24" if intervals else row["digits"]
                cells.append(digits if row["passed"] == "True" else f"{digits}, **fail**")
        needed = "24 of 24" if intervals else f"{specified['digits']:g}"
        agreed = kept[case, "HubSlosh"]["agreement"]
        cells.append("–" if agreed == "nan" else agreed)
        lines.append(f"| `{case}` | {needed} | {' | '.join(cells)} |")
    return "\n".join(lines)


def with_table(text: str, rows: list[dict[str, str]]) -> str:
    """Return the page ``text`` with the table of scores between its comment marks."""
    begin, end = (text.index(mark) for mark in MARKS)
    return f"{text[:begin]}{MARKS[0]}\n\n{table(rows)}\n\n{text[end:]}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Runs the slosh benchmark.")
    parser.add_argument("--only", choices=IMPLEMENTATIONS, help="run one implementation")
    parser.add_argument("--references", action="store_true", help="write new references")
    args = parser.parse_args()
    try:
        import heyoka  # noqa: F401
        import pandas  # noqa: F401
        import scipy  # noqa: F401
        from Basilisk.simulation import spacecraft  # noqa: F401
    except ModuleNotFoundError as missing:
        environment.run_again_in("benchmark", missing)
    folder = environment.target() / "benchmark"
    for name in [args.only] if args.only else IMPLEMENTATIONS:
        run(name, folder)
    if args.references:
        write_references(folder)
    write_scores(folder)
    text = with_table(PAGE.read_text(encoding="utf-8"), read_scores())
    PAGE.write_text(text, encoding="utf-8")
    print(table(read_scores()))


if __name__ == "__main__":
    main()
