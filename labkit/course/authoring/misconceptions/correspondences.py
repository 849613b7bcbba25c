"""Mistakes with correspondences: neighbours, gate, overlap, weights and their quality."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistake


@mistake("nearest_neighbors", credit=0.7)
def nearest_neighbors__squared(source, target):
    """The distances are squared; gates and weights are in metres, so take the root."""
    indices, distances = right.nearest_neighbors(source, target)
    return indices, distances**2


@mistake("nearest_neighbors", credit=0.4)
def nearest_neighbors__swapped(source, target):
    """This finds the nearest source point of each target point: it is to be the other way."""
    return right.nearest_neighbors(target, source)


@mistake("nearest_neighbors", credit=0.4)
def nearest_neighbors__manhattan(source, target):
    """These are sums of |Δx| and |Δy|; the distance is the root of the sum of squares."""
    all_distances = np.abs(source[:, None] - target[None]).sum(axis=2)
    return all_distances.argmin(axis=1), all_distances.min(axis=1)


@mistake("nearest_neighbors", credit=0.4)
def nearest_neighbors__used_once(source, target):
    """Every target point is given away once; several source points may share their nearest."""
    free, indices = set(range(len(target))), []
    for p in source:
        candidates = sorted(free) or range(len(target))
        indices.append(min(candidates, key=lambda j: math.dist(p, target[j])))
        free.discard(indices[-1])
    return np.array(indices), np.linalg.norm(source - target[indices], axis=1)


@mistake("nearest_neighbors", credit=0.8)
def nearest_neighbors__from_one(source, target):
    """The indices count from 1; Python's rows count from 0."""
    indices, distances = right.nearest_neighbors(source, target)
    return indices + 1, distances


@mistake("nearest_neighbors", credit=0.8)
def nearest_neighbors__order_of_results(source, target):
    """The two results are in the wrong order: first the indices, then the distances."""
    indices, distances = right.nearest_neighbors(source, target)
    return distances, indices


@mistake("nearest_neighbors", credit=0.2)
def nearest_neighbors__farthest(source, target):
    """These are the farthest points: take the smallest distance, not the largest."""
    all_distances = np.linalg.norm(source[:, None] - target[None], axis=2)
    return all_distances.argmax(axis=1), all_distances.max(axis=1)


@mistake("distance_gate", credit=0.5)
def distance_gate__squared_distance(distances, max_distance):
    """The squared distance is held against the gate: both are in metres."""
    return distances**2 <= max_distance


@mistake("distance_gate", credit=0.5)
def distance_gate__squared_gate(distances, max_distance):
    """The distance is held against the squared gate: both are in metres."""
    return distances <= max_distance**2


@mistake("distance_gate", credit=0.8)
def distance_gate__strict(distances, max_distance):
    """A pair right on the gate is rejected: the gate is d <= d_max."""
    return distances < max_distance


@mistake("distance_gate", credit=0.4)
def distance_gate__inverted(distances, max_distance):
    """The mask is True for the pairs to reject; it is to be True for those that stay."""
    return distances > max_distance


@mistake("distance_gate", credit=0.7)
def distance_gate__indices(distances, max_distance):
    """These are the indices of the pairs that stay; asked for is a mask, one entry a pair."""
    return np.flatnonzero(distances <= max_distance)


@mistake("distance_gate", credit=0.4)
def distance_gate__distances(distances, max_distance):
    """These are the distances that stay; asked for is a mask, one entry a pair."""
    return distances[distances <= max_distance]


@mistake("distance_gate", credit=0.3)
def distance_gate__relative(distances, max_distance):
    """The gate is taken as a share of the largest distance; it is a distance in metres."""
    return distances <= max_distance * distances.max()


def _closest(distances, count):
    kept = np.zeros(len(distances), dtype=bool)
    kept[np.argsort(distances)[: min(count, len(distances))]] = True
    return kept


@mistake("overlap", credit=0.3)
def overlap__worst_kept(distances, overlap_ratio):
    """The worst pairs are kept: trimming keeps the closest ones."""
    return right.overlap(-distances, overlap_ratio)


@mistake("overlap", credit=0.3)
def overlap__not_sorted(distances, overlap_ratio):
    """The first pairs are kept, in the order they came: they have to be sorted first."""
    return right.overlap(np.arange(len(distances)), overlap_ratio)


@mistake("overlap", credit=0.7)
def overlap__rounded_up(distances, overlap_ratio):
    """ρN is rounded up; the count is ⌊ρN⌋, rounded down."""
    return _closest(distances, max(3, math.ceil(overlap_ratio * len(distances))))


@mistake("overlap", credit=0.7)
def overlap__rounded(distances, overlap_ratio):
    """ρN is rounded to the nearest; the count is ⌊ρN⌋, rounded down."""
    return _closest(distances, max(3, round(overlap_ratio * len(distances))))


@mistake("overlap", credit=0.7)
def overlap__one_too_many(distances, overlap_ratio):
    """One pair too many is kept: an off-by-one in ⌊ρN⌋ (rank ⌊ρN⌋ counted from 0?)."""
    return _closest(distances, max(3, int(overlap_ratio * len(distances))) + 1)


@mistake("overlap", credit=0.7)
def overlap__one_too_few(distances, overlap_ratio):
    """One pair too few is kept: an off-by-one in ⌊ρN⌋ (is the threshold itself excluded?)."""
    return _closest(distances, max(3, int(overlap_ratio * len(distances))) - 1)


@mistake("overlap", credit=0.8)
def overlap__no_minimum(distances, overlap_ratio):
    """Fewer than 3 pairs are kept where ρN is small: keep at least 3, as a step needs them."""
    return _closest(distances, int(overlap_ratio * len(distances)))


@mistake("overlap", credit=0.3)
def overlap__share_of_range(distances, overlap_ratio):
    """ρ is taken as a share of the largest distance; it is a share of the number of pairs."""
    return distances <= overlap_ratio * distances.max()


@mistake("overlap", credit=0.7)
def overlap__quantile(distances, overlap_ratio):
    """A quantile interpolates between pairs and keeps ⌊ρ(N − 1)⌋ + 1 of them, not ⌊ρN⌋."""
    return distances <= np.quantile(distances, overlap_ratio)


@mistake("overlap", credit=0.4)
def overlap__share_removed(distances, overlap_ratio):
    """ρ is taken as the share to remove; it is the share to keep."""
    return right.overlap(distances, 1.0 - overlap_ratio)


@mistake("overlap", credit=0.7)
def overlap__indices(distances, overlap_ratio):
    """These are indices of the pairs that stay; asked for is a mask, one entry a pair."""
    return np.argsort(distances)[: max(3, int(overlap_ratio * len(distances)))]


@mistake("overlap", credit=0.4)
def overlap__inverted(distances, overlap_ratio):
    """The mask is True for the pairs to reject; it is to be True for those that stay."""
    return ~right.overlap(distances, overlap_ratio)


@mistake("overlap", credit=0.8)
def overlap__other_minimum(distances, overlap_ratio):
    """Another number of pairs than 3 is kept where ρN is small: keep at least 3."""
    count = int(overlap_ratio * len(distances))
    return Several(tuple(_closest(distances, max(least, count)) for least in (2, 4)))


@mistake("huber_weights", credit=0.5)
def huber_weights__squared(residuals, delta):
    """The residuals are squared before they meet δ: both are distances in metres."""
    return right.huber_weights(residuals**2, delta)


@mistake("huber_weights", credit=0.5)
def huber_weights__uncapped(residuals, delta):
    """The weight is δ/r everywhere; up to δ it is 1, or close pairs count far too much."""
    return delta / residuals


@mistake("huber_weights", credit=0.5)
def huber_weights__cut(residuals, delta):
    """Pairs beyond δ weigh nothing here: that is a gate. Huber's weight falls as δ/r."""
    return np.where(residuals <= delta, 1.0, 0.0)


@mistake("huber_weights", credit=0.5)
def huber_weights__rooted(residuals, delta):
    """Beyond δ this is the square root of δ/r; the weight is δ/r itself."""
    return np.sqrt(right.huber_weights(residuals, delta))


@mistake("huber_weights", credit=0.5)
def huber_weights__ratio_squared(residuals, delta):
    """Beyond δ this is (δ/r)²; the weight is δ/r itself."""
    return right.huber_weights(residuals, delta) ** 2


@mistake("huber_weights", credit=0.4)
def huber_weights__upside_down(residuals, delta):
    """Beyond δ this is r/δ: the farther a pair, the more it counts. It should be δ/r."""
    return np.maximum(residuals, delta) / delta


@mistake("huber_weights", credit=0.4)
def huber_weights__branches_swapped(residuals, delta):
    """The branches are swapped: 1 belongs to residuals up to δ, δ/r to those beyond."""
    return np.where(residuals > delta, 1.0, delta / residuals)


@mistake("huber_weights", credit=0.3)
def huber_weights__loss(residuals, delta):
    """This is Huber's loss; asked for are the weights that go with it."""
    capped = np.minimum(residuals, delta)
    return capped * (2.0 * residuals - capped)


@mistake("huber_weights", credit=0.3)
def huber_weights__half_loss(residuals, delta):
    """This is Huber's loss (halved, as in many books); asked for are the weights."""
    return huber_weights__loss(residuals, delta) / 2.0


@mistake("huber_weights", credit=0.8)
def huber_weights__whole_numbers(residuals, delta):
    """`np.ones_like` of whole numbers holds whole numbers, so δ/r is cut off to 0: ask for
    `dtype=float`."""
    weights = np.ones_like(residuals)
    far = residuals > delta
    weights[far] = (delta / np.maximum(residuals, 1e-12))[far]
    return weights


@mistake("huber_weights", credit=0.4)
def huber_weights__over_square(residuals, delta):
    """Beyond δ this is δ/r²; the weight is δ/r."""
    return np.where(residuals > delta, delta / np.maximum(residuals, 1e-12) ** 2.0, 1.0)


@mistake("inlier_rmse", credit=0.4)
def inlier_rmse__over_all(distances, kept):
    """This is the RMSE over all pairs; asked for is that over the kept ones."""
    return np.sqrt(np.mean(distances**2))


@mistake("inlier_rmse", credit=0.5)
def inlier_rmse__divided_by_all(distances, kept):
    """The squares of the kept pairs are divided by the number of all pairs."""
    return np.sqrt(np.sum(distances[kept] ** 2) / len(distances))


@mistake("inlier_rmse", credit=0.4)
def inlier_rmse__mean(distances, kept):
    """This is the mean distance; the RMSE is the root of the mean square."""
    return distances[kept].mean() if kept.any() else np.nan


@mistake("inlier_rmse", credit=0.5)
def inlier_rmse__no_root(distances, kept):
    """The root is missing: this is the mean square, in m²."""
    return np.mean(distances[kept] ** 2) if kept.any() else np.nan


@mistake("inlier_rmse", credit=0.5)
def inlier_rmse__no_mean(distances, kept):
    """The sum of squares is not divided by the number of kept pairs."""
    return np.sqrt(np.sum(distances[kept] ** 2)) if kept.any() else np.nan


@mistake("inlier_rmse", credit=0.3)
def inlier_rmse__spread(distances, kept):
    """This is the standard deviation: it subtracts the mean distance, the RMSE does not."""
    return np.std(distances[kept]) if kept.any() else np.nan


@mistake("inlier_rmse", credit=0.8)
def inlier_rmse__zero_for_none(distances, kept):
    """Where no pair is left this returns 0, which looks like a perfect match: return NaN."""
    return right.inlier_rmse(distances, kept) if kept.any() else 0.0


@mistake("fitness", credit=0.5)
def fitness__count(kept):
    """This is the number of pairs that are kept; asked for is their share."""
    return np.count_nonzero(kept)


@mistake("fitness", credit=0.5)
def fitness__percent(kept):
    """This is the share in percent; asked for is a number from 0 to 1."""
    return 100.0 * np.mean(kept)


@mistake("fitness", credit=0.4)
def fitness__rejected(kept):
    """This is the share of the pairs that are rejected; asked for is that of the kept ones."""
    return 1.0 - np.mean(kept)
