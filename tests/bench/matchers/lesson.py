"""The lesson's algorithm as section 6 prints it, at its own pace.

Robust point-to-point ICP as a first listing is written: the search tree is built anew for
every query, and every iteration asks a second time for all nearest neighbours, only to
report the RMSE that convergence is judged by.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from labkit import Scan
from labkit.support.arrays import FloatArray

MAX_ITERATIONS = 60
RMSE_TOLERANCE = 1e-7  # m
KEPT_FRACTION = 0.85
HUBER_DELTA = 0.20  # m
MIN_PAIRS = 3
MOST_POINTS = 2_000  # 20,000 take more than a second


def can_match(scan: Scan) -> bool:
    """Whether a pair is quick enough to be tried often."""
    return len(scan) <= MOST_POINTS


def lesson(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Gate, trim, weight and align until the RMSE stands still."""
    R, t = T_init[:2, :2].copy(), T_init[:2, 2].copy()
    iterations, last_rmse = 0, np.inf
    while iterations < MAX_ITERATIONS:
        iterations += 1
        moved = source @ R.T + t
        closest, squared = _nearest(moved, target)
        distance = np.sqrt(squared + 1e-12)
        kept = np.zeros(len(source), dtype=bool)
        kept[np.argsort(distance)[: max(MIN_PAIRS, int(KEPT_FRACTION * len(source)))]] = True
        kept &= distance <= gate
        if kept.sum() < MIN_PAIRS:
            raise RuntimeError(f"too few correspondences, got {kept.sum()}")
        dR, dt = _align(moved[kept], closest[kept])
        R, t = dR @ R, dR @ t + dt
        rmse = np.sqrt(_nearest(source @ R.T + t, target)[1].mean())
        if abs(last_rmse - rmse) < RMSE_TOLERANCE:
            break
        last_rmse = rmse
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = R, t
    return T, iterations


def _nearest(points: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The target point nearest to each point, and its squared distance."""
    distance, index = cKDTree(target).query(points)
    return target[index], distance**2


def _align(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation and translation that best take p to q under Huber's weights, by SVD."""
    distance = np.linalg.norm(p - q, axis=1)
    w = np.where(distance > HUBER_DELTA, HUBER_DELTA / (distance + 1e-12), 1.0)[:, None]
    p_mean, q_mean = (w * p).sum(axis=0) / w.sum(), (w * q).sum(axis=0) / w.sum()
    U, _, Vt = np.linalg.svd((w * (p - p_mean)).T @ (q - q_mean))
    if np.linalg.det(Vt.T @ U.T) < 0.0:
        Vt[1] *= -1.0
    R = Vt.T @ U.T
    return R, q_mean - R @ p_mean


MATCHERS = {"the lesson's listing": lesson}
