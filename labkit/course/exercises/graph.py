"""Chapter 10: a pose graph, linearised for the student and solved by them."""

import numpy as np
from scipy.sparse import bsr_array
from scipy.sparse.linalg import spsolve

from labkit import from_xytheta, to_xytheta, wrap
from labkit.course.exercises import exercise
from labkit.se2 import relative


def linearise(poses, ends, measured, sigma):
    """Errors of all edges in standard deviations (3E,), and their derivatives (3E, 3K), sparse.

    Edge e leads from pose `ends[e, 0]` to pose `ends[e, 1]`, of `poses` (K, 3).
    """
    i, j = ends.T
    c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
    dx, dy, turn = (poses[j] - poses[i]).T
    x = c * dx + s * dy  # pose j seen from pose i
    y = c * dy - s * dx
    errors = np.column_stack([x, y, turn]) - measured  # (10.1)
    errors[:, 2] = wrap(errors[:, 2])
    zero = np.zeros_like(c)
    by_j = np.array([[c, s, zero], [-s, c, zero], [zero, zero, zero + 1.0]])
    by_i = -by_j
    by_i[:2, 2] = y, -x
    blocks = np.stack([by_i, by_j]).transpose(3, 0, 1, 2).reshape(-1, 3, 3) / sigma[:, None]
    rows = 2 * np.arange(len(ends) + 1)
    shape = (3 * len(ends), 3 * len(poses))
    jacobian = bsr_array((blocks, ends.ravel(), rows), shape=shape)
    return (errors / sigma).ravel(), jacobian.tocsc()


def _square(seed):
    """A drive round a square in eight steps, measured with noise, and two loops."""
    rng = np.random.default_rng(seed)
    sigma = np.array([0.05, 0.05, 0.02])
    turns = np.repeat([0.3, -1.0], 4) if seed else np.full(8, np.pi / 4)
    truth = [np.array([1.0, -2.0, 0.4])]
    for turn in turns:
        truth.append(to_xytheta(from_xytheta(truth[-1]) @ from_xytheta((1.0, 0.1, turn))))
    T = from_xytheta(np.array(truth))
    ends = np.array([*((k, k + 1) for k in range(8)), (0, 8), (2, 7)])
    exact = to_xytheta(relative(T[ends[:, 0]], T[ends[:, 1]]))
    measured = exact + 3 * sigma * rng.normal(size=exact.shape)
    chain = [T[0]]
    for step in measured[:8]:
        chain.append(chain[-1] @ from_xytheta(step))
    return to_xytheta(np.array(chain)), ends, measured, sigma


def _three(second, third):
    """Three poses, the second and third of which are too far off, and their edges."""
    poses = np.array([(0.0, 0.0, 0.0), second, third])
    measured = np.array([(1.0, 0.2, 0.5), (1.0, -0.1, 0.4), (1.8, 0.7, 0.95)])
    return poses, np.array([(0, 1), (1, 2), (0, 2)]), measured, np.array([0.05, 0.05, 0.02])


# fmt: off
@exercise("Solve the graph", lambda: {
    "a drive that comes back to its start": _square(0), "a drive that bends both ways": _square(20),
    "poses that lie too far ahead and to the left": _three((1.3, 0.7, 1.0), (2.9, 1.8, 2.0)),
    "poses whose first steps add up to nothing": _three((0.7, 0.5, 0.9), (2.17585, 0.4, 0.5)),
}, {
    "All is nan: nothing fixes pose 0, so the matrix is singular; leave its three columns out.":
        lambda poses, ends, measured, sigma: np.full(poses.shape, np.nan),
    "This is one round; the headings make the graph nonlinear, so go round until nothing moves.":
        {"range(30)": "range(1)"},
    "The step has the wrong sign: it is −Jᵀe on the right of (10.2).":
        {"-J.T @ error": "J.T @ error", "range(30)": "range(1)"},
    "The loop ends as soon as no entry of the step is large and positive: take the sizes.":
        {"abs(step).max() < 1e-8": "step.max() < 0.01"},
}, tolerance=1e-3)
def solve_graph(poses, ends, measured, sigma):
    """Steps of (10.2), until they are small."""
    x = poses.copy()
    for _ in range(30):
        error, J = linearise(x, ends, measured, sigma)
        J = J[:, 3:]
        step = spsolve((J.T @ J).tocsc(), -J.T @ error).reshape(-1, 3)
        x[1:] += step
        if abs(step).max() < 1e-8:
            break
    return x
