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

from labkit.arrays import FloatArray
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
    A, g, center, length = _normal_equations(source, target, normals, weights, point_share)
    minimum = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    dx, dy, turn = _solve_constrained(A, g, (1.0 - point_share) * minimum + point_share)
    cx, cy = center.tolist()
    c, s = math.cos(turn / length), math.sin(turn / length)
    return np.array(  # turn about the centre, then shift
        [[c, -s, cx + dx - c * cx + s * cy], [s, c, cy + dy - s * cx - c * cy], [0.0, 0.0, 1.0]]
    )


def _normal_equations(
    source: FloatArray,
    target: FloatArray,
    normals: FloatArray,
    weights: FloatArray,
    point_share: float = 0.0,
) -> tuple[list[list[float]], list[float], FloatArray, float]:
    """A (3, 3) and g (3,) of the motion (Δx, Δy, ℓ Δψ), per unit of weight; centre and ℓ.

    All sums come from one product of eight rows, a column for each pair, with their
    transpose: on 360 pairs that takes half as long as summing them one after the other. What
    follows is plain numbers: in arrays of three, a step from afar takes 30 µs and not 22.
    """
    total = float(weights.sum())
    if total <= 0.0:
        raise DegenerateAlignmentError(f"none of {len(source)} pairs has weight on a surface")
    center: FloatArray = source.T @ weights / total
    rows = np.empty((8, len(source)))
    nx, ny, turn, residual, ax, ay, ex, ey = rows
    rows[:2] = normals.T
    np.subtract(source.T, center[:, None], out=rows[4:6])
    np.subtract(source.T, target.T, out=rows[6:])
    np.subtract(ny * ax, nx * ay, out=turn)  # (5.1)
    np.add(nx * ex, ny * ey, out=residual)
    M = ((rows * (weights / total)) @ rows.T).tolist()
    (a, b, c, u, *_), (_, d, e, v, *_), (_, _, f, w, *_) = M[:3]
    length = math.sqrt(M[4][4] + M[5][5])
    if length <= 64.0 * EPSILON * max(map(abs, center.tolist())):  # what the mean rounds by
        raise DegenerateAlignmentError(f"all {len(source)} surface points coincide")
    c, e, f, w = c / length, e / length, f / length / length, w / length
    if point_share > 0.0:
        x, y = (rows[6:] @ weights / total).tolist()
        t, rest = point_share, 1.0 - point_share
        a, b, c, d, e, f = rest * a + t, rest * b, rest * c, rest * d + t, rest * e, rest * f + t
        pull = (M[4][7] - M[5][6]) / length
        u, v, w = rest * u + t * x, rest * v + t * y, rest * w + t * pull
    return [[a, b, c], [b, d, e], [c, e, f]], [u, v, w], center, length


def _solve_constrained(A: list[list[float]], g: list[float], minimum: float) -> list[float]:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    (a, b, c), (_, d, e), (_, _, f) = A
    u, v, w = d * f - e * e, c * e - b * f, b * e - c * d  # first row of the adjugate
    determinant = a * u + b * v + c * w
    # λ₁ = det A / (λ₂ λ₃) ≥ 4 det A / (λ₂ + λ₃)²: mostly this settles it without eigenvalues.
    if 4.0 * determinant >= minimum * (a + d + f) ** 2:
        p, q, r = a * f - c * c, b * c - a * e, a * d - b * b
        x, y, t = (-each / determinant for each in g)
        return [u * x + v * y + w * t, v * x + p * y + q * t, w * x + q * y + r * t]
    values, vectors = np.linalg.eigh(A)
    constrained = values >= minimum
    values, vectors = values[constrained], vectors[:, constrained]
    solution: list[float] = (-vectors @ ((np.array(g) @ vectors) / values)).tolist()
    return solution
