"""Other numerics: the SVD for every alignment, expanded squares, angles by complex numbers."""

import numpy as np


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


def huber_weights(residuals, delta):
    r = np.array(residuals, dtype=float)
    weights = np.ones_like(r)
    weights[r > delta] = delta / r[r > delta]
    return weights
