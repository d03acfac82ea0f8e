"""Agile slew of an Earth-observation satellite with two tanks and an observer of the slosh torque.

Three runs are compared: rigid liquid, sloshing liquid, and sloshing liquid with the observer.

python examples/9_agile_slew/agile_slew.py
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.linalg import solve_discrete_are

import hubslosh
from hubslosh.plot import COLORS, save

PERIOD = 0.1  # s, cycle of the controller; its torque acts one cycle later
SLEW, DURATION = np.radians(30), 20.0
"""Slew about the roll axis: angle (rad), duration (s)."""
STOP, SHOWN = 500.0, 120.0  # s, of the simulation and of the figure
BANDWIDTH, DAMPING = 0.25, 0.9
"""Bandwidth and damping ratio of attitude control for a rigid craft: rad/s, 1."""
NOISE = 2e-6  # rad/s, standard deviation of a gyro sample
UNKNOWN = 1e-3
"""Standard deviation of the filter's process noise in the liquid's rate, 1/s per cycle."""
POINTING, RATE = np.radians(2e-3), np.radians(1e-3)
"""Imaging begins when the errors stay below these limits: rad, rad/s."""

J_XX = 450.0  # kg·m², inertia of the dry craft about roll
MASS, LENGTH, FIXED, ARM = 35.0, 0.15, 45.0, 0.5
"""Each tank: slosh mass (kg), pendulum length (m), rigid liquid (kg), distance from roll (m)."""
OWN = 0.5  # kg·m², inertia of a tank's rigid liquid about its own axis
FREQUENCY, ZETA = 0.08, 0.01
"""Frequency (Hz) and damping ratio of weightless liquid on its diaphragm in a fixed craft."""


def parameters(slosh: bool = True, frequency: float = FREQUENCY) -> dict[str, float | int]:
    """Return the FMU's parameters: tanks at ±ARM with their axes along the thrust axis x.

    ``frequency`` is the slosh frequency, Hz. Without ``slosh`` the liquid is rigid.
    """
    values: dict[str, float | int] = {
        "craft.mass": 900.0, "craft.Jxx": J_XX, "craft.Jyy": 380.0, "craft.Jzz": 400.0, "tanks": 2,
        "craft.r[1]": 0.0, "craft.r[2]": 0.0, "craft.r[3]": 0.0,
    }  # fmt: skip
    for tank, side in (("tank[1]", 1), ("tank[2]", -1)):
        values |= {
            f"{tank}.position[1]": 0.0, f"{tank}.position[2]": side * ARM,
            f"{tank}.position[3]": 0.0,
            f"{tank}.q[1]": np.sqrt(0.5), f"{tank}.q[3]": np.sqrt(0.5),
            f"{tank}.m_0": FIXED, f"{tank}.H_0": 0.0, f"{tank}.I_0": 0.7, f"{tank}.I_z": OWN,
            f"{tank}.mass[1]": MASS, f"{tank}.length[1]": LENGTH, f"{tank}.hinge[1]": LENGTH,
            f"{tank}.k[1]": MASS * (2 * np.pi * frequency) ** 2, f"{tank}.zeta[1]": ZETA,
            f"{tank}.g_ref": 1e-9, f"{tank}.damping_law": "constant",
        }  # fmt: skip
        if not slosh:
            values |= {f"{tank}.m_0": FIXED + MASS, f"{tank}.modes": 0}
    return values


RIGID = J_XX + 2 * (OWN + (FIXED + MASS) * ARM**2)
"""Roll inertia with rigid liquid, kg·m²."""


def reference(time: float) -> tuple[float, float, float]:
    """Return roll angle (rad), rate and acceleration of the slew at ``time``, s.

    The acceleration is one period of a sine.
    """
    t = np.clip(time, 0.0, DURATION)
    w = 2 * np.pi / DURATION
    angle = SLEW * (t - np.sin(w * t) / w) / DURATION
    rate = SLEW * (1 - np.cos(w * t)) / DURATION
    return angle, rate, SLEW * w * np.sin(w * t) / DURATION


class Observer:
    """Kalman filter that estimates roll rate and slosh from the gyro and the commanded torques."""

    def __init__(self, fmu: str, frequency: float) -> None:
        """Linearize the FMU with the assumed slosh frequency ``frequency`` (Hz)."""
        believed = parameters(frequency=frequency)
        model = hubslosh.linearize(fmu, believed, ["torque[1]"], ["omega[1]"])
        self.rate = model.states.index("omega[1]")
        self.A, self.B = model.A[self.rate], model.B[self.rate, 0]
        self.inertia = 1 / self.B  # kg·m², inertia against a sudden torque
        sampled = model.sampled(PERIOD)
        self.transition, self.input = sampled.A, sampled.B[:, 0]
        C = np.zeros((1, len(self.transition)))
        C[0, self.rate] = 1
        liquid = np.array([".p_dot[" in name for name in model.states])
        Q = np.diag(liquid * UNKNOWN**2)
        P = solve_discrete_are(self.transition.T, C.T, Q, [[NOISE**2]])
        self.gain = (P @ C.T / (C @ P @ C.T + NOISE**2))[:, 0]
        self.x = np.zeros(len(self.transition))

    def slosh_torque(self, x: np.ndarray) -> float:
        """Return the torque of the sloshing liquid on the craft, N·m, at the state ``x``."""
        return float(self.inertia * (self.A @ x))

    def update(self, measured: float, torque: float) -> tuple[float, float]:
        """Return the slosh torque one cycle ahead, and its mean over the next cycle, N·m.

        ``measured`` is the roll rate, rad/s; ``torque`` is the last command, which acts in the
        present cycle, N·m.
        """
        self.x += self.gain * (measured - self.x[self.rate])
        self.x = self.transition @ self.x + self.input * torque
        then = self.transition @ self.x + self.input * torque
        return self.slosh_torque(self.x), self.slosh_torque((self.x + then) / 2)


def slew(
    fmu: str,
    slosh: bool = True,
    observe: bool = False,
    frequency: float = FREQUENCY,
    stop: float = STOP,
) -> pd.DataFrame:
    """Simulate one slew; the column ``estimate`` is the observer's slosh torque, N·m.

    ``observe`` says whether the controller compensates this torque, and ``frequency`` is the slosh
    frequency that the observer assumes, Hz.
    """
    observer = Observer(fmu, frequency) if slosh else None
    random = np.random.default_rng(1)
    kp, kd = BANDWIDTH**2, 2 * DAMPING * BANDWIDTH
    estimates: list[float] = []
    last = 0.0

    def law(time: float, measured: np.ndarray) -> float:
        nonlocal last
        q1, q2, omega = measured
        omega += random.normal(0.0, NOISE)
        angle = 2 * np.arctan2(q2, q1)
        # The command acts during the next cycle, on average 1.5 cycles from now.
        _, _, ahead = reference(time + 1.5 * PERIOD)
        wanted, rate, _ = reference(time)
        acceleration = ahead + kp * (wanted - angle) + kd * (rate - omega)
        command = RIGID * acceleration
        if observer:
            estimate, mean = observer.update(omega, last)
            estimates.append(estimate)
            if observe:
                command = observer.inertia * acceleration - mean
        last = command
        return command

    names = ["q[1]", "q[2]", "omega[1]", "omega_dot[1]", "slosh_torque[1]"]
    run = hubslosh.closed_loop(
        law, PERIOD, stop, fmu, parameters(slosh), measured=names[:3], command="torque[1]",
        latency=1, outputs=[*names, "tank[1].angle_y[1]"], tolerance=1e-8,
    )  # fmt: skip
    angle, rate, _ = np.array([reference(t) for t in run["time"]]).T
    run["error"] = 2 * np.arctan2(run["q[2]"], run["q[1]"]) - angle
    run["rate_error"] = run["omega[1]"] - rate
    if observer:
        # By Newton and Euler the slosh torque is J omega' less the torque that acts. At a
        # communication point omega_dot still belongs to the torque of the step that ends there.
        acted = run["torque[1]"].shift(1, fill_value=0.0)
        run["slosh"] = observer.inertia * run["omega_dot[1]"] - acted
        run["estimate"] = [np.nan, *estimates]
    return run


def tranquillisation(run: pd.DataFrame) -> float:
    """Return the time from the end of the slew until imaging can begin, s."""
    late = run[run["time"] >= DURATION]
    out = late[(late["error"].abs() > POINTING) | (late["rate_error"].abs() > RATE)]
    return float(out["time"].iloc[-1] - DURATION) if len(out) else 0.0


def figure(runs: dict[str, pd.DataFrame]) -> plt.Figure:
    drawing, axes = plt.subplots(
        2, 1, figsize=(9, 5.6), sharex=True, layout="constrained", height_ratios=(2, 1)
    )
    for (name, run), color in zip(runs.items(), ("0.5", COLORS[1], COLORS[0]), strict=True):
        run = run[run["time"] <= SHOWN]
        # the rigid run's line is dashed and drawn over the observer's, which it nearly equals
        line = {"linestyle": ":", "zorder": 3} if name == "liquid rigid" else {}
        axes[0].plot(run["time"], 1e3 * np.degrees(run["error"]), color=color, label=name, **line)
    axes[0].axhspan(-1e3 * np.degrees(POINTING), 1e3 * np.degrees(POINTING), color="0.9")
    wait = tranquillisation(runs["sloshing"]) / 60
    observed = tranquillisation(runs["sloshing, with observer"])
    at_once = "at once" if observed == 0 else f"after {observed:.0f} s"
    axes[0].set(ylabel="pointing error (0.001°)")
    axes[0].set_title(
        f"Knowing the slosh: image {at_once}. Not knowing it: image after {wait:.0f} minutes"
    )
    run = runs["sloshing, with observer"]
    run = run[run["time"] <= SHOWN]
    axes[1].plot(run["time"], 1e3 * run["slosh"], color=COLORS[0], label="slosh torque")
    axes[1].plot(
        run["time"], 1e3 * run["estimate"], "--", color="k", linewidth=1, label="estimated"
    )
    axes[1].set(ylabel="roll torque (mN·m)", xlabel="time (s)")
    for ax in axes:
        ax.axvspan(0, DURATION, color="0.93", zorder=0, linewidth=0)
        ax.margins(x=0)
        ax.legend(fontsize=9, loc="upper right", framealpha=1)
    top = axes[0].get_xaxis_transform()
    axes[0].text(DURATION / 2, 0.96, "slew", transform=top, ha="center", va="top", color="0.4")
    return drawing


def all_runs(fmu: str) -> dict[str, pd.DataFrame]:
    """Return the three runs by name: with rigid liquid, without and with slosh compensation."""
    return {
        "liquid rigid": slew(fmu, slosh=False),
        "sloshing": slew(fmu),
        "sloshing, with observer": slew(fmu, observe=True),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Agile slew of an Earth observer.")
    parser.add_argument("--fmu", default="Spacecraft", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    runs = all_runs(args.fmu)
    for name, run in runs.items():
        late = run[run["time"] >= DURATION]
        text = f"{name}: largest error in the slew {np.degrees(run['error'].abs().max()):.4f} deg, "
        text += f"after it {np.degrees(late['error'].abs().max()):.5f} deg, "
        text += f"imaging after {tranquillisation(run):.1f} s"
        if "slosh" in run:
            text += f"; slosh torque up to {run['slosh'].abs().max():.4f} N·m, "
            text += f"estimated to {(run['slosh'] - run['estimate']).abs().max():.4f} N·m, "
            text += f"angle up to {np.degrees(run['tank[1].angle_y[1]'].abs().max()):.1f} deg"
        print(text)
    for share in (0.9, 1.1):
        run = slew(args.fmu, observe=True, frequency=share * FREQUENCY)
        late = run[run["time"] >= DURATION]
        print(f"observer's frequency x {share}: {np.degrees(late['error'].abs().max()):.5f} deg "
              f"after the slew, imaging after {tranquillisation(run):.1f} s")  # fmt: skip
    save(figure(runs), args.out)


if __name__ == "__main__":
    main()
