"""An operating point of a design review: a loop with its margins."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .linearization import LinearModel
from .loop import Loop
from .stability import Margins, _largest

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Point:
    """An operating point of a review: a fill, values of the uncertain quantities, and margins."""

    fill: int
    """Index of the fill."""
    shares: Vector
    """Position of each uncertain quantity in its range: -1 low end, 0 nominal, 1 high end."""
    loop: Loop
    """Loop at this point, around the trimmed craft."""
    margins: Margins
    """Margins of the loop."""
    gain: LinearModel
    """Sampled loop gain."""

    @property
    def growth(self) -> float:
        """Growth rate of the least stable closed-loop pole, 1/s; below 0 if the point is stable.

        Neutral poles do not count; if all poles are neutral, the rate is -inf.
        """
        poles = self.margins.poles
        size = _largest(poles[~np.isin(poles, self.margins.neutral)], self.gain.period)
        with np.errstate(divide="ignore"):
            return float(np.log(size) / self.loop.period)

    @property
    def distance(self) -> float:
        """Measure that the search for the worst point minimises.

        The distance is the modulus margin of a stable loop, and minus the growth rate (1/s) of an
        unstable loop.
        """
        return self.margins.modulus_margin if self.margins.stable else -self.growth
