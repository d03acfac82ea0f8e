"""Simulates a minute with a torque near the slosh frequency by fmpy's ``simulate_fmu``.

Run it by ``python harness/hosts/fmpy_example.py dist/HubSlosh.fmu``.
"""

import sys

import numpy as np
from fmpy import simulate_fmu

step = 0.02  # s
time = np.arange(0, 60 + step, step)
torque = np.zeros(len(time), dtype=[("time", float), ("tau_cmd", float)])
# fmpy holds each value over a step; set half a step early, it is right on average
torque["time"] = time - step / 2
torque["tau_cmd"] = 0.05 * np.sin(2 * np.pi * 2.4 * time)  # N·m

result = simulate_fmu(
    sys.argv[1],
    stop_time=60,
    output_interval=step,
    start_values={"slosh.model": 4, "tank.h": (50, "mm")},  # 4: spherical; in SI or a given unit
    input=torque,
    output=["omega", "slosh_angle"],
)
print(f"largest rate {np.abs(result['omega']).max():.4f} rad/s")
print(f"largest slosh angle {np.degrees(np.abs(result['slosh_angle']).max()):.2f} deg")
