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

from labkit.arrays import EPSILON, FloatArray, as_pairs
from labkit.errors import DegenerateAlignmentError
from labkit.se2 import rotation, transform

# A sum of n products carries a rounding error of about n·ε; a hundred thousand pairs
# stay well below this, and a real scan's spread stays well above it.
RELATIVE_RESOLUTION = 1e-10


def align(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """The rigid transform that best maps `source` onto `target`, in closed form.

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
    p, q, w = _weighted(source, target, weights)
    p_mean, q_mean, x, y, scale = _center(p, q, w)
    a = float(w @ (x * y).sum(axis=1))  # (2.5)  Σ w (x·y)
    b = float(w @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]))  # (2.6)  Σ w (x × y)
    _require_rotation(math.hypot(a, b), scale, len(w))
    theta = math.atan2(b, a)  # (2.7)
    t = q_mean - rotation(theta) @ p_mean  # (2.3)
    return transform(t[0], t[1], theta)


def align_svd(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """The same transform by the SVD of the cross-covariance (Kabsch, Umeyama).

    Takes, returns and raises what `align` does. H = Σ w x yᵀ = U Σ Vᵀ gives
    R = V diag(1, det(V Uᵀ)) Uᵀ; without the determinant a mirrored scene would yield a
    reflection, which no robot can drive.
    """
    p, q, w = _weighted(source, target, weights)
    p_mean, q_mean, x, y, scale = _center(p, q, w)
    H = (w[:, None] * x).T @ y  # (2.4)
    U, singular_values, Vt = np.linalg.svd(H)
    sign = np.sign(np.linalg.det(Vt.T @ U.T))
    _require_rotation(float(singular_values[0] + sign * singular_values[1]), scale, len(w))
    R = Vt.T @ np.diag([1.0, sign]) @ U.T  # (2.8)
    T = np.eye(3)
    T[:2, :2] = R
    T[:2, 2] = q_mean - R @ p_mean  # (2.3)
    return T


def _weighted(
    source: ArrayLike, target: ArrayLike, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The pairs that have a weight: those of weight 0 say nothing, wherever they lie."""
    p, q, w = as_pairs(source, target, weights)
    counted = w > 0.0
    if not counted.any():
        raise DegenerateAlignmentError(
            f"all {len(w)} weights are zero, so no pair says anything; "
            f"relax the gate or the weights"
        )
    return p[counted], q[counted], w[counted]


def _center(
    p: FloatArray, q: FloatArray, w: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Weighted centroids, the pairs seen from them (2.2), and their scale [m²].

    That is the weight times the root mean square distance from the centroid, of both.
    Raise where all points coincide.
    """
    total = w.sum()
    p_mean, q_mean = w @ p / total, w @ q / total
    x, y, scale = p - p_mean, q - q_mean, float(total)
    for name, points, centered in (("source", p, x), ("target", q, y)):
        spread = math.sqrt(float(w @ (centered * centered).sum(axis=1) / total))
        rounding = 64.0 * EPSILON * np.abs(points).max()
        if spread <= max(rounding, RELATIVE_RESOLUTION * np.abs(centered).max()):
            raise DegenerateAlignmentError(
                f"the weighted {name} points coincide (spread {spread:.3g} m over {len(w)} "
                f"pairs), so the rotation is undetermined; at least 2 distinct pairs with "
                f"weight are needed"
            )
        scale *= spread
    return p_mean, q_mean, x, y, scale


def _require_rotation(strength: float, scale: float, count: int) -> None:
    """Raise unless the pairs fix the angle.

    `strength` is √(a² + b²) = σ₁ ± σ₂, the height of the cosine that the angle maximises:
    zero means that every angle is as good. It is compared with the data's own scale.
    """
    if strength <= RELATIVE_RESOLUTION * scale:
        raise DegenerateAlignmentError(
            f"every rotation fits these {count} pairs equally well (a = b = 0 within "
            f"{RELATIVE_RESOLUTION:g} of their scale {scale:.3g} m²); "
            f"is the target a mirror image of the source?"
        )
