"""Simulates a rest-to-rest slew of 90 degrees with a bang-stop-bang and with a smoothed profile.

python examples/2_slew/slew.py
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

ANGLE = np.pi / 2
"""Angle of the slew, rad."""
PERIOD, LATENCY = 0.02, 1
"""Cycle time and delay of the controller: s, cycles."""
BANDWIDTH, ZETA = 0.3, 0.7
"""Bandwidth and damping ratio of the PD for a rigid body: Hz, 1."""
TOLERANCE = np.radians(0.001)
"""The hub has settled when the pointing error stays below this angle, rad."""
STOP = 40.0  # s
FREE = {"friction.model": "none"}
"""Parameters without friction, because a spacecraft has no bearing."""

Profile = Callable[[float], tuple[float, float, float]]
"""Function from time (s) to commanded angle (rad), rate (rad/s) and acceleration (rad/s²)."""


def bang_stop_bang(time: float, push: float = 1.2, coast: float = 1.2) -> tuple[float, ...]:
    """Return the slew profile of constant acceleration, coasting and constant deceleration.

    The result is angle (rad), rate and acceleration at ``time``, s, from the start of the slew.
    ``push`` and ``coast`` are the durations of acceleration and coasting, s.
    """
    a = ANGLE / (push * (push + coast))
    end = 2 * push + coast
    if time < push:
        return a * time**2 / 2, a * time, a
    if time < push + coast:
        return a * push * (time - push / 2), a * push, 0.0
    if time < end:
        left = end - time
        return ANGLE - a * left**2 / 2, a * left, -a
    return ANGLE, 0.0, 0.0


def smoothed(time: float, push: float = 2.4) -> tuple[float, ...]:
    """Return the profile with the same largest rate and torque, and accelerations like 1 - cos.

    A rest-to-rest slew of this angle is then two pulses of the duration ``push`` (s), without
    coasting between them.
    """
    a = ANGLE / (1.2 * (1.2 + 1.2)) / 2  # half the largest acceleration
    w = 2 * np.pi / push

    def pulse(t: float) -> tuple[float, float, float]:
        """Return angle, rate and acceleration during the first pulse."""
        angle = a * (t**2 / 2 - (1 - np.cos(w * t)) / w**2)
        return angle, a * (t - np.sin(w * t) / w), a * (1 - np.cos(w * t))

    if time < push:
        return pulse(time)
    if time < 2 * push:
        angle, rate, acceleration = pulse(2 * push - time)
        return ANGLE - angle, rate, -acceleration
    return ANGLE, 0.0, 0.0


PROFILES = {"bang-stop-bang": bang_stop_bang, "smoothed": smoothed}
DURATION = {"bang-stop-bang": 3.6, "smoothed": 4.8}
"""Duration of the slew by profile, s."""


def inertia(fmu: str | Path) -> float:
    """Return the moment of inertia of the hub with rigid liquid, kg·m²."""
    frozen = hubslosh.linearize(fmu, FREE | {"slosh.model": "frozen"}, ["tau_cmd"], ["omega"])
    return 1 / frozen.B[0, 0]


def slew(fmu: str | Path, profile: Profile, model: str) -> pd.DataFrame:
    """Simulate the slew ``profile`` with the slosh model ``model``.

    The column ``error`` is theta minus the angle of the profile, rad.
    """
    I, w = inertia(fmu), 2 * np.pi * BANDWIDTH

    def law(time: float, measured: np.ndarray) -> float:
        angle, rate, _ = profile(time)
        # the command acts between one and two cycles from now
        _, _, acceleration = profile(time + (LATENCY + 0.5) * PERIOD)
        error = w**2 * (angle - measured[0]) + 2 * ZETA * w * (rate - measured[1])
        return I * (acceleration + error)

    run = hubslosh.closed_loop(
        law, PERIOD, STOP, fmu, FREE | {"slosh.model": model}, latency=LATENCY,
        outputs=["theta", "omega", "slosh_angle", "slosh_angle_radial"],
    )  # fmt: skip
    run["error"] = run["theta"] - [profile(t)[0] for t in run["time"]]
    return run


def settling_time(run: pd.DataFrame, profile: str) -> float:
    """Return the time, s, after which the pointing error stays below `TOLERANCE`."""
    outside = run["time"][run["error"].abs() >= TOLERANCE]
    return max(DURATION[profile], outside.max() + PERIOD)


def results(fmu: str | Path) -> dict[tuple[str, str], pd.DataFrame]:
    """Return all runs, by the name of the profile and the slosh model."""
    models = ("frozen", "linear", "spherical")
    return {(p, m): slew(fmu, PROFILES[p], m) for p in PROFILES for m in models}


def title(runs: dict[tuple[str, str], pd.DataFrame], profile: str) -> str:
    """Return a title with the duration of the slew and the settling times."""
    settled = settling_time(runs[profile, "spherical"], profile)
    over = f"{profile.capitalize()}: over at {DURATION[profile]} s"
    return f"{over}, settled at {settled:.1f} s"


def figure(runs: dict[tuple[str, str], pd.DataFrame], path: Path) -> None:
    figure, axes = plt.subplots(3, 2, figsize=(10, 9), layout="constrained")
    for column, profile in zip(axes.T, PROFILES, strict=True):
        torque, error, path_of = column
        for (name, model), color in zip(runs, COLORS[:3] * 2, strict=True):
            if name != profile:
                continue
            run = runs[name, model]
            start = run[run["time"] < 8]
            torque.step(start["time"], start["tau_cmd"], color=color, where="post", label=model)
            early = run[run["time"] < 25]
            error.semilogy(
                early["time"], np.degrees(early["error"].abs()), color=color, linewidth=0.8
            )
            x, y = (np.degrees(run[f"slosh_angle{s}"]) for s in ("_radial", ""))
            if model != "frozen":
                path_of.plot(x, y, color=color, linewidth=0.8)
        error.axhline(np.degrees(TOLERANCE), color="black", linestyle="--", linewidth=0.8)
        error.axvline(DURATION[profile], color="black", linestyle=":", linewidth=0.8)
        torque.set(title=title(runs, profile), xlabel="time (s)", ylabel="torque (N·m)")
        torque.legend()
        error.set(xlabel="time (s)", ylabel="|pointing error| (deg)", ylim=(1e-5, 1))
        path_of.set(xlabel="slosh angle, radial (deg)", ylabel="tangential (deg)", aspect="equal")
        path_of.set(xlim=(-2, 2), ylim=(-2, 2))
        for ax in column:
            ax.grid(alpha=0.3)
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description="A slew with slosh, two profiles.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    runs = results(args.fmu)
    print("profile         model      largest error after the slew (deg)  settled at (s)")
    for (profile, model), run in runs.items():
        after = run[run["time"] > DURATION[profile]]
        largest = np.degrees(after["error"].abs().max())
        print(f"{profile:15} {model:10} {largest:34.4f}  {settling_time(run, profile):14.1f}")
    figure(runs, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
