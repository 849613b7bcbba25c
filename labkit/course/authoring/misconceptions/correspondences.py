"""Mistakes with correspondences: neighbours, gate, overlap, weights and their quality."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistakes


def _squared(source, target):
    indices, distances = right.nearest_neighbors(source, target)
    return indices, distances**2


def _manhattan(source, target):
    all_distances = np.abs(source[:, None] - target[None]).sum(axis=2)
    return all_distances.argmin(axis=1), all_distances.min(axis=1)


def _used_once(source, target):
    free, indices = set(range(len(target))), []
    for p in source:
        candidates = sorted(free) or range(len(target))
        indices.append(min(candidates, key=lambda j: math.dist(p, target[j])))
        free.discard(indices[-1])
    return np.array(indices), np.linalg.norm(source - target[indices], axis=1)


def _from_one(source, target):
    indices, distances = right.nearest_neighbors(source, target)
    return indices + 1, distances


def _order_of_results(source, target):
    indices, distances = right.nearest_neighbors(source, target)
    return distances, indices


def _farthest(source, target):
    all_distances = np.linalg.norm(source[:, None] - target[None], axis=2)
    return all_distances.argmax(axis=1), all_distances.max(axis=1)


def _closest(distances, count):
    kept = np.zeros(len(distances), dtype=bool)
    kept[np.argsort(distances)[: min(count, len(distances))]] = True
    return kept


def _other_minimum(distances, overlap_ratio):
    count = int(overlap_ratio * len(distances))
    return Several(tuple(_closest(distances, max(least, count)) for least in (2, 4)))


def _loss(residuals, delta):
    capped = np.minimum(residuals, delta)
    return capped * (2.0 * residuals - capped)


def _whole_numbers(residuals, delta):
    weights = np.ones_like(residuals)
    far = residuals > delta
    weights[far] = (delta / np.maximum(residuals, 1e-12))[far]
    return weights


# fmt: off
mistakes("nearest_neighbors", {
    "squared": (0.7,
        "The distances are squared; gates and weights are in metres, so take the root.",
        _squared),
    "swapped": (0.4,
        "This finds the nearest source point of each target point: it is to be the other way.",
        lambda source, target: right.nearest_neighbors(target, source)),
    "manhattan": (0.4,
        "These are sums of |Δx| and |Δy|; the distance is the root of the sum of squares.",
        _manhattan),
    "used_once": (0.4,
        "Every target point is given away once; several source points may share their nearest.",
        _used_once),
    "from_one": (0.8, "The indices count from 1; Python's rows count from 0.",
        _from_one),
    "order_of_results": (0.8,
        "The two results are in the wrong order: first the indices, then the distances.",
        _order_of_results),
    "farthest": (0.1, "These are the farthest points: take the smallest distance, not the largest.",
        _farthest),
})
mistakes("distance_gate", {
    "squared_distance": (0.6, "The squared distance is held against the gate: both are in metres.",
        lambda distances, max_distance: distances ** 2 <= max_distance),
    "squared_gate": (0.5, "The distance is held against the squared gate: both are in metres.",
        lambda distances, max_distance: distances <= max_distance ** 2),
    "strict": (0.05, "A pair right on the gate is rejected: the gate is d <= d_max.",
        lambda distances, max_distance: distances < max_distance),
    "inverted": (0.4,
        "The mask is True for the pairs to reject; it is to be True for those that stay.",
        lambda distances, max_distance: distances > max_distance),
    "indices": (0.7,
        "These are the indices of the pairs that stay; asked for is a mask, one entry a pair.",
        lambda distances, max_distance: np.flatnonzero(distances <= max_distance)),
    "distances": (0.4, "These are the distances that stay; asked for is a mask, one entry a pair.",
        lambda distances, max_distance: distances[distances <= max_distance]),
    "relative": (0.3,
        "The gate is taken as a share of the largest distance; it is a distance in metres.",
        lambda distances, max_distance: distances <= max_distance * distances.max()),
})
mistakes("overlap", {
    "worst_kept": (0.3, "The worst pairs are kept: trimming keeps the closest ones.",
        lambda distances, overlap_ratio: right.overlap(-distances, overlap_ratio)),
    "not_sorted": (0.3,
        "The first pairs are kept, in the order they came: they have to be sorted first.",
        lambda distances, overlap_ratio: right.overlap(np.arange(len(distances)), overlap_ratio)),
    "rounded_up": (0.7, "ρN is rounded up; the count is ⌊ρN⌋, rounded down.",
        lambda distances, overlap_ratio: _closest(distances, max(3, math.ceil(overlap_ratio *
            len(distances))))),
    "rounded": (0.7, "ρN is rounded to the nearest; the count is ⌊ρN⌋, rounded down.",
        lambda distances, overlap_ratio: _closest(distances, max(3, round(overlap_ratio *
            len(distances))))),
    "one_too_many": (0.7,
        "One pair too many is kept: an off-by-one in ⌊ρN⌋ (rank ⌊ρN⌋ counted from 0?).",
        lambda distances, overlap_ratio: _closest(distances, max(3, int(overlap_ratio *
            len(distances))) + 1)),
    "one_too_few": (0.7,
        "One pair too few is kept: an off-by-one in ⌊ρN⌋ (is the threshold itself excluded?).",
        lambda distances, overlap_ratio: _closest(distances, max(3, int(overlap_ratio *
            len(distances))) - 1)),
    "no_minimum": (0.85,
        "Fewer than 3 pairs are kept where ρN is small: keep at least 3, as a step needs them.",
        lambda distances, overlap_ratio: _closest(distances, int(overlap_ratio * len(distances)))),
    "share_of_range": (0.7,
        "ρ is taken as a share of the largest distance; it is a share of the number of pairs.",
        lambda distances, overlap_ratio: distances <= overlap_ratio * distances.max()),
    "quantile": (0.7,
        "A quantile interpolates between pairs and keeps ⌊ρ(N − 1)⌋ + 1 of them, not ⌊ρN⌋.",
        lambda distances, overlap_ratio: distances <= np.quantile(distances, overlap_ratio)),
    "share_removed": (0.4, "ρ is taken as the share to remove; it is the share to keep.",
        lambda distances, overlap_ratio: right.overlap(distances, 1.0 - overlap_ratio)),
    "indices": (0.7,
        "These are indices of the pairs that stay; asked for is a mask, one entry a pair.",
        lambda distances, overlap_ratio: np.argsort(distances)[:max(3, int(overlap_ratio *
            len(distances)))]),
    "inverted": (0.4,
        "The mask is True for the pairs to reject; it is to be True for those that stay.",
        lambda distances, overlap_ratio: ~right.overlap(distances, overlap_ratio)),
    "other_minimum": (0.85,
        "Another number of pairs than 3 is kept where ρN is small: keep at least 3.",
        _other_minimum),
})
mistakes("huber_weights", {
    "squared": (0.5, "The residuals are squared before they meet δ: both are distances in metres.",
        lambda residuals, delta: right.huber_weights(residuals ** 2, delta)),
    "uncapped": (0,
        "The weight is δ/r everywhere; up to δ it is 1, or close pairs count far too much.",
        lambda residuals, delta: delta / residuals),
    "cut": (0.5, "Pairs beyond δ weigh nothing here: that is a gate. Huber's weight falls as δ/r.",
        lambda residuals, delta: np.where(residuals <= delta, 1.0, 0.0)),
    "rooted": (0.5, "Beyond δ this is the square root of δ/r; the weight is δ/r itself.",
        lambda residuals, delta: np.sqrt(right.huber_weights(residuals, delta))),
    "ratio_squared": (0.5, "Beyond δ this is (δ/r)²; the weight is δ/r itself.",
        lambda residuals, delta: right.huber_weights(residuals, delta) ** 2),
    "upside_down": (0.4,
        "Beyond δ this is r/δ: the farther a pair, the more it counts. It should be δ/r.",
        lambda residuals, delta: np.maximum(residuals, delta) / delta),
    "branches_swapped": (0.4,
        "The branches are swapped: 1 belongs to residuals up to δ, δ/r to those beyond.",
        lambda residuals, delta: np.where(residuals > delta, 1.0, delta / residuals)),
    "loss": (0.3, "This is Huber's loss; asked for are the weights that go with it.",
        _loss),
    "half_loss": (0.3,
        "This is Huber's loss (halved, as in many books); asked for are the weights.",
        lambda residuals, delta: _loss(residuals, delta) / 2.0),
    "whole_numbers": (0.8,
        "`np.ones_like` of whole numbers holds whole numbers, so δ/r is cut off to 0: ask for "
        "`dtype=float`.",
        _whole_numbers),
    "over_square": (0.4, "Beyond δ this is δ/r²; the weight is δ/r.",
        lambda residuals, delta: np.where(residuals > delta, delta / np.maximum(residuals, 1e-12)
            ** 2.0, 1.0)),
})
mistakes("inlier_rmse", {
    "over_all": (0.4, "This is the RMSE over all pairs; asked for is that over the kept ones.",
        lambda distances, kept: np.sqrt(np.mean(distances ** 2))),
    "divided_by_all": (0.5, "The squares of the kept pairs are divided by the number of all pairs.",
        lambda distances, kept: np.sqrt(np.sum(distances[kept] ** 2) / len(distances))),
    "mean": (0.4, "This is the mean distance; the RMSE is the root of the mean square.",
        lambda distances, kept: distances[kept].mean() if kept.any() else np.nan),
    "no_root": (0.5, "The root is missing: this is the mean square, in m².",
        lambda distances, kept: np.mean(distances[kept] ** 2) if kept.any() else np.nan),
    "no_mean": (0.5, "The sum of squares is not divided by the number of kept pairs.",
        lambda distances, kept: np.sqrt(np.sum(distances[kept] ** 2)) if kept.any() else np.nan),
    "spread": (0.3,
        "This is the standard deviation: it subtracts the mean distance, the RMSE does not.",
        lambda distances, kept: np.std(distances[kept]) if kept.any() else np.nan),
    "zero_for_none": (0.8,
        "Where no pair is left this returns 0, which looks like a perfect match: return NaN.",
        lambda distances, kept: right.inlier_rmse(distances, kept) if kept.any() else 0.0),
})
mistakes("fitness", {
    "count": (0, "This is the number of pairs that are kept; asked for is their share.",
        np.count_nonzero),
    "percent": (0.5, "This is the share in percent; asked for is a number from 0 to 1.",
        lambda kept: 100.0 * np.mean(kept)),
    "rejected": (0.4,
        "This is the share of the pairs that are rejected; asked for is that of the kept ones.",
        lambda kept: 1.0 - np.mean(kept)),
})
