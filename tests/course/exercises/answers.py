"""What students hand in: wrong answers with a word of what is said of them, and right ones.

An empty word stands where nothing may be said but that it is wrong.
"""

# ruff: noqa: E501
from warnings import catch_warnings, simplefilter

import numpy as np
from scipy.sparse.linalg import spsolve

from labkit import IcpParameters, Target, align, apply, icp, wrap
from labkit import transform as T2
from labkit.correspondences import huber_loss
from labkit.course.exercises import exercises
from labkit.course.exercises.graph import linearise
from labkit.se2 import rotation


def rounds(p, q, T, update, count=15, gate=None):
    target = Target(q)
    for _ in range(count):
        m = apply(T, p)
        i, d = target.search.query(m)
        near = d <= (np.inf if gate is None else gate(d))
        T = update(align(m[near], q[i[near]]), T)
    return T


def svd(p, q, t=lambda R, a, b: b - R @ a):
    a, b = p.mean(0), q.mean(0)
    U, _, Vt = np.linalg.svd((p - a).T @ (q - b))
    R = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T
    return R, t(R, a, b)


def gated(p, q, gate):
    return icp(p, q, parameters=IcpParameters(max_correspondence_distance=gate))


def through(p, q, T, gates):
    for gate in gates:
        T = icp(p, q, T, IcpParameters(max_correspondence_distance=gate)).T_target_source
    return T


def cost(d, gate, count, delta, by):
    return huber_loss(np.minimum(np.sort(d)[:count], gate), delta).sum() / by


def lines(p, n, w, by=None):
    arm = p - w @ p / w.sum()
    length = np.sqrt(w @ (arm**2).sum(1) / w.sum())
    a = np.column_stack([n, (arm[:, 0] * n[:, 1] - arm[:, 1] * n[:, 0]) / length])
    return (a * w[:, None]).T @ a / (w.sum() if by is None else by)


def seen(A, g, use):
    values, vectors = np.linalg.eigh(A)
    return -vectors @ (use(values) * (vectors.T @ g))


def share(a, b, tie=0.5):
    return (a[:, None] > b).mean() + tie * (a[:, None] == b).mean()


def edge(i, j, z, turn=None, wrapped=wrap):
    d = rotation(-i[2] if turn is None else turn) @ (j[:2] - i[:2]) - z[:2]
    return np.append(d, wrapped(j[2] - i[2] - z[2]))


def bug(p, q, chain=lambda d, T: T @ d):
    total = np.eye(3)
    for _ in range(30):
        d = align(p, q[Target(q).search.query(p)[0]])
        p, total = apply(d, p), chain(d, total)
    return total


def unheld(poses, ends, measured, sigma):
    with catch_warnings():
        simplefilter("ignore")  # of a singular matrix
        for _ in range(30):
            e, J = linearise(poses, ends, measured, sigma)
            step = spsolve((J.T @ J).tocsc(), -J.T @ e)
            poses = poses + step.reshape(-1, 3)
            if abs(step).max() < 0.01:
                break
    return poses


I3 = np.eye(3)
Q, D = np.quantile, np.deg2rad

# fmt: off
WRONG = [
    ("motion_between", "inverted", lambda a, b: np.linalg.inv(b) @ a),
    ("turn_about", "transposed", lambda c, a: T2(*c - rotation(a) @ c, -a)),
    ("match_and_count", "does not reach", lambda p, q, g: (icp(p, q).inlier_count, icp(p, q).inlier_rmse)),
    ("match_and_count", "`source` and `target` exchanged", lambda p, q, g: (gated(q, p, g).inlier_count, gated(q, p, g).inlier_rmse)),
    ("match_and_count", "millimetres", lambda p, q, g: (gated(p, q, g).inlier_count, 1000.0 * gated(p, q, g).inlier_rmse)),
    ("icp_by_hand", "wrong side", lambda p, q, T, n: rounds(p, q, T, lambda d, T: T @ d, count=n)),
    ("icp_by_hand", "without the guess", lambda p, q, T, n: rounds(p, q, I3, lambda d, T: d @ T, count=n)),
    ("align_in_space", "sign", lambda p, q: svd(p, q, t=lambda R, a, b: R @ a - b)),
    ("align_robustly", "first round's", lambda p, q, d: align(p, q)),
    ("best_scale", "", lambda p, q: np.sum(q * (p @ align(p, q)[:2, :2].T)) / np.sum(p ** 2)),
    ("truncated_square", "charged nothing", lambda r, d: (np.where(r <= d, r ** 2, 0), (r <= d) * 1.0)),
    ("truncated_square", "on the gate", lambda r, d: (np.minimum(r, d) ** 2, r < d)),
    ("mutual_pairs", "not its partner", lambda p, q: ((t := Target(q).search.query(p)[0]), Target(p).search.query(q)[0][t] == t)[1]),
    ("match_by_median_gate", "wrong side", lambda p, q, T: rounds(p, q, T, lambda d, T: T @ d, 60, gate=lambda d: 3 * np.median(d))),
    ("cost_of", "kept pairs", lambda d, g, o, h: cost(d, g, int(o * len(d)), h, int(o * len(d)))),
    ("cost_of", "nearest number", lambda d, g, o, h: cost(d, g, round(o * len(d)), h, len(d))),
    ("colleagues_icp", "wrong order", bug),
    ("colleagues_icp", "last step", lambda p, q: bug(p, q, lambda d, T: d)),
    ("first_stops", "of each kind", lambda t, r, e: ((t < e).argmax(), (r < e).argmax())),
    ("first_stops", "first False", lambda t, r, e: ((t < e).argmin(), (r < e).argmin())),
    ("match_through_gates", "first guess again", lambda p, q, T, g: through(p, q, T, g[-1:])),
    ("lever_error", "half", lambda r, e: r * np.sin(abs(e) / 2)),
    ("seen_from_first", "shifted", lambda p: np.column_stack([p[:, :2] - p[0, :2], wrap(p[:, 2] - p[0, 2])])),
    ("solve_graph", "nothing fixes pose 0", unheld),
    ("solve_graph", "take the sizes", exercises()["solve_graph"].apply_edits({"abs(step).max()": "step.max()"})[0]),
    ("line_icp", "", exercises()["line_icp"].apply_edits({"d <= gate": "abs(e) <= gate"})[0]),
    ("line_errors", "lost its sign", lambda p, q, n: abs(((p - q) * n).sum(1))),
    ("turning_column", "origin", lambda p, n: p[:, 0] * n[:, 1] - p[:, 1] * n[:, 0]),
    ("line_matrix", "divided by N", lambda p, n, w: lines(p, n, w, by=len(w))),
    ("seen_step", "every direction", lambda A, g, s: -np.linalg.solve(A, g)),
    ("seen_step", "*not* seen", lambda A, g, s: seen(A, g, lambda v: (v < s) / v)),
    ("best_start", "smallest cost of all", lambda c, ok: c.argmin()),
    ("looks_worse", "exchanged", lambda b, g: share(g, b)),
    ("looks_worse", "counts fully", lambda b, g: share(b, g, 1.0)),
    ("closing_gap", "same axes", lambda s: (np.hypot(*s.sum(0)[:2]), abs(wrap(s.sum(0)[2])))),
    ("stretch_errors", "world", lambda e, r, n: np.hypot(*(e[n:] - e[:-n] - (r[n:] - r[:-n]))[:, :2].T)),
    ("edge_error", "world's axes", lambda i, j, z: edge(i, j, z, turn=0.0)),
    ("edge_error", "wrap the error itself", lambda i, j, z: np.append(edge(i, j, z)[:2], wrap(j[2] - i[2]) - z[2])),
]
RIGHT = [
    ("turn_about", lambda c, a: (T2(*c, 0) @ T2(0, 0, a) @ T2(*-c, 0)).astype(np.float32)),
    ("match_and_count", lambda p, q, g: np.array([gated(p, q, g).inlier_count, gated(p, q, g).inlier_rmse])),
    ("icp_by_hand", lambda p, q, T, n: rounds(p, q, T, lambda d, T: d @ T, count=n if n == 1 else 20)),
    ("align_in_space", lambda p, q: list(svd(p, q))),
    ("align_in_space", lambda p, q: np.block([[svd(p, q)[0], svd(p, q)[1][:, None]], [np.zeros((1, 3)), 1]])),
    ("align_in_space", lambda p, q: {"R": svd(p, q)[0], "t": svd(p, q)[1]}),
    ("best_scale", lambda p, q: np.array([np.sum((q - q.mean(0)) * ((p - p.mean(0)) @ align(p, q)[:2, :2].T)) / np.sum((p - p.mean(0)) ** 2)])),
    ("truncated_square", lambda r, d: np.array([np.minimum(r, d) ** 2, (r <= d) * 1.0])),
    ("truncated_square", lambda r, d: ([min(x, d) ** 2 for x in r], [x <= d for x in r])),
    ("mutual_pairs", lambda p, q: [int(Target(p).search.query(q[j][None])[0][0] == i) for i, j in enumerate(Target(q).search.query(p)[0])]),
    ("match_by_median_gate", lambda p, q, T: rounds(p, q, T, lambda d, T: d @ T, 60, gate=lambda d: 3 * sorted(d)[len(d) // 2])),
    ("cost_of", lambda d, g, o, h: np.float32(0) + cost(d, g, int(np.floor(o * len(d))), h, len(d))),
    ("line_matrix", lambda p, n, w: lines(p, n, 7 * w)),
    ("apparent_step", lambda s, p: (s + p / 2) % p - p / 2),
    ("best_start", lambda c, ok: float(np.flatnonzero(ok)[c[ok].argmin()]) if ok.any() else -1),
]
# fmt: on
