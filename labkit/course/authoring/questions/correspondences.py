"""Correspondences: neighbours, gate, overlap, weights and their quality."""

from __future__ import annotations

from typing import Any

import numpy as np

from labkit import correspondences
from labkit.correspondences import huber_loss
from labkit.course.authoring.entries import Draw, Exact, Rng, question, recipe
from labkit.course.exercises.entries import Arguments
from labkit.grading.box.inside.data import Value
from labkit.grading.questions import Answer
from labkit.neighbors import NearestNeighbors
from labkit.support.arrays import FloatArray

ROOT_MEAN_SQUARE = "np.sqrt(np.mean(distances[kept] ** 2))"


def _distances(rng: Rng, count: int, low: float, high: float) -> Value:
    """Distinct distances in no order."""
    return np.round(rng.permutation(np.linspace(low, high, count)), 3)


@recipe
def _on_the_gate(rng: Rng, *shares: float) -> Arguments:
    """Distances that are such shares of the gate, one of them the gate itself."""
    gate = float(rng.choice([0.25, 0.75, 1.5]))
    return gate * rng.permutation([*shares, 1.0]), gate


def _trimmed(count: int, ratio: float) -> Draw:
    return lambda rng: (_distances(rng, count, 0.02, rng.number(0.8, 2.0)), ratio)


def _weighed(count: int, low: float, high: float, delta: float) -> Draw:
    return lambda rng: (np.round(rng.uniform(low, high, count), 3), delta)


@recipe
def _kept(rng: Rng, count: int, share: float, distances: bool = True) -> Arguments:
    kept = rng.permutation(np.arange(count) < round(share * count))
    return (np.round(rng.uniform(0.05, 0.8, count), 3), kept) if distances else (kept,)


def _nearest_each_once(p: FloatArray, q: FloatArray) -> Any:
    """The wrong search that takes a target point away from all later source points."""
    distances = np.linalg.norm(p[:, None] - q, axis=2)
    indices, lengths = [], []
    for row in distances:
        nearest = row.argmin()
        indices.append(nearest)
        lengths.append(row.min())
        distances[:, nearest] = np.inf
    return np.array(indices), np.array(lengths)


# fmt: off
@question("Nearest neighbours", points=5, answer=Answer.MATCHES, unit="m",
    chapter="chapter 3, “The nearest point”",
    task=r"""
Find for each source point the nearest target point. Comparing all with all is good enough here.
""", oracle=lambda p, q: NearestNeighbors(q).query(p), visible={
    "three points and four": (
        np.array([[0.0, 0.1], [2.0, 2.5], [0.4, 0.3]]),
        np.array([[2.0, 2.0], [5.0, 5.0], [0.0, 0.0], [-1.0, 3.0]])),
    "three points that share two": (
        np.array([[0.0, 0.5], [0.0, -0.25], [3.0, 2.0]]),
        np.array([[4.0, 2.0], [0.0, 0.0]])),
    "points given as whole numbers": lambda rng: (rng.whole_points(4), rng.whole_points(5)),
}, hidden={
    "more target points than source points": lambda rng: (rng.points(10), rng.points(25)),
    "more source points than target points": lambda rng: (rng.points(25), rng.points(6)),
    "as many of both": lambda rng: (rng.points(12), rng.points(12)),
    "points given as whole numbers": lambda rng: (rng.whole_points(6), rng.whole_points(9)),
}, mistakes={
    "swapped": ("This is the nearest source point of each target point: turn it round.",
        lambda p, q: nearest_neighbors(q, p)),
    "each_once": ("A target point is taken once at most; several source points may share one.",
        _nearest_each_once),
    "farthest": ("These are the farthest target points, not the nearest.",
        {"argmin": "argmax"}),
    "manhattan": ("These are sums of |Δx| and |Δy|; a distance is the root of squares.",
        {"np.sqrt((offsets**2).sum(axis=2))": "np.abs(offsets).sum(axis=2)"}),
})
def nearest_neighbors(source, target):
    """Nearest target point of each source point.

    source, target: arrays (N, 2) and (M, 2), in metres.
    Returns (indices, distances), arrays (N,): the row of the nearest target point,
    counted from 0, and how far it is in metres.

    >>> print(*nearest_neighbors(np.array([[1.5, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0]])))
    [1] [0.5]
    """
    offsets = source[:, None, :] - target[None, :, :]
    distances = np.sqrt((offsets**2).sum(axis=2))
    indices = distances.argmin(axis=1)
    return indices, distances[np.arange(len(source)), indices]


@question("The distance gate", points=4, answer=Answer.MASK,
    chapter="chapter 3, “Which pairs to trust”",
    task=r"""
Reject the pairs that are farther apart than the gate $d_{\max}$. A pair right on the gate stays.
""", oracle=correspondences.distance_gate, visible={
    "five pairs, one of them on the gate": Exact(
        (np.array([0.125, 0.75, 0.5, 0.625, 0.25]), 0.5)),
    "a wide gate": (np.array([3.5, 1.7, 0.4, 2.2]), 2.0),
    "distances given as whole numbers": Exact((np.array([9, 1, 2, 5, 4, 3, 0]), 2)),
    "a pair a little beyond the gate": Exact((np.array([0.5005, 0.25, 0.5]), 0.5)),
}, hidden={
    "a wide gate": {
        "a wide gate": lambda rng: (_distances(rng, 12, 0.2, 6.0), rng.number(1.7, 2.2)),
    },
    "a narrow gate": {
        "a gate that nothing passes":
            lambda rng: (_distances(rng, 6, 0.6, 2.0), rng.number(0.2, 0.35)),
        "a gate that some pass": lambda rng: (_distances(rng, 12, 0.05, 1.0), rng.number(0.4, 0.6)),
    },
    "the gate itself": {
        "a pair a little beyond the gate": Exact((np.array([1.2, 0.75, 0.7504, 0.1]), 0.75)),
        "a pair on the gate": Exact(_on_the_gate(0.25, 0.5, 2.0, 3.0)),
        "a gate that one pair reaches": Exact(_on_the_gate(1.5, 2.0, 4.0)),
        "a gate that all pass": Exact(_on_the_gate(0.125, 0.5, 0.75)),
        "distances given as whole numbers": Exact(
            lambda rng: (rng.permutation(8).astype(np.int64), int(rng.choice([3, 4])))),
    },
}, mistakes={
    "squared_distance": ("The squared distance is held against the gate: both are in metres.",
        lambda d, gate: d**2 <= gate),
    "squared_gate": ("The distance is held against the squared gate: both are in metres.",
        lambda d, gate: d <= gate**2),
    "strict": ("A pair right on the gate is rejected: the gate is d <= d_max.",
        lambda d, gate: d < gate),
})
def distance_gate(distances, max_distance):
    """Which pairs lie within the gate.

    distances: array (N,), in metres.
    max_distance: float, the gate in metres.
    Returns a mask, an array (N,) of bool: True where the pair stays.

    >>> print(distance_gate(np.array([0.1, 0.7, 0.5]), 0.5))
    [ True False  True]
    """
    return distances <= max_distance


@question("Trimming to the overlap", points=5, answer=Answer.MASK,
    chapter="chapter 3, “Which pairs to trust”",
    task=r"""
Of $N$ pairs keep the $\lfloor\rho N\rfloor$ closest, but at least 3. The pairs come in no order.
""", oracle=correspondences.overlap, visible={
    "three quarters of ten": (
        np.array([0.31, 0.02, 0.9, 0.45, 0.11, 0.73, 0.2, 1.4, 0.64, 0.57]), 0.75),
    "all": (np.array([0.5, 0.1, 0.9]), 1.0),
    "at least three": (np.array([0.5, 0.1, 0.9, 0.2, 0.4, 0.7]), 0.3),
    "three quarters of nine": (
        np.array([0.8, 0.15, 0.5, 0.33, 1.2, 0.05, 0.61, 0.27, 0.94]), 0.75),
    "three quarters of eight": (np.array([0.7, 0.3, 1.1, 0.2, 0.9, 0.4, 0.6, 0.1]), 0.75),
    "two fifths of nine whole numbers": (np.array([5, 1, 4, 2, 3, 9, 7, 6, 8]), 0.4),
}, hidden={
    "the rounding": {
        "a share that is rounded down much": _trimmed(11, 0.7),
        "a share that is rounded down little": _trimmed(9, 0.6),
    },
    "the order": {
        "a share without remainder": _trimmed(16, 0.5),
        "distances given as whole numbers":
            lambda rng: (rng.permutation(15)[:9].astype(np.int64), 0.4),
    },
    "at least three": {
        "few pairs": _trimmed(5, 0.25),
    },
}, mistakes={
    "worst_kept": ("The worst pairs are kept: trimming keeps the closest ones.",
        {"np.argsort(distances)": "np.argsort(-distances)"}),
    "not_sorted": ("The first pairs are kept, in the order they came: sort them first.",
        {"kept[np.argsort(distances)[:count]]": "kept[:count]"}),
    "rounded_up": ("ρN is rounded up; the count is ⌊ρN⌋, rounded down.",
        {"int(overlap_ratio * len(distances))": "int(np.ceil(overlap_ratio * len(distances)))"}),
    "rounded": ("ρN is rounded to the nearest; the count is ⌊ρN⌋, rounded down.",
        {"int(overlap_ratio": "round(overlap_ratio"}),
    "one_too_many": ("One pair too many is kept: rank ⌊ρN⌋ counted from 0?",
        {"[:count]": "[:count + 1]"}),
    "one_too_few": ("One pair too few is kept: is the threshold itself excluded?",
        {"[:count]": "[:count - 1]"}),
    "no_minimum": ("Fewer than 3 pairs are kept where ρN is small: a step needs 3.",
        {"max(3, ": "max(0, "}),
    "quantile": ("A quantile interpolates between pairs and keeps ⌊ρ(N − 1)⌋ + 1 of them, "
        "not ⌊ρN⌋.", lambda d, ratio: d <= np.quantile(d, ratio)),
    "share_of_the_largest": ("ρ is taken of the largest distance; it is a share of the pairs.",
        lambda d, ratio: d <= ratio * d.max()),
    "ratio_as_distance": ("ρ is held against the distances; it is a share of the pairs.",
        lambda d, ratio: d <= ratio),
    "share_removed": ("ρ is taken as the share to remove; it is the share to keep.",
        {"int(overlap_ratio": "int((1 - overlap_ratio)"}),
    "indices": ("These are indices of the pairs that stay; asked for is a mask, one entry a "
        "pair.", lambda d, ratio: np.argsort(d)[:max(3, int(ratio * len(d)))]),
})
def overlap(distances, overlap_ratio):
    """Which pairs are among the closest.

    distances: array (N,), in metres, in no order.
    overlap_ratio: float, the share to keep, in (0, 1].
    Returns a mask, an array (N,) of bool: True where the pair stays.

    >>> print(overlap(np.array([0.1, 0.9, 0.2, 0.3]), 0.75))
    [ True False  True  True]
    """
    count = max(3, int(overlap_ratio * len(distances)))
    kept = np.zeros(len(distances), dtype=bool)
    kept[np.argsort(distances)[:count]] = True
    return kept


@question("Huber's weights", points=5, answer=Answer.VECTOR, low=0.0, high=1.0,
    chapter="chapter 3, “Which pairs to trust”",
    task=r"""
A pair with a residual up to $\delta$ counts fully, one beyond it less and less:
$w_i = 1$ for $r_i \le \delta$, and $w_i = \delta / r_i$ for $r_i > \delta$.
""", oracle=correspondences.huber_weights, visible={
    "five residuals, one of them zero": Exact((np.array([0.0, 0.125, 0.25, 0.375, 1.0]), 0.25)),
    "whole numbers": (np.array([1, 2, 4]), 2.0),
}, hidden={
    "to both sides of a narrow δ": {
        "residuals to both sides of δ": _weighed(10, 0.0, 0.8, 0.15),
        "residuals below δ": _weighed(6, 0.01, 0.2, 0.25),
    },
    "to both sides of a wide δ": {
        "a δ above one metre": _weighed(10, 0.0, 6.0, 1.5),
        "residuals below a δ above one metre": _weighed(6, 0.1, 1.4, 1.5),
    },
    "beyond δ": {
        "residuals beyond δ": _weighed(6, 0.3, 3.0, 0.1),
        "residuals beyond a δ above one metre": _weighed(6, 1.6, 6.0, 1.5),
    },
    "whole numbers": {
        "residuals given as whole numbers":
            lambda rng: (4 + rng.permutation(12)[:7].astype(np.int64), 3.0),
    },
}, mistakes={
    "squared": ("The residuals are squared before they meet δ: both are distances in metres.",
        lambda r, delta: huber_weights(r**2, delta)),
    "uncapped": ("The weight is δ/r everywhere; up to δ it is 1, or close pairs count too much.",
        lambda r, delta: delta / r),
    "cut": ("Pairs beyond δ weigh nothing here: that is a gate. Huber's weight falls as δ/r.",
        lambda r, delta: np.where(r <= delta, 1.0, 0.0)),
    "branches_swapped": ("The branches are swapped: 1 belongs up to δ, δ/r beyond.",
        lambda r, delta: np.where(r > delta, 1.0, delta / r)),
    "loss": ("This is Huber's loss; asked for are the weights that go with it.", huber_loss),
    "cauchy": ("This is Cauchy's weight; Huber's is 1 up to δ, and δ/r beyond.",
        lambda r, delta: 1 / (1 + (r / delta) ** 2)),
    "whole_numbers": ("`np.ones_like` of whole numbers holds whole numbers, so δ/r is cut off "
        "to 0: ask for `dtype=float`.",
        {"return delta / np.maximum(residuals, delta)":
         "weights = np.ones_like(residuals)\n    weights[residuals > delta] = "
         "delta / residuals[residuals > delta]\n    return weights"}),
})
def huber_weights(residuals, delta):
    """Huber's weight of each residual.

    residuals: array (N,), distances in metres, not squared; whole numbers are possible.
    delta: float, where the weight begins to fall, in metres.
    Returns an array (N,).

    >>> print(huber_weights(np.array([0.1, 0.2, 0.8]), 0.2))
    [1.   1.   0.25]
    """
    return delta / np.maximum(residuals, delta)


@question("The inlier RMSE", points=3, answer=Answer.NUMBER, unit="m", low=0.0,
    chapter="chapter 8, “Three questions”",
    task=r"""
Say how well the kept pairs agree: the root of their mean squared distance. Where no pair is kept
there is no such number; return `nan`, and not a 0 that looks like a perfect match.
""", oracle=lambda d, kept: np.linalg.norm(d[kept]) / np.sqrt(kept.sum()), visible={
    "two of three pairs": (np.array([0.3, 5.0, 0.4]), np.array([True, False, True])),
    "no pair left": (np.array([0.3, 0.4]), np.array([False, False])),
    "four of five pairs": (
        np.array([0.1, 0.2, 0.25, 7.0, 0.6]), np.array([True, True, True, False, True])),
}, hidden={
    "most pairs kept": {
        "most pairs kept": _kept(10, 0.7),
    },
    "few pairs kept": {
        "few pairs kept": _kept(20, 0.2),
    },
    "all and none": {
        "all pairs kept": _kept(6, 1.0),
        "no pair kept": _kept(7, 0.0),
    },
}, mistakes={
    "over_all": ("This is the RMSE over all pairs; asked for is that over the kept ones.",
        lambda d, kept: np.sqrt(np.mean(d**2))),
    "divided_by_all": ("The squares of the kept pairs are divided by the number of all pairs.",
        lambda d, kept: np.sqrt(np.sum(d[kept] ** 2) / len(d))),
    "mean": ("This is the mean distance; the RMSE is the root of the mean square.",
        {ROOT_MEAN_SQUARE: "np.mean(distances[kept])"}),
    "no_mean": ("The sum of squares is not divided by the number of kept pairs.",
        {ROOT_MEAN_SQUARE: "np.sqrt(np.sum(distances[kept] ** 2))"}),
    "spread": ("This is the standard deviation: it subtracts the mean, the RMSE does not.",
        {ROOT_MEAN_SQUARE: "np.std(distances[kept])"}),
    "one_less": ("The mean square is divided by one less than the number of kept pairs.",
        {ROOT_MEAN_SQUARE: "np.sqrt(np.sum(distances[kept] ** 2) / (kept.sum() - 1))"}),
    "zero_for_none": ("Where no pair is left this is 0, as of a perfect match: return NaN.",
        {"return np.nan": "return 0.0"}),
})
def inlier_rmse(distances, kept):
    """Root mean square distance of the kept pairs.

    distances: array (N,), in metres.
    kept: array (N,) of bool, True for the pairs that count.
    Returns a float in metres; nan where no pair is kept.

    >>> print(np.round(inlier_rmse(np.array([3.0, 50.0, 4.0]), np.array([True, False, True])), 2))
    3.54
    """
    if not kept.any():
        return np.nan
    return np.sqrt(np.mean(distances[kept] ** 2))


@question("The fitness", points=2, answer=Answer.NUMBER, low=0.0, high=1.0,
    chapter="chapter 8, “Three questions”",
    task=r"""
Say how much of the scan found a partner: the share of the source points whose pair is kept. An RMSE
alone says little, since it gets better the fewer pairs are left.
""", oracle=lambda kept: np.count_nonzero(kept) / len(kept), visible={
    "three of four": (np.array([True, False, True, True]),),
}, hidden={
    "most pairs kept": {
        "most pairs kept": _kept(11, 0.7, distances=False),
    },
    "few and all": {
        "few pairs kept": _kept(23, 0.2, distances=False),
        "all pairs kept": _kept(6, 1.0, distances=False),
    },
}, mistakes={
    "rejected": ("This is the share of the pairs that are rejected.", lambda kept: 1 - kept.mean()),
})
def fitness(kept):
    """Share of the source points whose pair is kept.

    kept: array (N,) of bool, one entry for each source point, True where its pair is kept.
    Returns a float in [0, 1].

    >>> print(fitness(np.array([True, False, True, True])))
    0.75
    """
    return kept.mean()
