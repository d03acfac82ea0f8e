"""Fill tables: SloshTank with a table is compared with a tank computed at the same fill."""

import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import option

import hubslosh
from hubslosh.craft import BEYOND_THIRD_ORDER

SHAPES = {
    "cylinder": "cylinder = { radius = 0.5, height = 1.5 }",
    "sphere": "sphere = { radius = 0.5 }",
}
FILLS = (3.1, 7.7, 15.2, 29.1, 44.3, 67.2, 87.9, 96.9)  # per cent
G = 9.81  # m/s²


@pytest.mark.parametrize("shape", ["cylinder", pytest.param("sphere", marks=pytest.mark.long)])
def test_a_fill_table_gives_the_parameters_of_the_tank_between_its_points(
    shape: str, request: pytest.FixtureRequest, fmu: Path, tmp_path: Path
) -> None:
    """Interpolated frequency and slosh mass are within 0.5 % of a computation at the same fill.

    Forces and torques, which depend on the height of the hinge, are within 2 %.
    """
    program, tank = option(request, "--hubslosh"), tmp_path / "tank.toml"
    tank.write_text(f"density = 1000\nshape = {{ {SHAPES[shape]} }}\n")

    def parameters(*fills: str) -> Path:
        out = tmp_path / "parameters.toml"
        command = [program, "tank", tank, *fills, "--modes=1", "--model=SloshTank"]
        subprocess.run([*command, "--parameters", out], check=True, capture_output=True)
        return out

    def swing(values: dict) -> pd.DataFrame:
        sine = 0.05
        start = {"tank.p_0[1,1]": sine, "tank.p_0[1,3]": -np.sqrt(1 - sine**2), "tank.g_ref": G}
        inputs = pd.DataFrame({"time": [0.0, 0.5], "a[3]": [G, G]})
        outputs = ["force[1]", "torque[2]", "mass", "der(tank.p_dot[1,1])", "center_of_mass[1]"]
        model = fmu.with_name("SloshTank.fmu")
        return hubslosh.simulate(model, {**values, **start}, inputs, step=0.01, outputs=outputs)

    table = hubslosh.read_parameters(parameters("--sweep", "2%,98%"))
    for fill in FILLS:
        own = hubslosh.read_parameters(parameters("--fill", f"{fill}%"))
        tables = table
        if any(BEYOND_THIRD_ORDER.search(name) for name in own):
            # leave out coefficients beyond third order, which a table does not have
            own = {n: value for n, value in own.items() if not BEYOND_THIRD_ORDER.search(n)}
            own, tables = (
                {n: 1.0 if ".nonlinear_" in n else value for n, value in values.items()}
                for values in (own, table)
            )
        third_order = {name: value for name, value in tables.items() if ".nonlinear_" in name}
        exact = swing({**own, **third_order})
        met = swing({**tables, "tank.liquid_0": exact["mass"][0]})
        stiffness = met["der(tank.p_dot[1,1])"][0] / exact["der(tank.p_dot[1,1])"][0]
        assert np.sqrt(stiffness) == pytest.approx(1, abs=5e-3), fill
        # m l sin(angle) compares the mass, because the frequency determines the length
        moment = met["center_of_mass[1]"][0] / exact["center_of_mass[1]"][0] * stiffness
        assert moment == pytest.approx(1, abs=5e-3), fill
        # torque: m g l sin(angle) about the hinge, and the height of the hinge times the force
        mass, force = exact["mass"][0], exact["force[1]"]
        assert np.abs(met["force[1]"] - force).max() < 0.02 * np.abs(force).max(), fill
        arm = np.abs(met["torque[2]"] - exact["torque[2]"]).max()
        assert arm < 0.02 * (np.abs(exact["torque[2]"]).max() + 0.01 * mass * G * 0.05), fill
