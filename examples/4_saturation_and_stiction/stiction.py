"""Effects of wheel limits and of a sticking bearing on a PID controller.

Smoothed friction laws are compared with the set-valued law, under which the hub sticks.

python examples/4_saturation_and_stiction/stiction.py
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

PERIOD, LATENCY = 0.02, 1
"""Cycle time and delay of the controller: s, cycles."""
BANDWIDTH, ZETA = 0.3, 0.7
"""Bandwidth and damping ratio of the PD part for a rigid body of `INERTIA`: Hz, 1."""
INERTIA = 0.428
"""Inertia of hub and rigid liquid, kg·m²."""
INTEGRAL = 0.4
"""Ratio of the integral to the proportional gain, 1/s."""
WIDTHS = (1e-2, 1e-3, 1e-5)
"""Widths of the smoothed sign function (``friction.eps``), rad/s."""


def run(
    fmu: str | Path, angle: float, stop: float, parameters: dict, integral: float = 0.0
) -> pd.DataFrame:
    """Simulate a step of the commanded angle (rad) with a PID controller and spherical pendulums.

    The run ends at ``stop``, s; ``integral`` is the controller's integral gain.
    """
    w, area = 2 * np.pi * BANDWIDTH, 0.0

    def law(time: float, measured: np.ndarray) -> float:
        nonlocal area
        error = angle - measured[0]
        area += error * PERIOD
        return INERTIA * (w**2 * (error + integral * area) - 2 * ZETA * w * measured[1])

    outputs = ["theta", "omega", "tau_actuator", "wheel_speed", "stuck", "event_count"]
    return hubslosh.closed_loop(
        law, PERIOD, stop, fmu, {"slosh.model": "spherical"} | parameters,
        latency=LATENCY, outputs=outputs,
    )  # fmt: skip


def saturation(fmu: str | Path) -> dict[str, pd.DataFrame]:
    """Return 90° steps on a free bearing, with unlimited torque and with the wheel's limits."""
    free = {"friction.model": "none"}
    return {
        "any torque": run(fmu, np.pi / 2, 20, free),
        "wheel": run(fmu, np.pi / 2, 20, free | {"wheel.enabled": True}),
    }


def friction_laws() -> dict[str, dict]:
    """Return the parameters of each friction law by name."""
    smooth = {"friction.model": "stribeck_smooth"}
    laws = {f"smoothed, {width:g} rad/s": smooth | {"friction.eps": width} for width in WIDTHS}
    return {"set-valued": {"friction.model": "stribeck"}} | laws


def stiction(fmu: str | Path, integral: float, stop: float) -> dict[str, pd.DataFrame]:
    """Return the motion after a commanded step of 1 degree, for each friction law.

    The runs end at ``stop``, s; ``integral`` is the controller's integral gain.
    """
    angle = np.radians(1)
    return {name: run(fmu, angle, stop, law, integral) for name, law in friction_laws().items()}


def summary(fmu: str | Path) -> pd.DataFrame:
    """Return the pointing error (deg) at four times after the step.

    The table has a row for each controller and friction law.
    """
    rows = {}
    for controller, integral in (("PD", 0.0), ("PID", INTEGRAL)):
        for name, table in stiction(fmu, integral, 60).items():
            error = np.degrees(table["theta"]) - 1
            rows[controller, name] = {f"{t} s": error[round(t / PERIOD)] for t in (10, 20, 60)}
            rows[controller, name]["stuck (%)"] = 100 * table["stuck"].mean()
    return pd.DataFrame.from_dict(rows, orient="index")


def figure(fmu: str | Path, path: Path) -> None:
    whole, axes = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    (angle, speed), (pd_error, pid_error) = axes
    for (name, table), color in zip(saturation(fmu).items(), COLORS, strict=False):
        angle.plot(table["time"], np.degrees(table["theta"]), color=color, label=name)
        speed.plot(table["time"], table["wheel_speed"] * 30 / np.pi, color=color, label=name)
    speed.axhspan(200, 3000, color="gray", alpha=0.15, label="the wheel's range")
    angle.set(
        xlabel="time (s)", ylabel="theta (deg)", title="90° step: the wheel's limits cost time only"
    )
    speed.set(
        xlabel="time (s)",
        ylabel="wheel speed (rpm)",
        title="The wheel runs out of torque, then of speed",
    )
    held = "PD, 1° step: a bearing holds, smoothed laws creep"
    waits = "PID: the hub waits, stuck; smoothed laws do not"
    for ax, integral, title in ((pd_error, 0.0, held), (pid_error, INTEGRAL, waits)):
        for (name, table), color in zip(stiction(fmu, integral, 60).items(), COLORS, strict=False):
            error = np.degrees(table["theta"]) - 1
            ax.plot(table["time"], error, color=color, linewidth=1.1, label=name)
        ax.set(xlabel="time (s)", ylabel="pointing error (deg)", ylim=(-0.3, 0.3))
        ax.set_title(title)
    for ax in axes.flat:
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
    save(whole, path)


def main() -> None:
    parser = argparse.ArgumentParser(description="Wheel limits and stiction of a bearing.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    for name, table in saturation(args.fmu).items():
        error = np.degrees((table["theta"] - np.pi / 2).abs())
        late = table["time"][error > 0.1].max()
        print(
            f"90° with {name}: torque up to {table['tau_actuator'].abs().max():.2f} N·m, "
            f"rate up to {table['omega'].max():.2f} rad/s, within 0.1° after {late:.1f} s"
        )
    print("pointing error after a step of 1° (deg)")
    with pd.option_context("display.width", 200):
        print(summary(args.fmu).round(4))
    figure(args.fmu, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
