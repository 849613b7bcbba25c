"""Alignment for fixed correspondences (section 3 of the lesson).

Given pairs (pᵢ, qᵢ) with weights wᵢ ≥ 0, both functions minimise, over R ∈ SO(2) and t,

    J(R, t) = Σ wᵢ ‖R pᵢ + t − qᵢ‖²                                             (2.1)

The lab uses `align`, which needs one `atan2`. `align_svd` follows the derivation for any
dimension; the tests compare `align` with it.

References
----------
.. [1] Arun, Huang, Blostein, "Least-squares fitting of two 3-D point sets",
       IEEE PAMI 9(5), 1987.
.. [2] Umeyama, "Least-squares estimation of transformation parameters between two
       point patterns", IEEE PAMI 13(4), 1991 (the determinant correction).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.support.arrays import EPSILON, FloatArray, as_pairs
from labkit.support.compiled import compiled
from labkit.support.errors import DegenerateAlignmentError

# A sum of n products carries a rounding error of about n·ε; a hundred thousand pairs
# stay well below this, and a real scan's spread stays well above it.
RELATIVE_RESOLUTION = 1e-10


def align(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Find the rigid transform that best maps `source` onto `target`, in closed form.

    Parameters
    ----------
    source, target : array_like, shape (N, 2)
        Matched points in metres: row i of one belongs to row i of the other.
    weights : array_like, shape (N,), optional
        Weight of each pair, ≥ 0; all equal by default. Only their ratios matter.

    Returns
    -------
    ndarray, shape (3, 3)
        ``T_target_source``, the unique minimiser of (2.1).

    Raises
    ------
    DegenerateAlignmentError
        If more than one rotation fits equally well.
    InvalidPointsError
        For a wrong shape, NaN, unequal lengths or a negative weight.

    Examples
    --------
    >>> T = align([[0, 0], [1, 0]], [[2, 3], [2, 4]])
    >>> np.round(T, 12).tolist()
    [[0.0, -1.0, 2.0], [1.0, 0.0, 3.0], [0.0, 0.0, 1.0]]
    """
    p, q, w = as_pairs(source, target, weights)
    return _refuse_undetermined(closed_form(p, q, w), p, q, w)


def align_svd(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """The same transform by the SVD of the cross-covariance (Kabsch, Umeyama).

    Takes, returns and raises what `align` does. H = Σ w x yᵀ = U Σ Vᵀ gives
    R = V diag(1, det(V Uᵀ)) Uᵀ; without the determinant a mirrored scene would yield a
    reflection, which no robot can drive.
    """
    p, q, w = as_pairs(source, target, weights)
    _refuse_undetermined(closed_form(p, q, w), p, q, w)
    p, q, w = p[w > 0.0], q[w > 0.0], w[w > 0.0]
    p_mean, q_mean = w @ p / w.sum(), w @ q / w.sum()  # (2.2)
    H = (w[:, None] * (p - p_mean)).T @ (q - q_mean)  # (2.4)
    U, _, Vt = np.linalg.svd(H)
    R = Vt.T @ np.diag([1.0, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T  # (2.8)
    T = np.eye(3)
    T[:2, :2] = R
    T[:2, 2] = q_mean - R @ p_mean  # (2.3)
    return T


@compiled
def closed_form(p: FloatArray, q: FloatArray, w: FloatArray) -> FloatArray:
    """Align pairs p, q (N, 2) [m] of weight w (N,): T, (3, 3); NaN where others fit as well.

    Pairs of weight 0 say nothing, wherever they lie.
    """
    p_mean = centroid(p, w)  # (2.2)
    q_mean = centroid(q, w)
    a = 0.0
    b = 0.0
    for i in range(len(p)):
        if w[i] > 0.0:
            x, y = p[i, 0] - p_mean[0], p[i, 1] - p_mean[1]
            u, v = q[i, 0] - q_mean[0], q[i, 1] - q_mean[1]
            a += w[i] * (x * u + y * v)  # (2.5)
            b += w[i] * (x * v - y * u)  # (2.6)
    p_spread = spread(p, w, p_mean)
    q_spread = spread(q, w, q_mean)
    height = math.hypot(a, b)  # of the cosine that θ maximises; 0 if every rotation fits
    is_high = height > RELATIVE_RESOLUTION * w.sum() * p_spread * q_spread
    is_determined = p_spread > 0.0 and q_spread > 0.0 and is_high
    theta = math.atan2(b, a) if is_determined else math.nan  # (2.7)
    return turn_about(p_mean, theta, q_mean[0] - p_mean[0], q_mean[1] - p_mean[1])  # (2.3)


@compiled
def spread(points: FloatArray, weights: FloatArray, mean: tuple[float, float]) -> float:
    """Root mean square distance [m] of points (N, 2) from their mean; 0 where it is rounding."""
    squares = 0.0
    total = 0.0
    longest = 0.0  # offset from the mean [m]
    largest = 0.0  # coordinate [m]
    for i in range(len(points)):
        if weights[i] > 0.0:
            x, y = points[i, 0] - mean[0], points[i, 1] - mean[1]
            squares += weights[i] * (x * x + y * y)
            total += weights[i]
            longest = max(longest, abs(x), abs(y))
            largest = max(largest, abs(points[i, 0]), abs(points[i, 1]))
    if total > 0.0:
        result = math.sqrt(squares / total)
        if result > max(64.0 * EPSILON * largest, RELATIVE_RESOLUTION * longest):
            return result
    return 0.0


@compiled
def centroid(points: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """Weighted mean of points (N, 2) [m]; (0, 0) where no point has weight."""
    x, y, total = 0.0, 0.0, 0.0
    for i in range(len(points)):
        x += weights[i] * points[i, 0]
        y += weights[i] * points[i, 1]
        total += weights[i]
    return (x / total, y / total) if total > 0.0 else (0.0, 0.0)


@compiled
def turn_about(center: tuple[float, float], theta: float, dx: float, dy: float) -> FloatArray:
    """The motion (3, 3) that turns by θ [rad] about `center` and then moves by (dx, dy) [m]."""
    c, s, (x, y) = math.cos(theta), math.sin(theta), center
    return np.array(
        [[c, -s, x + dx - (c * x - s * y)], [s, c, y + dy - (s * x + c * y)], [0.0, 0.0, 1.0]]
    )


@compiled
def product(A: FloatArray, B: FloatArray) -> FloatArray:
    """Product A B of two (3, 3) matrices; numba's ``@`` would load `scipy.linalg` for it."""
    C = np.zeros((3, 3))
    for row in range(3):
        for column in range(3):
            for k in range(3):
                C[row, column] += A[row, k] * B[k, column]
    return C


def _refuse_undetermined(T: FloatArray, p: FloatArray, q: FloatArray, w: FloatArray) -> FloatArray:
    """Return T, or raise an error that says why the pairs leave it open: T is NaN there."""
    if not math.isnan(T[0, 0]):
        return T
    reason = f"every rotation fits these {len(w)} pairs equally well; is the target a mirror image?"
    for name, points in {"source": p[w > 0.0], "target": q[w > 0.0]}.items():
        if len(points) == 0:
            reason = f"all {len(w)} weights are zero; relax the gate or the weights"
        elif np.ptp(points, axis=0).max() <= RELATIVE_RESOLUTION * np.abs(points).max():
            reason = f"the weighted {name} points of {len(w)} pairs coincide; two must lie apart"
    raise DegenerateAlignmentError(reason)
