"""Makes the .mat files here with scipy: another writer than our reader's author.

python make.py; needs scipy and h5py
"""

from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat

HERE = Path(__file__).parent
NAN = float("nan")

t = np.arange(6) * 20.0  # ms
torque = np.array([0, 100, 200, 300, 200, 100], dtype=np.int16)  # mNm
gyro = np.array([[0, 0, rate] for rate in (1.5, 3, NAN, 4.5, 6, 7.5)])  # deg/s
log = {"t": t[None, :], "T_cmd": torque[:, None], "gyro": gyro, "note": "a text", "scalar": 3.0}
savemat(HERE / "plain.mat", {**log, "cell": np.array(["a", 1], dtype=object)}, format="5")
savemat(HERE / "packed.mat", {"log": log}, format="5", do_compression=True)
savemat(HERE / "lengths.mat", {"time": t, "omega": t[:4], "tau_cmd": t}, format="5")
with h5py.File(HERE / "version_7_3.mat", "w", userblock_size=512) as file:
    file["t"] = t
with (HERE / "version_7_3.mat").open("r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
