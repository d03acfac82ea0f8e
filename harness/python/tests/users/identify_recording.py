"""Identifies friction from a recording and simulates the bench with the result."""

import numpy as np

import hubslosh

bench = {"friction.model": "viscous", "init.slosh_angle": 0.1}
recording = hubslosh.simulate(parameters=bench, stop=4, step=0.05, outputs="omega")
recording["omega"] += np.random.default_rng(1).normal(0, 1e-5, len(recording))
found = hubslosh.identify(recording, free={"friction.b": 0.03}, outputs=["omega"], settings=bench)
estimate = found.parameters["friction.b"]
low, high = estimate.interval
text = f"{estimate.value:.4f} ± {estimate.std:.4f} {estimate.unit}, {low:.4f} to {high:.4f}"
print(found.verdict[0], text)
values = {name: each.value for name, each in found.parameters.items()}
again = hubslosh.simulate(parameters={**values, **found.settings}, stop=4)
