"""A submission in (3, 3) matrices: the SVD for every alignment, general inverses, no shortcut."""

import numpy as np


def rotation(theta):
    return np.cos(theta) * np.eye(2) + np.sin(theta) * np.array([[0, -1], [1, 0]])


def compose(T_a_b, T_b_c):
    T_a_c = np.eye(3)
    T_a_c[:2, :2] = T_a_b[:2, :2] @ T_b_c[:2, :2]
    T_a_c[:2, 2] = T_a_b[:2, :2] @ T_b_c[:2, 2] + T_a_b[:2, 2]
    return T_a_c


def invert(T_a_b):
    return np.linalg.inv(T_a_b)


def wrap(angle):
    return np.angle(np.exp(1j * angle))


def best_translation(R, source, target):
    return (target.T - R @ source.T).mean(axis=1, keepdims=True)


def align(source, target):
    return align_weighted(source, target, np.ones(len(source)))


def align_svd(source, target):
    return align_weighted(source, target, np.ones(len(source)))


def align_weighted(source, target, weights):
    p_mean = np.average(source, axis=0, weights=weights)
    q_mean = np.average(target, axis=0, weights=weights)
    H = (source - p_mean).T @ np.diag(weights) @ (target - q_mean)
    U, _, Vt = np.linalg.svd(H)
    if np.linalg.det(Vt.T @ U.T) < 0:
        Vt[1] *= -1
    T = np.eye(3)
    T[:2, :2] = Vt.T @ U.T
    T[:2, 2] = q_mean - T[:2, :2] @ p_mean
    return T


def nearest_neighbors(source, target):
    squares = (
        (source**2).sum(axis=1)[:, None] - 2 * source @ target.T + (target**2).sum(axis=1)[None, :]
    )
    indices = np.argmin(squares, axis=1)
    return indices, np.linalg.norm(source - target[indices], axis=1)


def distance_gate(distances, max_distance):
    return np.where(np.asarray(distances) > max_distance, 0, 1)


def overlap(distances, overlap_ratio):
    count = max(3, int(np.floor(overlap_ratio * len(distances))))
    return np.asarray(distances) <= np.sort(distances)[count - 1]


def huber_weights(residuals, delta):
    r = np.array(residuals, dtype=float)
    weights = np.ones_like(r)
    weights[r > delta] = delta / r[r > delta]
    return weights


def inlier_rmse(distances, kept):
    d = np.asarray(distances)[np.asarray(kept)]
    return float(np.linalg.norm(d) / np.sqrt(d.size)) if d.size else float("nan")


def fitness(kept):
    return np.count_nonzero(kept) / np.size(kept)


def icp_step(source, target, T, max_distance, overlap_ratio, delta):
    homogeneous = np.column_stack([source, np.ones(len(source))])
    moved = (T @ homogeneous.T).T[:, :2]
    indices, d = nearest_neighbors(moved, target)
    near = np.flatnonzero(distance_gate(d, max_distance))
    near = near[overlap(d[near], overlap_ratio)]
    return align_weighted(moved[near], target[indices[near]], huber_weights(d[near], delta)) @ T


def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T, T_before = T_init, np.full((3, 3), np.inf)
    while max_iterations and not np.allclose(T, T_before, rtol=0, atol=1e-8):
        T, T_before = icp_step(source, target, T, max_distance, overlap_ratio, delta), T
        max_iterations -= 1
    return {"R": T[:2, :2], "t": T[:2, 2]}


def has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):
    reasons = [
        np.linalg.norm(dT[:2, 2]) < eps_t
        and np.abs(np.arcsin(dT[1, 0])) < eps_psi
        and dT[0, 0] > 0,
        np.abs(cost_change) < eps_cost,
        iteration + 1 > k_max,
    ]
    return np.any(reasons)


def integrate(increments, start):
    def pose(x, y, psi):
        return np.array([[np.cos(psi), -np.sin(psi), x], [np.sin(psi), np.cos(psi), y], [0, 0, 1]])

    T = [pose(*start)]
    for increment in increments:
        T.append(T[-1] @ pose(*increment))
    return np.array([[M[0, 2], M[1, 2], np.arctan2(M[1, 0], M[0, 0])] for M in T])


def is_plausible(increment, inlier_ratio, rmse, max_shift, max_turn, min_ratio, max_rmse):
    checks = {
        "translation": np.linalg.norm(increment[:2]) <= max_shift,
        "rotation": -max_turn <= increment[2] <= max_turn,
        "inliers": inlier_ratio >= min_ratio,
        "rmse": rmse <= max_rmse,
    }
    return all(checks.values())
