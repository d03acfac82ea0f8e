"""Simulates a pulse of torque on the hub, with sloshing and with rigid liquid.

python examples/1_first_torque/first_torque.py
"""

import argparse
from pathlib import Path

import pandas as pd

import hubslosh

PULSE = pd.DataFrame(
    {"time": [0, 1, 1, 2, 2, 40], "tau_cmd": [0, 0, 0.1, 0.1, 0, 0]}  # s, N·m
)
"""Torque over time, interpolated linearly; two rows at the same time are a jump."""


def run(fmu: str | Path, model: str) -> pd.DataFrame:
    """Simulate the pulse on the bench, whose bearing sticks, with a slosh model."""
    outputs = ["omega", "omega_dot", "slosh_angle", "stuck"]
    return hubslosh.simulate(fmu, {"slosh.model": model}, PULSE, step=0.01, outputs=outputs)


def main() -> None:
    parser = argparse.ArgumentParser(description="A pulse of torque on the hub.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    args = parser.parse_args()
    axes = None
    for model in ("frozen", "spherical"):
        table = run(args.fmu, model)
        stopped = table["time"][~table["stuck"]].max()
        print(
            f"{model:9}: rate up to {table['omega'].max():.4f} rad/s, slosh angle up to "
            f"{table['slosh_angle'].abs().max():.4f} rad, hub at rest for good from {stopped:.2f} s"
        )
        names = ("tau_cmd", "omega", "omega_dot", "slosh_angle")
        axes = hubslosh.plot.time_histories(
            table.query("time < 18"), *names, axes=axes, label=model
        )
    figure = axes[0].figure
    figure.suptitle(
        "The rate hardly shows the liquid, the acceleration does; it tears the stopped hub loose"
    )
    hubslosh.plot.save(figure, args.out)
    print(args.out)


if __name__ == "__main__":
    main()
