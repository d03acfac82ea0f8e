"""The page that shows a run in 3-D."""

import base64
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import option

import hubslosh
from hubslosh import FmuError


def shown(page: str) -> dict:
    """Return the data that a page of `view` draws."""
    found = re.search(r'<script type="application/json" id="run">(.*?)</script>', page, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_view_draws_a_table_with_the_parameters_of_its_run(fmu: Path, request) -> None:
    """The tank has the set diameter, which is in another unit; columns are rounded to 32 bits."""
    parameters = {"tank.d": (200, "mm"), "slosh.model": "spherical", "init.slosh_angle": 0.2}
    run = hubslosh.simulate(fmu, parameters=parameters, stop=3.0, step=0.02)
    page = hubslosh.view(run, program=option(request, "--hubslosh"))
    drawn = shown(page.html)
    tank = drawn["scene"]["geometry"]["tanks"][0]
    assert [0.1, 0.0] in tank["shape"]["contour"]
    assert tank["modes"][0]["wave"] == pytest.approx(0.2 / (1.841183781**2 - 1))
    angle = np.frombuffer(base64.b64decode(drawn["columns"]["slosh_angle"]), "<f4")
    assert np.array_equal(angle, run["slosh_angle"].to_numpy().astype("f4"))
    assert "srcdoc" in page._repr_html_() and page.path is None
    # the method `view` of the table, and of a selection of it, gives the same page
    same = run.view(program=option(request, "--hubslosh"))
    assert same.html == page.html
    part = run[run["time"] < 1.0].view(program=option(request, "--hubslosh"))
    assert shown(part.html)["time"]["count"] == (run["time"] < 1.0).sum()


def test_a_table_without_the_columns_of_the_motion_is_refused(
    fmu: Path, tmp_path: Path, request
) -> None:
    """One message lists all missing columns and how to record them; no page is written."""
    run = hubslosh.simulate(fmu, stop=1.0, step=0.02, outputs=["wave_height"])
    out = tmp_path / "page.html"
    with pytest.raises(FmuError, match=r"theta \(or omega\).*slosh_angle") as error:
        hubslosh.view(run, out, program=option(request, "--hubslosh"))
    assert "--columns theta,omega,slosh_angle,slosh_angle_radial" in str(error.value)
    # the message does not contain the name of a temporary file
    assert "the run cannot be drawn" in str(error.value)
    assert not out.exists()


def test_a_tank_is_drawn_with_the_shape_in_its_file(fmu: Path, tmp_path: Path, request) -> None:
    """In a half-full sphere the surface is drawn at half the height."""
    tank = tmp_path / "sphere.toml"
    tank.write_text("density = 1000\nshape = { sphere = { radius = 0.1 } }\n")
    mass = 1000 * 2 / 3 * np.pi * 0.1**3
    depth = mass / 1000 / (np.pi * 0.0815**2)
    run = hubslosh.simulate(fmu, {"tank.h": float(depth)}, stop=1.0, step=0.02)
    page = hubslosh.view(run, tanks=[tank], program=option(request, "--hubslosh"))
    drawn = shown(page.html)["scene"]["geometry"]["tanks"][0]
    # the height is interpolated between heights at each hundredth of the volume
    assert drawn["level"] == pytest.approx(0.1, abs=1e-4)
    assert max(r for r, _ in drawn["shape"]["contour"]) == pytest.approx(0.1)


def test_a_run_is_a_pandas_table_also_after_a_loop_a_copy_and_a_pickle(fmu: Path, request) -> None:
    """``run.view()`` works on selections and copies of the table, and refuses other tables."""
    run = hubslosh.closed_loop([[0.5, 0.6]], 0.1, 2.0, fmu)
    for table in (run, run.iloc[5:], run.copy(), pickle.loads(pickle.dumps(run))):
        assert isinstance(table, hubslosh.Run) and isinstance(table, pd.DataFrame)
        assert table.attrs["model"] == str(fmu)
    assert type(run["theta"]) is pd.Series
    with pytest.raises(FmuError, match=r"no theta \(or omega\)"):
        run[["time", "tau_cmd"]].view(program=option(request, "--hubslosh"))


@pytest.mark.parametrize(
    ("name", "parameters", "angles"),
    [
        ("HubSlosh", {}, 0),
        ("Spacecraft", {}, 2),
        ("Spacecraft", {"tanks": 0}, 2),
        ("Spacecraft", {"tanks": 2, "tank[1].modes": 3, "tank[2].modes": 2}, 10),
        ("SloshTank", {}, 2),
        ("SloshTank", {"tank.modes": 3}, 6),
    ],
)
def test_a_run_with_default_outputs_of_any_fmu_is_drawn(
    fmu: Path, request, name: str, parameters: dict, angles: int
) -> None:
    """The default outputs of every FMU contain what the page needs."""
    path = fmu.with_name(f"{name}.fmu")
    run = hubslosh.simulate(path, parameters, stop=1.0, step=0.05)
    assert sum(".angle_" in column for column in run.columns) == angles
    page = run.view(program=option(request, "--hubslosh"))
    assert shown(page.html)["time"]["count"] == len(run)
