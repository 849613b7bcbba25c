"""Chapter 6: the residual of a line, its system, and directions that are not seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import Case, exercise


def _pairs(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Points far from the origin, their partners, normals and weights."""
    rng = np.random.default_rng(seed)
    p = rng.uniform([1.0, -2.0], [5.0, 3.0], (12, 2))
    angle = rng.uniform(-np.pi, np.pi, 12)
    n = np.column_stack([np.cos(angle), np.sin(angle)])
    return p, p + rng.normal(0.0, 0.1, p.shape), n, rng.uniform(0.2, 1.0, 12)


@exercise("The residual across the wall")
def line_errors() -> Iterator[Case]:
    """For two sets of pairs with residuals of either sign."""
    for seed in (0, 1):
        p, q, n, _ = _pairs(seed)
        right = n[:, 0] * (p[:, 0] - q[:, 0]) + n[:, 1] * (p[:, 1] - q[:, 1])
        yield Case(
            "twelve pairs",
            (p, q, n),
            right,
            {
                "This is the distance of the points; project the difference on the normal.": (
                    np.hypot(*(p - q).T)
                ),
                "The sign is lost: on which side of the wall a point lies tells where to "
                "move it.": np.abs(right),
                "The sign is turned round: it is p − q, the point seen from the wall.": -right,
            },
        )


@exercise("How a turn changes the residual")
def turning_column() -> Iterator[Case]:
    """For points whose centroid is far from the origin."""
    for seed in (2, 3):
        p, _, n, _ = _pairs(seed)
        arm = p - p.mean(axis=0)
        right = np.array([u * ny - v * nx for (u, v), (nx, ny) in zip(arm, n, strict=True)])
        yield Case(
            "twelve points with normals",
            (p, n),
            right,
            {
                "This turns about the origin; the step turns about the centroid.": (
                    p[:, 0] * n[:, 1] - p[:, 1] * n[:, 0]
                ),
                "This is minus the answer: (u, v)⊥ = (−v, u) turns to the left.": -right,
                "This is n·(p − c); a turn moves a point at a right angle to its arm.": (
                    (n * arm).sum(axis=1)
                ),
            },
        )


@exercise("The matrix of the step")
def line_matrix() -> Iterator[Case]:
    """For weights that differ, so that the centroid, ℓ and W all need them."""
    for seed in (4, 5):
        p, _, n, w = _pairs(seed)
        even = np.ones(len(w))
        yield Case(
            "twelve weighted points with normals",
            (p, n, w),
            _matrix(p, n, w),
            {
                "This is the sum; divide it by W, the sum of the weights.": (
                    _matrix(p, n, w) * w.sum()
                ),
                "The weights are missing: with these all points count alike.": _matrix(p, n, even),
                "The third column is in metres per radian: divide it by ℓ.": (
                    _matrix(p, n, w, length=1.0)
                ),
                "The centroid has to be the weighted one.": _matrix(p, n, w, c=p.mean(axis=0)),
            },
        )


def _matrix(
    p: FloatArray,
    n: FloatArray,
    w: FloatArray,
    *,
    c: FloatArray | None = None,
    length: float | None = None,
) -> FloatArray:
    arm = p - (np.average(p, axis=0, weights=w) if c is None else c)
    if length is None:
        length = float(np.sqrt(np.average((arm**2).sum(axis=1), weights=w)))
    total = np.zeros((3, 3))
    for (u, v), (nx, ny), each in zip(arm, n, w, strict=True):
        a = np.array([nx, ny, (u * ny - v * nx) / length])
        total += each * np.outer(a, a)
    return np.asarray(total / w.sum())


@exercise("A step in the directions that are seen")
def seen_step() -> Iterator[Case]:
    """For a matrix with a free direction that is none of the coordinates, and one without."""
    turned, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-1.0, 1.0, 1.0], [0.3, -0.7, 1.0]]))
    g = np.array([0.03, -0.02, 0.05])
    for where, values in {
        "a corridor": np.array([0.001, 0.4, 0.6]),
        "a room": np.array([0.2, 0.3, 0.5]),
    }.items():
        A = turned @ np.diag(values) @ turned.T
        parts = [-(v @ g) / value * v for value, v in zip(values, turned.T, strict=True)]
        right = np.sum([part for part, value in zip(parts, values, strict=True) if value > 0.02], 0)
        mistakes = {"The sign is turned round: the step goes against the gradient.": -right}
        if values[0] < 0.02:
            mistakes |= {
                "This solves for every direction: along the corridor the step is made of noise.": (
                    -np.linalg.solve(A, g)
                ),
                "This keeps the free direction and drops the others.": parts[0],
            }
        yield Case(where, (A, g, 0.02), right, mistakes)


@exercise("Wheels and scan, fused")
def fuse() -> Iterator[Case]:
    """For a scan that leaves a direction free, and for one that does not."""
    x_wheels, x_scan = np.array([0.52, 0.03, 0.02]), np.array([0.10, 0.01, 0.035])
    info_wheels = np.array([[160.0, 20.0, 5.0], [20.0, 400.0, 0.0], [5.0, 0.0, 3000.0]])
    for where, along in {"a smooth corridor": 0.0, "a corridor with doors": 900.0}.items():
        info_scan = np.diag([along, 40000.0, 90000.0])
        both = info_scan + info_wheels
        gain = np.linalg.solve(both, info_scan)
        yield Case(
            where,
            (x_scan, info_scan, x_wheels, info_wheels),
            x_wheels + gain @ (x_scan - x_wheels),
            {
                "This is the mean of the two, whatever they know.": (x_scan + x_wheels) / 2,
                "The two are exchanged: each has to be weighed with its own information.": (
                    x_scan + gain @ (x_wheels - x_scan)
                ),
                "This weighs each with the diagonal of its information only.": _diagonally(
                    x_scan, info_scan, x_wheels, info_wheels
                ),
            },
        )


def _diagonally(*each: FloatArray) -> FloatArray:
    x_scan, info_scan, x_wheels, info_wheels = each
    s, w = np.diag(info_scan), np.diag(info_wheels)
    return np.asarray((s * x_scan + w * x_wheels) / (s + w))
