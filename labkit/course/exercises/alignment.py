"""Chapter 2: alignment of given pairs, in space, with a scale, with an outlier."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from labkit import align, apply, transform
from labkit.arrays import FloatArray
from labkit.correspondences import huber_weights
from labkit.course.exercises.exercise import Case, exercise


@exercise("Align in space")
def align_in_space() -> Iterator[Case]:
    """For a turned cloud, and for a mirrored one, which no rotation can match."""
    rng = np.random.default_rng(2)
    p = rng.normal(size=(30, 3)) * (3.0, 2.0, 1.0) + (1.0, -2.0, 0.5)
    turned = p @ Rotation.from_rotvec((0.4, -0.9, 1.3)).as_matrix().T
    clouds = {"a turned cloud": turned, "a mirrored cloud": turned * (1.0, 1.0, -1.0)}
    for where, cloud in clouds.items():
        q = cloud + np.array([0.5, 1.0, -2.0])
        x, y = p - p.mean(axis=0), q - q.mean(axis=0)
        R = Rotation.align_vectors(y, x)[0].as_matrix()
        U, _, Vt = np.linalg.svd(x.T @ y)
        orthogonal = Vt.T @ U.T
        mistakes = {"R is transposed: H = Σ x yᵀ = U S Vᵀ gives V … Uᵀ, not U … Vᵀ.": R.T}
        if where == "a mirrored cloud":  # of a turned one the two agree
            says = "The determinant is missing: for a mirrored cloud this R is a reflection."
            mistakes[says] = orthogonal
        unturned = "The translation is the difference of the centroids; the source's centroid has "
        unturned += "to be turned first: t = q̄ − R p̄."
        yield Case(
            where,
            (p, q),
            (R, q.mean(axis=0) - R @ p.mean(axis=0)),
            {says: (M, q.mean(axis=0) - M @ p.mean(axis=0)) for says, M in mistakes.items()}
            | {unturned: (R, q.mean(axis=0) - p.mean(axis=0))},
        )


@exercise("Leave the scale free")
def best_scale() -> Iterator[Case]:
    """In complex numbers a turn and a scale are one factor."""
    rng = np.random.default_rng(3)
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (50, 2)) + np.array([2.0, 1.0])
    for c in (1.3, 0.8):
        q = c * apply(transform(0.5, -0.2, 0.9), p) + rng.normal(0.0, 0.4, p.shape)
        x, y = (each @ (1.0, 1.0j) for each in (p, q))
        centered = [each - each.mean() for each in (x, y)]
        found, free = (abs(np.vdot(a, b)) / np.vdot(a, a).real for a, b in (centered, (x, y)))
        spread = [np.sqrt(np.vdot(a, a).real) for a in centered]
        yield Case(
            f"a copy scaled by {c:g}, with noise",
            (p, q),
            found,
            {
                "The points are not centred; take the centroids off first.": free,
                "This is the ratio of the spreads. It does not minimise the cost: noise in q "
                "makes it too large.": spread[1] / spread[0],
                "This is the scale from target to source, turned over; divide the trace by "
                "Σ‖x‖², not Σ‖y‖² by the trace.": (spread[1] / spread[0]) ** 2 / found,
            },
        )


@exercise("How sure is the translation?")
def std_of_translation() -> Iterator[Case]:
    """For walls round the robot, and for walls on one side."""
    rng = np.random.default_rng(4)
    for ahead in (2.0, 8.0):
        sigma = 0.02
        p = rng.uniform((ahead - 1.0, -3.0), (ahead + 1.0, 3.0), (100, 2))
        r = np.hypot(*p.mean(axis=0))
        spread, from_origin = p.var(axis=0).sum(), (p**2).sum(axis=1).mean()
        along = sigma * len(p) ** -0.5
        yield Case(
            f"a centroid {ahead:g} m ahead",
            (p, sigma),
            (along, along * np.sqrt(1.0 + r**2 / spread)),
            {
                "The lever is missing: an error of the angle moves the image of the centroid, "
                "too.": (along, along),
                "The noise of the centroid is missing across: two independent errors add up as "
                "squares.": (along, along * r / np.sqrt(spread)),
                "ℓ² is the mean squared distance from the *centroid*, not from the origin.": (
                    along,
                    along * np.sqrt(1.0 + r**2 / from_origin),
                ),
            },
            tolerance=1e-9,
        )


@exercise("Weigh by the residual, again and again")
def align_robustly() -> Iterator[Case]:
    """For ten pairs, one of which has nothing to do with the others."""
    rng = np.random.default_rng(5)
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (10, 2))
    for metres in 2.0, 20.0:
        q = apply(transform(0.35, 0.10, 0.5), p) + rng.normal(0.0, 0.02, p.shape)
        q[4] += (metres, 0.0)
        yield Case(
            f"an outlier {metres:g} m off",
            (p, q, 0.05),
            _reweighted(p, q, lambda r: huber_weights(r, 0.05)),
            {
                "This is least squares: the weights never reach `labkit.align`.": align(p, q),
                "The weight is δ/r for small residuals, too, above 1; Huber's weight is 1 up to "
                "δ.": _reweighted(p, q, lambda r: 0.05 / r),
                "The weight is (δ/r)²: that is no longer Huber's loss, and not "
                "convex.": _reweighted(p, q, lambda r: np.minimum(1.0, 0.05 / r) ** 2),
            },
        )


def _reweighted(
    p: FloatArray, q: FloatArray, weigh: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    weights = np.ones(len(p))
    for _ in range(20):
        T = align(p, q, weights)
        weights = weigh(np.hypot(*(apply(T, p) - q).T))
    return T
