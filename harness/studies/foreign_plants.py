"""Tests `hubslosh identify bench` with benches outside its model, and with twins within its model.

    python3 harness/studies/foreign_plants.py plants [--only NAME,…] [--amplitudes 0.05,0.15]
    python3 harness/studies/foreign_plants.py twins --habits [--seeds 1-12]

`foreign_plants.c`, compiled by `cc`, simulates the benches with equations, an integrator and random
draws of its own; it contains nothing of HubSlosh. `plants` have an effect that HubSlosh does not
have. Their identification is wrong if the verdict is that the model fits although a true value is
outside its interval and more than five standard deviations off, or if the verdict names a cause
that does not act. `twins` are benches within the model; with `--habits`, each is recorded with
another imperfection of data loggers. The program prints tables in Markdown; `--keep` keeps
recordings and results.
"""

import argparse
import ctypes
import json
import re
import resource
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import pi, sqrt, tanh
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.random import Generator, default_rng
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from identify_twins import Tally, Twin

ROOT = Path(__file__).resolve().parents[2]
XI = 1.8411837813406593  # first zero of the derivative of the Bessel function J1
WRONG = 5.0  # error in standard deviations beyond which a fit with a good verdict counts as wrong
STEP = 1e-3  # step of the integration, s
LIQUIDS = ("linear", "planar", "spherical")
ARRAYS = np.ctypeslib.ndpointer(dtype=float, flags="C")


class Bench(ctypes.Structure):
    """The structure `bench` of foreign_plants.c."""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("I_a", "I_b", "stiffness", "shaft_damping", "play")),
        *((name, ctypes.c_double) for name in ("r", "g")),
        *((name, ctypes.c_double * 2) for name in ("m", "l", "zeta")),
        *((name, ctypes.c_double) for name in ("b", "c", "d", "omega_s", "asymmetry")),
        *((name, ctypes.c_double) for name in ("drag", "cable", "imbalance", "periodic", "drift")),
        *((name, ctypes.c_double) for name in ("zeta_amplitude", "hardening")),
        *((name, ctypes.c_double) for name in ("leak_I", "leak_m", "leak_l", "duration")),
        *((name, ctypes.c_int) for name in ("liquid", "modes", "has_second", "tank_on_second")),
    ]


def compile_plant(folder: str) -> ctypes.CDLL:
    """Compile foreign_plants.c into a folder and return the library."""
    library = Path(folder, "foreign_plants.so")
    options = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC"]
    source = Path(__file__).with_suffix(".c")
    subprocess.run(["cc", *options, source, "-o", library, "-lm"], check=True)
    plant = ctypes.CDLL(str(library))
    plant.simulate.argtypes = [ctypes.POINTER(Bench), ctypes.c_long, *[ARRAYS] * 5]
    return plant


def first_mode(d: float, h: float, rho: float) -> tuple[float, float, float]:
    """Return mass and length of the first mode of an upright cylinder, and the liquid's mass."""
    filling = tanh(2 * XI * h / d)
    liquid = rho * pi / 4 * d**2 * h
    return liquid * d * filling / (XI * (XI**2 - 1) * h), d / (2 * XI * filling), liquid


@dataclass
class Setup:
    """A bench, its torque, its sensors and its logger; SI units."""

    parameters: dict[str, float]  # true values by their names in the FMU
    liquid: str = "linear"
    effects: dict[str, float] = field(default_factory=dict)  # further fields of Bench
    torque: Callable[[np.ndarray], np.ndarray] = np.zeros_like
    actuator: Callable[[np.ndarray], np.ndarray] = np.array  # acting torque from command
    hold: str = "held"  # intersample behaviour of the torque
    duration: float = 600.0
    rate: float = 50.0  # rows per second
    arm: float = 0.225
    gravity: float = 9.81
    density: float = 1000.0
    torque_scale: float = 1.0  # ratio of the recorded to the true torque
    clock: float = 1.0  # ratio of the recorded to the true time
    delay: float = 0.0
    gyro_scale: float = 1.0
    gyro_bias: float = 0.0
    gyro_lag: float = 0.0
    white: float = 5.75e-5  # rad/s/sqrt(Hz)
    drift: float = 7.85e-5
    drift_time: float = 100.0
    lsb: float = 1.53e-4
    clip: float = 0.0  # rate at which the gyro clips, as a fraction of the largest rate
    jitter: float = 0.0  # jitter of the times, as a fraction of a row
    lost: float = 0.0  # fraction of the rows that is lost
    gaps: int = 0
    spikes: float = 0.0  # fraction of the rows with a spike
    stamp: float = 0.0  # resolution of the recorded times, s
    arguments: list[str] = field(default_factory=list)

    def bench(self) -> Bench:
        """Return the bench as the structure that the compiled plant reads."""
        p = self.parameters
        mass, length, liquid = first_mode(p["tank.d"], p["tank.h"], self.density)
        effects = dict(self.effects)
        second = effects.pop("second_mode_mass", 0.0) * mass
        length_2 = length * effects.pop("second_mode_length", 1.0)
        fixed = (liquid - mass - second) * self.arm**2
        share, frequency = effects.pop("second_share", 0.0), effects.pop("second_frequency", 0.0)
        ratio = effects.pop("second_damping", 0.005)
        leak = effects.pop("leak", 0.0)
        bench = Bench(
            r=self.arm,
            g=self.gravity,
            m=(mass, second),
            l=(length, length_2),
            zeta=(p["slosh.zeta"],) * 2,
            duration=self.duration,
            liquid=LIQUIDS.index(self.liquid),
            modes=2 if second else 1,
            has_second=share > 0.0,
            tank_on_second=effects.pop("tank_on_second", 0.0) > 0.0,
            **{name: p[f"friction.{name}"] for name in ("b", "c", "d", "omega_s", "asymmetry")},
            **effects,
        )
        bench.I_a, bench.I_b = p["hub.I"] * (1 - share), p["hub.I"] * share
        moved = bench.I_b
        if bench.tank_on_second:
            bench.I_b += fixed
            moved = bench.I_b + mass * self.arm**2
        else:
            bench.I_a += fixed
        bench.stiffness = moved * (2 * pi * frequency) ** 2
        bench.shaft_damping = 2 * ratio * moved * 2 * pi * frequency
        if leak:
            after = first_mode(p["tank.d"], p["tank.h"] * (1 - leak), self.density)
            change = (after[2] - after[0]) * self.arm**2 - fixed
            bench.leak_I = change / bench.I_a
            bench.leak_m, bench.leak_l = after[0] / mass - 1, after[1] / length - 1
        return bench

    def move(self, plant: ctypes.CDLL, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Simulate torques commanded at the times `rows`; return times and rates of the hub."""
        count = round(1 / (self.rate * STEP))
        part = np.arange(count) / count
        begin = (rows[:-1, None] + np.diff(rows)[:, None] * part).ravel()
        length = np.diff(np.append(begin, rows[-1]))
        command = self.torque(rows)
        points = [begin, begin + length / 2, begin + length]
        if self.hold == "smooth":
            torque = [self.torque(t) for t in points]
        elif self.hold == "linear":
            torque = [np.interp(t, rows, command) for t in points]
        else:
            torque = [np.repeat(command[:-1], count)] * 3
        acting = np.ascontiguousarray(self.actuator(np.stack(torque, axis=1)))
        angle, rate = np.empty_like(begin), np.empty_like(begin)
        bench = self.bench()
        if plant.simulate(ctypes.byref(bench), begin.size, begin, length, acting, angle, rate):
            raise ValueError("the bench's motion is not finite")
        return np.append(0.0, begin + length), np.append(0.0, rate)

    def record(self, plant: ctypes.CDLL, random: Generator) -> Twin:
        """Record the bench as its logger does, with the errors of its sensors."""
        rows = np.arange(0.0, self.duration + 1e-9, 1 / self.rate)
        if self.jitter:
            rows[1:-1] += self.jitter / self.rate * random.uniform(-1, 1, rows.size - 2)
        instants, rates = self.move(plant, rows)
        if self.gyro_lag:
            keep = np.exp(-STEP / self.gyro_lag)
            middle = 1 - (1 - keep) * self.gyro_lag / STEP  # exact if the rate is linear in time
            rates = lfilter([middle, 1 - keep - middle], [1, -keep], rates)
        rate = CubicSpline(instants, rates)(np.maximum(rows - self.delay, 0.0))
        keep = np.exp(-1 / (self.rate * self.drift_time))
        kicks = self.drift * sqrt(1 - keep**2) * random.normal(size=rows.size)
        kicks[0] = self.drift * random.normal()
        drift = lfilter([1], [1, -keep], kicks)
        noise = self.white * sqrt(self.rate) * random.normal(size=rows.size)
        omega = self.gyro_scale * (rate + drift + noise) + self.gyro_bias
        if self.clip:
            most = self.clip * abs(omega).max()
            omega = np.clip(omega, -most, most)
        omega = np.round(omega / self.lsb) * self.lsb
        spikes = random.uniform(size=rows.size) < self.spikes
        omega[spikes] += random.choice([-1, 1], spikes.sum()) * random.uniform(1, 5, spikes.sum())
        stamps = self.clock * rows
        if self.stamp:
            stamps = np.round(stamps / self.stamp) * self.stamp
        table = pd.DataFrame(
            {"time": stamps, "tau_cmd": self.torque_scale * self.torque(rows), "omega": omega}
        )
        kept = random.uniform(size=rows.size) >= self.lost
        for k in range(self.gaps):
            begin = self.duration * (k + random.uniform(0.2, 0.8)) / self.gaps
            kept &= (rows < begin) | (rows > begin + random.uniform(0.3, 1.0))
        kept[[0, -1]] = True
        truth = self.parameters | {
            "delay": self.delay,
            "gyro_scale": self.gyro_scale,
            "gyro_bias[1]": self.gyro_bias + self.gyro_scale * drift.mean(),
        }
        return Twin(table[kept].round(9), truth)


def sweep(amplitude: float, f0: float, f1: float, duration: float) -> Callable:
    """Return a sine sweep, linear in frequency from ``f0`` to ``f1``, as a function of time."""
    return lambda t: amplitude * np.sin(2 * pi * (f0 * t + (f1 - f0) / (2 * duration) * t**2))


def noise(random: Generator, rms: float, band: tuple[float, float], period: float) -> Callable:
    """Return random noise as a function of time.

    It is a sum of sines with random phases in the frequency ``band``, Hz, and has the standard
    deviation ``rms``.
    """
    lines = np.fft.rfftfreq(round(200 * period), 1 / 200)
    spectrum = np.exp(2j * pi * random.uniform(size=lines.size))
    spectrum[(lines < band[0]) | (lines > band[1])] = 0.0
    signal = np.fft.irfft(spectrum)
    signal *= rms / signal.std()
    time = np.arange(signal.size + 1) / 200
    spline = CubicSpline(time, np.append(signal, signal[0]), bc_type="periodic")
    return lambda t: spline(np.mod(t, period))


def turning(amplitude: float, duration: float) -> Callable:
    """Return a torque as a function of time: a sweep, and a slow sine that turns the hub."""
    fast = sweep(amplitude, 1.5, 3.6, duration)
    return lambda t: fast(t) + 0.05 * np.sin(2 * pi * t / 60)


def draw(random: Generator, duration: float) -> Setup:
    """Return a random bench, whose values are within 30 % of the bench of the thesis.

    Errors of its known values are within their tolerances. The recording takes ``duration``, s.
    """

    def near(value: float) -> float:
        return value * random.uniform(0.7, 1.3)

    parameters = {
        "tank.d": near(0.163),
        "tank.h": near(0.1),
        "slosh.zeta": near(0.003),
        "hub.I": near(0.322),
        "friction.b": near(0.038),
        "friction.c": near(0.0035),
        "friction.d": near(0.0024),
        "friction.omega_s": near(0.086),
        "friction.asymmetry": random.uniform(-0.1, 0.1),
    }
    about = 1 + random.normal(size=5) * [1e-2, 1e-4, 1e-3, 4e-3, 3e-3]
    setup = Setup(
        parameters,
        duration=duration,
        torque_scale=about[0],
        clock=about[1],
        gravity=9.81 * about[2],
        arm=0.225 * about[3],
        density=1000.0 * about[4],
        delay=random.uniform(0, 0.01),
        gyro_scale=1 + 0.01 * random.normal(),
        gyro_bias=3e-3 * random.normal(),
        hold=str(random.choice(["held", "linear", "smooth"])),
        liquid="spherical" if random.uniform() < 0.3 else "linear",
    )
    torques = [
        lambda: sweep(0.1, 1.5, 3.6, duration),
        lambda: sweep(0.1, 3.6, 1.5, duration),
        lambda: sweep(0.04, 1.5, 3.6, duration),
        lambda: noise(random, 0.05, (1.25, 3.6), duration),
        lambda: noise(random, 0.08, (1.25, 3.6), 100.0),
    ]
    setup.torque = torques[random.integers(len(torques))]()
    return setup


HABITS: dict[str, dict] = {
    "stamps in ms at 33 Hz": {"rate": 33.0, "stamp": 1e-3},
    "jitter": {"jitter": 0.3},
    "3 % of the rows lost": {"lost": 0.03},
    "three gaps": {"gaps": 3},
    "spikes": {"spikes": 0.003},
    "clipping": {"clip": 0.8},
    "LSB 0.07 deg/s": {"lsb": 1.22e-3},
    "drift 3 times as large": {"drift": 2.4e-4, "drift_time": 30.0},
    "delay to 50 ms": {"delay": 0.05},
    "clock 300 ppm off": {"clock": 1.0003, "arguments": ["--tolerance", "clock=0.03%"]},
    "clock and lost rows": {
        "clock": 0.9997,
        "lost": 0.03,
        "arguments": ["--tolerance", "clock=0.03%"],
    },
    "jitter, LSB and delay": {"jitter": 0.2, "lsb": 6.1e-4, "delay": 0.03},
}


@dataclass
class Plant:
    """An effect that a bench has and the fitted models do not have."""

    change: Callable[[Setup, Generator, float], None]  # applies the effect for a torque amplitude
    causes: str  # regular expression of the causes that are true
    spread: dict[str, float] = field(default_factory=dict)  # largest relative change of parameters


def effects(**ranges: tuple[float, float]) -> Callable[[Setup, Generator, float], None]:
    """Return a function that changes a bench by these effects, each drawn from its range."""

    def change(setup: Setup, random: Generator, _: float) -> None:
        for name, (low, high) in ranges.items():
            setup.effects[name] = random.uniform(low, high)

    return change


def actuator(law: Callable) -> Callable[[Setup, Generator, float], None]:
    """Return a function that changes the acting torque of a bench by `law`.

    The arguments of `law` are the torque, a random number and the amplitude.
    """

    def change(setup: Setup, random: Generator, amplitude: float) -> None:
        x = random.uniform()
        setup.actuator = lambda u: law(u, x, amplitude)

    return change


def dead_zone(u: np.ndarray, x: float, _: float) -> np.ndarray:
    """Return the torque for the commands ``u`` of an actuator with a dead zone of 2 to 5 mN·m.

    ``x`` between 0 and 1 chooses the width.
    """
    return np.sign(u) * np.maximum(abs(u) - 0.002 - 0.003 * x, 0.0)


def periodic_friction(setup: Setup, random: Generator, amplitude: float) -> None:
    """Let the dry friction vary once per revolution, and make the hub turn."""
    setup.torque = turning(amplitude, setup.duration)
    setup.effects["periodic"] = random.uniform(0.3, 0.6)


def slow_clipped_gyro(setup: Setup, random: Generator, _: float) -> None:
    """Give the gyro of a bench a low-pass filter, and clip its readings."""
    setup.gyro_lag, setup.clip = random.uniform(0.01, 0.04), 0.8


def wrong_fill(option: str, known: str) -> Callable[[Setup, Generator, float], None]:
    """Return a function that gives `identify` a fill 50 % too high.

    Much smaller errors would not be a misfit, because the torque's tolerance of 1 % corresponds to
    5 to 9 % of the fill.
    """

    def change(setup: Setup, *_: object) -> None:
        setup.arguments += [option, f"tank.h={1.5 * setup.parameters['tank.h']:.5f}{known}"]

    return change


PLANTS = {
    "flexible hub, 4 Hz": Plant(
        effects(second_share=(0.05, 0.2), second_frequency=(4, 4)), "flexib|appendage"
    ),
    "flexible hub, 8 Hz": Plant(
        effects(second_share=(0.05, 0.2), second_frequency=(8, 8)), "flexib|appendage"
    ),
    "flexible arm, 8 Hz": Plant(
        effects(second_share=(0.3, 0.5), second_frequency=(8, 8), tank_on_second=(1, 1)),
        "flexib|appendage",
    ),
    "friction drifts": Plant(
        effects(drift=(0.2, 0.5)),
        "drift",
        {f"friction.{name}": 0.5 for name in ("b", "c", "d")},
    ),
    "dead zone": Plant(actuator(dead_zone), "dead zone"),
    "quantised torque": Plant(
        actuator(lambda u, x, _: np.round(u / (0.005 + 0.005 * x)) * (0.005 + 0.005 * x)),
        "quantis|resolution of the torque",
    ),
    "heavy second mode": Plant(
        effects(second_mode_mass=(0.1, 0.3), second_mode_length=(0.4, 0.55)), "second.* mode"
    ),
    "cable": Plant(effects(cable=(0.2, 0.6)), "turns the hub back|cable|follows the angle$"),
    "fill set wrong": Plant(wrong_fill("--set", ""), "fill|tank.h"),
    "fill known wrong": Plant(wrong_fill("--start", ":0.001"), "fill|tank.h"),
    "periodic friction": Plant(
        periodic_friction,
        "revolution|friction that follows the angle",
        {"friction.c": 0.6, "friction.d": 0.6},
    ),
    "filtered, clipped gyro": Plant(slow_clipped_gyro, "gyro|clipped"),
    "torque limit": Plant(
        actuator(lambda u, x, a: np.clip(u, -(0.7 + 0.2 * x) * a, (0.7 + 0.2 * x) * a)),
        "largest torque|limit",
    ),
    "backlash": Plant(
        effects(
            second_share=(0.3, 0.5),
            second_frequency=(30, 30),
            second_damping=(0.1, 0.1),
            tank_on_second=(1, 1),
            play=(5e-5, 3e-4),
        ),
        "backlash|play",
    ),
    "drag": Plant(effects(drag=(0.005, 0.03)), "rate's square|drag"),
    "hardening slosh": Plant(effects(hardening=(0.2, 1.0)), "stiffness of the slosh|hardening"),
    "leak": Plant(effects(leak=(0.03, 0.06)), "fill|leak", {"tank.h": 0.06}),
    "gain of one sign": Plant(
        actuator(lambda u, x, _: u * (1 + (0.01 + 0.02 * x) * np.sign(u))),
        "torque's square|square of the torque|asymmetr",
    ),
    "damping grows": Plant(effects(zeta_amplitude=(0.01, 0.03)), "damping that grows"),
}


def run(program: str, twin: Twin, arguments: Iterable[str], path: Path) -> tuple[dict | str, float]:
    """Identify a recording; return the result or the error, and the CPU time, s."""
    twin.table.to_csv(path, index=False)
    result = path.with_suffix(".json")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [program, "-q", "identify", "bench", path, *arguments, "--out", result]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    if done.returncode not in (0, 3):
        return done.stderr.strip()[-300:], seconds
    return json.loads(result.read_text(encoding="utf-8")), seconds


def beyond(found: dict, truth: dict[str, float], spread: dict[str, float]) -> list[str]:
    """Return the parameters whose estimates are wrong by more than five standard deviations.

    ``spread`` has the largest relative change of parameters that vary during the recording.
    """
    wrong = []
    for name, e in (found["parameters"] | found["measurement"]).items():
        if name in truth and e["std"]:
            part = 1 + spread.get(name, 0.0) * np.array([-1, 1])
            nearest = float(np.clip(e["value"], *sorted(truth[name] * part)))
            low, high = (np.inf if end is None else end for end in e["interval"])
            off = (e["value"] - nearest) / e["std"]
            if abs(off) > WRONG and not low <= nearest <= high:
                wrong.append(f"{name} {off:+.1f} σ")
    return wrong


def named(found: dict) -> list[str]:
    """Return the causes of the misfit that a result names."""
    cause = found.get("cause")
    causes = [cause["effect"] if isinstance(cause, dict) else str(cause)] if cause else []
    return causes + [missing["follows"] for missing in found.get("missing") or []]


def judge(found: dict, plant: Plant, twin: Twin) -> list[str]:
    """Return the wrong statements in a result for a bench that has an effect outside the model."""
    off = beyond(found, twin.truth, plant.spread) if found["fits"] else []
    faults = [f"fits, but {name}" for name in off]
    causes = named(found)
    faults += [f"names {cause}" for cause in causes if not re.search(plant.causes, cause)]
    verdict = " ".join(found["verdict"])
    if not found["fits"] and not causes and not re.search(r"unknown.* Hz.* s\b", verdict):
        faults.append("states neither a cause nor frequency and time of the residual")
    return faults


def options_of(setup: Setup, seed: int, models: str | None) -> list[str]:
    """Return command-line options; for even seeds, the intersample behaviour is given as known."""
    hold = ["--torque", setup.hold] if seed % 2 == 0 else []
    return ["--model", models or setup.liquid, *hold, *setup.arguments]


def plants(arguments: argparse.Namespace, plant: ctypes.CDLL, folder: Path) -> None:
    """Print a row for each effect outside the model."""
    print("| bench | amplitude, N·m | seed | fits | named | runs | CPU, s | wrong |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    only = arguments.only.split(",") if arguments.only else list(PLANTS)
    for name in [each for each in PLANTS if any(word in each for word in only)]:
        for amplitude in map(float, arguments.amplitudes.split(",")):
            for seed in arguments.seeds:
                number = list(PLANTS).index(name)
                random = default_rng([seed, number, round(1e4 * amplitude)])
                setup = replace(draw(random, arguments.duration), liquid="linear")
                setup.torque = sweep(amplitude, 1.5, 3.6, setup.duration)
                PLANTS[name].change(setup, random, amplitude)
                twin = setup.record(plant, random)
                options = options_of(setup, seed, arguments.models)
                path = folder / f"{re.sub('[^a-z0-9]+', '_', name.lower())}_{amplitude}_{seed}.csv"
                found, seconds = run(arguments.program, twin, options, path)
                if isinstance(found, str):
                    cells = ["refused", found.splitlines()[-1], "", f"{seconds:.0f}", ""]
                else:
                    faults = "; ".join(judge(found, PLANTS[name], twin))
                    runs = f"{found['fit']['simulations']:.0f}"
                    cause = "; ".join(named(found)) or "unknown" * (not found["fits"])
                    cells = [str(found["fits"]), cause, runs, f"{seconds:.0f}", faults]
                print("|", " | ".join([name, str(amplitude), str(seed), *cells]), "|", flush=True)


def twins(arguments: argparse.Namespace, plant: ctypes.CDLL, folder: Path) -> None:
    """Print a line for each twin, and a table with the coverage of each parameter's intervals."""
    tally, runs, seconds = Tally(), [], []
    for seed in arguments.seeds:
        random = default_rng([seed, 1000])
        setup = draw(random, arguments.duration)
        habit = list(HABITS)[(seed - 1) % len(HABITS)] if arguments.habits else "plain"
        setup = replace(setup, **HABITS.get(habit, {}))
        twin = setup.record(plant, random)
        options = options_of(setup, seed, arguments.models)
        found, cpu = run(arguments.program, twin, options, folder / f"twin_{seed}.csv")
        tally.add(seed, found, twin.truth)
        seconds.append(cpu)
        if isinstance(found, str):
            result = f"refused, {found.splitlines()[-1]}"
        else:
            runs.append(found["fit"]["simulations"])
            wrong = ", ".join(beyond(found, twin.truth, {}))
            result = "fits" if found["fits"] else f"does not fit {named(found)}"
            result += f", {runs[-1]:.0f} runs" + f", beyond {WRONG:.0f} σ: {wrong}" * bool(wrong)
        print(f"* {seed}, {habit}, {setup.hold}, {setup.liquid}: {result}, {cpu:.1f} s", flush=True)
    print("\n| parameter | inside its 95 % interval | rms of error/σ | largest | median σ |")
    print("| --- | --- | --- | --- | --- |")
    print("\n".join(tally.rows()))
    print(f"\nDoes not fit: {tally.unfit}; refused: {tally.refused}. Runs: median", end=" ")
    print(f"{np.median(runs):.0f}, most {max(runs)}. CPU time: median", end=" ")
    print(f"{np.median(seconds):.1f} s, most {max(seconds):.1f} s.")


def seeds(text: str) -> range:
    """Return the range of seeds that ``text`` gives, such as "0-20"."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["plants", "twins"])
    parser.add_argument("--seeds", type=seeds, help="such as 1-12 (default; plants: 1)")
    parser.add_argument("--only", help="plants whose names have one of these words")
    parser.add_argument("--amplitudes", default="0.05,0.15", help="amplitudes of the torque, N·m")
    parser.add_argument("--habits", action="store_true", help="twins with habits of loggers")
    parser.add_argument("--duration", type=float, default=600.0, help="of a recording, s")
    parser.add_argument("--models", help="slosh models to try (default: the true one)")
    parser.add_argument("--keep", type=Path, help="folder that keeps recordings and results")
    parser.add_argument("--program", default=str(ROOT / "target/release/hubslosh"))
    arguments = parser.parse_args()
    arguments.seeds = arguments.seeds or seeds("1" if arguments.what == "plants" else "1-12")
    with tempfile.TemporaryDirectory() as folder:
        plant = compile_plant(folder)
        kept = arguments.keep or Path(folder)
        kept.mkdir(parents=True, exist_ok=True)
        (plants if arguments.what == "plants" else twins)(arguments, plant, kept)


if __name__ == "__main__":
    main()
