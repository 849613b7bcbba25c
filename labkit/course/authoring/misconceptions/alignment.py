"""Mistakes in the alignment of known pairs."""

import itertools

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistakes

WEIGHTS = "chapter 2, “Weights, and one outlier”"
DETERMINANT = "chapter 2, “What the determinant is for”"


def _aligned(source, target, angle=np.arctan2):
    """Centroids and the angle, from (a, b) by a formula that may be wrong."""
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    x, y = source - p_mean, target - q_mean
    a, b = (x * y).sum(), (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()
    return p_mean, q_mean, right.rotation(angle(b, a))


def _mapped(p_mean, q_mean, R):
    return R, q_mean - R @ p_mean


def _transposed(source, target):
    R, t = right.align(source, target)
    return R.T, t


def _not_centred(source, target):
    _, _, R = _aligned(np.vstack([source, -source]), np.vstack([target, -target]))
    return _mapped(source.mean(axis=0), target.mean(axis=0), R)


def _centroid_not_turned(source, target):
    p_mean, q_mean, R = _aligned(source, target)
    return R, q_mean - p_mean


def _translation_zero(source, target):
    R, _ = right.align(source, target)
    return R, np.zeros(2)


def _aligned_weighted(source, target, w_mean, w_sums):
    """The closed form with one set of weights in the centroids and another in a and b."""
    p_mean = w_mean @ source / w_mean.sum()
    q_mean = w_mean @ target / w_mean.sum()
    x, y = source - p_mean, target - q_mean
    a = w_sums @ (x * y).sum(axis=1)
    b = w_sums @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = right.rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


def _divided_by_count(source, target, weights):
    p_mean, q_mean = (weights @ points / len(points) for points in (source, target))
    x, y = source - p_mean, target - q_mean
    a = weights @ (x * y).sum(axis=1)
    b = weights @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = right.rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


def _sign_of_b(source, target, weights):
    mirror = np.array([1.0, -1.0])
    R, _ = right.align_weighted(source * mirror, target * mirror, weights)
    p_mean, q_mean = (weights @ points / weights.sum() for points in (source, target))
    return R, q_mean - R @ p_mean


def _transposed_(source, target, weights):
    R, t = right.align_weighted(source, target, weights)
    return R.T, t


def _not_normalised(source, target, weights):
    p_mean, q_mean = weights @ source, weights @ target
    x, y = source - p_mean, target - q_mean
    a = weights @ (x * y).sum(axis=1)
    b = weights @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    R = right.rotation(np.arctan2(b, a))
    return R, q_mean - R @ p_mean


def _kabsch(source, target, fix):
    """Alignment by the SVD, with a last step that may be wrong."""
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((source - p_mean).T @ (target - q_mean))
    return _mapped(p_mean, q_mean, fix(U, Vt))


def _v_transposed(source, target):
    answers = []
    for signs in itertools.product([1.0, -1.0], repeat=2):  # the SVD may choose them

        def fix(U, Vt, signs=signs):
            U, Vt = U @ np.diag(signs), np.diag(signs) @ Vt
            return Vt @ np.diag([1.0, _sign(U, Vt)]) @ U.T

        answers.append(_kabsch(source, target, fix))
    return Several(tuple(answers))


def _not_centred_(source, target):
    R, _ = right.align_svd(np.vstack([source, -source]), np.vstack([target, -target]))
    return _mapped(source.mean(axis=0), target.mean(axis=0), R)


def _centroid_not_turned_(source, target):
    R, _ = right.align_svd(source, target)
    return R, target.mean(axis=0) - source.mean(axis=0)


def _sign(U, Vt):
    return np.sign(np.linalg.det(Vt.T @ U.T))


def _column_of_r(source, target):
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((source - p_mean).T @ (target - q_mean))
    turns = []
    for column in (0, 1):
        R = Vt.T @ U.T
        if np.linalg.det(R) < 0:
            R[:, column] *= -1
        turns.append((R, q_mean - R @ p_mean))
    return Several(tuple(turns))


# fmt: off
mistakes("best_translation", {
    "not_turned": (0.1, "The source's centroid is not turned: t = q̄ − R p̄, and not q̄ − p̄.",
        lambda R, source, target: target.mean(axis=0) - source.mean(axis=0)),
    "transposed": (0.5, "The source's centroid is turned by R transposed: t = q̄ − R p̄.",
        lambda R, source, target: target.mean(axis=0) - R.T @ source.mean(axis=0)),
    "negative": (0.5, "The sign is the wrong way round: t = q̄ − R p̄ goes from source to target.",
        lambda R, source, target: R @ source.mean(axis=0) - target.mean(axis=0)),
    "difference_turned": (0.4,
        "The difference of the centroids is turned as a whole; R belongs to p̄ alone.",
        lambda R, source, target: R @ (target.mean(axis=0) - source.mean(axis=0))),
    "first_pair": (0.4,
        "Only the first pair is used; least squares takes the centroids of all of them.",
        lambda R, source, target: target[0] - R @ source[0]),
    "sums": (0.5, "These are sums over the points; the centroid divides them by their number.",
        lambda R, source, target: target.sum(axis=0) - R @ source.sum(axis=0)),
})
mistakes("align", {
    "sign_of_b": (0.5,
        "The angle has the wrong sign: b = Σ (x v − y u), with (x, y) of the source.",
        lambda source, target: _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan2(-b,
            a)))),
    "transposed": (0.5, "This is R transposed, next to the right t.",
        _transposed),
    "swapped": (0.5, "Source and target are swapped: this maps the target onto the source.",
        lambda source, target: right.align(target, source)),
    "arctan_of_ratio": (0.6,
        "The angle is arctan(b / a), which cannot tell (a, b) from (−a, −b): take arctan2.",
        lambda source, target: _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan(b /
            a)))),
    "arctan2_swapped": (0.4, "The arguments of arctan2 are swapped: it takes b first, then a.",
        lambda source, target: _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan2(a,
            b)))),
    "degrees": (0.5, "The angle is turned into degrees before its sine and cosine are taken.",
        lambda source, target: _mapped(*_aligned(source, target, angle=lambda b, a:
            np.rad2deg(np.arctan2(b, a))))),
    "not_centred": (0.3,
        "The points are not centred: a and b are sums over the points less their centroids.",
        _not_centred),
    "centroid_not_turned": (0.5,
        "The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R "
        "p̄.",
        _centroid_not_turned, "chapter 2, “The best translation”"),
    "translation_zero": (0.5, "The rotation is right, but the translation is left out.",
        _translation_zero, "chapter 2, “The best translation”"),
})
mistakes("align_weighted", {
    "ignored": (0.1, "The weights are not used: every pair counts alike.",
        lambda source, target, weights: right.align(source, target), WEIGHTS),
    "centroids_unweighted": (0.6,
        "The centroids are plain means: they need the weights as much as the sums do.",
        lambda source, target, weights: _aligned_weighted(source, target, np.ones(len(source)),
            weights), WEIGHTS),
    "sums_unweighted": (0.6, "The centroids are weighted, but the sums for the rotation are not.",
        lambda source, target, weights: _aligned_weighted(source, target, weights,
            np.ones(len(source))), WEIGHTS),
    "squared": (0.6, "The weights enter squared: each belongs in every sum once.",
        lambda source, target, weights: right.align_weighted(source, target, weights ** 2),
            WEIGHTS),
    "rooted": (0.6, "The weights enter by their square roots: each belongs in every sum as it is.",
        lambda source, target, weights: right.align_weighted(source, target, np.sqrt(weights)),
            WEIGHTS),
    "twice_in_sums": (0.6,
        "Both factors of the sums are weighted, so the weights count twice there.",
        lambda source, target, weights: _aligned_weighted(source, target, weights, weights ** 2),
            WEIGHTS),
    "divided_by_count": (0.4,
        "The weighted centroid is divided by the number of pairs; divide by the sum of weights.",
        _divided_by_count, WEIGHTS),
    "sign_of_b": (0.5,
        "The angle has the wrong sign: b = Σ w (x v − y u), with (x, y) of the source.",
        _sign_of_b),
    "swapped": (0.5, "Source and target are swapped: this maps the target onto the source.",
        lambda source, target, weights: right.align_weighted(target, source, weights)),
    "transposed": (0.5, "This is R transposed, next to the right t.",
        _transposed_),
    "not_normalised": (0.5, "The weighted sums are taken for means: divide Σ w p and Σ w q by Σ w.",
        _not_normalised, WEIGHTS),
})
mistakes("align_svd", {
    "reflection_kept": (0.6,
        "A mirror image yields a reflection here: the determinant correction is missing.",
        lambda source, target: _kabsch(source, target, lambda U, Vt: Vt.T @ U.T), DETERMINANT),
    "wrong_column": (0.7,
        "The wrong singular vector is turned round: the correction is for the smallest value.",
        lambda source, target: _kabsch(source, target, lambda U, Vt: Vt.T @ np.diag([_sign(U, Vt),
            1.0]) @ U.T), DETERMINANT),
    "transposed": (0.5,
        "This is R transposed: U and V are swapped, or H was made the other way round.",
        lambda source, target: _kabsch(source, target, lambda U, Vt: U @ np.diag([1.0, _sign(U,
            Vt)]) @ Vt)),
    "v_transposed": (0.6, "`np.linalg.svd` returns V transposed; R = V diag(1, s) Uᵀ needs V.",
        _v_transposed),
    "swapped": (0.5, "Source and target are swapped: this maps the target onto the source.",
        lambda source, target: right.align(target, source)),
    "not_centred": (0.3,
        "The points are not centred: H is a sum over the points less their centroids.",
        _not_centred_),
    "centroid_not_turned": (0.5,
        "The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R "
        "p̄.",
        _centroid_not_turned_, "chapter 2, “The best translation”"),
    "column_of_r": (0.6,
        "Against the reflection a column of R is negated; the one to negate is V's last, before "
        "R = V Uᵀ is formed.",
        _column_of_r, DETERMINANT),
})
