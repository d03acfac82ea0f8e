"""Design reviews: margins equal closed forms; the page, files and errors."""

import html
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import hubslosh
from hubslosh import Craft, FmuError, FmuWarning, MountedTank
from hubslosh.project import Project, main
from hubslosh.worst_case import Confirmation

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
DRY, INERTIA = 1000.0, 900.0
PERIOD = 0.05

# these tanks are larger, in lower gravity, than the tanks whose damping was measured
pytestmark = pytest.mark.filterwarnings("ignore:tank.*outside the measured")


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft with one spherical tank on the axis."""
    return Craft(
        DRY, (INERTIA, INERTIA, 700.0), (0, 0, 1.0),
        {"ox": MountedTank(SPHERE, (0, 0, 0.2), modes=1, nu=3e-7)}, 400.0,
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip


def gains(kp: float = 40.0, kd: float = 400.0) -> np.ndarray:
    """Return a PD controller of half angles and rates, the same for each axis."""
    return np.hstack([2 * kp * np.eye(3), kd * np.eye(3)])


def test_margins_of_a_rigid_craft_equal_those_of_a_double_integrator(craft: Craft) -> None:
    """A full tank does not slosh, so that the sampled loop about each axis is known.

    It is L(z) = kp T² (z + 1)/(2 J (z - 1)²) + kd T/(J (z - 1)), with gains kp and kd, period T and
    inertia J.
    """
    found = craft.review(gains(), PERIOD, ["100%"], damping="nominal", inertia="nominal")
    J = craft.mass_properties("100%").inertia[0, 0]

    def loop_gain(f: float) -> complex:
        z, T = np.exp(2j * np.pi * f * PERIOD), PERIOD
        return 40 * T**2 * (z + 1) / (2 * J * (z - 1) ** 2) + 400 * T / (J * (z - 1))

    crossing = brentq(lambda f: abs(loop_gain(f)) - 1, 1e-3, 1.0, xtol=1e-15)
    of_x = found.nominal[0].margins.crossings.query("loop == 'torque[1]' and crossing == 'gain'")
    assert of_x["frequency"].to_numpy() == pytest.approx([crossing], rel=1e-7)
    phase = np.degrees(np.angle(-loop_gain(crossing)))
    assert of_x["phase_margin"].to_numpy() == pytest.approx([phase], rel=1e-7)
    assert found.slosh.empty and "stable at 1 fill and 1 point;" in found.summary
    assert found.points["phase_margin"].tolist() == [found.nominal[0].margins.phase_margin]


def closed_form(craft: Craft, fill: str) -> tuple[float, float, float, float]:
    """Return heights of hinge and slosh mass (m), and pole and zero from torque to angle (Hz).

    Heights are measured from the centre of mass of craft and rigid liquid. For one pendulum on the
    thrust axis, equation (8.1) of the craft's equations gives
    ω_p² = ω_0² (1 + m/M + m b²/I) + m b g/I and ω_z² = ω_0² (1 + m/M).
    """
    p = craft.parameters(fill)
    m, length = p["tank[1].mass[1]"], p["tank[1].length[1]"]
    z = p["tank[1].position[3]"]
    hinge, fixed, m_0 = z + p["tank[1].hinge[1]"], z + p["tank[1].H_0"], p["tank[1].m_0"]
    M = DRY + m_0
    center = (DRY * 1.0 + m_0 * fixed) / M
    inertia = INERTIA + DRY * (1.0 - center) ** 2 + p["tank[1].I_0"] + m_0 * (fixed - center) ** 2
    h, b, g = hinge - center, hinge - length - center, 400 / (M + m)
    w = g / length
    pole = w * (1 + m / M + m * b**2 / inertia) + m * b * g / inertia
    return h, b, *np.sqrt([pole, w * (1 + m / M)]) / (2 * np.pi)


@pytest.mark.parametrize(
    ("height", "order", "phase"),
    [
        pytest.param(1.1, "zero first", 0, marks=pytest.mark.long),
        (0.62, "pole first", 180),
        pytest.param(-0.3, "zero first", 0, marks=pytest.mark.long),
    ],
)
def test_the_kind_of_stabilisation_depends_on_the_height_of_the_tank(
    craft: Craft, height: float, order: str, phase: float
) -> None:
    """Hinge and slosh mass are above, on both sides of, or below the centre of mass.

    The controller moves the pole by Kd (ω_z² - ω_p²)/(2 I ω_p²), so that the mode is stabilised by
    phase if the zero has the lower frequency.
    """
    tank = replace(craft.tanks["ox"], position=(0, 0, height), nu=None)
    craft = replace(craft, tanks={"ox": tank})
    h, b, pole, zero = closed_form(craft, "50%")
    assert (h > 0, b > 0) == {1.1: (True, True), 0.62: (True, False), -0.3: (False, False)}[height]
    undamped = {"tank[1].zeta[1]": 0.0}
    found = craft.review(gains(4, 40), 0.01, ["50%"], damping="nominal", parameters=undamped)
    rows = found.slosh.query("loop != 'torque[3]'")
    assert len(rows) == 2 and set(rows["order"]) == {order}
    assert rows["frequency"].to_numpy() == pytest.approx([pole, pole], rel=1e-6)
    assert (rows["frequency"] - rows["zero"]).to_numpy() == pytest.approx(pole - zero, rel=0.02)
    away = np.abs(np.abs(rows["phase"]) - phase)
    assert (away < 60).all()
    expected = {"gain and phase", "phase"} if phase == 0 else {"unstable"}
    assert set(rows["stabilised"]) <= expected
    # growth rate due to the loop, to first order in its gains
    growth = 40 * (zero**2 - pole**2) / (2 * INERTIA * pole**2)
    assert np.sign(rows["zeta_closed"]).to_numpy() == pytest.approx([-np.sign(growth)] * 2)
    assert found.points["stable"].all() == (phase == 0)


def test_the_linear_models_of_all_fills_have_equal_states_and_the_responses_of_the_craft(
    craft: Craft,
) -> None:
    """A full tank has no slosh mode, but its model has the states of a mode."""
    fixed = {"damping": "nominal", "frequency": "nominal", "inertia": "nominal"}
    found = craft.review(gains(), PERIOD, ["20%", "60%", "100%"], **fixed)
    assert {model.states for model in found.family} == {found.family[0].states}
    assert "tank[1].p[1,1]" in found.family[2].states
    for point, model in zip(found.nominal, found.family, strict=True):
        plant = point.loop.plant()
        f = np.array([0.003, 0.11, 0.7])
        assert model.response(f) == pytest.approx(plant.response(f), rel=1e-9)
        assert (model.inputs, model.outputs) == (plant.inputs, plant.outputs)


def test_bands_of_a_review_contain_all_points_and_the_ends_of_each_range(craft: Craft) -> None:
    """Points are nominal points, random draws, and both ends of each range at each fill.

    Four ranges at two fills give 16 ends.
    """
    uncertain = {"craft.Jxx": "10%", "delay": (0.0, 0.2)}
    found = craft.review(gains(), PERIOD, ["30%", "70%"], uncertain=uncertain, draws=6, delay=0.1)
    names = [quantity.name for quantity in found.uncertain]
    assert names == ["damping of ox", "frequency of ox", "craft.Jxx", "delay"]
    kinds = dict(found.points["kind"].value_counts())
    assert kinds.pop("search") > 0 and kinds == {"one at a time": 16, "draw": 6, "nominal": 2}
    late = found.points.query("kind == 'one at a time' and delay == 1 and fill == 0").iloc[0]
    there = craft.loop(gains(), PERIOD, "30%", delay=0.2)
    assert late["modulus_margin"] == pytest.approx(hubslosh.margins(there).modulus_margin, rel=1e-9)
    bands = found.bands()
    for name in ("modulus_margin", "phase_margin", "delay_margin"):
        assert (bands[f"{name}_low"] <= bands[f"{name}_nominal"]).all()
        assert (bands[f"{name}_nominal"] <= bands[f"{name}_high"]).all()
    assert len(str(found).splitlines()) <= 20


def test_a_review_trims_a_thrust_off_the_centre_of_mass(craft: Craft) -> None:
    """A torque that balances the moment of the thrust gives the same margins without trimming."""
    craft = replace(craft, center_of_mass=(0.02, -0.01, 1.0))
    fixed = {"damping": "nominal", "frequency": "nominal", "inertia": "nominal"}
    found = craft.review(gains(), PERIOD, ["50%"], **fixed)
    center = craft.mass_properties("50%").center_of_mass
    balance = {"torque[1]": 400 * center[1], "torque[2]": -400 * center[0]}
    mine = found.nominal[0].margins
    with pytest.warns(FmuWarning, match="untrimmed, is no steady state: an angular acceleration"):
        beside = craft.parameters("50%", trimmed=False)
    loop = replace(found.nominal[0].loop, parameters=beside | balance)
    by_torque = hubslosh.margins(loop)
    columns = ["frequency", "gain_margin", "phase_margin"]
    assert mine.crossings[columns].to_numpy() == pytest.approx(
        by_torque.crossings[columns].to_numpy(), rel=1e-6, nan_ok=True
    )
    start = found.nominal[0].loop.parameters
    run = hubslosh.simulate(craft.model, start, stop=20, outputs=["omega", "mass"])
    assert run[["omega[1]", "omega[2]", "omega[3]"]].abs().to_numpy().max() < 1e-12


def test_the_search_finds_the_worst_corner_of_the_ranges(craft: Craft) -> None:
    """No corner has a smaller modulus margin; the simulation confirms the margin to 1 %."""
    craft = replace(craft, inertia=(INERTIA, INERTIA, 1200.0))
    uncertain = {"craft.Jxx": "20%", "craft.Jyy": "10%", "delay": (0.0, 0.3)}
    options = {"damping": "nominal", "frequency": "nominal", "delay": 0.1, "uncertain": uncertain}
    found = craft.review(gains(), PERIOD, ["30%", "70%"], draws=4, **options)
    corners = []
    for point in found.nominal:
        for x, y, late in np.ndindex(2, 2, 2):
            sides = {"craft.Jxx": (1 + 0.2 * (2 * x - 1)) * INERTIA}
            sides |= {"craft.Jyy": (1 + 0.1 * (2 * y - 1)) * INERTIA}
            loop = replace(point.loop, parameters=point.loop.parameters | sides, delay=0.3 * late)
            corners.append(hubslosh.margins(loop).modulus_margin)
    assert found.worst.distance <= min(corners) * (1 + 1e-6)
    assert found.worst.distance < found.points.query("kind == 'draw'")["distance"].min()
    assert found.worst_values()["craft.Jxx"] == pytest.approx(0.8 * INERTIA)
    assert found.confirmation.agrees and found.confirmation.command is not None
    assert found.confirmation.simulated_factor == pytest.approx(found.confirmation.factor, rel=0.01)


@pytest.mark.parametrize(("delay", "mass"), [(0.03, 2.0), (0.03, 0.2), (0.06, 0.2)])
def test_simulation_confirms_a_stability_limit_although_slosh_decays_more_slowly(
    craft: Craft, delay: float, mass: float
) -> None:
    """A lander with an array at 3 Hz, with the gain at which its array or the delay is critical.

    1 % below this gain the slosh, whose damping is 0.1 %, still decays more slowly.
    """
    tank = replace(craft.tanks["ox"], position=(0.8, 0, 0.3))
    tanks = {"ox": tank, "fuel": replace(tank, position=(-0.8, 0, 0.3))}
    arm, inertia = 1.2, 2 * mass
    participation = np.array([0, 0, mass * arm, inertia, 0, 0]) / np.sqrt(inertia)
    array = hubslosh.Appendage((0, 1.0, 0.8), 3.0, participation)
    lander = Craft(
        1500, (900, 850, 800), (0, 0, 0.9), tanks, 5000.0, appendages={"array": array},
        model=craft.model,
    )  # fmt: skip
    # 2 kp and kd give 0.2 Hz with a damping ratio of 0.7; each signal has a filter at 5 Hz
    law = gains(0.5 * 1.58 * 1500, 1.76 * 1500)
    w = 2 * np.pi * 5
    law = hubslosh.LinearModel(-w * np.eye(6), w * np.eye(6), law, np.zeros((3, 6)), (), (), ())
    fixed = {"damping": "nominal", "frequency": "nominal", "inertia": "nominal", "draws": 0}
    found = lander.review(law, PERIOD, ["50%"], delay=delay, **fixed)
    rows = found.worst.margins.crossings.dropna(subset="gain_margin")
    row = rows.loc[rows["gain_margin"].abs().idxmin()]
    compared = found.confirmation
    assert compared.agrees, compared.summary
    assert compared.command == row["loop"]
    assert compared.frequency == pytest.approx(row["frequency"], rel=1e-3)
    assert compared.simulated_frequency == pytest.approx(row["frequency"], rel=1e-3)
    assert compared.simulated_factor == pytest.approx(compared.factor, rel=1e-3)


def test_the_confirmation_reports_a_simulation_that_leaves_the_range_of_its_model(
    craft: Craft,
) -> None:
    """The worst case is a tank that spins fast; the message has the factor of the gain."""
    loop = craft.loop(gains(), PERIOD, "50%")
    run = loop.simulate(5.0, {"init.omega[3]": 9.0}, outputs=[])
    (sentence,) = [text for text in run.out_of_range if "tank 1" in text]
    assert "spin of the liquid matters" in sentence
    compared = Confirmation("torque[1]", 1.5, 1.5, 0.1, 0.1, 0.0, 0.0, {1.485: run})
    assert compared.out_of_range[0] == f"with gain × 1.485 {sentence}"
    assert f"left the range of its model: with gain × 1.485 {sentence}" in str(compared)


def test_an_unstable_worst_case_grows_as_predicted(craft: Craft) -> None:
    """Undamped slosh is unstable if the centre of mass is between slosh mass and hinge.

    The growth rate in the simulation equals that of the linear pole to 1 %.
    """
    tank = replace(craft.tanks["ox"], position=(0, 0, 0.62), nu=None)
    craft = replace(craft, tanks={"ox": tank})
    found = craft.review(
        gains(4, 40), PERIOD, ["50%"], damping="nominal", frequency="nominal",
        parameters={"tank[1].zeta[1]": 0.0},
    )  # fmt: skip
    assert "UNSTABLE at 1 of 1 fill: 50%" in found.summary
    compared = found.confirmation
    assert compared.agrees and compared.growth > 0
    assert compared.frequency == pytest.approx(closed_form(craft, "50%")[2], rel=0.02)


def test_the_page_of_a_review_begins_with_the_result_and_needs_no_network(
    craft: Craft, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every figure has a question as its title, axes with units, and the colours of the page."""
    found = craft.review(gains(), PERIOD, ["30%", "70%"], draws=4, delay=0.1)
    path = tmp_path / "review.html"
    found.save(path)
    text = path.read_text(encoding="utf-8")
    body = re.sub(r"<[^>]+>", " ", text[text.index("</h1>") :])
    assert " ".join(body.split()).startswith(html.escape(found.summary))
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert len(titles) == text.count("<figure>") + text.count("<section>")
    assert text.count("<figure>") == text.count("<svg ") == 11
    assert all("?" in title for title in titles)
    for unit in ("(deg)", "(dB)", "(Hz)", "(s)", "(%)", "(N·m)"):
        assert unit in text
    addresses = set(re.findall(r"https?://[^\"' <)]+", text))
    assert addresses <= {"http://www.w3.org/1999/xlink", "http://www.w3.org/2000/svg"}
    # no axis magnifies rounding errors, for which matplotlib prints an offset "1e-13+9.356e-1"
    assert not re.search(r">[^<]*1e[-−]\d", text)
    assert "var(--ink)" in text and "<script" not in text and "NaN" not in text
    assert text == found.html()
    with pytest.raises(FmuError, match=r"must end in \.html"):
        found.save(tmp_path / "review.pdf")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(FmuError, match="pip install matplotlib"):
        found.html()


def test_the_suggested_filter_raises_the_margin_as_stated(craft: Craft) -> None:
    """With the centre of mass between hinge and slosh mass, the filter makes the loop stable.

    `margins` of the controller with the filter gives the stated margin.
    """
    craft = replace(craft, tanks={"ox": replace(craft.tanks["ox"], position=(0, 0, 0.62))})
    lightly = {"tank[1].zeta[1]": 5e-4}
    still = {"damping": "nominal", "frequency": "nominal", "inertia": "nominal"}
    found = craft.review(gains(25, 300), PERIOD, ["50%"], parameters=lightly, **still)
    of = found.suggestion
    assert found.worst.distance == of.before < 0 < of.after
    loop = found.nominal[0].loop
    there = hubslosh.margins(replace(loop, controller=of.controller))
    assert there.stable and there.modulus_margin == pytest.approx(of.after, rel=0.01)
    # phase of the filter at the rigid-body crossover
    rows = found.nominal[0].margins.crossings.query("crossing == 'gain' and near == ''")
    phases = np.degrees(np.angle(of.filter.response(rows["frequency"])[:, 0, 0]))
    assert of.cost == pytest.approx(-phases.min(), rel=1e-9) and 0 < of.cost <= 15
    # without slosh no filter is suggested
    full = craft.review(gains(), PERIOD, ["100%"], damping="nominal").suggestion
    assert full.controller is None and full.before == full.after


PLAN = """
controller = {controller}
period = 0.05
fills = ["50%"]
damping = "nominal"
uncertain = {{ "craft.Jxx" = [850.0, 950.0] }}
draws = 2

[craft]
mass = 1000.0
inertia = [900.0, 900.0, 700.0]
center_of_mass = [0.0, 0.0, 1.0]
thrust = 400.0
model = {model}

[craft.tanks.ox]
source = "ox.toml"
position = [0.0, 0.0, 0.2]
modes = 1
nu = 3e-7
"""


@pytest.mark.long
def test_a_project_file_gives_the_same_review_as_the_call_in_python(
    craft: Craft, tmp_path: Path, capsys, monkeypatch
) -> None:
    """The controller is gains, matrices or a Python function; the page has the name of the file."""
    (tmp_path / "ox.toml").write_text("density = 1440.0\nshape = { sphere = { radius = 0.5 } }\n")
    law = (
        "import numpy as np\ndef law():\n    return np.hstack([80 * np.eye(3), 400 * np.eye(3)])\n"
    )
    (tmp_path / "law.py").write_text(law)
    rows = gains().tolist()
    matrices = f"{{ A = [[-1.0]], B = [{[0.0] * 6}], C = [[0.0], [0.0], [0.0]], D = {rows} }}"
    options = {"damping": "nominal", "uncertain": {"craft.Jxx": (850, 950)}, "draws": 2}
    direct = craft.review(gains(), PERIOD, ["50%"], **options)

    def plan(controller: str, text: str = PLAN) -> Path:
        model = f"'{craft.model}'"
        file = tmp_path / "plan.toml"
        file.write_text(text.format(controller=controller, model=model))
        return file

    for controller in (str(rows), matrices, '"law.py:law"'):
        (found,) = Project.read(plan(controller)).reviews().values()
        mine, theirs = (r.points.query("kind != 'search'") for r in (found, direct))
        assert mine["modulus_margin"].to_numpy() == pytest.approx(
            theirs["modulus_margin"].to_numpy(), rel=1e-9
        )
    monkeypatch.setattr(sys, "argv", ["review", str(tmp_path / "plan.toml")])
    main()
    assert found.summary in capsys.readouterr().out
    assert found.summary in (tmp_path / "plan.html").read_text(encoding="utf-8")
    failing = PLAN.replace("draws = 2", "draws = 2\nrequirements = {{ phase_margin = 80 }}")
    plan(str(rows), failing)
    with pytest.raises(SystemExit, match=r"error: .* FAILS 1 of 1 requirement: phase margin"):
        main()
    assert "FAILS 1 of 1" in (tmp_path / "plan.html").read_text(encoding="utf-8")
    for text, said in {
        PLAN.replace("period", "peroid"): "did you mean period",
        PLAN.replace("mass =", "maas ="): "craft has maas",
        PLAN.replace("[craft.tanks.ox]", "[craft.tanks.ox]\nx = 1"): r"craft\.tanks\.ox has x",
        PLAN.replace("fills", "fills = ["): r"plan\.toml: ",
        "period = 0.1": r"the table \[craft\] is missing",
    }.items():
        with pytest.raises(FmuError, match=said):
            Project.read(plan("1", text))
    with pytest.raises(FmuError, match=r"must be \"FILE\.py:NAME\""):
        Project.read(plan('"none.py:law"'))
    with pytest.raises(FmuError, match="needs A, B, C and D"):
        Project.read(plan("{ A = [[0.0]] }"))


def test_a_project_is_unchanged_after_writing_and_reading(
    craft: Craft, tmp_path: Path, monkeypatch
) -> None:
    """The file has gains, matrices, transfer functions, masses, engines, tank files and cases."""
    (tmp_path / "ox.toml").write_text("density = 1440.0\nshape = { sphere = { radius = 0.5 } }\n")
    (tmp_path / "law.py").write_text(f"law = {gains().tolist()}\n")
    craft = replace(
        craft, thrust=(0.0, 0.0, 100.0), model=str(craft.model),
        tanks={"main ox": replace(craft.tanks["ox"], source=tmp_path / "ox.toml", axis=(0, 0, 2))},
        engines={"main": hubslosh.Engine((0, 0, -1), (0, 0, 1), 300.0)},
    )  # fmt: skip
    settings = {
        "period": PERIOD, "fills": ["50%", (300, "kg")], "damping": "nominal", "draws": 2,
        "uncertain": {"craft.Jxx": [850, 950]}, "requirements": {"phase_margin": {"all": 10}},
    }  # fmt: skip
    law = hubslosh.LinearModel(
        np.array([[-1.0]]), np.zeros((1, 6)), np.zeros((3, 1)), gains(), (), (), ()
    )
    named = f"{tmp_path / 'law.py'}:law"
    points = []
    for controller, file in ((gains(), None), (law, None), (None, named)):
        cases = {"little thrust": {"craft": {"thrust": 10.0}, "fills": ["30%"]}, "as it is": {}}
        project = Project(craft, controller, settings, cases, controller_file=file)
        (tmp_path / "other").mkdir(exist_ok=True)
        project.save(tmp_path / "other" / "design.toml")
        again = Project.read(tmp_path / "other" / "design.toml")
        assert again.settings == settings and again.cases == cases and again.name == "design"
        assert again.craft.parameters("50%") == craft.parameters("50%")
        loop = craft.loop(gains(), PERIOD, "50%")
        assert hubslosh.margins(again.loop("50%")).phase_margin == pytest.approx(
            hubslosh.margins(loop).phase_margin, rel=1e-9
        )
        points.append(again)
    found = points[-1].reviews()
    assert list(found) == ["design, little thrust", "design, as it is"]
    assert found["design, little thrust"].fills == ("30%",)
    direct = craft.review(gains(), **settings).points
    mine = found["design, as it is"].points
    assert mine["modulus_margin"].tolist() == direct["modulus_margin"].tolist()
    # (s + 2)/(s + 4) from each measurement to its command
    plain = points[0]._text(tmp_path)
    filters = "{ num = [[[1.0, 2.0]]], den = [[[1.0, 4.0]]] }"
    (tmp_path / "one.toml").write_text(plain.replace(str(gains().tolist()), filters))
    model = Project.read(tmp_path / "one.toml").controller
    s = 2j * np.pi * 0.3
    assert model.response(0.3)[0, 0, 0] == pytest.approx((s + 2) / (s + 4), rel=1e-12)
    with pytest.raises(FmuError, match="cannot be written to a project file"):
        Project(craft, lambda _t, _y: 0.0, settings).save(tmp_path / "law.toml")
    assert not (tmp_path / "law.toml").exists()
    for text, said in {
        "[cases.a]\nperiods = 1\n": "cases.a has periods .*did you mean period",
        "[cases.a.craft]\ntanks = 1\n": "cases.a.craft has tanks",
        "[cases]\na = 1\n": "cases.a must be a table",
    }.items():
        wrong = plain.partition("\n[cases")[0] + "\n" + text
        (tmp_path / "wrong.toml").write_text(wrong)
        with pytest.raises(FmuError, match=rf"wrong\.toml: {said}"):
            Project.read(tmp_path / "wrong.toml")


def test_two_designs_are_compared_on_one_page(
    craft: Craft, tmp_path: Path, capsys, monkeypatch
) -> None:
    """The worse design is listed first and marked; ``hubslosh review`` compares two files."""
    settings = {"period": PERIOD, "fills": ["30%", "60%"], "damping": "nominal", "draws": 2}
    for name, factor in {"good": 1, "wrong sign": -1}.items():
        Project(replace(craft, model=str(craft.model)), factor * gains(), settings).save(
            tmp_path / f"{name}.toml"
        )
    files = [str(tmp_path / f"{name}.toml") for name in ("good", "wrong sign")]
    out = tmp_path / "comparison.html"
    monkeypatch.setattr(sys, "argv", ["review", *files])
    main()
    assert str(out) in capsys.readouterr().out
    page = out.read_text(encoding="utf-8")
    assert "Comparison of 2 designs" in page and page.count('class="answer') == 2
    rows = page[page.index("What are the least margins") :]
    assert (
        rows.index("wrong sign") < rows.index("good") and '<tr class="bad"><td>wrong sign' in rows
    )
    assert page.count("<h2>How close does the loop of torque") == 3
    found = {Path(f).stem: Project.read(f).reviews()[Path(f).stem] for f in files}
    table = hubslosh.compare(found)
    assert table["passed"].tolist() == [True, False] and table["unstable"].iloc[1] > 0
    stable = found["good"].points
    assert table.loc["good", "phase_margin"] == stable["phase_margin"].abs().min()
    assert np.isnan(table.loc["wrong sign", "phase_margin"])
    with pytest.raises(FmuError, match="two to 6 reviews by name"):
        hubslosh.compare({"one": found["good"]})
    monkeypatch.setattr(sys, "argv", ["review", files[0], files[0]])
    with pytest.raises(SystemExit, match="two projects are named good"):
        main()


def test_a_review_refuses_wrong_fills_ranges_names_and_controllers(craft: Craft) -> None:
    """The error names the wrong argument and the allowed values."""

    def review(*, of: Craft = craft, law=None, fills=("50%",), **options) -> None:
        of.review(gains() if law is None else law, PERIOD, fills, **options)

    for fills, text in {
        (): "fills is empty",
        "50%": "fills must be a list",
        ("50%", "120%"): r"fills\[1\] = '120%': tank ox",
    }.items():
        with pytest.raises(FmuError, match=text):
            review(fills=fills)
    for uncertain, text in {
        "mass": "uncertain must be ranges by name",
        ("craft.mas", "5%"): "did you mean craft.mass",
        ("craft.mass", (1, 2)): "is nominally 1000, outside 1 to 2",
        ("craft.mass", (2, 1)): "low < high",
        ("craft.mass", "5"): 'such as "5%"',
        ("craft.mass", 5): 'such as "5%"',
        ("delay", "5%"): "is 0",
        ("tank[1].mass[2]", "5%"): "its tank has no such mode",
    }.items():
        given = dict([uncertain]) if isinstance(uncertain, tuple) else uncertain
        with pytest.raises(FmuError, match=text):
            review(uncertain=given)
    with pytest.raises(FmuError, match="has 2 inputs and 3 outputs"):
        review(law=np.ones((3, 2)))
    with pytest.raises(FmuError, match="needs a linear controller"):
        review(law=lambda _t, _y: 0.0)
    with pytest.raises(FmuError, match="needs the viscosity"):
        bare = {"ox": replace(craft.tanks["ox"], nu=None)}
        review(of=replace(craft, tanks=bare))
    with pytest.raises(FmuError, match="draws must be a whole number"):
        review(draws=-1)
    with pytest.raises(FmuError, match='"interval" or "nominal"'):
        review(damping="low")


def test_a_lower_slosh_frequency_makes_the_loop_unstable(craft: Craft) -> None:
    """The loop is stable at nominal frequencies, and unstable at -10 %, the end of the range."""
    craft = replace(craft, tanks={"ox": replace(craft.tanks["ox"], position=(0, 0, 0.62))})
    options = {"damping": "nominal", "draws": 0, "parameters": {"ox.zeta[1]": 8e-4}}
    options["inertia"] = "nominal"
    still = craft.review(gains(25, 300), PERIOD, ["30%"], frequency="nominal", **options)
    assert still.points["stable"].all() and still.uncertain == ()
    found = craft.review(gains(25, 300), PERIOD, ["30%"], **options)
    assert "UNSTABLE at" in found.summary and "within the uncertainty" in found.summary
    low = found.points.query("kind == 'one at a time' and `frequency of ox` == -1").iloc[0]
    assert not low["stable"] and low["growth"] > 0
    # an unstable point has no margins and does not count in bands
    assert np.isnan(low["phase_margin"]) and np.isnan(low["modulus_margin"])
    (band,) = found.bands().to_dict("records")
    stable = found.points[found.points["stable"]]
    assert band["unstable"] == len(found.points) - len(stable) > 0
    assert band["modulus_margin_low"] == stable["modulus_margin"].min()
    assert found.confirmation.agrees and found.confirmation.growth > 0


def test_all_components_of_the_inertia_vary_by_the_same_factor(craft: Craft) -> None:
    """The default range is 5 %.

    Inertia does not vary so if the argument is "nominal" or a component has a range of its own.
    """
    fixed = {"damping": "nominal", "frequency": "nominal", "draws": 0}
    inertia = [[900.0, -20.0, 5.0], [-20.0, 900.0, 0.0], [5.0, 0.0, 700.0]]
    craft = replace(craft, inertia=inertia)
    found = craft.review(gains(), PERIOD, ["50%"], **fixed)
    assert [u.name for u in found.uncertain] == ["inertia of craft"]
    for share, factor in ((-1, 0.95), (1, 1.05)):
        row = found.points.query(f"kind == 'one at a time' and `inertia of craft` == {share}")
        scaled = replace(craft, inertia=factor * np.array(inertia))
        wanted = hubslosh.margins(scaled.loop(gains(), PERIOD, "50%"))
        assert row["modulus_margin"].tolist() == pytest.approx([wanted.modulus_margin], rel=1e-9)
    nominal = craft.review(gains(), PERIOD, ["50%"], inertia="nominal", **fixed)
    assert nominal.uncertain == ()
    own = craft.review(gains(), PERIOD, ["50%"], uncertain={"craft.Jzz": "1%"}, **fixed)
    assert [u.name for u in own.uncertain] == ["craft.Jzz"]


def test_requirements_apply_to_the_nominal_points_or_to_all_points(craft: Craft) -> None:
    """An unstable point fails, and failed requirements are listed first."""
    fills, fixed = ["30%", "50%"], {"damping": "nominal", "draws": 3}
    plain = craft.review(gains(), PERIOD, fills, **fixed)
    assert plain.requirements().empty and plain.passed and "requirement" not in plain.summary
    least = plain.points["phase_margin"].min()
    nominal = plain.points.query("kind == 'nominal'")["phase_margin"].min()
    assert least < nominal
    limits = {
        "gain_margin": 1e-3,
        "phase_margin": {"nominal": nominal - 1e-9, "all": (least + nominal) / 2},
    }
    found = craft.review(gains(), PERIOD, fills, requirements=limits, **fixed)
    table = found.requirements()
    assert table["passed"].tolist() == [False, True, True] and not found.passed
    assert table["requirement"][0].startswith("phase margin of all points at least")
    below = plain.points["phase_margin"] < (least + nominal) / 2
    assert table.loc[0, ["least", "failing", "points"]].tolist() == [least, below.sum(), len(below)]
    assert "FAILS 1 of 3 requirements: phase margin of all points" in found.summary
    page = found.html()
    assert 'class="answer bad"' in page and "Which requirements are met? 2 of 3" in page
    met = craft.review(gains(), PERIOD, fills, requirements={"modulus_margin": 0.1}, **fixed)
    assert met.passed and "It meets 1 requirement." in met.summary
    unstable = craft.review(-gains(), PERIOD, ["50%"], requirements={"delay_margin": 1e-9}, **fixed)
    assert unstable.requirements()["least"].tolist() == [-np.inf]
    assert "(unstable at fill 50%)" in unstable.summary
    for text, wrong in {
        "must be limits by margin": "phase_margin",
        "did you mean phase_margin": {"phase_margins": 30},
        "phase_margin must be a number above 0": {"phase_margin": -1},
        "a table of them, not '30'": {"phase_margin": "30"},
        r"requirements\.gain_margin has every": {"gain_margin": {"every": 6}},
    }.items():
        with pytest.raises(FmuError, match=text):
            craft.review(gains(), PERIOD, fills, requirements=wrong)


@pytest.mark.long
def test_an_unstable_real_pole_is_the_worst_case(craft: Craft) -> None:
    """A negative attitude gain kp about z gives J s² + kd s + kp = 0 a positive real root.

    The motion grows without oscillation.
    """
    law, J = gains(), craft.mass_properties("50%").inertia[2, 2]
    law[2] = 0
    law[2, 2], law[2, 5] = -2 * 200.0, 300.0
    fixed = {"damping": "nominal", "frequency": "nominal", "inertia": "nominal"}
    found = craft.review(law, 0.01, ["50%"], **fixed)
    expected = (-300 + np.sqrt(300**2 + 4 * J * 200)) / (2 * J)
    assert found.worst.growth == pytest.approx(expected, rel=0.01)
    compared = found.confirmation
    assert compared.agrees and compared.frequency == compared.simulated_frequency == 0
    assert compared.growth == pytest.approx(found.worst.growth, rel=1e-9)
    assert compared.simulated_growth == pytest.approx(compared.growth, rel=1e-3)
    assert "confirms its growth" in str(compared) and "without oscillation" in str(compared)
    # the growing command is drawn, although it is not the first command
    page = found.html()
    drawn = page[page.index("Does the nonlinear craft agree") :]
    assert "torque[3]" in drawn[: drawn.index("</figure>")]


@pytest.mark.long
def test_the_page_of_a_review_lists_unstable_points_first(craft: Craft) -> None:
    """Unstable fills, points and modes are marked and listed before stable ones."""
    craft = replace(craft, tanks={"ox": replace(craft.tanks["ox"], position=(0, 0, 0.62))})
    fills = ["10%", "30%", "50%"]
    found = craft.review(gains(25, 300), PERIOD, fills, damping="nominal", draws=0,
                         parameters={"ox.zeta[1]": 4.5e-4})  # fmt: skip
    nominal = [point.margins.stable for point in found.nominal]
    assert True in nominal and False in nominal
    table = found.bands()
    assert (np.isnan(table["modulus_margin_nominal"]) == ~np.array(nominal)).all()
    by_phase = found.slosh["phase"].abs() < 90
    by_gain = found.slosh["peak"] < 0
    for how, expected in {
        "phase": by_phase & ~by_gain, "gain": by_gain & ~by_phase, "neither": ~by_phase & ~by_gain,
    }.items():  # fmt: skip
        assert expected[found.slosh["stabilised"] == how].all(), how
    assert "neither" in set(found.slosh["stabilised"])
    (words,) = found.modes().values()
    assert words.startswith("unstable at ") and words.count("unstable") == 1
    for stable, fill in zip(nominal, found.fills, strict=True):
        rows = found.slosh[found.slosh["fill"] == found.fills.index(fill)]
        assert ("unstable" in set(rows["stabilised"])) is not stable
    page = found.html()
    tables = page[page.index('<div class="tables">') :]
    assert tables.index("Which points are unstable?") < tables.index("What are the margins")
    rows = re.findall(r"<tr( class=\"bad\")?><td>([^<]*)</td><td>([^<]*)</td>", tables)
    margins = [row for row in rows if row[2] == "no" or "points" in row[2]]
    assert [bool(bad) for bad, _, _ in margins] == sorted(
        (bool(bad) for bad, _, _ in margins), reverse=True
    )
    first = margins[0]
    assert first[2].startswith("nominal, ") and not nominal[found.fills.index(first[1])]
    assert "nominal loop unstable" in page
    # unstable points are listed in order of growth, the fastest first
    growth = found.unstable()["growth"].to_numpy()
    assert (np.diff(growth) <= 0).all() and found.worst.growth == growth[0]


def test_a_review_that_would_take_hours_is_refused(craft: Craft) -> None:
    """Times, counts and sizes outside their ranges are refused before anything is computed."""
    for (name, value), words in {
        ("period", 1e-9): "period must be a number of seconds from 1e-06 to 1e.06, not 1e-09",
        ("delay", 1e9): "delay must be a number of seconds from 0 to 1e.06",
        ("delay", 1e3): r"1000 s is 20000 cycles of 0\.05 s.*give a shorter delay",
        ("period", 1e-6): "cycles of 1e-06 s",
        ("latency", 10**7): "latency must be a whole number from 0 to 1000000",
        ("draws", 10**9): "draws must be a whole number from 0 to 100000",
        ("fills", ("50%",) * 2000): "fills has 2000 fills",
        ("seed", -1): "seed must be a whole number",
        ("delay", 10.0): r"review has \d+ points of \d+ states, which would take hours",
    }.items():
        given = {"period": PERIOD, "fills": ["50%"], "damping": "nominal", "delay": 0.1}
        given |= {"draws": 100_000} if words.startswith("review") else {}
        given[name] = value
        with pytest.raises(FmuError, match=words):
            craft.review(gains(), **given)


def test_the_worst_case_under_thrust_vector_control_is_confirmed_by_simulation(
    craft: Craft,
) -> None:
    """The loop commands the lateral force of a gimballed engine, which is added to the thrust.

    A force F across the thrust, at the distance d below the centre of mass, causes the torque d F.
    The thrust is tilted, so that its component along x is a constant in the command force[1]. A
    full tank does not slosh, so that the craft is at rest under a tilted thrust.
    """
    tilted = replace(craft, thrust=(20.0, 0.0, 400.0))
    place = tilted.trim("100%").shift
    arm = (tilted.mass_properties("100%").center_of_mass - place)[2]
    mix = np.array([[0, -1 / arm, 0], [1 / arm, 0, 0], [0, 0, 1]])
    command = ["force[1]", "force[2]", "torque[3]"]
    found = tilted.review(
        mix @ gains(), PERIOD, ["100%"], draws=0, command=command, damping="nominal",
        inertia="nominal", frequency="nominal",
    )  # fmt: skip
    assert found.confirmation.agrees, found.confirmation.summary
    with pytest.raises(FmuError, match=r"the command force\[4\] is not an input"):
        craft.review(gains(), PERIOD, ["wrong fill"], command=[*command[:2], "force[4]"])


def test_a_neutral_attitude_does_not_count_as_unstable(craft: Craft) -> None:
    """A rate controller has no effect on the attitude; the simulation confirms its margin."""
    found = craft.review(
        gains(kp=0.0), PERIOD, ["100%"], draws=3, damping="nominal", delay=0.1,
        requirements={"phase_margin": 30},
    )  # fmt: skip
    assert found.passed and found.unstable().empty and found.points["growth"].max() < -0.1
    assert "3 poles at 100% are neutral, which counts as stable" in found.summary
    assert "UNSTABLE" not in str(found) and found.confirmation.agrees
    assert found.confirmation.command is not None
    alone = craft.review(
        gains() * [[1], [1], [0]], PERIOD, ["50%"], damping="nominal", frequency="nominal",
        inertia="nominal", draws=0,
    )  # fmt: skip
    assert alone.unstable().empty and alone.confirmation.agrees, str(alone)
    assert len(alone.nominal[0].margins.neutral) == 2
