"""All methods of a craft use the same operating point and the same names of quantities."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hubslosh
from hubslosh import Craft, FmuError, FmuWarning, MountedTank
from hubslosh.quantities import KINDS, ModeQuantity, Modes

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
CYLINDER = {"density": 875.0, "shape": {"cylinder": {"radius": 0.4, "height": 1.1}}}
GAINS = np.hstack([80 * np.eye(3), 400 * np.eye(3)])
PERIOD = 0.05
MEASURED = ["q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]"]

pytestmark = pytest.mark.filterwarnings("ignore:tank.*outside the measured")


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft of two tanks whose thrust misses its centre of mass by 0.1 m."""
    tanks = {
        "NTO": MountedTank(SPHERE, (0.1, 0.5, -0.2), modes=1, nu=3e-7),
        "MMH": MountedTank(CYLINDER, (0.1, -0.6, -0.4), modes=2, nu=9e-7, sigma=0.03),
    }
    return Craft(
        1000.0, (900.0, 850.0, 700.0), (0.1, 0.02, 1.0), tanks, 400.0,
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip


def numbers(found: hubslosh.Margins) -> np.ndarray:
    """Return the numbers in a table of margins: all crossings with their margins."""
    return found.crossings[["frequency", "gain_margin", "phase_margin"]].to_numpy()


def test_loop_linearize_review_and_uncertain_linearise_at_one_trimmed_point(craft: Craft) -> None:
    """With thrust 0.1 m off the centre of mass, the four methods agree to 1e-9.

    Without trimming the delay margin differs, and a warning states the angular acceleration.
    """
    by_loop = hubslosh.margins(loop := craft.loop(GAINS, PERIOD, "50%", delay=0.1))
    review = craft.review(GAINS, PERIOD, ["50%"], delay=0.1, damping="nominal", frequency="nominal")
    by_review = review.nominal[0].margins
    assert numbers(by_loop) == pytest.approx(numbers(by_review), rel=1e-9, nan_ok=True)
    assert by_loop.delay_margin == pytest.approx(by_review.delay_margin, rel=1e-9)
    f = np.array([0.003, 0.13, 0.3])
    plant = craft.linearize("50%", outputs=MEASURED).response(f)
    assert loop.plant().response(f) == pytest.approx(plant, rel=1e-12)
    model = craft.uncertain("50%", {"craft.Jxx": "5%"})
    # the tolerance allows rounding errors, because the states of the LFT are scaled differently
    size = np.abs(plant).max()
    assert model.at([0.0]).response(f) == pytest.approx(plant, rel=1e-9, abs=1e-12 * size)
    with pytest.warns(FmuWarning, match="untrimmed, is no steady state"):
        beside = craft.parameters("50%", trimmed=False)
    with pytest.warns(FmuWarning, match=r"angular acceleration of 0\.0\d+ rad/s² remains, \("):
        untrimmed = hubslosh.margins(replace(loop, parameters=beside))
    assert abs(untrimmed.delay_margin / by_loop.delay_margin - 1) > 0.01


def test_trimming_removes_rotation_and_prints_the_remaining_accelerations(craft: Craft) -> None:
    """Before trimming, the acceleration is the moment of the thrust over the inertia.

    After trimming it is 0, also in a simulation.
    """
    point = craft.trim("50%")
    at = craft.mass_properties("50%")
    assert point.shift == pytest.approx(at.center_of_mass * (1, 1, 0), abs=1e-12)
    # the effective inertia is used, because liquid does not follow a rotation like a solid
    moment = np.cross(-at.center_of_mass, [0, 0, 400.0])
    rigid = craft.parameters("50%", rigid=True, trimmed=True)
    with hubslosh.Plant(craft.model, rigid | {
        f"{place}[{i + 1}]": float(x)
        for place, r in {
            "craft.r": craft.center_of_mass,
            **{f"tank[{k}].position": t.position for k, t in enumerate(craft.tanks.values(), 1)},
        }.items()
        for i, x in enumerate(r)
    }) as plant:  # fmt: skip
        turning = plant.get([f"omega_dot[{i}]" for i in (1, 2, 3)])
    assert turning == pytest.approx(np.linalg.solve(at.inertia, moment), rel=1e-9, abs=1e-12)
    assert (
        np.linalg.norm(point.untrimmed_acceleration) > 0.01
        and np.linalg.norm(point.angular_acceleration) < 1e-12
    )
    assert point.lateral_acceleration == pytest.approx({"NTO": 0, "MMH": 0}, abs=1e-12)
    assert "rad/s² before" in str(point) and "rad/s² left" in str(point)
    run = hubslosh.simulate(craft.model, craft.parameters("50%"), stop=20, outputs=["omega"])
    assert run[["omega[1]", "omega[2]", "omega[3]"]].abs().to_numpy().max() < 1e-12
    # accelerations due to further parameters remain, and are printed
    pushed = craft.trim("50%", {"torque[1]": 3.0})
    assert np.linalg.norm(pushed.angular_acceleration) > 1e-3
    with pytest.warns(
        FmuWarning, match=f"of {np.linalg.norm(pushed.angular_acceleration):.4g} rad/s² remains"
    ):
        craft.linearize("50%", parameters={"torque[1]": 3.0})
    leaning = replace(craft.tanks["NTO"], axis=(np.sin(0.1), 0, np.cos(0.1)))
    tilted = replace(craft, tanks={"NTO": leaning}).trim("50%")
    # liquid on the axis of a tilted tank is not at rest, and turns the craft
    assert (
        tilted.lateral_acceleration["NTO"] > 0.02
        and np.linalg.norm(tilted.angular_acceleration) > 1e-4
    )


@pytest.mark.parametrize("name", ["NTO", "tank[1]"])
def test_every_method_accepts_names_and_numbers_of_tanks(craft: Craft, name: str) -> None:
    """`loop`, `linearize`, `review`, `uncertain` and `draw` accept a tank's name and its number."""
    nominal = craft.uncertain("50%", {f"{name}.frequency[1]": "1%"})
    f = 0.8 * nominal.center["tank[1].frequency[1]"]
    zeta = 2 * craft.tank_at("50%")["NTO"].modes["zeta"][0]
    ranges = {f"{name}.frequency[1]": (f, f * 1.0001), f"{name}.zeta[1]": (zeta, 1.0001 * zeta)}
    model = craft.uncertain("50%", ranges).at([-1.0, -1.0])
    values = {f"{name}.frequency[1]": f, f"{name}.zeta[1]": zeta, "craft.Jxx": 910.0, "delay": 0.12}
    (drawn,) = (
        hubslosh.monte_carlo({key: [value] for key, value in values.items()}, 1, progress=False)
        .drop(columns="run")
        .to_dict("records")
    )
    at = np.array([0.01, 0.11, 0.14, 0.2])
    of_modes = {key: drawn[key] for key in ranges}
    plant = craft.linearize("50%", outputs=MEASURED, parameters=of_modes)
    size = np.abs(plant.response(at)).max()
    assert model.response(at) == pytest.approx(plant.response(at), rel=1e-7, abs=1e-10 * size)
    loop = craft.loop(GAINS, PERIOD, "50%", parameters=drawn)
    assert loop.delay == 0.12 and loop.parameters["craft.Jxx"] == 910.0
    shares = {key: (0.9 * value, value) for key, value in values.items() if "freq" in key}
    found = craft.review(
        GAINS, PERIOD, ["50%"], damping="nominal", parameters=drawn, uncertain=shares, draws=2,
        frequency="nominal", inertia="nominal",
    )  # fmt: skip
    assert numbers(found.nominal[0].margins) == pytest.approx(
        numbers(hubslosh.margins(loop)), rel=1e-9, nan_ok=True
    )
    assert [u.name for u in found.uncertain] == list(shares)
    for call, words in {
        lambda: craft.linearize("50%", parameters={"delay": 0.1}): "delay belongs to a loop",
        lambda: craft.uncertain("50%", {"delay": (0, 1)}): "delay belongs to a loop",
        lambda: craft.linearize("50%", parameters={"NTO.zeta[1]": 0.1, "tank[1].zeta[1]": 0.1}):
            "are the same quantity",
        lambda: craft.loop(GAINS, PERIOD, "50%", parameters={"NTO.zeta[2]": 0.1}): "no such mode",
        lambda: craft.uncertain("50%", {"NTO.length[1]": "5%"}):
            r"moves the slosh mass and changes the frequency: give tank\[1\]\.frequency\[1\]",
        lambda: craft.review(GAINS, PERIOD, ["50%"], uncertain={f"{name}.hinge[1]": "5%"}):
            r"moves the slosh mass: give tank\[1\]\.frequency\[1\]",
    }.items():  # fmt: skip
        with pytest.raises(FmuError, match=words):
            call()


WRONG = {
    "NTO.frequence[1]": "no quantity NTO.frequence[1]; did you mean NTO.frequency[1]?",
    "MH.zeta[1]": "the craft has no quantity MH.zeta[1]; did you mean MMH.zeta[1]?",
    "craft.Jxw": "the craft has no quantity craft.Jxw; did you mean craft.Jxz?",
    "dealy": "the craft has no quantity dealy; did you mean delay?",
    "tank[1].frequency": "the craft has no quantity tank[1].frequency; did you mean",
    "NTO.frequency[2]": "NTO.frequency[2] does not exist: its tank has no such mode",
    "tank[1].bob[2]": "NTO.bob[2] does not exist: its tank has no such mode",
    "tank[3].mass[1]": "tank[3].mass[1] does not exist: its tank has no such mode",
}
"""Names that no quantity of the craft has, with the error message of every method."""


@pytest.mark.parametrize("name", WRONG)
def test_every_method_reports_a_wrong_name_with_one_message(craft: Craft, name: str) -> None:
    """The name is wrong as a parameter, as a value of a study, or as a range."""
    values, ranges = {name: 0.2}, {name: (0.1, 0.3)}
    for call in (
        lambda: craft.parameters("50%", parameters=values),
        lambda: craft.trim("50%", values),
        lambda: craft.linearize("50%", parameters=values),
        lambda: craft.loop(GAINS, PERIOD, "50%", parameters=values),
        lambda: craft.review(GAINS, PERIOD, ["50%"], parameters=values, draws=0),
        lambda: craft.uncertain("50%", {"craft.Jxx": "5%"}, parameters=values),
        lambda: craft.review(GAINS, PERIOD, ["50%"], uncertain=ranges, draws=0),
        lambda: craft.uncertain("50%", ranges),
    ):
        with pytest.raises(FmuError) as told:
            call()
        assert WRONG[name] in str(told.value)


def test_an_uncertain_quantity_can_be_named_by_the_name_of_its_tank(craft: Craft) -> None:
    """A tank's name and its number give the same uncertain model."""
    model = craft.uncertain("50%", {"NTO.frequency[1]": "5%", "craft.Jxx": "5%"})
    for name in ("NTO.frequency[1]", "tank[1].frequency[1]"):
        assert model.delta({name: 0.5}).tolist() == [0.5, 0.0]


def test_frequency_mass_and_height_of_a_mode_change_independently(craft: Craft) -> None:
    """A change of one of them leaves the other two, and the liquid at rest, unchanged.

    This also holds with surface tension.
    """
    nominal, of = craft.parameters("50%"), ModeQuantity(2, "frequency", 1)
    assert nominal[of.name("k")] > 0

    def state(parameters: dict) -> dict[str, float]:
        modes = Modes(craft.model, parameters)
        found = {kind: modes.value(ModeQuantity(2, kind, 1)) for kind in KINDS}
        names = ["mass", *(f"center_of_mass[{i}]" for i in (1, 2, 3))]
        names += [f"inertia[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3)]
        with hubslosh.Plant(craft.model, parameters) as plant:
            values = plant.get(names)
        return found | {f"whole {name}": x for name, x in zip(names, values, strict=True)}

    before = state(nominal)
    for kind, value in {"frequency": 0.8 * before["frequency"], "mass": 1.2 * before["mass"],
                        "bob": before["bob"] + 0.05}.items():  # fmt: skip
        after = state(craft.parameters("50%", parameters={f"MMH.{kind}[1]": value}))
        assert after == pytest.approx(before | {kind: value}, rel=1e-9, abs=1e-9), kind


def test_a_review_varies_slosh_frequencies_by_default(craft: Craft) -> None:
    """By default the frequencies of a tank's modes vary together by 10 %.

    The argument can be "nominal" or another share.
    """
    found = craft.review(GAINS, PERIOD, ["50%"], damping="nominal", draws=0)
    names = ["frequency of NTO", "frequency of MMH", "inertia of craft"]
    assert [u.name for u in found.uncertain] == names
    ends = found.uncertain[0].ends[0]["tank[1].frequency[1]"]
    assert ends == pytest.approx((0.9 * ends[1], ends[1], 1.1 * ends[1]), rel=1e-12)
    # a damping ratio with a given value or range does not vary over the interval of its tank
    given = {"parameters": {"NTO.zeta[1]": 0.01}, "uncertain": {"MMH.zeta[2]": "5%"}}
    given["inertia"] = "nominal"
    found = craft.review(GAINS, PERIOD, ["50%"], draws=0, frequency="nominal", **given)
    assert [u.name for u in found.uncertain] == ["damping of MMH", "MMH.zeta[2]"]
    assert list(found.uncertain[0].ends[0]) == ["tank[2].zeta[1]"]
    with pytest.raises(FmuError, match=r'frequency must be a share .* such as "10%"'):
        craft.review(GAINS, PERIOD, ["50%"], frequency="10")


def test_a_used_craft_and_its_results_can_be_pickled(craft: Craft) -> None:
    """A study sends both to other processes; the copy computes the same numbers."""
    loop = craft.loop(GAINS, PERIOD, "50%", delay=0.1)
    review = craft.review(GAINS, PERIOD, ["50%"], damping="nominal", draws=0)
    craft.uncertain("50%", {"NTO.zeta[1]": "interval"})
    again = pickle.loads(pickle.dumps(craft))
    assert again.parameters("50%") == craft.parameters("50%")
    for thing in (loop, review, craft.trim("50%"), craft.uncertain("50%", {"craft.Jxx": "5%"})):
        assert str(pickle.loads(pickle.dumps(thing))) == str(thing)


def test_a_tank_with_the_name_of_a_parameter_is_refused(craft: Craft) -> None:
    """A name with which a parameter of the FMU begins is refused.

    If the name of a tank begins with the name of another tank, the longer name counts.
    """
    tanks = {"A": craft.tanks["NTO"], "A.B": craft.tanks["MMH"]}
    both = replace(craft, tanks=tanks)
    values = both.parameters("50%", parameters={"A.B.zeta[1]": 0.07, "A.zeta[1]": 0.03})
    assert (values["tank[2].zeta[1]"], values["tank[1].zeta[1]"]) == (0.07, 0.03)
    for name in ("craft", "tank[2]", "init", ""):
        with pytest.raises(FmuError, match=r"the tank cannot have the name|must be a text"):
            replace(craft, tanks={name: craft.tanks["NTO"]})


@pytest.mark.parametrize("largest", [0, np.nan, 1e9, "3"])
def test_the_cost_of_a_worst_case_search_is_limited(craft: Craft, largest: object) -> None:
    """``largest``, the multiple of the ranges at which the search ends, is at most 1000."""
    model = craft.uncertain("50%", {"craft.Jxx": "5%"})
    with pytest.raises(FmuError, match=r"largest must be a number from 0\.001 to 1000"):
        model.worst_case(craft.loop(GAINS, PERIOD, "50%"), largest=largest)


def test_the_error_about_a_computed_frequency_names_the_parameter_to_leave_out(
    craft: Craft,
) -> None:
    """The frequency follows from the fill table for ``mass_flow``, or from the diameter."""
    frequency, given = ModeQuantity(1, "frequency", 1), craft.parameters("50%")
    drains = Modes(craft.model, given | {"tank[1].fill.points": 3}).problem(frequency)
    assert drains.endswith("cannot be given; leave out mass_flow, or vary the fill instead")
    scaled = Modes(craft.model, given | {"tank[1].diameter": 1.0}).problem(frequency)
    assert "mass_flow" not in scaled and scaled.endswith("; leave out diameter")
    assert not Modes(craft.model, given).problem(frequency)
