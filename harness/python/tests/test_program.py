"""Calls of the program ``hubslosh`` by the package."""

import json
import os
import re
import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from conftest import option

import hubslosh
from hubslosh import FmuError
from hubslosh.fmu import Fmu
from hubslosh.program import Method

PLAN = """
title = "Two pulses"
profile = "pulse:amplitude=0.05,start=1,width=1,duration=10"
[vary]
slosh.model = ["linear", "spherical"]
"""


def test_campaign_returns_a_table(fmu: Path, tmp_path: Path, request) -> None:
    """The table has a row for each run; the report is in the same folder."""
    binary = option(request, "--hubslosh")
    table = hubslosh.campaign(PLAN, tmp_path / "out", model=fmu, program=binary)
    assert len(table) == 2
    assert (table.attrs["directory"] / "report.html").is_file()


def test_the_package_runs_commands_of_the_program(request) -> None:
    """``python -m hubslosh`` prints the program's output and ends with the program's exit code."""
    python = [sys.executable, "-m", "hubslosh"]
    surroundings = os.environ | {
        "HUBSLOSH": str(option(request, "--hubslosh")),
        "PYTHONPATH": str(Path(hubslosh.__file__).parents[1]),
    }
    for command, code in (["check", "--rules"], 0), (["nonsense"], 2):
        own, said = (
            subprocess.run(
                [*program, *command], env=surroundings, capture_output=True, text=True, check=False
            )
            for program in ([surroundings["HUBSLOSH"]], python)
        )
        assert said.returncode == own.returncode == code
        assert (said.stdout, said.stderr) == (own.stdout, own.stderr)


def test_analyse_returns_a_row_for_a_recording_and_for_the_model(
    fmu: Path, tmp_path: Path, request
) -> None:
    """The recording is from a data logger with other names, milliseconds and decimal commas."""
    binary = option(request, "--hubslosh")
    profile = "exp-sweep:f0=1.25,f1=3.5,duration=60"
    time, growth = 0.02 * np.arange(3001), np.log(3.5 / 1.25) / 60
    torque = 0.1 * np.sin(2 * np.pi * 1.25 * np.expm1(growth * time) / growth)
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    run = hubslosh.simulate(fmu, inputs=inputs, outputs=["omega"])
    table = pd.DataFrame({"t": 1e3 * time, "T": torque, "w": run["omega"]})
    table.to_csv(tmp_path / "bench.csv", sep=";", decimal=",", index=False)
    found = hubslosh.analyse(
        tmp_path / "bench.csv",
        tmp_path / "out",
        "--profile",
        profile,
        "--model",
        "linear",
        columns="time=t:ms,tau_cmd=T,omega=w",
        settings={"tank.h": 0.1},
        fmu=fmu,
        program=binary,
    )
    assert list(found["model"]) == ["recording", "linear"]
    # recording and simulation differ only by last digits of the sine and rounding of milliseconds
    assert np.ptp(found["fit_freq_pct"]) < 1e-4


def test_a_variable_accepts_the_same_units_in_python_as_in_the_command(fmu: Path, request) -> None:
    """Every variable accepts the same units in Python as in the program, with the same factors."""
    command = [option(request, "--hubslosh"), "variables", "--json", "--fmu", fmu]
    listed = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    opened = Fmu.open(fmu)
    assert {variable["name"] for variable in listed} == opened.variables.keys()
    several = 0
    for variable in listed:
        name, units = variable["name"], variable["units"]
        own = opened.unit(name)
        shown = [unit for unit, *_ in opened.variables[name].shown]
        assert set(units) == {unit for unit in (own, *shown) if unit}, name
        for unit, scale in units.items():
            assert opened.scale(name, unit) == (scale["factor"], scale["offset"]), (name, unit)
        several += len(units) > 1
    assert several > 50, "most angles and lengths have a display unit"
    assert opened.convert("tank.h", "50 mm") == opened.convert("tank.h", "50mm") == 0.05


def test_the_message_of_a_failed_command_is_that_of_the_python_error(
    fmu: Path, tmp_path: Path, request
) -> None:
    """A file that is no plan is given as a plan; the error is the message of the command."""
    binary = option(request, "--hubslosh")
    with pytest.raises(FmuError, match=r"(?s)hubslosh campaign: .*sewer"):
        hubslosh.campaign("sewer=1\n", tmp_path, model=fmu, program=binary)


def test_a_missing_command_raises_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to install the program."""
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CARGO_TARGET_DIR", "nowhere")
    monkeypatch.delenv("HUBSLOSH", raising=False)
    for call in (lambda: hubslosh.campaign("thesis"), lambda: hubslosh.identify("data.csv")):
        with pytest.raises(FmuError, match=r"not found.*cargo build --release"):
            call()
    with pytest.raises(FmuError, match="there is no program at elsewhere"):
        hubslosh.campaign("thesis", program="elsewhere")


def with_binary(fmu: Path, binary: bytes, path: Path) -> Path:
    """Write a copy of an FMU to ``path`` in which the library is ``binary``; return ``path``."""
    with zipfile.ZipFile(fmu) as packed, zipfile.ZipFile(path, "w") as new:
        for name in packed.namelist():
            new.writestr(name, binary if "binaries/" in name else packed.read(name))
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no compiler by default")
def test_an_fmu_that_crashes_does_not_end_python(fmu: Path, tmp_path: Path, request) -> None:
    """The FMU's library aborts while it is loaded.

    `identify` raises an error, and `check` reports a finding; the Python process goes on.
    """
    program, library = option(request, "--hubslosh"), tmp_path / "library"
    (source := tmp_path / "crash.c").write_text(
        "#include <stdlib.h>\n__attribute__((constructor)) static void crash(void) { abort(); }\n"
    )
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    crashing = with_binary(fmu, library.read_bytes(), tmp_path / "crashing.fmu")
    table = pd.DataFrame({"time": [0.0, 1.0, 2.0], "tau_cmd": 0.0, "omega": 0.0})
    with pytest.raises(FmuError, match="hubslosh identify: the FMU has ended the process"):
        hubslosh.identify(table, fmu=crashing, program=program)
    checked = hubslosh.check(crashing, only=["load.opens"], program=program)
    assert checked.errors == 1 and "the process ended" in checked.findings[0].text


def test_a_check_gives_typed_findings(fmu: Path, tmp_path: Path, request) -> None:
    """An FMU whose libraries are damaged breaks a rule; the undamaged FMU breaks none."""
    program, seen = option(request, "--hubslosh"), []
    checked = hubslosh.check(fmu, only=["steps"], progress=seen.append, program=program)
    assert (checked.errors, checked.warnings, checked.findings) == (0, 0, ())
    assert len(checked.rules) > 3 and all(rule.skipped is None for rule in checked.rules)
    assert any("rules of calls" in line for line in seen)
    sarif = tmp_path / "broken.sarif"
    broken = with_binary(fmu, b"text", tmp_path / "broken.fmu")
    checked = hubslosh.check(
        broken, "--sarif", str(sarif), only=["load"], progress=False, program=program
    )
    assert checked.errors == len(checked.findings) > 0 and sarif.is_file()
    finding = checked.findings[0]
    assert (finding.rule, finding.severity) == ("load.opens", "error")
    assert f"error load.opens: {finding.place}: " in repr(checked)
    with pytest.raises(FmuError, match=r"^hubslosh check: no rule is called sewers"):
        hubslosh.check(fmu, only=["sewers"], program=program)


def test_ctrl_c_ends_an_identification_and_its_processes(
    fmu: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The signal is sent at the first line of progress, when the subprocess with the FMU runs."""
    time = np.arange(0, 600, 0.02)
    table = pd.DataFrame({"time": time, "tau_cmd": 0.1 * np.sin(time**2 / 30), "omega": 0.0})
    table["omega"] = np.cumsum(table["tau_cmd"]) * 0.02 / 0.32
    table.to_csv(file := tmp_path / "sweep.csv", index=False)

    def living() -> list[str]:
        commands = [
            path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.is_file()
        ]
        return [text for text in commands if str(file).encode() in text]

    def interrupt(_line: str) -> None:
        assert sys.platform != "linux" or len(living()) == 2
        signal.raise_signal(signal.SIGINT)

    # restore the default handler, because background processes of a shell ignore SIGINT
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            hubslosh.identify(
                file, fmu=fmu, progress=interrupt, program=option(request, "--hubslosh")
            )
    finally:
        signal.signal(signal.SIGINT, handler)
    assert not living()


def test_an_unknown_method_of_identify_is_refused() -> None:
    """The error lists the known methods; the flag --method is refused, too."""
    for flags in (["--method", "acceleration"], ["--method=friction"]):
        with pytest.raises(FmuError, match="method="):
            hubslosh.identify("data.csv", None, *flags)


def test_every_method_of_identify_returns_the_same_type(
    fmu: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The case is the method for friction and inertia, with a sweep over a rigid liquid."""
    time = np.arange(0, 60, 0.02)
    torque = 0.1 * np.sin(2 * np.pi * (1.25 * time + 0.01875 * time**2))
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    run = hubslosh.simulate(fmu, {"slosh.model": "frozen"}, inputs, outputs=["omega"])
    run["omega"] += 1e-4 * np.random.default_rng(2).standard_normal(len(run))
    program = option(request, "--hubslosh")
    full = {"tank.h": 0.1}
    found = hubslosh.identify(run, method="friction", settings=full, fmu=fmu, program=program)
    inertia = found.parameters["hub.I"]
    # harness/identify/tests/all/friction.rs tests the accuracy of the method
    assert abs(inertia.value / 0.322414 - 1) < 0.01 and inertia.std > 0 and found.fits
    assert found.model == "frozen" and found.all["condition"] > 1


def test_every_method_of_identification_is_in_the_package_and_in_the_book(
    request: pytest.FixtureRequest,
) -> None:
    """`Method` and the docstring of `identify` list the methods that the program has."""
    command = [option(request, "--hubslosh"), "identify", "--help"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    kinds = re.findall(r"^  (bench|fmu|decay|friction) ", text, re.M)
    # identify uses the method fmu if free= is given
    assert sorted([*get_args(Method), "fmu"]) == sorted(kinds), "Method in hubslosh/program.py"
    pages = (Path(__file__).parents[3] / "book").glob("*.md")
    book = "".join(page.read_text("utf-8") for page in pages)
    for method in get_args(Method):
        assert f'"{method}"' in hubslosh.identify.__doc__, f"docstring of identify: {method}"
    for kind in ("friction", "decay"):
        assert f"hubslosh identify {kind}" in book, f"book/other_methods.md: {kind}"


def test_identification_gives_typed_estimates(
    fmu: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The recording is a sweep of three minutes, simulated by the FMU.

    The liquid is rigid, the friction is dry and the noise is white. The true inertia is within four
    standard deviations of the estimate; the standard deviation is 1/16,000 of the inertia.
    """
    time = np.arange(0, 180, 0.02)
    torque = 0.05 * np.sin(2 * np.pi * (0.3 * time + 0.008 * time**2))
    bench = {"slosh.model": "frozen"}
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    clean = hubslosh.simulate(fmu, bench, inputs, outputs=["omega"])
    run = clean.copy()
    random = np.random.default_rng(1)
    run["omega"] += 1e-4 * random.standard_normal(len(run))
    found = hubslosh.identify(
        run, "frozen", "--also", "none", fmu=fmu, out=tmp_path / "result.json",
        program=option(request, "--hubslosh"),
    )  # fmt: skip
    assert found.model == "frozen" and found.converged
    assert found.all["fit"]["fit_pct"] > 99
    for estimate in found.parameters.values():
        low, high = estimate.interval
        assert low <= estimate.value <= high and estimate.std >= 0
    viscous = found.parameters["friction.b"]
    assert viscous.unit == "N.m.s" and 0 < viscous.std < 0.05 * viscous.value
    assert abs(viscous.value - 0.03793) < 4 * viscous.std
    # a simulation with the identified parameters differs from the recording by far less than the
    # noise of the recording, 1e-4 rad/s
    twin = hubslosh.simulate(fmu, tmp_path / "result.json", inputs, outputs=["omega"])
    assert np.std(twin["omega"] - clean["omega"]) < 3e-5
    (tmp_path / "other.json").write_text("[]")
    reason = r"not a result of `hubslosh identify` with parameters of an FMU$"
    with pytest.raises(FmuError, match=reason):
        hubslosh.simulate(fmu, tmp_path / "other.json", inputs)


INERTIA, VISCOUS = 0.4, 0.05
SPUN_DOWN = {
    "free": {"friction.b": (0.03, 0.0, 1.0), "init.omega@each": 0.1},
    "outputs": ["omega"],
    "settings": {
        "slosh.model": "frozen",
        "fluid.rho": 1e-6,
        "friction.model": "viscous",
        "hub.I": INERTIA,
    },
}


def spun_down() -> list[pd.DataFrame]:
    """Return two recordings, in closed form, of a hub that viscous friction stops."""
    random = np.random.default_rng(1)
    time = np.arange(0.0, 20.0, 0.1)
    return [
        pd.DataFrame(
            {
                "time": time,
                "omega": start * np.exp(-VISCOUS / INERTIA * time)
                + 1e-3 * random.standard_normal(time.size),
            }
        )
        for start in (1.0, -0.5)
    ]


def test_any_fmu_is_fitted_by_the_names_of_its_variables(
    fmu: Path, request: pytest.FixtureRequest
) -> None:
    """Estimates for a hub with a closed-form motion are within 4 σ of the true values."""
    tables = spun_down()
    binary = option(request, "--hubslosh")
    found = hubslosh.identify(tables, fmu=fmu, **SPUN_DOWN, program=binary)
    assert found.fits and found.converged, found.verdict
    truth = {"friction.b": VISCOUS, "init.omega@1": 1.0, "init.omega@2": -0.5}
    for name, estimate in found.parameters.items():
        assert abs(estimate.value - truth[name]) < 4 * estimate.std, name
    spread = found.covariance
    deviations = dict(zip(spread.index, np.sqrt(np.diag(spread)), strict=True))
    for name, estimate in found.parameters.items():
        # widen the interval, because the optimisation ends near the minimum, not at it
        widened = np.hypot(1, found.all["decrement"])
        assert widened * deviations[name] == pytest.approx(estimate.std_noise, rel=1e-9)
    with pytest.raises(FmuError, match=r"friction\.z"):
        hubslosh.identify(
            tables,
            fmu=fmu,
            free={"friction.z": 1.0},
            outputs=["omega"],
            program=option(request, "--hubslosh"),
        )
    with pytest.raises(
        FmuError, match=r"^hubslosh identify: the recording data\[1\] cannot be used"
    ):
        backwards = tables[1].iloc[::-1]
        hubslosh.identify([tables[0], backwards], fmu=fmu, **SPUN_DOWN, program=binary)
    with pytest.raises(FmuError, match="only together with free="):
        hubslosh.identify(tables, fmu=fmu, outputs=["omega"])


def test_a_result_without_intervals_is_printed(fmu: Path, request: pytest.FixtureRequest) -> None:
    """With viscous friction no output depends on the Stribeck speed, whose interval is infinite."""
    bench = {"friction.model": "viscous", "init.slosh_angle": 0.1}
    run = hubslosh.simulate(fmu, bench, stop=4, step=0.05, outputs="omega")
    found = hubslosh.identify(
        run, fmu=fmu, free={"friction.b": 0.03, "friction.omega_s": 0.1}, outputs=["omega"],
        settings=bench, program=option(request, "--hubslosh"),
    )  # fmt: skip
    # the recording has no noise
    assert found.fits and found.parameters["friction.b"].value == pytest.approx(0.03793, rel=1e-3)
    estimate = found.parameters["friction.omega_s"]
    assert estimate.std == np.inf and not estimate.determined
    assert "friction.omega_s = 0.1 ± inf" in str(found)


@pytest.mark.long
def test_the_posterior_has_the_intervals_that_the_fit_states(
    fmu: Path, request: pytest.FixtureRequest
) -> None:
    """For a model that is nearly linear in its unknowns, the posterior is a normal distribution.

    Means, standard deviations and ends of the intervals agree within the accuracy of 190
    independent samples.
    """
    tables, binary = spun_down(), option(request, "--hubslosh")
    found = hubslosh.identify(tables, fmu=fmu, **SPUN_DOWN, program=binary)
    samples = hubslosh.posterior(
        found, tables, fmu=fmu, **SPUN_DOWN, walkers=64, steps=40, burn=10, program=binary
    )
    assert len(samples) == 64 * 30
    # 1920 samples with a correlation time of some ten steps count as 190 independent samples, whose
    # mean is known to 0.07 σ, standard deviation to 5 %, and ends of the interval to some 0.2 σ.
    # Four times these errors are allowed.
    for name, estimate in found.parameters.items():
        sample = samples[name]
        assert abs(sample.mean() - estimate.value) < 0.3 * estimate.std, name
        assert abs(sample.std() / estimate.std - 1) < 0.2, name
        for end, stated in zip(sample.quantile([0.025, 0.975]), estimate.interval, strict=True):
            assert abs(end - stated) < 0.8 * estimate.std, name
