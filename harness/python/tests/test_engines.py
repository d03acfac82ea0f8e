"""Engines: operating points with their resultant force, and momentum from pulses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hubslosh
from hubslosh import Craft, Engine, FmuError, MountedTank

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
GAINS = np.hstack([80 * np.eye(3), 400 * np.eye(3)])
INERTIA = np.array([[900.0, -20.0, 5.0], [-20.0, 850.0, 0.0], [5.0, 0.0, 700.0]])


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft with a tank and a thrust at O that misses its centre of mass."""
    tanks = {"ox": MountedTank(SPHERE, (0.1, 0.5, -0.2), modes=1, nu=3e-7)}
    return Craft(1000.0, INERTIA, (0.1, 0.02, 1.0), tanks, 400.0, gravity=0.3,
                 model=fmu.with_name("Spacecraft.fmu"))  # fmt: skip


def test_engines_with_the_same_resultant_as_thrust_give_the_same_craft(craft: Craft) -> None:
    """Parameters and margins are equal.

    The engine is at O, elsewhere on the line of action of ``thrust``, or split into two engines.
    """
    plain = hubslosh.margins(craft.loop(GAINS, 0.05, "50%")).crossings
    for engines in (
        {"main": Engine((0, 0, 0), (0, 0, 2), 400)},
        {"main": Engine((0, 0, -1.5), (0, 0, 1), 400)},
        {
            "left": Engine((0.3, 0, 0), (0, 0, 1), 200),
            "right": Engine((-0.3, 0, 0), (0, 0, 1), 200),
        },
    ):
        same = replace(craft, thrust=0.0, engines=engines)
        assert same.parameters("50%") == pytest.approx(craft.parameters("50%"), abs=1e-12)
        assert same.trim("50%").shift == pytest.approx(craft.trim("50%").shift, abs=1e-12)
        found = hubslosh.margins(same.loop(GAINS, 0.05, "50%")).crossings
        assert found["phase_margin"].to_numpy() == pytest.approx(
            plain["phase_margin"].to_numpy(), rel=1e-9, nan_ok=True
        )
    # an engine off the axis equals an engine at O with all other parts moved the opposite way
    off_axis = replace(craft, thrust=0.0, engines={"main": Engine((0.2, -0.1, 0), (0, 0, 1), 400)})
    moved = replace(
        craft, center_of_mass=(-0.1, 0.12, 1.0),
        tanks={"ox": replace(craft.tanks["ox"], position=(-0.1, 0.6, -0.2))},
    )  # fmt: skip
    assert off_axis.parameters("50%") == pytest.approx(moved.parameters("50%"), abs=1e-12)
    assert off_axis.trim("50%").untrimmed_acceleration == pytest.approx(
        moved.trim("50%").untrimmed_acceleration, rel=1e-9
    )


def test_canted_engines_leave_a_torque_about_their_line_of_action(craft: Craft) -> None:
    """Four engines canted by 10° accelerate the craft about z by their moment over its inertia."""
    cant, r = np.radians(10), 0.6
    engines = {}
    for k in range(4):
        c, s = np.cos(k * np.pi / 2), np.sin(k * np.pi / 2)
        direction = (-s * np.sin(cant), c * np.sin(cant), np.cos(cant))
        engines[f"e{k}"] = Engine((r * c, r * s, 0), direction, 100)
    rigid = replace(craft, tanks={}, thrust=0.0, engines=engines)
    point = rigid.trim(0)
    moment = 4 * 100 * np.sin(cant) * r
    expected = np.linalg.solve(INERTIA, [0, 0, moment])
    assert point.angular_acceleration == pytest.approx(expected, rel=1e-9)
    assert point.parameters["force[3]"] == pytest.approx(400 * np.cos(cant), rel=1e-12)


def test_pulses_of_any_length_give_the_craft_their_impulse(craft: Craft) -> None:
    """A rigid craft gains the linear and angular momentum of the pulses.

    Angular momentum about the centre of mass is compared with the integral of r × F.
    """
    engines = {
        "a": Engine((0.7, 0.2, 0.4), (0, 0.3, 1), 22.0, burns=False),
        "b": Engine((-0.5, 0.6, 0.1), (1, 0, 0), 10.0, burns=False),
    }
    free = replace(craft, tanks={}, thrust=0.0, engines=engines)
    firing = {"a": [(0.05, 0.062), (0.015, 0.02)], "b": [(0.0171, 0.0533)]}
    table = free.pulses(0, firing, stop=0.5)
    run = free.simulate(0, table, stop=0.5, hold=True, outputs=["omega", "velocity"])
    burnt = {"a": 0.012 + 0.005, "b": 0.0533 - 0.0171}
    total = sum(t * engines[n].wrench(np.array(free.center_of_mass)) for n, t in burnt.items())
    omega = run[[f"omega[{i}]" for i in (1, 2, 3)]].iloc[-1].to_numpy()
    # gyroscopic terms are products of small rates, and are far below the tolerance
    assert omega == pytest.approx(np.linalg.solve(INERTIA, total[3:]), rel=1e-3)
    both = table[["time", "force[1]", "force[3]"]].to_numpy()
    along = 22 / np.sqrt(1.09)
    wanted = [[0, 0, 0], [0.015, 0, along], [0.0171, 10, along], [0.02, 10, 0], [0.05, 10, along],
              [0.0533, 0, along], [0.062, 0, 0], [0.5, 0, 0]]  # fmt: skip
    assert both == pytest.approx(np.array(wanted), abs=1e-12)
    # a main engine that is named in `firing` burns only in its pulses
    main = replace(free, engines={"main": Engine((0.3, 0, 0), (0, 0, 1), 400)})
    off = main.pulses(0, {"main": [(0, 0.25)]}, stop=0.5)
    assert off["force[3]"].tolist() == [400.0, 0.0, 0.0]
    assert off[[f"torque[{i}]" for i in (1, 2, 3)]].abs().to_numpy().max() < 1e-10


def test_errors_name_each_wrong_engine_and_pulse(craft: Craft) -> None:
    """One message lists every wrong engine and pulse, with the allowed values."""
    with pytest.raises(FmuError, match=r"engine a: direction must not be zero; engine a: thrust"):
        replace(craft, engines={"a": Engine((0, 0, 0), (0, 0, 0), -1)})
    with pytest.raises(FmuError, match="engine a must be an Engine, not 5"):
        replace(craft, engines={"a": 5})
    with pytest.raises(FmuError, match="engines must be a dict of Engine by name"):
        replace(craft, engines=[Engine((0, 0, 0), (0, 0, 1), 1)])
    with_roll = replace(craft, engines={"roll": Engine((1, 0, 0), (0, 1, 0), 5, burns=False)})
    for firing, text in {
        "roll": "firing must be pulses by engine",
        ("rol", ((0, 1),)): "did you mean roll",
        ("roll", (0, 1, 2)): "pulses must be",
        ("roll", ((0.2, 0.1),)): "must end after it starts",
        ("roll", ((0.1, 0.3), (0.2, 0.4))): "must not overlap",
        ("roll", ((0.1, 3),)): "between 0 and stop = 1 s",
    }.items():
        given = dict([firing]) if isinstance(firing, tuple) else firing
        with pytest.raises(FmuError, match=text):
            with_roll.pulses("50%", given, stop=1)


def test_a_printed_craft_lists_thrusters_apart_from_the_engines_that_burn(craft: Craft) -> None:
    """The line of the thrust names only the main engine; thrusters are listed in another line."""
    main, side = Engine((0, 0, -1.5), (0, 0, 1), 400), Engine((1, 0, 0), (0, 1, 0), 22, burns=False)
    craft = replace(craft, thrust=0.0, engines={"main": main, "up": side, "down": side})
    lines = str(craft).splitlines()
    assert lines[2:4] == ["thrust (0, 0, 400) N by main", "thrusters that fire in pulses: up, down"]
    assert str(replace(craft, engines={"up": side})).splitlines()[2] == "thrust (0, 0, 0) N"
    assert "thrusters" not in str(replace(craft, engines={"main": main}))
