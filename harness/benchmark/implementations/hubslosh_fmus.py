"""Computes the cases by the FMUs of HubSlosh.

    python3 hubslosh_fmus.py RESULTS_FOLDER [CASE ...]

It needs the Python package (``pip install hubslosh``). ``--fmus FOLDER`` uses the FMUs in a folder
instead of the FMUs of the package.
"""

import argparse
import csv
import math
from pathlib import Path

import numpy as np
import pandas as pd

import cases
import hubslosh

TOLERANCE = 1e-13
FOLDER: Path | None = None
MEASURED = Path(__file__).resolve().parents[2] / "studies" / "measured" / "results.csv"


def fmu(name: str) -> str | Path:
    """Return the file of an FMU, or its name in the package."""
    return FOLDER / f"{name}.fmu" if FOLDER else name


def put(settings: dict, name: str, values) -> None:
    """Store the components of a vector in ``settings``."""
    settings.update({f"{name}[{i}]": float(x) for i, x in enumerate(values, 1)})


# ------------------------------------------------------------------------------ bench, friction


def bench(case: str) -> np.ndarray:
    p = cases.parameters(case)
    spherical = case == "bench_spherical"
    settings = {
        "slosh.model": "spherical" if spherical else "linear",
        "slosh.source": "table",
        "slosh.modes": 1,
        "slosh.table.m_liq": p["m_0"] + p["m"],
        "slosh.table.mass[1]": p["m"],
        "slosh.table.length[1]": p["l"],
        "slosh.table.zeta[1]": p["zeta"],
        "slosh.damping_law": "constant_ratio",
        "hub.I": p["I"],
        "tank.r": p["r"],
        "g_axial": p["g"],
        "friction.model": "stribeck",
        "friction.b": p["b"],
        "friction.c": p["c_f"],
        "friction.d": p["d_f"],
        "friction.omega_s": p["omega_s"],
    }
    if spherical:
        settings["init.slosh_angle_radial"] = math.asin(p["p_x_0"])
        settings["init.slosh_angle"] = math.asin(p["p_y_0"])
    else:
        settings["init.slosh_angle"] = p["alpha_0"]
    time, torque = cases.inputs(case)
    table = pd.DataFrame({"time": time, "tau_cmd": torque[:, 0]})
    columns = ["theta", "omega", "slosh_angle", "slosh_angle_radial"]
    run = hubslosh.simulate(
        fmu("HubSlosh"), settings, table, time[-1], cases.INTERVAL[case], columns,
        tolerance=TOLERANCE, hold=True,
    )  # fmt: skip
    time, theta, omega, y, x = run[["time", *columns]].to_numpy().T
    bobs = [np.sin(x), np.sin(y)] if spherical else [y]
    return np.column_stack([time, theta, omega, *bobs])


# --------------------------------------------------------------------------------------- six axes


def turned(axis: np.ndarray) -> np.ndarray:
    """Return the quaternion of the shortest rotation from the z axis to ``axis``."""
    q = np.array([1 + axis[2], -axis[1], axis[0], 0.0])
    return q / np.linalg.norm(q)


def matrix_of(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a quaternion, scalar first."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def rigid(p: dict) -> dict:
    """Return the FMU's parameters of the rigid part of a craft."""
    settings = {f"craft.J{a}": float(p[f"J_{a}"]) for a in ("xx", "yy", "zz", "xy", "xz", "yz")}
    settings["craft.mass"] = p["mass"]
    put(settings, "craft.r", p["center"])
    put(settings, "init.omega", p["omega_0"])
    return settings


def with_tanks(p: dict) -> tuple[dict, list[np.ndarray]]:
    """Return the FMU's parameters of a craft with pendulums, and matrices from tank to body axes.

    The tanks have no rigid liquid, because the rigid part in the specification contains it.
    """
    settings = {**rigid(p), "tanks": len(p["tank"])}
    axes = []
    for i, tank in enumerate(p["tank"], 1):
        q = turned(tank["axis"])
        axes.append(matrix_of(q))
        name = f"tank[{i}]"
        stiffness = 1.0 / tank["l"] + tank["k"] / tank["m"]
        settings |= {
            f"{name}.m_0": 0.0, f"{name}.I_0": 0.0, f"{name}.H_0": 0.0, f"{name}.modes": 1,
            f"{name}.mass[1]": tank["m"], f"{name}.length[1]": tank["l"],
            f"{name}.hinge[1]": 0.0, f"{name}.k[1]": tank["k"], f"{name}.g_ref": 1.0,
            f"{name}.zeta[1]": tank["c"] / (2 * tank["m"] * math.sqrt(stiffness)),
            f"{name}.damping_law": "constant",
        }  # fmt: skip
        put(settings, f"{name}.position", tank["hinge"])
        put(settings, f"{name}.q", q)
        for key in ("p_0", "p_dot_0"):
            for k, x in enumerate(axes[-1].T @ tank[key], 1):
                settings[f"{name}.{key}[1,{k}]"] = float(x)
    return settings, axes


def that_drains(p: dict) -> tuple[dict, list[np.ndarray]]:
    """Return the FMU's parameters of the craft whose tank drains: a fill table with two points."""
    settings = {**rigid(p), "tanks": 1, "mass_flow[1]": p["flow"]}
    name = "tank[1]"
    settings |= {
        f"{name}.modes": 1, f"{name}.fill.points": 2, f"{name}.liquid_0": p["M_0"],
        f"{name}.outlet": p["outlet"], f"{name}.g_ref": 1.0, f"{name}.damping_law": "constant",
        f"{name}.k[1]": 0.0, f"{name}.zeta[1]": p["gamma"] * math.sqrt(p["l"]) / 2,
    }  # fmt: skip
    for i, liquid in enumerate((100.0, 400.0), 1):
        settings |= {
            f"{name}.fill.liquid[{i}]": liquid,
            f"{name}.fill.H_0[{i}]": p["H_b"] + p["H_M"] * liquid,
            f"{name}.fill.I_0[{i}]": p["iota"] * liquid,
            f"{name}.fill.mass[1,{i}]": p["mu"] * liquid,
            f"{name}.fill.length[1,{i}]": p["l"],
            f"{name}.fill.hinge[1,{i}]": p["h_b"] + p["h_M"] * liquid + p["l"],
        }
    put(settings, f"{name}.position", p["position"])
    for key in ("p_0", "p_dot_0"):
        settings |= {f"{name}.{key}[1,{k}]": float(x) for k, x in enumerate(p[key], 1)}
    return settings, [np.eye(3)]


WRENCH = [f"{port}[{i}]" for port in ("force", "torque") for i in (1, 2, 3)]


def columns_of(count: int) -> list[str]:
    """Return the names of rate, velocity and directions of ``count`` slosh masses in the FMU."""
    names = [f"{name}[{i}]" for name in ("omega", "velocity") for i in (1, 2, 3)]
    return names + [f"tank[{i}].p[1,{k}]" for i in range(1, count + 1) for k in (1, 2, 3)]


def body(values: np.ndarray, axes: list[np.ndarray]) -> np.ndarray:
    """Return rows of results with the directions of slosh masses transformed to body axes.

    ``axes`` has the matrix from tank to body axes of each tank.
    """
    rows = [values[:, :6]]
    rows += [values[:, 6 + 3 * i : 9 + 3 * i] @ turn.T for i, turn in enumerate(axes)]
    return np.hstack(rows)


def craft(case: str) -> np.ndarray:
    """Return the rows of a case in six axes."""
    p = cases.parameters(case)
    settings, axes = that_drains(p) if case == "draining" else with_tanks(p)
    pieces = cases.segments(case)
    wrench = np.array([*(piece[2] for piece in pieces), pieces[-1][2]])
    table = pd.DataFrame(wrench, columns=WRENCH)
    table.insert(0, "time", [piece[0] for piece in pieces] + [pieces[-1][1]])
    names = columns_of(len(axes))
    run = hubslosh.simulate(
        fmu("Spacecraft"), settings, table, pieces[-1][1], cases.INTERVAL[case], names,
        tolerance=TOLERANCE, hold=True,
    )  # fmt: skip
    return np.column_stack([run["time"], body(run[names].to_numpy(), axes)])


def spinner() -> np.ndarray:
    """Simulate the closed loop of the spinner and return its rows."""
    p = cases.parameters("spinner")
    settings, axes = with_tanks(p)
    names, rows = columns_of(len(axes)), []
    every, skip = p["every"], round(cases.INTERVAL["spinner"] / p["every"])
    wanted = np.array([0, 0, p["spin"]])

    def torque(omega):
        return np.clip(p["K"] * (wanted - np.array(omega)), -p["most"], p["most"])

    put(settings, "torque", torque(p["omega_0"]))
    with hubslosh.Plant(fmu("Spacecraft"), settings, tolerance=TOLERANCE) as plant:
        for k in range(round(p["end"] / every) + 1):
            values = plant.get(names)
            if k % skip == 0:
                rows.append([k * every, *values])
            if k < round(p["end"] / every):
                acting = torque(values[:3])
                for i, x in enumerate(acting.tolist(), 1):
                    plant.set(f"torque[{i}]", x)
                plant.step((k + 1) * every)
    rows = np.array(rows)
    return np.column_stack([rows[:, 0], body(rows[:, 1:], axes)])


def linearisation() -> np.ndarray:
    """Return the frequency responses from directional derivatives of the FMU."""
    p = cases.parameters("linearisation")
    settings, _ = with_tanks(cases.linearised_craft())
    settings["force[3]"] = p["thrust"]
    model = hubslosh.linearize(
        fmu("Spacecraft"), settings, ["torque[2]", "force[1]"], ["omega[2]", "specific_force[1]"]
    )
    a, b, c, d = (np.asarray(x) for x in model)
    rows = []
    for frequency in cases.frequencies():
        response = c @ np.linalg.solve(1j * frequency * np.eye(len(a)) - a, b) + d
        rate, force = response[0, 0], response[1, 1]
        rows.append([frequency, rate.real, rate.imag, force.real, force.imag])
    return np.array(rows)


# ------------------------------------------------------------------------------ finite amplitude


def still_tank(s: float, kappa: float, g: float, place, rate=(0.0, 0.0, 0.0)) -> dict:
    """Return the FMU's parameters of a tank at rest with only a slosh mass of 1 kg and 1 m.

    s and kappa are its coefficients of third order, g is the specific force, ``place`` its
    direction and ``rate`` the rate of the direction at the start.
    """
    settings = {
        "tank.modes": 1, "tank.m_0": 0.0, "tank.I_0": 0.0, "tank.H_0": 0.0,
        "tank.position[3]": 0.0, "tank.mass[1]": 1.0, "tank.length[1]": 1.0, "tank.hinge[1]": 0.0,
        "tank.zeta[1]": 0.0, "tank.damping_law": "constant", "tank.g_ref": g,
        "tank.nonlinear_inertia[1]": s, "tank.nonlinear_stiffness[1]": kappa, "a[3]": g,
    }  # fmt: skip
    settings |= {f"tank.p_0[1,{k}]": float(x) for k, x in enumerate(place, 1)}
    return settings | {f"tank.p_dot_0[1,{k}]": float(x) for k, x in enumerate(rate, 1)}


def backbones() -> np.ndarray:
    """Return the frequency of free waves at each amplitude of the case "backbones".

    Planar waves are integrated over a quarter period; in circular waves forces balance.
    """
    rows = []
    names = ["tank.p[1,1]", "tank.p_dot[1,1]"]
    for number, (_, degrees, s, kappa) in enumerate(cases.inputs_of_backbones(), 1):
        largest = math.sin(math.radians(degrees))
        start = [largest, 0.0, -math.sqrt(1 - largest**2)]
        step = 0.02
        run = hubslosh.simulate(
            fmu("SloshTank"), still_tank(s, kappa, 1.0, start), None, 2.0, step, names,
            tolerance=TOLERANCE,
        )  # fmt: skip
        time, x, x_d = run[["time", *names]].to_numpy().T
        at = int(np.flatnonzero(np.diff(np.sign(x)))[0])
        # time of the crossing, by interpolation of the time over x
        near = slice(at - 3, at + 5)
        quarter = hermite(x[near], time[near], 1 / x_d[near])

        def radial(speed, start=start, s=s, kappa=kappa):
            settings = still_tank(s, kappa, 1.0, start, (0.0, speed, 0.0))
            with hubslosh.Plant(fmu("SloshTank"), settings) as tank:
                return tank.get(["der(tank.p_dot[1,1])"])[0]

        at_rest, faster = radial(0.0), radial(1.0)
        square = -at_rest / (faster - at_rest + 1 / largest)
        rows.append([number, math.pi / 2 / quarter, math.sqrt(square) / largest])
    return np.array(rows)


def hermite(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> float:
    """Return y at x = 0 by Hermite interpolation of values and slopes (divided differences)."""
    z = np.repeat(x, 2)
    table = np.repeat(y, 2).astype(float)
    coefficients = [table[0]]
    for order in range(1, len(z)):
        new = []
        for i in range(len(z) - order):
            gap = z[i + order] - z[i]
            new.append(slope[i // 2] if gap == 0 else (table[i + 1] - table[i]) / gap)
        table = np.array(new)
        coefficients.append(table[0])
    value, product = 0.0, 1.0
    for c, at in zip(coefficients, z, strict=True):
        value += c * product
        product *= -at
    return value


def forced() -> np.ndarray:
    """Return cosine and sine amplitude of the liquid's centre in the case "forced".

    They are fitted to the last 15 of 150 periods.
    """
    p, rows = cases.parameters("forced"), []
    natural = math.sqrt(p["g"] / p["l"])
    pieces = 384  # linear pieces of the input per period; every sixth point is used, as on the page
    for number, forcing in enumerate(p["forcing"], 1):
        w = forcing["ratio"] * natural
        start = [0.0, p["across"], -math.sqrt(1 - p["across"] ** 2)]
        settings = still_tank(p["s"], p["kappa"], p["g"], start)
        settings |= {"tank.mass[1]": p["m"], "tank.length[1]": p["l"], "tank.zeta[1]": p["zeta"]}
        # linear interpolation multiplies the fundamental of the sine by sinc^2, which is corrected
        turns = np.arange(150 * pieces + 1) / pieces
        raised = forcing["stroke"] * w * w / np.sinc(1 / pieces) ** 2
        time = 2 * math.pi / w * turns
        inputs = pd.DataFrame({"time": time, "a[1]": raised * np.cos(2 * math.pi * turns)})
        inputs["a[3]"] = p["g"]
        del settings["a[3]"]
        run = hubslosh.simulate(
            fmu("SloshTank"), settings, inputs, outputs=["tank.p[1,1]"], tolerance=1e-11
        )
        last = slice(135 * pieces, 150 * pieces, pieces // 64)
        x = 1e3 * p["share"] * p["l"] * run["tank.p[1,1]"].to_numpy()[last]
        angle = 2 * math.pi * turns[last]
        rows.append([number, 2 * np.mean(x * np.cos(angle)), 2 * np.mean(x * np.sin(angle))])
    return np.array(rows)


def measured() -> np.ndarray:
    """Return the results of harness/studies/measured.py for the cases with measurements."""
    with MEASURED.open(encoding="utf-8") as file:
        ours = {
            (row["experiment"], row["quantity"]): row
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
        }
    with cases.HERE.joinpath("measured", "comparisons.csv").open(encoding="utf-8") as file:
        frozen = list(csv.DictReader(line for line in file if not line.startswith("#")))
    rows = []
    for row in frozen:
        own = ours[row["experiment"], row["quantity"]]
        value = own["measured"] if row["unit"] == "share" else own["ours"]
        rows.append([float(row["row"]), float(value)])
    return np.array(rows)


CASES = {
    "bench_linear": lambda: bench("bench_linear"),
    "bench_spherical": lambda: bench("bench_spherical"),
    "thrust": lambda: craft("thrust"),
    "weightless": lambda: craft("weightless"),
    "draining": lambda: craft("draining"),
    "linearisation": linearisation,
    "spinner": spinner,
    "backbones": backbones,
    "forced": forced,
    "measured": measured,
}


def main() -> None:
    global FOLDER
    parser = argparse.ArgumentParser(description="Runs the slosh benchmark with HubSlosh's FMUs.")
    parser.add_argument("folder", type=Path, help="where to write CASE/results.csv")
    parser.add_argument("case", nargs="*", help="cases to run (all)")
    parser.add_argument("--fmus", type=Path, help="folder with FMUs to use instead")
    args = parser.parse_args()
    FOLDER = args.fmus
    for name in args.case or CASES:
        cases.write(args.folder, name, CASES[name]())
        print(f"{name}: written", flush=True)


if __name__ == "__main__":
    main()
