"""A submission in single precision, as a small processor would run it; points as complex numbers.

A turn is a product with e^{iθ}, so the best rotation is the phase of Σ w conj(x) y.
"""

import numpy as np

F = np.float32


def rotation(theta):
    c, s = np.cos(F(theta)), np.sin(F(theta))
    return np.array([[c, -s], [s, c]], dtype=F)


def compose(T_a_b, T_b_c):
    return np.asarray(T_a_b, dtype=F) @ np.asarray(T_b_c, dtype=F)


def invert(T_a_b):
    T = np.asarray(T_a_b, dtype=F)
    R, t = T[:2, :2], T[:2, 2:]
    return np.block([[R.T, -R.T @ t], [np.zeros((1, 2), F), np.ones((1, 1), F)]])


def to_complex(points):
    points = np.asarray(points, dtype=F)
    return points[:, 0] + F(1) * 1j * points[:, 1]


def wrap(angle):
    return np.arctan2(np.sin(F(angle)), np.cos(F(angle)))


def best_translation(R, source, target):
    e = complex(R[0][0], R[1][0])
    t = to_complex(target).mean() - e * to_complex(source).mean()
    return np.array([t.real, t.imag], dtype=F)


def align(source, target):
    return align_weighted(source, target, np.ones(len(source), F))


def align_svd(source, target):
    return align(source, target)


def align_weighted(source, target, weights):
    w = np.asarray(weights, dtype=F)
    p, q = to_complex(source), to_complex(target)
    p_mean, q_mean = np.sum(w * p) / w.sum(), np.sum(w * q) / w.sum()
    phase = np.sum(w * np.conj(p - p_mean) * (q - q_mean))
    e = phase / np.abs(phase)
    t = q_mean - e * p_mean
    R = np.array([[e.real, -e.imag], [e.imag, e.real]], dtype=F)
    return R, np.array([[t.real], [t.imag]], dtype=F)


def nearest_neighbors(source, target):
    distances = np.abs(to_complex(source)[:, None] - to_complex(target))
    return distances.argmin(axis=1).astype(np.int32), distances.min(axis=1)


def distance_gate(distances, max_distance):
    return np.asarray(distances, dtype=F) <= F(max_distance)


def overlap(distances, overlap_ratio):
    d = np.asarray(distances, dtype=F)
    ranks = np.argsort(np.argsort(d, kind="stable"), kind="stable")
    return ranks < max(3, int(overlap_ratio * d.size))


def huber_weights(residuals, delta):
    r = np.asarray(residuals, dtype=F)
    return np.minimum(F(1), F(delta) / np.where(r > 0, r, F(delta)))


def inlier_rmse(distances, kept):
    d = np.asarray(distances, dtype=F)[np.asarray(kept, dtype=bool)]
    return np.sqrt((d * d).mean()) if len(d) else F("nan")


def fitness(kept):
    return np.mean(kept, dtype=F)


def icp_step(source, target, T, max_distance, overlap_ratio, delta):
    T = np.asarray(T, dtype=F)
    moved = np.asarray(source, dtype=F) @ T[:2, :2].T + T[:2, 2]
    indices, d = nearest_neighbors(moved, target)
    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)
    w = huber_weights(d, delta) * kept
    R, t = align_weighted(moved, np.asarray(target)[indices], w)
    return np.vstack([np.hstack([R, t]), np.array([[0, 0, 1]], F)]) @ T


def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T = np.asarray(T_init, dtype=F)
    for _ in range(max_iterations):
        T = icp_step(source, target, T, max_distance, overlap_ratio, delta)
    return T


def has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):
    dT = np.asarray(dT, dtype=F)
    step = np.abs(dT[0, 2] + 1j * dT[1, 2])
    turn = np.abs(np.angle(dT[0, 0] + 1j * dT[1, 0]))
    small = (step < eps_t) & (turn < eps_psi)
    return int(small | (abs(F(cost_change)) < eps_cost) | (iteration >= k_max))


def integrate(increments, start):
    x, y, psi = (F(value) for value in start)
    z, e = x + 1j * y, np.exp(1j * psi)
    poses = [(x, y, psi)]
    for dx, dy, dpsi in np.asarray(increments, dtype=F):
        z = z + e * (dx + 1j * dy)
        e = e * np.exp(1j * dpsi)
        poses.append((z.real, z.imag, np.angle(e)))
    return np.array(poses, dtype=F)


def is_plausible(increment, inlier_ratio, rmse, max_shift, max_turn, min_ratio, max_rmse):
    dx, dy, dpsi = np.asarray(increment, dtype=F)
    return bool(
        np.sqrt(dx * dx + dy * dy) <= F(max_shift)
        and np.abs(dpsi) <= F(max_turn)
        and F(inlier_ratio) >= F(min_ratio)
        and F(rmse) <= F(max_rmse)
    )
