"""Alignment to the lines through the target points: the point-to-line metric.

A pair's residual is its distance from the target's surface, e = n·(p − q), so a scan may
slide along a wall at no cost. Linearised about the source's centroid c, a small motion
x = (Δx, Δy, Δψ) changes e by

    n·Δt + Δψ n·(p − c)⊥ ,      (u, v)⊥ = (−v, u)                               (5.1)

which leaves a 3×3 system A x = −g. Where the surface fixes only part of the motion (a
corridor, a single wall), only that part of x is solved for; the rest stays at rest.

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
from labkit.se2 import compose, transform

# A direction of motion is free when the residuals answer it, on average, by less than
# this share of what they answer straight motion into a wall: √0.02 is a mean angle of 8°
# between the surface and the direction, about the noise of a normal.
MIN_INFORMATION = 0.02


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
    center, length, jacobian = _linearise(points, normals, w)
    values, vectors = np.linalg.eigh((jacobian * w[:, None]).T @ jacobian / w.sum())
    return Information(center=center, length=length, values=values, vectors=vectors)


def align_to_lines(
    source: FloatArray, target: FloatArray, normals: FloatArray, weights: FloatArray
) -> FloatArray:
    """One Gauss-Newton step of the point-to-line metric.

    Parameters
    ----------
    source, target, normals : ndarray, shape (N, 2)
        Matched points [m] and the unit normals of the target's surface.
    weights : ndarray, shape (N,)
        Weight of each pair, ≥ 0.

    Returns
    -------
    ndarray, shape (3, 3)
        The step ``T_target_source``, identity in every free direction.

    Raises
    ------
    DegenerateAlignmentError
        Where every direction is free.
    """
    information = line_information(source, normals, weights)
    constrained = information.values >= MIN_INFORMATION
    _, _, jacobian = _linearise(source, normals, weights)
    residual = (normals * (source - target)).sum(axis=1)
    gradient = jacobian.T @ (weights * residual) / weights.sum()
    basis = information.vectors[:, constrained]
    x = -basis @ ((basis.T @ gradient) / information.values[constrained])
    c = information.center
    turn = transform(c[0] + x[0], c[1] + x[1], x[2] / information.length)
    return compose(turn, transform(-c[0], -c[1], 0.0))


def _linearise(
    points: FloatArray, normals: FloatArray, weights: FloatArray
) -> tuple[FloatArray, float, FloatArray]:
    """Centre c, length ℓ and the rows of (5.1) in the coordinates (Δx, Δy, ℓ Δψ)."""
    total = weights.sum() if len(points) else 0.0
    if total <= 0.0:
        raise DegenerateAlignmentError(f"none of {len(points)} pairs has weight on a surface")
    center = weights @ points / total
    arm = points - center
    length = math.sqrt(float(weights @ (arm * arm).sum(axis=1)) / total)
    if length <= 64.0 * np.finfo(float).eps * np.abs(points).max():  # what the mean rounds by
        raise DegenerateAlignmentError(f"all {len(points)} surface points coincide")
    turning = (normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]) / length
    return center, length, np.column_stack([normals, turning])
