"""Computes the torque at which planar slosh on the bench becomes unstable, without the FMU.

    python3 harness/studies/planar_stability.py

The model here is a spherical pendulum on a turning hub (Newton's equations, projected on the
sphere); it shares no code with the FMU. At each frequency, a shooting method finds the periodic
motion under a sinusoidal torque, for amplitudes of the motion in ascending order, because several
motions can exist for the same torque (folds). Planar slosh becomes rotary at the amplitude at which
a Floquet multiplier of half a period passes −1. A dwell from rest reaches this amplitude if the
torque exceeds the torques of all smaller amplitudes. The smallest such torque at any frequency is
the onset of rotary slosh.
"""

import numpy as np

DIAMETER, ARM, INERTIA = 0.163, 0.225, 0.322414  # m, m, kg·m² of the hub without liquid
GRAVITY, DENSITY, VISCOSITY = 9.81, 1000.0, 9.1312e-7  # m/s², kg/m³, m²/s
ROOT = 1.8411837813406593  # first zero of J1'
VISCOUS, COULOMB = 0.03793, 0.003498  # N·m·s, N·m
STRIBECK, STRIBECK_RATE = 0.002423, 0.08581  # N·m, rad/s
SMOOTH = 1e-3  # width over which the sign function of the friction is smoothed, rad/s

DEPTH = 0.08  # m, as in the plan t5_near_resonance
FREQUENCIES = np.arange(2.38, 2.4201, 0.0025)  # Hz
ANGLES = np.radians(np.arange(6.0, 24.1, 1.0))  # amplitudes of the slosh angle

STEPS = 200  # number of Runge–Kutta steps in half a period
NUDGE = 1e-6  # step of difference quotients
MIRROR = np.array([-1.0, 1.0, -1.0, 1.0, -1.0])  # signs of rate, x, y, x', y' after half a period
UNKNOWN = [0, 1, 3]  # indices of the unknown rate, x and x' in the state


class Plant:
    """Hub with one slosh mode in an upright cylinder; the state is rate, x, y, x', y'."""

    def __init__(self, depth: float):
        radius = DIAMETER / 2
        u = ROOT * depth / radius
        liquid = DENSITY * np.pi * radius**2 * depth
        share = DIAMETER * np.tanh(u) / (ROOT * (ROOT**2 - 1) * depth)
        self.mass, self.length = liquid * share, radius / (ROOT * np.tanh(u))
        self.inertia = INERTIA + (liquid - self.mass) * ARM**2
        # damping ratio by Mikishev and Dorozhkin
        slope, rest = 1.84 * depth / radius, 1 - depth / radius
        bottom = 0.318 / np.sinh(slope) * (1 + rest / np.cosh(slope))
        zeta = 0.79 * np.sqrt(VISCOSITY / np.sqrt(GRAVITY * radius**3)) * (1 + bottom)
        self.drag = 2 * zeta * np.sqrt(GRAVITY / self.length)  # 1/s

    def slope(self, state: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Return the time derivatives of states (5, n) under torques (n)."""
        rate, x, y, vx, vy = state
        square, mass = self.length**2, self.mass
        stribeck = STRIBECK * np.exp(-((rate / STRIBECK_RATE) ** 2))
        friction = -VISCOUS * rate - np.tanh(rate / SMOOTH) * (COULOMB + stribeck)
        height = np.sqrt(square - x * x - y * y)
        speed = vx * vx + vy * vy + ((x * vx + y * vy) / height) ** 2
        lever = ARM + x
        px, py = rate * (2 * vy + rate * lever), rate * (rate * y - 2 * vx)
        inward = (x * px + y * py + GRAVITY * height + speed) / square
        fx, fy = px - x * inward - self.drag * vx, py - y * inward - self.drag * vy
        liquid = mass * (y * fx - lever * fy - 2 * rate * (lever * vx + y * vy))
        bend = ARM * y / square
        hub = (torque + friction + liquid) / (self.inertia + mass * ARM * y * bend)
        return np.stack([hub, vx, vy, fx + hub * (y + x * bend), fy + hub * (y * bend - lever)])

    def half_period(
        self, state: np.ndarray, torque: np.ndarray, phase: np.ndarray, frequency: np.ndarray
    ) -> np.ndarray:
        """Return the states half a period later, with all signs changed.

        A symmetric motion returns to its start.
        """
        step = 0.5 / (frequency * STEPS)
        turn = np.pi / STEPS
        push = torque * np.sin(phase)
        for k in range(STEPS):
            half = torque * np.sin(phase + (k + 0.5) * turn)
            last = torque * np.sin(phase + (k + 1) * turn)
            first = self.slope(state, push)
            second = self.slope(state + step / 2 * first, half)
            third = self.slope(state + step / 2 * second, half)
            fourth = self.slope(state + step * third, last)
            state = state + step / 6 * (first + 2 * (second + third) + fourth)
            push = last
        return MIRROR[:, None] * state

    def guess(self, angle: np.ndarray, frequency: np.ndarray) -> np.ndarray:
        """Estimate rate, x, x', torque and phase (5, n) of nearly linear motion at its extreme."""
        speed, natural = 2j * np.pi * frequency, GRAVITY / self.length
        y = self.length * np.sin(angle)
        rate = -(natural * (1 - angle**2 / 8) + speed**2 + speed * self.drag) * y / (ARM * speed)
        friction = VISCOUS + 4 * COULOMB / (np.pi * np.abs(rate))
        liquid = ARM * self.mass * (natural * (1 - angle**2 / 8) + speed * self.drag) * y
        torque = (self.inertia * speed + friction) * rate - liquid
        zero = np.zeros_like(y)
        return np.array([rate.real, zero, zero, np.abs(torque), np.angle(torque) + np.pi / 2])

    def periodic(self, angle: np.ndarray, frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return torques and Floquet multipliers of symmetric motions with given slosh amplitudes.

        They are NaN if Newton's method does not converge.
        """
        count, unknown = len(angle), self.guess(angle, frequency)
        turning = self.length * np.sin(angle)

        def ends(unknown: np.ndarray, y: np.ndarray, vy: np.ndarray, f: np.ndarray) -> np.ndarray:
            state = np.stack([unknown[0], unknown[1], y, unknown[2], vy])
            return self.half_period(state, unknown[3], unknown[4], f)

        # states for difference quotients: unperturbed; each unknown perturbed; y and y' perturbed
        nudged = NUDGE * np.hstack([np.zeros((7, 1)), np.eye(7)])[:, :, None]
        with np.errstate(all="ignore"):
            for _ in range(9):
                fixed = np.stack([turning, np.zeros(count)])
                trial = np.concatenate([unknown, fixed])[:, None] + nudged
                flat = trial.reshape(7, -1)
                end = ends(flat[:5], flat[5], flat[6], np.tile(frequency, 8)).reshape(5, 8, count)
                slopes = (end[:, 1:] - end[:, :1]) / NUDGE
                start = np.stack([unknown[0], unknown[1], turning, unknown[2], np.zeros(count)])
                gap = (end[:, 0] - start).T[:, :, None]
                jacobian = slopes[:, :5].transpose(2, 0, 1).copy()
                jacobian[:, UNKNOWN, [0, 1, 2]] -= 1
                lost = ~np.isfinite(jacobian).all(axis=(1, 2))
                jacobian[lost] = np.eye(5)
                change = np.linalg.solve(jacobian, gap)[:, :, 0].T
                unknown = unknown - change
        lost |= ~(np.abs(change).max(axis=0) < 1e-6)
        of_state = slopes[:, [0, 1, 5, 2, 6]].transpose(2, 0, 1)
        of_state[lost] = 0
        multipliers = np.linalg.eigvals(of_state)
        multipliers[lost] = np.nan
        return np.where(lost, np.nan, unknown[3]), multipliers


def onsets(plant: Plant, frequencies: np.ndarray) -> np.ndarray:
    """Return the torque at which planar slosh becomes unstable at each frequency, N·m, or NaN."""
    shape = (len(frequencies), len(ANGLES))
    angle = np.tile(ANGLES, shape[0])
    torque, multipliers = plant.periodic(angle, np.repeat(frequencies, shape[1]))
    torque = torque.reshape(shape)
    # ignore complex multipliers, which belong to motion in the plane
    real = np.where(np.abs(multipliers.imag) < 1e-9, multipliers.real, 0).min(axis=1)
    margin = (real + 1).reshape(shape)
    found = np.full(shape[0], np.nan)
    for i in range(shape[0]):
        lost = np.flatnonzero(margin[i] < 0)
        if len(lost) and lost[0] > 0:
            k = lost[0]
            part = margin[i, k - 1] / (margin[i, k - 1] - margin[i, k])
            at = torque[i, k - 1] + part * (torque[i, k] - torque[i, k - 1])
            found[i] = max(at, torque[i, :k].max())
    return found


def onset(depth: float = DEPTH) -> tuple[float, float]:
    """Return frequency (Hz) and torque (N·m) at which slosh can become rotary, at a depth (m)."""
    torques = onsets(Plant(depth), FREQUENCIES)
    least = int(np.nanargmin(torques))
    return float(FREQUENCIES[least]), float(torques[least])


if __name__ == "__main__":
    for frequency, torque in zip(FREQUENCIES, onsets(Plant(DEPTH), FREQUENCIES), strict=True):
        print(f"{frequency:.4f} Hz: {torque:.4f} N·m")
