"""The FMU's derivatives and simulations of the closed loop reproduce the README's numbers."""

import pytest
from stability import (
    DESIGNS,
    DRAINED,
    FAST,
    FROZEN,
    SLOW,
    Bench,
    Cycle,
    growth,
    margins,
    predicted_rate,
    settled,
    simulated_first_unstable,
    slosh_damping,
    threshold,
)


@pytest.fixture(scope="module")
def full(fmu: str) -> Bench:
    return Bench(fmu)


@pytest.mark.parametrize(
    ("cycle", "sloshing", "rigid"),
    [(FAST, 3.694, 3.947), (Cycle(0.02, 6, ""), 0.207, 0.911), (SLOW, 0.164, 0.795)],
    ids=["30 ms", "130 ms", "150 ms"],
)
def test_the_simulation_turns_unstable_where_the_sampled_linear_model_does(
    fmu: str, full: Bench, cycle: Cycle, sloshing: float, rigid: float
) -> None:
    """The limits agree within 0.5 %, and with the three digits of the README."""
    predicted = full.first_unstable(cycle)
    assert round(predicted, 3) == sloshing
    assert round(Bench(fmu, FROZEN).first_unstable(cycle), 3) == rigid
    assert simulated_first_unstable(full, cycle, predicted) == pytest.approx(predicted, rel=5e-3)


@pytest.mark.parametrize("name", DESIGNS)
def test_simulated_oscillations_grow_or_decay_as_the_gain_margin_predicts(
    full: Bench, name: str
) -> None:
    """Some designs have filters.

    A rate counts as growth or decay above 0.002/s, a tenth of the slowest design's rate.
    """
    cycle, bandwidth, filter = DESIGNS[name]
    stop = min(40.0, 1200 * cycle.period)
    rate = growth(full.run(cycle, bandwidth, stop, filter, outputs=["omega"]))
    assert abs(rate) > 0.002
    assert (rate < 0) == (margins(full, cycle, bandwidth, filter).gain > 0)


def test_a_short_delay_damps_slosh_and_a_notch_removes_this_damping(fmu: str, full: Bench) -> None:
    """The damping ratio is 0.3 % without control and 4.4 % under PD control.

    A notch reduces it to 0.7 %.
    """
    open_loop = full.linear.poles
    slosh = open_loop[open_loop.imag > 0][0]
    assert -slosh.real / abs(slosh) == pytest.approx(0.0034, abs=5e-5)
    with_pd, with_notch = (
        slosh_damping(full, *DESIGNS[name])
        for name in ("50 Hz, PD 1 Hz", "50 Hz, PD 1 Hz, notch 2.456 Hz")
    )
    assert with_pd == pytest.approx(0.0441, abs=5e-5)
    assert with_notch == pytest.approx(0.0071, abs=5e-5)


def test_a_notch_above_the_slosh_frequency_is_worse_than_none(fmu: str, full: Bench) -> None:
    """A notch at the slosh frequency turns a gain margin of -3.8 dB into 11.5 dB.

    When the tank drains, the slosh frequency leaves the notch, which then no longer helps.
    """
    drained = Bench(fmu, DRAINED)
    drained.inertia = full.inertia
    pd = "10 Hz, PD 0.25 Hz"

    def gain(bench: Bench, name: str) -> float:
        return margins(bench, *DESIGNS[name]).gain

    assert gain(full, pd) == pytest.approx(-3.84, abs=0.01)
    assert gain(full, pd + ", notch 2.456 Hz") == pytest.approx(11.52, abs=0.01)
    assert gain(drained, pd + ", notch 2.456 Hz") == pytest.approx(1.29, abs=0.01)
    assert gain(drained, pd + ", notch 2.2 Hz") == pytest.approx(10.23, abs=0.01)
    assert gain(drained, pd + ", notch 2.9 Hz") < gain(drained, pd) < 0


def test_dry_friction_masks_the_instability_up_to_the_predicted_amplitude(
    full: Bench,
) -> None:
    """The simulated amplitude agrees with the describing function to 10 %."""
    predicted = predicted_rate(full, 0.25, "linear", dry=True)
    assert threshold(full, 0.25) == pytest.approx(predicted, rel=0.02)


def test_spherical_pendulums_reach_the_predicted_amplitude_or_rotary_slosh(
    full: Bench,
) -> None:
    """The amplitude of motion in the plane agrees with the prediction to 10 %.

    Above about 0.172 Hz the liquid leaves the plane. After 900 s 1 % of the transient is left (at
    0.17 Hz its time constant is 200 s).
    """
    angle, radial, rate = settled(full, 0.17, 900)
    assert radial < 0.01 * angle
    assert rate == pytest.approx(predicted_rate(full, 0.17, "planar", dry=False), rel=0.05)
    angle, radial, rate = settled(full, 0.2, 300)
    assert radial > 0.3 * angle
    assert rate < 0.7 * predicted_rate(full, 0.2, "planar", dry=False)
