r"""Certificates of robust stability, over intervals of frequency and boxes of parameters.

N(f) is the closed loop's frequency response from the outputs to the inputs of Δ, which holds the
uncertain parameters. A loop that is stable at Δ = 0 stays stable in a box of Δ if no pole reaches
the unit circle, that is if I - N(f) Δ is regular for each frequency f up to half the sampling rate
and each Δ in the box. This is proved if there are scalings D and G with which the matrix X(f) of
the module `scalings` is negative definite.

The proof uses scalings that vary linearly over an interval of frequency. N is analytic in f, even
with a delay, so that on a short interval X equals a polynomial of degree `DEGREE` up to rounding.
The values of a polynomial are convex combinations of its Bernstein coefficients. If these
coefficients are negative definite, X is negative definite on the whole interval; otherwise the
interval is halved. If no scalings exist at one end of the interval, the box is halved instead.
"""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import comb
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuError
from .progress import Line, Progress
from .quantities import short_name
from .scalings import Complex, Scalings, Vector, form, recentred
from .short import MOST

DEGREE = 8  # Degree of the polynomials that approximate X on an interval

# Sum of the semi-axes of the Bernstein ellipse around an interval (scaled to the half length 1) in
# which no pole may lie, so that the Chebyshev series of X converges fast.
REACH = 2.0

LOWEST = 1e-6  # Frequency that replaces f = 0, as a fraction of half the sampling rate

REMAINDER = 0.01  # Largest truncation error of a polynomial, as a fraction of the margin of X

ROUNDING = 1e-9  # Smallest margin that proves X < 0; X is scaled so that the diagonal of D is 1

# Largest number of times that an interval is halved with the same scalings.
HALVINGS = 8

# `UncertainModel.certify` divides the size of Δ that it tries to certify by each of these factors,
# one after the other, until a size can be certified.
SIZES = (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0)

SMALLEST_BOX = 1e-3  # Smallest width of a box, as a fraction of the whole range

# Chebyshev nodes between 0 and 1.
NODES = (1 - np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))) / 2
_TO_CHEBYSHEV = np.linalg.inv(np.polynomial.chebyshev.chebvander(2 * NODES - 1, DEGREE))
_TO_BERNSTEIN = np.linalg.inv([
    [comb(DEGREE, k) * x**k * (1 - x) ** (DEGREE - k) for k in range(DEGREE + 1)] for x in NODES
])  # fmt: skip


@dataclass(frozen=True, eq=False)
class WorstCase:
    """Smallest Δ found that brings a loop to the limit of stability.

    `UncertainModel.worst_case` returns an instance.

    Attributes
    ----------
    delta : dict of str to float
        Value of each uncertain parameter in Δ, by name; ±1 is an end of the parameter's range.
        Empty if the search found no such Δ.
    size : float
        Largest magnitude in Δ; inf if the search found no such Δ.
    frequency : float
        Frequency of the oscillation that neither grows nor decays, Hz.
    parameters : dict of str to float
        Uncertain parameters at this Δ, by name, SI units.
    tanks : tuple of str
        Names of the craft's tanks; they replace ``tank[1]``, … in printed names of parameters.

    Examples
    --------
    >>> from hubslosh import WorstCase
    >>> case = WorstCase({"craft.mass": -2.0}, 2.0, 0.3, {"craft.mass": 800.0})
    >>> case.mu
    0.5
    """

    delta: "dict[str, float]"
    size: float
    frequency: float
    parameters: "dict[str, float]"
    tanks: tuple[str, ...] = ()

    @property
    def mu(self) -> float:
        """Lower bound of the structured singular value µ: 1 divided by the size of the worst Δ."""
        return 1 / self.size

    def __repr__(self) -> str:
        if not np.isfinite(self.size):
            return "WorstCase: no unstable Δ was found, so the lower bound of µ is 0"
        values = [
            f"\n  {short_name(name, self.tanks)} = {x:.6g}" for name, x in self.parameters.items()
        ]
        left = len(values) - MOST
        more = f"\n  and {left} more" if left > 0 else ""
        first = f"WorstCase: unstable from {self.size:.4g} times the ranges on, µ ≥ {self.mu:.4g}"
        return f"{first}, at {self.frequency:.5g} Hz{''.join(values[:MOST])}{more}"


@dataclass(frozen=True, eq=False)
class Certificate:
    """Proof that a loop is stable for all values of uncertain parameters in a box.

    `UncertainModel.certify` returns an instance. Δ has the deviation δ of each parameter from its
    nominal value, where ±1 is an end of the parameter's range.

    Parameters
    ----------
    size : float
        The loop is stable for all ``|δ| ≤ size``. A size of 1 means that the whole ranges are
        proved; 0 means that nothing was proved.
    worst : WorstCase
        Smallest Δ found that makes the loop unstable.
    least : dict of float
        Lower bound of δ by name, for quantities such as damping ratios, which cannot be below 0.
    data : dict of ndarray
        Content of the file that `save` writes: the loop, the parts (intervals of frequency and
        boxes of Δ) into which the proof is divided, and the scalings D and G of each part.
    solved : int
        Number of convex problems that were solved.

    Examples
    --------
    A craft with one tank under a PD controller whose command is 0.2 s late:

    >>> import numpy as np
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=1e-6)}
    >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
    >>> loop = craft.loop(np.hstack([20 * np.eye(3), 80 * np.eye(3)]), 0.1, "50%", delay=0.2)
    >>> model = craft.uncertain("50%", {"main.frequency[1]": "10%", "craft.Jxx": "5%"})
    >>> found = model.certify(loop, largest=2)
    >>> found.size, found.worst.size
    (2.0, inf)
    >>> found.save("certificate.npz")
    """

    size: float
    worst: WorstCase
    least: dict[str, float]
    data: dict[str, NDArray[Any]]
    solved: int

    @property
    def mu(self) -> float:
        """Upper bound of µ over all frequencies: 1 divided by the certified size."""
        return 1 / self.size if self.size else np.inf

    @property
    def gap(self) -> float:
        """Ratio of the worst case's size to the certified size; inf if either was not found.

        A ratio near 1 means that the proof reaches almost as far as possible.
        """
        return self.worst.size / self.size if self.size else np.inf

    def __repr__(self) -> str:
        if not self.size:
            return f"Certificate: none was found with {self.solved} convex problems\n{self.worst!r}"
        found = (
            f"unstable at {self.worst.size:.4g} times the ranges, {self.gap:.3f} times as much"
            if np.isfinite(self.worst.size)
            else "no unstable Δ was found"
        )
        return (
            f"Certificate: stable up to {self.size:.4g} times the ranges, µ ≤ {self.mu:.4g}; "
            f"{found}\n  {len(self.data['low'])} intervals of frequency and boxes, "
            f"{len(self.data['D'])} pairs of scalings, {self.solved} convex problems"
        )

    def save(self, path: str | Path) -> None:
        """Write the certificate as .npz, so that it can be checked with NumPy alone.

        Parameters
        ----------
        path : str or Path
            File to write. The script ``check_certificate.py`` of example 14 checks such a file.

        Raises
        ------
        FmuError
            If the name does not end in .npz, the file cannot be written, or nothing was proved.
        """
        from .temporary import write_file

        if not self.size:
            raise FmuError("the certificate proves nothing, so that there is nothing to save")

        def content() -> bytes:
            file = io.BytesIO()
            np.savez_compressed(file, **self.data)  # type: ignore[arg-type]
            return file.getvalue()

        write_file(path, ".npz", content)


def corners(count: int) -> Vector:
    """Return the corners of the cube [-1, 1]^count.

    If the cube has more than 64 corners, 64 random corners are returned.
    """
    if count <= 6:
        return np.array(list(product((-1.0, 1.0), repeat=count)))
    return np.random.default_rng(1).choice((-1.0, 1.0), (64, count))


class UnstableError(Exception):
    """Raised if the loop is unstable for parameters for which stability should be proved."""

    def __init__(self, delta: Vector) -> None:
        super().__init__()
        self.delta = delta


class ExhaustedError(Exception):
    """Raised if a proof needs too many convex problems, or too small boxes of parameters."""


Pair = tuple[Complex, Complex]  # D and G

# Lower and upper end of an interval of frequency, Hz; lower and upper bounds of a box of Δ.
Region = tuple[float, float, Vector, Vector]


class Search:
    """A search for scalings D and G that prove that a loop is stable; found scalings are reused.

    ``response`` is a function that returns N, the closed loop's response from the outputs to the
    inputs of Δ, at frequencies in Hz. ``poles`` is a function that returns the closed loop's poles
    in the z plane for each row of an array of Δ.
    """

    def __init__(
        self, response: Callable[[Any], Complex], poles: Callable[[Vector], Complex],
        counts: Sequence[int], period: float, progress: Progress = None,
    ) -> None:  # fmt: skip
        self.closed, self.poles, self.period = response, poles, period
        self.scalings = Scalings(counts)
        self.nyquist = 0.5 / period
        self.width = np.ones(len(counts))
        self.pairs: list[Pair] = []
        self.found: dict[tuple[float, bytes, bytes], tuple[float, int]] = {}
        self.known: dict[tuple[float, float], Complex] = {}
        self.own: dict[bytes, Complex] = {}
        self.line = Line(progress)

    def response(self, a: float, b: float) -> Complex:
        """Return the closed loop's response N at frequencies between ``a`` and ``b``, Hz.

        The frequencies are Chebyshev nodes, so that a polynomial through these values is close to N
        everywhere between ``a`` and ``b``.
        """
        if (a, b) not in self.known:
            self.known[a, b] = self.closed(a + (b - a) * NODES)
        return self.known[a, b]

    def own_poles(self, low: Vector, high: Vector) -> Complex:
        """Return the closed loop's poles for the Δ in the middle of a box.

        The poles are converted from the z plane to complex frequencies, Hz. Raises `UnstableError`
        if one of the poles is unstable.
        """
        middle = (low + high) / 2
        key = middle.tobytes()
        if key not in self.own:
            z = self.poles(middle[None])[0]
            if np.abs(z).max() > 1 + 1e-9:
                raise UnstableError(middle)
            # uncontrollable modes have undamped poles, which N does not contain
            z = z[(np.abs(z) > 1e-12) & (np.abs(z) < 1 - 1e-9)]
            self.own[key] = np.log(z) / (2j * np.pi * self.period)
        return self.own[key]

    def proved(
        self, region: Region, ends: tuple[Pair, Pair], part: tuple[float, float], halvings: int
    ) -> list[tuple[float, float]] | None:
        """Return the frequency intervals on which X < 0 is proved, or None if the proof fails.

        X is the matrix of the robustness test with D and G scalings (`scalings.form`): the loop is
        robust where X is negative definite. D and G are interpolated linearly between their values
        at both ends of the region's frequency interval, and X is bounded by polynomials. ``part``
        is the part of the frequency interval to prove; it may be halved ``halvings`` times.
        """
        low, high = region[2:]
        a, b = part
        share = (a + (b - a) * NODES - region[0]) / (region[1] - region[0])
        D, G = ((1 - share)[:, None, None] * first + share[:, None, None] * last
                for first, last in zip(*ends, strict=True))  # fmt: skip
        X = form(recentred(self.response(a, b), self.scalings.copies, low, high), D, G)
        # D and G in physical units differ by many powers of ten; scaling keeps the signs of the
        # eigenvalues of X
        scale = 1 / np.sqrt(np.diag(D[DEGREE // 2]).real)
        X = X * scale * scale[:, None]
        margin = -np.linalg.eigvalsh(X)[:, -1].max()
        if not margin > ROUNDING:
            return None
        away = (self.own_poles(low, high) - (a + b) / 2) / ((b - a) / 2)
        axes = np.abs(away + np.sqrt(away - 1) * np.sqrt(away + 1))
        if np.maximum(axes, 1 / axes).min(initial=np.inf) >= REACH:
            last = np.abs(np.tensordot(_TO_CHEBYSHEV[-2:], X, 1)).sum(axis=0)
            remainder = float(np.linalg.norm(last))
            if remainder < REMAINDER * margin:
                top = np.linalg.eigvalsh(np.tensordot(_TO_BERNSTEIN, X, 1))[:, -1].max()
                if top < -2 * remainder:
                    return [(a, b)]
        if not halvings:
            return None
        middle, found = (a + b) / 2, []
        for half in ((a, middle), (middle, b)):
            pieces = self.proved(region, ends, half, halvings - 1)
            if pieces is None:
                return None
            found += pieces
        return found

    def halved(self, region: Region) -> list[Region]:
        """Return two regions whose boxes are the halves of a region's box.

        The box is cut in the middle of the range of one uncertain parameter. It is the parameter
        for which both halves have the largest margins (see `margin`) in the middle of the region's
        frequency interval.
        """
        a, b, low, high = region
        if ((high - low) / self.width).max() < SMALLEST_BOX:
            raise ExhaustedError
        at = np.where(corners(len(low)) > 0, high, low)
        sizes = np.abs(self.poles(at)).max(axis=1)
        if sizes.max() > 1 + 1e-9:
            raise UnstableError(at[sizes.argmax()])
        share = (high - low) / self.width
        # if no cut gives a margin, cut along the quantity with the widest remaining range
        best: tuple[float, list[Region]] = (-np.inf, [])
        for k in np.argsort(-share):
            if share[k] < 0.2 * share.max():
                break
            middle = (low[k] + high[k]) / 2
            halves = [(low.copy(), high.copy()), (low.copy(), high.copy())]
            halves[0][1][k] = halves[1][0][k] = middle
            margins = sorted(self.margin((a + b) / 2, *half)[0] for half in halves)
            if (merit := margins[0] + 0.1 * margins[1]) > best[0] + ROUNDING or not best[1]:
                best = merit, [(a, b, *half) for half in halves]
        return best[1]

    def margin(self, f: float, low: Vector, high: Vector) -> tuple[float, int]:
        """Return the margin of a proof at the frequency ``f`` (Hz), and the index of its scalings.

        The proof is for the box of Δ from ``low`` to ``high``. It succeeds if the margin, which
        `Scalings.best` maximises, is above 0. ``pairs[index]`` has the scalings D and G.
        """
        key = f, low.tobytes(), high.tobytes()
        if key not in self.found:
            # f = 0 is a pole of the craft (not of N), at which N cannot be computed
            N = self.closed([max(f, LOWEST * self.nyquist)])[0]
            margin, *pair = self.scalings.best(recentred(N, self.scalings.copies, low, high))
            self.pairs.append((pair[0], pair[1]))
            self.found[key] = margin, len(self.pairs) - 1
        return self.found[key]

    def certify(self, low: Vector, high: Vector, most: int) -> dict[str, NDArray[Any]]:
        """Prove that the loop is stable for all Δ between ``low`` and ``high``.

        Return the parts (intervals of frequency and boxes of Δ) into which the proof is divided,
        with the scalings of each part.

        Raises `UnstableError` if the loop is unstable for one of these Δ, and `ExhaustedError` if
        more than ``most`` convex problems would be needed.
        """
        self.width, self.pairs, self.found = high - low, [], {}
        self.line.start()
        edges = np.append(0.0, np.geomspace(self.nyquist / 1000, self.nyquist, 16))
        stack = [(float(a), float(b), low, high) for a, b in pairwise(edges)]
        shares, done = [1 / len(stack)] * len(stack), 0.0
        rows: list[tuple[float, float, Vector, Vector, float, float, int, int]] = []
        while stack:
            region, share = stack.pop(), shares.pop()
            a, b, *box = region
            if self.scalings.solved > most:
                raise ExhaustedError
            self.own_poles(*box)
            first, last = self.margin(a, *box), self.margin(b, *box)
            if min(first[0], last[0]) > ROUNDING and b - a > 1e-9 * self.nyquist:
                ends = self.pairs[first[1]], self.pairs[last[1]]
                if pieces := self.proved(region, ends, (a, b), HALVINGS):
                    rows.extend((*piece, *box, a, b, first[1], last[1]) for piece in pieces)
                    done += share
                    size = max(np.abs(low).max(), np.abs(high).max())
                    self.line.show(
                        f"certificate for {size:.4g} times the ranges: {100 * done:.0f} % proved, "
                        f"about {self.line.left(done):.0f} s left"
                    )
                    continue
                middle = (a + b) / 2
                stack += [(middle, b, *box), (a, middle, *box)]
            else:
                stack += self.halved(region)
            shares += [share / 2, share / 2]
        names = ("low", "high", "box_low", "box_high", "start", "stop", "first", "last")
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        found = dict(zip(names, columns, strict=True))
        used, numbers = np.unique([found["first"], found["last"]], return_inverse=True)
        found["first"], found["last"] = numbers.reshape(2, -1)
        return found | {
            name: np.array([self.pairs[k][i] for k in used]) for i, name in enumerate("DG")
        }
