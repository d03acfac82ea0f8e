"""Slosh modes in three dimensions, compared with closed forms and with two other methods."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import option
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jvp

from hubslosh import FmuError, LiquidModes, linearize, liquid_modes, tank

XI = 1.841183781340659  # first zero of J1'


def lambdas(found: LiquidModes) -> np.ndarray:
    """Return the eigenvalues λ = ω²/g of the modes, 1/m."""
    return (2 * np.pi * found.modes["frequency"].to_numpy()) ** 2 / found.gravity


def error(found: LiquidModes, mode: int = 0) -> float:
    """Return the estimated relative error of the eigenvalue of ``mode``.

    It is twice the estimated error of the frequency.
    """
    return 2 * float(found.error["frequency"][mode])


def line(a: complex, b: complex) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points x + i z, derivatives and quadrature weights of a straight piece of boundary."""
    nodes, weights = np.polynomial.legendre.leggauss(80)
    return a + (b - a) * (nodes + 1) / 2, np.full_like(nodes, b - a, complex), weights / 2


def arc(radius: float, start: float, end: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points x + i z, derivatives and quadrature weights of an arc about the origin.

    ``start`` and ``end`` are angles, rad.
    """
    nodes, weights = np.polynomial.legendre.leggauss(80)
    w = radius * np.exp(1j * (start + (end - start) * (nodes + 1) / 2))
    return w, 1j * (end - start) * w, weights / 2


def ritz(surface: tuple[complex, complex], wall: list[tuple[np.ndarray, ...]]) -> np.ndarray:
    """Return upper bounds of the eigenvalues λ of a plane liquid, by Ritz's method without a mesh.

    Trial functions are Re f and Im f with f = w^k, w = x + i z, k = 1..22. They solve Laplace's
    equation, so that ∫(∇φ)² = ∮ φ ∂φ/∂n ds. By the Cauchy–Riemann equations, ∂/∂n Re f ds = d Im f
    along the boundary counter-clockwise. ``surface`` has both ends of the free surface. ``wall``
    has the pieces of the wall counter-clockwise, from the left end of the surface to its right end.
    """
    size = max(np.abs(w).max() for w, _, _ in wall)

    def trial(piece: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
        w, slope, weights = piece
        k = np.arange(1, 23)[:, None]
        f, d = (w / size) ** k, k * (w / size) ** (k - 1) * slope / size * weights
        return np.vstack([f.real, f.imag]), np.vstack([d.imag, -d.real])

    left, right = surface
    top = line(right, left)
    stiffness = sum(phi @ dn.T for phi, dn in map(trial, [*wall, top]))
    phi, _ = trial(top)
    width, weights = abs(right - left), top[2]
    phi = phi - (phi @ weights)[:, None]  # the mean of a mode over the surface is 0
    mass = width * phi @ np.diag(weights) @ phi.T
    values, vectors = eigh((stiffness + stiffness.T) / 2)
    kept = values > 1e-11 * values.max()
    basis = vectors[:, kept] / np.sqrt(values[kept])
    return 1 / eigh(basis.T @ mass @ basis, eigvals_only=True)[::-1][:4]


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        pytest.param(
            {"cylinder": {"radius": 0.5, "height": 2.0}}, lambda h: h / 2, marks=pytest.mark.long
        ),
        pytest.param(
            {"horizontal_cylinder": {"radius": 0.5, "length": 1.5}},
            lambda h: (np.arccos(1 - 2 * h) - 2 * (1 - 2 * h) * np.sqrt(h - h * h)) / np.pi,
            marks=pytest.mark.long,
        ),
        ({"sphere": {"radius": 0.5}}, lambda h: h * h * (3 - 2 * h)),
    ],
)
def test_a_fill_in_per_cent_gives_the_height_with_this_volume(
    shape: dict, volume: Callable[[float], float]
) -> None:
    """The volume below the computed height follows from a closed form."""
    found = liquid_modes(shape, "40%", modes=1, resolution=10)
    # curved elements of a sixth of the diameter represent a volume to 1e-4
    assert volume(found.surface) == pytest.approx(0.4, abs=1e-4)


@pytest.mark.long
def test_modes_of_an_upright_cylinder_equal_closed_forms() -> None:
    """Frequency, slosh mass and its height, wave height and inertia agree to 1e-4.

    This accuracy is required of the default mesh; finer meshes are more accurate.
    """
    r, h, rho = 0.5, 0.6, 900.0
    found = liquid_modes({"cylinder": {"radius": r, "height": 2}}, h, density=rho, modes=2)
    k, mass = XI / r, rho * np.pi * r**2 * h
    assert found.mass == pytest.approx(mass, rel=3e-5)
    assert found.modes["direction"].to_numpy() == pytest.approx([0, 90], abs=1e-2)
    m = mass * 2 * r * np.tanh(k * h) / (XI * (XI**2 - 1) * h)
    for n in (0, 1):
        mode = found.modes.iloc[n]
        assert mode["length"] == pytest.approx(1 / (k * np.tanh(k * h)), rel=1e-4)
        assert mode["mass"] == pytest.approx(m, rel=1e-4)
        assert mode["bob"] == pytest.approx(h - 2 / k * np.tanh(k * h / 2), rel=1e-4)
        assert mode["wave"] == pytest.approx(2 * r / (XI**2 - 1), rel=3e-4)
        assert abs(mode["arm"]) < 1e-5 and mode["twist"] < 1e-7 * mass
    assert found.rest["m_0_x"] == pytest.approx(mass - m, rel=1e-4)
    # inertia of liquid under a rigid lid: about its centre by a series of NASA SP-106, about the
    # axis 0
    between = [1.0 + np.pi * i for i in range(40)]
    xi = np.array([brentq(lambda x: jvp(1, x), low, low + 2) for low in between])
    series = np.sum(np.tanh(xi * h / (2 * r)) / (xi**3 * (xi**2 - 1)))
    inertia = mass * (h**2 / 12 - 3 * r**2 / 4 + 16 * r**3 / h * series) + mass * (h / 2) ** 2
    assert found.lid_inertia[0, 0] == pytest.approx(inertia, rel=2e-3)
    assert abs(found.lid_inertia[2, 2]) < 1e-6 * inertia


def test_modes_of_a_sphere_equal_those_of_the_axisymmetric_solver(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The axisymmetric solver is `tank`, which discretises the contour; its error is 1e-9."""
    monkeypatch.setenv("HUBSLOSH", str(option(request, "--hubslosh")))
    flat = tank({"density": 1000.0, "shape": {"sphere": {"radius": 1.0}}}, 0.8, modes=1)
    found = liquid_modes({"sphere": {"radius": 1}}, 0.8, modes=1, resolution=18)
    for name, bound in (("frequency", 1e-4), ("mass", 1e-4), ("wave", 3e-4)):
        assert found.modes[name][0] == pytest.approx(flat.modes[name][0], rel=bound), name
    # the hinge of every mode is the centre of the sphere
    assert found.modes["hinge"][0] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.long
def test_a_half_full_horizontal_cylinder_has_lamb_s_mode_with_its_hinge_on_the_axis() -> None:
    """Lamb, Hydrodynamics, art. 259, gives λR = 1.3557 for the mode across the axis.

    Ritz's method gives two more digits.
    """
    found = liquid_modes({"horizontal_cylinder": {"radius": 1, "length": 1}}, 1.0, modes=3,
                         resolution=12)  # fmt: skip
    across = found.modes[np.abs(found.modes["direction"]) > 89].iloc[0]
    [first, *_] = ritz((-1, 1), [arc(1, np.pi, 2 * np.pi)])
    assert first == pytest.approx(1.35573, abs=2e-5)
    assert 1 / across["length"] == pytest.approx(first, rel=1e-4)
    # all normals of the wall meet on the axis, so that the hinge is there
    assert across["hinge"] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("inner", "angle"), [(0.0, 90.0), pytest.param(0.4, 60.0, marks=pytest.mark.long)]
)
def test_upright_sectors_have_the_modes_of_bessel_s_functions(inner: float, angle: float) -> None:
    """λ = k tanh(k h) with cos(m θ) around the sector, where m = n π/α for the opening angle α.

    k follows from the zeros of the Bessel function's derivative J'm or, in a ring, of the cross
    product.
    """
    from scipy.special import yvp

    h, alpha = 0.7, np.radians(angle)
    expected = []
    for n in range(3):
        m = n * np.pi / alpha

        def slope(k: float, m: float = m) -> float:
            if inner == 0:
                return float(jvp(m, k))
            return float(jvp(m, k * inner) * yvp(m, k) - yvp(m, k * inner) * jvp(m, k))

        k = np.linspace(0.3, 9, 3000)
        values = np.array([slope(x) for x in k])
        changes = np.flatnonzero(values[1:] * values[:-1] < 0)
        roots = [brentq(slope, k[i], k[i + 1]) for i in changes]
        expected += [root * np.tanh(root * h) for root in roots]
    size = {"inner_radius": inner, "radius": 1, "angle": angle, "height": 1}
    found = liquid_modes({"sector": size}, h, modes=2, resolution=12)
    assert lambdas(found) == pytest.approx(sorted(expected)[:2], rel=2e-4)
    # the slosh mass moves along y at a distance from the axis, so that rotation also excites it
    assert abs(found.modes["direction"][0]) == pytest.approx(90, abs=0.1)
    assert abs(found.modes["arm"][0]) > 0.5


@pytest.mark.long
def test_the_inertia_of_liquid_in_a_box_about_the_vertical_equals_lamb_s_series() -> None:
    """For a square box, Lamb's series gives 0.1565 of the inertia of a solid."""
    found = liquid_modes(
        {"box": {"length": 0.4, "width": 0.4, "height": 1}}, "30%", modes=2, resolution=12
    )
    rigid = found.mass * (0.4**2 + 0.4**2) / 12
    assert found.lid_inertia[2, 2] / rigid == pytest.approx(0.1565, abs=5e-4)
    k = np.pi / 0.4
    assert lambdas(found) == pytest.approx(2 * [k * np.tanh(k * 0.3)], rel=1e-4)
    table = found.table("x")
    assert table["slosh.table.length[1]"] == pytest.approx(1 / lambdas(found)[0], rel=1e-4)
    assert table["tank.I_own"] == pytest.approx(0.1565 * rigid, rel=4e-3)


@pytest.mark.parametrize(
    ("shape", "fill"),
    [
        ({"horizontal_cylinder": {"radius": 0.5, "length": 1.6}}, "40%"),
        pytest.param(
            {"sector": {"inner_radius": 0.3, "radius": 1, "angle": 70, "height": 1}},
            0.5,
            marks=pytest.mark.long,
        ),
    ],
)
def test_spacecraft_has_slosh_modes_along_both_axes_and_their_moments_about_a_pivot(
    fmu: Path, shape: dict, fill: float | str
) -> None:
    """The craft is on a pivot that turns only about a vertical, at a distance from the liquid.

    Let ψ be the angle of the pivot, Lzz the inertia of the liquid about the vertical through the
    pivot, and a_n the arm of slosh mass n about it. Potential flow gives
    (J + Lzz) ψ'' + Σ m_n a_n η_n'' = 0 and η_n'' + ω_n² η_n + a_n ψ'' = 0.
    """
    found = liquid_modes(shape, fill, modes=8, resolution=8)
    values = found.parameters(2)
    alone = {name.replace("tank[2]", "tank"): value for name, value in values.items()}
    assert found.parameters(model="SloshTank") == alone
    with pytest.raises(FmuError, match="must be Spacecraft or SloshTank, not 'HubSlosh'"):
        found.parameters(model="HubSlosh")
    shift, count = np.array([0.4, 0.7, 0.2]), values["tank[2].modes"]
    assert count == 3
    with pytest.raises(FmuError, match="modes must be 1 to 3"):
        found.parameters(modes=4)
    values = found.parameters(position=shift)
    own, heavy = 0.3 * found.mass, 1e9 * found.mass
    craft = {
        "mount": "pivot", "tanks": 1, "craft.mass": 1.0, "craft.r[3]": 0.0, "craft.Jxx": heavy,
        "craft.Jyy": heavy, "craft.Jzz": own, "gravity[3]": -found.gravity,
    }  # fmt: skip
    model = linearize(fmu.with_name("Spacecraft.fmu"), craft | values, all_states=True)
    kept = found.modes.sort_values("mass", ascending=False).head(count)
    turn = np.radians(kept["direction"])
    arms = kept["arm"] + shift[0] * np.sin(turn) - shift[1] * np.cos(turn)
    mass, omega = kept["mass"].to_numpy(), 2 * np.pi * kept["frequency"].to_numpy()
    center = np.array(found.center[:2])
    level = found.mass * (((center + shift[:2]) ** 2).sum() - (center**2).sum())
    inertia = np.diag([own + found.lid_inertia[2, 2] + level, *mass])
    inertia[0, 1:] = inertia[1:, 0] = mass * arms
    expected = np.sqrt(eigh(np.diag([0.0, *mass * omega**2]), inertia, eigvals_only=True)[1:])
    poles = np.abs(model.poles.imag)
    for w in expected:
        assert np.abs(poles / w - 1).min() < 1e-6
    # the arms change every frequency relative to a fixed pivot
    assert np.abs(np.sort(omega) / expected - 1).max() > 0.02
    # rigid liquid and slosh masses at rest together have the mass and the centre of the liquid
    get = lambda name, n: float(values[f"tank[1].{name}[{n}]"])  # noqa: E731
    m = np.array([get("mass", n) for n in range(1, count + 1)] + [values["tank[1].m_0"]])
    z = [get("hinge", n) - get("length", n) for n in range(1, count + 1)]
    assert m.sum() == pytest.approx(found.mass, rel=1e-12)
    assert m @ [*z, values["tank[1].H_0"]] == pytest.approx(found.mass * found.center[2], rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("degrees", [10.0, 40.0])
def test_modes_of_a_tilted_box_equal_the_plane_problem_of_its_section(degrees: float) -> None:
    """Modes that do not vary across the box are compared with Ritz's method for the section."""
    a, depth, t = 0.4, 0.5, np.radians(degrees)
    force = 9.81 * np.array([np.sin(t), 0, np.cos(t)])
    size = {"length": a, "width": 0.2, "height": 2}
    found = liquid_modes({"box": size}, "25%", modes=1, specific_force=force, resolution=10)
    # walls x = ±a/2, floor z = 0, surface through (0, depth), normal to the specific force
    up = np.exp(1j * t)  # turns the tank's axes so that the specific force points along z
    low, high = depth - a / 2 * -np.tan(t), depth - a / 2 * np.tan(t)
    corners = [complex(-a / 2, low), complex(-a / 2, 0), complex(a / 2, 0), complex(a / 2, high)]
    turned = [(c - 1j * depth) * up for c in corners]
    assert abs(turned[0].imag) < 1e-12 and abs(turned[3].imag) < 1e-12
    wall = [line(p, q) for p, q in pairwise(turned)]
    [first, *_] = ritz((turned[0], turned[3]), wall)
    assert lambdas(found)[0] == pytest.approx(first, rel=5e-4)
    assert abs(found.modes["direction"][0]) < 0.1


@pytest.mark.long
def test_small_tilts_change_frequencies_by_their_square() -> None:
    """By symmetry the first order in the tilt is 0, so that 8° change four times as much as 4°."""

    def frequency(degrees: float) -> float:
        t = np.radians(degrees)
        size = {"cylinder": {"radius": 0.1, "height": 1}}
        force = [np.sin(t), 0, np.cos(t)]
        found = liquid_modes(size, "20%", modes=1, specific_force=force, resolution=12)
        return float(found.modes["frequency"][0])

    upright, small, twice = (frequency(degrees) for degrees in (0, 4, 8))
    assert small < upright
    # at 8° the fourth order is 5 % of the second order, 5e-3; the errors of the meshes are 1e-5
    assert (upright - twice) / (upright - small) == pytest.approx(4, rel=0.1)


@pytest.mark.long
def test_frequencies_of_a_tilted_cylinder_equal_perturbation_theory() -> None:
    """At h/R = 1 the frequencies agree to second order in the tilt.

    The error of the meshes is 4e-4 of λ; its change between upright and tilted is 1e-4, and the
    fourth order in the tilt is smaller.
    """
    slope = 0.15
    t = np.arctan(slope)
    depth = np.cos(t) + np.sin(t)  # above the lowest point of the floor
    found = liquid_modes(
        {"cylinder": {"radius": 1, "height": 4}}, depth, modes=2, resolution=12,
        specific_force=9.81 * np.array([np.sin(t), 0, np.cos(t)]),
    )  # fmt: skip
    along, across = lambdas(found) / np.cos(t) / (XI * np.tanh(XI)) - 1
    assert abs(found.modes["direction"][0]) < 0.1
    assert along == pytest.approx(-0.42679 * slope**2, abs=3e-4)
    assert across == pytest.approx(0.23149 * slope**2, abs=3e-4)


@pytest.mark.long
def test_a_box_from_a_step_file_equals_the_box_given_by_dimensions(tmp_path: Path) -> None:
    """Frequency and slosh mass agree within the errors of the meshes."""
    import gmsh

    file = tmp_path / "tank.step"
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.model.occ.addBox(-0.2, -0.15, 0, 0.4, 0.3, 1)
    gmsh.model.occ.synchronize()
    gmsh.write(str(file))
    gmsh.finalize()
    drawn = liquid_modes({"step": file}, "50%", modes=1, resolution=6)
    size = {"length": 0.4, "width": 0.3, "height": 1}
    plain = liquid_modes({"box": size}, "50%", modes=1, resolution=6)
    # the two boxes have different meshes, each with its own error
    assert drawn.modes["frequency"][0] == pytest.approx(plain.modes["frequency"][0], rel=1e-3)


@pytest.mark.long
def test_the_estimated_error_exceeds_the_true_error() -> None:
    """The estimate is the difference of two meshes; the result is from the finer mesh."""
    k = np.pi / 0.4
    size = {"length": 0.4, "width": 0.3, "height": 1}
    for resolution in (6, 9):
        found = liquid_modes({"box": size}, 0.3, modes=1, resolution=resolution)
        assert abs(lambdas(found)[0] / (k * np.tanh(k * 0.3)) - 1) < error(found)


@pytest.mark.parametrize(
    ("shape", "fill", "words"),
    [
        ({"pear": {}}, 0.1, "shape must be one of cylinder, horizontal_cylinder"),
        ({"sphere": {"radius": -1}}, 0.1, "radius of the sphere must be positive, not -1.0"),
        ({"sphere": {"diameter": 1}}, 0.1, "sphere expects radius"),
        ({"sphere": {"radius": 1}}, 2.5, "between 0 and 2 m"),
        ({"sphere": {"radius": 1}}, "120%", "between 0% and 100%"),
        ({"step": "nowhere.step"}, 0.1, "nowhere.step: no such file"),
    ],
)
def test_invalid_tanks_are_refused_in_words(shape: dict, fill: float, words: str) -> None:
    """Each message says what is allowed."""
    with pytest.raises(FmuError, match=words):
        liquid_modes(shape, fill)
