"""Crossings and margins of loops for which they are known, to 1e-6."""

import control
import numpy as np
import pytest

from hubslosh import FmuError, LinearModel, margins

EXACT = 1e-6
"""The tolerance that is promised; what is found is better by orders of magnitude."""

S = control.tf("s")
TURN = 2 * np.pi


def crossings(found, kind: str) -> np.ndarray:
    """Return the frequencies of one kind, rad/s."""
    table = found.crossings
    return table.loc[table["crossing"] == kind, "frequency"].to_numpy() * TURN


def test_three_lags_by_their_closed_form() -> None:
    """10/(s + 1)³: |L| = 1 at sqrt(10^(2/3) - 1), negative real at sqrt(3), where it is -10/8."""
    found = margins(10 / (S + 1) ** 3)
    gain, phase = np.sqrt(10 ** (2 / 3) - 1), np.sqrt(3)
    assert crossings(found, "gain") == pytest.approx([gain], rel=EXACT)
    assert crossings(found, "phase") == pytest.approx([phase], rel=EXACT)
    assert not found.stable and found.delay_margin == 0
    assert found.gain_margins == pytest.approx((-20 * np.log10(10 / 8), np.inf), rel=EXACT)
    assert found.phase_margin == pytest.approx(180 - 3 * np.degrees(np.arctan(gain)), rel=EXACT)


def test_an_integrator_with_two_lags_by_its_closed_form() -> None:
    """3/(s (s + 1) (s + 2)): negative real at sqrt(2), where it is -3/6; Routh: stable below 6."""
    found = margins(3 / (S * (S + 1) * (S + 2)))
    assert crossings(found, "phase") == pytest.approx([np.sqrt(2)], rel=EXACT)
    assert found.gain_margins[1] == pytest.approx(20 * np.log10(2), rel=EXACT)
    # |L| = 1: w² (w² + 1) (w² + 4) = 9
    square = np.roots([1, 5, 4, -9])
    w = np.sqrt(square[square.real > 0].real[0])
    assert crossings(found, "gain") == pytest.approx([w], rel=EXACT)
    assert found.stable
    # the delay that takes the phase margin
    assert found.delay_margin == pytest.approx(np.radians(found.phase_margin) / w, rel=EXACT)


@pytest.mark.parametrize("half", [0.05, 1e-4])
def test_a_slosh_dipole_however_narrow(half: float) -> None:
    """By choice of k, a, b k (s² + a²)/(s (s² + b²)) is 1 at 2.5 - half, 2.5 and 2.5 + half rad/s.

    The narrower dipole is 1e-8 rad/s wide: no frequency grid would see it. The three are roots of
    w³ - k w² - b² w + k a² = 0, the middle one with the other sign.
    """
    r1, r2, r3 = 2.5 - half, 2.5 + half, 2.5
    k, b2 = r1 + r2 - r3, r3 * (r1 + r2) - r1 * r2
    a2 = r1 * r2 * r3 / k
    found = margins(k * (S**2 + a2) / (S * (S**2 + b2)))
    assert crossings(found, "gain") == pytest.approx([r1, r3, r2], rel=1e-10)
    assert found.crossings["phase_margin"].to_numpy() == pytest.approx([90, -90, 90], abs=EXACT)
    assert len(found.modes) == 1 and (found.crossings["near"] != "").all()


@pytest.mark.parametrize("late", [0, 2])
def test_a_sampled_integrator_by_its_closed_form(late: int) -> None:
    """1.5 T/(z^late (z - 1)): |L| = 1 where 2 sin(wT/2) = 1.5 T.

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
    """Two integrators, the first drives the second: L = [[a/s, 0], [c/s, b/s]].

    Triangular: the loops have the crossings of a/s and b/s. With a full matrix the first, the
    second closed, is a/s - d/s · c/s / (1 + b/s) = (a s + a b - c d)/(s (s + b)).
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
    """For 1/(s (s + 1)) as on a fine grid: a minimum is flat, 1e-5 in w is 1e-10 in it."""
    w = np.linspace(0.5, 3, 250_001)
    least = np.abs(1 + 1 / (1j * w * (1j * w + 1))).min()
    assert margins(1 / (S * (S + 1))).modulus_margin == pytest.approx(least, rel=1e-8)


def test_a_loop_without_crossings_says_so() -> None:
    """1/(2 (s + 1)) is nowhere 1; its distance to -1 is least at infinity, 1. And L = 0."""
    for gain in (0.5, 0.0):
        found = margins(control.tf([gain], [1, 1]))
        assert found.stable and not len(found.crossings) and found.delay_margin == np.inf
        assert found.modulus_margin == pytest.approx(1, abs=1e-3)
        assert "phase margin none" in str(found) and "no crossings" in str(found)


def test_loops_that_cannot_be_closed_are_refused() -> None:
    """D = -1, or not square."""
    one, none = np.eye(1), np.zeros((1, 1))
    with pytest.raises(FmuError, match="I \\+ D is singular"):
        margins(LinearModel(-one, one, one, -one, ("x",), ("u",), ("y",)))
    with pytest.raises(FmuError, match="as many inputs as outputs"):
        margins(LinearModel(-one, np.ones((1, 2)), one, np.zeros((1, 2)), ("x",), ("u",), ("y",)))
    assert (
        margins(LinearModel(none - 1, one, one, none, ("x",), ("u",), ("y",))).delay_margin
        == np.inf
    )
