"""Uncertain models, margins, worst cases and reviews of craft that spin."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.optimize import brentq
from test_uncertain import MEASURED, POINT, RANGES, TORQUE, difference

import hubslosh
from hubslosh import (
    Craft,
    FmuError,
    FmuWarning,
    Loop,
    MountedTank,
    UncertainModel,
    Wheel,
    uncertain,
)

CYLINDER = {"density": 1000, "shape": {"cylinder": {"radius": 0.3, "height": 0.6}}}
RATES = [f"omega[{i}]" for i in (1, 2, 3)]

pytestmark = pytest.mark.filterwarnings("ignore:.*no steady state")

TUMBLING = POINT | {
    "init.omega[1]": 0.2, "init.omega[2]": -0.1, "init.omega[3]": 0.5,
    "tank[1].spin_inertia": 3.1, "tank[1].spin_decay[1]": 0.02, "tank[1].spin_decay[2]": 0.05,
    "tank[1].gyroscopic[1]": 0.42, "tank[1].gyroscopic_stiffness[1]": 0.13,
    "tank[2].spin_inertia": 2.4, "tank[2].spin_inertia_across": 2.9, "tank[2].spin_coupling": 0.9,
    "tank[2].gyroscopic[1]": 0.6, "tank[2].slip_0[1]": 0.03, "tank[2].slip_0[3]": -0.2,
    "appendages": 1, "appendage[1].frequency": 0.4, "appendage[1].position[2]": 1.1,
    "appendage[1].participation[1]": 1.4, "appendage[1].participation[3]": 2.0,
    "appendage[1].participation[4]": 3.0, "appendage[1].eta_0": 0.02,
}  # fmt: skip
"""A craft in which every term acts: surfaces are not at rest, liquids spin, an array is bent."""


@pytest.fixture
def spacecraft(fmu: Path) -> Path:
    return fmu.with_name("Spacecraft.fmu")


def loop_difference(loop: Loop, model: UncertainModel, delta: np.ndarray) -> float:
    """Return how far the loop gain of ``model`` at Δ is from that of a new ``loop``, relatively.

    The new loop has the parameters that the model has at Δ.
    """
    new = replace(loop, parameters=model.parameters(delta)).gain()
    mine = loop._gain(model.at(delta), loop.linear())
    f = np.geomspace(0.01, 4.9, 40)
    a, b = mine.response(f), new.response(f)
    return float(np.abs(a - b).max() / np.abs(b).max())


def test_every_draw_is_the_linear_model_of_a_craft_that_spins(spacecraft: Path) -> None:
    """At random corners and interior points, models and loop gains agree with new linear models."""
    ranges = RANGES | {"appendage[1].frequency": "10%", "appendage[1].zeta": "50%"}
    model = uncertain(TUMBLING, ranges, ("torque", "force"), model=spacecraft)
    random = np.random.default_rng(3)
    count = len(ranges)
    for delta in [*random.choice([-1.0, 1.0], (20, count)), *random.uniform(-1, 1, (20, count))]:
        assert difference(model, delta, spacecraft) < 1e-11
    gains = np.hstack([40 * np.eye(3), 200 * np.eye(3)])
    loop = Loop(gains, 0.1, spacecraft, TUMBLING, MEASURED, TORQUE, delay=0.07)
    model = uncertain(TUMBLING, ranges, outputs=MEASURED, model=spacecraft)
    for delta in [np.zeros(count), random.choice([-1.0, 1.0], count), random.uniform(-1, 1, count)]:
        assert loop_difference(loop, model, delta) < 1e-8


@pytest.fixture
def spinner(spacecraft: Path) -> Craft:
    """Return a craft that spins about its thrust, with one tank on the spin axis and two off it.

    The axis of each tank is along the specific force at its slosh mass, so that the liquid is at
    rest.
    """
    spin, thrust, x = 0.7, 500.0, 0.9
    axial = MountedTank(CYLINDER, (0, 0, 0.4), modes=1, nu=1e-6)
    upright = Craft(700, [500, 520, 610], tanks={"axial": axial}, thrust=thrust, model=spacecraft)
    values = upright.parameters("50%")
    bob = values["tank[1].hinge[1]"] - values["tank[1].length[1]"]
    liquid = upright.mass_properties("50%").mass - upright.mass
    lean = 0.0
    for _ in range(40):
        inwards = spin**2 * (x - bob * np.sin(lean))
        lean = np.arctan2(inwards, thrust / (upright.mass + 3 * liquid))
    tanks = {"axial": axial}
    for name, side in (("left", 1), ("right", -1)):
        axis = (-side * np.sin(lean), 0, np.cos(lean))
        tanks[name] = replace(axial, position=(side * x, 0, -0.3), axis=axis)
    return replace(upright, tanks=tanks, spin=spin)


NAMED = {
    "axial.frequency[1]": "10%", "axial.zeta[1]": "interval", "left.frequency[1]": "8%",
    "right.mass[1]": "10%", "right.bob[1]": (0.16, 0.2), "craft.Jxx": "5%", "craft.Jzz": "5%",
}  # fmt: skip


def test_a_name_means_the_same_quantity_in_the_uncertain_model_and_in_a_loop(
    spinner: Craft,
) -> None:
    """A loop with the uncertain values as parameters has the loop gain of the LFT at this Δ.

    The liquid is at rest, so that none of these values changes the accelerations at the operating
    point. The damping differs by 1e-7, because it depends on the specific force at the hinge, which
    moves with the frequency.
    """
    gains = 200 * np.eye(3)
    ranges = {name: of for name, of in NAMED.items() if name != "right.bob[1]"}
    model = spinner.uncertain("50%", ranges, outputs=RATES)
    random = np.random.default_rng(1)
    for delta in (random.choice([-1.0, 1.0], len(ranges)), random.uniform(-1, 1, len(ranges))):
        values = model.values(delta)
        loop = spinner.loop(gains, 0.1, "50%", measured="omega", delay=0.04, parameters=values)
        mine = loop._gain(model.at(delta), loop.linear())
        f = np.geomspace(0.01, 4.9, 40)
        new = loop.gain().response(f)
        assert np.abs(mine.response(f) - new).max() < 1e-6 * np.abs(new).max()


def test_a_new_height_of_the_slosh_mass_does_not_change_its_frequency(spinner: Craft) -> None:
    """In a tank off the spin axis the specific force varies with the height of the slosh mass."""
    model = spinner.uncertain("50%", {"right.bob[1]": (0.1, 0.25)}, outputs=RATES)
    high = spinner.parameters("50%", parameters={"right.bob[1]": 0.25})
    now = uncertain(high, {"craft.Jxx": "1%"}, model=spinner.model)._craft.values
    name = "tank[3].frequency[1]"
    assert now[name] == pytest.approx(model._craft.values[name], rel=1e-9)
    assert now["tank[3].bob[1]"] == pytest.approx(0.25, rel=1e-12)
    length = model.parameters([1.0])["tank[3].length[1]"]
    # agree only approximately: the model keeps the acceleration constant, the craft its thrust
    assert length == pytest.approx(high["tank[3].length[1]"], rel=2e-3)
    assert length < 0.99 * model.parameters([0.0])["tank[3].length[1]"]


def test_the_worst_case_of_a_rigid_spinner_equals_a_closed_form_of_its_nutation(
    spacecraft: Path,
) -> None:
    """The transverse rate ξ = ω_1 + j ω_2 follows across · ξ' = j (along - across) s ξ + τ.

    ``along`` and ``across`` are the moments of inertia, s is the spin. With a delayed, sampled rate
    feedback the poles are the roots of a polynomial.
    """
    across, along, s, k, period, delay = 400.0, 520.0, 2.0, 300.0, 0.1, 0.26
    dry = Craft(900, [across, across, along], spin=s, model=spacecraft)

    def roots(along: float) -> np.ndarray:
        turn, rest = 1j * (along - across) * s / across, delay - 2 * period
        late, whole = ((np.exp(turn * t) - 1) / turn / across for t in (period - rest, period))
        # ξ_{n+1} = step ξ_n - k (late ξ_{n-2} + (whole - late) ξ_{n-3})
        return np.roots([1, -np.exp(turn * period), 0, k * late, k * (whole - late)])

    limit = brentq(lambda x: np.abs(roots(x)).max() - 1, along, 5 * across, xtol=1e-12)
    critical = max(roots(limit), key=abs)
    loop = dry.loop(np.diag([k, k, 5.0]), period, 0, measured="omega", delay=delay)
    model = dry.uncertain(0, {"craft.Jzz": "20%"}, outputs=RATES)
    worst = model.worst_case(loop, largest=10)
    assert model.values(worst.delta)["craft.Jzz"] == pytest.approx(limit, rel=1e-7)
    assert worst.frequency == pytest.approx(np.angle(critical) / (2 * np.pi * period), rel=1e-6)
    found = model.certify(loop, largest=10, worst=worst)
    assert found.size <= worst.size < 1.05 * found.size


def test_the_worst_case_of_a_spinner_with_slosh_is_at_the_stability_limit(spinner: Craft) -> None:
    """A new loop is stable at a Δ just below the worst case, and unstable just above it.

    The certificate proves stability up to a size that is at most 5 % smaller.
    """
    # the controller turns the torque by 50° relative to the measured rate
    turn = np.radians(50)
    mix = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    loop = spinner.loop(150 * mix, 0.1, "50%", measured="omega", delay=0.1)
    names = ("left.frequency[1]", "right.bob[1]", "craft.Jzz")
    model = spinner.uncertain("50%", {name: NAMED[name] for name in names}, outputs=RATES)
    worst = model.worst_case(loop, largest=20)
    assert worst.delta
    for share, stable in ((0.999, True), (1.001, False)):
        delta = {name: share * x for name, x in worst.delta.items()}
        delta = np.maximum(model.delta(delta), model._least)
        new = replace(loop, parameters=model.parameters(delta, commanded=True))
        assert hubslosh.margins(new).stable is stable
    found = model.certify(loop, largest=20, worst=worst)
    assert 0 < found.size <= worst.size < 1.05 * found.size


WHEELS = {
    "a": Wheel((1, 0, 0.3), 0.5, 5, 3000), "b": Wheel((-0.2, 1, 0), 0.4, 5, 3000),
    "c": Wheel((0, 0.1, 1), 0.3, 5, 3000),
}  # fmt: skip
"""Three wheels; the third is nearly along the spin of the craft."""


def test_every_draw_has_the_momentum_that_wheels_gain(spacecraft: Path) -> None:
    """Vertices and interior points agree with the model of a new loop, and the loops with it."""
    ranges = RANGES | {"appendage[1].frequency": "10%", "appendage[1].zeta": "50%"}
    point = TUMBLING | {"h_wheels[1]": 7.0, "h_wheels[2]": -4.0, "h_wheels[3]": 25.0}
    commands = ["b.torque", "force[2]", "c.torque", "a.torque"]
    gains = np.random.default_rng(2).normal(0, 100, (4, 3))
    loop = Loop(gains, 0.1, spacecraft, point, RATES, commands, delay=0.07, wheels=WHEELS)
    model = uncertain(point, ranges, outputs=RATES, model=spacecraft)
    with pytest.raises(FmuError, match=r"inputs=\['force\[2\]', 'torque\[1\]', .*, outputs="):
        model.worst_case(loop)
    model = uncertain(point, ranges, ["force[2]", *TORQUE], RATES, model=spacecraft)
    mine, controller = model._around(loop)
    assert mine.M.states[-3:] == ("a.speed", "b.speed", "c.speed")
    random, count = np.random.default_rng(3), len(ranges)
    f = np.geomspace(0.01, 4.9, 40)
    for delta in [*random.choice([-1.0, 1.0], (10, count)), *random.uniform(-1, 1, (10, count))]:
        new = replace(loop, parameters=model.parameters(delta))
        theirs = new.plant()
        kept = [theirs.states.index(state) for state in mine.M.states]
        matrices = theirs.A[np.ix_(kept, kept)], theirs.B[kept], theirs.C[:, kept], theirs.D
        for a, b in zip(mine.at(delta), matrices, strict=True):
            assert np.abs(a - b).max() <= 1e-11 * np.abs(b).max()
        a, b = loop._gain(mine.at(delta), controller).response(f), new.gain().response(f)
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max()


def test_the_worst_case_of_wheels_on_a_spinner_is_its_total_momentum(spinner: Craft) -> None:
    """Wheels across the spin damp the rates of a craft only if its momentum is against the spin.

    Without an external torque the momentum about the centre of mass is J s + h along the spin s,
    and k feeds the rates across back to the wheels. These turn with the momentum h_E = h_1 + j h_2:
    (I/k) h_E'' + [1 + j (I s - J s - h)/k] h_E' + j s h_E = 0, which is at the limit of stability
    with h_E' = -j s h_E where J s + h = 0. A delay turns k by a phase, which does not move it.
    """
    s, along, h, k = 0.7, 520.0, -480.0, 150.0
    wheels = {"x": Wheel((1, 0, 0), 0.5, 5, 3000), "y": Wheel((0, 1, 0), 0.5, 5, 3000)}
    wheels["z"] = Wheel((0, 0, 1), 0.5, 5, 3000, speed=h / 0.5)
    dry = Craft(900, [400, 400, along], spin=s, wheels=wheels, model=spinner.model)
    loop = dry.loop(k * np.eye(3), 0.1, 0, measured="omega", command="wheels", delay=0.05)
    model = dry.uncertain(0, {"craft.Jzz": "10%"}, outputs=RATES)
    worst = model.worst_case(loop, largest=10)
    assert model.values(worst.delta)["craft.Jzz"] == pytest.approx(-h / s, rel=1e-3)
    assert worst.frequency == pytest.approx(s / (2 * np.pi), rel=1e-3)
    # the same wheels, except for the speed of z, on a spinner with tanks
    full = replace(spinner, wheels=wheels | {"z": replace(wheels["z"], speed=-600 / 0.5)})
    loop = full.loop(k * np.eye(3), 0.1, "50%", measured="omega", command="wheels", delay=0.05)
    names = ("left.frequency[1]", "right.bob[1]", "craft.Jzz")
    model = full.uncertain("50%", {name: NAMED[name] for name in names}, outputs=RATES)
    worst = model.worst_case(loop, largest=20)
    assert worst.delta
    for share, stable in ((0.999, True), (1.001, False)):
        delta = np.maximum(share * model.delta(worst.delta), model._least)
        new = replace(loop, parameters=model.parameters(delta))
        assert hubslosh.margins(new).stable is stable
    found = model.certify(loop, largest=20, worst=worst)
    assert 0 < found.size <= worst.size < 1.05 * found.size


def test_a_spin_of_the_craft_or_of_a_tank_applies_to_the_craft_and_all_liquids(
    spinner: Craft,
) -> None:
    """The spin is set either as ``spin`` of the craft, or as ``spin`` of a tank."""
    values = spinner.parameters("50%")
    assert values["init.omega[3]"] == 0.7 and values["init.omega[1]"] == 0
    assert values["tank[1].spin_inertia"] > 0 and values["tank[2].spin_inertia"] > 0
    upside_down = MountedTank(CYLINDER, (0, 0, 0.4), (0, 0, -2), modes=1, spin=0.3)
    tanks = {"up": replace(upside_down, axis=(0, 0, 1)), "down": upside_down}
    tanks["other"] = replace(upside_down, spin=None)
    by_tank = replace(spinner, tanks=tanks, spin=None, gravity=0.5)
    values = by_tank.parameters("50%")
    assert values["init.omega[3]"] == pytest.approx(0.3, rel=1e-15)
    assert values["tank[3].spin_inertia"] == values["tank[1].spin_inertia"] > 0
    assert "spin (0, 0, 0.3) rad/s" in str(by_tank)
    # an initial rate across the spin axis is allowed
    nutating = by_tank.parameters("50%", parameters={"init.omega[1]": (2, "deg/s")})
    assert nutating["init.omega[1]"] == (2, "deg/s")


def test_an_error_names_both_of_two_spins_that_contradict_each_other(spinner: Craft) -> None:
    """The message also says which spin to leave out."""
    tank = replace(spinner.tanks["axial"], spin=0.4)
    with pytest.raises(
        FmuError, match=r"axial: spin = 0\.4 rad/s, but .* at 0\.7 rad/s .*give the spin"
    ):
        replace(spinner, tanks={"axial": tank})
    again = replace(spinner, tanks={"axial": replace(tank, spin=0.7)})
    assert again.parameters("50%")["init.omega[3]"] == 0.7
    for given in ({"init.omega[3]": 0.6}, {"init.omega[3]": (0.6, "rad/s")}):
        with pytest.raises(
            FmuError, match=r"init.omega is 0\.6 rad/s .* spin at 0\.7 rad/s: leave"
        ):
            again.parameters("50%", parameters=given)
    with pytest.raises(FmuError, match="spin must be 3 finite numbers"):
        replace(spinner, spin=(1.0, 2.0))


def test_the_attitude_of_a_spinner_is_no_steady_state(spinner: Craft) -> None:
    """Margins and uncertain models warn if the loop measures the attitude."""
    for call in (
        lambda: hubslosh.margins(spinner.loop(np.ones((3, 6)), 0.1, "50%")),
        lambda: spinner.uncertain("50%", {"craft.Jxx": "5%"}),
    ):
        with pytest.warns(FmuWarning, match=r"no steady state of q: .*Measure omega instead"):
            call()


def test_files_of_a_spinner_have_a_linear_model_at_its_steady_state(
    spinner: Craft, tmp_path: Path
) -> None:
    """The attitude, of which the other calls warn, is not among its outputs."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", FmuWarning)
        found = loadmat(spinner.export(tmp_path, "50%")["mat"], squeeze_me=True)
    assert [name.strip() for name in found["outputs"]] == RATES
    assert (found["A"] == spinner.linearize("50%", outputs="omega").A).all()


def test_a_review_simulates_the_worst_case_at_the_spin(spinner: Craft) -> None:
    """The simulated limit of stability agrees with the predicted one to 1 %."""
    found = spinner.review(150 * np.eye(3), 0.1, ["50%"], draws=5, measured="omega", delay=0.1)
    assert found.points["stable"].all() and found.confirmation.agrees
