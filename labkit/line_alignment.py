"""Alignment to the lines through the target points: the point-to-line metric.

A pair's residual is its distance from the target's surface, e = n·(p − q), so a scan may
slide along a wall at no cost. Linearised about the source's centroid c, a small motion
x = (Δx, Δy, Δψ) changes e by

    n·Δt + Δψ n·(p − c)⊥ ,      (u, v)⊥ = (−v, u)                               (6.1)

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
from typing import NamedTuple

import numpy as np

from labkit.arrays import EPSILON, FloatArray, homogeneous
from labkit.correspondences import FROM_LINE, MOVED, NORMAL, OFFSET, TURNING
from labkit.errors import DegenerateAlignmentError

# A direction of motion is free when the residuals answer it, on average, by less than
# this share of what they answer straight motion into a wall: √0.02 is a mean angle of 8°
# between the surface and the direction, about the noise of a normal.
MIN_INFORMATION = 0.02
# A quarter of it will do where so much of point-to-point steadies the step.
STEADY_SHARE, STEADY_INFORMATION = 0.03, 0.25 * MIN_INFORMATION
# With next to nothing but point-to-point all eigenvalues are 1, and so is what they must reach.
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
    center = _center(points, w)
    moved = homogeneous(points - center.T)
    rows = line_rows(moved, np.concatenate((moved[:2], normals.T)))
    return information_of_rows(rows, w, center)


def information_of_rows(rows: FloatArray, weights: FloatArray, center: FloatArray) -> Information:
    """`line_information` of pairs as the ICP loop has them, see `Correspondences`."""
    equations = normal_equations(rows, weights, center)
    values, vectors = np.linalg.eigh(np.array(equations.A) / equations.weight)
    middle = np.array(equations.center)
    return Information(center=middle, length=equations.length, values=values, vectors=vectors)


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
    center = _center(source, weights)
    nearest = np.concatenate((target.T - center, normals.T))
    rows = line_rows(homogeneous(source - center.T), nearest)
    return line_step(normal_equations(rows, weights, center, point_share))


def _center(points: FloatArray, weights: FloatArray) -> FloatArray:
    """The mean (x, y) of points (N, 2) that have weight, shape (2, 1)."""
    if not weights.any():
        return np.zeros((2, 1))
    center: FloatArray = points[weights > 0.0].mean(axis=0)[:, None]
    return center


class NormalEquations(NamedTuple):
    """A x = −g of the motion x = (Δx, Δy, ℓΔψ) about the centre c, summed over all weight."""

    A: list[list[float]]
    g: list[float]
    weight: float
    center: tuple[float, float]
    length: float
    point_share: float


def line_step(equations: NormalEquations) -> FloatArray:
    """The step ``T_target_source`` that solves them, in the constrained directions alone."""
    A, g, total, (cx, cy), length, point_share = equations
    minimum = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    minimum = total * ((1.0 - point_share) * minimum + point_share) * BUT_FOR_ROUNDING
    dx, dy, turn = _solve_constrained(A, g, minimum)
    c, s = math.cos(turn / length), math.sin(turn / length)
    return np.array(  # turn about the pairs' centre, then shift
        [[c, -s, cx + dx - c * cx + s * cy], [s, c, cy + dy - s * cx - c * cy], [0.0, 0.0, 1.0]]
    )


def line_rows(moved: FloatArray, nearest: FloatArray) -> FloatArray:
    """The rows of `Correspondences`, from p as (x, y, 1) and the partner's (x, y, nx, ny)."""
    rows = np.empty((FROM_LINE + 1, moved.shape[1]))
    rows[MOVED] = moved
    offset = np.subtract(moved[:2], nearest[:2], out=rows[OFFSET])
    rows[NORMAL] = normal = nearest[2:]
    across, along = normal[::-1] * moved[:2], normal * offset
    np.subtract(across[0], across[1], out=rows[TURNING])
    np.add(along[0], along[1], out=rows[FROM_LINE])
    return rows


def normal_equations(
    rows: FloatArray, weights: FloatArray, center: FloatArray, point_share: float = 0.0
) -> NormalEquations:
    """The equations of a step, from pairs as the ICP loop has them, see `Correspondences`.

    All sums come from one product of the rows with their transpose: on 360 pairs that takes
    half as long as summing them one after the other. They are taken about `center`, and
    A = [[a, b, c], [b, d, e], [c, e, f]] and g = [u, v, w] then moved to the pairs' own
    centre (x, y) in plain numbers, for which arrays of three are too slow.
    """
    M = ((rows * weights) @ rows.T).tolist()
    (xx, _, sum_x, _, x_to_y, *_), (_, yy, sum_y, y_to_x, *_), (_, _, total, to_x, to_y, *_) = M[:3]
    (a, b, c, u), (d, e, v), (f, w) = M[5][5:], M[6][6:], M[7][7:]
    if total <= 0.0:
        raise DegenerateAlignmentError(f"none of {len(weights)} pairs has weight on a surface")
    x, y, square = sum_x / total, sum_y / total, (xx + yy) / total
    (cx,), (cy,) = center.tolist()
    spread, reach = square - x * x - y * y, max(abs(x + cx), abs(y + cy))
    if not spread > 64.0 * EPSILON * max(square, 64.0 * EPSILON * reach * reach):  # of rounding
        raise DegenerateAlignmentError(f"all {len(weights)} surface points coincide")
    length = math.sqrt(spread)
    f = (f - 2.0 * (x * e - y * c) + x * x * d - 2.0 * x * y * b + y * y * a) / spread
    c, e = (c - x * b + y * a) / length, (e - x * d + y * b) / length
    w = (w - x * v + y * u) / length
    if point_share > 0.0:
        t, rest = point_share, 1.0 - point_share
        pull = (x_to_y - y_to_x - x * to_y + y * to_x) / length
        full = t * total
        a, b, c = rest * a + full, rest * b, rest * c
        d, e, f = rest * d + full, rest * e, rest * f + full
        u, v, w = rest * u + t * to_x, rest * v + t * to_y, rest * w + t * pull
    A, g = [[a, b, c], [b, d, e], [c, e, f]], [u, v, w]
    return NormalEquations(A, g, total, (x + cx, y + cy), length, point_share)


def _solve_constrained(A: list[list[float]], g: list[float], minimum: float) -> list[float]:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    (a, b, c), (_, d, e), (_, _, f) = A
    h, m, n = a - minimum, d - minimum, f - minimum
    minor = h * m - b * b
    if h > 0.0 and minor > 0.0 and n * minor > h * e * e - 2.0 * b * c * e + m * c * c:
        # A − minimum·I is positive definite (Sylvester), so that no eigenvalue is smaller. Not
        # to compute them saves a tenth of a match in corridors.
        u, v, w = d * f - e * e, c * e - b * f, b * e - c * d  # first row of the adjugate
        p, q, r = a * f - c * c, b * c - a * e, a * d - b * b
        determinant = a * u + b * v + c * w
        x, y, t = (-each / determinant for each in g)
        return [u * x + v * y + w * t, v * x + p * y + q * t, w * x + q * y + r * t]
    values, vectors = np.linalg.eigh(A)
    constrained = values >= minimum
    values, vectors = values[constrained], vectors[:, constrained]
    solution: list[float] = (-vectors @ ((np.array(g) @ vectors) / values)).tolist()
    return solution
