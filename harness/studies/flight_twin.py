"""Identifies slosh from simulated flights (twins) with slews of 0.3° and gyros of two qualities.

    python flight_twin.py [--gyro good|mems] [--twins 1] [--known exact|wrong|tolerances]

A second simulator, independent of Spacecraft.fmu, flies a rigid craft with two tanks under thrust.
It integrates Newton's law of craft and bobs by Runge–Kutta, as one dense system with the tensions
of the rods as unknowns. Wheels turn the craft by 0.3° to and fro, and thrusters fire sideways. The
recordings of two flights at 10 Hz have three gyros, with errors of scale and alignment and with
biases, and an accelerometer. The fit starts at the values that `hubslosh tank` computes from the
drawing of the tanks, which differ from the true values by up to 10 %. With --known wrong, dry mass,
thrust, hinges and rigid liquids also have errors of the size of their tolerances. With --known
tolerances, the fit takes these tolerances into account.

The program prints estimates and true values; for several twins it also prints how many intervals
contain the true value.
"""

import argparse
import json
import os
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.random import Generator, default_rng

STEP, ROWS = 0.1, 2000  # s
THRUST = 800.0  # N, along z
SLEW = np.radians(0.3)
TANK = """
density = 1000.0
shape = { cylinder = { radius = 0.4, height = 1.0 } }
"""
# position from O of the origin of each tank, which is the tank's lowest point, m
PLACES = ((0.0, 0.0, -0.75), (0.0, 0.0, 0.45))
FILLS = (0.6, 0.35)  # m
NOISE = {  # gyro noise per row and drift, rad/s; accelerometer, m/s²; biases, scale, alignment
    "good": {"w": 9e-6, "drift": 0.0, "a": 3e-4, "b": 5e-6, "scale": 1e-3, "angle": 1e-3},
    "mems": {"w": 2.8e-4, "drift": 5e-5, "a": 3e-3, "b": 1e-3, "scale": 1e-2, "angle": 1e-2},
}


TOLERANCES = {  # standard deviations of known values, relative or in m
    "craft.mass": "0.5%",
    "scale(force[3])": "0.3%",
    "tank[1].hinge[1]": "±0.005",
    "tank[2].hinge[1]": "±0.005",
    "tank[1].m_0": "0.5%",
    "tank[2].m_0": "0.5%",
}


def cross(v: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product v ×."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product a × b; for short vectors it is faster than NumPy's."""
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


class Craft:
    """An independent simulator of the craft, whose parameters have their names in Spacecraft.fmu.

    Vectors are in body axes, and positions are relative to O.
    """

    def __init__(self, p: dict[str, float]) -> None:
        """Compute the rigid part of the craft: dry craft and rigid liquids."""
        mass, at = p["craft.mass"], np.array([p[f"craft.r[{i}]"] for i in (1, 2, 3)])
        inertia = np.diag([p[f"craft.J{i}{i}"] for i in "xyz"])
        rigid = [(mass, at, inertia)]
        bobs = []
        for i, place in enumerate(PLACES, 1):
            d, t = np.array(place), f"tank[{i}]."
            own = np.diag([p[t + "I_0"], p[t + "I_0"], 0.0])
            rigid.append((p[t + "m_0"], d + np.array([0, 0, p[t + "H_0"]]), own))
            m, length = p[t + "mass[1]"], p[t + "length[1]"]
            rate = np.sqrt(p[t + "g_ref"] / length)
            drag = 2.0 * p[t + "zeta[1]"] * m * rate
            bobs.append((m, length, drag, d + np.array([0, 0, p[t + "hinge[1]"]])))
        self.thrust = THRUST * (1.0 + p.get("scale(force[3])", 0.0))
        self.mass = sum(m for m, _, _ in rigid)
        self.moment = sum(m * s for m, s, _ in rigid)
        self.inertia = sum(j - m * cross(s) @ cross(s) for m, s, j in rigid)
        self.bobs = bobs
        self.matrix = np.zeros((6 + 4 * len(bobs), 6 + 4 * len(bobs)))
        self.matrix[:3, :3] = self.mass * np.eye(3)
        self.matrix[:3, 3:6] = -cross(self.moment)
        self.matrix[3:6, :3] = cross(self.moment)
        self.matrix[3:6, 3:6] = self.inertia

    def solve(self, x: np.ndarray, u: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Solve for the specific force, w', and p'' and the tension T of the rod of each bob.

        ``x`` has w, then p and p' of each bob; ``u`` has force, torque and momentum h of the
        wheels; ``slope`` is h'.
        """
        w, (force, torque, h) = x[:3], u.reshape(3, 3)
        m, right = self.matrix.copy(), np.zeros(len(self.matrix))
        right[:3] = force - times(w, times(w, self.moment))
        right[3:6] = torque - slope - times(w, self.inertia @ w + h)
        for i, (mass, length, drag, hinge) in enumerate(self.bobs):
            p, p_dot = x[3 + 6 * i : 6 + 6 * i], x[6 + 6 * i : 9 + 6 * i]
            rho, push, k = hinge + length * p, drag * length * p_dot, 6 + 4 * i
            # the craft feels the tension T p of the rod and the damping force, both at the bob
            right[:3] += push
            right[3:6] += times(rho, push)
            m[:3, k + 3] = -p
            m[3:6, k + 3] = -times(rho, p)
            # m (a + w' × ρ + w × (w × ρ) + 2 l w × p' + l p'') = -T p - drag
            m[k : k + 3, :3] = mass * np.eye(3)
            m[k : k + 3, 3:6] = -mass * cross(rho)
            m[k : k + 3, k : k + 3] = mass * length * np.eye(3)
            m[k : k + 3, k + 3] = p
            turning = times(w, times(w, rho)) + 2.0 * length * times(w, p_dot)
            right[k : k + 3] = -push - mass * turning
            # constraint |p| = 1
            m[k + 3, k : k + 3] = p
            right[k + 3] = -p_dot @ p_dot
        return np.linalg.solve(m, right)

    def rate(self, x: np.ndarray, u: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return the derivative of the state x; for the arguments see `solve`."""
        solved, dx = self.solve(x, u, slope), np.empty_like(x)
        dx[:3] = solved[3:6]
        for i in range(len(self.bobs)):
            dx[3 + 6 * i : 6 + 6 * i] = x[6 + 6 * i : 9 + 6 * i]
            dx[6 + 6 * i : 9 + 6 * i] = solved[6 + 4 * i : 9 + 4 * i]
        return dx

    def fly(self, slew: np.ndarray, pulse: np.ndarray) -> pd.DataFrame:
        """Simulate a flight with commanded attitudes and sideways forces; angles are small."""
        x = np.concatenate([np.zeros(3), *(np.array([0, 0, -1.0, 0, 0, 0]) for _ in self.bobs)])
        angle, h, rows = np.zeros(3), np.zeros(3), []
        # the engine is trimmed, so that its thrust acts through the centre of mass
        total = self.mass + sum(m for m, _, _, _ in self.bobs)
        down = np.array([0.0, 0.0, 1.0])
        center = self.moment + sum(m * (hinge - rod * down) for m, rod, _, hinge in self.bobs)
        trim = times(center / total, np.array([0.0, 0.0, self.thrust]))
        for row in range(ROWS):
            # PD controller: torque of the wheels over the next step
            torque = -np.diag(self.inertia) * (0.5 * (angle - slew[row]) + 0.9 * x[:3])
            torque = np.clip(torque, -3.0, 3.0)
            force = np.array([*pulse[row], self.thrust])
            # the thrusters push 0.2 m above O
            side = times(np.array([0.0, 0.0, 0.2]), np.array([*pulse[row], 0.0]))
            u = np.concatenate([force, trim + side, h])
            commanded = [*force[:2], THRUST, *u[3:]]
            rows.append([row * STEP, *commanded, *x[:3], *self.solve(x, u, -torque)[:3]])
            parts, d = 2, STEP / 2
            for part in range(parts):
                v = u.copy()

                def rate_at(
                    s: float, y: np.ndarray, part: int = part, v: np.ndarray = v
                ) -> np.ndarray:
                    v[6:] = h - torque * (part + s) * d  # noqa: B023
                    return self.rate(y, v, -torque)  # noqa: B023

                k1 = rate_at(0.0, x)
                k2 = rate_at(0.5, x + d / 2 * k1)
                k3 = rate_at(0.5, x + d / 2 * k2)
                k4 = rate_at(1.0, x + d * k3)
                before = x[:3].copy()
                x = x + d / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                angle = angle + d / 2 * (before + x[:3])
            h = h - torque * STEP
        return pd.DataFrame(rows, columns=["time", *INPUTS, *OMEGA, *FORCE])


def names(what: str) -> list[str]:
    """Return the names of the three components of a vector variable."""
    return [f"{what}[{i}]" for i in (1, 2, 3)]


INPUTS = [*names("force"), *names("torque"), *names("h_wheels")]
OMEGA, FORCE = names("omega"), names("specific_force")


def drawn_tanks(program: str, folder: Path) -> dict[str, float]:
    """Return the modal parameters of both tanks by `hubslosh tank`."""
    drawing, found = folder / "tank.toml", {}
    drawing.write_text(TANK, encoding="utf-8")
    for i, fill in enumerate(FILLS, 1):
        command = [program, "-q", "tank", drawing, "--fill", str(fill), "--modes", "1", "--json"]
        done = subprocess.run([*command, "--gravity", "0.5"], check=True, capture_output=True)
        tank = json.loads(done.stdout)
        mode, rigid, t = tank["modes"][0], tank["rest"][0], f"tank[{i}]."
        found |= {
            t + "mass[1]": mode["m"],
            t + "length[1]": mode["l"],
            t + "hinge[1]": mode["hinge"],
            t + "m_0": rigid["m_0"],
            t + "H_0": rigid["H_0"],
            t + "I_0": rigid["I_0"],
            t + "zeta[1]": 0.005,
            t + "g_ref": 0.5,
        }
    return found


def manoeuvre(flight: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the commanded attitudes (rad) and sideways forces (N) of a flight, row by row."""
    time = STEP * np.arange(ROWS)
    slew, pulse = np.zeros((ROWS, 3)), np.zeros((ROWS, 2))
    for k, start in enumerate(range(10, 190, 20)):
        on = (time >= start) & (time < start + 10)
        slew[on, (k + flight) % 3] = SLEW * (-1) ** (k // 3)
    for k, start in enumerate((20, 55, 90, 125)):
        on = (time >= start + 3 * flight) & (time < start + 3 * flight + 1.5)
        pulse[on, (k + flight) % 2] = 22.0 * (-1) ** (k // 2)
    return slew, pulse


def measured(
    random: Generator,
    flight: pd.DataFrame,
    noise: dict[str, float],
    errors: np.ndarray,
    truth: dict,
) -> pd.DataFrame:
    """Return the readings of the sensors in a flight, and add their biases to ``truth``.

    ``noise`` has the standard deviation of each sensor's noise, and ``errors`` their scale errors.
    """
    number = 1 + sum(name.startswith("bias(omega[1])") for name in truth)
    table = flight.copy()
    table[OMEGA] = flight[OMEGA].to_numpy() @ (np.eye(3) + errors).T
    keep = np.exp(-STEP / 300.0)
    for name in [*OMEGA, *FORCE]:
        gyro = name in OMEGA
        bias = (noise["b"] if gyro else 1e-3) * random.normal()
        truth[f"bias({name})@{number}"] = bias
        table[name] += bias + noise["w" if gyro else "a"] * random.normal(size=ROWS)
        if gyro and noise["drift"]:
            drift = [noise["drift"] * random.normal()]
            for kick in noise["drift"] * np.sqrt(1 - keep**2) * random.normal(size=ROWS - 1):
                drift.append(keep * drift[-1] + kick)
            table[name] += drift
            # the mean of the drift counts as bias, because a flight cannot separate the two
            truth[f"bias({name})@{number}"] += np.mean(drift)
    return table


def deviation(name: str, start: dict[str, float]) -> float:
    """Return the standard deviation with which the value ``name`` is known before the flight."""
    size = TOLERANCES[name]
    if not size.endswith("%"):
        return float(size.removeprefix("±"))
    return float(size.removesuffix("%")) / 100 * start.get(name, 1.0)


def free_flags(start: dict[str, float], noise: dict[str, float], known_as: str) -> list[str]:
    """Return the options of `hubslosh identify` and `design`, except the names of files."""
    free = [f"craft.J{i}{i}={start[f'craft.J{i}{i}']}:200:2500" for i in "xyz"]
    free += [f"{name}={start[name]}:-1:1" for name in names("craft.r")]
    for i in (1, 2):
        mass, length = start[f"tank[{i}].mass[1]"], start[f"tank[{i}].length[1]"]
        free.append(f"tank[{i}].mass[1]={mass}:{0.5 * mass}:{2 * mass}")
        free.append(f"tank[{i}].length[1]={length}:{0.6 * length}:{1.6 * length}")
        free.append(f"tank[{i}].zeta[1]=0.005:0.0005:0.05")
    known = {"tanks": 2, "craft.mass": start["craft.mass"]}
    for i, place in enumerate(PLACES, 1):
        t = f"tank[{i}]."
        known |= {t + f"position[{k}]": at for k, at in enumerate(place, 1)}
        known |= {t + n: start[t + n] for n in ("m_0", "H_0", "I_0", "hinge[1]", "g_ref")}
        known |= {t + "modes": 1, t + "damping_law": "constant"}
    flags = [
        "--free",
        ",".join(free),
        "--triad",
        f"{','.join(OMEGA)}={noise['scale']}:{noise['angle']}",
    ]
    flags += [
        "--bias",
        ",".join([*(f"{n}={noise['b']}" for n in OMEGA), *(f"{n}=1e-3" for n in FORCE)]),
    ]
    flags += ["--inputs", ",".join([f"{name}:held" for name in INPUTS[:6]] + INPUTS[6:])]
    flags += ["--outputs", ",".join([*OMEGA, *FORCE])]
    for name, value in known.items():
        flags += ["--set", f"{name}={value}"]
    if known_as == "tolerances":
        flags += ["--tolerance", ",".join(f"{n}={size}" for n, size in TOLERANCES.items())]
    return flags


def twin(
    seed: int, kind: str, program: str, fmu: str, folder: Path, known_as: str = "exact"
) -> tuple[dict, dict[str, Any], float]:
    """Simulate and identify one flight; return true values, result and CPU time (s).

    ``known_as`` says how the actuators' scales are given: as exact, or with their uncertainty.
    """
    random, noise = default_rng(seed), NOISE[kind]
    start = drawn_tanks(program, folder) | {"craft.mass": 1180.0}
    start |= {"craft.Jxx": 910.0, "craft.Jyy": 860.0, "craft.Jzz": 640.0}
    start |= {"craft.r[1]": 0.0, "craft.r[2]": 0.0, "craft.r[3]": 0.21}
    truth = dict(start)
    for name in start:
        if "mass[1]" in name or "length" in name or "craft.J" in name:
            truth[name] *= random.uniform(0.9, 1.1)
        if "zeta" in name:
            truth[name] = random.uniform(0.003, 0.008)
        if "craft.r" in name:
            truth[name] += random.uniform(-0.01, 0.01)
    if known_as != "exact":
        others = default_rng([seed, 1])
        for name in TOLERANCES:
            truth[name] = start.get(name, 0.0) + deviation(name, start) * others.normal()
    errors = np.where(np.eye(3) > 0, noise["scale"], noise["angle"]) * random.normal(size=(3, 3))
    for i, read in enumerate(OMEGA):
        for j, of in enumerate(OMEGA):
            truth[f"scale({read})" if i == j else f"cross({read},{of})"] = errors[i, j]
    craft, files = Craft(truth), []
    for flight in (0, 1):
        files.append(folder / f"{kind}{seed}_{flight + 1}.csv")
        table = measured(random, craft.fly(*manoeuvre(flight)), noise, errors, truth)
        table.to_csv(files[-1], index=False)
    result = folder / f"{kind}{seed}.json"
    flags = [*free_flags(start, noise, known_as), *(["--drift"] if noise["drift"] else [])]
    command = [program, "-q", "identify", *files, "--fmu", fmu, *flags, "--out", result]
    before = os.times().children_user
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return truth, json.loads(result.read_text(encoding="utf-8")), os.times().children_user - before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gyro", default="good", choices=list(NOISE), help="which gyro")
    parser.add_argument(
        "--known", default="exact", choices=["exact", "wrong", "tolerances"], help="known values"
    )
    parser.add_argument("--twins", type=int, default=1, help="how many")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--program", default="hubslosh", help="the program")
    parser.add_argument("--fmu", default="Spacecraft", help="the FMU")
    parser.add_argument("--keep", type=Path, help="a folder in which recordings are kept")
    arguments = parser.parse_args()
    seen: dict[str, list[tuple[bool, float, float]]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        for seed in range(arguments.first, arguments.first + arguments.twins):
            truth, found, seconds = twin(
                seed, arguments.gyro, arguments.program, arguments.fmu, folder, arguments.known
            )
            fits, outside = found["fits"] and found["converged"], []
            for name, e in (found["parameters"] | found["measurement"]).items():
                low, high = e["interval"]
                off, inside = e["value"] - truth[name], low <= truth[name] <= high
                if not inside:
                    outside.append(f"{name} {off / e['std']:+.1f}")
                if fits:
                    seen[name].append((inside, off / e["std"], e["std"]))
                if arguments.twins == 1:
                    print(f"{name:28} {truth[name]:12.5g} {e['value']:12.5g} ± {e['std']:.2g}")
            said = f"fits: {fits}, outside: {', '.join(outside) or 'none'}"
            print(f"twin {seed}: {seconds:.0f} s of CPU time, {said}", flush=True)
    print("| unknown | inside its 95 % interval | rms of error/σ | σ, % |")
    print("| --- | --- | --- | --- |")
    for name, rows in seen.items():
        inside, off, std = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
        percent = 100 * np.median(std) / abs(truth[name])
        print(
            f"| `{name}` | {int(inside.sum())} of {len(rows)} "
            f"| {np.sqrt((off**2).mean()):.2f} | {percent:.2g} |"
        )
    fitted = [name for name in seen if name.startswith(("craft", "tank")) and "@" not in name]
    for words, group in (
        ("known values", [name for name in fitted if name in TOLERANCES]),
        ("the others of craft and tanks", [name for name in fitted if name not in TOLERANCES]),
    ):
        rows = [row for name in group for row in seen[name]]
        print(f"| {words} | {sum(inside for inside, _, _ in rows)} of {len(rows)} | | |")


if __name__ == "__main__":
    main()
