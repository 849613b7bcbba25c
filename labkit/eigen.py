"""Eigenvalues and eigenvectors of a symmetric (3, 3) by Jacobi's rotations.

numba's `eigh` would load `scipy.linalg`, which takes a third of the first match.

References
----------
.. [1] Golub, Van Loan, "Matrix Computations", 4th ed., 2013, section 8.5.
"""

from __future__ import annotations

import math

import numpy as np

from labkit.support.arrays import EPSILON, FloatArray
from labkit.support.compiled import compiled

MAX_SWEEPS = 12  # over all three rotations; five are enough for doubles


@compiled
def eigen_symmetric(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues, ascending, and eigenvectors, as columns, of a symmetric (3, 3).

    Each of Jacobi's rotations J [1]_ turns A into JᵀAJ, with a zero beside the diagonal; after a
    few of them A is diagonal, but for rounding.
    """
    D = A.copy()  # becomes diagonal
    V = np.zeros((3, 3))  # becomes the product of all J
    for k in range(3):
        V[k, k] = 1.0
    rounding = EPSILON * largest_entry(A)
    for _ in range(MAX_SWEEPS):
        is_diagonal = True
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if abs(D[q, p]) > rounding:
                is_diagonal = False
                c, s = jacobi_rotation(D, p, q)
                turn_columns(D, p, q, c, s)  # D J
                turn_rows(D, p, q, c, s)  # Jᵀ D J
                turn_columns(V, p, q, c, s)  # V J
                D[p, q] = 0.0  # but for rounding, it is by now
                D[q, p] = 0.0
        if is_diagonal:
            break
    return sort_columns(V, D)


@compiled
def largest_entry(A: FloatArray) -> float:
    """The largest magnitude of an entry of A (3, 3)."""
    largest = 0.0
    for row in range(3):
        for column in range(3):
            largest = max(largest, abs(A[row, column]))
    return largest


@compiled
def jacobi_rotation(D: FloatArray, p: int, q: int) -> tuple[float, float]:
    """Cosine and sine of the rotation J after which JᵀDJ is 0 at row p and column q."""
    cotangent = 0.5 * (D[q, q] - D[p, p]) / D[q, p]  # of twice the angle
    # Its tangent t solves t² + 2 t cotangent = 1; the root nearer to 0 turns least.
    t = math.copysign(1.0, cotangent) / (abs(cotangent) + math.hypot(cotangent, 1.0))
    c = 1.0 / math.hypot(t, 1.0)
    return c, t * c


@compiled
def turn_columns(M: FloatArray, p: int, q: int, c: float, s: float) -> None:
    """M becomes M J: the rotation of its columns p and q."""
    for row in range(3):
        a, b = M[row, p], M[row, q]
        M[row, p] = c * a - s * b
        M[row, q] = s * a + c * b


@compiled
def turn_rows(M: FloatArray, p: int, q: int, c: float, s: float) -> None:
    """M becomes JᵀM: the rotation of its rows p and q."""
    for column in range(3):
        a, b = M[p, column], M[q, column]
        M[p, column] = c * a - s * b
        M[q, column] = s * a + c * b


@compiled
def sort_columns(vectors: FloatArray, D: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The diagonal of D in ascending order, and its vectors, as columns, in the same order.

    numba's `argsort` would take a second of the first compilation.
    """
    values = np.zeros(3)
    for k in range(3):
        values[k] = D[k, k]
    for k in (0, 1, 0):  # neighbours change places: this orders three
        if values[k] > values[k + 1]:
            values[k], values[k + 1] = values[k + 1], values[k]
            for row in range(3):
                vectors[row, k], vectors[row, k + 1] = vectors[row, k + 1], vectors[row, k]
    return values, vectors
