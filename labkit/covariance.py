"""How far to trust a match: Censi's closed-form covariance (section 5).

The estimate x = (Δx, Δy, Δψ) minimises a cost J(x, z) of the measured ranges z. Where the
gradient ∂J/∂x vanishes, the implicit function theorem tells how x follows z, so

    cov(x) ≈ A⁻¹ B cov(z) Bᵀ A⁻¹ ,   A = ∂²J/∂x² ,   B = ∂²J/∂z ∂x               (6.4)

J is the point-to-line cost Σ wᵢ rᵢ², rᵢ = nᵢ·(R pᵢ + t − qᵢ), with the correspondences,
normals and weights of the last association held fixed.

References
----------
.. [1] Censi, "An accurate closed-form estimate of ICP's covariance", ICRA 2007.
"""

from __future__ import annotations

import numpy as np

from labkit.arrays import FloatArray, check_range
from labkit.errors import DegenerateAlignmentError
from labkit.result import IcpResult
from labkit.se2 import apply


def censi_covariance(result: IcpResult, range_std: float) -> FloatArray:
    """Covariance of an estimated motion, from the noise of the ranges.

    Parameters
    ----------
    result : IcpResult
        What `labkit.icp` returned.
    range_std : float
        Standard deviation of one range of either scan [m].

    Returns
    -------
    ndarray, shape (3, 3)
        Covariance of (Δx, Δy, Δψ), in m², m rad and rad². Along a free direction it is
        very large: the ranges say nothing there.

    Raises
    ------
    DegenerateAlignmentError
        Where the match failed, or a direction is free without any doubt (A is singular).

    Notes
    -----
    The point-to-point metric lets points stick to their nearest neighbours, so its own
    spread may exceed this covariance where the scans are sparse.
    """
    check_range(range_std, "range_std", above=0.0, unit="m")
    if result.termination.failed:
        raise DegenerateAlignmentError(f"no covariance without an estimate: {result.message}")
    target, pairs = result.target, result.correspondences
    used = pairs.kept & np.isfinite(target.normals[pairs.target_index, 0])
    index, w = pairs.target_index[used], pairs.weights[used]
    p = result.source.points[:: pairs.every][used]
    q, n = target.points[index], target.normals[index]

    T = result.T_target_source
    moved, turned = apply(T, p), p @ T[:2, :2].T
    r = _dot(n, moved - q)
    slope = np.column_stack([n, _dot(n, _perpendicular(turned))])  # ∂r/∂x
    A = 2.0 * (slope * w[:, None]).T @ slope
    A[2, 2] -= 2.0 * np.sum(w * r * _dot(n, turned))  # ∂²r/∂ψ² = −n·R p

    ray = turned / _ranges(p)  # p = ρ u: how p moves with its range
    B_source = slope * _dot(n, ray)[:, None]
    B_source[:, 2] += r * _dot(n, _perpendicular(ray))
    B_pairs = -slope * _dot(n, q / _ranges(q))[:, None]
    B_target = np.zeros((len(target.points), 3))
    np.add.at(B_target, index, w[:, None] * B_pairs)  # one range may serve many pairs
    B = 2.0 * np.vstack([w[:, None] * B_source, B_target])
    try:
        gain = np.linalg.solve(A, B.T)
    except np.linalg.LinAlgError:
        raise DegenerateAlignmentError(
            f"{used.sum()} pairs on surfaces leave a direction of the motion free, "
            f"so its variance is unbounded"
        ) from None
    covariance: FloatArray = range_std**2 * gain @ gain.T
    return covariance


def _ranges(points: FloatArray) -> FloatArray:
    """Distance of each point from its scanner, shape (N, 1), never 0: no beam ends there."""
    return np.maximum(np.hypot(points[:, :1], points[:, 1:]), np.finfo(float).tiny)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row by row a·b."""
    product: FloatArray = (a * b).sum(axis=1)
    return product


def _perpendicular(v: FloatArray) -> FloatArray:
    """Each row (x, y) turned by a right angle to the left: (−y, x)."""
    return np.column_stack([-v[:, 1], v[:, 0]])
