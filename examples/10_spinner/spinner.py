"""Simulates nutation of a spinning craft with slosh, which grows about the axis of least inertia.

python examples/10_spinner/spinner.py
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

SPIN = 1.1  # rad/s, about z
DAMPED = 31.7569  # viscous damping coefficient of each mode, N·s/m
MASS, LENGTH = 38.3866, 0.163644
"""Mass and length of each mode: kg, m."""
PROLATE, OBLATE = 71.0, 240.0
"""Moment of inertia of the dry craft about z, kg·m², below and above those about x and y."""
START = (0.06, 0.02, SPIN)  # angular velocity at the start, rad/s


def parameters(j_zz: float, slosh: bool = True, omega: tuple = START) -> dict[str, float | int]:
    """Return the FMU's parameters: two tanks at ±0.45 m whose bottoms point outwards.

    ``j_zz`` is the inertia about the spin axis, kg·m², and ``omega`` the angular velocity at the
    start, rad/s. Without ``slosh`` the liquid is rigid.
    """
    values: dict[str, float | int] = {
        "craft.mass": 310.0, "craft.r[3]": 0.05, "craft.Jxx": 152.0, "craft.Jyy": 148.0,
        "craft.Jzz": j_zz, "tanks": 2,
    }  # fmt: skip
    values |= {f"init.omega[{i}]": w for i, w in enumerate(omega, 1)}
    for tank, side in (("tank[1]", 1), ("tank[2]", -1)):
        m_0, H_0, hinge = 102.985, 0.0174912, 0.116718
        values |= {
            f"{tank}.position[1]": side * 0.45, f"{tank}.position[3]": 0.6,
            f"{tank}.q[1]": np.sqrt(0.5), f"{tank}.q[3]": -side * np.sqrt(0.5),
            f"{tank}.I_0": 0.780463, f"{tank}.m_0": m_0, f"{tank}.H_0": H_0,
            f"{tank}.mass[1]": MASS, f"{tank}.length[1]": LENGTH, f"{tank}.hinge[1]": hinge,
            f"{tank}.g_ref": 1.0, f"{tank}.damping_law": "constant",
            f"{tank}.zeta[1]": DAMPED / (2 * MASS * np.sqrt(1.0 / LENGTH)),
        }  # fmt: skip
        if not slosh:
            # add the slosh mass to the rigid liquid at its position
            bob, total = hinge - LENGTH, m_0 + MASS
            centre = (m_0 * H_0 + MASS * bob) / total
            inertia = 0.780463 + m_0 * (H_0 - centre) ** 2 + MASS * (bob - centre) ** 2
            values |= {f"{tank}.m_0": total, f"{tank}.H_0": centre, f"{tank}.I_0": inertia}
            values[f"{tank}.modes"] = 0
    return values


def nutation_pole(fmu: str, j_zz: float) -> complex:
    """Return the pole of the nutation about the steady spin, body axes, 1/s.

    Among all poles, this is the pole whose eigenvector has the largest transverse rate. ``j_zz`` is
    the inertia about the spin axis, kg·m².
    """
    spin = parameters(j_zz, omega=(0, 0, SPIN))
    model = hubslosh.linearize(fmu, spin, ["torque[1]"], ["omega[1]"], all_states=True)
    poles, vectors = np.linalg.eig(model.A)
    rates = [model.states.index(f"omega[{i}]") for i in (1, 2)]
    bobs = [n for n, name in enumerate(model.states) if ".p" in name]
    size = np.abs(vectors[rates]).sum(0) / (np.abs(vectors[bobs]).sum(0) + 1e-9)
    size[poles.imag < 0.01] = 0
    return complex(poles[np.argmax(size)])


def nutation(fmu: str, j_zz: float, stop: float, slosh: bool = True) -> pd.DataFrame:
    """Simulate the craft to the time ``stop``, s, for the inertia ``j_zz`` about the spin axis.

    Return time (s), nutation angle (rad) and dissipated energy (J).
    """
    names = [f"q[{i}]" for i in range(1, 5)] + [f"angular_momentum[{i}]" for i in (1, 2, 3)]
    run = hubslosh.simulate(
        fmu, parameters(j_zz, slosh), stop=stop, step=0.1, outputs=[*names, "dissipated"],
        tolerance=1e-10,
    )  # fmt: skip
    w, x, y, z, *H = run[names].to_numpy().T
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    across = np.linalg.norm(np.cross(axis.T, np.array(H).T), axis=1)
    angle = np.arctan2(across, (axis * H).sum(0))
    return pd.DataFrame({"time": run["time"], "angle": angle, "dissipated": run["dissipated"]})


def mean_growth(history: pd.DataFrame, until: float = np.inf) -> float:
    """Return the mean growth rate of the nutation angle over whole periods of variation, 1/s."""
    part = history[(history["time"] > 60) & (history["time"] < until)]
    return float(np.polyfit(part["time"], np.log(part["angle"]), 1)[0])


def figure(fmu: str) -> plt.Figure:
    """Draw the nutation angle of four craft, each with another ratio of inertias."""
    drawing, axes = plt.subplots(1, 2, figsize=(11, 3.8), layout="constrained")
    for ax, j_zz, text, stop in (
        (axes[0], PROLATE, "Spin about the axis of least inertia: slosh makes nutation grow", 1600),
        (axes[1], OBLATE, "About that of greatest inertia: slosh damps it", 1600),
    ):
        for slosh, color in ((False, "0.6"), (True, COLORS[0])):
            run = nutation(fmu, j_zz, stop, slosh)
            label = "sloshing" if slosh else "rigid liquid"
            ax.plot(run["time"], np.degrees(run["angle"]), color=color, linewidth=0.8, label=label)
        rate = nutation_pole(fmu, j_zz).real
        first = run[run["time"] < 60]["angle"].mean()
        line = np.degrees(first) * np.exp(rate * (run["time"] - 30))
        line[line > 90] = np.nan
        ax.plot(run["time"], line, "--", color=COLORS[1], label=f"pole: {rate:+.2e}/s")
        ax.set(xlabel="time (s)", ylabel="nutation angle (°)", ylim=(0, None))
        ax.set_title(text, fontsize="medium")
        ax.legend(fontsize=8)
    return drawing


def main() -> None:
    parser = argparse.ArgumentParser(description="Nutation of a spinner with slosh.")
    parser.add_argument("--fmu", default="Spacecraft", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    for j_zz in (PROLATE, OBLATE):
        pole = nutation_pole(args.fmu, j_zz)
        run = nutation(args.fmu, j_zz, 600)
        rate = mean_growth(run)
        first, last = np.degrees(run["angle"].iloc[[0, -1]])
        print(f"{j_zz}: pole {pole:.7f}, simulated {rate:.4e}/s; {first:.2f} to {last:.2f} deg; "
              f"{run['dissipated'].iloc[-1]:.3f} J")  # fmt: skip
    run = nutation(args.fmu, PROLATE, 4000)
    print("prolate after 4000 s:", np.degrees(run["angle"].iloc[-1]))
    save(figure(args.fmu), args.out)


if __name__ == "__main__":
    main()
