"""Crossings and margins of loops, compared with known values to 1e-6."""

from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.linalg import eigvals
from scipy.optimize import brentq

from hubslosh import Craft, FmuError, LinearModel, Loop, margins
from hubslosh.stability import _broken_at, _closed, minimal

EXACT = 1e-6
"""Tolerance of the tests; the actual errors are smaller by orders of magnitude."""

S = control.tf("s")
TURN = 2 * np.pi


def crossings(found, kind: str) -> np.ndarray:
    """Return the frequencies, rad/s, at which |L| = 1 ("gain") or the phase is ±180° ("phase")."""
    table = found.crossings
    return table.loc[table["crossing"] == kind, "frequency"].to_numpy() * TURN


def test_margins_of_three_lags_equal_the_closed_form() -> None:
    """L = 10/(s + 1)³ has |L| = 1 at sqrt(10^(2/3) - 1) rad/s, and L = -10/8 at sqrt(3) rad/s."""
    found = margins(10 / (S + 1) ** 3)
    gain, phase = np.sqrt(10 ** (2 / 3) - 1), np.sqrt(3)
    assert crossings(found, "gain") == pytest.approx([gain], rel=EXACT)
    assert crossings(found, "phase") == pytest.approx([phase], rel=EXACT)
    assert not found.stable and found.delay_margin == 0
    assert found.gain_margins == pytest.approx((-20 * np.log10(10 / 8), np.inf), rel=EXACT)
    assert found.phase_margin == pytest.approx(180 - 3 * np.degrees(np.arctan(gain)), rel=EXACT)


def test_margins_of_an_integrator_with_two_lags_equal_the_closed_form() -> None:
    """L = 3/(s (s + 1) (s + 2)) is -3/6 at sqrt(2) rad/s; a gain of 6 is the limit (Routh)."""
    found = margins(3 / (S * (S + 1) * (S + 2)))
    assert crossings(found, "phase") == pytest.approx([np.sqrt(2)], rel=EXACT)
    assert found.gain_margins[1] == pytest.approx(20 * np.log10(2), rel=EXACT)
    # |L| = 1: w² (w² + 1) (w² + 4) = 9
    square = np.roots([1, 5, 4, -9])
    w = np.sqrt(square[square.real > 0].real[0])
    assert crossings(found, "gain") == pytest.approx([w], rel=EXACT)
    assert found.stable
    # the delay margin is the delay that uses up the phase margin
    assert found.delay_margin == pytest.approx(np.radians(found.phase_margin) / w, rel=EXACT)


@pytest.mark.parametrize("half", [0.05, 1e-4])
def test_crossings_at_a_narrow_slosh_dipole_are_found(half: float) -> None:
    """All three gain crossings next to a narrow pair of pole and zero are found.

    k, a and b are chosen so that the loop gain k (s² + a²)/(s (s² + b²)) has the magnitude 1 at
    2.5 - half, 2.5 and 2.5 + half rad/s. The narrower dipole is 1e-8 rad/s wide, so that no
    frequency grid would show it. The frequencies are roots of w³ - k w² - b² w + k a² = 0, where
    the middle frequency is minus a root.
    """
    r1, r2, r3 = 2.5 - half, 2.5 + half, 2.5
    k, b2 = r1 + r2 - r3, r3 * (r1 + r2) - r1 * r2
    a2 = r1 * r2 * r3 / k
    found = margins(k * (S**2 + a2) / (S * (S**2 + b2)))
    assert crossings(found, "gain") == pytest.approx([r1, r3, r2], rel=1e-10)
    assert found.crossings["phase_margin"].to_numpy() == pytest.approx([90, -90, 90], abs=EXACT)
    assert len(found.modes) == 1 and (found.crossings["near"] != "").all()


@pytest.mark.parametrize("late", [0, 2])
def test_margins_of_a_sampled_integrator_equal_the_closed_form(late: int) -> None:
    """L = 1.5 T/(z^late (z - 1)) has |L| = 1 where 2 sin(w T/2) = 1.5 T.

    Its phase is -90° - (late + 1/2) wT. At half the sampling rate it is real: -0.75 T for an even
    number of cycles.
    """
    T = 0.1
    L = control.tf([1.5 * T], [1, -1, *[0] * late], T)
    found = margins(L)
    w = 2 * np.arcsin(1.5 * T / 2) / T
    assert crossings(found, "gain") == pytest.approx([w], rel=EXACT)
    phase = 90 - np.degrees((late + 0.5) * w * T)
    assert found.phase_margin == pytest.approx(phase, rel=EXACT)
    turns = [np.pi / 2 / (late + 0.5) / T] if late else []
    assert crossings(found, "phase") == pytest.approx([*turns, np.pi / T], rel=EXACT)
    last = found.crossings.iloc[-1]
    assert last["gain_margin"] == pytest.approx(-20 * np.log10(0.75 * T), rel=EXACT)
    assert found.stable


def test_a_conditionally_stable_loop_has_a_gain_margin_downwards() -> None:
    """The loop k (s + 1)²/s³ is stable for k > 1/2 (Routh); at w = 1 it is -2k."""
    found = margins(3 * (S + 1) ** 2 / S**3)
    assert crossings(found, "phase") == pytest.approx([1], rel=EXACT)
    assert found.gain_margins == pytest.approx((-20 * np.log10(6), np.inf), rel=EXACT)
    assert found.stable
    assert not margins(0.49 * (S + 1) ** 2 / S**3).stable


def test_each_of_two_loops_is_broken_with_the_other_closed() -> None:
    """The first case is triangular, L = [[a/s, 0], [c/s, b/s]]: crossings are those of a/s and b/s.

    In the second case, d/s replaces 0, so that the first loop gain with the second loop closed is
    a/s - d/s · c/s / (1 + b/s) = (a s + a b - c d)/(s (s + b)).
    """
    a, b, c, d = 2.0, 5.0, 3.0, 1.5
    none = np.zeros((2, 2))

    def loop(d: float) -> LinearModel:
        return LinearModel(
            none, np.eye(2), np.array([[a, d], [c, b]]), none, ("x", "y"), ("u", "v"), ("u", "v")
        )

    table = margins(loop(0.0)).crossings
    assert table["loop"].tolist() == ["u", "v"]
    assert table["frequency"].to_numpy() * TURN == pytest.approx([a, b], rel=EXACT)
    first = margins(loop(d)).crossings.query("loop == 'u'")["frequency"].iloc[0] * TURN
    alone = margins((a * S + a * b - c * d) / (S * (S + b)))
    assert first == pytest.approx(crossings(alone, "gain")[0], rel=EXACT)


def test_the_modulus_margin_is_the_least_distance_to_minus_one() -> None:
    """The modulus margin of 1/(s (s + 1)) equals the least distance to -1 on a fine grid."""
    w = np.linspace(0.5, 3, 250_001)
    least = np.abs(1 + 1 / (1j * w * (1j * w + 1))).min()
    assert margins(1 / (S * (S + 1))).modulus_margin == pytest.approx(least, rel=1e-8)


def test_a_loop_gain_without_states_has_no_crossings() -> None:
    """The constant gain 0.5 never has magnitude 1; its distance to -1 is 1.5."""
    none = np.zeros((0, 0))
    half = LinearModel(
        none, np.zeros((0, 1)), np.zeros((1, 0)), np.full((1, 1), 0.5), (), ("u",), ("y",)
    )
    found = margins(half)
    assert not len(found.crossings) and found.stable
    assert found.modulus_margin == 1.5


def test_printed_margins_of_a_loop_without_crossings_say_so() -> None:
    """The magnitude of 1/(2 (s + 1)) is below 1 at all frequencies.

    Its distance to -1 has the limit 1, its smallest value, at infinite frequency. The second case
    is a gain of 0.
    """
    for gain in (0.5, 0.0):
        found = margins(control.tf([gain], [1, 1]))
        assert found.stable and not len(found.crossings) and found.delay_margin == np.inf
        assert found.modulus_margin == pytest.approx(1, abs=1e-3)
        assert "phase margin none" in str(found) and "no crossings" in str(found)


def test_loops_that_cannot_be_closed_are_refused() -> None:
    """A feedthrough of -1 makes I + D singular; a loop gain that is not square cannot be closed."""
    one, none = np.eye(1), np.zeros((1, 1))
    with pytest.raises(FmuError, match="I \\+ D is singular"):
        margins(LinearModel(-one, one, one, -one, ("x",), ("u",), ("y",)))
    with pytest.raises(FmuError, match="as many inputs as outputs"):
        margins(LinearModel(-one, np.ones((1, 2)), one, np.zeros((1, 2)), ("x",), ("u",), ("y",)))
    assert (
        margins(LinearModel(none - 1, one, one, none, ("x",), ("u",), ("y",))).delay_margin
        == np.inf
    )


def by_pencils(gain: LinearModel) -> list[tuple[str, float]]:
    """Return kind and frequency (rad/s) of the crossings of one loop, by generalised eigenvalues.

    Crossings are the roots of 1 - L(s) L(-s) and of L(s) - L(-s), with 1/z in place of -s in
    discrete time. Because rounding errors move these roots, they and a grid that is finer near the
    poles only separate the crossings; each crossing is found by its change of sign.
    """
    A, B, C, D = gain
    n, T = len(A), gain.period
    one, none, column = np.eye(n), np.zeros((n, n)), np.zeros((n, 1))
    row, zero, unit = column.T, np.zeros((1, 1)), np.ones((1, 1))
    last = [[C, row, D, -unit], [row, C, -unit, D]]
    if T is None:
        pencils = {
            "gain": ([[A, none, B, column], [none, -A, column, -B], *last],
                     np.diag([1.0] * (2 * n) + [0.0, 0.0])),
            "phase": ([[A, none, B], [none, -A, -B], [C, -C, zero]],
                      np.diag([1.0] * (2 * n) + [0.0])),
        }  # fmt: skip
    else:
        late = [[one, none, column, column], [none, A, column, B], [np.zeros((2, 2 * n + 2))]]
        pencils = {
            "gain": ([[A, none, B, column], [none, one, column, column], *last], np.block(late)),
            "phase": (
                [[A, none, B], [none, one, column], [C, -C, zero]],
                np.block([[one, none, column], [none, A, B], [np.zeros((1, 2 * n + 1))]]),
            ),
        }

    def places(values: np.ndarray) -> np.ndarray:
        values = values[np.isfinite(values) & (values != 0)]
        found = np.abs(values.imag) if T is None else np.abs(np.angle(values)) / T
        return found[found > 0]

    def at(w: float) -> complex:
        return complex(gain.response(w / TURN)[0, 0, 0])

    found = []
    for kind, (M, E) in pencils.items():
        with np.errstate(all="ignore"):
            nodes = [places(eigvals(np.block(M), E)), np.geomspace(1e-3, 300 if T is None else
                     (1 - 1e-7) * np.pi / T, 400)]  # fmt: skip
        for pole in filter(abs, (*np.linalg.eigvals(A), *_closed(gain))):
            root = pole if T is None else np.log(complex(pole)) / T
            about = abs(np.real(root)) * np.array([0, 0.3, 1, 3, 10, 30])
            nodes.append(abs(np.imag(root)) + np.concatenate([-about, about]))
        every = np.unique(np.concatenate(nodes))
        every = every[(every >= nodes[1][0]) & (every <= nodes[1][-1])]
        points = (every[1:] + every[:-1]) / 2

        def sign(w: float, kind: str = kind) -> float:
            value = at(w)
            return np.log(abs(value)) if kind == "gain" else value.imag / abs(value)

        heights = np.array([sign(w) for w in points])
        for k in np.flatnonzero((heights[1:] > 0) != (heights[:-1] > 0)):
            w = brentq(sign, points[k], points[k + 1], xtol=1e-300, rtol=1e-14)
            if abs(sign(w)) < 1e-6 and (kind == "gain" or at(w).real < 0):
                found.append((kind, w))
    return sorted(found, key=lambda crossing: crossing[1])


@pytest.mark.parametrize("seed", range(24))
def test_crossings_of_random_loops_equal_those_from_matrix_pencils(seed: int) -> None:
    """A slower method, eigenvalues of matrix pencils, finds the same crossings to 1e-9.

    Random cases have one to three loops, lightly and heavily damped modes, integrators and delays.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 4))
    blocks = [np.zeros((1, 1))] * int(random.integers(0, 2))
    for _ in range(random.integers(2, 8)):
        w, zeta = 10 ** random.uniform(-1, 1.2), 10 ** random.uniform(-4, 0)
        light = random.random() < 0.7
        blocks.append(np.array([[0, 1], [-w * w, -2 * zeta * w]]) if light else np.array([[-w]]))
    n = sum(len(block) for block in blocks)
    A, k = np.zeros((n, n)), 0
    for block in blocks:
        A[k : k + len(block), k : k + len(block)] = block
        k += len(block)
    B, C = random.standard_normal((n, count)), random.standard_normal((count, n))
    D = random.choice([0.0, 0.3]) * random.standard_normal((count, count))
    names = tuple(f"u{i}" for i in range(count))
    C *= 10 ** random.uniform(-2, 0.5)
    gain = LinearModel(A, B, C, D, tuple(f"x{i}" for i in range(n)), names, names)
    if random.random() < 0.6:
        gain = gain.sampled(0.1, int(random.integers(0, 3)))
    found = margins(gain)
    table = found.crossings
    table = table[(table["frequency"] > 1e-3 / TURN) & (table["frequency"] < 300 / TURN)]
    if gain.period:  # at half the sampling rate the loop gain is always real
        table = table[table["frequency"] < (1 - 1e-7) / 2 / gain.period]
    for i, name in enumerate(names):
        mine = table[table["loop"] == name]
        expected = by_pencils(_broken_at(gain, i))
        assert mine["crossing"].to_list() == [kind for kind, _ in expected]
        assert mine["frequency"].to_numpy() * TURN == pytest.approx(
            [w for _, w in expected], rel=1e-9
        )
    # the modulus margin is at most the smallest distance on any grid
    w = np.geomspace(1e-3, 3 if gain.period is None else 31, 4000)
    for i in range(count):
        distance = np.abs(1 + _broken_at(gain, i).response(w / TURN)[:, 0, 0])
        assert found.modulus_margin <= distance.min() + 1e-12


def test_the_delay_margin_puts_a_pole_on_the_unit_circle(fmu: Path) -> None:
    """A craft with two tanks and control about three axes is the case.

    It is stable with each delay of a multiple of a quarter cycle below the margin, and unstable
    just above the margin.
    """
    craft = {"tanks": 2, "force[3]": 400.0, "tank[2].position[2]": 0.7, "craft.Jxy": 30.0}
    model = fmu.with_name("Spacecraft.fmu")
    gains = np.hstack([np.diag([80.0, 70.0, 60.0]), np.diag([500.0, 450.0, 400.0])])
    measured = ["q[2]", "q[3]", "q[4]", "omega"]
    for period, delay in ((0.1, 0.0), (0.5, 0.33), (1.0, 1.0)):
        loop = Loop(gains, period, model, craft, measured, "torque", delay=delay)
        found = margins(loop)
        assert found.stable and 0 < found.delay_margin < 20
        small, controller = minimal(loop.plant()), loop.linear()

        def largest(more: float) -> float:
            return np.abs(_closed(loop._gain(small, controller, more))).max()  # noqa: B023

        before = np.arange(0, found.delay_margin, period / 4)
        assert all(largest(more) < 1 for more in before)
        assert (
            largest(found.delay_margin * (1 - 1e-7)) < 1 < largest(found.delay_margin * (1 + 1e-7))
        )
        late = margins(replace(loop, delay=delay + found.delay_margin / 2))
        assert late.delay_margin == pytest.approx(found.delay_margin / 2, rel=1e-9)


def test_a_loop_gain_that_is_only_rounding_has_no_crossing(fmu: Path) -> None:
    """A filter by Tustin's rule is 0 at half the sampling rate, except for rounding errors."""
    lag = control.ss(1 / (S / 3 + 1) ** 2)
    found = margins(Loop(5 * lag, 0.1, fmu, {"friction.model": "viscous"}, "theta"))
    assert found.crossings["gain_margin"].dropna().abs().max() < 200


def test_a_pole_that_the_controller_does_not_move_is_neutral(fmu: Path) -> None:
    """A rate controller has no effect on the attitude, which has one neutral pole for each axis.

    A controller without gain about z leaves two neutral poles. They belong to a chain of two
    integrators, whose poles rounding errors move by the root of ε.
    """
    model = fmu.with_name("Spacecraft.fmu")
    craft = Craft(900, (400, 380, 300), model=model)
    attitude = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
    cases = [
        (attitude * np.repeat([0, 1], 3), 3),
        (attitude * [[1], [1], [0]], 2),
        (attitude * [[1], [0], [0]], 4),
        (attitude, 0),
    ]
    for gains, count in cases:
        found = margins(craft.loop(gains, 0.1, {}, delay=0.15))
        assert found.stable and len(found.neutral) == count
        assert np.abs(found.neutral - 1) == pytest.approx(0, abs=1e-6)
        assert ("neutral" in str(found)) == (count > 0)
        wrong = margins(craft.loop(-gains, 0.1, {}, delay=0.15))
        assert not wrong.stable and len(wrong.neutral) == count
    # poles that feedback moves to the limit of stability, or that grow slowly, are not neutral
    assert not margins(1 / S**2).stable and not len(margins(1 / S**2).neutral)
    slow = margins(-1e-9 / S)
    assert not slow.stable and not len(slow.neutral)


def test_undamped_oscillations_without_feedback_are_neutral() -> None:
    """The system has an undamped mode that the input does not excite, and a decaying pole."""
    A = np.zeros((3, 3))
    A[:2, :2] = [[0.0, 2.0], [-2.0, 0.0]]
    B, C, D = np.array([[0.0], [0.0], [1.0]]), np.array([[1.0, 0.0, 3.0]]), np.zeros((1, 1))
    gain = LinearModel(A, B, C, D, ("a", "b", "c"), ("u",), ("y",))
    for loop in (gain, gain.sampled(0.1)):
        found = margins(loop)
        assert found.stable and len(found.neutral) == 2
