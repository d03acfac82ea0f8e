"""Slosh benchmark: the scores of HubSlosh equal the table; score.py reports wrong results."""

import math
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import ROOT

BENCHMARK = ROOT / "harness" / "benchmark"
sys.path[:0] = [str(BENCHMARK), str(BENCHMARK / "implementations")]

import cases  # noqa: E402
import compare  # noqa: E402
import hubslosh_fmus  # noqa: E402
import plain  # noqa: E402
import score  # noqa: E402

SHOWN = 0.1
"""Resolution of the correct digits in the table; differences between NumPy's sums are smaller."""


def kept(name: str) -> dict[str, dict[str, str]]:
    """Return the rows of the stored table of scores for the implementation ``name``, by case."""
    return {row["case"]: row for row in compare.read_scores() if row["implementation"] == name}


def test_hubslosh_has_the_scores_in_the_table_of_the_benchmark(
    fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The results of all ten cases have the scores of the table, to one digit."""
    monkeypatch.setattr(hubslosh_fmus, "FOLDER", fmu.parent)
    for case, run in hubslosh_fmus.CASES.items():
        cases.write(tmp_path, case, run())
    scores, errors = score.collect(tmp_path)
    assert not errors
    rows = kept("HubSlosh")
    assert [each.case for each in scores] == list(rows) == list(score.specification())
    for each in scores:
        row = rows[each.case]
        assert str(each.passed) == row["passed"]
        slack = SHOWN if each.digits < 12 else 0.5
        assert each.digits == pytest.approx(float(row["digits"]), abs=slack), each


def test_the_table_in_the_readme_equals_the_stored_scores() -> None:
    """The table in the README of the benchmark equals the file scores.csv."""
    text = compare.PAGE.read_text(encoding="utf-8")
    assert text == compare.with_table(text, compare.read_scores())


@pytest.mark.parametrize("case", ["linearisation", "backbones"])
def test_a_plain_script_has_the_scores_in_the_table_of_the_benchmark(
    case: str, tmp_path: Path
) -> None:
    """The script uses SciPy; cases that take long are left out."""
    cases.write(tmp_path, case, plain.CASES[case]())
    found = score.score(case, tmp_path / case / "results.csv")
    row = kept("SciPy")[case]
    slack = SHOWN if found.digits < 12 else 0.5
    assert found.digits == pytest.approx(float(row["digits"]), abs=slack)
    assert found.passed


@pytest.mark.parametrize("case", list(score.specification()))
def test_the_page_of_a_benchmark_case_contains_all_its_parameters_and_inputs(case: str) -> None:
    """The page repeats the numbers of the files, and names every column with its unit."""
    page = BENCHMARK.joinpath(case, "page.md").read_text(encoding="utf-8")
    parameters = BENCHMARK / case / "parameters.toml"
    if parameters.exists():
        assert parameters.read_text(encoding="utf-8").strip() in page
        tomllib.loads(parameters.read_text(encoding="utf-8"))
    inputs = BENCHMARK / case / "input.csv"
    if inputs.exists() and case != "backbones":
        for line in inputs.read_text(encoding="utf-8").splitlines()[2:]:
            assert f"| {line.replace(',', ' | ')} |" in page
    columns = score.specification()[case]["columns"]
    assert ",".join(score.header(*column) for column in columns.items()) in page


def test_all_files_of_the_benchmark_together_have_at_most_2_mb() -> None:
    """A copy of the benchmark is therefore small."""
    files = [path for path in BENCHMARK.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    assert sum(path.stat().st_size for path in files) < 2e6


def reference(case: str) -> list[str]:
    """Return the lines of a case's reference result."""
    text = BENCHMARK.joinpath(case, "results.csv").read_text(encoding="utf-8")
    return [line for line in text.splitlines() if not line.startswith("#")]


def scored(lines: list[str], folder: Path, case: str = "bench_linear") -> score.Score:
    """Return the score that ``score.py`` gives to a results.csv with these lines."""
    path = folder / case / "results.csv"
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return score.score(case, path)


def changed(change: Callable[[list[float]], list[float]]) -> list[str]:
    """Return the lines of the reference result of bench_linear with changed rows."""
    head, *rows = reference("bench_linear")
    return [head, *(",".join(map(repr, change([*map(float, row.split(","))]))) for row in rows)]


def test_a_reference_result_has_the_largest_score(tmp_path: Path) -> None:
    """Columns in another order, further times, comments and spaces are allowed."""
    lines = reference("bench_linear")
    assert scored(lines, tmp_path).digits == score.MOST_DIGITS
    turned = [",".join(reversed(line.split(","))) for line in lines]
    more = ["# mine", *turned, "0.1, 0.2, 0.3, 0.05", ""]
    assert scored(more, tmp_path).digits == score.MOST_DIGITS


@pytest.mark.parametrize(
    ("change", "digits"),
    [
        (lambda row: [row[0], row[1] + 1e-4 * 0.1320, *row[2:]], 4.0),
        (lambda row: [*row[:3], row[3] * (1 + 1e-7)], 7.0),
        (lambda row: [*row[:3], 0.0], 0.0),
    ],
)
def test_correct_digits_are_computed_from_the_error_over_the_largest_value(
    change: Callable, digits: float, tmp_path: Path
) -> None:
    """The error is divided by the largest value of the column; theta is at most 0.132 rad."""
    found = scored(changed(change), tmp_path)
    assert found.digits == pytest.approx(digits, abs=0.01)
    assert found.passed == (digits >= 6)


@pytest.mark.parametrize(
    ("factor", "hint"), [(180 / math.pi, "degrees for radians"), (-1.0, "the opposite sign")]
)
def test_the_score_names_a_wrong_unit_or_sign_as_possible_cause(
    factor: float, hint: str, tmp_path: Path
) -> None:
    """The message names a column that is in degrees, or that has the opposite sign."""
    found = scored(changed(lambda row: [row[0], factor * row[1], *row[2:]]), tmp_path)
    assert not found.passed
    assert found.hint == f"theta looks like {hint}"


HEAD = "time [s],theta [rad],omega [rad/s],alpha [rad]"


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "has no rows"),
        ([HEAD], "no row with time = 0 s"),
        (["time [s],theta [rad],omega [rad/s]", "0,0,0"], "column alpha is missing"),
        ([HEAD + ",p [1]", "0,0,0,0,0"], "column p is unknown"),
        (
            [HEAD.replace("theta [rad]", "theta [deg]"), "0,0,0,0"],
            "theta is in deg; convert it to rad",
        ),
        ([HEAD.replace(" [rad/s]", ""), "0,0,0,0"], "omega has no unit; write omega [rad/s]"),
        ([HEAD.replace(",", ";"), "0;0;0;0"], "has semicolons"),
        ([HEAD.replace("alpha", "theta"), "0,0,0,0"], "column theta stands 2 times"),
        ([HEAD, "0,0,0"], "line 2 has 3 cells for 4 columns"),
        ([HEAD, "0,0,x,0"], "'x' in column omega is not a number"),
        ([HEAD, "0,0,nan,0.05"], "no row with time = 0.1 s"),
    ],
)
def test_the_error_about_a_file_that_cannot_be_scored_names_the_reason(
    lines: list[str], words: str, tmp_path: Path
) -> None:
    """The message names the line or column, and the allowed values."""
    with pytest.raises(score.ResultsError) as error:
        scored(lines, tmp_path)
    assert words in str(error.value)


def test_rows_with_wrong_times_and_values_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    """Results on a shifted grid of times, and results with an infinite value, are refused."""
    with pytest.raises(score.ResultsError, match="no row with time = 0 s; its rows"):
        scored(changed(lambda row: [row[0] + 0.05, *row[1:]]), tmp_path)
    with pytest.raises(score.ResultsError, match="omega is empty or not finite at time = 3"):
        scored(
            changed(lambda row: [*row[:2], math.inf if row[0] == 3 else row[2], row[3]]), tmp_path
        )


def test_measurements_that_are_missing_count_as_failed(tmp_path: Path) -> None:
    """A file with only one of 24 rows is scored; a row that does not exist is an error."""
    found = scored(["row [1],value [various]", "4,7.8"], tmp_path, "measured")
    assert (found.digits, found.needed, found.passed) == (1.0, 24.0, False)
    with pytest.raises(score.ResultsError, match="there is no row 25"):
        scored(["row [1],value [various]", "25,7.8"], tmp_path, "measured")


def test_a_folder_without_cases_is_an_error(tmp_path: Path) -> None:
    """The message says in which folder a results.csv belongs."""
    scores, errors = score.collect(tmp_path)
    assert not scores
    assert "CASE/results.csv" in errors[0]
    assert "is no folder" in score.collect(tmp_path / "none")[1][0]
