"""Short forms of the studies: numbers and pictures of the book equal those that studies compute.

Studies that take only seconds have files of their own: `test_measured`, `test_cluster` and
`test_analysis`. `cargo test` runs `test_analysis`, and `.ci/long-tests --nightly` runs all others.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from numpy.random import default_rng

import bench_damping
import compare_releases
import damping_over_fill
import design_times
import flight_twin
import foreign_plants
import identify_twins
import intervals
import large_fmu
import mode_errors
import planar_stability
import reversal
import rotary_branch
import tilted_tank
import work_precision
from conftest import ROOT, same_picture

BOOK = ROOT / "book"

pytestmark = pytest.mark.long


def lines(page: str) -> list[str]:
    """Return the lines of a page of the book."""
    return (BOOK / page).read_text(encoding="utf-8").splitlines()


def cells(page: str, first: str) -> list[str]:
    """Return the cells after ``first`` in the only table row of a page that begins with it."""
    (row,) = (line for line in lines(page) if line.startswith(f"| {first} |"))
    return [cell.strip() for cell in row.removeprefix(f"| {first} |").strip("| ").split("|")]


def half_digit(text: str) -> float:
    """Return half a unit of the last digit of a printed number."""
    return 0.5 * 10.0 ** Decimal(text).as_tuple().exponent


@pytest.fixture(autouse=True)
def style() -> None:
    plt.rcdefaults()


def test_the_picture_of_rotary_slosh_in_the_readme_is_reproduced(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture shows two sweeps of 2700 s."""
    monkeypatch.setattr(rotary_branch, "FMU", fmu)
    same_picture(rotary_branch.draw(), rotary_branch.PICTURE)


def test_rotary_slosh_begins_where_planar_slosh_is_unstable(
    fmu: Path, program: Path, tmp_path: Path
) -> None:
    """The torque that the plan t5_near_resonance finds equals that of a stability analysis."""
    text = (ROOT / "harness" / "campaigns" / "t5_near_resonance.toml").read_text(encoding="utf-8")
    plan = re.sub(r"slosh.model = \[.*\]", 'slosh.model = ["spherical"]', text)
    path = tmp_path / "spherical.toml"
    path.write_text(plan, encoding="utf-8")
    command = [program, "campaign", "--plan", path, "--fmu", fmu, "--list"]
    runs = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["runs"]
    dwells = [run["varied"] for run in runs]
    torques = {float(dwell["profile.amplitude"]) for dwell in dwells}
    low, high = sorted(torques - set(tomllib.loads(text)["onset"]["amplitude"]))
    frequency, torque = planar_stability.onset()
    assert torque == pytest.approx((low + high) / 2, abs=0.005)
    assert [float(dwell["profile.frequency"]) for dwell in dwells] == pytest.approx(
        [frequency] * 6, abs=0.005
    )


@pytest.mark.parametrize(("study", "model"), [(mode_errors, "HubSlosh"), (reversal, "Spacecraft")])
def test_the_studies_reproduce_two_pictures_of_the_book(
    study, model: str, fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The studies are `mode_errors` and `reversal`."""
    monkeypatch.setattr(study, "FMU", fmu.with_name(f"{model}.fmu"))
    study.draw(tmp_path / "picture.svg")
    same_picture((tmp_path / "picture.svg").read_text(encoding="utf-8"), study.PICTURE)


def test_damping_over_the_fill_of_a_capsule_has_no_step() -> None:
    """Damping ratios equal the numbers in book/damping.md in all printed digits."""
    text = " ".join(lines("damping.md"))
    at_tangent = re.search(r"where the ratio is ([\d.]+) %", text)
    ends = re.search(r"From 24 to 29 % it stays between ([\d.]+) and ([\d.]+) %", text)
    capsule = damping_over_fill.SHAPES["capsule, cylinder of 0.4 m"]
    found = damping_over_fill.damping(capsule, [f"{share}%" for share in range(24, 30)])
    ratios = 100 * found["zeta_1"]
    assert ratios[1] == pytest.approx(float(at_tangent[1]), abs=5e-4)
    assert ratios.min() == pytest.approx(float(ends[1]), abs=5e-3)
    assert ratios.max() == pytest.approx(float(ends[2]), abs=5e-3)


def slowed(depth: float) -> float:
    """Return by how many per cent a tilt of 60 degrees lowers the frequency along the slope."""
    upright, tilted = (tilted_tank.frequencies(depth, tilt)[0] for tilt in (0, 60))
    return 100 * (1 - tilted / upright)


def test_the_tilt_of_a_shallow_tank_lowers_the_frequency_as_the_book_says() -> None:
    """The change of frequency at half a radius equals the number printed in book/liquid.md."""
    text = " ".join(lines("liquid.md"))
    shallow = re.search(r"give −([\d.]+) % at a depth of half a radius", text)
    assert slowed(0.5) == pytest.approx(float(shallow[1]), abs=0.05)


def test_the_tilt_of_deeper_tanks_lowers_the_frequency_as_the_book_says() -> None:
    """Changes of frequency at two larger depths equal the numbers printed in book/liquid.md."""
    deeper = re.search(r"and −(\d+) to −(\d+) % in deeper liquid", " ".join(lines("liquid.md")))
    found = [slowed(depth) for depth in (1.0, 2.0)]
    assert found == pytest.approx([float(deeper[1]), float(deeper[2])], abs=0.5)


@pytest.mark.parametrize(
    "case", [("linear", 0.0, 0.05, "none"), ("spherical", 0.016, 0.1, "noise")]
)
def test_two_rows_on_the_damping_of_the_bench_in_the_book_are_reproduced(
    case, fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two simulated rows equal the rows of book/damping.md in all printed digits."""
    monkeypatch.setattr(bench_damping, "FMU", fmu)
    table = bench_damping.text(pd.DataFrame([bench_damping.case(case)])).splitlines()
    (row,) = (line for line in table if line.startswith(f"| {case[0]} |"))
    page = lines("damping.md")
    # rows of the 5 cm fill come before rows of the 10 cm fill
    start = page.index(next(line for line in page if line.startswith("| 10 cm fill:")))
    assert row in (page[:start] if case[2] == 0.05 else page[start:])


def test_the_motion_equals_that_of_the_last_release(
    fmu: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """All slosh models and friction laws give the motion of the last release over 300 s.

    Runs of 2700 s, and comparisons with release 0.1.0, are started by hand.
    """
    monkeypatch.setattr(sys, "argv", ["", "--short", "--now", os.fspath(fmu)])
    assert compare_releases.main() == 0, capsys.readouterr().out


@pytest.mark.parametrize("model", ["linear", "spherical"])
def test_the_errors_in_the_work_precision_tables_are_reproduced(
    model: str, fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The FMU's errors over 2700 s at two tolerances equal the digits printed in the book.

    CPU times are not tested, because they depend on the machine; other methods and the counts of
    instructions take too long for a test.
    """
    program = work_precision.build()
    (tmp_path / "dist").mkdir()
    shutil.copy(fmu, tmp_path / "dist" / "HubSlosh.fmu")
    monkeypatch.setattr(work_precision, "ROOT", tmp_path)
    seconds, exact = str(work_precision.SWEEP), str(tmp_path / "exact.f64")
    work_precision.run(program, model, "1e-13", seconds, "1", "--write", exact)
    for tolerance in ("1e-4", "1e-8"):
        _, error = work_precision.run(program, model, tolerance, seconds, "1", exact)
        printed = cells("work_precision.md", f"HubSlosh, {model} | {tolerance}")[0]
        assert error == pytest.approx(float(printed), abs=1.01 * half_digit(printed))


def test_a_simulated_flight_identifies_slosh_as_in_the_book(
    fmu: Path, program: Path, tmp_path: Path
) -> None:
    """The estimates of one simulated flight equal the table of one flight in book/flight.md.

    The flight has the seed 1 and the good gyro. Beyond the printed digits, estimates may differ by
    0.1 of their standard deviations, and standard deviations by 5 %, which hardly matters.
    """
    spacecraft = os.fspath(fmu.with_name("Spacecraft.fmu"))
    truth, found, _ = flight_twin.twin(1, "good", os.fspath(program), spacecraft, tmp_path)
    assert found["fits"] and found["converged"]
    page = lines("flight.md")
    header = "| unknown | true value | estimate with the good gyro | estimate with the MEMS gyro |"
    start = page.index(header) + 2
    rows = page[start : page.index("", start)]
    assert len(rows) == 8
    for row in rows:
        head, true, good = (cell.strip() for cell in row.split("|")[1:4])
        name = head.split("`")[1]
        value, std = good.split(" ± ")
        estimate = found["parameters"][name]
        assert truth[name] == pytest.approx(float(true), abs=half_digit(true))
        slack = half_digit(std) + 0.05 * float(std)
        assert estimate["std"] == pytest.approx(float(std), abs=slack)
        slack = half_digit(value) + 0.1 * float(std)
        assert estimate["value"] == pytest.approx(float(value), abs=slack)


def test_at_least_17_of_20_intervals_of_a_sticking_hub_contain_the_true_value(
    fmu: Path, program: Path, tmp_path: Path
) -> None:
    """The intervals are from five simulated recordings of HubSlosh.

    Of 20 correct 95 % intervals, 17 or more contain the true value with a probability of 98 %; the
    seeds are fixed. Standard deviations are within a factor of two of the medians on the page,
    because inertia and friction are drawn within 30 %.
    """
    case = identify_twins.CASES["Hub"]
    case.fmu = os.fspath(fmu)
    page = BOOK.joinpath("identification_method.md").read_text(encoding="utf-8")
    inside, stated = 0, {}
    for seed in range(1, 6):
        twin = case.make(default_rng(seed))
        found = identify_twins.run(case, twin, os.fspath(program), os.fspath(tmp_path))
        assert found["fits"] and found["converged"]
        for unknown, e in (found["parameters"] | found["measurement"]).items():
            low, high = e["interval"]
            inside += low <= twin.truth[unknown] <= high
            stated.setdefault(unknown, []).append(e["std"])
    assert inside >= 17
    section = page[page.index("| HubSlosh, stick and slip") :]
    for unknown, deviations in stated.items():
        row = next(line for line in section.splitlines() if f"`{unknown}`" in line)
        median = float(row.strip("| ").split("|")[-1])
        assert 0.5 < np.median(deviations) / median < 2


@pytest.mark.skipif(sys.platform != "linux", reason="the study compiles a plant for Linux")
@pytest.mark.parametrize("liquid", foreign_plants.LIQUIDS)
def test_an_independent_simulator_without_additional_effects_moves_like_hubslosh(
    liquid: str, fmu: Path, tmp_path: Path
) -> None:
    """The second simulator and HubSlosh agree to 1e-7 of the largest rate, also with stops.

    The plant has another integrator and other states than the FMU.
    """
    import hubslosh

    setup = foreign_plants.draw(default_rng(1), 60.0)
    setup = replace(setup, liquid=liquid, hold="linear", gravity=9.81)
    setup.torque = foreign_plants.sweep(0.05, 1.5, 3.6, 60.0)
    rows = np.arange(0.0, 60.001, 0.02)
    _, rates = setup.move(foreign_plants.compile_plant(os.fspath(tmp_path)), rows)
    inputs = pd.DataFrame({"time": rows, "tau_cmd": setup.torque(rows)})
    more = {
        "slosh.model": liquid,
        "slosh.zeta_from_correlation": False,
        "tank.r": setup.arm,
        "fluid.rho": setup.density,
    }
    run = hubslosh.simulate(
        fmu, setup.parameters | more, inputs, outputs=["omega", "stuck"], tolerance=1e-10
    )
    assert run["stuck"].any()
    largest = abs(run["omega"]).max()
    np.testing.assert_allclose(rates[::20], run["omega"], rtol=0, atol=1e-7 * largest)


@pytest.mark.skipif(sys.platform != "linux", reason="the study compiles a binary for Linux")
@pytest.mark.parametrize("only", ["decay", "gyro", "tank", "design --free"])
def test_at_most_one_of_four_intervals_misses_the_true_value(
    only: str, fmu: Path, program: Path, tmp_path: Path
) -> None:
    """Correct 95 % intervals fail this test with a probability of 1.4 %."""
    bench = intervals.Bench(os.fspath(program), os.fspath(fmu), tmp_path)
    rows = list(intervals.census(bench, only, 4))
    assert rows
    for row in rows:
        found = re.search(r"(\d) of 4 .* (\d) \| ([^|]*) \|$", row)
        assert found is not None, row
        held, without, of_fit = found.groups()
        assert int(held) >= 3
        assert without == "0", row
        # the width that `design` predicts is the width of the fit
        assert of_fit == "-" or abs(float(of_fit.split()[0]) - 1) < 0.2, row


def test_the_check_of_an_fmu_with_many_variables_finds_no_error(
    program: Path, tmp_path: Path
) -> None:
    """The FMU is that of book/check_ci.md, with 1000 variables."""
    fmu = tmp_path / "large.fmu"
    large_fmu.write(fmu, 1000)
    done = subprocess.run([program, "check", fmu, "--json"], capture_output=True, check=False)
    report = json.loads(done.stdout)
    assert done.returncode == 0, report
    checked = {rule["rule"] for rule in report["rules"] if not rule.get("skipped")}
    assert checked >= {"steps.run", "exchange.run", "values.start", "states.rollback", "life.reset"}


@pytest.mark.filterwarnings("ignore:tank.*outside the measured")
def test_the_table_of_design_times_has_every_step_with_its_number_of_tasks(
    fmu: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The short form measures few tasks."""
    import hubslosh

    telecom, _ = design_times.satellite()
    craft = replace(telecom.craft, model=fmu.with_name("Spacecraft.fmu"))
    monkeypatch.setattr(telecom, "craft", craft)
    monkeypatch.setattr(telecom, "FILLS", ["50%"])
    times, given = design_times.now(2, 0, 2, 1.0)
    assert [time.count for time in times[:2]] + [times[3].count] == [10, 2, 2]
    assert times[2].count > 5 and all(time.elapsed > 0 for time in times)
    given["model"] = str(craft.model)
    again, first = design_times.loop_of(given), telecom.loop("50%")
    assert hubslosh.margins(again).delay_margin == hubslosh.margins(first).delay_margin
