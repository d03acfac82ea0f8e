"""Inertia of a hub from its parts by the parallel-axis theorem (Rubaga's thesis, section 5.3)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from .arguments import floats
from .fmu import FmuError

# Shapes of parts, and the dimensions by which they are given.
SHAPES = {
    "point": "nothing of its own",
    "box": "(a, b): a block, its sides across the bearing axis, m",
    "disc": "radius: a solid cylinder along the bearing axis, m",
    "tube": "(inner, outer): a hollow cylinder along the bearing axis, radii, m",
    "rod": "(radius, length): a solid cylinder across the bearing axis, m",
    "inertia": "the part's own inertia about its centre, parallel to the bearing axis, kg m2",
}


def _own(shape: str, mass: float, size: Any) -> float:
    """Return a part's inertia about its own centre, parallel to the bearing axis, kg·m².

    ``mass`` is in kg, and ``size`` has the dimensions (m) that ``shape`` needs.
    """
    numbers = np.atleast_1d(floats(size))
    count = {"box": 2, "tube": 2, "rod": 2}.get(shape, 1)
    if numbers.shape != (count,) or not np.isfinite(numbers).all() or (numbers < 0).any():
        raise FmuError(f"{shape}={size!r} (allowed: {SHAPES[shape]}; 0 or more)")
    if shape == "inertia":
        return float(numbers[0])
    if shape == "disc":
        return float(mass * numbers[0] ** 2 / 2)
    a, b = numbers
    if shape == "tube":
        if a > b:
            raise FmuError(f"tube={size!r}: the inner radius is larger than the outer radius")
        return float(mass * (a**2 + b**2) / 2)
    return float(mass * ((a**2 + b**2) if shape == "box" else (3 * a**2 + b**2)) / 12)


def bottom_up(parts: Mapping[str, Mapping[str, Any]] | Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Add up the inertia of HubSlosh's hub and dry tank about the bearing axis.

    Parameters
    ----------
    parts : mapping or sequence of mappings
        Parts by name, each a mapping with ``mass`` (kg), ``position`` and one of `SHAPES`, for
        example ``{"plate": {"mass": 2.1, "box": (0.5, 0.3)}}``. ``position`` is (x, y) of the
        part's centre from the bearing axis, m: x radial towards the tank, y towards +theta; by
        default (0, 0). A part may have ``inertia`` (kg·m², about its own centre, parallel to the
        bearing axis), for example from CAD; its ``mass`` is then 0 by default.

    Returns
    -------
    DataFrame
        A row for each part of the hub: its ``mass`` (kg), its ``own`` inertia about its centre of
        mass, ``offset`` (mass times squared distance from the axis), the sum of both, ``inertia``
        (all in kg·m²), and the ``share`` of the part in the total inertia.
        ``.attrs["parameters"]`` has HubSlosh's ``hub.I``, ``hub.imbalance`` and
        ``hub.imbalance_angle``, for `simulate`.

    Raises
    ------
    FmuError
        If there are no parts, or one has a wrong key or number.

    Examples
    --------
    >>> import hubslosh
    >>> parts = {"plate": {"mass": 2.0, "box": (0.6, 0.3)},
    ...          "motor": {"mass": 1.0, "position": (0.2, 0.0)}}
    >>> hubslosh.bottom_up(parts)["inertia"].round(4).to_dict()
    {'plate': 0.075, 'motor': 0.04}
    """
    if not isinstance(parts, Mapping):
        parts = {str(part.get("name", k)): part for k, part in enumerate(parts, 1)}
    rows, problems, moment = {}, [], np.zeros(2)
    for name, part in parts.items():
        try:
            given = [shape for shape in SHAPES if shape in part]
            wrong = set(part) - set(SHAPES) - {"name", "mass", "position"}
            if wrong or len(given) > 1:
                keys = ", ".join(sorted(wrong) or given)
                raise FmuError(f"{keys} (allowed: mass, position and one of {', '.join(SHAPES)})")
            shape = given[0] if given else "point"
            mass = float(part.get("mass", 0.0 if shape == "inertia" else np.nan))
            if not (np.isfinite(mass) and mass >= 0):
                raise FmuError(f"mass={part.get('mass')!r} (allowed: 0 or more, kg)")
            at = floats(part.get("position", (0.0, 0.0)))
            if at.shape != (2,) or not np.isfinite(at).all():
                raise FmuError(f"position={part['position']!r} (allowed: (x, y), m)")
            own = 0.0 if shape == "point" else _own(shape, mass, part[shape])
        except (FmuError, TypeError, ValueError) as error:
            problems.append(f"{name}: {error}")
            continue
        rows[name] = (mass, own, mass * (at @ at))
        moment += mass * at
    if problems or not rows:
        raise FmuError("; ".join(problems) or "there are no parts")
    table = pd.DataFrame.from_dict(rows, orient="index", columns=["mass", "own", "offset"])
    table.index.name = "part"
    table["inertia"] = table["own"] + table["offset"]
    total = float(table["inertia"].sum())
    table["share"] = table["inertia"] / total if total > 0 else 0.0
    table.attrs["parameters"] = {
        "hub.I": total,
        "hub.imbalance": float(np.hypot(*moment)),
        "hub.imbalance_angle": float(np.arctan2(moment[1], moment[0])),
    }
    return table
