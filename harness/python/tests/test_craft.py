"""Mass properties, parameters and loops of a craft, compared with sums by hand and with the FMU."""

import pickle
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import option
from fmpy import simulate_fmu

import hubslosh
from hubslosh import Craft, FmuError, FmuWarning, MountedTank, Wheel, attitude
from hubslosh.tanks import TankCase, read_drawing, solve

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
CYLINDER = {"density": 875.0, "shape": {"cylinder": {"radius": 0.4, "height": 1.1}}}
J = [[1150.0, -14.0, 22.0], [-14.0, 980.0, 9.0], [22.0, 9.0, 870.0]]
TURNED = (np.sin(0.1), 0.0, np.cos(0.1))

# Wheels about the body axes with angular momenta of 1, 2 and 3 N·m·s.
WHEELS = {
    name: Wheel(axis, 0.01, 0.2, 400, speed)
    for name, axis, speed in zip("xyz", np.eye(3), (100.0, 200.0, 300.0), strict=True)
}


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft with a spherical tank, and a cylindrical tank whose axis is tilted."""
    tanks = {
        "ox": MountedTank(SPHERE, (0.1, 0.5, -0.3)),
        "fuel": MountedTank(CYLINDER, (-0.2, -0.6, 0.1), TURNED, modes=1),
    }
    return Craft(
        1400.0, J, (0.01, -0.02, 1.05), tanks, 400.0, WHEELS,
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip


def shifted(mass: float, arm: np.ndarray) -> np.ndarray:
    """Return the inertia of a point mass (kg) at ``arm`` (m) from the reference point."""
    x, y, z = arm
    return mass * np.array(
        [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z],
         [-x * z, -y * z, x * x + y * y]]
    )  # fmt: skip


def test_monte_carlo_accepts_the_ranges_of_an_uncertain_model(craft: Craft) -> None:
    """Shares refer to the value at the fill; a tank has its name or its number.

    The ranges have the same ends as in `Craft.uncertain`. Names that are no parameters of the craft
    need the form (low, high).
    """
    tanks = {"ox": replace(craft.tanks["ox"], nu=3e-6)}
    tanks["fuel"] = replace(craft.tanks["fuel"], axis=(0, 0, 1))
    craft = replace(craft, tanks=tanks)
    ranges = {"ox.frequency[1]": "10%", "tank[1].zeta[1]": "interval", "craft.Jxx": "± 5%"}
    model = craft.uncertain("50%", ranges)
    table = craft.monte_carlo("50%", ranges | {"bias": (0.0, 1.0)}, 300)
    assert table.attrs["drawn"] == [*ranges, "bias"]
    for name, full in zip(ranges, model.deltas, strict=True):
        middle, half = model.center[full], float(model.spread.loc[full, full])
        assert (table[name] - middle).abs().max() == pytest.approx(half, rel=0.02)
        assert table[name].between(middle - half, middle + half).all()
    late = craft.monte_carlo("50%", {"delay": "10%"}, 50, parameters={"delay": 0.1})["delay"]
    assert 0.09 <= late.min() < 0.092 and 0.108 < late.max() <= 0.11
    for given, text in {
        ("delay", "10%"): "delay has no nominal value",
        ("bias", "10%"): "the craft has no quantity bias",
        ("fuel.frequency[2]", "10%"): "its tank has no such mode",
        ("craft.Jxx", "interval"): '"interval" is for zeta',
    }.items():
        with pytest.raises(FmuError, match=text):
            craft.monte_carlo("50%", dict([given]), 3)


def test_fmpy_with_the_parameters_of_a_craft_is_bit_identical_to_simulate(craft: Craft) -> None:
    """`Craft.parameters` therefore returns all values that a host must set."""
    values = craft.parameters("50%")
    names = [f"{name}[{i}]" for name in ("omega", "velocity", "slosh_torque") for i in (1, 2, 3)]
    steps = {"stop_time": 5.0, "output_interval": 0.05, "step_size": 0.05}
    theirs = simulate_fmu(str(craft.model), start_values=values, output=names, **steps)
    ours = hubslosh.simulate(craft.model, values, stop=5.0, step=0.05, outputs=names)
    assert len(theirs) == len(ours) == 101
    for name in names:
        assert theirs[name].tolist() == ours[name].tolist()
    assert ours["omega[1]"].any()


def test_rigid_mass_properties_equal_sums_of_textbook_formulas(craft: Craft) -> None:
    """The liquid is half a sphere and half a cylinder, each rotated and shifted to its tank."""
    found = craft.mass_properties("50%", "rigid")
    R, r, h = 0.5, 0.4, 0.55
    ox = 1440 * 2 / 3 * np.pi * R**3
    fuel = 875 * np.pi * r**2 * h
    # half a ball: its centre is 3 R/8 below the centre of the sphere, about which its inertia is
    # 2/5 m R²
    across = ox * R**2 * (2 / 5 - 9 / 64)
    of_ox = np.diag([across, across, 2 / 5 * ox * R**2])
    c, s = TURNED[2], TURNED[0]
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    side = fuel * (3 * r**2 + h**2) / 12
    of_fuel = turn @ np.diag([side, side, fuel * r**2 / 2]) @ turn.T
    places = [
        np.array([0.01, -0.02, 1.05]),
        np.array([0.1, 0.5, -0.3 + 5 / 8 * R]),
        np.array([-0.2, -0.6, 0.1]) + h / 2 * np.array(TURNED),
    ]
    masses = [1400.0, ox, fuel]
    center = sum(m * p for m, p in zip(masses, places, strict=True)) / sum(masses)
    inertia = np.array(J) + of_ox + of_fuel
    inertia += sum(shifted(m, p - center) for m, p in zip(masses, places, strict=True))
    assert found.mass == pytest.approx(sum(masses), rel=1e-12)
    assert found.center_of_mass == pytest.approx(center, abs=1e-12)
    # the tolerance is that of the program's integration over the contour
    assert found.inertia == pytest.approx(inertia, abs=1e-9 * inertia.max())


@pytest.mark.parametrize("fill", ["3%", {"ox": (120.0, "kg"), "fuel": 0.7}, ("100%", 0)])
def test_effective_mass_properties_equal_those_of_the_fmu(craft: Craft, fill) -> None:
    """Mass, centre of mass and inertia at rest agree, with sloshing and with rigid liquid."""
    mine = craft.mass_properties(fill)
    shift = craft.trim(fill).shift
    for rigid in (False, True):
        start = craft.parameters(fill, rigid=rigid)
        with hubslosh.Plant(craft.model, start) as plant:
            names = ["mass", *(f"center_of_mass[{i}]" for i in (1, 2, 3))]
            names += [f"inertia[{i},{k}]" for i in (1, 2, 3) for k in (1, 2, 3)]
            values = np.array([plant.get([name])[0] for name in names])
        assert values[0] == pytest.approx(mine.mass, rel=1e-12)
        assert values[1:4] + shift == pytest.approx(mine.center_of_mass, abs=1e-12)
        assert values[4:].reshape(3, 3) == pytest.approx(mine.inertia, rel=1e-9, abs=1e-7)


def test_loop_and_linear_model_of_a_craft_equal_a_calculation_by_hand(craft: Craft) -> None:
    """In the calculation, the parameters are composed by hand from the results of `tank`."""
    fill, gains = "60%", np.hstack([20 * np.eye(3), 300 * np.eye(3)])
    mass = craft.mass_properties(fill).mass
    hand = {"craft.mass": 1400.0, "tanks": 2, "force[3]": 400.0}
    hand |= {"craft.Jxx": 1150.0, "craft.Jxy": -14.0, "craft.Jxz": 22.0, "craft.Jyy": 980.0}
    hand |= {"craft.Jyz": 9.0, "craft.Jzz": 870.0}
    # O moves across the thrust, along z, to the centre of mass
    across = craft.trim(fill).shift
    center = craft.mass_properties(fill).center_of_mass
    assert across == pytest.approx(center * (1, 1, 0), abs=1e-12)
    r = np.array([0.01, -0.02, 1.05]) - across
    hand |= {f"craft.r[{i}]": float(x) for i, x in zip((1, 2, 3), r, strict=True)}
    hand |= {f"h_wheels[{i}]": float(i) for i in (1, 2, 3)}
    for number, (of, along) in enumerate(zip(craft.tanks.values(), (1, TURNED[2]), strict=True), 1):
        own = hubslosh.tank(of.source, fill, modes=of.modes, gravity=400 / mass * along)
        place = np.array(of.position) - across
        hand |= own.parameters("Spacecraft", number, position=place, axis=of.axis)
    torques = ["torque[1]", "torque[2]", "torque[3]"]
    measured = ["q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]"]
    loop = craft.loop(gains, 0.1, fill, delay=0.15)
    assert loop.names == (measured, torques)
    other = hubslosh.Loop(gains, 0.1, craft.model, hand, measured, torques, delay=0.15)
    mine, theirs = hubslosh.margins(loop), hubslosh.margins(other)
    assert mine.delay_margin == pytest.approx(theirs.delay_margin, rel=1e-9)
    columns = ["frequency", "gain_margin", "phase_margin"]
    assert mine.crossings[columns].to_numpy() == pytest.approx(
        theirs.crossings[columns].to_numpy(), rel=1e-9, nan_ok=True
    )
    model = craft.linearize(fill)
    assert model.outputs == ("q[1]", "q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]")
    assert model.inputs == tuple(torques)


def test_a_draining_craft_loses_the_mass_that_flows_out(craft: Craft) -> None:
    """In 10 s with 2 kg/s the mass falls by 20 kg.

    The FMU receives a table over the fill with damping and third-order coefficients. Third-order
    coefficients of fills between 56 and 71 % are not used, because the formulas have poles there.
    """
    on_axis = replace(craft.tanks["ox"], position=(0, 0, -0.3), modes=1, nu=3e-6)
    craft = replace(craft, center_of_mass=(0, 0, 1.05), gravity=0.25, tanks={"ox": on_axis})
    with pytest.warns(FmuWarning, match="tank ox: finite amplitude: .* bounded by its other fills"):
        start = craft.drain(2.0, "50%", between=("20%", "70%"))
    points = int(start["tank[1].fill.points"])
    for fill, point in (("20%", 1), ("70%", points)):
        ratio = craft.tank_at(fill)["ox"].modes["zeta"][0]
        assert start[f"tank[1].fill.zeta[1,{point}]"] == pytest.approx(ratio, rel=1e-6)
    least = craft.tank_at("20%")["ox"].all["finite_amplitude"]["mode"]
    for name in ("nonlinear_inertia", "nonlinear_stiffness"):
        assert start[f"tank[1].fill.{name}[1,1]"] == least[name] != 1
        column = [start[f"tank[1].fill.{name}[1,{point}]"] for point in range(1, points + 1)]
        assert len(set(column)) == points and min(column) > 0 and max(column) < 2
        assert f"tank[1].{name}[1]" not in start
    run = hubslosh.simulate(craft.model, start, stop=10, outputs=["mass", "center_of_mass"])
    lost = run["mass"].iloc[0] - run["mass"].iloc[-1]
    assert lost == pytest.approx(20, rel=1e-9)
    now = craft.mass_properties((craft.tank_at("50%")["ox"].mass - 20, "kg"))
    assert run["center_of_mass[3]"].iloc[-1] == pytest.approx(now.center_of_mass[2], abs=2e-4)
    # a loop around the draining craft
    gains = np.hstack([20 * np.eye(3), 300 * np.eye(3)])
    loop = craft.loop(gains, 0.5, "50%", mass_flow={"ox": 2.0}, between=("20%", "70%"))
    end = loop.simulate(10, outputs="mass")["mass"].iloc[-1]
    assert end == pytest.approx(run["mass"].iloc[-1], rel=1e-9)


def test_the_travel_of_detached_liquid_equals_closed_forms(craft: Craft) -> None:
    """In a sphere the travel is twice the distance between the centres of sphere and liquid.

    In a cylinder the travel is the height of the gas.
    """
    ways = craft.travel({"ox": "50%", "fuel": "25%"})
    assert ways["ox"] == pytest.approx(2 * 3 / 8 * 0.5, rel=1e-8)
    assert ways["fuel"] == pytest.approx(0.75 * 1.1, rel=1e-8)
    values = craft.parameters({"ox": "50%", "fuel": "25%"}, detach=True)
    assert values["tank[2].ball.travel"] == ways["fuel"]
    # the FMU accepts the parameters of detached liquid
    hubslosh.simulate(craft.model, values, stop=1, outputs=["mass"])
    assert craft.travel("100%")["ox"] == pytest.approx(0, abs=1e-12)


def test_the_viewer_draws_a_loop_that_records_the_columns_of_the_craft(
    craft: Craft, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """The viewer draws the tanks by their own contours."""
    loop = craft.loop(np.hstack([20 * np.eye(3), 300 * np.eye(3)]), 0.1, "60%")
    reference = attitude.slew(0.02, 1.0, axis=(0, 0, 1))
    run = loop.simulate(2, reference=reference, outputs=craft.columns("60%"))
    page = craft.view(run, tmp_path / "craft.html", program=option(request, "--hubslosh"))
    assert page.path.stat().st_size > 100_000
    assert "tank[2].angle_y[1]" in run and "tank[1].angle_x[2]" in run


def test_all_errors_of_a_craft_are_reported_at_once(craft: Craft) -> None:
    """One message lists all wrong fields; a wrong fill is reported by the call that takes it."""
    bad = MountedTank(SPHERE, (0, 0), axis=(0, 0, 0), modes=4)
    with pytest.raises(FmuError) as error:
        Craft(-1, [[1, 0, 0], [0, 1, 0], [0, 0, 3]], tanks={"a": bad, "b": SPHERE}, thrust="x")
    for text in ("mass must be", "principal moments", "thrust must be", "tank a: position", "axis",
                 "modes must be 1, 2 or 3", "tank b must be a MountedTank"):  # fmt: skip
        assert text in str(error.value)
    for fill, text in {
        ("50%",): "one for each of ox, fuel",
        "120%": r"tank ox: The fill is 120 % of the tank's volume; it must be 0 to 100 %",
    }.items():
        with pytest.raises(FmuError, match=text):
            craft.parameters(fill)
    with pytest.raises(FmuError, match="fill must have ox, fuel, not ox"):
        craft.fills({"ox": "50%"})
    with pytest.raises(FmuError, match=r"m/s² along its axis.*give gravity="):
        replace(craft, thrust=0.0).parameters("50%")
    assert replace(craft, thrust=0.0, gravity=0.1).parameters("50%")["tank[1].g_ref"] == 0.1
    assert len(str(craft).splitlines()) <= 10


def test_many_fills_at_once_give_the_same_bits_as_single_fills(craft: Craft) -> None:
    """A call with many fills uses all cores.

    This also holds after the craft was copied to another process.
    """
    fills = ["20%", ("35%", 0.4), {"ox": (120.0, "kg"), "fuel": 0}, "100%"]
    apart = replace(craft)
    craft.solve(fills)
    for fill in fills:
        assert craft.parameters(fill, rigid=fill == "100%") == apart.parameters(
            fill, rigid=fill == "100%"
        )
    one = craft.tank_at("20%")["ox"]
    again = pickle.loads(pickle.dumps(one))
    assert again.all == one.all and again.picture == one.picture
    assert again.parameters() == one.parameters()
    # the mass is the same whether modes are computed or not
    for tank in (SPHERE, CYLINDER, {"density": 1.0, "box": [0.5, 0.8]}):
        for height in (0.1, 0.55, 1.0):
            mass = read_drawing(tank).mass(height)
            assert mass == hubslosh.tank(tank, height, modes=1).mass


def test_ctrl_c_ends_the_calculation_of_tanks() -> None:
    """An interrupt ends a calculation of several minutes within a second."""
    # restore the default handler, because background processes of a shell ignore the signal
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT))
    case = TankCase(SPHERE, "50%", 3, 1.0, 1e-6, None, None)
    start = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        solve([case] * 10_000)
    signal.signal(signal.SIGINT, before)
    assert time.monotonic() - start < 30


def test_the_liquid_of_a_spinning_tank_starts_with_the_spin_of_the_tank(craft: Craft) -> None:
    """Its angular momentum is the rate of the tank times the inertia of the turning liquid."""
    tank = MountedTank(CYLINDER, (0.0, 0.0, -0.5), modes=1, nu=1e-6, spin=0.4)
    spinner = replace(craft, tanks={"fuel": tank}, wheels={})
    values = spinner.parameters(0.4)
    inertia = values["tank[1].spin_inertia"]
    radius = 0.4
    mass = 875.0 * np.pi * radius**2 * 0.4
    assert inertia == pytest.approx(mass * radius**2 / 2, rel=0.1) and inertia > 0
    assert values["tank[1].gyroscopic[1]"] == pytest.approx(0.496, abs=1e-3)
    assert values["tank[1].spin_decay[1]"] == pytest.approx(np.sqrt(1e-6 * 0.4) / 0.4, rel=1e-6)
    run = hubslosh.simulate(
        craft.model, {**values, "init.omega[3]": 0.4}, stop=1.0,
        outputs=["tank[1].spin[3]", "tank[1].spin_number"],
    )  # fmt: skip
    assert run["tank[1].spin[3]"].iloc[0] == pytest.approx(0.4 * inertia, rel=1e-9)
    assert 0 < run["tank[1].spin_number"].iloc[-1] < 1
    without = replace(craft, tanks={"fuel": replace(tank, spin=None)}).parameters(0.4)
    assert not any("spin" in name or "gyroscopic" in name for name in without)
    assert "spin = -1" in replace(tank, spin=-1.0).problems()[0]
