"""Mistakes with correspondences: neighbours, gate, overlap, weights and their quality."""

import math

import numpy as np

from labkit.correspondences import huber_loss
from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes


def _used_once(p, q):
    free, indices = set(range(len(q))), []
    for one in p:
        candidates = sorted(free) or range(len(q))
        indices.append(min(candidates, key=lambda j: math.dist(one, q[j])))
        free.discard(indices[-1])
    return np.array(indices), np.linalg.norm(p - q[indices], axis=1)


DISTANCES = "np.sqrt((offsets**2).sum(axis=2))"
ROOT_MEAN_SQUARE = "np.sqrt(np.mean(distances[kept] ** 2))"
INVERTED = (0.4, "The mask is True for the pairs to reject; it is to be True for those that stay.")

# fmt: off
mistakes("nearest_neighbors", {
    "squared": (0.7, "The distances are squared; gates and weights are in metres: take the root.",
        {DISTANCES: "(offsets**2).sum(axis=2)"}),
    "swapped": (0.4, "This is the nearest source point of each target point: turn it round.",
        lambda p, q: right.nearest_neighbors(q, p)),
    "manhattan": (0.4, "These are sums of |Δx| and |Δy|; a distance is the root of squares.",
        {DISTANCES: "np.abs(offsets).sum(axis=2)"}),
    "used_once": (0.4, "Every target point is given away once; several source points may share "
        "their nearest.", _used_once),
    "from_one": (0.8, "The indices count from 1; Python's rows count from 0.",
        {"return indices,": "return indices + 1,"}),
    "order_of_results": (0.8, "The results are in the wrong order: indices, then distances.",
        {"return indices, distances[np.arange(len(source)), indices]":
         "return distances[np.arange(len(source)), indices], indices"}),
    "farthest": (0.1, "These are the farthest points: take the smallest distance, not the largest.",
        {"argmin": "argmax"}),
})
mistakes("distance_gate", {
    "squared_distance": (0.6, "The squared distance is held against the gate: both are in metres.",
        lambda d, gate: d**2 <= gate),
    "squared_gate": (0.5, "The distance is held against the squared gate: both are in metres.",
        lambda d, gate: d <= gate**2),
    "strict": (0.05, "A pair right on the gate is rejected: the gate is d <= d_max.",
        lambda d, gate: d < gate),
    "inverted": (*INVERTED, lambda d, gate: d > gate),
    "indices": (0.7, "These are the indices of the pairs that stay; asked for is a mask, one entry "
        "a pair.", lambda d, gate: np.flatnonzero(d <= gate)),
    "distances": (0.4, "These are the distances that stay; asked for is a mask, one entry a pair.",
        lambda d, gate: d[d <= gate]),
    "relative": (0.3, "The gate is taken as a share of the largest distance; it is in metres.",
        lambda d, gate: d <= gate * d.max()),
})
mistakes("overlap", {
    "worst_kept": (0.3, "The worst pairs are kept: trimming keeps the closest ones.",
        {"np.argsort(distances)": "np.argsort(-distances)"}),
    "not_sorted": (0.3, "The first pairs are kept, in the order they came: sort them first.",
        {"kept[np.argsort(distances)[:count]]": "kept[:count]"}),
    "rounded_up": (0.7, "ρN is rounded up; the count is ⌊ρN⌋, rounded down.",
        {"int(overlap_ratio * len(distances))": "int(np.ceil(overlap_ratio * len(distances)))"}),
    "rounded": (0.7, "ρN is rounded to the nearest; the count is ⌊ρN⌋, rounded down.",
        {"int(overlap_ratio": "round(overlap_ratio"}),
    "one_too_many": (0.7, "One pair too many is kept: rank ⌊ρN⌋ counted from 0?",
        {"[:count]": "[:count + 1]"}),
    "one_too_few": (0.7, "One pair too few is kept: is the threshold itself excluded?",
        {"[:count]": "[:count - 1]"}),
    "no_minimum": (0.85, "Fewer than 3 pairs are kept where ρN is small: a step needs 3.",
        {"max(3, ": "max(0, "}),
    "share_of_range": (0.7, "ρ is taken as a share of the largest distance; it is of the pairs.",
        lambda d, ratio: d <= ratio * d.max()),
    "quantile": (0.7, "A quantile interpolates between pairs and keeps ⌊ρ(N − 1)⌋ + 1 of them, "
        "not ⌊ρN⌋.", lambda d, ratio: d <= np.quantile(d, ratio)),
    "share_removed": (0.4, "ρ is taken as the share to remove; it is the share to keep.",
        {"int(overlap_ratio": "int((1 - overlap_ratio)"}),
    "indices": (0.7, "These are indices of the pairs that stay; asked for is a mask, one entry a "
        "pair.", lambda d, ratio: np.argsort(d)[:max(3, int(ratio * len(d)))]),
    "inverted": (*INVERTED, {"return kept": "return ~kept"}),
    "other_minimum": (0.85, "Where ρN is small another number of pairs than 3 is kept.",
        [{"max(3, ": "max(2, "}, {"max(3, ": "max(4, "}]),
})
mistakes("huber_weights", {
    "squared": (0.5, "The residuals are squared before they meet δ: both are distances in metres.",
        lambda r, delta: right.huber_weights(r**2, delta)),
    "uncapped": (0, "The weight is δ/r everywhere; up to δ it is 1, or close pairs count too much.",
        lambda r, delta: delta / r),
    "cut": (0.5, "Pairs beyond δ weigh nothing here: that is a gate. Huber's weight falls as δ/r.",
        lambda r, delta: np.where(r <= delta, 1.0, 0.0)),
    "rooted": (0.5, "Beyond δ this is the square root of δ/r; the weight is δ/r itself.",
        lambda r, delta: np.sqrt(right.huber_weights(r, delta))),
    "ratio_squared": (0.5, "Beyond δ this is (δ/r)²; the weight is δ/r itself.",
        lambda r, delta: right.huber_weights(r, delta) ** 2),
    "upside_down": (0.4, "Beyond δ this is r/δ: the farther a pair, the more it counts. Take δ/r.",
        lambda r, delta: np.maximum(r, delta) / delta),
    "branches_swapped": (0.4, "The branches are swapped: 1 belongs up to δ, δ/r beyond.",
        lambda r, delta: np.where(r > delta, 1.0, delta / r)),
    "loss": (0.3, "This is Huber's loss; asked for are the weights that go with it.", huber_loss),
    "half_loss": (0.3, "This is Huber's loss, halved as in many books; asked for are weights.",
        lambda r, delta: huber_loss(r, delta) / 2.0),
    "whole_numbers": (0.8, "`np.ones_like` of whole numbers holds whole numbers, so δ/r is cut off "
        "to 0: ask for `dtype=float`.",
        {"return delta / np.maximum(residuals, delta)":
         "weights = np.ones_like(residuals)\n    weights[residuals > delta] = "
         "delta / residuals[residuals > delta]\n    return weights"}),
    "over_square": (0.4, "Beyond δ this is δ/r²; the weight is δ/r.",
        lambda r, delta: np.where(r > delta, delta / np.maximum(r, 1e-12) ** 2.0, 1.0)),
})
mistakes("inlier_rmse", {
    "over_all": (0.4, "This is the RMSE over all pairs; asked for is that over the kept ones.",
        lambda d, kept: np.sqrt(np.mean(d**2))),
    "divided_by_all": (0.5, "The squares of the kept pairs are divided by the number of all pairs.",
        lambda d, kept: np.sqrt(np.sum(d[kept] ** 2) / len(d))),
    "mean": (0.4, "This is the mean distance; the RMSE is the root of the mean square.",
        {ROOT_MEAN_SQUARE: "np.mean(distances[kept])"}),
    "no_root": (0.5, "The root is missing: this is the mean square, in m².",
        {ROOT_MEAN_SQUARE: "np.mean(distances[kept] ** 2)"}),
    "no_mean": (0.5, "The sum of squares is not divided by the number of kept pairs.",
        {ROOT_MEAN_SQUARE: "np.sqrt(np.sum(distances[kept] ** 2))"}),
    "spread": (0.3, "This is the standard deviation: it subtracts the mean, the RMSE does not.",
        {ROOT_MEAN_SQUARE: "np.std(distances[kept])"}),
    "zero_for_none": (0.8, "Where no pair is left this is 0, as of a perfect match: return NaN.",
        {"return np.nan": "return 0.0"}),
})
mistakes("fitness", {
    "count": (0, "This is the number of pairs that are kept; asked for is their share.",
        np.count_nonzero),
    "percent": (0.5, "This is the share in percent; asked for is a number from 0 to 1.",
        lambda kept: 100.0 * np.mean(kept)),
    "rejected": (0.4, "This is the share of the rejected pairs; asked for is that of the kept.",
        lambda kept: 1.0 - np.mean(kept)),
})
