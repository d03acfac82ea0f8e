"""Requirements of a design review: minimum margins that its operating points must have."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from .arguments import not_positive, refuse
from .fmu import FmuError, did_you_mean
from .short import ShortTable

# Margins that may be required, and their units. The gain margin is the smaller of the margins for
# an increase and for a decrease of the gain.
UNITS = {"modulus_margin": "", "phase_margin": "°", "gain_margin": " dB", "delay_margin": " s"}

# Operating points to which a requirement may apply: only the nominal points, or all points.
POINTS = ("nominal", "all")


@dataclass(frozen=True)
class Requirement:
    """Minimum of one margin at the nominal operating points, or at all operating points."""

    margin: str
    points: str
    limit: float

    @property
    def unit(self) -> str:
        """Unit of the limit, printed after the number; an empty string if it has no unit."""
        return UNITS[self.margin]

    def __str__(self) -> str:
        what = self.margin.replace("_", " ")
        return f"{what} of {self.points} points at least {self.limit:g}{self.unit}"


def requirements_of(given: Any) -> tuple[Requirement, ...]:
    """Return requirements from the argument ``requirements=`` of `Craft.review`.

    The argument is a dictionary from the name of a margin to a limit for all operating points, or
    to separate limits for ``nominal`` and ``all`` operating points. Raises FmuError with
    everything that is wrong.
    """
    if given is None:
        return ()
    example = '{"phase_margin": 30, "gain_margin": {"nominal": 6, "all": 3}}'
    if not isinstance(given, Mapping):
        raise FmuError(f"requirements must be limits by margin, such as {example}, not {given!r}")
    found, problems = [], []
    for margin, limits in given.items():
        if margin not in UNITS:
            hint = did_you_mean(str(margin), UNITS)
            problems.append(f"requirements has {margin} (allowed: {', '.join(UNITS)}){hint}")
            continue
        for points, limit in (limits if isinstance(limits, Mapping) else {"all": limits}).items():
            if points not in POINTS:
                problems.append(f"requirements.{margin} has {points} (allowed: nominal, all)")
            elif wrong := not_positive(f"requirements.{margin}", limit, "or a table of them"):
                problems += wrong
            else:
                found.append(Requirement(margin, points, float(limit)))
    refuse(problems)
    return tuple(found)


def margins_of(points: pd.DataFrame) -> pd.DataFrame:
    """Return a table of the margins that requirements can limit, with a row for each point."""
    gain = points[["gain_up", "gain_down"]].abs().min(axis=1)
    found = points.assign(gain_margin=gain, phase_margin=points["phase_margin"].abs())
    return found[list(UNITS)]


def judged(requirements: tuple[Requirement, ...], points: pd.DataFrame) -> ShortTable:
    """Compare the margins of the operating points with the requirements.

    The returned table has the columns of `Review.requirements` and one row for each requirement,
    failed requirements first.
    """
    margins = margins_of(points).where(points["stable"], -np.inf)  # an unstable point has no margin
    rows = []
    for one in requirements:
        among = margins[points["kind"] == "nominal"] if one.points == "nominal" else margins
        values = among[one.margin]
        failing = int((values < one.limit).sum())
        rows.append(
            {
                "requirement": str(one),
                "passed": failing == 0,
                "least": float(values.min()),
                "fill": int(points.loc[values.idxmin(), "fill"]),
                "failing": failing,
                "points": len(values),
            }
        )
    columns = ["requirement", "passed", "least", "fill", "failing", "points"]
    return ShortTable(sorted(rows, key=lambda row: row["passed"]), columns=columns)
