"""Chapter 6: the residual of a line, its system, and directions that are not seen."""

import numpy as np

from labkit.course.exercises import exercise


def _pairs(seed):
    """Points far from the origin, their partners, normals and weights."""
    rng = np.random.default_rng(seed)
    p = rng.uniform([1.0, -2.0], [5.0, 3.0], (12, 2))
    angle = rng.uniform(-np.pi, np.pi, 12)
    n = np.column_stack([np.cos(angle), np.sin(angle)])
    return p, p + rng.normal(0.0, 0.1, p.shape), n, rng.uniform(0.2, 1.0, 12)


def _cross(a, n):
    (x, y), (u, v) = a.T, n.T
    return x * v - y * u


# fmt: off
@exercise("The residual across the wall", {
    "twelve pairs": _pairs(0)[:3], "twelve other pairs": _pairs(1)[:3],
}, {
    "This is the distance; project it on the normal.": lambda p, q, n: np.hypot(*(p - q).T),
    "This is the residual *along* the wall; project on n itself.": lambda p, q, n: _cross(p - q, n),
    "These are products entry by entry, (N, 2): add the two of each.": lambda p, q, n: (p - q) * n,
    "This is the sum over the pairs; give one for each pair.": lambda p, q, n: ((p - q) * n).sum(0),
})
def line_errors(p, q, n):
    """Coordinate by coordinate."""
    x, y = (p - q).T
    u, v = n.T
    return u * x + v * y


@exercise("How a turn changes the residual", {
    "twelve points with normals": _pairs(2)[::2], "twelve others": _pairs(3)[::2],
}, {
    "This turns about the origin; the step turns about the centroid.": {" - p.mean(axis=0)": ""},
    "This is n·(p − c); a turn moves across that arm.": {"_cross(arm, n)": "(arm * n).sum(1)"},
    "The perpendicular is (v, u): one of the two has to change its sign, (−v, u).":
        {"_cross(arm, n)": "(arm[:, ::-1] * n).sum(1)"},
})
def turning_column(p, n):
    """The arm's perpendicular on the normal."""
    arm = p - p.mean(axis=0)
    return _cross(arm, n)


@exercise("The matrix of the step", {
    "twelve weighted points with normals": (*_pairs(4)[::2], _pairs(4)[3]),
    "twelve others": (*_pairs(5)[::2], _pairs(5)[3]),
}, {
    "The sum is divided by N; divide it by W, the sum of the weights.": {"w.sum()": "len(w)"},
    "The third column is in metres per radian: divide it by ℓ.": {" / length": ""},
    "Centroid and ℓ are weighted, but the sum of a aᵀ is not.":
        {"w, a, a) / w.sum()": "np.ones(len(w)), a, a) / len(w)"},
})
def line_matrix(p, n, w):
    """The weighted mean of a aᵀ."""
    arm = p - np.average(p, axis=0, weights=w)
    length = np.average((arm**2).sum(axis=1), weights=w) ** 0.5
    a = np.column_stack([n, _cross(arm, n) / length])
    return np.einsum("i,ij,ik->jk", w, a, a) / w.sum()


def _corridor_and_room():
    turned, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-1.0, 1.0, 1.0], [0.3, -0.7, 1.0]]))
    g = np.array([0.03, -0.02, 0.05])
    values = {"a corridor": (0.001, 0.4, 0.6), "a room": (0.2, 0.3, 0.5)}
    values["a corridor without any doors"] = (0.0001, 0.4, 0.6)
    values["a room that is seen well, but for one direction"] = (0.03, 0.1, 3.0)
    cases = {about: (turned @ np.diag(v) @ turned.T, g, 0.02) for about, v in values.items()}
    return cases | {"a direction exactly at the limit": (np.diag([0.4, 0.05, 0.6]), g, 0.05)}


@exercise("A step in the directions that are seen", _corridor_and_room, {
    "This solves for every direction, even where all is noise.": {"(values >= least)": "1"},
    "`least` is held against shares of the largest eigenvalue; hold it against each as it is.":
        {">= least": ">= least * values.max()"},
    "Eigenvectors are the *columns* of what `eigh` returns, not rows.":
        {"    parts": "    V = V.T\n    parts"},
    "Small eigenvalues are raised to `least`; a direction that is not seen gets no step at all.":
        {"(values >= least) / values": "1 / np.maximum(values, least)"},
    "The step goes in the directions that are *not* seen: keep the eigenvalues from `least` up.":
        {"values >= least": "values < least"},
    "An eigenvalue right at `least` counts as seen.": {"values >= least": "values > least"},
})
def seen_step(A, g, least):
    """A sum over the eigenvectors that are seen."""
    values, V = np.linalg.eigh(A)
    parts = (values >= least) / values * (V.T @ g)
    return -V @ parts
