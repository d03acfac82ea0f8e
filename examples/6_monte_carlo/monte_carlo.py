"""Monte Carlo of settling time and robust stability over fill, damping and friction.

python examples/6_monte_carlo/monte_carlo.py --runs 400

The runs use the cores of this machine, with ``--scheduler`` a dask cluster (pip install
distributed).
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import hubslosh
from hubslosh.plot import COLORS, save

if TYPE_CHECKING:
    from distributed import Client

PERIOD, LATENCY = 0.1, 1
"""Cycle time and delay of the controller: s, cycles."""
BANDWIDTH, ZETA = 0.15, 0.7
"""Bandwidth and damping ratio of the PD controller for the nominal bench: Hz, 1."""
INERTIA = 0.428
"""Inertia of hub and rigid liquid at 10 cm, kg·m²."""
STOP = 90.0  # s
PUSH = np.radians(4)
"""Slosh angle at the start, rad."""
TOLERANCE = np.radians(0.01)
"""Pointing error below which the hub counts as settled, rad."""


def gains() -> np.ndarray:
    w = 2 * np.pi * BANDWIDTH
    return INERTIA * np.array([w**2, 2 * ZETA * w])


def draws(runs: int, seed: int) -> pd.DataFrame:
    """Return the FMU's parameters, a row per run; the same seed gives the same rows.

    The fill is 4 to 14 cm. The damping ratio is log-normal about 0.3 % with 30 %, the scatter of
    measured tanks. Dry friction ranges from none to the bench's.
    """
    random = np.random.default_rng(seed)
    share = random.uniform(0, 1, runs)
    return pd.DataFrame(
        {
            "tank.h": random.uniform(0.04, 0.14, runs),
            "slosh.zeta": 0.003 * np.exp(0.3 * random.standard_normal(runs)),
            "friction.c": 0.003498 * share,
            "friction.d": 0.002423 * share,
        }
    )


def one(row: dict[str, float], fmu: str) -> dict[str, float]:
    """Return the largest pole (linear, with viscous friction) and the settling time of a draw."""
    k = gains()
    parameters = {"slosh.zeta_from_correlation": False} | row
    viscous = parameters | {"friction.model": "viscous"}
    A, B, C, _ = hubslosh.linearize(fmu, viscous, ["tau_cmd"], ["theta", "omega"]).sampled(
        PERIOD, LATENCY
    )
    start = {"slosh.model": "spherical", "init.slosh_angle": PUSH}
    run = hubslosh.closed_loop(
        lambda time, measured: -k @ measured, PERIOD, STOP, fmu, parameters | start,
        latency=LATENCY, outputs=["theta", "slosh_angle"],
    )  # fmt: skip
    outside = run["time"][(run["theta"] - run["theta"].iloc[-50:].mean()).abs() >= TOLERANCE]
    return {
        "largest_pole": float(np.abs(np.linalg.eigvals(A - B @ k[None] @ C)).max()),
        "settling_time": float(outside.max()),
    }


def study(client: "Client | None", runs: int, seed: int, fmu: str) -> pd.DataFrame:
    """Return the draws with their results.

    Dask's workers compute them, or, without a client, processes of this machine.
    """
    table = draws(runs, seed)
    rows = table.to_dict("records")
    if client:
        found = client.gather(client.map(one, rows, fmu=fmu))
    else:
        with ProcessPoolExecutor() as pool:
            found = list(pool.map(partial(one, fmu=fmu), rows, chunksize=4))
    return pd.concat([table, pd.DataFrame(found)], axis=1)


def figure(table: pd.DataFrame, path: Path) -> None:
    whole, (poles, times, ranks) = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    stable = table["largest_pole"] < 1
    fill = 100 * table["tank.h"]
    dots = poles.scatter(100 * table["slosh.zeta"], table["largest_pole"], c=fill, s=12)
    whole.colorbar(dots, label="fill (cm)")
    poles.axhline(1, color="black", linewidth=0.8)
    poles.set(xlabel="slosh damping (%)", ylabel="largest pole (1: unstable)")
    poles.set_title("Too little slosh damping: unstable at any fill")
    for these, color, label in ((stable, COLORS[0], "stable"), (~stable, COLORS[1], "unstable")):
        torque = 1e3 * (table["friction.c"] + table["friction.d"])[these]
        times.plot(torque, table["settling_time"][these], ".", color=color, label=label)
    times.set(xlabel="stiction (mN·m)", ylabel=f"settling time (s; {STOP:g}: not settled)")
    times.set_title("Stiction hides most of the instability")
    times.legend(title="linear model")
    correlation = table.corr(method="spearman")
    names = ["tank.h", "slosh.zeta", "friction.c"]
    place = np.arange(len(names))
    for shift, of in ((-0.2, "largest_pole"), (0.2, "settling_time")):
        ranks.barh(place + shift, correlation.loc[names, of], 0.38, label=of.replace("_", " "))
    ranks.set_yticks(place, ["fill", "slosh damping", "dry friction"])
    ranks.set(
        xlabel="rank correlation (Spearman)",
        xlim=(-1, 1),
        title="Damping decides stability, friction settling",
    )
    ranks.legend()
    for ax in (poles, times, ranks):
        ax.grid(alpha=0.3)
    save(whole, path)


def main() -> None:
    parser = argparse.ArgumentParser(description="Settling time and robust stability.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scheduler", help="address of a dask scheduler; workers need hubslosh")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    if args.scheduler:
        try:
            from distributed import Client
        except ModuleNotFoundError:
            sys.exit("error: --scheduler needs dask: pip install distributed")
        with Client(args.scheduler) as client:
            table = study(client, args.runs, args.seed, args.fmu)
    else:
        table = study(None, args.runs, args.seed, args.fmu)
    stable, settled = table["largest_pole"] < 1, table["settling_time"] < STOP - 6
    print(f"{args.runs} draws: linear model stable in {stable.sum()}, settled in {settled.sum()};")
    print(f"settled although unstable in {(settled & ~stable).sum()}")
    print(f"settling time, median: {table['settling_time'].median():.1f} s")
    print(table.corr(method="spearman")[["largest_pole", "settling_time"]].iloc[:3].round(2))
    figure(table, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
