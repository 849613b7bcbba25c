"""Chapter 2: alignment of given pairs, in space, with a scale, with an outlier."""

import numpy as np
from scipy.spatial.transform import Rotation

from labkit import align, apply, transform
from labkit.correspondences import huber_weights
from labkit.course.exercises import exercise


def _clouds():
    p = np.random.default_rng(2).normal(size=(30, 3)) * (3.0, 2.0, 1.0) + (1.0, -2.0, 0.5)
    turned = p @ Rotation.from_rotvec((0.4, -0.9, 1.3)).as_matrix().T
    shift = np.array([0.5, 1.0, -2.0])
    return {
        "a turned cloud": (p, turned + shift),
        "a mirrored cloud": (p, turned * (1.0, 1.0, -1.0) + shift),
    }


def _svd(signs):
    """Alignment by the SVD with these in its middle, made of the sign of the determinant."""

    def align_in_space(p, q):
        H = (p - p.mean(0)).T @ (q - q.mean(0))
        U, _, Vt = np.linalg.svd(H)
        chi = np.sign(np.linalg.det(Vt.T @ U.T))
        R = Vt.T @ np.diag(signs(chi)) @ U.T
        return R, q.mean(0) - R @ p.mean(0)

    return align_in_space


# fmt: off
@exercise("Align in space", _clouds, {
    "R is transposed: from H = U S Vᵀ it is V … Uᵀ.": {".as_matrix()": ".as_matrix().T"},
    "The determinant is missing: for a mirrored cloud this R is a reflection.":
        _svd(lambda sign: [1, 1, 1]),
    "The determinant turns the first singular vector; it belongs to the last, the smallest value.":
        _svd(lambda sign: [sign, 1, 1]),
    "The translation is q̄ − p̄; the source's centroid has to be turned first: t = q̄ − R p̄.":
        {"R @ p": "p"},
    "The points are not centred: H sums the points less their centroids.":
        {"q - q.mean(0), p - p.mean(0)": "q, p"},
})
def align_in_space(p, q):
    """The rotation from scipy, by another way than the solution."""
    best_rotation, _ = Rotation.align_vectors(q - q.mean(0), p - p.mean(0))
    R = best_rotation.as_matrix()
    return R, q.mean(0) - R @ p.mean(0)


def spread(x):
    """Σ‖x‖² of complex numbers."""
    return np.vdot(x, x).real


def _copies():
    rng = np.random.default_rng(3)
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (50, 2)) + np.array([2.0, 1.0])
    noise = rng.normal(0.0, 0.4, p.shape)
    T = transform(0.5, -0.2, 0.9)
    return {f"a copy scaled by {c:g}, with noise": (p, c * apply(T, p) + noise) for c in (1.3, 0.8)}


@exercise("Leave the scale free", _copies, {
    "The points are not centred; take the centroids off first.":
        {" - p.mean(0)": "", " - q.mean(0)": ""},
    "This is the ratio of the spreads. It does not minimise the cost: noise in q enlarges it.":
        {"abs(np.vdot(x, y)) / spread(x)": "(spread(y) / spread(x)) ** 0.5"},
    "This is the scale from target to source, turned over: divide the trace by Σ‖x‖².":
        {"abs(np.vdot(x, y)) / spread(x)": "spread(y) / abs(np.vdot(x, y))"},
    "The points are not turned: the trace is that of R H, with the best R.":
        {"abs(np.vdot(x, y))": "np.vdot(x, y).real"},
})
def best_scale(p, q):
    """In complex numbers a turn and a scale are one factor, and |x̄ᵀ y| is the trace of R H."""
    x = (p - p.mean(0)) @ (1.0, 1.0j)
    y = (q - q.mean(0)) @ (1.0, 1.0j)
    return abs(np.vdot(x, y)) / spread(x)


def _outliers():
    rng, cases = np.random.default_rng(5), {}
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (10, 2))
    for metres in 2.0, 20.0, 0.1:
        q = apply(transform(0.35, 0.10, 0.5), p) + rng.normal(0.0, 0.02, p.shape)
        q[4] += (metres, 0.0)
        cases[f"an outlier {metres:g} m off"] = (p, q, 0.05)
    return cases


@exercise("Weigh by the residual, again and again", _outliers, {
    "This is the first round's alignment, with all weights 1: does a `return` inside the loop end "
    "it, or do the new weights not reach `align`?": {"range(20)": "range(1)"},
    "The weight is δ/r for small residuals, too; up to δ it is 1.":
        {"huber_weights(r, delta)": "delta / r"},
    "The weight is (δ/r)²: that is no longer Huber's loss, and not convex.":
        {"(r, delta)": "(r, delta) ** 2"},
    "The residuals are squared before they meet δ; both are lengths in metres.":
        {"(r, delta)": "(r**2, delta)"},
    "Pairs beyond δ weigh nothing: that is a gate. Huber's weight falls as δ/r.":
        {"huber_weights(r, delta)": "(r <= delta) + 1e-12"},
})
def align_robustly(p, q, delta):
    """Twenty rounds of reweighing."""
    weights = np.ones(len(p))
    for _ in range(20):
        T = align(p, q, weights)
        r = np.hypot(*(apply(T, p) - q).T)
        weights = huber_weights(r, delta)
    return T
