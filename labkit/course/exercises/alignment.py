"""Chapter 2: alignment of given pairs, in space, with a scale, with an outlier."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from labkit import align, apply, transform
from labkit.arrays import FloatArray
from labkit.correspondences import huber_weights
from labkit.course.exercises.exercise import Arguments, exercise

Pair = tuple[FloatArray, FloatArray]


def _clouds() -> Arguments:
    p = np.random.default_rng(2).normal(size=(30, 3)) * (3.0, 2.0, 1.0) + (1.0, -2.0, 0.5)
    turned = p @ Rotation.from_rotvec((0.4, -0.9, 1.3)).as_matrix().T
    shift = np.array([0.5, 1.0, -2.0])
    return {
        "a turned cloud": (p, turned + shift),
        "a mirrored cloud": (p, turned * (1.0, 1.0, -1.0) + shift),
    }


def _kabsch(p: FloatArray, q: FloatArray, fix: Any, center: float = 1.0) -> Pair:
    U, _, Vt = np.linalg.svd((p - center * p.mean(0)).T @ (q - center * q.mean(0)))
    R = fix(U, Vt, np.sign(np.linalg.det(Vt.T @ U.T)))
    return R, q.mean(0) - R @ p.mean(0)


def _proper(U: FloatArray, Vt: FloatArray, sign: float) -> FloatArray:
    return np.asarray(Vt.T @ np.diag([1.0, 1.0, sign]) @ U.T)


# fmt: off
@exercise("Align in space", _clouds, {
    "R is transposed: H = Σ x yᵀ = U S Vᵀ gives V … Uᵀ, not U … Vᵀ.":
        lambda p, q: _kabsch(p, q, lambda *svd: _proper(*svd).T),
    "R is transposed, next to the right t.":
        lambda p, q: (align_in_space(p, q)[0].T, align_in_space(p, q)[1]),
    "The determinant is missing: for a mirrored cloud this R is a reflection.":
        lambda p, q: _kabsch(p, q, lambda U, Vt, sign: Vt.T @ U.T),
    "The determinant turns the first singular vector; it belongs to the last, the smallest value.":
        lambda p, q: _kabsch(p, q, lambda U, Vt, sign: Vt.T @ np.diag([sign, 1, 1]) @ U.T),
    "For a mirrored cloud all of R is negated; turn the last singular vector alone.":
        lambda p, q: _kabsch(p, q, lambda U, Vt, sign: sign * Vt.T @ U.T),
    "The translation is q̄ − p̄; the source's centroid has to be turned first: t = q̄ − R p̄.":
        lambda p, q: (align_in_space(p, q)[0], q.mean(0) - p.mean(0)),
    "The points are not centred: H is a sum over the points less their centroids.":
        lambda p, q: _kabsch(p, q, _proper, center=0.0),
    "The translation has the wrong sign: t = q̄ − R p̄.":
        lambda p, q: (align_in_space(p, q)[0], -align_in_space(p, q)[1]),
    "The translation is turned as a whole: t = q̄ − R p̄, not R (q̄ − p̄).":
        lambda p, q: (R := align_in_space(p, q)[0], R @ (q.mean(0) - p.mean(0))),
    "p and q are swapped: this maps the target onto the source.":
        lambda p, q: align_in_space(q, p),
})
def align_in_space(p: FloatArray, q: FloatArray) -> Pair:
    """The rotation from scipy, by another way than the solution."""
    R = Rotation.align_vectors(q - q.mean(0), p - p.mean(0))[0].as_matrix()
    return R, q.mean(0) - R @ p.mean(0)


def _scaled() -> Arguments:
    rng = np.random.default_rng(3)
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (50, 2)) + np.array([2.0, 1.0])
    noise, T = rng.normal(0.0, 0.4, p.shape), transform(0.5, -0.2, 0.9)
    return {f"a copy scaled by {c:g}, with noise": (p, c * apply(T, p) + noise) for c in (1.3, 0.8)}


def _complex(p: FloatArray, q: FloatArray, center: bool = True) -> Any:
    x, y = (each @ (1.0, 1.0j) for each in (p, q))
    return (x - x.mean(), y - y.mean()) if center else (x, y)


def _ratio(x: Any, y: Any) -> Any:
    return abs(np.vdot(x, y)) / np.vdot(x, x).real


@exercise("Leave the scale free", _scaled, {
    "The points are not centred; take the centroids off first.":
        lambda p, q: _ratio(*_complex(p, q, center=False)),
    "This is the ratio of the spreads. It does not minimise the cost: noise in q enlarges it.":
        lambda p, q: np.sqrt(q.var(0).sum() / p.var(0).sum()),
    "This is the ratio of the spreads, squared, and not the trace over Σ‖x‖².":
        lambda p, q: q.var(0).sum() / p.var(0).sum(),
    "This is the scale from target to source, turned over: divide the trace by Σ‖x‖².":
        lambda p, q: 1 / best_scale(q, p),
    "Source and target are swapped: this is the scale from target to source.":
        lambda p, q: best_scale(q, p),
    "The points are not turned: the trace is that of R H, with the best R.":
        lambda p, q: np.vdot(*_complex(p, q)).real / p.var(0).sum() / len(p),
    "The points are turned the wrong way: with R transposed the trace is another one.":
        lambda p, q: (np.vdot(*_complex(p, q)) ** 2).real / abs(np.vdot(*_complex(p, q)))
        / p.var(0).sum() / len(p),
    "This is the trace; divide it by Σ‖x‖².": lambda p, q: abs(np.vdot(*_complex(p, q))),
    "The trace is divided by the number of pairs; divide it by Σ‖x‖².":
        lambda p, q: abs(np.vdot(*_complex(p, q))) / len(p),
    "The trace is divided by Σ‖x‖ Σ‖y‖, as for a correlation; divide it by Σ‖x‖².":
        lambda p, q: np.sqrt(best_scale(p, q) * best_scale(q, p)),
})
def best_scale(p: FloatArray, q: FloatArray) -> Any:
    """In complex numbers a turn and a scale are one factor."""
    return _ratio(*_complex(p, q))


def _walls() -> Arguments:
    rng = np.random.default_rng(4)
    return {
        f"a centroid {x:g} m ahead": (rng.uniform((x - 1.0, -3.0), (x + 1.0, 3.0), (100, 2)), 0.02)
        for x in (2.0, 8.0)
    }


def _across(p: FloatArray, s: float, factor: Any) -> tuple[float, float]:
    r2, spread = (p.mean(0) ** 2).sum(), p.var(0).sum()
    along = s / len(p) ** 0.5
    return along, along * factor(r2, spread)


@exercise("How sure is the translation?", _walls, {
    "The lever is missing: an error of the angle moves the image of the centroid, too.":
        lambda p, s: _across(p, s, lambda r2, spread: 1.0),
    "The noise of the centroid is missing across: two independent errors add as squares.":
        lambda p, s: _across(p, s, lambda r2, spread: (r2 / spread) ** 0.5),
    "The two errors across are added; independent errors add as squares.":
        lambda p, s: _across(p, s, lambda r2, spread: 1 + (r2 / spread) ** 0.5),
    "The root is missing across: 1 + r²/ℓ² is the factor of the variance.":
        lambda p, s: _across(p, s, lambda r2, spread: 1 + r2 / spread),
    "r and ℓ enter as they are; their squares do.":
        lambda p, s: _across(p, s, lambda r2, spread: (1 + (r2 / spread) ** 0.5) ** 0.5),
    "ℓ² is the mean squared distance from the *centroid*, not from the origin.":
        lambda p, s: _across(p, s, lambda r2, spread: (1 + r2 / (r2 + spread)) ** 0.5),
    "ℓ² is a mean: divide the sum of the squares by N.":
        lambda p, s: _across(p, s, lambda r2, spread: (1 + r2 / spread / len(p)) ** 0.5),
    "The noise is divided by N; that of a mean falls with the root of N.":
        lambda p, s: std_of_translation(p, s / len(p) ** 0.5),
    "The noise is not divided by the root of N: the centroid is a mean of N points.":
        lambda p, s: std_of_translation(p, s * len(p) ** 0.5),
    "These are variances; asked for are their roots.":
        lambda p, s: tuple(one**2 for one in std_of_translation(p, s)),
}, tolerance=1e-8)
def std_of_translation(p: FloatArray, sigma: float) -> tuple[float, float]:
    """By (2.10)."""
    return _across(p, sigma, lambda r2, spread: (1 + r2 / spread) ** 0.5)


def _outliers() -> Arguments:
    rng, cases = np.random.default_rng(5), {}
    p = rng.uniform((-4.0, -3.0), (4.0, 3.0), (10, 2))
    for metres in 2.0, 20.0, 0.1:
        q = apply(transform(0.35, 0.10, 0.5), p) + rng.normal(0.0, 0.02, p.shape)
        q[4] += (metres, 0.0)
        cases[f"an outlier {metres:g} m off"] = (p, q, 0.05)
    return cases


def _again(p: FloatArray, q: FloatArray, weigh: Any, rounds: int = 20, move: Any = apply) -> Any:
    weights = np.ones(len(p))
    for _ in range(rounds):
        T = align(p, q, weights)
        weights = weigh(np.hypot(*(move(T, p) - q).T))
    return T


@exercise("Weigh by the residual, again and again", _outliers, {
    "This is least squares: the weights never reach `labkit.align`.": lambda p, q, d: align(p, q),
    "The weight is δ/r for small residuals, too, above 1; Huber's weight is 1 up to δ.":
        lambda p, q, d: _again(p, q, lambda r: d / r),
    "The weight is (δ/r)²: that is no longer Huber's loss, and not convex.":
        lambda p, q, d: _again(p, q, lambda r: huber_weights(r, d) ** 2),
    "The weight is the root of δ/r; it is δ/r itself.":
        lambda p, q, d: _again(p, q, lambda r: huber_weights(r, d) ** 0.5),
    "The residuals are squared before they meet δ; both are lengths in metres.":
        lambda p, q, d: _again(p, q, lambda r: huber_weights(r**2, d)),
    "The residuals are those of the *unmoved* points: apply T to p first.":
        lambda p, q, d: _again(p, q, lambda r: huber_weights(r, d), move=lambda T, p: p),
    "Pairs beyond δ weigh nothing: that is a gate. Huber's weight falls as δ/r.":
        lambda p, q, d: _again(p, q, lambda r: (r <= d) + 1e-12),
    "The weights are used once; asked for are twenty rounds.":
        lambda p, q, d: _again(p, q, lambda r: huber_weights(r, d), rounds=2),
    "The arguments of `huber_weights` are exchanged: first the residuals, then δ.":
        lambda p, q, d: _again(p, q, lambda r: np.minimum(1.0, r / d)),
    "The weights are upside down: the farther a pair, the more it counts.":
        lambda p, q, d: _again(p, q, lambda r: np.maximum(r, d) / d),
    "p and q are swapped: this maps the target onto the source.":
        lambda p, q, d: align_robustly(q, p, d),
})
def align_robustly(p: FloatArray, q: FloatArray, delta: float) -> FloatArray:
    """Twenty rounds of reweighing."""
    return np.asarray(_again(p, q, lambda r: huber_weights(r, delta)))
