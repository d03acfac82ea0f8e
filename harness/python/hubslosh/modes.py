"""Number of slosh modes that a model needs: error of the slosh force over the number of modes."""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .fmu import FmuError, Parameters, Quantity
from .plant import Plant
from .simulation import parameters_of

Vector = NDArray[np.float64]

# Errors for which `mode_errors` returns the number of modes, as in Rubaga's thesis (section 4.2.1).
TOLERANCES = (0.05, 0.01)


def impulse(masses: Vector, omegas: Vector, zetas: Vector, time: Vector) -> NDArray[np.float64]:
    """Return the force (N) of each mode on a tank whose speed jumps by 1 m/s at time 0.

    Each row is one mode, each column one time. The slosh angle a follows l a'' + 2 zeta omega l a'
    + g a = -u with the tank's acceleration u, and the force is F = m (g a + 2 zeta omega l a')
    (Rubaga's thesis, equations 4.16 to 4.21).
    """
    omegas, zetas = omegas[:, None], zetas[:, None]
    damped = omegas * np.sqrt(1 - zetas**2)
    decay = np.exp(-zetas * omegas * time)
    angle = -decay * np.sin(damped * time) / damped
    rate = -decay * (np.cos(damped * time) - zetas * omegas / damped * np.sin(damped * time))
    return masses[:, None] * (omegas**2 * angle + 2 * zetas * omegas * rate)


def mode_responses(
    masses: Vector, omegas: Vector, zetas: Vector, frequencies: Vector
) -> NDArray[np.complex128]:
    """Return each mode's frequency response from the tank's acceleration to the force on it.

    Force over acceleration is in kg. Each row is one mode, each column one frequency (Hz).
    """
    w = 2 * np.pi * np.asarray(frequencies)
    spring = omegas[:, None] ** 2 + 2j * (zetas * omegas)[:, None] * w
    return -masses[:, None] * spring / (spring - w**2)


def mode_errors(
    parameters: Parameters | str | Path | None = None,
    below: float | None = None,
    fmu: str | Path = "HubSlosh",
) -> pd.DataFrame:
    """Return the error of the slosh force on HubSlosh's tank for each number of modes.

    The error is the difference to the force with all modes (parameter ``slosh.modes``). An impulse
    excites all frequencies equally, but a control loop excites only its band, so use the column
    ``band`` for loops.

    Parameters
    ----------
    parameters : mapping, str or Path, optional
        Parameters of HubSlosh, as for `simulate`. ``slosh.modes`` is 10 by default.
    below : float, optional
        Upper end of the band, Hz; by default 1.5 times the frequency of the first mode.
    fmu : str or Path
        Name of the FMU, or its file.

    Returns
    -------
    DataFrame
        A row for each number of modes, with two relative errors. ``impulse`` is the largest error
        of the force after an impulse of the tank, divided by the largest force (equation 4.24 of
        Rubaga's thesis). ``band`` is the largest error of the response from acceleration to force
        at frequencies up to ``below``, divided by the mass of the liquid. ``.attrs["needed"]`` has
        the number of modes for errors of 5 % and 1 %, ``.attrs["below"]`` the end of the band, Hz.

    Raises
    ------
    FmuError
        If the liquid cannot slosh, or a parameter is refused.

    Examples
    --------
    >>> import hubslosh
    >>> table = hubslosh.mode_errors({"slosh.modes": 3})
    >>> table.attrs["needed"]["band"][0.05]
    1
    """
    settings: dict[str, Quantity] = {"slosh.modes": 10} | dict(parameters_of(parameters))
    with Plant(fmu, settings) as plant:
        count = int(plant.get(["slosh.modes"])[0])
        names = ("slosh.mass", "slosh.frequency", "slosh.damping")
        values = plant.get([f"{name}[{n}]" for name in names for n in range(1, count + 1)])
        (liquid,) = plant.get(["tank.m_liq"])
    masses, frequencies, zetas = np.array(values).reshape(3, count)
    if not (masses > 0).all() or not (frequencies > 0).all():
        raise FmuError("the liquid cannot slosh: slosh.model is frozen, or g_axial is 0")
    omegas = 2 * np.pi * frequencies
    below = 1.5 * frequencies[0] if below is None else below
    if not below > 0:
        raise FmuError(f"below={below} (allowed: above 0)")
    # 60 points in the period of the fastest mode, over 20 periods of the slowest mode
    time = np.arange(0, 20 / frequencies[0], 1 / (60 * frequencies[-1]))
    forces = impulse(masses, omegas, zetas, time)
    # a resonance peak has the relative width 2 zeta, which the step of 0.2 zeta divides into ten
    peaks = [
        np.linspace(f * (1 - 5 * z), f * (1 + 5 * z), 51)
        for f, z in zip(frequencies, zetas, strict=True)
    ]
    grid = np.unique(np.concatenate([np.linspace(0, below, 2001), *peaks]))
    grid = grid[(grid >= 0) & (grid <= below)]
    whole = forces.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        # A mode that is left out counts as liquid that moves with the tank. The error is infinite
        # at the frequency of an undamped mode.
        lacks = mode_responses(masses, omegas, zetas, grid) + masses[:, None]
    lacks[~np.isfinite(lacks)] = np.inf
    rows = []
    for n in range(1, count + 1):
        force, mass = (np.abs(left[n:].sum(axis=0)).max() for left in (forces, lacks))
        rows.append((force / np.abs(whole).max(), mass / liquid))
    table = pd.DataFrame(
        rows, columns=["impulse", "band"], index=pd.RangeIndex(1, count + 1, name="modes")
    )
    table.attrs["needed"] = {
        column: {tolerance: int((table[column] < tolerance).idxmax()) for tolerance in TOLERANCES}
        for column in table.columns
    }
    table.attrs["below"] = float(below)
    return table
