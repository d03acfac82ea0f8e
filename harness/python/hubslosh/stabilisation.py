"""Stabilisation of slosh modes in a loop: by phase, by gain, by both or by neither.

Near a lightly damped pole p of the plant the loop gain is L(s) = R/(s - p) + L0. Closing the loop
with u = -L u moves this pole by about -R/(1 + L0). If the phase of R/(1 + L0) is near 0°, the loop
adds damping to the mode; if it is near ±180°, the loop removes damping. In the Nyquist plot the
resonance is a circle that begins at L0 in the direction of R: away from -1 if the phase is 0°,
towards -1 if it is ±180°. The zero next to the pole is at about p - R/L0, so that the order of pole
and zero shows the sign of R/L0.
"""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .linearization import LinearModel
from .stability import LIGHT, MOVED, _broken_at, _moved

SHOWN = 1e-2  # Diameter of a mode's resonance circle (-40 dB) below which the mode is left out

_TANK = re.compile(r"tank\[(\d)\]\.p(?:_dot)?\[(\d),\d\]")


def resonances(gain: LinearModel, tanks: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return rows of a table of the slosh modes that appear in a sampled loop gain.

    A mode has one row for each command. ``gain`` is the sampled loop gain with the names of its
    states, as `Loop.gain` returns it; ``tanks`` has the names of the tanks in the FMU's order.
    Columns of the table:

    * ``loop``: command at which the loop is broken, with the loops of the other commands closed.
    * ``mode``: names of the tanks whose liquid moves, and number of the mode.
    * ``frequency`` (Hz), ``zeta``: frequency and damping ratio of the mode's pole in the loop gain.
    * ``zeta_closed``: damping ratio of this mode if this loop is closed, too.
    * ``zero`` (Hz): frequency of the zero next to the pole.
    * ``order``: "zero first" if the zero has the lower frequency, otherwise "pole first".
    * ``peak`` (dB): loop gain at the frequency of the pole.
    * ``phase`` (deg): of R/(1 + L0), the direction of the resonance circle in the Nyquist plot; at
      0° the circle points away from -1.
    * ``stabilised``: "unstable" if the mode grows with all loops closed (such a mode is listed even
      if it hardly appears in the loop gain); "gain" if the peak is below 0 dB; "phase" if the phase
      is within ±90°, so that the loop adds damping; "gain and phase" if both hold; "neither" if the
      mode is stable although neither holds.
    """
    found, closed = [], _moved(gain)
    for i in range(len(gain.D) if len(closed) else 0):
        one = _broken_at(gain, i)
        for poles, residue, names in _groups(one):
            row = _row(one, poles, residue, closed)
            if row:
                mode = _name(names, tanks)
                found.append({"loop": gain.inputs[i], "mode": mode} | row)
    return sorted(found, key=lambda row: (row["loop"], row["frequency"]))


Complex = NDArray[np.complex128]


def _groups(one: LinearModel) -> list[tuple[complex, complex, set[str]]]:
    """Return pole (z plane), residue and states of each slosh mode of a plant with one command.

    Modes with equal poles count as one.
    """
    from scipy.linalg import eig

    assert one.period is not None
    poles, left, right = eig(one.A, left=True)
    share = np.abs(left * right)
    s = np.log(np.where(poles == 0, 1e-300, poles).astype(complex)) / one.period
    light = (s.imag > 0) & (-s.real < LIGHT * np.abs(s)) & (s.imag * one.period < 3.14)
    left_out = set(np.flatnonzero(~light))
    found = []
    for k in np.flatnonzero(light):
        if k in left_out:
            continue
        same = np.flatnonzero(light & (np.abs(s - s[k]) < 1e-6 * np.abs(s[k])))
        left_out |= set(same)
        most = (share[:, same] > 0.2 * share[:, same].max(axis=0)).any(axis=1)
        names = {one.states[i] for i in np.flatnonzero(most) if i < len(one.states)}
        if not any(_TANK.fullmatch(name) for name in names):
            continue
        L, R = left[:, same].conj().T, right[:, same]
        residue = complex((one.C @ R @ np.linalg.lstsq(L @ R, L @ one.B, rcond=1e-12)[0])[0, 0])
        if abs(residue) > MOVED * np.linalg.norm(one.C) * np.linalg.norm(one.B):
            found.append((complex(poles[k]), residue, names))
    return found


def _row(
    one: LinearModel, pole: complex, residue: complex, poles: Complex
) -> dict[str, Any] | None:
    """Return the row of the table for one slosh mode in one loop.

    ``one`` is the loop gain, ``pole`` and ``residue`` belong to the mode (z plane), and ``poles``
    are the poles of the closed loop.
    """
    T = one.period
    assert T is not None

    def value(z: complex) -> complex:
        return complex(one._at(np.array([z]))[0, 0, 0])

    s = np.log(pole) / T
    near = np.exp((1e-3 * abs(s) + 1j * s.imag) * T)  # L is finite here even for an undamped pole
    rest = value(near) - residue / (near - pole)
    height = np.exp(1j * s.imag * T) - pole
    own = residue / height if abs(height) > 1e-12 else complex(np.inf)
    near = _solved(value, pole, pole - residue / (1 + rest), 1.0)
    closed = np.log(poles[np.argmin(np.abs(poles - near))]) / T
    if abs(own) < SHOWN and not closed.real > 0:
        return None
    zero = np.log(_solved(value, pole, pole - residue / rest, 0.0)) / T
    # the residue R in the s plane is the residue in the z plane divided by T z
    phase = float(np.degrees(np.angle(residue / (T * pole * (1 + rest)))))
    peak = 20 * np.log10(abs(own + rest))
    adds = abs(phase) < 90
    if closed.real > 0:
        how = "unstable"
    elif peak < 0:
        how = "gain and phase" if adds else "gain"
    else:
        how = "phase" if adds else "neither"
    hertz = abs(zero) / (2 * np.pi)
    frequency = abs(s) / (2 * np.pi)
    return {
        "frequency": frequency, "zeta": -s.real / abs(s),
        "zeta_closed": -closed.real / abs(closed), "zero": hertz,
        "order": "zero first" if hertz < frequency else "pole first", "peak": float(peak),
        "phase": phase, "stabilised": how,
    }  # fmt: skip


def _solved(value: Any, pole: complex, start: complex, offset: float) -> complex:
    """Return the root z of offset + L(z) = 0 near ``start``, by the secant method.

    ``value`` is the function L. The method is applied to (z - pole) (offset + L(z)), which is
    smooth near the pole.
    """

    def smooth(z: complex) -> complex:
        return complex((z - pole) * (offset + value(z)))

    if start == pole:
        return pole
    a, b = start, start + 1e-4 * (start - pole)
    at_a, at_b = smooth(a), smooth(b)
    for _ in range(30):
        if at_b == at_a or abs(b - a) <= 1e-14 * abs(b):
            break
        a, b, at_a = b, b - at_b * (b - a) / (at_b - at_a), at_b
        if b == pole:
            break
        at_b = smooth(b)
    # a root farther away belongs to another mode
    return b if abs(b - pole) < 3 * abs(start - pole) else start


def _name(states: set[str], tanks: Sequence[str]) -> str:
    """Return the name of a slosh mode, from the states that move in it and the tanks' names."""
    found: dict[str, set[str]] = {}
    for state in states:
        if match := _TANK.fullmatch(state):
            number = int(match[1])
            tank = tanks[number - 1] if number <= len(tanks) else f"tank {number}"
            found.setdefault(match[2], set()).add(tank)
    return ", ".join(f"{' and '.join(sorted(of))} mode {n}" for n, of in sorted(found.items()))
