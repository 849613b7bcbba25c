"""Alignment to the lines through the target points: the point-to-line metric.

A pair's residual is its distance from the target's surface, e = n·(p − q), so a scan may
slide along a wall at no cost. Linearised about the source's centroid c, a small motion
x = (Δx, Δy, ℓΔψ) changes e by J x, with the row

    J = (nᵀ, n·a⊥) ,      a = (p − c) / ℓ ,      (u, v)⊥ = (−v, u)               (6.1)

of each pair. That leaves a 3×3 system A x = −g with A = JᵀWJ and g = JᵀWe. Where the
surface fixes only part of the motion (a corridor, a single wall), only that part of x is
solved for; the rest stays zero.

Under the point-to-point metric J has two rows a pair, (I, a⊥), and its A is the identity
times the total weight, so that a share τ of it is (1 − τ) A + τ W I (see `labkit.approach`).

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

from labkit.arrays import EPSILON, FloatArray
from labkit.errors import DegenerateAlignmentError
from labkit.se2 import compose, transform

# A direction of motion is free when the residuals answer it, on average, by less than
# this share of what they answer straight motion into a wall: √0.02 is a mean angle of 8°
# between the surface and the direction, about the noise of a normal.
MIN_INFORMATION = 0.02
# A quarter of it will do where so much of point-to-point steadies the step.
STEADY_SHARE, STEADY_INFORMATION = 0.03, 0.25 * MIN_INFORMATION
# As τ → 1 eigenvalues and threshold both approach 1; this margin absorbs rounding.
BUT_FOR_ROUNDING = 1.0 - 1e-12


@dataclass(frozen=True, eq=False, kw_only=True)
class Information:
    """Eigen-structure of what a set of surface points says about a planar motion.

    Attributes
    ----------
    center : ndarray, shape (2,)
        The point c [m] that the motion turns about.
    length : float
        Root mean square distance ℓ [m] of the points from c: it makes an angle comparable
        with a translation, so that the motion's coordinates are (Δx, Δy, ℓ Δψ).
    values : ndarray, shape (3,)
        Mean square change of the residuals for a unit motion along each eigenvector,
        ascending; about ½ for translations in a room, 0 along a corridor.
    vectors : ndarray, shape (3, 3)
        The eigenvectors, as columns.
    """

    center: FloatArray
    length: float
    values: FloatArray
    vectors: FloatArray

    @property
    def free(self) -> FloatArray:
        """Directions of motion (Δx, Δy, ℓ Δψ) that the points leave free, shape (3, F)."""
        return self.vectors[:, self.values < MIN_INFORMATION]

    @property
    def degenerate(self) -> bool:
        """Whether any direction of motion is free."""
        return bool(self.values[0] < MIN_INFORMATION)


def line_information(
    points: FloatArray,
    normals: FloatArray,
    weights: FloatArray | None = None,
    other_normals: FloatArray | None = None,
) -> Information:
    """Information that surface points carry about a small rigid motion.

    Parameters
    ----------
    points, normals : ndarray, shape (N, 2)
        Points [m] on surfaces, and the unit normals there.
    weights : ndarray, shape (N,), optional
        Weight of each, ≥ 0; all equal by default.
    other_normals : ndarray, shape (N, 2), optional
        The same normals, measured independently: their noise averages out of J'ᵀWJ.

    Raises
    ------
    DegenerateAlignmentError
        Where there is no point with weight, or all of them coincide.
    """
    w = np.ones(len(points)) if weights is None else weights
    center, length = center_and_length(points, w)
    arm = (points - center) / length
    J = np.column_stack([normals, lever(normals, arm)])
    other = J
    if other_normals is not None:
        same_side = np.copysign(1.0, (normals * other_normals).sum(axis=1))[:, None]
        other = same_side * np.column_stack([other_normals, lever(other_normals, arm)])
    A = J.T @ (w[:, None] * other) / w.sum()
    values, vectors = np.linalg.eigh(0.5 * (A + A.T))
    return Information(center=center, length=length, values=values, vectors=vectors)


def align_to_lines(
    source: FloatArray,
    target: FloatArray,
    normals: FloatArray,
    weights: FloatArray,
    point_share: float = 0.0,
) -> FloatArray:
    """One Gauss-Newton step of the point-to-line metric.

    Parameters
    ----------
    source, target, normals : ndarray, shape (N, 2)
        Matched points [m] and the unit normals of the target's surface.
    weights : ndarray, shape (N,)
        Weight of each pair, ≥ 0.
    point_share : float
        τ in [0, 1]: how much of the cost is that of the point-to-point metric.

    Returns
    -------
    ndarray, shape (3, 3)
        The step ``T_target_source``, identity in every free direction.

    Raises
    ------
    DegenerateAlignmentError
        Where there is no pair with weight, or all of them coincide.
    """
    center, length = center_and_length(source, weights)
    offset, arm, total = source - target, (source - center) / length, weights.sum()
    J = np.column_stack([normals, lever(normals, arm)])  # (6.1)
    e = (normals * offset).sum(axis=1)
    A = J.T @ (weights[:, None] * J)
    g = J.T @ (weights * e)
    if point_share > 0.0:
        turning = arm[:, 0] * offset[:, 1] - arm[:, 1] * offset[:, 0]  # a⊥·(p − q)
        pull = np.column_stack([offset, turning]).T @ weights
        A = (1.0 - point_share) * A + point_share * total * np.eye(3)
        g = (1.0 - point_share) * g + point_share * pull
    dx, dy, turn = solve_constrained(A, g, total * least_information(point_share))
    (x, y), step = center, transform(dx, dy, turn / length)
    return compose(transform(x, y, 0.0), step, transform(-x, -y, 0.0))  # about the centroid


def least_information(point_share: float) -> float:
    """The eigenvalue, per unit of weight, from which on a direction is solved for."""
    least = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    return ((1.0 - point_share) * least + point_share) * BUT_FOR_ROUNDING


def solve_constrained(A: FloatArray, g: FloatArray, minimum: float) -> FloatArray:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    eigenvalues, eigenvectors = np.linalg.eigh(A)
    constrained = eigenvalues >= minimum
    V = eigenvectors[:, constrained]
    x: FloatArray = -V @ ((V.T @ g) / eigenvalues[constrained])
    return x


def lever(normals: FloatArray, arm: FloatArray) -> FloatArray:
    """n·a⊥ of each row: how far a unit turn moves the point along its normal, shape (N,)."""
    turned: FloatArray = normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]
    return turned


def center_and_length(points: FloatArray, weights: FloatArray) -> tuple[FloatArray, float]:
    """The weighted centroid c [m] and the root mean square distance ℓ [m] from it."""
    total = weights.sum()
    if total <= 0.0:
        raise DegenerateAlignmentError(f"none of {len(weights)} pairs has weight on a surface")
    center = weights @ points / total
    length = math.sqrt(weights @ ((points - center) ** 2).sum(axis=1) / total)
    if length <= 64.0 * EPSILON * np.abs(points).max():
        raise DegenerateAlignmentError(f"all {len(weights)} surface points coincide")
    return center, length
