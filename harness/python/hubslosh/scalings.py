r"""D and G scalings of real, repeated parameters (Fan, Tits and Doyle 1991), by Clarabel.

Δ is diagonal and real, and the copies of each parameter form one block. Let D > 0 and G be
Hermitian with a full block for each parameter, so that both commute with Δ. If

    X = N^H D N - D + j (G N - N^H G) < 0

then I - N Δ is regular for all |δ| ≤ 1. Proof: (I - N Δ) v = 0 with w = Δ v, v = N w would give
w^H X w = v^H D v - w^H D w ≥ 0, because the term with G vanishes for a real Δ.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuError

Complex = NDArray[np.complex128]
Vector = NDArray[np.float64]

FLOOR = 1e-6  # Lower bound of the eigenvalues of D, whose mean is 1, after balancing of N

SMALLEST = 1e-3  # Smallest bound of µ that is computed


def solver() -> Any:
    """Return the module of the convex solver Clarabel.

    Raises FmuError with the command that installs Clarabel if it is missing.
    """
    try:
        import clarabel
    except ModuleNotFoundError:
        raise FmuError(
            "bounds of µ and certificates need the package clarabel: pip install 'hubslosh[robust]'"
        ) from None
    return clarabel


def adjoint(matrices: Complex) -> Complex:
    """Return the conjugate transpose of each matrix."""
    return np.swapaxes(matrices.conj(), -1, -2)


def form(N: Complex, D: Complex, G: Complex) -> Complex:
    """Return X = N^H D N - D + j (G N - N^H G) for each matrix N.

    If X is negative definite, I - N Δ is regular for all |δ| ≤ 1, which means that the loop is not
    at the limit of stability for any of these Δ.
    """
    half = adjoint(N) @ D @ N / 2 + 1j * (G @ N) - D / 2
    return half + adjoint(half)


def recentred(N: Complex, copies: NDArray[np.int64], low: Vector, high: Vector) -> Complex:
    """Return N after a change of variables in which a box of δ becomes |δ| ≤ 1.

    N is the response from the outputs to the inputs of Δ; its row n belongs to the parameter
    ``copies[n]``. The box reaches from ``low`` to ``high``. A proof for |δ| ≤ 1 with the returned
    matrix is a proof for the box.
    """
    middle, radius = ((low + high) / 2)[copies], ((high - low) / 2)[copies]
    found: Complex = np.linalg.solve(np.eye(len(middle)) - N * middle, N) * radius
    return found


class Scalings:
    """Finds scalings D and G for a Δ in which each parameter has a given number of copies."""

    def __init__(self, counts: Sequence[int]) -> None:
        self.clarabel = solver()
        self.counts = tuple(int(count) for count in counts)
        self.copies = np.repeat(np.arange(len(self.counts)), self.counts)
        """Index of the parameter for each row of Δ."""
        self.solved = 0
        """Number of convex problems that were solved."""
        n, basis, start = sum(self.counts), [], 0
        for count in self.counts:
            for i in range(start, start + count):
                for j in range(start, i + 1):
                    for value in (1.0, 1j)[: 2 - (i == j)]:
                        unit = np.zeros((n, n), complex)
                        unit[i, j], unit[j, i] = value, np.conj(value)
                        basis.append(unit)
            start += count
        self.basis = np.array(basis)
        # Constraints: D ≥ FLOOR in each block, and the trace of D is n. The last unknown is the
        # margin.
        rows, bounds, self.cones, start = [], [], [], 0
        for count in self.counts:
            block = self.basis[:, start : start + count, start : start + count]
            rows.append(-_triangle(block))
            bounds.append(-FLOOR * _triangle(np.eye(count, dtype=complex)))
            self.cones.append(self.clarabel.PSDTriangleConeT(2 * count))
            start += count
        rows.append(np.trace(self.basis, axis1=1, axis2=2).real[:, None])
        bounds.append(np.array([float(n)]))
        self.cones.append(self.clarabel.ZeroConeT(1))
        # limit the margin to 1, because for some N a large G would make it arbitrarily large
        bounds.append(np.array([1.0]))
        self.cones.append(self.clarabel.NonnegativeConeT(1))
        left = np.hstack(rows)
        self.fixed = np.zeros((left.shape[1] + 1, 2 * len(basis) + 1))
        self.fixed[:-1, : len(basis)] = left.T
        self.fixed[-1, -1] = 1.0
        self.bounds = np.concatenate(bounds)
        settings = self.clarabel.DefaultSettings()
        settings.verbose, settings.max_iter, settings.max_threads = False, 60, 1
        # No equilibration, because N is balanced already. Coarse tolerances suffice, because the
        # eigenvalues of X decide whether a solution proves anything.
        settings.equilibrate_enable = settings.chordal_decomposition_enable = False
        settings.tol_gap_abs = settings.tol_gap_rel = 1e-3
        settings.tol_feas = 1e-7
        self.settings = settings

    def best(self, N: Complex) -> tuple[float, Complex, Complex]:
        """Return the margin -λmax(X), and D and G that make it largest.

        A margin above 0 proves that I - N Δ is regular for all |δ| ≤ 1. The margin is at most 1,
        because D is scaled so that the mean of its eigenvalues is 1.
        """
        from scipy.sparse import csc_matrix

        n, count = len(N), len(self.basis)
        N, scale = _balanced(N)
        turned = 1j * (self.basis @ N)
        by_D = adjoint(N) @ self.basis @ N - self.basis
        lmi = np.vstack([
            _triangle(by_D), _triangle(turned + adjoint(turned)),
            _triangle(np.eye(n, dtype=complex))[None],
        ])  # fmt: skip
        aim = np.zeros(2 * count + 1)
        aim[-1] = -1.0
        found = self.clarabel.DefaultSolver(
            csc_matrix((len(aim), len(aim))), aim, csc_matrix(np.vstack([lmi.T, self.fixed])),
            np.concatenate([np.zeros(lmi.shape[1]), self.bounds]),
            [self.clarabel.PSDTriangleConeT(2 * n), *self.cones], self.settings,
        ).solve()  # fmt: skip
        self.solved += 1
        x = np.array(found.x)
        D, G = (np.tensordot(part, self.basis, 1) for part in (x[:count], x[count:-1]))
        margin = -float(np.linalg.eigvalsh(form(N, D, G))[-1])
        if not np.isfinite(margin) or np.linalg.eigvalsh(D)[0] <= 0:
            margin = -np.inf
        across = np.outer(scale, scale)
        return margin, D / across, G / across

    def largest(self, N: Complex, least: Vector, guess: float = 1.0) -> float:
        """Return the largest size k for which scalings prove I - N Δ regular for all |δ| ≤ k.

        Only values δ ≥ ``least`` are considered. The returned size is accurate to 0.5 %, and at
        most 1/SMALLEST. If ``guess`` is close to the result, half as many convex problems are
        solved.
        """

        def is_proved(log_size: float) -> bool:
            size = np.exp(log_size)
            low = np.maximum(-size, least)
            whole = recentred(N, self.copies, low, np.full(len(least), size))
            return log_size <= norm or self.best(whole)[0] > 0

        if not N.any():
            return 1 / SMALLEST
        # size below which the norm of N alone proves that I - N Δ is regular
        norm = -float(np.log(np.linalg.norm(_balanced(N)[0], 2))) - 1e-9
        most, step = -float(np.log(SMALLEST)), 0.1
        low = high = min(max(float(np.log(guess)), norm), most)
        while is_proved(high):
            low = high
            if low >= most:
                return 1 / SMALLEST
            high, step = min(low + step, most), 2 * step
        if low == high:
            low = max(low - step, norm)
            while not is_proved(low):
                high, low, step = low, max(low - 2 * step, norm), 2 * step
        while high - low > 5e-3:
            middle = (low + high) / 2
            low, high = (middle, high) if is_proved(middle) else (low, middle)
        return float(np.exp(low))


def mu_upper(N: Complex, counts: Sequence[int], least: Vector | None = None) -> float:
    """Return an upper bound of µ of a matrix for real, repeated parameters.

    ``counts`` has the number of copies of each parameter in Δ. ``least`` has lower bounds of δ for
    parameters such as damping ratios, which cannot be below 0.
    """
    ends = np.full(len(counts), -np.inf) if least is None else least
    return 1 / Scalings(counts).largest(np.asarray(N, complex), ends)


def _balanced(N: Complex) -> tuple[Complex, Vector]:
    """Return N scaled so that its rows and columns have the same norm (Osborne), and the scale.

    LAPACK is not used, because its scales are powers of 2. The scales here are continuous in N, so
    that D and G are continuous, too.
    """
    sizes = np.abs(N) + 1e-9 * np.abs(N).max()
    np.fill_diagonal(sizes, 0.0)
    scale = np.ones(len(N))
    for _ in range(30):
        for k in range(len(N)):
            row, column = np.linalg.norm(sizes[k]), np.linalg.norm(sizes[:, k])
            share = np.sqrt(row / column) if row and column else 1.0
            sizes[k] /= share
            sizes[:, k] *= share
            scale[k] *= share
    return N * scale / scale[:, None], scale


def _triangle(matrices: Complex) -> Vector:
    """Return Hermitian matrices as vectors, in the form that the solver Clarabel needs.

    A Hermitian matrix is represented by a real symmetric matrix of twice the size; the vector is
    the triangle of this matrix, with off-diagonal elements multiplied by √2.
    """
    real, imaginary = matrices.real, matrices.imag
    whole = np.concatenate([
        np.concatenate([real, -imaginary], -1), np.concatenate([imaginary, real], -1)
    ], -2)  # fmt: skip
    column, row = np.tril_indices(whole.shape[-1])
    found: Vector = whole[..., row, column] * np.where(row == column, 1.0, np.sqrt(2))
    return found
