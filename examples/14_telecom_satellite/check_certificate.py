"""Checks a certificate of robust stability with only NumPy: python check_certificate.py FILE."""

import sys
from math import comb
from pathlib import Path

import numpy as np


def check(path: str | Path) -> float:
    """Check a certificate of stability in the file ``path`` without the package.

    Return the largest eigenvalue of the matrix X of the proof; stability is proved if it is below
    0.
    """
    c = np.load(path)
    copies, period, n = np.repeat(np.arange(len(c["counts"])), c["counts"]), c["period"], 9
    same = copies[:, None] == copies
    if (c["D"][:, ~same] != 0).any() or (c["G"][:, ~same] != 0).any():
        raise ValueError("a scaling matrix D does not commute with Δ")
    if any(not np.allclose(x, x.conj().swapaxes(1, 2), 1e-12, 0) for x in (c["D"], c["G"])):
        raise ValueError("a scaling is not Hermitian")
    if np.linalg.eigvalsh(c["D"]).min() <= 0:
        raise ValueError("a D is not positive definite")
    A, B, C, D = (c[f"L_{part}"] for part in "ABCD")
    if abs(np.linalg.eigvals(A - B @ np.linalg.solve(np.eye(len(D)) + D, C))).max() > 1 + 1e-9:
        raise ValueError("the loop is unstable at Δ = 0")
    # intervals of frequency times boxes of Δ must cover everything without a gap or an overlap
    whole = np.maximum(-c["size"], c["least"]), np.full(len(c["counts"]), c["size"])
    low, high = (np.column_stack([c[f], c[f"box_{f}"]]) for f in ("low", "high"))
    ends = np.append(0.0, whole[0]), np.append(0.5 / period, whole[1])
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    apart = (shared <= 1e-12 * (ends[1] - ends[0])).any(axis=2) | np.eye(len(low), dtype=bool)
    filled = np.prod((high - low) / (ends[1] - ends[0]), axis=1).sum()
    if (low < ends[0]).any() or (high > ends[1]).any() or not apart.all() or filled < 1 - 1e-9:
        raise ValueError("intervals and boxes do not cover all frequencies and all of Δ")

    def response(name: str, s: np.ndarray) -> np.ndarray:
        A, B, C, D = (c[f"{name}_{part}"] for part in "ABCD")
        return C @ np.linalg.solve(s[:, None, None] * np.eye(len(A)) - A, B[None]) + D

    x = (1 - np.cos(np.pi * (np.arange(n) + 0.5) / n)) / 2
    bernstein = np.linalg.inv(
        [[comb(n - 1, k) * t**k * (1 - t) ** (n - 1 - k) for k in range(n)] for t in x]
    )
    chebyshev = np.linalg.inv(np.polynomial.chebyshev.chebvander(2 * x - 1, n - 1))
    size, worst = len(copies), -np.inf
    rows = zip(low[:, 0], high[:, 0], low[:, 1:], high[:, 1:], strict=True)
    for k, (a, b, l, h) in enumerate(rows):
        f = a + (b - a) * x
        # D and G are interpolated linearly over an interval of frequency
        t = ((f - c["start"][k]) / (c["stop"][k] - c["start"][k]))[:, None, None]
        D, G = ((1 - t) * c[m][c["first"][k]] + t * c[m][c["last"][k]] for m in "DG")
        if t.min() < 0 or t.max() > 1:
            raise ValueError("an interval reaches beyond its scalings")
        s, z = 2j * np.pi * f, np.exp(2j * np.pi * f * period)
        hold = np.sinc(f * period) * np.exp(-s * (period / 2 + c["delay"]))
        P, K, L = response("M", s), response("K", z) * hold[:, None, None], response("L", z)
        across = np.linalg.solve(np.eye(L.shape[1]) + L, K @ P[:, size:, :size])
        N = P[:, :size, :size] - P[:, :size, size:] @ across
        N = np.linalg.solve(np.eye(size) - N * ((l + h) / 2)[copies], N) * ((h - l) / 2)[copies]
        NH, scale = N.conj().swapaxes(1, 2), np.sqrt(np.diag(D[0]).real)
        X = NH @ D @ N - D + 1j * (G @ N - NH @ G)
        X = X / np.outer(scale, scale)
        rest = np.linalg.norm(abs(np.tensordot(chebyshev[-2:], X, 1)).sum(axis=0))
        top = np.linalg.eigvalsh(np.tensordot(bernstein, X, 1))[:, -1].max() + rest
        worst = max(worst, top)
    return float(worst)


if __name__ == "__main__":
    top = check(sys.argv[1] if len(sys.argv) > 1 else "certificate.npz")
    print(f"largest eigenvalue {top:.3g}: {'proved' if top < 0 else 'NOT proved'}")
