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
from labkit.support.arrays import EPSILON, FloatArray, as_normals, as_pairs, check_range
from labkit.support.compiled import compiled
from labkit.support.errors import DegenerateAlignmentError

# A direction of motion is free if the residuals answer it, on average, by less than this share of
# what they answer straight motion into a wall: √0.02 is a mean angle of 8° between the surface and
# the direction, about the noise of a normal.
MIN_INFORMATION = 0.02
# A quarter is enough if the point-to-point share is at least STEADY_SHARE.
STEADY_SHARE, STEADY_INFORMATION = 0.03, 0.25 * MIN_INFORMATION
BUT_FOR_ROUNDING = 1.0 - 1e-12  # as τ → 1 eigenvalues and threshold both approach 1


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
    all equal by default. `other_normals` are the same normals, measured independently: their
    noise averages out of J'ᵀWJ. Raises as `align_to_lines` does.
    """
    p, n, w = as_pairs(points, normals, weights)
    other = n if other_normals is None else as_normals(other_normals, "other_normals", len(p))
    center, length = _center_and_length(p, w)
    values, vectors = np.linalg.eigh(information_matrix(p, n, other, w, center, length))
    return Information(center=np.array(center), length=length, values=values, vectors=vectors)


def align_to_lines(
    source: ArrayLike,
    target: ArrayLike,
    normals: ArrayLike,
    weights: ArrayLike,
    share: float = 0.0,
) -> FloatArray:
    """One Gauss-Newton step (3, 3) of the point-to-line metric: none in free directions.

    Matched points [m] and unit normals of the target's surface, shape (N, 2), of weights ≥ 0,
    and the share τ of the point-to-point metric. Raises `DegenerateAlignmentError` where no pair
    has weight, or all of them coincide.
    """
    p, q, w = as_pairs(source, target, weights)
    n = as_normals(normals, "normals", len(p))
    check_range(share, "share", at_least=0.0, at_most=1.0)
    _center_and_length(p, w)
    return line_step(p, q, n, w, float(share))


@compiled
def line_step(
    p: FloatArray, q: FloatArray, n: FloatArray, w: FloatArray, share: float
) -> FloatArray:
    """The step (3, 3) for pairs p, q (N, 2) [m], normals n and weights w; NaN if all coincide."""
    c, length = center_and_length(p, w)
    if not length > 0.0:
        return turn_about(c, math.nan, math.nan, math.nan)
    total, A, g = w.sum(), np.zeros((3, 3)), np.zeros(3)
    for i in range(len(p)):
        if w[i] > 0.0:
            ax, ay = (p[i, 0] - c[0]) / length, (p[i, 1] - c[1]) / length
            dx, dy = p[i, 0] - q[i, 0], p[i, 1] - q[i, 1]
            J = (n[i, 0], n[i, 1], n[i, 1] * ax - n[i, 0] * ay)  # (6.1)
            e = n[i, 0] * dx + n[i, 1] * dy
            pull = (dx, dy, ax * dy - ay * dx)  # of the point-to-point metric
            for row in range(3):
                g[row] += w[i] * ((1.0 - share) * J[row] * e + share * pull[row])
                for column in range(row + 1):  # A is symmetric, `eigh` reads this half of it
                    A[row, column] += w[i] * (1.0 - share) * J[row] * J[column]
    for k in range(3):
        A[k, k] += share * total
    x = solve_constrained(A, g, total * least_information(share))
    return turn_about(c, x[2] / length, x[0], x[1])


@compiled
def solve_constrained(A: FloatArray, g: FloatArray, minimum: float) -> FloatArray:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    eigenvalues, eigenvectors = np.linalg.eigh(A)
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
    """The eigenvalue, per unit of weight, from which on a direction is solved for."""
    least = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    return ((1.0 - point_share) * least + point_share) * BUT_FOR_ROUNDING


@compiled
def information_matrix(
    p: FloatArray,
    n: FloatArray,
    other: FloatArray,
    w: FloatArray,
    center: tuple[float, float],
    length: float,
) -> FloatArray:
    """J'ᵀWJ per unit of weight, (3, 3), symmetric; J' is made of the other normals."""
    A, total = np.zeros((3, 3)), w.sum()
    for i in range(len(p)):
        ax, ay = (p[i, 0] - center[0]) / length, (p[i, 1] - center[1]) / length
        ux, uy, vx, vy = n[i, 0], n[i, 1], other[i, 0], other[i, 1]
        if ux * vx + uy * vy < 0.0:
            vx, vy = -vx, -vy  # the same side of the surface
        J, K = (ux, uy, uy * ax - ux * ay), (vx, vy, vy * ax - vx * ay)
        for row in range(3):
            for column in range(3):
                A[row, column] += 0.5 * w[i] * (J[row] * K[column] + K[row] * J[column]) / total
    return A


@compiled
def center_and_length(points: FloatArray, weights: FloatArray) -> tuple[tuple[float, float], float]:
    """The weighted centroid c [m] and the root mean square distance ℓ [m] from it.

    ℓ is 0 where no point has weight, or where all of them coincide.
    """
    center, square, total, most = centroid(points, weights), 0.0, 0.0, 0.0
    for i in range(len(points)):
        if weights[i] > 0.0:
            x, y = points[i, 0] - center[0], points[i, 1] - center[1]
            square, total = square + weights[i] * (x * x + y * y), total + weights[i]
            most = max(most, abs(points[i, 0]), abs(points[i, 1]))
    length = math.sqrt(square / total) if total > 0.0 else 0.0
    return center, length if length > 64.0 * EPSILON * most else 0.0


def _center_and_length(p: FloatArray, w: FloatArray) -> tuple[tuple[float, float], float]:
    """The same; raise an error where ℓ is 0."""
    center, length = center_and_length(p, w)
    if not length > 0.0:
        raise DegenerateAlignmentError(
            f"{np.count_nonzero(w)} surface points with weight lie in one place or are none; "
            f"a line needs two that lie apart"
        )
    return center, length
