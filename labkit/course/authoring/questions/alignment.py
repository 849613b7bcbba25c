"""Alignment of given pairs: exact and noisy ones, wide turns, outliers, mirror images."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.course.authoring.entries import Rng, question, recipe
from labkit.course.authoring.questions.se2 import rotation
from labkit.course.exercises.entries import Arguments
from labkit.grading.questions import Answer
from labkit.support.arrays import FloatArray

LEFT, RIGHT, WIDE, BACK = (0.3, 1.2), (-1.2, -0.3), (1.8, 2.8), (-2.8, -1.8)
TRIANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])

TRANSLATION = "chapter 2, “The best translation”"
NOT_TURNED = "The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R p̄."
PROPER = "Vt.T @ np.diag([1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T"
CHANGED_SIGNS = "np.array([[1, -1], [-1, 1]]) * Vt"  # the SVD may choose them


@recipe
def _pairs(
    rng: Rng,
    count: int,
    turn: tuple[float, float],
    noise: float = 0.02,
    away: float = 0.0,
    mirrored: bool = False,
) -> Arguments:
    """Points `away` from the origin and, with noise [m], the same after a motion."""
    p = rng.points(count) * (1.0, 0.4 if mirrored else 1.0) + away
    q = labkit.apply(rng.motion(turn), p * (1.0, -1.0 if mirrored else 1.0))
    return p, np.round(q + rng.normal(0.0, noise, p.shape), 3)


def _whole(rng: Rng) -> Arguments:
    """Whole coordinates after a quarter turn and a whole step, one of them a metre off."""
    p = np.asarray(rng.whole_points(6))
    q = np.column_stack([-p[:, 1], p[:, 0]]) + rng.integers(-5, 6, 2)
    q[rng.integers(6), 0] += 1
    return p, q


@recipe
def _weighted(
    rng: Rng, draw: Any, low: float, high: float, outliers: int = 1, whole: bool = False
) -> Arguments:
    """Pairs with weights; the first `outliers` of them are wrong."""
    p, q = draw(rng)
    w = np.round(rng.uniform(low, high, len(p)), 2)
    w[:outliers] = np.round(low / 4.0, 2)
    q[:outliers] += rng.choice([-3, 2, 3], (outliers, 2))
    return p, q, np.maximum(w, 1).astype(np.int64) if whole else w


@recipe
def _translation(rng: Rng, count: int, turn: tuple[float, float]) -> Arguments:
    p = rng.points(count) + 1.0
    T = rng.motion(turn)
    return T[:2, :2], p, np.round(labkit.apply(T, p) + rng.normal(0.0, 0.05, p.shape), 3)


def _turned(angle: float) -> FloatArray:
    return np.round(labkit.apply(labkit.transform(1.0, 2.0, angle), TRIANGLE), 12)


def _by_least_squares(R: FloatArray, p: FloatArray, q: FloatArray) -> FloatArray:
    """By numpy over all coordinates at once."""
    coefficients = np.tile(np.eye(2), (len(p), 1))
    differences = q - p @ R.T
    t, *_ = np.linalg.lstsq(coefficients, differences.ravel())
    return t


# fmt: off
@question("The best translation", points=3, answer=Answer.VECTOR, unit="m",
    chapter="chapter 2, “The best translation”",
    task=r"""
For a rotation that is given, find the $\mathbf{t}^\star$ that minimises
$\sum_i \lVert\mathbf{R}\,\mathbf{p}_i + \mathbf{t} - \mathbf{q}_i\rVert^2$.
""", oracle=_by_least_squares, visible={
    "no turn": (np.eye(2), TRIANGLE, TRIANGLE + np.array([1.0, 2.0])),
    "a quarter turn": (rotation(math.pi / 2), TRIANGLE, _turned(math.pi / 2)),
    "noisy pairs": _translation(6, LEFT),
    "points given as whole numbers": lambda rng: (np.array([[0, 1], [-1, 0]]), *_whole(rng)),
}, hidden={
    "a turn to the left": _translation(5, LEFT),
    "a turn to the right": _translation(8, RIGHT),
    "more than a right angle": _translation(12, WIDE),
    "points given as whole numbers": lambda rng: (np.array([[0, -1], [1, 0]]), *_whole(rng)),
}, mistakes={
    "not_turned": ("The rotation is left out: the centroid p̄ has to be turned, t = q̄ − R p̄.",
        lambda R, p, q: q.mean(axis=0) - p.mean(axis=0)),
    "way_back": ("This is the translation of the inverse motion: it leads from target to source.",
        lambda R, p, q: p.mean(axis=0) - R.T @ q.mean(axis=0)),
    "difference_turned": ("The difference of the centroids is turned as one; turn p̄ alone.",
        lambda R, p, q: R @ (q.mean(axis=0) - p.mean(axis=0))),
    "turned_back": ("The centroid p̄ is turned by Rᵀ; it is t = q̄ − R p̄.",
        {"R @ source": "R.T @ source"}),
    "exchanged": ("Source and target are exchanged: it is t = q̄ − R p̄.",
        lambda R, p, q: p.mean(axis=0) - R @ q.mean(axis=0)),
    "first_pair": ("This is the translation of the first pair alone; take the mean of all.",
        lambda R, p, q: q[0] - R @ p[0]),
    "median": ("This is the median of the differences; the sum of squares is least at their mean.",
        lambda R, p, q: np.median(q - p @ R.T, axis=0)),
})
def best_translation(R, source, target):
    """Best translation for a fixed rotation.

    R: array (2, 2), a rotation.
    source, target: arrays (N, 2), pairs: row i of one belongs to row i of the other.
    Returns t, an array (2,) in metres.

    >>> print(best_translation(np.eye(2), np.array([[0, 0], [2, 0]]), np.array([[1, 1], [3, 1]])))
    [1. 1.]
    """
    return target.mean(axis=0) - R @ source.mean(axis=0)


@question("Alignment in closed form", points=6, answer=Answer.TRANSFORM,
    chapter="chapter 2, “In the plane: one `atan2`”",
    task=r"""
Find the rotation and the translation that together minimise
$\sum_i \lVert\mathbf{R}\,\mathbf{p}_i + \mathbf{t} - \mathbf{q}_i\rVert^2$. In the plane the angle
is one $\operatorname{\text{atan2}}(b, a)$ of two sums over the centred points. Any turn is
possible, also one beyond a right angle.
""", oracle=labkit.align, visible={
    "a triangle after a wide turn": (TRIANGLE, _turned(2.0)),
    "noisy pairs": _pairs(6, LEFT),
    "noisy pairs after a turn to the right": _pairs(5, RIGHT),
    "points given as whole numbers": _whole,
}, hidden={
    "noisy pairs": _pairs(20, RIGHT, noise=0.05),
    "more than a right angle to the left": _pairs(10, WIDE),
    "more than a right angle to the right": _pairs(10, BACK),
    "points far from the origin": _pairs(8, LEFT, away=15.0),
    "points given as whole numbers": _whole,
    "two pairs": _pairs(2, LEFT),
}, mistakes={
    "sign_of_b": ("The angle has the wrong sign: b = Σ (x v − y u), (x, y) of the source.",
        {"np.arctan2(b,": "np.arctan2(-b,"}),
    "arctan_of_ratio": ("arctan(b / a) cannot tell (a, b) from (−a, −b): take arctan2.",
        {"np.arctan2(b, (x * y).sum())": "np.arctan(b / (x * y).sum())"}),
    "sign_lost": ("The angle has lost its sign, as `arccos` loses it: turns to the right go wrong.",
        {"np.arctan2(b, (x * y).sum())": "abs(np.arctan2(b, (x * y).sum()))"}),
    "arctan2_swapped": ("The arguments of arctan2 are swapped: it takes b first, then a.",
        {"np.arctan2(b, (x * y).sum())": "np.arctan2((x * y).sum(), b)"}),
    "not_centred": ("The points are not centred: a and b sum the points less centroids.",
        {"x, y = source - p_mean, target - q_mean": "x, y = source, target"}),
    "centroid_not_turned": (NOT_TURNED,
        {"q_mean - R @ p_mean": "q_mean - p_mean"}, TRANSLATION),
})
def align(source, target):
    """Best rigid motion of pairs, all of which count alike.

    source, target: arrays (N, 2), pairs: row i of one belongs to row i of the other.
    Returns (R, t), arrays (2, 2) and (2,), or one (3, 3); it maps source onto target.

    >>> R, t = align(np.array([[0, 0], [1, 0]]), np.array([[2, 3], [2, 4]]))
    >>> print(np.round(t, 2))
    [2. 3.]
    """
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    x, y = source - p_mean, target - q_mean
    b = (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()
    R = rotation(np.arctan2(b, (x * y).sum()))
    return R, q_mean - R @ p_mean


@question("Alignment with weights", points=6, answer=Answer.TRANSFORM,
    chapter="chapter 2, “Weights, and one outlier”",
    task=r"""
The same with a weight for each pair: minimise
$\sum_i w_i \lVert\mathbf{R}\,\mathbf{p}_i + \mathbf{t} - \mathbf{q}_i\rVert^2$. The weights need
not sum up to one; some may be zero.
""", oracle=labkit.align, visible={
    "a wrong pair without weight": (
        np.vstack([TRIANGLE, [[3.0, 3.0]]]),
        np.vstack([_turned(2.0), [[9.0, 9.0]]]),
        np.array([1.0, 1.0, 1.0, 0.0])),
    "a wrong pair with a small weight": _weighted(_pairs(6, LEFT), 0.4, 1.0),
    "weights above one, and a turn to the right": _weighted(_pairs(6, RIGHT), 4.0, 30.0),
    "whole numbers": _weighted(_whole, 4.0, 9.0, whole=True),
}, hidden={
    "weights below one": _weighted(_pairs(10, LEFT), 0.4, 1.0),
    "weights above one": _weighted(_pairs(10, RIGHT), 4.0, 30.0),
    "wrong pairs without weight": _weighted(_pairs(12, LEFT), 0.0, 1.0, 3),
    "a wide turn": _weighted(_pairs(8, WIDE), 0.4, 1.0),
    "whole numbers": _weighted(_whole, 4.0, 9.0, whole=True),
}, mistakes={
    "weights_squared": ("The weights are squared; each pair counts with w itself.",
        lambda p, q, w: align_weighted(p, q, w**2)),
    "unweighted": ("The weights have no effect: centroids and sums need them.",
        lambda p, q, w: align_weighted(p, q, np.ones(len(p)))),
    "centroids_unweighted": ("The centroids are plain means: they need the weights, too.",
        {"weights @ source / weights.sum()": "source.mean(axis=0)",
         "weights @ target / weights.sum()": "target.mean(axis=0)"}),
    "sums_unweighted": ("The centroids are weighted, but the sums for the rotation are not.",
        {"weights @ (x": "np.ones(len(x)) @ (x"}),
    "sign_of_b": ("The angle has the wrong sign: b = Σ w (x v − y u), (x, y) the source.",
        {"np.arctan2(b,": "np.arctan2(-b,"}),
    "not_normalised": ("The weighted sums are taken for means: divide Σ w p and Σ w q by Σ w.",
        {" / weights.sum()": ""}),
})
def align_weighted(source, target, weights):
    """Best rigid motion of weighted pairs.

    source, target: arrays (N, 2), pairs: row i of one belongs to row i of the other.
    weights: array (N,), not negative.
    Returns (R, t), arrays (2, 2) and (2,), or one (3, 3); it maps source onto target.

    >>> p, q = np.array([[0, 0], [1, 0], [5, 5]]), np.array([[2, 3], [2, 4], [0, 0]])
    >>> R, t = align_weighted(p, q, np.array([1, 1, 0]))
    >>> print(np.round(t, 2))
    [2. 3.]
    """
    p_mean = weights @ source / weights.sum()
    q_mean = weights @ target / weights.sum()
    x, y = source - p_mean, target - q_mean
    a = weights @ (x * y).sum(axis=1)
    b = weights @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


@question("Alignment by the SVD", points=6, answer=Answer.TRANSFORM,
    chapter="chapter 2, “In any dimension: the singular value decomposition”",
    task=r"""
The same motion from the singular values of the cross-covariance
$\mathbf{H} = \sum_i \mathbf{x}_i\mathbf{y}_i^\top$. The target may be a mirror image of the source.
The answer is to be a rotation all the same: the best one there is.
""", oracle=labkit.align_svd, visible={
    "noisy pairs": _pairs(6, LEFT),
    "a mirror image": (
        np.array([[3.0, 0.0], [-3.0, 0.5], [1.0, 1.0], [-2.0, -1.0]]),
        np.array([[3.0, 0.0], [-3.0, -0.5], [1.0, -1.0], [-2.0, 1.0]])),
    "whole numbers": _whole,
}, hidden={
    "a wide turn": _pairs(8, BACK),
    "mirror images": {
        "a mirror image, turned to the left": _pairs(10, LEFT, mirrored=True),
        "a mirror image after a wide turn": _pairs(10, WIDE, mirrored=True),
    },
    "whole numbers": _whole,
}, mistakes={
    "reflection_kept": ("A mirror image yields a reflection: correct the determinant of V Uᵀ "
        "(`np.linalg.svd` returns Vᵀ).",
        [{PROPER: f"{V} @ U.T"} for V in ("Vt.T", "Vt", CHANGED_SIGNS)],
        "chapter 2, “What the determinant is for”"),
    "transposed": ("This is R transposed: U and V, or the two factors of H, are swapped.",
        [{"svd(H)": "svd(H.T)"}, {PROPER: "U @ Vt"}]),
    "v_transposed": ("`np.linalg.svd` returns V transposed; R = V diag(1, s) Uᵀ needs V.",
        [{"R = Vt.T @": "R = Vt @"}, {"R = Vt.T @": f"R = {CHANGED_SIGNS} @"}]),
    "all_signs": ("Where the determinant is −1, −R has it, too, in the plane: change the sign of "
        "V's last column alone.",
        {PROPER: "np.linalg.det(Vt.T @ U.T) * Vt.T @ U.T"},
        "chapter 2, “What the determinant is for”"),
    "first_sign": ("The determinant turns the first singular vector; it belongs to the last, that "
        "of the smallest singular value.",
        {"[1.0, np.linalg.det(Vt.T @ U.T)]": "[np.linalg.det(Vt.T @ U.T), 1.0]"},
        "chapter 2, “What the determinant is for”"),
    "not_centred": ("The points are not centred: H sums the points less their centroids.",
        {"(source - p_mean).T @ (target - q_mean)": "source.T @ target"}),
    "centroid_not_turned": (NOT_TURNED,
        {"q_mean - R @ p_mean": "q_mean - p_mean"}, TRANSLATION),
})
def align_svd(source, target):
    """Best rigid motion of pairs, by the singular value decomposition.

    source, target: arrays (N, 2), pairs: row i of one belongs to row i of the other.
    Returns (R, t), arrays (2, 2) and (2,), or one (3, 3); the determinant of R is +1.

    >>> R, t = align_svd(np.array([[0, 0], [1, 0]]), np.array([[2, 3], [2, 4]]))
    >>> print(np.round(t, 2))
    [2. 3.]
    """
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    H = (source - p_mean).T @ (target - q_mean)
    U, _, Vt = np.linalg.svd(H)
    R = Vt.T @ np.diag([1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T
    return R, q_mean - R @ p_mean
