"""Reaction wheels: closed forms, conservation of angular momentum, limits, and linear models."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import hubslosh
from hubslosh import Craft, FmuError, FmuWarning, MountedTank, Wheel, attitude

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
INERTIA = np.array([[900.0, -20.0, 5.0], [-20.0, 850.0, 12.0], [5.0, 12.0, 700.0]])
GAINS = np.hstack([80 * np.eye(3), 400 * np.eye(3)])

# Four wheels in a pyramid configuration.
PYRAMID = {
    name: Wheel((np.cos(angle), np.sin(angle), 0.7), 0.02, 0.3, 500, speed)
    for name, angle, speed in zip(
        "abcd", np.radians([45, 135, 225, 315]), (100.0, -50.0, 0.0, 120.0), strict=True
    )
}
# Wheels about the body axes with a bias momentum of 6 N·m·s each.
BODY_WHEELS = {
    name: Wheel(axis, 0.02, 0.3, 500, 300) for name, axis in zip("xyz", np.eye(3), strict=True)
}
AXES = np.array([wheel.direction for wheel in PYRAMID.values()])
OMEGA = [f"omega[{i}]" for i in (1, 2, 3)]
MOMENTUM = [f"angular_momentum[{i}]" for i in (1, 2, 3)]


@pytest.fixture(params=["Spacecraft", "Spacecraft-fmi3"])
def rigid(request: pytest.FixtureRequest, fmu: Path) -> Craft:
    """Return a craft without tanks, with four wheels."""
    model = fmu.with_name(f"{request.param}.fmu")
    return Craft(1000.0, INERTIA, (0.1, 0.02, 1.0), wheels=PYRAMID, model=model)


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft with two tanks and four wheels."""
    tanks = {
        "ox": MountedTank(SPHERE, (0.1, 0.6, 0.2), modes=1, nu=3e-7),
        "fuel": MountedTank(SPHERE, (0, -0.7, -0.4), modes=2, nu=9e-7),
    }
    return Craft(1000.0, INERTIA, (0, 0, 1.0), tanks, 400.0, PYRAMID,
                 model=fmu.with_name("Spacecraft.fmu"))  # fmt: skip


def rotated(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors, one in each row, transformed from body to inertial axes by ``q``."""
    w, xyz = q[:, :1], q[:, 1:]
    across = np.cross(xyz, vectors)
    return vectors + 2 * (w * across + np.cross(xyz, across))


def test_wheels_turn_a_craft_at_rest_by_their_momentum(rigid: Craft) -> None:
    """The total angular momentum stays 0, so that omega = -J^-1 h at every time.

    J is the inertia of the whole craft. The torques are commands of a loop, or inputs of
    `simulate`.
    """
    wheels = {name: replace(wheel, speed=0.0) for name, wheel in PYRAMID.items()}
    craft = replace(rigid, wheels=wheels)
    torque = np.array([0.2, -0.1, 0.05, 0.25])
    turning = -np.linalg.solve(INERTIA, AXES.T @ -torque)  # rad/s²
    loop = craft.loop(lambda t, y: torque, 0.1, 0, command="wheels")
    run = loop.simulate(30, outputs=OMEGA, tolerance=1e-10)
    expected = np.outer(run["time"], turning)
    assert run[OMEGA].to_numpy() == pytest.approx(expected, rel=1e-9, abs=1e-14)
    table = pd.DataFrame({"time": [0.0, 30.0]})
    for name, value in zip("abcd", torque, strict=True):
        table[f"{name}.torque"] = value
    run = craft.simulate(0, table, step=0.5, outputs=OMEGA, tolerance=1e-10)
    expected = np.outer(run["time"], turning)
    assert run[OMEGA].to_numpy() == pytest.approx(expected, rel=1e-9, abs=1e-14)
    assert run["a.speed"].to_numpy() == pytest.approx(-0.2 / 0.02 * run["time"].to_numpy())


def test_the_precession_of_a_gyrostat_equals_its_closed_form(rigid: Craft) -> None:
    """The transverse rate of a symmetric body with a wheel on its axis rotates.

    Its angular velocity is ((C - A) s + h)/A, where A and C are the moments of inertia across and
    along the axis, s is the spin, and h the momentum of the wheel.
    """
    a, c, s, x, h = 500.0, 800.0, 0.02, 0.03, -40.0  # a, c: A, C
    wheel = Wheel((0, 0, 2), 0.1, 1, 1000, h / 0.1)
    body = replace(rigid, inertia=[a, a, c], wheels={"z": wheel}, center_of_mass=(0, 0, 0))
    start = {"init.omega[1]": x, "init.omega[3]": s}
    run = body.simulate(
        0, stop=200, step=1, outputs=[*OMEGA, *attitude.NAMES], parameters=start, tolerance=1e-11
    )
    rate, t = ((c - a) * s + h) / a, run["time"].to_numpy()
    expected = np.column_stack([x * np.cos(rate * t), -x * -np.sin(rate * t), s + 0 * t])
    assert run[OMEGA].to_numpy() == pytest.approx(expected, abs=1e-9)
    momentum = run[OMEGA].to_numpy() * (a, a, c) + (0, 0, h)
    inertial = rotated(run[list(attitude.NAMES)].to_numpy(), momentum)
    assert inertial == pytest.approx(np.tile((a * x, 0, c * s + h), (len(t), 1)), abs=1e-8)


@pytest.mark.parametrize("period", [0.05, 0.2])
def test_wheels_and_slosh_do_not_change_the_total_angular_momentum(
    craft: Craft, period: float
) -> None:
    """Without thrust, no external torque acts on the craft.

    The momentum of the wheels is computed from their speeds, the momentum of craft and liquid from
    their motion.
    """
    free = replace(craft, thrust=0.0, gravity=0.4)
    start = {"init.omega[1]": 0.02, "init.omega[3]": -0.01, "ox.zeta[1]": 0.0}
    start |= {f"tank[{tank}].k[{n}]": 2.0 for tank, n in ((1, 1), (2, 1), (2, 2))}
    gains = np.linalg.pinv(AXES.T) @ (20 * GAINS)
    loop = free.loop(gains, period, "50%", command="wheels", parameters=start)
    outputs = [*OMEGA, *MOMENTUM, "h_wheels[1]", "h_wheels[2]", "h_wheels[3]"]
    outputs += [f"tank[2].angle_{axis}[1]" for axis in "xy"]
    run = loop.simulate(60, outputs=outputs, tolerance=1e-11, substeps=2)
    assert 0.02 < run[outputs[-2:]].abs().to_numpy().max() < 0.7
    total = run[MOMENTUM].to_numpy()
    assert np.abs(total - total[0]).max() < 1e-9 * np.linalg.norm(total[0])
    speeds = run[[f"{name}.speed" for name in PYRAMID]].to_numpy()
    torques = run[[f"{name}.torque" for name in PYRAMID]].to_numpy()
    assert (np.abs(torques).max(axis=0) == 0.3).any() and np.ptp(speeds, axis=0).min() > 1
    own = 0.02 * speeds @ AXES
    assert run[[f"h_wheels[{i}]" for i in (1, 2, 3)]].to_numpy() == pytest.approx(own, abs=1e-11)
    # the torque of each row accelerates its wheel until the next row, below the largest speed
    dt = np.diff(run["time"])[:, None]
    short = np.abs(np.diff(speeds, axis=0)) - np.abs(torques[:-1]) * dt / 0.02
    limited = np.abs(speeds[1:]) == 500
    assert short[~limited] == pytest.approx(0, abs=1e-9) and (short[limited] < 1e-9).all()
    assert (short < -0.1).any()


def test_a_wheel_at_its_largest_speed_gains_no_more_momentum(rigid: Craft) -> None:
    """In a loop and in `simulate`, torque and speed stay within their limits.

    A torque that brakes such a wheel acts. The craft has the opposite momentum of the wheel.
    """
    wheel = Wheel((0, 0, 1), 0.01, 0.2, 100, 80.0)
    body = replace(rigid, inertia=[400, 400, 300], wheels={"z": wheel}, center_of_mass=(0, 0, 0))
    asked = lambda t: -0.5 if t < 3 else 0.1  # noqa: E731
    loop = body.loop(lambda t, y: asked(t), 0.3, 0, command=["z.torque"])
    looped = loop.simulate(6, outputs=["omega[3]"], substeps=1)
    table = pd.DataFrame({"time": [0.0, 3.0, 6.0], "z.torque": [-0.5, 0.1, 0.1]})
    plain = body.simulate(0, table, step=0.3, outputs=["omega[3]"])
    table["torque[1]"] = [0.0, 0.6, 0.6]
    opened = body.simulate(0, table, step=0.3, outputs=["omega[3]"])
    for run in (looped, plain, opened):
        torque, speed = run["z.torque"].to_numpy(), run["z.speed"].to_numpy()
        assert np.abs(speed).max() == 100 and np.abs(torque).max() == 0.2
        turned = 0.01 * (speed - 80) / 300
        assert run["omega[3]"].to_numpy() == pytest.approx(-turned, rel=1e-9, abs=1e-15)
        assert run["z.speed"].iloc[-1] == pytest.approx(100 - 0.1 * 3 / 0.01)
    # the wheel reaches its largest speed after 1 s, between two rows; until then the torque acts
    for run in (looped, plain, opened):
        assert run["z.torque"].to_numpy()[:5].tolist() == [-0.2, -0.2, -0.2, -0.2, 0]
    assert looped["omega[3]"].tolist() == plain["omega[3]"].tolist()
    # A ramp of torque about the first axis changes the rounding errors of rates up to 7e-4 rad/s.
    assert np.abs(plain["omega[3]"] - opened["omega[3]"]).max() < 2e-18
    assert opened["torque[1]"].iloc[-1] == 0.6 and opened["torque[1]"].iloc[5] == pytest.approx(0.3)


def test_a_loop_with_wheels_is_bit_identical_to_single_calls_of_the_fmu(craft: Craft) -> None:
    """The loop has a matrix of gains; the single calls are made in Python."""
    loop = craft.loop(
        np.linalg.pinv(AXES.T) @ GAINS, 0.1, "50%", command="wheels",
        parameters={"init.omega[1]": 0.01},
    )  # fmt: skip
    run = loop.simulate(5, outputs=OMEGA)
    measured, commands = loop.names
    assert commands == ["a.torque", "b.torque", "c.torque", "d.torque"]
    speed = np.array([wheel.speed for wheel in PYRAMID.values()])
    h = np.array([float(loop.parameters[f"h_wheels[{i}]"]) for i in (1, 2, 3)])
    omegas, speeds = [], []
    with hubslosh.Plant(loop.model, loop.parameters) as plant:
        for k in range(50):
            omegas.append(plant.get(OMEGA))
            speeds.append(speed)
            y = -np.array(plant.get(measured))
            u = np.clip(
                [sum(g * e for g, e in zip(row, y, strict=True)) for row in loop.controller],
                -0.3,
                0.3,
            )
            time = k * 0.1
            dt = (k + 1) * 0.1 - time
            speed = speed - u * dt / 0.02
            slope = np.zeros(3)
            for torque, axis in zip(u, AXES, strict=True):
                slope = slope - torque * axis
            for i in range(3):
                plant.set(f"h_wheels[{i + 1}]", float(h[i]))
                plant.set_slope(f"h_wheels[{i + 1}]", float(slope[i]))
            plant.step(time + dt)
            h = h + slope * dt
    assert run[OMEGA].to_numpy()[:-1].tolist() == omegas
    assert run[["a.speed", "d.speed"]].to_numpy()[:-1].tolist() == [
        [s[0], s[3]] for s in speeds
    ]  # fmt: skip


def test_a_loop_with_wheels_has_the_margins_of_a_loop_with_torques_and_bias_momentum(
    craft: Craft,
) -> None:
    """The wheels turn about the body axes."""
    craft = replace(craft, wheels=BODY_WHEELS)
    there = hubslosh.margins(craft.loop(GAINS, 0.1, "50%", command="wheels", delay=0.05))
    plain = hubslosh.margins(craft.loop(GAINS, 0.1, "50%", delay=0.05))
    assert there.poles == pytest.approx(plain.poles, abs=1e-12)
    axes = there.crossings["loop"].str.removesuffix(".torque").map({"x": "1", "y": "2", "z": "3"})
    assert axes.tolist() == plain.crossings["loop"].str[7].tolist()
    assert there.delay_margin == pytest.approx(plain.delay_margin)
    rest = replace(craft, wheels={})
    without_bias = hubslosh.margins(rest.loop(GAINS, 0.1, "50%", delay=0.05)).poles
    assert abs(np.sort(abs(without_bias)) - np.sort(abs(plain.poles))).max() > 3e-5


def test_the_linear_model_of_wheels_in_a_craft_that_spins_has_their_speeds_as_states(
    rigid: Craft,
) -> None:
    """The model equals J w' = -w x (J w + h) + torques, linearised by hand."""
    spin = np.array([0.0, 0.0, 0.4])
    body = replace(rigid, inertia=[500, 500, 800], center_of_mass=(0, 0, 0))
    inertia = np.diag([500.0, 500, 800])

    def cross(v: np.ndarray) -> np.ndarray:
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    # equal speeds have a total momentum along z, with which the craft turns steadily
    wheels = {n: replace(w, speed=100.0) for n, w in PYRAMID.items()}
    body = replace(body, wheels=wheels)
    h = sum(wheel.momentum for wheel in wheels.values())
    assert h[:2] == pytest.approx(0, abs=1e-12)
    loop = body.loop(np.zeros((4, 3)), 0.1, 0, command="wheels", measured="omega",
                     parameters={"init.omega[3]": 0.4})  # fmt: skip
    model = loop.plant()
    turn = np.linalg.solve(inertia, cross(inertia @ spin + h) - cross(spin) @ inertia)
    by_speed = -np.linalg.solve(inertia, cross(spin) @ AXES.T * 0.02)
    a = np.block([[turn, by_speed], [np.zeros((4, 7))]])
    b = np.vstack([np.linalg.solve(inertia, AXES.T), -np.eye(4) / 0.02])
    f = np.array([0.003, 0.05, 0.2, 1.0])
    mine = np.array([np.linalg.solve(2j * np.pi * x * np.eye(7) - a, b)[:3] for x in f])
    assert model.response(f) == pytest.approx(mine, rel=1e-9, abs=1e-15)
    assert model.states[-4:] == ("a.speed", "b.speed", "c.speed", "d.speed")


def test_a_loop_with_wheels_equals_an_independent_integration(rigid: Craft) -> None:
    """The case is a spinning craft with wheels that saturate; results agree to 1e-8."""
    body = replace(rigid, center_of_mass=(0, 0, 0))
    gain = -np.linalg.pinv(AXES.T) @ np.diag([30.0, 20.0, 25.0])
    start = {"init.omega[1]": 0.03, "init.omega[2]": -0.02, "init.omega[3]": 0.4}
    loop = body.loop(lambda t, y: gain @ y, 0.2, 0, command="wheels", measured="omega",
                     parameters=start)  # fmt: skip
    run = loop.simulate(20, outputs=OMEGA, tolerance=1e-11)
    w, speed = np.array([0.03, -0.02, 0.4]), np.array([w.speed for w in PYRAMID.values()])
    for k in range(100):
        assert run[OMEGA].iloc[k].to_numpy() == pytest.approx(w, abs=1e-8)
        u = np.clip(gain @ w, -0.3, 0.3)
        after = np.clip(speed - u * 0.2 / 0.02, -500, 500)
        h, slope = 0.02 * speed @ AXES, 0.02 * (after - speed) / 0.2 @ AXES

        def rate(t: float, w: np.ndarray, h: np.ndarray = h, d: np.ndarray = slope) -> np.ndarray:
            return np.linalg.solve(INERTIA, -d - np.cross(w, INERTIA @ w + h + d * t))

        w = solve_ivp(rate, (0, 0.2), w, rtol=1e-12, atol=1e-14).y[:, -1]
        speed = after
    assert np.abs(run[["a.torque", "b.torque"]].to_numpy()).max() == 0.3


def test_reviews_and_uncertain_models_accept_wheels(craft: Craft, tmp_path: Path) -> None:
    """Wheels about the body axes give the same margins as torques.

    Wheels and command are unchanged after writing and reading a project file.
    """
    craft = replace(craft, wheels=BODY_WHEELS)
    settings = {"draws": 6, "fills": ["40%", "60%"]}
    plain = craft.review(GAINS, 0.1, **settings)
    there = craft.review(GAINS, 0.1, command="wheels", **settings)
    assert there.points["distance"].to_numpy() == pytest.approx(
        plain.points["distance"].to_numpy(), rel=1e-6
    )
    assert [model.inputs for model in there.family] == [("x.torque", "y.torque", "z.torque")] * 2
    assert "x.torque" in there.html()
    ranges = {"ox.frequency[1]": "20%", "craft.Jxx": "20%"}
    model = craft.uncertain("50%", ranges)
    loops = [craft.loop(GAINS, 0.1, "50%", command=name) for name in ("torque", "wheels")]
    one, other = (model.mu_upper(loop, [0.05, 0.1]) for loop in loops)
    assert other == pytest.approx(one, rel=1e-9)
    project = hubslosh.Project(craft, GAINS, {"period": 0.1, "command": "wheels", **settings})
    with pytest.raises(FmuError, match="wheels"):
        replace(craft, wheels=(0.0, 0.0, 5.0))
    project = replace(project, craft=replace(craft, tanks={}))
    project.save(tmp_path / "design.toml")
    again = hubslosh.Project.read(tmp_path / "design.toml")
    assert again.craft.wheels["y"].max_torque == 0.3
    assert again.loop(0).names[1] == ["x.torque", "y.torque", "z.torque"]


def test_errors_name_the_wrong_wheel_and_the_allowed_values(rigid: Craft, fmu: Path) -> None:
    """Wrong commands and inputs are reported, too."""
    for wheel, what in (
        (Wheel((0, 0, 0), 0.01, 0.2, 400), "axis must not be zero"),
        (Wheel((0, 1), 0.01, 0.2, 400), "axis must be 3 finite numbers"),
        (Wheel((0, 0, 1), 0.0, 0.2, 400), "inertia must be a number above 0, kg·m², not 0.0"),
        (Wheel((0, 0, 1), np.inf, 0.2, 400), "inertia must be"),
        (Wheel((0, 0, 1), 0.01, -1, 400), "max_torque must be a number above 0, N·m, not -1"),
        (Wheel((0, 0, 1), 0.01, 0.2, np.nan), "max_speed must be"),
        (Wheel((0, 0, 1), 0.01, 0.2, 400, -401), "speed must be from -400 to 400 rad/s"),
        (Wheel((0, 0, 1), 0.01, 0.2, 400, "1"), "speed must be a finite number"),
        (7, "wheel z must be a Wheel, not 7"),
    ):
        with pytest.raises(FmuError, match="wheel z") as error:
            replace(rigid, wheels={"z": wheel})
        assert what in str(error.value)
    with pytest.raises(FmuError, match="inertia times speed"):
        replace(rigid, wheels=(1.0, 2.0, 3.0))
    for command, what in (
        ("e.torque", "the command e.torque is not an input"),
        (["wheels", "a.torque"], "the command a.torque is given twice"),
        (["wheels", "h_wheels[1]"], "is set by the reaction wheels"),
    ):
        loop = rigid.loop(lambda t, y: 0.0, 0.1, 0, command=command)
        with pytest.raises(FmuError) as error:
            loop.simulate(1)
        assert what in str(error.value)
    assert rigid.loop(GAINS, 0.1, 0, command="wheels").problems()  # four wheels, three gains
    loop = rigid.loop(lambda t, y: np.zeros(4), 0.1, 0, command="wheels")
    table = pd.DataFrame({"time": [0.0, 1.0], "h_wheels[1]": 0.0})
    with pytest.raises(FmuError, match="which the reaction wheels set"):
        loop.simulate(1, inputs=table)
    with pytest.raises(FmuError, match="which the reaction wheels set"):
        rigid.simulate(0, table.assign(**{"a.torque": 0.1}))
    table = pd.DataFrame({"time": [0.0, 1.0], "a.torque": [0.1, np.nan]})
    with pytest.raises(FmuError, match="not finite in row 1"):
        rigid.simulate(0, table)
    table = pd.DataFrame({"time": [0.0, 1.0], "e.torque": [0.1, 0.0]})
    with pytest.raises(FmuError, match="no inputs of"):
        rigid.simulate(0, table)
    bench = hubslosh.Loop([[4.0, 2.0]], 0.1, fmu, command="z.torque", wheels={"z": PYRAMID["a"]})
    assert "wheels are for Spacecraft" in bench.problems()[0]


def test_a_warning_names_a_wheel_that_stays_at_its_largest_speed(rigid: Craft) -> None:
    """A constant torque of 0.2 N·m turns the wheel from 80 to 100 rad/s in 1 s.

    A wheel that is braked later, or that reaches the limit only at the end, is not reported.
    """
    wheel = Wheel((0, 0, 1), 0.01, 0.2, 100, 80.0)
    body = replace(rigid, wheels={"z": wheel})
    loop = body.loop(lambda t, y: -0.5, 0.25, 0, command="wheels")
    with pytest.warns(FmuWarning) as told:
        run = loop.simulate(5, outputs=[], substeps=2)
    assert len(told) == 1 and Path(told[0].filename) == Path(__file__)
    said = "wheel z stays at its largest speed, 100 rad/s, from 1 s to the end of the run at 5 s"
    assert str(told[0].message).startswith(said)
    assert "unload it with thrusters" in str(told[0].message)
    assert (run["z.speed"][run["time"] >= 1] == 100).all()
    braked = body.loop(lambda t, y: -0.5 if t < 3 else 0.1, 0.25, 0, command="wheels")
    with warnings.catch_warnings():
        warnings.simplefilter("error", FmuWarning)
        braked.simulate(5, outputs=[])
        loop.simulate(1, outputs=[])
