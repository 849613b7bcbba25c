"""Chapter 6: the residual of a line, its system, and directions that are not seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import Arguments, exercise


def _pairs(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Points far from the origin, their partners, normals and weights."""
    rng = np.random.default_rng(seed)
    p = rng.uniform([1.0, -2.0], [5.0, 3.0], (12, 2))
    angle = rng.uniform(-np.pi, np.pi, 12)
    n = np.column_stack([np.cos(angle), np.sin(angle)])
    return p, p + rng.normal(0.0, 0.1, p.shape), n, rng.uniform(0.2, 1.0, 12)


# fmt: off
@exercise("The residual across the wall", {
    "twelve pairs": _pairs(0)[:3], "twelve other pairs": _pairs(1)[:3],
}, {
    "This is the distance of the points; project the difference on the normal.":
        lambda p, q, n: np.hypot(*(p - q).T),
    "The sign is lost: on which side of the wall a point lies tells where to move it.":
        lambda p, q, n: abs(line_errors(p, q, n)),
    "The sign is turned round: it is p − q, the point seen from the wall.":
        lambda p, q, n: line_errors(q, p, n),
    "This is the residual *along* the wall; project on the normal itself.":
        lambda p, q, n: ((p - q) * n[:, ::-1] * (1, -1)).sum(1),
    "This is the residual along the wall, with the other sign; project on the normal.":
        lambda p, q, n: ((q - p) * n[:, ::-1] * (1, -1)).sum(1),
    "These are the squares; the residual keeps its sign.":
        lambda p, q, n: line_errors(p, q, n) ** 2,
    "These are products entry by entry, (N, 2): add the two for each pair.":
        lambda p, q, n: (p - q) * n,
    "This is the sum over the pairs; asked for is one residual for each.":
        lambda p, q, n: ((p - q) * n).sum(0),
    "Point p is projected, without its partner q.": lambda p, q, n: (p * n).sum(1),
    "The mean of the two products is taken; a dot product is their sum.":
        lambda p, q, n: line_errors(p, q, n) / 2,
})
def line_errors(p: FloatArray, q: FloatArray, n: FloatArray) -> FloatArray:
    """Coordinate by coordinate."""
    return n[:, 0] * (p[:, 0] - q[:, 0]) + n[:, 1] * (p[:, 1] - q[:, 1])


def _cross(a: FloatArray, n: FloatArray) -> FloatArray:
    return a[:, 0] * n[:, 1] - a[:, 1] * n[:, 0]


@exercise("How a turn changes the residual", {
    "twelve points with normals": _pairs(2)[::2], "twelve others": _pairs(3)[::2],
}, {
    "This turns about the origin; the step turns about the centroid.": lambda p, n: _cross(p, n),
    "This is minus the answer: (u, v)⊥ = (−v, u) turns to the left.":
        lambda p, n: -turning_column(p, n),
    "This is minus the answer, about the origin: turn to the left, about the centroid.":
        lambda p, n: -_cross(p, n),
    "This is n·(p − c); a turn moves a point at a right angle to its arm.":
        lambda p, n: ((p - p.mean(0)) * n).sum(1),
    "This is n·p; a turn about the centroid moves a point at a right angle to its arm p − c.":
        lambda p, n: (p * n).sum(1),
    "The perpendicular is (v, u): one of the two has to change its sign, (−v, u).":
        lambda p, n: ((p - p.mean(0))[:, ::-1] * n).sum(1),
    "This is the length of the arms; project their perpendicular on the normal.":
        lambda p, n: np.hypot(*(p - p.mean(0)).T),
    "The sign is lost: a turn moves some points to one side of their wall, some to the other.":
        lambda p, n: abs(turning_column(p, n)),
    "The arms are scaled to length 1: a far point moves more.":
        lambda p, n: turning_column(p, n) / np.hypot(*(p - p.mean(0)).T),
    "The centroid is the sum of the points; divide it by their number.":
        lambda p, n: _cross(p - p.sum(0), n),
    "The median is no centroid: take the mean.": lambda p, n: _cross(p - np.median(p, axis=0), n),
})
def turning_column(p: FloatArray, n: FloatArray) -> FloatArray:
    """Point by point."""
    arm = p - p.mean(axis=0)
    return np.array([u * ny - v * nx for (u, v), (nx, ny) in zip(arm, n, strict=True)])


def _matrix(p: FloatArray, n: FloatArray, w: FloatArray, c: Any = None, length: Any = None,
            sign: float = 1.0) -> FloatArray:
    arm = p - (np.average(p, axis=0, weights=w) if c is None else c)
    if length is None:
        length = np.sqrt(np.average((arm**2).sum(axis=1), weights=w))
    a = np.column_stack([n, sign * _cross(arm, n) / length])
    return np.asarray(np.einsum("i,ij,ik->jk", w, a, a) / w.sum())


@exercise("The matrix of the step", {
    "twelve weighted points with normals": (*_pairs(4)[::2], _pairs(4)[3]),
    "twelve others": (*_pairs(5)[::2], _pairs(5)[3]),
}, {
    "This is the sum; divide it by W, the sum of the weights.":
        lambda p, n, w: line_matrix(p, n, w) * w.sum(),
    "The sum is divided by N; divide it by W, the sum of the weights.":
        lambda p, n, w: line_matrix(p, n, w) * w.mean(),
    "The weights are missing: with these all points count alike.":
        lambda p, n, w: _matrix(p, n, np.ones(len(w))),
    "The third column is in metres per radian: divide it by ℓ.":
        lambda p, n, w: _matrix(p, n, w, length=1.0),
    "The centroid has to be the weighted one.": lambda p, n, w: _matrix(p, n, w, c=p.mean(0)),
    "The turn is about the origin: take the weighted centroid off.":
        lambda p, n, w: _matrix(p, n, w, c=np.zeros(2)),
    "ℓ has to be weighted, too.": lambda p, n, w: _matrix(
        p, n, w, length=np.sqrt(((p - np.average(p, axis=0, weights=w)) ** 2).sum(1).mean())),
    "ℓ is the mean length of the arms; asked for is their root mean square.":
        lambda p, n, w: _matrix(p, n, w, length=np.average(
            np.hypot(*(p - np.average(p, axis=0, weights=w)).T), weights=w)),
    "ℓ² is in the place of ℓ: the root is missing.": lambda p, n, w: _matrix(
        p, n, w, length=np.average(
            ((p - np.average(p, axis=0, weights=w)) ** 2).sum(1), weights=w)),
    "Centroid and ℓ are weighted, but the sum of a aᵀ is not.":
        lambda p, n, w: _matrix(p, n, np.ones(len(w)), np.average(p, axis=0, weights=w), np.sqrt(
            np.average(((p - np.average(p, axis=0, weights=w)) ** 2).sum(1), weights=w))),
    "The weights enter squared: each belongs in the sum once.":
        lambda p, n, w: np.einsum("i,ij,ik->jk", w**2, a := np.column_stack([n, _cross(
            arm := p - np.average(p, axis=0, weights=w), n) / np.sqrt(np.average(
                (arm**2).sum(1), weights=w))]), a) / w.sum(),
    "The third column has the wrong sign: (u, v)⊥ = (−v, u).":
        lambda p, n, w: _matrix(p, n, w, sign=-1.0),
})
def line_matrix(p: FloatArray, n: FloatArray, w: FloatArray) -> FloatArray:
    """The weighted mean of a aᵀ."""
    return _matrix(p, n, w)


def _corridor_and_room() -> Arguments:
    turned, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-1.0, 1.0, 1.0], [0.3, -0.7, 1.0]]))
    g = np.array([0.03, -0.02, 0.05])
    values = {"a corridor": (0.001, 0.4, 0.6), "a room": (0.2, 0.3, 0.5)}
    return {about: (turned @ np.diag(v) @ turned.T, g, 0.02) for about, v in values.items()}


def _by_parts(A: FloatArray, g: FloatArray, use: Any, take: Any = np.array) -> Any:
    values, V = np.linalg.eigh(A)
    V = take(V)
    return -V @ (use(values) * (V.T @ g))


@exercise("A step in the directions that are seen", _corridor_and_room, {
    "The sign is turned round: the step goes against the gradient.":
        lambda A, g, least: -seen_step(A, g, least),
    "This solves for every direction: along the corridor the step is made of noise.":
        lambda A, g, least: -np.linalg.solve(A, g),
    "This solves for every direction, and with the wrong sign: x = −A⁻¹ g.":
        lambda A, g, least: np.linalg.solve(A, g),
    "This keeps the free directions and drops the others.":
        lambda A, g, least: _by_parts(A, g, lambda v: (v < least) / v),
    "The eigenvectors are the *columns* of what `eigh` returns; these are its rows.":
        lambda A, g, least: _by_parts(A, g, lambda v: (v >= least) / v, np.transpose),
    "The parts are not divided by their eigenvalues.":
        lambda A, g, least: _by_parts(A, g, lambda v: (v >= least) * 1.0),
    "The parts are multiplied by their eigenvalues; divide by them.":
        lambda A, g, least: _by_parts(A, g, lambda v: (v >= least) * v),
    "Small eigenvalues are raised to `least`; a direction that is not seen gets no step at all.":
        lambda A, g, least: _by_parts(A, g, lambda v: 1 / np.maximum(v, least)),
    "The smallest eigenvalue is always dropped; drop those below `least`.":
        lambda A, g, least: _by_parts(A, g, lambda v: (v > v.min()) / v),
    "This is the step in the coordinates of the eigenvectors; turn it back by V.":
        lambda A, g, least: np.linalg.eigh(A)[1].T @ seen_step(A, g, least),
    "`least` is added to A; that damps every direction and drops none.":
        lambda A, g, least: -np.linalg.solve(A + least * np.eye(3), g),
})
def seen_step(A: FloatArray, g: FloatArray, least: float) -> FloatArray:
    """A sum over the eigenvectors that are seen."""
    return _by_parts(A, g, lambda v: (v >= least) / v)


def _two_sources() -> Arguments:
    wheels = np.array([[160.0, 20.0, 5.0], [20.0, 400.0, 0.0], [5.0, 0.0, 3000.0]])
    return {
        about: (np.array([0.10, 0.01, 0.035]), np.diag([along, 40000.0, 90000.0]),
                np.array([0.52, 0.03, 0.02]), wheels)
        for about, along in (("a smooth corridor", 0.0), ("a corridor with doors", 900.0))
    }


@exercise("Wheels and scan, fused", _two_sources, {
    "This is the mean of the two, whatever they know.": lambda x, A, y, B: (x + y) / 2,
    "The two are exchanged: each has to be weighed with its own information.":
        lambda x, A, y, B: fuse(y, A, x, B),
    "This weighs each with the diagonal of its information only.":
        lambda x, A, y, B: fuse(x, np.diag(np.diag(A)), y, np.diag(np.diag(B))),
    "The sum is divided by diagonal entries; solve with the sum of both matrices.":
        lambda x, A, y, B: (A @ x + B @ y) / np.diag(A + B),
    "The weighted sum is not divided: solve with the sum of both matrices.":
        lambda x, A, y, B: A @ x + B @ y,
    "This is the scan alone.": lambda x, A, y, B: x,
    "This is the wheels alone.": lambda x, A, y, B: y,
    "The matrices are weighed by one number each, their trace; they differ by direction.":
        lambda x, A, y, B: (np.trace(A) * x + np.trace(B) * y) / np.trace(A + B),
    "The matrices are inverted first; they are informations already, not covariances.":
        lambda x, A, y, B: fuse(x, np.linalg.inv(A), y, np.linalg.inv(B)),
    "The product is on the wrong side of the inverse: (Λ_s + Λ_w)⁻¹ stands on the left.":
        lambda x, A, y, B: A @ np.linalg.solve(A + B, x) + B @ np.linalg.solve(A + B, y),
    "The result is halved: the two informations add up, they are not averaged.":
        lambda x, A, y, B: fuse(x, A, y, B) / 2,
})
def fuse(x_scan: Any, info_scan: Any, x_wheels: Any, info_wheels: Any) -> FloatArray:
    """The wheels, moved by a gain towards the scan."""
    gain = np.linalg.solve(info_scan + info_wheels, info_scan)
    return np.asarray(x_wheels + gain @ (x_scan - x_wheels))
