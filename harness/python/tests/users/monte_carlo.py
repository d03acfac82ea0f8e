"""Runs a Monte Carlo study of the largest slosh angle and prints its 95 % quantile."""

from typing import Any

import hubslosh


def outcome(values: dict[str, Any]) -> dict[str, float]:
    """Simulate a draw and return its largest slosh angle."""
    run = hubslosh.simulate(parameters=values | {"init.slosh_rate": 0.5}, stop=10)
    return {"angle": run["slosh_angle"].abs().max()}


ranges = {"tank.h": (0.05, 0.12), "slosh.model": ["linear", "spherical"]}
table = hubslosh.monte_carlo(ranges, 20, seed=3, outcome=outcome)
found = hubslosh.quantiles(table, "angle", at=[0.95])
print(f"{found['value'].iloc[0]:.3f} rad")
