"""Tanks in Python equal the command line; tables and parameters as files; plots."""

import json
import os
import pickle
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from conftest import ROOT, option

import hubslosh
from hubslosh import FmuError, FmuWarning, attitude, plot, stability, tank

mpl.use("agg")
SPHERE = {"density": 1008.0, "shape": {"sphere": {"radius": 0.35}}}


@pytest.fixture(autouse=True)
def program(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the path of the program, and set HUBSLOSH so that the package finds it."""
    path = option(request, "--hubslosh")
    monkeypatch.setenv("HUBSLOSH", str(path))
    return path


def test_the_function_tank_gives_what_the_command_tank_gives(program: Path, tmp_path: Path) -> None:
    """Python and ``hubslosh tank`` give the same result, picture and parameters for one file."""
    file = ROOT / "harness" / "tank" / "examples" / "capsule.toml"
    mine = tank(file, fill="40%", modes=2, gravity=3.0, nu=1e-6)
    out, picture, parameters = (tmp_path / name for name in ("r.json", "t.svg", "p.toml"))
    subprocess.run(
        [program, "tank", file, "--fill", "40%", "--modes", "2", "--gravity", "3", "--nu", "1e-6",
         "--out", out, "--picture", picture, "--model", "Spacecraft", "--tank-number", "2",
         "--parameters", parameters],
        check=True, capture_output=True,
    )  # fmt: skip
    assert mine.all == json.loads(out.read_text())
    assert mine.picture == picture.read_text() and mine.picture.startswith("<svg")
    assert mine.parameters("Spacecraft", 2) == hubslosh.read_parameters(parameters)
    assert mine.modes["frequency"][0] == pytest.approx(
        np.sqrt(3 / mine.modes["length"][0]) / (2 * np.pi), rel=1e-12
    )
    assert "slosh.table.mass[1]" in mine.parameters("HubSlosh") or mine.parameters("HubSlosh")
    modes = mine.modes
    assert (modes["zeta_low"] < modes["zeta"]).all() and (modes["zeta"] < modes["zeta_high"]).all()
    assert modes["zeta"][0] == mine.parameters("Spacecraft", 2)["tank[2].zeta[1]"]
    # the tank is also given as a dict
    import tomllib

    again = tank(tomllib.loads(file.read_text()), fill="40%", modes=2, gravity=3.0, nu=1e-6)
    assert again.all == mine.all
    by_mass = tank(file, fill_mass=mine.mass, modes=1)
    assert by_mass.all["fill"] == pytest.approx(mine.all["fill"], rel=1e-9)
    mine.save(tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_text() == mine.picture


def test_liquid_in_the_fmu_has_the_frequency_of_the_tank(fmu: Path) -> None:
    """On a very heavy craft, the pole of the linearised FMU is the natural frequency of the mode.

    The axis of the tank is x or another direction.
    """
    full = tank(SPHERE, fill="60%", modes=1, gravity=0.1)
    for axis, thrust in (((0, 0, 1), "force[3]"), ((1, 0, 0), "force[1]"), ((0, 0, -1), None)):
        craft = {"craft.mass": 1e9, "tanks": 1, "craft.Jxx": 1e9, "craft.Jyy": 1e9}
        craft |= {"craft.Jzz": 1e9, thrust or "force[3]": (1 if thrust else -1) * 0.1 * 1e9}
        craft |= {f"craft.r[{i}]": 0.0 for i in (1, 2, 3)}
        craft |= full.parameters("Spacecraft", position=(0.5, 0, 0), axis=axis)
        model = hubslosh.linearize(fmu.with_name("Spacecraft.fmu"), craft)
        # the craft has 1e7 times the mass of the liquid, so that it hardly moves
        frequency = model.modes()["frequency"].to_numpy()
        assert frequency == pytest.approx(full.modes["frequency"][0], rel=1e-5)
    rigid = full.parameters("SloshTank", rigid=True)
    assert rigid["tank.modes"] == 0 and rigid["tank.m_0"] == full.mass
    assert not any("mass[1]" in name for name in rigid)


def test_errors_of_a_tank_are_reported_in_words(tmp_path: Path) -> None:
    """Wrong tanks raise FmuError with the message of the package or of the program."""
    full = tank(SPHERE, fill=0.3, modes=1)
    wrong = {
        "give the fill": lambda: tank(SPHERE),
        r'a height in m, or a share such as "60%"': lambda: tank(SPHERE, fill="60"),
        "modes must be a number, not 'two'": lambda: tank(SPHERE, fill=0.3, modes="two"),
        "a tank must be a tank file, or a dict": lambda: tank(3, fill=0.3),
        "^density is missing": lambda: tank({"shape": {"sphere": {"radius": 1}}}, fill=0.3),
        "3 m.*0.7": lambda: tank(SPHERE, fill=3.0),
        "no_such.toml": lambda: tank("no_such.toml", fill=0.3),
        "position must be 3 finite numbers, not 3": lambda: full.parameters(position=3),
        "axis must not be zero": lambda: full.parameters(axis=(0, 0, 0)),
        "position is for Spacecraft and SloshTank": lambda: full.parameters(
            "HubSlosh", position=(0, 0, 0)
        ),
        "number must be 1 to 4": lambda: full.parameters("Spacecraft", 5),
        "must be Spacecraft, SloshTank or HubSlosh, not 'Craft'": lambda: full.parameters("Craft"),
        "must end in .svg": lambda: full.save("tank.png"),
        "cannot be written to TOML": lambda: tank({"density": object()}, fill=0.3),
    }
    for sentence, call in wrong.items():
        with pytest.raises(FmuError, match=sentence):
            call()
    with pytest.warns(FmuWarning, match="capillarity"):
        tank(SPHERE, fill=0.3, sigma=0.07, contact_angle=5.0, gravity=9.81).parameters()


def test_tables_are_read_back_from_files_with_every_digit(tmp_path: Path) -> None:
    """Other programs read exactly the same numbers from .csv, .parquet and .mat."""
    from scipy.io import loadmat

    table = pd.DataFrame({"time": [0.0, 0.1], "q[1]": [1 / 3, np.pi], "stuck": [True, False]})
    table.attrs["units"] = {"time": "s", "q[1]": "1"}
    hubslosh.to_csv(table, tmp_path / "a.csv")
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "a.csv"), table, check_exact=True)
    hubslosh.to_parquet(table, tmp_path / "a.parquet")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "a.parquet"), table, check_exact=True)
    hubslosh.to_mat(table, str(tmp_path / "a.mat"))
    matlab = loadmat(tmp_path / "a.mat")
    assert (matlab["q_1"][:, 0] == table["q[1]"]).all() and matlab["time"].shape == (2, 1)
    assert matlab["units"]["time"].item().item() == "s"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.mat", "a.parquet"]
    wrong = {
        "give the table first, then the file": lambda: hubslosh.to_csv("a.csv", table),
        "must end in .mat": lambda: hubslosh.to_mat(table, "a.csv"),
        "DataFrame, not list": lambda: hubslosh.to_parquet([1], "a.parquet"),
        "whole table instead of its column 'time'": lambda: hubslosh.quantiles(table["time"]),
        "the name of a file must be a str or a Path": lambda: hubslosh.to_csv(table, 3),
        "cannot be written": lambda: hubslosh.to_csv(table, tmp_path / "none" / "a.csv"),
        "the same name in MATLAB: a.b, a_b": lambda: hubslosh.to_mat(
            pd.DataFrame({"a.b": [1], "a_b": [2]}), "a.mat"
        ),
    }
    for sentence, call in wrong.items():
        with pytest.raises(FmuError, match=sentence):
            call()


def test_every_plot_has_the_elements_that_its_docstring_describes(fmu: Path) -> None:
    """For example, the frequency band of a Bode diagram follows from the poles."""
    viscous = {"friction.model": "viscous"}
    model = hubslosh.linearize(fmu, viscous, ["tau_cmd"], ["omega"])
    gain, _ = plot.bode(model)
    line = gain.lines[0].get_xdata()
    poles = np.abs(model.poles) / (2 * np.pi)
    assert line[0] == pytest.approx(poles[0] / 5) and line[-1] == pytest.approx(poles[-1] * 5)
    drawn, high = gain.lines[0].get_ydata(), np.abs(line - poles[-1]) < 0.05
    peak = abs(model.response(np.linspace(poles[-1] - 0.05, poles[-1] + 0.05, 100_001))).max()
    assert drawn[high].max() == pytest.approx(peak, rel=1e-3)
    assert stability.band(model.sampled(0.1))[1] == 5.0

    loop = hubslosh.Loop([[0.4, 0.6]], 0.1, fmu, viscous, delay=0.02)
    gain, phase = plot.margins(loop)
    found = hubslosh.margins(loop)
    dots = sorted(line.get_xdata()[0] for line in phase.lines if line.get_marker() == "o")
    squares = sorted(line.get_xdata()[0] for line in gain.lines if line.get_marker() == "s")
    known = found.crossings.groupby("crossing")["frequency"].apply(list)
    assert dots == known["gain"] and squares == known["phase"]

    wanted = pd.DataFrame({"time": [0.0, 5.0], "theta": [0.1, 0.1]})
    axes = plot.closed_loop(loop.simulate(5, reference=wanted), wanted)
    labels = [ax.get_ylabel() for ax in axes]
    assert labels == ["attitude (deg)", "left to turn (deg)", "rate (deg/s)", "torque (N·m)"]
    assert axes[1].lines[0].get_ydata()[0] == pytest.approx(np.degrees(0.1))
    turning = attitude.slew(0.3, 5)
    left = plot.closed_loop(turning, turning)[1]
    assert all(np.abs(line.get_ydata()).max() < 1e-6 for line in left.lines)

    table = pd.DataFrame({"run": range(100), "hub.I": 0.3, "rate (deg/s)": np.arange(100.0)})
    (ax,) = plot.monte_carlo(table)
    assert ax.get_xlabel() == "rate (deg/s)"
    assert ax.lines[0].get_ydata()[-1] == 100
    study = hubslosh.monte_carlo(
        {"mass": (1, 2)}, 20, outcome=lambda drawn: {"error[1]": drawn["mass"]}, progress=False
    )
    (ax,) = plot.monte_carlo(study)
    assert ax.get_xlabel() == "error[1]"
    for call, sentence in (
        (lambda: plot.bode(3), "bode draws tables"),
        (lambda: plot.monte_carlo(table[["run", "hub.I"]]), "no results to draw"),
        (lambda: plot.closed_loop(wanted[["time"]]), "neither an attitude"),
    ):
        with pytest.raises(FmuError, match=sentence):
            call()


@pytest.fixture
def three_axes(fmu: Path) -> hubslosh.Loop:
    """Return a loop about three axes in which undamped slosh crosses 0 dB."""
    sphere = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
    tanks = {
        "ox": hubslosh.MountedTank(sphere, (0, 0.6, 0.22)),
        "fuel": hubslosh.MountedTank(sphere, (0.02, -0.7, -0.4)),
    }
    craft = hubslosh.Craft(
        1000.0, (900.0, 800.0, 700.0), (0, 0, 1.0), tanks, 400.0,
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip
    undamped = {f"{tank}.zeta[{n}]": 0.0 for tank in tanks for n in (1, 2)}
    # a lag that is discretised by Tustin's rule has a zero at half the sampling rate
    gains = np.hstack([400 * np.eye(3), 1000 * np.eye(3)])
    lag = hubslosh.LinearModel(
        -9.0 * np.eye(3), 9 * gains, np.eye(3), np.zeros((3, 6)), ("a", "b", "c"), (), ()
    )
    return craft.loop(lag, 0.1, "60%", delay=0.2, parameters=undamped)


def labels_of(*axes: Any) -> list[Any]:
    """Return the bounding boxes of all labels in diagrams, after checking that none overlap."""
    labels = [text.get_window_extent() for ax in axes for text in ax.texts]
    assert not any(a.overlaps(b) for k, a in enumerate(labels) for b in labels[:k])
    return labels


def test_the_margin_plot_of_three_axes_is_legible(three_axes: hubslosh.Loop) -> None:
    """The title fits, a gain of zero does not set the scale, and labels do not overlap."""
    gain, phase = plot.margins(three_axes)
    figure = gain.figure
    figure.draw_without_rendering()
    # the curves use most of the diagram
    low, high = gain.get_ylim()
    curves = [line for line in gain.lines if str(line.get_label()).startswith("torque")]
    ends = {round(float(line.get_ydata()[k])) for line in curves for k in (0, -1)}
    assert len(curves) == 3 and high - low <= 100 and ends
    assert all(min(abs(end - low), abs(end - high)) <= 10 for end in ends), (ends, low, high)
    title = gain.title.get_window_extent()
    assert title.x0 >= 0 and title.x1 <= figure.bbox.width
    assert "slosh crosses 0 dB" in gain.get_title() and " more Hz" in gain.get_title()
    assert len(labels_of(gain, phase)) > 5


def test_nichols_and_nyquist_show_every_crossing_of_three_axes(three_axes: hubslosh.Loop) -> None:
    """Crossings lie exactly on 0 dB or ±180° and have the colour of their loop."""
    found = hubslosh.margins(three_axes).crossings.query("frequency > 0")
    nichols, nyquist = plot.nichols(three_axes), plot.nyquist(three_axes)
    for ax in (nichols, nyquist):
        ax.figure.draw_without_rendering()
        legend = ax.get_legend()
        assert [text.get_text() for text in legend.get_texts()] == [
            f"torque[{i}]" for i in (1, 2, 3)
        ]
        title = ax.title.get_window_extent()
        assert title.x0 >= 0 and title.x1 <= ax.figure.bbox.width
        assert len(labels_of(ax)) > 3 and all(" at " in text.get_text() for text in ax.texts)
    colors = {line.get_label(): line.get_color() for line in nichols.lines}
    for symbol, kind in (("o", "gain"), ("s", "phase")):
        rows = found[found["crossing"] == kind]
        marks = [line for line in nichols.lines if line.get_marker() == symbol]
        places = [line for line in nyquist.lines if line.get_marker() == symbol]
        assert len(marks) == len(places) == len(rows) > 0
        margins = rows[f"{'phase' if kind == 'gain' else 'gain'}_margin"].abs()
        rows = rows.loc[margins.sort_values(kind="stable").index]
        for mark, place, row in zip(marks, places, rows.itertuples(), strict=True):
            (x,), (y,) = mark.get_xdata(), mark.get_ydata()
            assert mark.get_color() == place.get_color() == colors[row.loop]
            if kind == "gain":
                wanted = np.exp(1j * np.radians(row.phase_margin - 180))
                assert y == 0 and abs((x - 180 - row.phase_margin + 180) % 360 - 180) < 2
            else:
                wanted = -(10 ** (-row.gain_margin / 20))
                assert (x, y) == ((x // 360) * 360 + 180, -row.gain_margin)
            drawn = complex(place.get_xdata()[0], place.get_ydata()[0])
            assert abs(drawn - wanted) < 0.03 * abs(wanted)


SSV = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="bench">
 <ssv:Parameters>{parameters}</ssv:Parameters>
 <ssv:Units>
  <ssc:Unit name="mil"><ssc:BaseUnit m="1" factor="2.54e-5"/></ssc:Unit>
  <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
  <ssc:Unit name="min"><ssc:BaseUnit s="1" factor="60"/></ssc:Unit>
  {units}
 </ssv:Units>
</ssv:ParameterSet>
"""


def parameter(name: str, value: str, unit: str = "", kind: str = "Real") -> str:
    """Return the XML element of a parameter of SSP."""
    unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"{unit}/></ssv:Parameter>'


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        (parameter("tank.h", "50", "mm"), "tank.h", 0.05),  # unit of both file and FMU
        (parameter("tank.h", "1000", "mil"), "tank.h", 0.0254),  # unit of the file only
        (parameter("tank.h", "0.05", "m"), "tank.h", 0.05),
        (parameter("tank.h", "0.05"), "tank.h", 0.05),
        (
            parameter("init.slosh_angle", "3", "deg"),
            "init.slosh_angle",
            np.radians(3),
        ),  # unit of the FMU only
    ],
)
def test_units_of_a_parameter_set_are_converted(
    fmu: Path, tmp_path: Path, text: str, name: str, value: float
) -> None:
    """Units are converted by the definitions of the file or, if it has none, of the FMU."""
    file = tmp_path / "bench.ssv"
    file.write_text(SSV.format(parameters=text, units=""))
    converted = hubslosh.fmu.Fmu.open(fmu).convert(name, hubslosh.read_parameters(file)[name])
    assert converted == pytest.approx(value, rel=1e-15)
    by_file = hubslosh.simulate(fmu, file, stop=0.2)
    by_value = hubslosh.simulate(fmu, {name: converted}, stop=0.2)
    assert by_file.equals(by_value)
    again = pickle.loads(pickle.dumps(hubslosh.read_parameters(file)))
    assert hubslosh.fmu.Fmu.open(fmu).convert(name, again[name]) == converted


@pytest.mark.parametrize(
    ("text", "units", "said"),
    [
        (
            parameter("tank.h", "50", "furlong"),
            "",
            r'tank.h has no unit "furlong" \(allowed: m',
        ),
        (
            parameter("tank.h", "50", "min"),
            "",
            "min cannot be converted to m",
        ),
        (parameter("friction.model", "1", "m", "Integer"), "", "and no unit"),
        (parameter("tank.h", "50 mm"), "", "allowed: a value of type Real"),
        (parameter("gyro.on", "yes", kind="Boolean"), "", "allowed: a value of type Boolean"),
        (
            parameter("tank.h", "1") + "\n" + parameter("tank.h", "1"),
            "",
            r"line 5: tank.h is given twice, first in line 4 \(allowed: once\)",
        ),
        (
            parameter("tank.h", "1"),
            '<ssc:Unit name="x"/>',
            'line 9: the unit "x" has no valid BaseUnit',
        ),
        (
            parameter("tank.h", "1"),
            '<ssc:Unit name="x"><ssc:BaseUnit m="1" factor="0"/></ssc:Unit>',
            "a finite factor other than 0",
        ),
    ],
)
def test_a_unit_that_does_not_fit_the_variable_is_refused(
    fmu: Path, tmp_path: Path, text: str, units: str, said: str
) -> None:
    """A file that is not a parameter set is also refused."""
    file = tmp_path / "bench.ssv"
    file.write_text(SSV.format(parameters=text, units=units))
    with pytest.raises(FmuError, match=said):
        hubslosh.simulate(fmu, file, stop=0.2)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no named pipes in the file system")
@pytest.mark.parametrize("write", [hubslosh.to_csv, hubslosh.to_parquet, hubslosh.to_mat])
def test_an_output_follows_links_and_is_written_to_a_pipe(
    tmp_path: Path, write: Callable[[pd.DataFrame, Path], None]
) -> None:
    """As in the program, a link and a pipe are not replaced by a file."""
    ending = write.__name__.removeprefix("to_")
    table = pd.DataFrame({"time": [0.0, 1.0], "omega": [1.0, 2.0]})
    plain, link, far, pipe = (tmp_path / f"{n}.{ending}" for n in ("plain", "link", "far", "pipe"))
    write(table, plain)
    link.symlink_to(far)
    write(table, link)
    assert link.is_symlink()
    assert far.stat().st_size == plain.stat().st_size
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as pool:
        read = pool.submit(pipe.read_bytes)
        write(table, pipe)
    assert len(read.result()) == plain.stat().st_size
    assert pipe.is_fifo()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        path.name for path in (plain, link, far, pipe)
    )
    if not Path("/dev/full").exists():
        return  # only Linux has /dev/full
    link.unlink()
    link.symlink_to("/dev/full")
    with pytest.raises(FmuError, match="cannot be written: No space left"):
        write(table, link)
    assert link.is_symlink()
