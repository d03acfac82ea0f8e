"""Slosh in a PD loop whose delay decides if the loop damps or destabilises the liquid.

    python examples/3_slosh_meets_the_controller/stability.py

Predictions are computed from the FMU's directional derivatives (`linearize`). The amplitudes of
limit cycles follow from the first harmonic of the planar pendulum's equations. Simulations run the
FMU in closed loop.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import control
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.optimize import brentq, fsolve

import hubslosh
from hubslosh.plot import COLORS, save

VISCOUS = {"friction.model": "viscous"}
DRAINED = {"tank.h": (50, "mm")}
FROZEN = {"slosh.model": "frozen"}
ZETA = 0.7
"""Damping ratio of the PD design."""


@dataclass(frozen=True)
class Cycle:
    """Cycle time and delay of the controller, s."""

    period: float  # s
    latency: int  # cycles
    label: str

    def hold(self, frequency: np.ndarray) -> np.ndarray:
        """Return the response of zero-order hold and delay at frequencies in Hz."""
        half = np.exp(-1j * np.pi * frequency * self.period)
        return half * np.sinc(frequency * self.period)


FAST = Cycle(0.02, 1, "50 Hz, 30 ms")
SLOW = Cycle(0.1, 1, "10 Hz, 150 ms")


class Bench:
    """The FMU of the bench, and linear models of the bench at rest."""

    def __init__(self, fmu: str | Path = "HubSlosh", parameters: dict | None = None) -> None:
        self.fmu = fmu
        self.parameters = VISCOUS | (parameters or {})
        self.linear = self._linearize({})
        # Inertia of the rigid body that the design assumes: tau = inertia omega_dot.
        self.inertia = 1 / self._linearize(FROZEN).B[1, 0]

    def _linearize(self, more: dict) -> hubslosh.LinearModel:
        outputs = ["theta", "omega"]
        return hubslosh.linearize(self.fmu, self.parameters | more, ["tau_cmd"], outputs)

    def gains(self, bandwidth: float) -> np.ndarray:
        """Return [kp, kd] of a PD law that puts the rigid body's poles at ``bandwidth``, Hz."""
        w = 2 * np.pi * bandwidth
        return self.inertia * np.array([w**2, 2 * ZETA * w])

    def loop(self, cycle: Cycle, bandwidth: float, filter: control.StateSpace | None = None):
        """Return the sampled loop gain, with the loop opened at the torque command."""
        plant = self.linear.sampled(cycle.period, cycle.latency).to_control()
        plant = plant if filter is None else plant * filter
        return control.ss(plant.A, plant.B, self.gains(bandwidth) @ plant.C, 0, cycle.period)

    def largest_pole(self, cycle: Cycle, bandwidth: float, filter=None) -> float:
        """Return the magnitude of the closed loop's largest pole; below 1 the loop is stable."""
        loop = self.loop(cycle, bandwidth, filter)
        return np.abs(np.linalg.eigvals(loop.A - loop.B @ loop.C)).max()

    def first_unstable(self, cycle: Cycle, filter=None, low: float = 0.03) -> float:
        """Return the lowest bandwidth at which the loop is unstable, Hz."""
        plant = self.linear.sampled(cycle.period, cycle.latency).to_control()
        plant = plant if filter is None else plant * filter

        def excess(bandwidth: float) -> float:
            closed = plant.A - plant.B @ self.gains(bandwidth)[None] @ plant.C
            return np.abs(np.linalg.eigvals(closed)).max() - 1

        grid = np.geomspace(low, 8, 120)
        above = next(k for k, bandwidth in enumerate(grid) if excess(bandwidth) > 0)
        return brentq(excess, grid[above - 1], grid[above])

    def run(
        self, cycle: Cycle, bandwidth: float, stop: float, filter=None, **options
    ) -> pd.DataFrame:
        """Simulate the loop after a push of the liquid; options as for `hubslosh.closed_loop`."""
        parameters = self.parameters | {"init.slosh_angle": 0.01} | options.pop("parameters", {})
        return hubslosh.closed_loop(
            pd_law(self.gains(bandwidth), filter), cycle.period, stop, self.fmu, parameters,
            latency=cycle.latency, **options,
        )  # fmt: skip


def pd_law(gains: np.ndarray, filter: control.StateSpace | None = None) -> hubslosh.Law:
    """Return the controller u = filter(-kp theta - kd omega); ``gains`` is [kp, kd]."""
    state = np.zeros(0 if filter is None else len(filter.A))

    def law(time: float, measured: np.ndarray) -> float:
        nonlocal state
        u = -gains @ measured
        if filter is None:
            return u
        out = (filter.C @ state + filter.D[:, 0] * u).item()
        state = filter.A @ state + filter.B[:, 0] * u
        return out

    return law


def notch(frequency: float, cycle: Cycle, deep: float = 0.05, wide: float = 0.3):
    """Return a notch filter at ``frequency``, Hz, sampled without a shift of its frequency w.

    It is (s² + 2·deep·w s + w²)/(s² + 2·wide·w s + w²).
    """
    w = 2 * np.pi * frequency
    continuous = control.tf([1, 2 * deep * w, w**2], [1, 2 * wide * w, w**2])
    return control.ss(
        control.sample_system(continuous, cycle.period, "tustin", prewarp_frequency=w)
    )


def low_pass(frequency: float, cycle: Cycle):
    """Return a Butterworth low-pass of second order at ``frequency``, Hz, sampled."""
    w = 2 * np.pi * frequency
    continuous = control.tf([w**2], [1, np.sqrt(2) * w, w**2])
    return control.ss(
        control.sample_system(continuous, cycle.period, "tustin", prewarp_frequency=w)
    )


def slosh_damping(bench: Bench, cycle: Cycle, bandwidth: float, filter=None) -> float:
    """Return the damping ratio of the slosh mode in the closed loop.

    This mode's pole is the closed loop's pole nearest to the slosh pole of the open loop.
    ``bandwidth`` is the bandwidth of the controller, Hz.
    """
    loop = bench.loop(cycle, bandwidth, filter)
    poles = np.log(np.linalg.eigvals(loop.A - loop.B @ loop.C).astype(complex)) / cycle.period
    open_loop = bench.linear.poles
    slosh = open_loop[open_loop.imag > 0][0]
    pole = poles[np.argmin(np.abs(poles - slosh))]
    return -pole.real / abs(pole)


@dataclass(frozen=True)
class Margins:
    """Stability margins of a loop: distances of its loop gain to -1."""

    gain: float
    """Largest factor of the gains with which the loop is stable, dB; negative if unstable."""
    modulus: float
    """Smallest distance of the loop gain to -1; 0 if the loop is unstable."""
    slosh_gain: float
    """Largest loop gain between 1.8 and 3 Hz, dB; below 0 the slosh mode is gain-stabilised."""


def margins(bench: Bench, cycle: Cycle, bandwidth: float, filter=None) -> Margins:
    """Return the stability margins of the loop with a controller of ``bandwidth``, Hz."""
    loop = bench.loop(cycle, bandwidth, filter)

    def excess(factor: float) -> float:
        return np.abs(np.linalg.eigvals(loop.A - factor * loop.B @ loop.C)).max() - 1

    factors = np.geomspace(0.05, 100, 200)
    above = next(k for k, factor in enumerate(factors) if excess(factor) > 0)
    gain = brentq(excess, factors[above - 1], factors[above])
    frequency = np.union1d(np.geomspace(0.01, 0.5 / cycle.period, 2000), np.linspace(1.8, 3, 4000))
    response = loop(np.exp(2j * np.pi * frequency * cycle.period))
    near = (frequency > 1.8) & (frequency < 3)
    modulus = np.abs(1 + response).min() if gain > 1 else 0.0
    decibel = 20 * np.log10([gain, np.abs(response[near]).max()])
    return Margins(decibel[0], modulus, decibel[1])


def growth(run: pd.DataFrame) -> float:
    """Return the growth rate of the oscillation over the last two thirds of a run, 1/s."""
    t, x = run["time"].to_numpy(), run["omega"].to_numpy()
    thirds = [x[(t >= k * t[-1] / 3) & (t < (k + 1) * t[-1] / 3)] for k in (1, 2)]
    return np.log(np.std(thirds[1]) / np.std(thirds[0])) / (t[-1] / 3)


def simulated_first_unstable(bench: Bench, cycle: Cycle, near: float) -> float:
    """Return the bandwidth, Hz, at which the simulated motion neither grows nor decays.

    The search begins at ``near``, Hz.
    """
    stop = 1800 * cycle.period
    return brentq(
        lambda bandwidth: growth(bench.run(cycle, bandwidth, stop, outputs=["omega"])),
        0.97 * near, 1.03 * near, xtol=1e-4 * near,
    )  # fmt: skip


# Limit cycles ------------------------------------------------------------------------------------


def harmonic_balance(bench: Bench, cycle: Cycle, amplitudes: np.ndarray, pendulum: str, dry: bool):
    """Return limit cycles with given slosh angles: bandwidths (Hz) and rate amplitudes (rad/s).

    al = a cos(wt) and omega = Re(W exp(iwt)) are put into the equations of hub and pendulum (linear
    or planar; the documentation's page on the model has them); their first harmonics must vanish.
    This is the describing function of all nonlinear terms together. The unknowns are w, W and the
    bandwidth. The held torque also excites the plant above half the sampling rate, and sampling
    folds (aliases) this response back to w. The folded part is the response of the sampled model
    minus the response of hold and plant.

    ``amplitudes`` are the slosh angles a, rad; ``dry`` says whether the bearing has dry friction.
    """
    names = ["hub.I", "tank.m_0", "slosh.mass[1]", "slosh.length[1]", "tank.r", "g_axial"]
    names += ["slosh.damping[1]", *(f"friction.{x}" for x in ("b", "c", "d", "omega_s"))]
    with hubslosh.Plant(bench.fmu, bench.parameters) as plant:
        I_hub, m_0, m, l, r, g, zeta, b, c, d, omega_s = plant.get(names)
    I0 = I_hub + m_0 * r**2
    drag = 2 * zeta * np.sqrt(g / l)  # c_i/m_i, 1/s
    phase = 2 * np.pi * np.arange(256) / 256
    harmonic = np.exp(1j * phase)
    sampled = bench.linear.sampled(cycle.period)

    def commanded(w: float, W: complex, bandwidth: float) -> complex:
        gains, f = bench.gains(bandwidth), np.array([w / (2 * np.pi)])
        late = np.exp(-1j * w * cycle.period * cycle.latency)
        folded = sampled.response(f)[0, :, 0] - cycle.hold(f) * bench.linear.response(f)[0, :, 0]
        commands = -late * gains @ [W / (1j * w), W] / (1 + late * gains @ folded)
        return (commands * cycle.hold(f)).item()

    def residual(unknown: np.ndarray, a: float) -> list[float]:
        w, bandwidth = 15 * unknown[0], unknown[3]
        W = a * (unknown[1] + 1j * unknown[2])
        al, ald, aldd = (
            a * np.cos(phase),
            -a * w * np.sin(phase),
            -a * w**2 * np.cos(phase),
        )
        omega, omega_dot = (W * harmonic).real, (1j * w * W * harmonic).real
        tau = (commanded(w, W, bandwidth) * harmonic).real - b * omega
        if dry:
            tau -= np.sign(omega) * (c + d * np.exp(-((omega / omega_s) ** 2)))
        if pendulum == "planar":
            s, k = np.sin(al), np.cos(al)
            hub = (I0 + m * (r**2 + l**2) * s**2) * omega_dot - tau - m * (
                -2 * l**2 * s * k * omega * ald + r * l * s * ald**2
                + r * k * (g * s + drag * l * ald - l * omega**2 * s * k)
            )  # fmt: skip
            liquid = aldd + r / l * k * omega_dot + g / l * s - omega**2 * s * k + drag * ald
        else:
            hub = I0 * omega_dot - tau - m * r * (g * al + drag * l * ald)
            liquid = aldd + r / l * omega_dot + g / l * al + drag * ald
        first = [np.mean(x * harmonic.conj()) / a for x in (hub, liquid / 200)]
        return [part for x in first for part in (x.real, x.imag)]

    start, found = np.array([1.03, -0.3, 0.0, 0.17]), []
    for a in amplitudes[::-1]:  # from the largest, which friction affects least
        start, _, success, message = fsolve(residual, start, (a,), full_output=True)
        if success != 1:
            raise RuntimeError(f"no limit cycle of {a} rad is found: {message}")
        found.append((start[3], a * np.hypot(start[1], start[2])))
    return np.array(found[::-1]).T


def fundamental(time: np.ndarray, signal: np.ndarray) -> float:
    """Return the amplitude of the signal's strongest harmonic between 2 and 3 Hz."""
    window = np.hanning(len(time))
    frequency = np.linspace(2, 3, 1001)
    spectrum = np.exp(-2j * np.pi * frequency[:, None] * time) @ (signal * window)
    return 2 * np.abs(spectrum).max() / window.sum()


def predicted_rate(bench: Bench, bandwidth: float, pendulum: str, dry: bool) -> float:
    """Return the rate amplitude of the limit cycle at a bandwidth, by harmonic balance, rad/s.

    Use it only where one limit cycle exists: linear pendulum with dry friction, or planar pendulum
    without dry friction.
    """
    amplitudes = np.geomspace(0.03, 1.0, 60)
    found, rate = harmonic_balance(bench, SLOW, amplitudes, pendulum, dry)
    order = np.argsort(found)
    if not found.min() <= bandwidth <= found.max():
        raise ValueError(f"no limit cycle has 0.03 to 1 rad at {bandwidth} Hz")
    return float(np.interp(bandwidth, found[order], rate[order]))


def threshold(bench: Bench, bandwidth: float) -> float:
    """Return the rate amplitude (rad/s) between decay and growth, with dry friction.

    The function searches for an initial slosh angle with which the motion neither decays nor grows
    for two minutes; such a motion stays near the unstable limit cycle.
    """

    def run(push: float, stop: float, **options) -> pd.DataFrame:
        parameters = {"friction.model": "stribeck", "init.slosh_angle": push}
        return bench.run(SLOW, bandwidth, stop, parameters=parameters, **options)

    low, high = 0.01, 0.5  # rad
    for _ in range(16):
        middle = np.sqrt(low * high)
        rate = run(middle, 120, outputs=["omega"])["omega"]
        grown = rate.tail(100).abs().max() > rate[200:300].abs().max()
        low, high = (low, middle) if grown else (middle, high)
    hovering = run(low, 40, outputs=["omega"], substeps=5).query("time >= 15")
    return fundamental(hovering["time"].to_numpy(), hovering["omega"].to_numpy())


def settled(bench: Bench, bandwidth: float, stop: float) -> list[float]:
    """Return the amplitudes that a run with spherical pendulums approaches until ``stop``, s.

    These are the tangential and the radial slosh angle (rad) and the hub's rate (rad/s).
    """
    columns = ["slosh_angle", "slosh_angle_radial", "omega"]
    parameters = {"slosh.model": "spherical", "init.slosh_angle": 0.3}
    end = bench.run(SLOW, bandwidth, stop, parameters=parameters, outputs=columns)
    end = end[end["time"] > stop - 40]
    return [fundamental(end["time"].to_numpy(), end[name].to_numpy()) for name in columns]


# Table and figure --------------------------------------------------------------------------------

DESIGNS = {
    "50 Hz, PD 1 Hz": (FAST, 1.0, None),
    "50 Hz, PD 1 Hz, notch 2.456 Hz": (FAST, 1.0, notch(2.456, FAST)),
    "50 Hz, PD 2.5 Hz": (FAST, 2.5, None),
    "50 Hz, PD 2.5 Hz, notch 2.456 Hz": (FAST, 2.5, notch(2.456, FAST)),
    "10 Hz, PD 0.08 Hz": (SLOW, 0.08, None),
    "10 Hz, PD 0.25 Hz": (SLOW, 0.25, None),
    "10 Hz, PD 0.25 Hz, low-pass 1 Hz": (SLOW, 0.25, low_pass(1.0, SLOW)),
    "10 Hz, PD 0.25 Hz, notch 2.456 Hz": (SLOW, 0.25, notch(2.456, SLOW)),
    "10 Hz, PD 0.25 Hz, notch 2.2 Hz": (SLOW, 0.25, notch(2.2, SLOW)),
    "10 Hz, PD 0.25 Hz, notch 2.9 Hz": (SLOW, 0.25, notch(2.9, SLOW)),
}
"""Designs by name: cycle, bandwidth in Hz, filter."""


def table(full: Bench, drained: Bench) -> pd.DataFrame:
    """Return margins and slosh damping of the designs with full and with drained tank."""
    rows = {}
    for name, design in DESIGNS.items():
        found = margins(full, *design)
        rows[name] = {
            "gain margin (dB)": found.gain,
            "min |1+L|": found.modulus,
            "|L| at slosh (dB)": found.slosh_gain,
            "slosh damping (%)": 100 * slosh_damping(full, *design),
            "gain margin at 5 cm (dB)": margins(drained, *design).gain,
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def figure(full: Bench, drained: Bench, path: Path) -> None:
    _, axes = plt.subplots(3, 2, figsize=(11, 12), layout="constrained")
    (damping, nyquist), (notch_slow, notch_fast), (decay, cycles) = axes
    blue, orange, green, pink = COLORS[:4]

    damping.axhline(0, color="black", linewidth=0.8)
    for cycle, color, top in ((FAST, blue, 3.9), (SLOW, orange, 0.6)):
        bandwidth = np.geomspace(0.03, top, 60)
        values = [100 * slosh_damping(full, cycle, f) for f in bandwidth]
        damping.semilogx(bandwidth, values, color=color, label=f"{cycle.label} delay in all")
    limit = simulated_first_unstable(full, SLOW, full.first_unstable(SLOW))
    damping.plot(limit, 0, "x", color="black", label="unstable from here on, simulated")
    damping.set(xlabel="bandwidth (Hz)", ylabel="slosh damping (%)", ylim=(-1.5, 8))
    damping.set_title("Short delay: the loop damps the liquid. Long delay: it drives it")

    nyquist.plot(-1, 0, "k+", markersize=10)
    turn = np.exp(2j * np.pi * np.linspace(0, 1, 200))
    nyquist.plot(turn.real, turn.imag, ":", color="gray", linewidth=0.8)
    for name, color in zip(
        ("50 Hz, PD 1 Hz", "10 Hz, PD 0.08 Hz", "10 Hz, PD 0.25 Hz"), COLORS[:3], strict=True
    ):
        cycle, bandwidth, _ = DESIGNS[name]
        frequency = np.concatenate(
            [np.linspace(0.3 * bandwidth + 0.1, 2.2, 400), np.linspace(2.2, 2.7, 3000)]
        )
        loop = full.loop(cycle, bandwidth)(np.exp(2j * np.pi * frequency * cycle.period))
        nyquist.plot(loop.real, loop.imag, color=color, linewidth=1.2, label=name)
    nyquist.set(xlabel="Re L", ylabel="Im L", xlim=(-3, 7), ylim=(-5, 3), aspect="equal")
    nyquist.set_title("Loop gain: the slosh mode is a circle")

    for ax, cycle, top in ((notch_slow, SLOW, 0.8), (notch_fast, FAST, 4.2)):
        centre = np.linspace(1.6, 3.2, 33)
        for bench, color, label in ((full, blue, "10 cm"), (drained, orange, "5 cm")):
            limits = [bench.first_unstable(cycle, notch(f, cycle)) for f in centre]
            ax.plot(centre, limits, color=color, label=f"fill {label}, notch")
            ax.axhline(
                bench.first_unstable(cycle),
                color=color,
                linestyle="--",
                label=f"fill {label}, none",
            )
        ax.set(
            xlabel="centre of the notch (Hz)",
            ylabel="first unstable bandwidth (Hz)",
            ylim=(0, top),
        )
    notch_slow.set_title("10 Hz: a notch helps, below the slosh frequency")
    notch_fast.set_title("50 Hz: any notch hurts")

    runs = (
        ("viscous bearing, 0.1°", 0.1, VISCOUS, orange),
        ("dry friction, 5.2°", 5.2, {"friction.model": "stribeck"}, green),
        ("dry friction, 5.4°", 5.4, {"friction.model": "stribeck"}, pink),
    )
    for label, push, parameters, color in runs:
        more = {
            "slosh.model": "spherical",
            "init.slosh_angle": (push, "deg"),
        } | parameters
        run = full.run(SLOW, 0.25, 240, parameters=more, outputs=["theta"], substeps=5)
        envelope = np.degrees(run["theta"].diff(25).abs().rolling(50).max())  # half a period, 1 s
        decay.semilogy(run["time"], envelope / 2, color=color, linewidth=1.0, label=label)
    decay.set(xlabel="time (s)", ylabel="oscillation of theta (deg)", ylim=(1e-3, 2))
    decay.set_title("10 Hz, PD 0.25 Hz, spherical: dry friction masks it, to a point")

    amplitudes = np.geomspace(0.012, 0.8, 60)
    for pendulum, dry, color, label in (
        ("linear", True, green, "dry friction, linear"),
        ("planar", True, pink, "dry friction, pendulum"),
        ("planar", False, orange, "viscous, pendulum"),
    ):
        bandwidth, rate = harmonic_balance(full, SLOW, amplitudes, pendulum, dry)
        cycles.semilogy(bandwidth, rate, color=color, label=f"{label}: harmonic balance")
    for bandwidth in (0.2, 0.25, 0.3, 0.35):
        found = threshold(full, bandwidth)
        cycles.plot(bandwidth, found, "o", color=green, markersize=5, markerfacecolor="none")
    for bandwidth in (0.166, 0.168, 0.17, 0.175, 0.18, 0.19, 0.2):
        found = settled(full, bandwidth, 1500)
        plane = found[1] < 0.01
        cycles.plot(
            bandwidth,
            found[2],
            "s" if plane else "*",
            color=orange,
            markersize=6,
            markerfacecolor="none",
        )
    cycles.plot(
        [],
        [],
        "ko",
        markerfacecolor="none",
        label="simulated: grows above, decays below",
    )
    cycles.plot(
        [],
        [],
        "ks",
        markerfacecolor="none",
        label="simulated, spherical: settles there",
    )
    cycles.plot([], [], "k*", markerfacecolor="none", label="the same, in rotary slosh")
    cycles.set(
        xlabel="bandwidth (Hz)",
        ylabel="rate amplitude (rad/s)",
        xlim=(0.15, 0.37),
        ylim=(5e-3, 0.4),
    )
    cycles.set_title("Limit cycles at 10 Hz")

    for ax in axes.flat:
        ax.grid(alpha=0.3, which="both")
        ax.legend(fontsize=7.5)
    save(plt.gcf(), path)
    plt.close()


def main() -> None:
    parser = argparse.ArgumentParser(description="Slosh and a sampled PD controller.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    full, drained, frozen = (Bench(args.fmu, more) for more in ({}, DRAINED, FROZEN))
    drained.inertia = full.inertia  # the gains are still those for the full tank
    print("First unstable bandwidth, PD with zeta 0.7:")
    for cycle in (FAST, Cycle(0.02, 6, "50 Hz, 130 ms"), SLOW):
        sloshing, rigid = full.first_unstable(cycle), frozen.first_unstable(cycle)
        simulated = simulated_first_unstable(full, cycle, sloshing)
        print(
            f"  {cycle.label}: {sloshing:.4f} Hz ({simulated:.4f} Hz simulated), "
            f"rigid liquid {rigid:.4f} Hz"
        )
    with pd.option_context("display.width", 200, "display.max_columns", None):
        print(table(full, drained).round(2))
    print("Limit cycles at 10 Hz, rate amplitude (rad/s): harmonic balance, simulated")
    for bandwidth in (0.2, 0.25, 0.3):
        predicted = predicted_rate(full, bandwidth, "linear", dry=True)
        print(f"  {bandwidth} Hz, dry friction: {predicted:.5f}, {threshold(full, bandwidth):.5f}")
    for bandwidth in (0.167, 0.17):
        predicted = predicted_rate(full, bandwidth, "planar", dry=False)
        simulated = settled(full, bandwidth, 1500)[2]
        print(f"  {bandwidth} Hz, spherical, viscous: {predicted:.5f}, {simulated:.5f}")
    figure(full, drained, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
