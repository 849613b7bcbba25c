"""Alignment to the lines through the target points: the point-to-line metric.

A pair's residual is its distance from the target's surface, e = n·(p − q), so a scan may
slide along a wall at no cost. Linearised about the source's centroid c, a small motion
x = (Δx, Δy, ℓΔψ) changes e by J x, with the row

    J = (nᵀ, n·a⊥) ,      a = (p − c) / ℓ ,      (u, v)⊥ = (−v, u)               (6.1)

of each pair. That leaves a 3×3 system A x = −g with A = JᵀWJ and g = JᵀWe. Where the
surface fixes only part of the motion (a corridor, a single wall), only that part of x is
solved for; the rest stays zero.

Under the point-to-point metric J has two rows a pair, (I, a⊥), and its A is the identity
times the total weight, so that a share τ of it is (1 − τ) A + τ W I (see `labkit.schedule`).

References
----------
.. [1] Chen, Medioni, "Object modelling by registration of multiple range images",
       Image and Vision Computing 10(3), 1992.
.. [2] Censi, "An ICP variant using a point-to-line metric", ICRA 2008.
.. [3] Zhang, Kaess, Singh, "On degeneracy of optimization-based state estimation
       problems", ICRA 2016 (solving in the constrained directions alone).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.alignment import centroid, turn_about
from labkit.eigen import eigen_symmetric
from labkit.support.arrays import EPSILON, FloatArray, as_normals, as_pairs, check_range
from labkit.support.compiled import compiled
from labkit.support.errors import DegenerateAlignmentError

# A direction of motion is free if its eigenvalue is below this share of that of a motion straight
# into a wall: √0.02 is the sine of 8° between direction and surface, about the noise of a normal.
MIN_INFORMATION = 0.02
STEADY_SHARE = 0.03  # share of point-to-point that steadies a step, so that
STEADY_INFORMATION = 0.25 * MIN_INFORMATION  # less information is enough
BUT_FOR_ROUNDING = 1.0 - 1e-12  # at τ = 1 eigenvalue and threshold are both 1, but for rounding


@dataclass(frozen=True, eq=False, kw_only=True)
class Information:
    """Eigen-structure of what a set of surface points says about a planar motion.

    The coordinates of the motion are (Δx, Δy, ℓ Δψ), for an angle to compare with a translation.
    An eigenvalue is the mean square change of the residuals for a unit motion along its
    eigenvector: about ½ for translations in a room, 0 along a corridor.
    """

    center: FloatArray  #: The point c [m] that the motion turns about, shape (2,).
    length: float  #: Root mean square distance ℓ [m] of the points from c.
    values: FloatArray  #: The eigenvalues, ascending, shape (3,).
    vectors: FloatArray  #: The eigenvectors, as columns, shape (3, 3).

    @property
    def free(self) -> FloatArray:
        """Directions of motion (Δx, Δy, ℓ Δψ) that the points leave free, shape (3, F)."""
        return self.vectors[:, self.values < MIN_INFORMATION]

    @property
    def degenerate(self) -> bool:
        """True if any direction of motion is free."""
        return bool(self.values[0] < MIN_INFORMATION)


def line_information(
    points: ArrayLike,
    normals: ArrayLike,
    weights: ArrayLike | None = None,
    other_normals: ArrayLike | None = None,
) -> Information:
    """Information that surface points carry about a small rigid motion.

    Points [m] on surfaces and the unit normals there, shape (N, 2), of weights ≥ 0, shape (N,),
    all equal by default. `other_normals` are a second, independent measurement of the same
    normals, from which the rows K are built: the noise averages out of JᵀWK. Raises as
    `align_to_lines` does.
    """
    p, n, w = as_pairs(points, normals, weights)
    as_normals(n, "normals", len(p))
    other = n if other_normals is None else as_normals(other_normals, "other_normals", len(p))
    _check_spread(p, w)
    return information_of(p, n, other, w)


def information_of(p: FloatArray, n: FloatArray, other: FloatArray, w: FloatArray) -> Information:
    """The same of arrays that are checked, points with weight that do not coincide."""
    center, length, values, vectors = eigen_information(p, n, other, w)
    return Information(center=np.array(center), length=length, values=values, vectors=vectors)


def align_to_lines(
    source: ArrayLike,
    target: ArrayLike,
    normals: ArrayLike,
    weights: ArrayLike,
    share: float = 0.0,
) -> FloatArray:
    """One Gauss-Newton step (3, 3) of the point-to-line metric: zero along free directions.

    Matched points [m] and unit normals of the target's surface, shape (N, 2), of weights ≥ 0,
    and the share τ of the point-to-point metric. Raises `DegenerateAlignmentError` where no pair
    has weight, or all of them coincide.
    """
    p, q, w = as_pairs(source, target, weights)
    n = as_normals(normals, "normals", len(p))
    check_range(share, "share", at_least=0.0, at_most=1.0)
    _check_spread(p, w)
    return line_step(p, q, n, w, float(share))


@compiled
def line_step(
    p: FloatArray, q: FloatArray, n: FloatArray, w: FloatArray, share: float
) -> FloatArray:
    """The step (3, 3) for pairs p, q (N, 2) [m], normals n and weights w; NaN if all coincide."""
    center, length = center_and_length(p, w)
    if not length > 0.0:
        return turn_about(center, math.nan, math.nan, math.nan)
    J = line_rows(p, n, center, length)
    A, g = normal_equations(J, J, line_residuals(p, q, n), w)
    if share > 0.0:
        A, g = add_point_share(A, g, p, q, w, center, length, share)
    x = solve_constrained(A, g, w.sum() * least_information(share))
    return turn_about(center, x[2] / length, x[0], x[1])


@compiled
def line_rows(
    p: FloatArray, n: FloatArray, center: tuple[float, float], length: float
) -> FloatArray:
    """The rows J (6.1): change of each residual with the motion (Δx, Δy, ℓΔψ), shape (N, 3)."""
    J = np.empty((len(p), 3))
    for i in range(len(p)):
        ax = (p[i, 0] - center[0]) / length
        ay = (p[i, 1] - center[1]) / length
        J[i, 0] = n[i, 0]
        J[i, 1] = n[i, 1]
        J[i, 2] = n[i, 1] * ax - n[i, 0] * ay
    return J


@compiled
def line_residuals(p: FloatArray, q: FloatArray, n: FloatArray) -> FloatArray:
    """Signed distances e = n·(p − q) [m] of points p from the lines through q, shape (N,)."""
    e = np.empty(len(p))
    for i in range(len(p)):
        e[i] = n[i, 0] * (p[i, 0] - q[i, 0]) + n[i, 1] * (p[i, 1] - q[i, 1])
    return e


@compiled
def normal_equations(
    J: FloatArray, K: FloatArray, e: FloatArray, w: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A = ½ Σ w (JᵀK + KᵀJ), shape (3, 3), and g = Σ w Jᵀe, shape (3,), over pairs with weight.

    K is J, or the rows of the same pairs with other normals.
    """
    A = np.zeros((3, 3))
    g = np.zeros(3)
    for i in range(len(w)):
        if w[i] > 0.0:
            for row in range(3):
                g[row] += w[i] * J[i, row] * e[i]
                for column in range(3):
                    both = J[i, row] * K[i, column] + K[i, row] * J[i, column]
                    A[row, column] += 0.5 * w[i] * both
    return A, g


@compiled
def add_point_share(
    A: FloatArray,
    g: FloatArray,
    p: FloatArray,
    q: FloatArray,
    w: FloatArray,
    center: tuple[float, float],
    length: float,
    share: float,
) -> tuple[FloatArray, FloatArray]:
    """(1 − τ) A + τ W I, and (1 − τ) g + τ times the g of the point-to-point metric."""
    A = (1.0 - share) * A
    g = (1.0 - share) * g
    for i in range(len(w)):
        if w[i] > 0.0:
            ax = (p[i, 0] - center[0]) / length
            ay = (p[i, 1] - center[1]) / length
            dx, dy = p[i, 0] - q[i, 0], p[i, 1] - q[i, 1]
            g[0] += share * w[i] * dx
            g[1] += share * w[i] * dy
            g[2] += share * w[i] * (ax * dy - ay * dx)
    for k in range(3):
        A[k, k] += share * w.sum()
    return A, g


@compiled
def solve_constrained(A: FloatArray, g: FloatArray, minimum: float) -> FloatArray:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    eigenvalues, eigenvectors = eigen_symmetric(A)
    x = np.zeros(3)
    for k in range(3):
        if eigenvalues[k] >= minimum:
            v = eigenvectors[:, k]
            share = (v[0] * g[0] + v[1] * g[1] + v[2] * g[2]) / eigenvalues[k]
            for row in range(3):
                x[row] -= share * v[row]
    return x


@compiled
def least_information(point_share: float) -> float:
    """Smallest eigenvalue, per unit of weight, of a direction that a step is solved for.

    The point-to-point share τ turns an eigenvalue λ of the lines into (1 − τ) λ + τ.
    """
    of_lines = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    return ((1.0 - point_share) * of_lines + point_share) * BUT_FOR_ROUNDING


@compiled
def eigen_information(
    p: FloatArray, n: FloatArray, other: FloatArray, w: FloatArray
) -> tuple[tuple[float, float], float, FloatArray, FloatArray]:
    """Centre and length, and the eigenvalues and vectors of JᵀWK per unit of weight.

    K are the rows of the other normals, turned to the same side of the surface.
    """
    center, length = center_and_length(p, w)
    same_side = other.copy()
    for i in range(len(p)):
        if n[i, 0] * other[i, 0] + n[i, 1] * other[i, 1] < 0.0:
            same_side[i, 0] = -other[i, 0]
            same_side[i, 1] = -other[i, 1]
    J = line_rows(p, n, center, length)
    K = line_rows(p, same_side, center, length)
    A, _ = normal_equations(J, K, np.zeros(len(p)), w)
    values, vectors = eigen_symmetric(A / w.sum())
    return center, length, values, vectors


@compiled
def center_and_length(points: FloatArray, weights: FloatArray) -> tuple[tuple[float, float], float]:
    """The weighted centroid c [m] and the root mean square distance ℓ [m] from it.

    ℓ is 0 where no point has weight, or where all of them coincide.
    """
    center = centroid(points, weights)
    squares = 0.0
    total = 0.0
    largest = 0.0  # coordinate [m]: rounding is relative to it
    for i in range(len(points)):
        if weights[i] > 0.0:
            x, y = points[i, 0] - center[0], points[i, 1] - center[1]
            squares += weights[i] * (x * x + y * y)
            total += weights[i]
            largest = max(largest, abs(points[i, 0]), abs(points[i, 1]))
    length = math.sqrt(squares / total) if total > 0.0 else 0.0
    return center, length if length > 64.0 * EPSILON * largest else 0.0


def _check_spread(p: FloatArray, w: FloatArray) -> None:
    """Raise an error unless two points with weight lie apart."""
    _, length = center_and_length(p, w)
    if not length > 0.0:
        raise DegenerateAlignmentError(
            f"{np.count_nonzero(w)} surface points with weight lie in one place or are none; "
            f"a line needs two that lie apart"
        )
