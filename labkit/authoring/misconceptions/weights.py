"""Mistakes with weights: in the alignment, and in Huber's formula."""

import numpy as np

from labkit.authoring.mistake import mistake
from labkit.authoring.variants import vectorised as right

WEIGHTS = "chapter 2, “Weights, and one outlier”"


def _aligned(source, target, w_mean, w_sums):
    """The closed form with one set of weights in the centroids and another in a and b."""
    p_mean = w_mean @ source / w_mean.sum()
    q_mean = w_mean @ target / w_mean.sum()
    x, y = source - p_mean, target - q_mean
    a = w_sums @ (x * y).sum(axis=1)
    b = w_sums @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = right.rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


@mistake("align_weighted", credit=0.4, chapter=WEIGHTS)
def align_weighted__ignored(source, target, weights):
    """The weights are not used: every pair counts alike."""
    return right.align(source, target)


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__centroids_unweighted(source, target, weights):
    """The centroids are plain means: they need the weights as much as the sums do."""
    return _aligned(source, target, np.ones(len(source)), weights)


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__sums_unweighted(source, target, weights):
    """The centroids are weighted, but the sums for the rotation are not."""
    return _aligned(source, target, weights, np.ones(len(source)))


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__squared(source, target, weights):
    """The weights enter squared: each belongs in every sum once."""
    return right.align_weighted(source, target, weights**2)


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__rooted(source, target, weights):
    """The weights enter by their square roots: each belongs in every sum as it is."""
    return right.align_weighted(source, target, np.sqrt(weights))


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__twice_in_sums(source, target, weights):
    """Both factors of the sums are weighted, so the weights count twice there."""
    return _aligned(source, target, weights, weights**2)


@mistake("align_weighted", credit=0.4, chapter=WEIGHTS)
def align_weighted__divided_by_count(source, target, weights):
    """The weighted centroid is divided by the number of pairs; divide by the sum of weights."""
    p_mean, q_mean = (weights @ points / len(points) for points in (source, target))
    x, y = source - p_mean, target - q_mean
    a = weights @ (x * y).sum(axis=1)
    b = weights @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = right.rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


@mistake("align_weighted", credit=0.5)
def align_weighted__sign_of_b(source, target, weights):
    """The angle has the wrong sign: b = Σ w (x v − y u), with (x, y) of the source."""
    mirror = np.array([1.0, -1.0])
    R, _ = right.align_weighted(source * mirror, target * mirror, weights)
    p_mean, q_mean = (weights @ points / weights.sum() for points in (source, target))
    return R, q_mean - R @ p_mean


@mistake("align_weighted", credit=0.5)
def align_weighted__swapped(source, target, weights):
    """Source and target are swapped: this maps the target onto the source."""
    return right.align_weighted(target, source, weights)


@mistake("align_weighted", credit=0.5)
def align_weighted__transposed(source, target, weights):
    """This is R transposed, next to the right t."""
    R, t = right.align_weighted(source, target, weights)
    return R.T, t


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
