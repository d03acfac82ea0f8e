"""Exported files of a craft: each is read by another tool that reads such files."""

import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd, read_ssv
from scipy.io import loadmat

import hubslosh
from hubslosh import Craft, FmuError, MountedTank, Wheel

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
FILL = {"ox": "40%", "fuel": "70%"}
TURNING = {"init.omega[1]": 0.02, "init.omega[2]": -0.01, "ox.zeta[1]": 0.01}

# Wheels about the body axes with angular momenta of 1, 2 and 3 N·m·s.
WHEELS = {
    name: Wheel(axis, 0.01, 0.2, 400, speed)
    for name, axis, speed in zip("xyz", np.eye(3), (100.0, 200.0, 300.0), strict=True)
}


@pytest.fixture(params=["Spacecraft", "Spacecraft-fmi3"])
def craft(request: pytest.FixtureRequest, fmu: Path) -> Craft:
    """Return a craft with two tanks that needs trimming."""
    tanks = {
        "ox": MountedTank(SPHERE, (0.1, 0.6, 0.2), modes=1),
        "fuel": MountedTank(SPHERE, (0, -0.7, -0.4)),
    }
    return Craft(
        1000.0, (900.0, 800.0, 700.0), (0, 0, 1.0), tanks, 400.0, WHEELS,
        model=fmu.with_name(f"{request.param}.fmu"),
    )  # fmt: skip


def test_an_exported_fmu_simulates_the_craft_in_a_tool_that_sets_no_parameters(
    craft: Craft, tmp_path: Path
) -> None:
    """FMPy, which sets no parameter, gives the results of `Craft.simulate`, bit by bit.

    The FMU has the variables of two tanks only.
    """
    files = craft.export(tmp_path / "craft", FILL, parameters=TURNING)
    run = craft.simulate(FILL, stop=20, step=0.0625, parameters=TURNING)
    names = [name for name in run.columns if name.startswith(("q[", "omega[", "tank["))]
    there = {v.name for v in fmpy.read_model_description(str(files["fmu"])).modelVariables}
    assert "tank[2].p[2,1]" in there and not any(name.startswith("tank[3]") for name in there)
    names = [name for name in names if name in there]
    assert len(names) > 10
    found = fmpy.simulate_fmu(
        str(files["fmu"]), stop_time=20, output_interval=0.0625, fmi_type="CoSimulation",
        output=names,
    )  # fmt: skip
    assert np.ptp(found["q[1]"]) > 1e-3
    for name in ["time", *names]:
        assert found[name].tolist() == run[name].tolist(), name
    again = craft.export(tmp_path / "again", FILL, parameters=TURNING)
    for kind in ("fmu", "ssv", "ssp", "script"):
        assert again[kind].read_bytes() == files[kind].read_bytes(), kind


def test_an_exported_system_has_the_craft_and_its_parameters(craft: Craft, tmp_path: Path) -> None:
    """The SSP file is valid by FMPy's copy of the schemas of SSP 1.0; its .ssv has every value."""
    files = craft.export(tmp_path, FILL, parameters=TURNING)
    system = read_ssd(str(files["ssp"])).system
    (component,) = system.elements
    connectors = {connector.name: connector.kind for connector in component.connectors}
    assert connectors["torque[3]"] == "input" and connectors["omega[1]"] == "output"
    with zipfile.ZipFile(files["ssp"]) as archive:
        archive.extractall(tmp_path / "system")
    assert len(read_ssv(str(tmp_path / "system" / "resources" / "craft.ssv")).parameters) > 50
    assert (tmp_path / "system" / "resources" / "craft.fmu").read_bytes() == files[
        "fmu"
    ].read_bytes()
    wanted = craft.parameters(FILL, parameters=TURNING)
    fmu = hubslosh.Fmu.open(craft.model)
    found = hubslosh.read_parameters(files["ssv"])
    assert {n: fmu.convert(n, v) for n, v in found.items()} == {
        n: fmu.convert(n, v) for n, v in wanted.items()
    }


def test_the_mat_file_contains_the_linear_model(craft: Craft, tmp_path: Path) -> None:
    """The file also has the parameters and the inputs at the start."""
    found = loadmat(craft.export(tmp_path, FILL)["mat"], squeeze_me=True)
    model = craft.linearize(FILL)
    assert (found["A"] == model.A).all() and (found["C"] == model.C).all()
    inputs = dict(zip(found["input_names"], found["input_values"], strict=True))
    assert inputs["force[3]"] == 400 and inputs["h_wheels[2]"] == 2 and inputs["torque[1]"] == 0
    values = dict(zip(found["parameter_names"], found["parameter_values"], strict=True))
    assert values["craft.mass"] == 1000 and values["tanks"] == 2


@pytest.mark.octave
def test_octave_runs_the_exported_script_up_to_the_simulink_commands(
    craft: Craft, tmp_path: Path
) -> None:
    """Octave reads the matrices and finds each port of the script among the FMU's variables.

    The rest of the script needs Simulink.
    """
    craft.export(tmp_path, FILL)
    poles = "dlmwrite('poles', [real(eig(A)) imag(eig(A))], 'precision', '%.17g')"
    done = subprocess.run(
        ["octave-cli", "--eval", f"craft_simulink; {poles}"], cwd=tmp_path, check=False,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "inputs: force[1], force[2]" in done.stdout and "no model is built" in done.stdout
    assert "q[1]" in done.stdout and "omega[3]" in done.stdout
    real, imaginary = np.loadtxt(tmp_path / "poles", delimiter=",").T
    expected = np.sort(np.abs(craft.linearize(FILL).poles.imag))
    assert np.sort(np.abs(imaginary)) == pytest.approx(expected, abs=1e-6)
    assert real.max() < 1e-4


def test_a_folder_that_cannot_be_created_is_named(craft: Craft, tmp_path: Path) -> None:
    """A wrong parameter is also named, before any file is written."""
    (tmp_path / "file").write_text("")
    with pytest.raises(FmuError, match="file cannot be created"):
        craft.export(tmp_path / "file", FILL)
    with pytest.raises(FmuError, match=r"did you mean ox\.zeta"):
        craft.export(tmp_path / "none", FILL, parameters={"ox.zet[1]": 0.1})
    assert not (tmp_path / "none").exists()
