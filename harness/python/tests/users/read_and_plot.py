"""Reads a recording of a data logger, estimates the frequency response and draws both."""

from pathlib import Path

import numpy as np
import pandas as pd

import hubslosh

time = np.arange(0, 60, 0.02)
torque = 0.05 * np.sin(2 * np.pi * (1 + time / 60) * time)
table = pd.DataFrame({"time": time, "tau_cmd": torque})
run = hubslosh.simulate(parameters={"friction.model": "viscous"}, inputs=table, outputs="omega")
path = Path("bench.csv")
pd.DataFrame({"t_ms": 1000 * time, "T": torque, "w": run["omega"]}).to_csv(path, index=False)
recording = hubslosh.read_recording(path, "time=t_ms:ms,tau_cmd=T:N.m,omega=w:rad/s")
response = hubslosh.frequency_response(recording)
gain, phase = hubslosh.plot.bode(response)
gain.set_title("bench")
hubslosh.plot.time_histories(recording, "tau_cmd", "omega")
