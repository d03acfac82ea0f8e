"""Thrust phase of a spacecraft with a 2 m tank of liquid oxygen at 0.012 m/s².

python examples/5_thrust_phase/thrust.py
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

CRAFT = {
    "hub.I": 8000.0,
    "tank.d": 2.0,
    "tank.h": 1.2,
    "tank.r": 0.5,
    "fluid.rho": 1141.0,
    "fluid.nu": (0.17, "mm2/s"),
    "fluid.sigma": (13.2, "mN/m"),
    "friction.model": "none",
}
"""Free dry craft with the tank half a metre off the axis, and liquid oxygen at 90 K."""
THRUST = 0.012
"""Specific force of the engine, m/s²."""
COAST = THRUST / 4
"""Specific force in coast, m/s². The Bond number is 259; below 100 surface tension matters."""
START, END, STOP = 100.0, 1200.0, 1600.0  # s
RAMP = 5.0  # s
PERIOD, LATENCY = 0.5, 1
"""Cycle time and delay of the controller: s, cycles."""
ZETA = 0.7
BANDWIDTHS = {"below": 0.009, "near": 0.026, "above": 0.066}
"""Bandwidths in Hz, named by their place relative to the slosh frequency."""
DISPLACED = np.radians(10)
"""Slosh angle at the start, left by an earlier manoeuvre, rad."""


def specific_force() -> pd.DataFrame:
    """Return the input ``g_axial`` over time: coast, thrust and coast, joined by ramps."""
    time = [0.0, START, START + RAMP, END, END + RAMP, STOP]
    return pd.DataFrame({"time": time, "g_axial": [COAST, COAST, THRUST, THRUST, COAST, COAST]})


def linear(fmu: str | Path, model: str = "linear") -> hubslosh.LinearModel:
    """Return the linear model of the craft under thrust."""
    parameters = CRAFT | {"slosh.model": model, "g_axial": THRUST}
    return hubslosh.linearize(fmu, parameters, ["tau_cmd"], ["theta", "omega"])


def gains(fmu: str | Path, bandwidth: float) -> np.ndarray:
    """Return [kp, kd] of a PD controller of ``bandwidth``, Hz, for hub and rigid liquid."""
    w = 2 * np.pi * bandwidth
    return np.array([w**2, 2 * ZETA * w]) / linear(fmu, "frozen").B[1, 0]


def slosh_pole(fmu: str | Path, bandwidth: float) -> complex:
    """Return the pole of the slosh mode in the sampled loop under thrust, rad/s.

    ``bandwidth`` is the bandwidth of the controller, Hz.
    """
    A, B, C, _ = linear(fmu).sampled(PERIOD, LATENCY)
    poles = np.log(np.linalg.eigvals(A - B @ gains(fmu, bandwidth)[None] @ C).astype(complex))
    free = linear(fmu).poles
    slosh = free[free.imag > 0][0] * PERIOD
    return poles[np.argmin(np.abs(poles - slosh))] / PERIOD


def run(fmu: str | Path, bandwidth: float, model: str = "spherical") -> pd.DataFrame:
    """Simulate coast, thrust and coast with a PD controller of ``bandwidth``, Hz."""
    k = gains(fmu, bandwidth)
    return hubslosh.closed_loop(
        lambda time, measured: -k @ measured, PERIOD, STOP, fmu,
        CRAFT | {"slosh.model": model, "init.slosh_angle": DISPLACED},
        latency=LATENCY, inputs=specific_force(),
        outputs=["theta", "omega", "slosh_angle", "slosh_angle_radial"],
    )  # fmt: skip


def decay(table: pd.DataFrame) -> float:
    """Return the decay rate of slosh under thrust, 1/s, from the times of 90 and 10 % amplitude."""
    thrust = table.query("@START + 150 <= time < @END")
    n = len(thrust) // 4
    first, last = (np.std(thrust["slosh_angle"].iloc[s]) for s in (slice(0, n), slice(-n, None)))
    return np.log(first / last) / (3 * n * PERIOD)


def figure(fmu: str | Path, runs: dict[str, pd.DataFrame], path: Path) -> None:
    whole, (error, slosh, damping) = plt.subplots(
        3, figsize=(8, 9), layout="constrained", height_ratios=(1, 1, 1)
    )
    for (name, table), color in zip(runs.items(), COLORS, strict=False):
        label = f"PD {BANDWIDTHS[name]:g} Hz"
        error.plot(table["time"], np.degrees(table["theta"]), color=color, linewidth=1, label=label)
        slosh.plot(table["time"], np.degrees(table["slosh_angle"]), color=color, linewidth=0.8)
        rate = decay(table) / abs(slosh_pole(fmu, BANDWIDTHS[name]))
        damping.plot(BANDWIDTHS[name], 100 * rate, "o", color=color, label=f"simulated, {label}")
    bandwidth = np.geomspace(0.002, 0.13, 60)
    poles = np.array([slosh_pole(fmu, f) for f in bandwidth])
    damping.semilogx(bandwidth, -100 * poles.real / np.abs(poles), color="black", label="predicted")
    for ax in (error, slosh):
        ax.axvspan(START, END, color="gray", alpha=0.15)
        ax.set_xlabel("time (s); thrust in grey")
    error.set(ylabel="pointing error (deg)", title="Stiff control holds the craft")
    slosh.set(
        ylabel="slosh angle (deg)", title="and leaves the liquid alone; soft control damps it"
    )
    best = bandwidth[np.argmax(-poles.real / np.abs(poles))]
    damping.set(xlabel="bandwidth (Hz)", ylabel="slosh damping (%)")
    damping.set_title(f"best at {best:.3f} Hz, a little below the slosh frequency")
    for ax in (error, slosh, damping):
        ax.grid(alpha=0.3, which="both")
    error.legend()
    damping.legend()
    save(whole, path)


def main() -> None:
    parser = argparse.ArgumentParser(description="Slosh under thrust.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    runs = {name: run(args.fmu, bandwidth) for name, bandwidth in BANDWIDTHS.items()}
    print("bandwidth (Hz)  largest error (deg)  slosh decays with (1/s): predicted  simulated")
    for name, table in runs.items():
        largest = np.degrees(table["theta"].abs().max())
        predicted = -slosh_pole(args.fmu, BANDWIDTHS[name]).real
        print(f"{BANDWIDTHS[name]:14.3f}  {largest:19.3f}  {predicted:34.2e}  {decay(table):9.2e}")
    figure(args.fmu, runs, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
