"""Compares the sizes of certificates of robust stability with the sizes of worst cases.

The loops are the 20 fills of example 14, and random craft with a PD controller. Each row has the
certified size, the ratio of the size of the worst case to the certified size, and the CPU time of
search and certificate together, on one core. ``--draws`` also counts unstable loops among random Δ
within the certified size.

    python3 harness/studies/certificates.py [--fills 97% 60%] [--craft 10] [--draws 100000]
"""

import argparse
import os
import sys
import time
import warnings
from pathlib import Path

for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[library] = "1"

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [
    os.fspath(ROOT / "harness/python"),
    os.fspath(ROOT / "examples/14_telecom_satellite"),
]

import telecom  # noqa: E402
from certificate import RANGES  # noqa: E402

import hubslosh  # noqa: E402

LARGEST = 9.0
STABLE = 1 + 1e-9  # largest absolute value of a pole of the sampled loop
MEASURED = ["q[2]", "omega[1]", "q[3]", "omega[2]", "q[4]", "omega[3]"]


def example(fill: str) -> tuple[hubslosh.UncertainModel, hubslosh.Loop]:
    """Return the uncertain model and the loop of example 14 at a fill of both its tanks."""
    loop = telecom.loop(fill)
    return telecom.craft.uncertain(fill, RANGES, outputs=loop.names[0]), loop


def random_craft(seed: int) -> tuple[hubslosh.UncertainModel, hubslosh.Loop]:
    """Return the model and the loop of a random craft with one or two tanks.

    The uncertain quantities are frequency (10 %) and damping of mode 1 of each tank, and one moment
    of inertia (10 %).
    """
    random = np.random.default_rng(seed)
    mass = random.uniform(400, 2000)  # kg
    inertia = mass * random.uniform(0.5, 0.9, 3)  # kg·m²
    tanks = {}
    for name in ["A", "B"][: random.integers(1, 3)]:
        radius = random.uniform(0.25, 0.5)  # m
        shape = {"sphere": {"radius": radius}}
        if random.random() < 0.5:
            shape = {"cylinder": {"radius": radius, "height": 3 * radius}}
        place = (*random.uniform(-0.4, 0.4, 2), random.uniform(-0.6, 0.6))
        tanks[name] = hubslosh.MountedTank({"density": 1000.0, "shape": shape}, place, nu=1e-6)
    craft = hubslosh.Craft(
        mass=mass, center_of_mass=(0.0, 0.0, random.uniform(0.3, 1.2)), inertia=np.diag(inertia),
        thrust=mass * random.uniform(0.05, 0.5), tanks=tanks,
    )  # fmt: skip
    fill = f"{random.uniform(20, 80):.0f}%"
    w = 2 * np.pi * random.uniform(0.01, 0.03)  # rad/s
    inertia = np.diag(np.diag(craft.mass_properties(fill).inertia))
    gains = np.zeros((3, 6))
    gains[:, 0::2], gains[:, 1::2] = 2 * w**2 * inertia, 1.4 * w * inertia  # q is half the angle
    loop = craft.loop(gains, 0.1, fill, measured=MEASURED, delay=random.uniform(0, 0.2))
    ranges = {f"{name}.frequency[1]": "10%" for name in tanks}
    ranges |= {f"{name}.zeta[1]": "interval" for name in tanks} | {"craft.Jxx": "10%"}
    return craft.uncertain(fill, ranges, outputs=loop.names[0]), loop


def unstable_draws(
    model: hubslosh.UncertainModel, loop: hubslosh.Loop, found: hubslosh.Certificate, draws: int
) -> int:
    """Return how many of ``draws`` random Δ within the certified size make the loop unstable."""
    random, count, linear = np.random.default_rng(1), 0, loop.linear()
    low = np.maximum(-found.size, list(found.least.values()))
    for _ in range(draws):
        poles = loop._gain(model.at(random.uniform(low, found.size)), linear)
        count += np.abs(hubslosh.stability._closed(poles)).max() >= STABLE
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--fills", nargs="*", default=telecom.FILLS)
    parser.add_argument("--craft", type=int, default=10)
    parser.add_argument("--draws", type=int, default=0)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", hubslosh.FmuWarning)
    seeds = range(1, arguments.craft + 1)
    cases = [(f"example 14, {fill}", example, fill) for fill in arguments.fills]
    cases += [(f"random craft {seed}", random_craft, seed) for seed in seeds]
    heads = ("certified size", "worst case / certified size", "convex problems", "CPU time, s")
    print(" | ".join(("| loop", *heads, "unstable draws |")), "| --- " * 6 + "|", sep="\n")
    for name, make, key in cases:
        model, loop = make(key)
        if not hubslosh.margins(loop).stable:
            print(f"| {name} | unstable without uncertainty | | | | |", flush=True)
            continue
        start = time.process_time()
        found = model.certify(loop, largest=LARGEST)
        cost = time.process_time() - start
        drawn = f"{unstable_draws(model, loop, found, arguments.draws)} of {arguments.draws}"
        row = (f"{found.size:.3f}", f"{found.gap:.3f}", str(found.solved), f"{cost:.1f}", drawn)
        print(f"| {name} | " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
