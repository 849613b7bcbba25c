"""A submission in numpy: the angle by atan2, (R, t) returned, ρ of all source points."""

import numpy as np


def rotation(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


def compose(T_a_b, T_b_c):
    return T_a_b @ T_b_c


def invert(T_a_b):
    R, t = T_a_b[:2, :2], T_a_b[:2, 2]
    T_b_a = np.eye(3)
    T_b_a[:2, :2] = R.T
    T_b_a[:2, 2] = -R.T @ t
    return T_b_a


def wrap(angle):
    return np.pi - (np.pi - angle) % (2 * np.pi)


def best_translation(R, source, target):
    return target.mean(axis=0) - R @ source.mean(axis=0)


def align(source, target):
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    x, y = source - p_mean, target - q_mean
    b = (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()
    R = rotation(np.arctan2(b, (x * y).sum()))
    return R, q_mean - R @ p_mean


def align_weighted(source, target, weights):
    p_mean = weights @ source / weights.sum()
    q_mean = weights @ target / weights.sum()
    x, y = source - p_mean, target - q_mean
    a = weights @ (x * y).sum(axis=1)
    b = weights @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


def align_svd(source, target):
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    H = (source - p_mean).T @ (target - q_mean)
    U, _, Vt = np.linalg.svd(H)
    R = Vt.T @ np.diag([1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T
    return R, q_mean - R @ p_mean


def nearest_neighbors(source, target):
    offsets = source[:, None, :] - target[None, :, :]
    distances = np.sqrt((offsets**2).sum(axis=2))
    indices = distances.argmin(axis=1)
    return indices, distances[np.arange(len(source)), indices]


def distance_gate(distances, max_distance):
    return distances <= max_distance


def overlap(distances, overlap_ratio):
    count = max(3, int(overlap_ratio * len(distances)))
    kept = np.zeros(len(distances), dtype=bool)
    kept[np.argsort(distances)[:count]] = True
    return kept


def huber_weights(residuals, delta):
    return delta / np.maximum(residuals, delta)


def inlier_rmse(distances, kept):
    if not kept.any():
        return np.nan
    return np.sqrt(np.mean(distances[kept] ** 2))


def fitness(kept):
    return kept.mean()


def has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):
    small_shift = np.hypot(dT[0, 2], dT[1, 2]) < eps_t
    small_turn = abs(np.arctan2(dT[1, 0], dT[0, 0])) < eps_psi
    return (small_shift and small_turn) or abs(cost_change) < eps_cost or iteration >= k_max


def icp_step(source, target, T, max_distance, overlap_ratio, delta):
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = nearest_neighbors(moved, target)
    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)
    R, t = align_weighted(moved[kept], target[indices[kept]], huber_weights(d[kept], delta))
    dT = np.eye(3)
    dT[:2, :2], dT[:2, 2] = R, t
    return dT @ T


def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T = T_init
    for _ in range(max_iterations):
        T_before, T = T, icp_step(source, target, T, max_distance, overlap_ratio, delta)
        dT = T @ invert(T_before)
        if np.hypot(*dT[:2, 2]) < 1e-7 and abs(np.arctan2(dT[1, 0], dT[0, 0])) < 1e-7:
            break
    return T


def integrate(increments, start):
    poses = [np.array(start, dtype=float)]
    for increment in increments:
        x, y, psi = poses[-1]
        dx, dy = rotation(psi) @ increment[:2]
        poses.append(np.array([x + dx, y + dy, wrap(psi + increment[2])]))
    return np.array(poses)


def is_plausible(increment, inlier_ratio, rmse, max_shift, max_turn, min_ratio, max_rmse):
    return (
        np.hypot(increment[0], increment[1]) <= max_shift
        and abs(increment[2]) <= max_turn
        and inlier_ratio >= min_ratio
        and rmse <= max_rmse
    )
