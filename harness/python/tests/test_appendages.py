"""Flexible appendages of a craft: effect on margins, names of quantities, uncertainty, files."""

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import control
import numpy as np
import pandas as pd
import pytest

import hubslosh
from hubslosh import Appendage, Craft, FmuError, MountedTank, Project

SPHERE = {"density": 1440.0, "shape": {"sphere": {"radius": 0.5}}}
CYLINDER = {"density": 875.0, "shape": {"cylinder": {"radius": 0.4, "height": 1.1}}}
GAINS = np.hstack([80 * np.eye(3), 400 * np.eye(3)])
PERIOD = 0.05
MEASURED = ["q[2]", "q[3]", "q[4]", "omega[1]", "omega[2]", "omega[3]"]
ARRAY = pd.DataFrame({
    "frequency": [0.31, 0.9], "x": [0.0, 3.1], "y": [0.2, -0.1], "z": [5.2, 0.3],
    "rx": [11.0, 0.4], "ry": [0.3, 0.1], "rz": [-0.2, -6.5], "zeta": [0.004, 0.006],
})  # fmt: skip
"""Modes of a solar array of 40 kg: one bends it out of its plane, the other within its plane."""

pytestmark = pytest.mark.filterwarnings("ignore:tank.*outside the measured")


@pytest.fixture
def craft(fmu: Path) -> Craft:
    """Return a craft of two tanks and two arrays; thrust misses its centre of mass by 0.1 m."""
    tanks = {
        "NTO": MountedTank(SPHERE, (0.1, 0.5, -0.2), modes=1, nu=3e-7),
        "MMH": MountedTank(CYLINDER, (0.1, -0.6, -0.4), modes=2, nu=9e-7),
    }
    appendages = {
        "north": Appendage.from_table(ARRAY, (0, 0.9, 0.8)),
        "south": Appendage((0, -0.9, 0.8), 0.33, [0, 0, 5.2, -11.0, 0, 0]),
    }
    return Craft(
        1000.0, (900.0, 850.0, 700.0), (0.1, 0.02, 1.0), tanks, 400.0, appendages=appendages,
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip


def crossed(v: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product with the vector ``v``."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def lagrange(of: dict[str, float], damping: list[float]) -> control.StateSpace:
    """Return the linear model of the craft under thrust, derived by Lagrange's equations.

    The model is from torque to `MEASURED`. Its coordinates are the rotation, the displacements of
    the slosh masses across z, and the modal displacements. ``of`` has the parameters of the FMU,
    whose tanks stand along z; ``damping`` is c/m of each slosh mass, 1/s.
    """

    def vector(name: str, n: int = 3) -> np.ndarray:
        return np.array([float(of.get(f"{name}[{i}]", 0)) for i in range(1, n + 1)])

    def body(m: float, r: np.ndarray, own: np.ndarray) -> np.ndarray:
        arm = crossed(r)
        return np.block([[m * np.eye(3), -m * arm], [m * arm, own - m * arm @ arm]])

    dry = np.array([[of.get(f"craft.J{''.join(sorted(a + b))}", 0) for a in "xyz"] for b in "xyz"])
    rigid = body(of["craft.mass"], vector("craft.r"), dry)
    bobs = []
    for i in range(1, int(of["tanks"]) + 1):
        at, e = vector(f"tank[{i}].position"), np.array([0, 0, 1.0])
        axial = np.diag([of[f"tank[{i}].I_0"]] * 2 + [of.get(f"tank[{i}].I_z", 0)])
        rigid += body(of[f"tank[{i}].m_0"], at + of[f"tank[{i}].H_0"] * e, axial)
        for n in range(1, int(of[f"tank[{i}].modes"]) + 1):
            m, length = of[f"tank[{i}].mass[{n}]"], of[f"tank[{i}].length[{n}]"]
            rho = at + (of[f"tank[{i}].hinge[{n}]"] - length) * e
            rigid += body(m, rho, np.zeros((3, 3)))
            bobs.append((m, length, rho))
    thrust = of["force[3]"]
    a = np.array([0, 0, thrust / rigid[0, 0]])
    modes = []
    for j in range(1, int(of["appendages"]) + 1):
        name = f"appendage[{j}]"
        at, part = vector(f"{name}.position"), vector(f"{name}.participation", 6)
        p, w = part[:3], 2 * np.pi * of[f"{name}.frequency"]
        # modal displacements of the appendages under the steady thrust
        eta = -(p @ a) / w**2
        y = p * eta
        both = crossed(at) @ crossed(y) + crossed(y) @ crossed(at)
        rigid += np.block([[np.zeros((3, 3)), -crossed(y)], [crossed(y), -both]])
        modes.append((np.concatenate([p, part[3:] + np.cross(at, p)]), w, of[f"{name}.zeta"], p))
    n = 6 + 2 * len(bobs) + len(modes)
    mass, stiff, drag = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    mass[:6, :6] = rigid
    k = 6
    for (m, length, rho), c in zip(bobs, damping, strict=True):
        for i in range(2):
            e = np.eye(3)[i]
            mass[:6, k] = mass[k, :6] = m * np.concatenate([e, np.cross(rho, e)])
            mass[k, k], stiff[k, k], drag[k, k] = m, m * a[2] / length, m * c
            stiff[3:6, k] = m * np.cross(e, a)
            k += 1
    for u, w, zeta, p in modes:
        mass[:6, k] = mass[k, :6] = u
        mass[k, k], stiff[k, k], drag[k, k] = 1.0, w * w, 2 * zeta * w
        stiff[3:6, k] = np.cross(p, a)
        k += 1
    inverse = np.linalg.inv(mass)
    # states: half the rotation, rate, then all others and their rates
    r = n - 6
    rates, driven = np.zeros((6 + 2 * r, 6 + 2 * r)), np.zeros((6 + 2 * r, 3))
    accelerated = -inverse @ np.hstack([np.zeros((n, 6)), stiff[:, 6:], drag[:, 6:]])
    rates[:3, 3:6] = np.eye(3) / 2
    rates[3:6] = accelerated[3:6]
    rates[6 : 6 + r, 6 + r :] = np.eye(r)
    rates[6 + r :] = accelerated[6:]
    driven[3:6], driven[6 + r :] = inverse[3:6, 3:6], inverse[6:, 3:6]
    return control.ss(rates, driven, np.eye(6, 6 + 2 * r), np.zeros((6, 3)))


@pytest.mark.parametrize("fill", ["10%", "30%", "50%", "70%", "90%"])
def test_margins_equal_those_of_a_lagrange_model_in_python_control(craft: Craft, fill: str) -> None:
    """All margins agree within 0.02 dB and 0.02°; one loop is opened, and the others are closed."""
    loop = craft.loop(GAINS, PERIOD, fill, delay=2 * PERIOD)
    found = hubslosh.margins(loop)
    point = craft.trim(fill).parameters
    of = {name: float(value) for name, value in point.items() if not isinstance(value, str)}
    g, damping = 400.0 / craft.mass_properties(fill).mass, []
    for i in (1, 2):
        for n in range(1, int(of[f"tank[{i}].modes"]) + 1):
            # in laminar flow zeta is proportional to w^-1/2
            at_ref = np.sqrt(of[f"tank[{i}].g_ref"] / of[f"tank[{i}].length[{n}]"])
            here = np.sqrt(g / of[f"tank[{i}].length[{n}]"])
            damping.append(2 * of[f"tank[{i}].zeta[{n}]"] * np.sqrt(at_ref * here))
    plant = control.sample_system(lagrange(of, damping), PERIOD, "zoh")
    one, none = np.eye(3), np.zeros((3, 3))
    late = control.ss(
        np.block([[none, none], [one, none]]), np.vstack([one, none]), np.hstack([none, one]),
        none, PERIOD,
    )  # fmt: skip
    gain = control.ss([], [], [], GAINS, PERIOD) * plant * late
    compared = 0
    for row in found.crossings.itertuples():
        z = np.exp(2j * np.pi * row.frequency * PERIOD)
        every = gain(z)
        k = loop.names[1].index(row.loop)
        rest = [i for i in range(3) if i != k]
        closed = np.linalg.solve(np.eye(2) + every[np.ix_(rest, rest)], every[rest, k])
        value = every[k, k] - every[k, rest] @ closed
        decibels, degrees = 20 * np.log10(abs(value)), np.degrees(np.angle(-value))
        if row.crossing == "gain":
            assert abs(decibels) < 0.02
            assert degrees == pytest.approx(row.phase_margin, abs=0.02)
        else:
            assert abs(degrees) < 0.02
            assert -decibels == pytest.approx(row.gain_margin, abs=0.02)
        compared += 1
    assert compared >= 6
    without = hubslosh.margins(replace(craft, appendages={}).loop(GAINS, PERIOD, fill, delay=0.1))
    assert abs(found.delay_margin / without.delay_margin - 1) > 1e-3


def test_modes_of_the_free_craft_equal_modes_of_matrices_set_up_by_hand(craft: Craft) -> None:
    """The craft has no tanks; all its frequencies are above those of the fixed appendages."""
    dry = replace(craft, tanks={}, thrust=0.0)
    u = []
    for of in dry.appendages.values():
        for mode in of.modes():
            part = np.array([mode[f"participation[{i}]"] for i in range(1, 7)])
            at = np.array(of.position, float)
            u.append([*part[:3], *(part[3:] + np.cross(at, part[:3]))])
    along, r = np.array(u).T, crossed(np.array(dry.center_of_mass))
    rigid = np.block(
        [[1000 * np.eye(3), -1000 * r], [1000 * r, np.diag(dry.inertia) - 1000 * r @ r]]
    )
    held = np.array([mode["frequency"] for of in dry.appendages.values() for mode in of.modes()])
    reduced = np.eye(3) - along.T @ np.linalg.solve(rigid, along)
    free = np.sqrt(np.linalg.eigvals(np.linalg.solve(reduced, np.diag(held**2))).real)
    found = dry.linearize(0).modes()["frequency"]
    zeta = np.array([0.004, 0.006, 0.005])
    assert (np.sort(free) > np.sort(held)).all()
    # damped frequencies differ from natural ones by zeta^2/2
    assert np.sort(found) == pytest.approx(np.sort(free), rel=float(zeta.max() ** 2))


def test_a_trimmed_craft_rests_with_appendages_deformed_by_the_thrust(craft: Craft) -> None:
    """The arrays keep their displacements, -p.a/ω², and the craft does not turn."""
    point = craft.trim("50%")
    assert np.linalg.norm(point.angular_acceleration) < 1e-12
    g = 400.0 / craft.mass_properties("50%").mass
    want = -5.2 * g / (2 * np.pi * 0.31) ** 2
    assert point.parameters["appendage[1].eta_0"] == pytest.approx(want, rel=1e-12)
    names = [f"appendage[{j}].{kind}" for j in (1, 2, 3) for kind in ("eta", "eta_dot")]
    run = craft.simulate("50%", stop=20, outputs=[*names, "omega"])
    assert np.ptp(run["appendage[1].eta"]) < 1e-9 * abs(want)
    assert run[[f"omega[{i}]" for i in (1, 2, 3)]].abs().to_numpy().max() < 1e-12


def test_quantities_of_appendages_have_one_name_in_every_method(craft: Craft) -> None:
    """Short names and names of the FMU set the same values; a wrong name raises an error."""
    short = craft.parameters("50%", parameters={"south.frequency[1]": 0.4, "north.zeta[2]": 0.01})
    full = {"appendage[3].frequency": 0.4, "appendage[2].zeta": 0.01}
    assert short == craft.parameters("50%", parameters=full)
    assert short["appendage[3].frequency"] == 0.4 and short["appendages"] == 3
    other = craft.parameters("50%", parameters={"north.participation[2,1]": 3.0})
    assert other["appendage[2].participation[1]"] == 3.0
    with pytest.raises(FmuError, match=r"no quantity north\.frequency\[3\].*north\.frequency\["):
        craft.parameters("50%", parameters={"north.frequency[3]": 1.0})
    both = {"north.zeta[1]": 0.01, "appendage[1].zeta": 0.01}
    with pytest.raises(FmuError, match=r"north\.zeta\[1\] are the same quantity"):
        craft.parameters("50%", parameters=both)


def test_an_uncertain_model_is_the_linear_model_of_its_parameters(craft: Craft) -> None:
    """Both models agree to 1e-9 at the ends of ranges of an appendage, a mass and a slosh mode."""
    ranges = {
        "north.frequency[1]": "15%", "south.zeta[1]": (0.0, 0.02), "craft.Jxx": "5%",
        "NTO.frequency[1]": "10%", "acceleration": "4%",
    }  # fmt: skip
    model = craft.uncertain("50%", ranges)
    assert "appendage[1].frequency" in model.deltas
    assert model.delta({"north.frequency[1]": 1.0}).tolist() == [1.0, 0.0, 0.0, 0.0, 0.0]
    f = np.array([0.02, 0.12, 0.28, 0.36, 1.1])
    for delta in ([0.0] * 5, [1.0, -1.0, 1.0, -1.0, 1.0], [-1.0, 1.0, -0.3, 0.7, -1.0]):
        plant = hubslosh.linearize(craft.model, model.parameters(delta), "torque", MEASURED)
        want = plant.response(f)
        size = np.abs(want).max(axis=(1, 2), keepdims=True)
        assert np.abs(model.at(delta).response(f) - want).max() < 1e-9 * size.max()


@pytest.mark.long
def test_a_review_varies_frequencies_of_appendages_and_the_delay(craft: Craft) -> None:
    """The frequencies reach the ends of their range, and a larger range lowers the margins."""
    uncertain = {"north.frequency[1]": "20%", "delay": (0.05, 0.15)}
    review = craft.review(
        GAINS, PERIOD, ["50%"], delay=0.1, damping="nominal", uncertain=uncertain, draws=4
    )
    varied = {of.name for of in review.uncertain}
    assert {"north.frequency[1]", "delay", "frequency of south"} <= varied
    assert len(review.points) > 4
    values = {"north.frequency[1]": (0.25, 0.37), "south.zeta[1]": (0.002, 0.01)}

    def delay_margin(drawn: dict[str, float]) -> dict[str, float]:
        loop = craft.loop(GAINS, PERIOD, "50%", delay=0.1, parameters=drawn)
        return {"delay": hubslosh.margins(loop).delay_margin}

    table = hubslosh.monte_carlo(values, 4, 1, delay_margin)
    assert table["delay"].nunique() == 4


def test_a_project_file_and_an_exported_fmu_have_the_appendages(
    craft: Craft, tmp_path: Path
) -> None:
    """A project is written and read again; the exported FMU has variables for three modes."""
    Project(craft, GAINS, {"period": PERIOD}).save(tmp_path / "project.toml")
    again = Project.read(tmp_path / "project.toml").craft
    assert again.parameters("50%") == craft.parameters("50%")
    files = craft.export(tmp_path / "others", "50%")
    part = hubslosh.Fmu(files["fmu"])
    assert "appendage[3].eta" in part.variables and "appendage[4].eta" not in part.variables
    run = hubslosh.simulate(files["fmu"], stop=1, outputs=["appendage[1].eta"])
    want = craft.simulate("50%", stop=1, outputs=["appendage[1].eta"])
    assert run["appendage[1].eta"].tolist() == want["appendage[1].eta"].tolist()


def test_reduced_matrices_give_the_modes_that_move_the_craft_most() -> None:
    """Modes are sorted by frequency, in any axes; matrices of another form are refused."""
    mass, stiffness = np.zeros((9, 9)), np.zeros((9, 9))
    mass[:6, :6] = np.diag([40.0, 40, 40, 30, 9, 39])
    mass[6:, 6:] = np.eye(3)
    rows = np.array([[0, 0, 0.1, 0, 0, 0], [0, 0, 5, 4, 0, 0], [3.0, 0, 0, 0, 1, 0]])
    mass[6:, :6], mass[:6, 6:] = rows, rows.T
    stiffness[6:, 6:] = np.diag((2 * np.pi * np.array([0.2, 1.4, 0.9])) ** 2)
    turn = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    found = Appendage.from_craig_bampton(
        (mass, stiffness), (0, 0.6, 0), [0.1, 0.02, 0.03], axes=turn, most=2
    )
    assert np.asarray(found.frequency) == pytest.approx([0.9, 1.4], rel=1e-12)
    assert np.asarray(found.zeta).tolist() == [0.03, 0.02]
    want = [[0, -3, 0, 1, 0, 0], [0, 0, 5, 0, -4, 0]]
    assert np.asarray(found.participation) == pytest.approx(np.array(want, float))
    for change, text in [
        (lambda m, k: (m * 2, k), "unit modal mass"),
        (lambda m, k: (m, k + 1e3 * np.eye(9)), "interface must be 0"),
        (lambda m, k: (m, k - k), "above 0"),
        (lambda m, k: (m[:6, :6], k[:6, :6]), "then at least one mode"),
        (lambda m, k: (m + np.triu(m, 1), k), "symmetric"),
    ]:
        with pytest.raises(FmuError, match=text):
            Appendage.from_craig_bampton(change(mass, stiffness), (0, 0, 0))


def test_an_output_4_file_is_read_by_pyyeti(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A substitute module stands for pyyeti; without pyyeti the error says how to install it."""
    mass, stiffness = np.diag([40.0, 40, 40, 30, 9, 39, 1]), np.zeros((7, 7))
    mass[2, 6] = mass[6, 2] = 5.0
    stiffness[6, 6] = 4.0
    matrices = {"mxx": mass, "kxx": stiffness}
    package, nastran = ModuleType("pyyeti"), ModuleType("pyyeti.nastran")
    nastran.op4 = ModuleType("op4")
    nastran.op4.read = lambda name: matrices if name.endswith("boom.op4") else {"a": mass}
    monkeypatch.setitem(sys.modules, "pyyeti", package)
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", nastran)
    found = Appendage.from_craig_bampton(tmp_path / "boom.op4", (0, 0, 1))
    assert found.modes()[0]["participation[3]"] == 5.0
    with pytest.raises(FmuError, match=r"no matrix mxx, kxx; it has a: .*names="):
        Appendage.from_craig_bampton(tmp_path / "other.op4", (0, 0, 1))
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", None)
    with pytest.raises(FmuError, match="pip install pyyeti"):
        Appendage.from_craig_bampton(tmp_path / "boom.op4", (0, 0, 1))


def test_all_errors_of_an_appendage_are_reported_in_one_message() -> None:
    """One message lists wrong names, numbers of modes, shapes and columns of a table."""
    good = Appendage((0, 0, 0), [0.1, 0.2, 0.3, 0.4], np.ones((4, 6)))
    with pytest.raises(FmuError) as error:
        Craft(
            900, [400, 380, 300],
            tanks={"a": MountedTank(SPHERE, (0, 0, 0))},
            appendages={
                "a": good, "appendage[1]": good, "bad": Appendage((0, 0), 0.1, [1, 2], -1),
                "none": 3,
            },
        )  # fmt: skip
    for text in (
        "a is a tank and an appendage", "cannot have the name 'appendage[1]'",
        "appendage bad: position", "appendage bad: zeta", "appendage bad: participation",
        "appendage none must be an Appendage", "8 modes in all (allowed: up to 6)",
    ):  # fmt: skip
        assert text in str(error.value)
    with pytest.raises(FmuError, match="missing: rz, unknown: mass"):
        Appendage.from_table(ARRAY.rename(columns={"rz": "mass"}), (0, 0, 0))


def test_the_acceleration_before_trimming_has_the_rigid_inertia_of_the_craft(fmu: Path) -> None:
    """The deflected array turns with the craft: J α = -c × F, where the array moves c.

    A mode with the displacement η moves the centre of mass by p η/m, and
    η = -(p·a + r·α)/ω² with the acceleration a of the interface point.
    """
    place, at = np.array([0.1, -0.02, 0.3]), np.array([0.0, 0.9, 0.8])
    inertia, thrust, m = np.diag([400.0, 280.0, 300.0]), np.array([0.0, 0.0, 50.0]), 500.0
    p, r = np.array([0.0, 0.0, 5.2]), np.array([11.0, 0.0, 0.0])
    array = Appendage(tuple(at), 0.31, [*p, *r])
    craft = Craft(
        m, np.diag(inertia), tuple(place), {}, tuple(thrust), appendages={"array": array},
        model=fmu.with_name("Spacecraft.fmu"),
    )  # fmt: skip
    eta = 0.0
    for _ in range(100):
        c = place + p * eta / m
        turning = np.linalg.solve(inertia, np.cross(-c, thrust))
        a = thrust / m + np.cross(turning, at - c)
        eta = -(p @ a + r @ turning) / (2 * np.pi * 0.31) ** 2
    point = craft.trim({})
    assert point.untrimmed_acceleration == pytest.approx(turning, rel=1e-2, abs=1e-4)
    assert np.linalg.norm(turning) > 0.01  # the deflection changes the inertia by 1 %
    assert f"{np.linalg.norm(point.untrimmed_acceleration):.4g} rad/s² before" in str(point)
