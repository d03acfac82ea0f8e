"""Runs the FMU at 1 kHz with a controller in another process, over UDP; counts missed deadlines.

python examples/13_real_time/real_time.py
"""

import argparse
import os
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd

import hubslosh

PERIOD = 1e-3
"""Cycle time of the loop, s."""
ANGLE = 0.2
"""Commanded angle of the hub, rad."""
GAINS = 0.6, 0.7
"""Gains of the controller: N·m/rad, N·m·s/rad."""
STATE, TORQUE = struct.Struct("<Idd"), struct.Struct("<Id")
"""Formats of datagrams: cycle, angle (rad) and rate (rad/s); cycle and torque (N·m)."""
SILENCE = 5.0
"""Time without a datagram after which the controller ends, s."""


def controller(port: int) -> None:
    """Answer every state that arrives at the UDP ``port`` with a torque.

    The function ends if no state arrives for `SILENCE`.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        peer.settimeout(SILENCE)
        peer.sendto(b"", ("127.0.0.1", port))  # tells the simulator the controller's port
        try:
            while data := peer.recv(64):
                cycle, theta, omega = STATE.unpack(data)
                torque = GAINS[0] * (ANGLE - theta) - GAINS[1] * omega
                peer.sendto(TORQUE.pack(cycle, torque), ("127.0.0.1", port))
        except TimeoutError:
            return


def wait(until: float) -> None:
    """Wait until the clock shows ``until``, s: sleep, then poll, because a sleep may end late."""
    rest = until - time.perf_counter() - 2e-4
    if rest > 0:
        time.sleep(rest)
    while time.perf_counter() < until:
        pass


def run(fmu: str | Path, cycles: int) -> pd.DataFrame:
    """Simulate a number of cycles in real time.

    The table has one row for each cycle: ``start``, its delay, s; ``work``, the time to receive the
    newest torque, make a step and send the state, s; ``missed``, true if the cycle ended after the
    next cycle was due; ``age``, the number of cycles between the state and the torque that answers
    it, or -1 before the first answer; ``theta`` (rad) and ``time`` of the FMU (s). A late cycle is
    not skipped but begins at once, so that the FMU catches up.
    """
    rows = np.empty((cycles, 6))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.settimeout(30)
        arguments = [sys.executable, __file__, "--controller", str(link.getsockname()[1])]
        # the controller gets the import path of this process
        peer = subprocess.Popen(
            arguments, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        )
        try:
            _, address = link.recvfrom(64)
            link.setblocking(False)
            with hubslosh.Plant(fmu, {"friction.model": "none"}) as plant:
                torque, answered = 0.0, -1
                begin = time.perf_counter() + 0.01
                for k in range(cycles):
                    due = begin + k * PERIOD
                    wait(due)
                    start = time.perf_counter()
                    try:
                        while True:
                            answered, torque = TORQUE.unpack(link.recv(64))
                    except BlockingIOError:
                        pass
                    plant.step((k + 1) * PERIOD, torque)
                    theta, omega = plant.get(["theta", "omega"])
                    link.sendto(STATE.pack(k, theta, omega), address)
                    end = time.perf_counter()
                    age = k - answered if answered >= 0 else -1
                    rows[k] = start - due, end - start, end > due + PERIOD, age, theta, plant.time
            link.sendto(b"", address)
            peer.wait(SILENCE + 5)
        finally:
            peer.kill()
    return pd.DataFrame(rows, columns=["start", "work", "missed", "age", "theta", "time"])


def lines(table: pd.DataFrame) -> list[str]:
    """Return the results of a run as lines of text."""
    cycles = len(table)
    shown = [
        f"{cycles} cycles of {1e3 * PERIOD:g} ms, {int(table['missed'].sum())} missed deadlines"
    ]
    for name, what in (("start", "late at the start"), ("work", "work of a cycle")):
        p50, p99, most = 1e6 * np.percentile(table[name], [50, 99.9, 100])
        shown.append(
            f"{what}: {p50:.0f} us half of the time, 99.9 % {p99:.0f} us, at most {most:.0f} us"
        )
    answers = table["age"][table["age"] >= 0]
    if len(answers):
        shown.append(
            f"torques answer a state {answers.median():.0f} cycles old, at most {answers.max():.0f}"
        )
    shown.append(f"theta at the end {table['theta'].iloc[-1]:.4f} rad (wanted {ANGLE} rad)")
    return shown


def figure(table: pd.DataFrame, path: Path) -> None:
    import matplotlib.pyplot as plt

    whole, (when, share) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for name, label in (
        ("start", "late at the start"),
        ("work", "work: torque in, step, state out"),
    ):
        micro = 1e6 * table[name]
        when.plot(table["time"], micro, ".", markersize=2, label=label, rasterized=True)
        share.plot(np.sort(micro), 1 - np.arange(len(micro)) / len(micro), label=label)
    when.axhline(1e6 * PERIOD, color="gray", linestyle="--", label="deadline")
    share.axvline(1e6 * PERIOD, color="gray", linestyle="--", label="deadline")
    missed = int(table["missed"].sum())
    when.set(xlabel="time of the FMU (s)", ylabel="time (us)", yscale="log")
    when.set_title(f"{missed} of {len(table)} deadlines missed")
    share.set(xlabel="time (us)", ylabel="share of cycles above it", xscale="log", yscale="log")
    share.set_title("How many cycles take longer")
    for ax in (when, share):
        ax.grid(alpha=0.3)
        ax.legend(fontsize=8)
    whole.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description="The FMU at 1 kHz against a UDP peer.")
    parser.add_argument("--fmu", default="HubSlosh", help="FMU file, or name of a packaged FMU")
    parser.add_argument("--cycles", type=int, default=10_000, help="1 ms each, 60,000 at most")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".svg"))
    parser.add_argument("--controller", type=int, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.controller is not None:
        return controller(args.controller)
    if not 1 <= args.cycles <= 60_000:
        parser.error(f"--cycles {args.cycles} (allowed: 1 to 60000)")
    table = run(args.fmu, args.cycles)
    print("\n".join(lines(table)))
    figure(table, args.out)
    print(args.out)
    return None


if __name__ == "__main__":
    main()
