"""Scores results of the slosh benchmark; needs only Python 3.11.

    python3 score.py RESULTS_FOLDER

RESULTS_FOLDER contains a folder for each case that you have run, which has the name of the case and
contains your results.csv. It must have the same columns, units and rows as the results.csv of this
benchmark, which is the reference. Cases that you have not run are left out.

The program prints a line for each case: the number of correct digits, the column and row with the
largest error, and pass or fail. The exit code is 0 if every case in the folder has a score, even if
it fails, and 1 if a file has an error. ``--json`` prints the scores as JSON.
"""

import argparse
import csv
import json
import math
import sys
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
MOST_DIGITS = 15.0
"""Number of digits of a result without error; references have about as many correct digits."""
HINTS = {
    math.degrees(1): "degrees for radians",
    math.radians(1): "radians for degrees",
    1e3: "thousandths of the unit, such as mm for m",
    1e-3: "thousands of the unit, such as m for mm",
    -1.0: "the opposite sign",
}
"""Frequent mistakes, by the factor between a column and its reference that they cause."""


class ResultsError(Exception):
    """Raised if a results.csv cannot be scored."""


@dataclass(frozen=True)
class Table:
    """Rows of a results.csv, each with its values by column."""

    columns: dict[str, str]
    rows: list[dict[str, float]]


@dataclass(frozen=True)
class Score:
    """The score of a case."""

    case: str
    title: str
    digits: float
    """-log10 of the largest relative error; for measurements, the number of rows that pass."""
    needed: float
    passed: bool
    worst: str
    """Column and row of the largest error, in words."""
    hint: str = ""


def specification() -> dict[str, dict]:
    """Return the specification of each case from specification.toml."""
    return tomllib.loads((HERE / "specification.toml").read_text(encoding="utf-8"))


def header(name: str, unit: str) -> str:
    """Return the header of a column in a results.csv, such as ``omega [rad/s]``."""
    return f"{name} [{unit}]"


def split(head: str) -> tuple[str, str | None]:
    """Return name and unit of a column from its header; the unit is None if it has none."""
    name, bracket, rest = head.strip().partition("[")
    return name.strip(), rest.strip().removesuffix("]").strip() if bracket else None


def read(path: Path, columns: dict[str, str]) -> Table:
    """Read a results.csv with these columns.

    Lines that begin with # are comments. An empty cell is NaN. Raises ResultsError that names the
    place of the error and the allowed values.
    """
    if not path.is_file():
        raise ResultsError(f"{path} is missing")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ResultsError(f"{path} is not UTF-8 text") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise ResultsError(f"{path} has no rows")
    wanted = ",".join(header(name, unit) for name, unit in columns.items())
    if ";" in lines[0][1] and "," not in lines[0][1]:
        raise ResultsError(f"{path} has semicolons; separate the columns with commas: {wanted}")
    heads = [split(head) for head in next(csv.reader([lines[0][1]]))]
    names = [name for name, _ in heads]
    problems = [f"column {name} is missing" for name in columns if name not in names]
    problems += [
        f"column {name or '(no name)'} is unknown" for name in names if name not in columns
    ]
    problems += [f"column {name} stands {names.count(name)} times" for name in columns
                 if names.count(name) > 1]  # fmt: skip
    for name, unit in heads:
        if name in columns and unit is None:
            problems.append(f"column {name} has no unit; write {header(name, columns[name])}")
        elif name in columns and unit != columns[name]:
            problems.append(f"column {name} is in {unit}; convert it to {columns[name]}")
    if problems:
        raise ResultsError(f"{path}: {'; '.join(problems)}. The columns are {wanted}")
    rows = []
    for number, line in lines[1:]:
        cells = next(csv.reader([line]))
        if len(cells) != len(names):
            raise ResultsError(
                f"{path}, line {number} has {len(cells)} cells for {len(names)} columns"
            )
        row = {}
        for name, cell in zip(names, cells, strict=True):
            try:
                row[name] = float(cell) if cell.strip() else math.nan
            except ValueError:
                raise ResultsError(
                    f"{path}, line {number}: {cell!r} in column {name} is not a number"
                ) from None
        rows.append(row)
    return Table(columns, rows)


def reference(case: str, specified: dict) -> Table:
    """Return the reference of a case."""
    columns = specified["columns"]
    if specified["kind"] == "intervals":
        columns = {"row": "1", "measured": "various", "error": "various", "band": "various"}
    return read(HERE / case / "results.csv", columns)


def match(path: Path, table: Table, wanted: Table) -> list[dict[str, float]]:
    """Return the rows of ``table`` that the reference ``wanted`` has, too, in ascending order.

    Rows are matched and sorted by the first column. The table may have further rows, for example at
    more times. ``path`` is the file that error messages name.
    """
    key = next(iter(wanted.columns))
    keys = sorted((row[key], i) for i, row in enumerate(table.rows))
    spaces = [b[key] - a[key] for a, b in zip(wanted.rows, wanted.rows[1:], strict=False)]
    near = 1e-6 * min(map(abs, spaces))
    found = []
    at = 0
    for row in sorted(wanted.rows, key=lambda row: row[key]):
        while at < len(keys) and keys[at][0] < row[key] - near:
            at += 1
        if at == len(keys) or keys[at][0] > row[key] + near:
            first, last = (keys[0][0], keys[-1][0]) if keys else (math.nan, math.nan)
            unit = wanted.columns[key]
            raise ResultsError(
                f"{path} has no row with {key} = {row[key]:g} {unit}; its rows reach from "
                f"{first:g} to {last:g} {unit}. The reference has {len(wanted.rows)} rows from "
                f"{wanted.rows[0][key]:g} to {wanted.rows[-1][key]:g} {unit}"
            )
        found.append(table.rows[keys[at][1]])
    return found


def group(name: str) -> str:
    """Return the group of a column, which is its name up to the last underscore."""
    return name.rpartition("_")[0] or name


def score(case: str, path: Path) -> Score:
    """Return the score of a results.csv; raise ResultsError if it cannot be scored."""
    known = specification()
    if case not in known:
        raise ResultsError(f"{case} is no case of the benchmark (cases: {', '.join(known)})")
    specified = known[case]
    table = read(path, specified["columns"])
    wanted = reference(case, specified)
    if specified["kind"] == "intervals":
        return score_intervals(case, specified["title"], path, table, wanted)
    try:
        worst, where, hints = largest_error(match(path, table, wanted), wanted, specified["scale"])
    except ValueError as error:
        raise ResultsError(f"{path}: {error}") from None
    digits = MOST_DIGITS if worst == 0 else min(MOST_DIGITS, -math.log10(worst))
    needed = specified["digits"]
    return Score(case, specified["title"], digits, needed, digits >= needed, where, hints)


def largest_error(
    rows: list[dict[str, float]], wanted: Table, scale: str
) -> tuple[float, str, str]:
    """Return the largest relative error of rows, its column and row, and its possible cause.

    Errors are relative to the largest value of the column if ``scale`` is "column", else to the
    value in the row. Raises ValueError if a value is not finite.
    """
    key, *names = wanted.columns
    whole = scales(wanted.rows, names)
    worst, where, factors = 0.0, "", {name: [] for name in names}
    for row, exact in zip(rows, wanted.rows, strict=True):
        size = whole if scale == "column" else scales([exact], names)
        for name in names:
            if math.isnan(exact[name]):
                continue
            if not math.isfinite(row[name]):
                raise ValueError(f"{name} is empty or not finite at {key} = {exact[key]:g}")
            error = abs(row[name] - exact[name]) / size[group(name)]
            if abs(exact[name]) > 0.01 * size[group(name)]:
                factors[name].append(row[name] / exact[name])
            if error >= worst:
                worst, unit = error, wanted.columns[key]
                where = f"{name} at {key} = {exact[key]:g}{'' if unit == '1' else ' ' + unit}"
    hints = [
        f"{name} looks like {words}"
        for name, found in factors.items()
        for factor, words in HINTS.items()
        if found and same(found, factor)
    ]
    return worst, where, "; ".join(hints)


def same(found: list[float], factor: float) -> bool:
    """Return True if nearly all quotients in ``found`` equal ``factor``.

    All errors then have one cause, for example another unit.
    """
    return sum(abs(x / factor - 1) < 0.05 for x in found) > 0.9 * len(found)


def scales(rows: list[dict[str, float]], names: list[str]) -> dict[str, float]:
    """Return the largest norm of each group of columns over all rows.

    For example, omega_x, omega_y and omega_z are the components of one group.
    """
    largest: dict[str, float] = {}
    for row in rows:
        squares: dict[str, float] = {}
        for name in names:
            if not math.isnan(row[name]):
                squares[group(name)] = squares.get(group(name), 0.0) + row[name] ** 2
        for name, square in squares.items():
            largest[name] = max(largest.get(name, 0.0), math.sqrt(square))
    return largest


def score_intervals(case: str, title: str, path: Path, table: Table, wanted: Table) -> Score:
    """Return the score of a case with measurements: how many rows are within their errors."""
    values = {}
    for row in table.rows:
        if row["row"] not in {exact["row"] for exact in wanted.rows}:
            raise ResultsError(f"{path}: there is no row {row['row']:g} (1 to {len(wanted.rows)})")
        values[row["row"]] = row["value"]
    missed = []
    for exact in wanted.rows:
        value = values.get(exact["row"], math.nan)
        # the tolerance allows rounding, because stored fractions have six digits
        if not abs(value - exact["measured"]) <= exact["error"] + exact["band"] + 1e-5:
            missed.append(f"{exact['row']:g}")
    count = len(wanted.rows)
    where = f"rows that fail or are missing: {', '.join(missed)}" if missed else ""
    return Score(case, title, float(count - len(missed)), float(count), not missed, where)


def collect(folder: Path) -> tuple[list[Score], list[str]]:
    """Return all scores and all error messages of a folder with results."""
    if not folder.is_dir():
        return [], [f"{folder} is no folder"]
    known = specification()
    scores, errors = [], []
    for case in known:
        if (folder / case).is_dir():
            try:
                scores.append(score(case, folder / case / "results.csv"))
            except ResultsError as error:
                errors.append(f"{case}: {error}")
    if not scores and not errors:
        errors.append(f"{folder} has no folder of a case; a results.csv belongs into "
                      f"{folder}/CASE/results.csv, with one of {', '.join(known)}")  # fmt: skip
    return scores, errors


def line(score: Score) -> str:
    verdict = "pass" if score.passed else "FAIL"
    if score.needed > MOST_DIGITS:
        text = f"{score.digits:.0f} of {score.needed:.0f} rows pass"
    else:
        text = f"{score.digits:4.1f} digits (needs {score.needed:g})"
    place = f", largest error in {score.worst}" if score.needed <= MOST_DIGITS else ""
    rest = f"; {score.worst}" if score.needed > MOST_DIGITS and score.worst else ""
    hint = f" ({score.hint})" if score.hint else ""
    return f"{score.case:16} {verdict}  {text}{place}{rest}{hint}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Scores results of the slosh benchmark.")
    parser.add_argument("folder", type=Path, help="a folder with CASE/results.csv")
    parser.add_argument("--json", action="store_true", help="print the scores as JSON")
    args = parser.parse_args()
    scores, errors = collect(args.folder)
    if args.json:
        print(json.dumps({"scores": [asdict(score) for score in scores], "errors": errors}))
    else:
        for each in scores:
            print(line(each))
    for error in errors:
        print(f"error: {error}", file=sys.stderr)
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
