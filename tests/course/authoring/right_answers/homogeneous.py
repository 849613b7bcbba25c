"""The solution in (3, 3) matrices: the SVD for every alignment, and answers in other forms."""

import numpy as np


def rotation(theta):
    return np.cos(theta) * np.eye(2) + np.sin(theta) * np.array([[0, -1], [1, 0]])


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


def integrate(increments, start):
    def pose(x, y, psi):
        return np.array([[np.cos(psi), -np.sin(psi), x], [np.sin(psi), np.cos(psi), y], [0, 0, 1]])

    T = [pose(*start)]
    for increment in increments:
        T.append(T[-1] @ pose(*increment))
    return np.array([[M[0, 2], M[1, 2], np.arctan2(M[1, 0], M[0, 0])] for M in T])
