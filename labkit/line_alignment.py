"""Alignment to the lines through the target points: the point-to-line metric.

A pair's residual is its distance from the target's surface, e = n·(p − q), so a scan may
slide along a wall at no cost. Linearised about the source's centroid c, a small motion
x = (Δx, Δy, Δψ) changes e by

    n·Δt + Δψ n·(p − c)⊥ ,      (u, v)⊥ = (−v, u)                               (5.1)

which leaves a 3×3 system A x = −g. Where the surface fixes only part of the motion (a
corridor, a single wall), only that part of x is solved for; the rest stays at rest.

Along the lines the residual is that of e⊥ = n⊥·(p − q), and the two together make the
point-to-point metric. In the units used here, (Δx, Δy, ℓΔψ) per unit of weight, its A is
the identity, so that a share τ of it is (1 − τ) A + τ I, at no cost (see `labkit.approach`).

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

from labkit.arrays import FloatArray, dots
from labkit.errors import DegenerateAlignmentError

# A direction of motion is free when the residuals answer it, on average, by less than
# this share of what they answer straight motion into a wall: √0.02 is a mean angle of 8°
# between the surface and the direction, about the noise of a normal.
MIN_INFORMATION = 0.02
# A quarter of it will do where so much of point-to-point steadies the step.
STEADY_SHARE, STEADY_INFORMATION = 0.03, 0.25 * MIN_INFORMATION
EPSILON = float(np.finfo(float).eps)


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
        Mean squared answer of the residuals to a unit motion along each eigenvector,
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
    points: FloatArray, normals: FloatArray, weights: FloatArray | None = None
) -> Information:
    """What points (N, 2) [m] on surfaces with normals (N, 2) say about a motion of theirs.

    Raises
    ------
    DegenerateAlignmentError
        Where there is no point with weight, or all of them coincide.
    """
    w = np.ones(len(points)) if weights is None else weights
    A, _, center, length = _normal_equations(points, points, normals, w)
    values, vectors = np.linalg.eigh(A)
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
    A, g, center, length = _normal_equations(source, target, normals, weights)
    minimum = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    if point_share > 0.0:
        pull = _point_gradient(source - center, source - target, weights, length)
        A = (1.0 - point_share) * A + point_share * np.eye(3)
        g = (1.0 - point_share) * g + point_share * pull
        minimum = (1.0 - point_share) * minimum + point_share
    dx, dy, turn = _solve_constrained(A, g, minimum).tolist()
    cx, cy = center.tolist()
    c, s = math.cos(turn / length), math.sin(turn / length)
    return np.array(  # turn about the centre, then shift
        [[c, -s, cx + dx - c * cx + s * cy], [s, c, cy + dy - s * cx - c * cy], [0.0, 0.0, 1.0]]
    )


def _normal_equations(
    source: FloatArray, target: FloatArray, normals: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """A (3, 3) and g (3,) of the motion (Δx, Δy, ℓ Δψ), per unit of weight; centre and ℓ."""
    total = float(weights.sum()) if len(source) else 0.0
    if total <= 0.0:
        raise DegenerateAlignmentError(f"none of {len(source)} pairs has weight on a surface")
    center = weights @ source / total
    arm = source - center
    length = math.sqrt(float(weights @ dots(arm, arm)) / total)
    if length <= 64.0 * EPSILON * max(map(abs, center.tolist())):  # what the mean rounds by
        raise DegenerateAlignmentError(f"all {len(source)} surface points coincide")
    rows = np.empty((4, len(source)))  # (5.1) and the residual, one column a pair
    rows[:2] = normals.T
    rows[2] = (normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]) / length
    rows[3] = dots(normals, source - target)
    M = (rows * (weights / total)) @ rows.T
    return M[:3, :3], M[:3, 3], center, length


def _point_gradient(
    arm: FloatArray, offset: FloatArray, weights: FloatArray, length: float
) -> FloatArray:
    """Gradient g (3,) of the point-to-point metric, in the units of `_normal_equations`."""
    pull = np.empty((len(arm), 3))
    pull[:, :2] = offset
    pull[:, 2] = (arm[:, 0] * offset[:, 1] - arm[:, 1] * offset[:, 0]) / length
    gradient: FloatArray = weights @ pull / weights.sum()
    return gradient


def _solve_constrained(A: FloatArray, g: FloatArray, minimum: float) -> FloatArray:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    (a, b, c), (_, d, e), (_, _, f) = A.tolist()
    u, v, w = d * f - e * e, c * e - b * f, b * e - c * d  # first row of the adjugate
    determinant = a * u + b * v + c * w
    # λ₁ = det A / (λ₂ λ₃) ≥ 4 det A / (λ₂ + λ₃)²: mostly this settles it without eigenvalues.
    if 4.0 * determinant >= minimum * (a + d + f) ** 2:
        p, q, r = a * f - c * c, b * c - a * e, a * d - b * b
        gx, gy, gt = (g / -determinant).tolist()
        return np.array(
            [u * gx + v * gy + w * gt, v * gx + p * gy + q * gt, w * gx + q * gy + r * gt]
        )
    values, vectors = np.linalg.eigh(A)
    constrained = values >= minimum
    values, vectors = values[constrained], vectors[:, constrained]
    x: FloatArray = -vectors @ ((g @ vectors) / values)
    return x
