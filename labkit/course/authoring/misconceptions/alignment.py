"""Mistakes in the alignment of known pairs."""

import itertools

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistake

WEIGHTS = "chapter 2, “Weights, and one outlier”"
DETERMINANT = "chapter 2, “What the determinant is for”"


@mistake("best_translation", credit=0.4)
def best_translation__not_turned(R, source, target):
    """The source's centroid is not turned: t = q̄ − R p̄, and not q̄ − p̄."""
    return target.mean(axis=0) - source.mean(axis=0)


@mistake("best_translation", credit=0.5)
def best_translation__transposed(R, source, target):
    """The source's centroid is turned by R transposed: t = q̄ − R p̄."""
    return target.mean(axis=0) - R.T @ source.mean(axis=0)


@mistake("best_translation", credit=0.5)
def best_translation__negative(R, source, target):
    """The sign is the wrong way round: t = q̄ − R p̄ goes from source to target."""
    return R @ source.mean(axis=0) - target.mean(axis=0)


@mistake("best_translation", credit=0.4)
def best_translation__difference_turned(R, source, target):
    """The difference of the centroids is turned as a whole; R belongs to p̄ alone."""
    return R @ (target.mean(axis=0) - source.mean(axis=0))


@mistake("best_translation", credit=0.4)
def best_translation__first_pair(R, source, target):
    """Only the first pair is used; least squares takes the centroids of all of them."""
    return target[0] - R @ source[0]


@mistake("best_translation", credit=0.5)
def best_translation__sums(R, source, target):
    """These are sums over the points; the centroid divides them by their number."""
    return target.sum(axis=0) - R @ source.sum(axis=0)


def _aligned(source, target, angle=np.arctan2):
    """Centroids and the angle, from (a, b) by a formula that may be wrong."""
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    x, y = source - p_mean, target - q_mean
    a, b = (x * y).sum(), (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()
    return p_mean, q_mean, right.rotation(angle(b, a))


def _mapped(p_mean, q_mean, R):
    return R, q_mean - R @ p_mean


@mistake("align", credit=0.5)
def align__sign_of_b(source, target):
    """The angle has the wrong sign: b = Σ (x v − y u), with (x, y) of the source."""
    return _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan2(-b, a)))


@mistake("align", credit=0.5)
def align__transposed(source, target):
    """This is R transposed, next to the right t."""
    R, t = right.align(source, target)
    return R.T, t


@mistake("align", credit=0.5)
def align__swapped(source, target):
    """Source and target are swapped: this maps the target onto the source."""
    return right.align(target, source)


@mistake("align", credit=0.5)
def align__arctan_of_ratio(source, target):
    """The angle is arctan(b / a), which cannot tell (a, b) from (−a, −b): take arctan2."""
    return _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan(b / a)))


@mistake("align", credit=0.4)
def align__arctan2_swapped(source, target):
    """The arguments of arctan2 are swapped: it takes b first, then a."""
    return _mapped(*_aligned(source, target, angle=lambda b, a: np.arctan2(a, b)))


@mistake("align", credit=0.5)
def align__degrees(source, target):
    """The angle is turned into degrees before its sine and cosine are taken."""
    return _mapped(*_aligned(source, target, angle=lambda b, a: np.rad2deg(np.arctan2(b, a))))


@mistake("align", credit=0.3)
def align__not_centred(source, target):
    """The points are not centred: a and b are sums over the points less their centroids."""
    _, _, R = _aligned(np.vstack([source, -source]), np.vstack([target, -target]))
    return _mapped(source.mean(axis=0), target.mean(axis=0), R)


@mistake("align", credit=0.5, chapter="chapter 2, “The best translation”")
def align__centroid_not_turned(source, target):
    """The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R p̄."""
    p_mean, q_mean, R = _aligned(source, target)
    return R, q_mean - p_mean


@mistake("align", credit=0.5, chapter="chapter 2, “The best translation”")
def align__translation_zero(source, target):
    """The rotation is right, but the translation is left out."""
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


@mistake("align_weighted", credit=0.4, chapter=WEIGHTS)
def align_weighted__ignored(source, target, weights):
    """The weights are not used: every pair counts alike."""
    return right.align(source, target)


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__centroids_unweighted(source, target, weights):
    """The centroids are plain means: they need the weights as much as the sums do."""
    return _aligned_weighted(source, target, np.ones(len(source)), weights)


@mistake("align_weighted", credit=0.6, chapter=WEIGHTS)
def align_weighted__sums_unweighted(source, target, weights):
    """The centroids are weighted, but the sums for the rotation are not."""
    return _aligned_weighted(source, target, weights, np.ones(len(source)))


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
    return _aligned_weighted(source, target, weights, weights**2)


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


@mistake("align_weighted", credit=0.5, chapter=WEIGHTS)
def align_weighted__not_normalised(source, target, weights):
    """The weighted sums are taken for means: divide Σ w p and Σ w q by Σ w."""
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


@mistake("align_svd", credit=0.6, chapter=DETERMINANT)
def align_svd__reflection_kept(source, target):
    """A mirror image yields a reflection here: the determinant correction is missing."""
    return _kabsch(source, target, lambda U, Vt: Vt.T @ U.T)


@mistake("align_svd", credit=0.7, chapter=DETERMINANT)
def align_svd__wrong_column(source, target):
    """The wrong singular vector is turned round: the correction is for the smallest value."""
    return _kabsch(source, target, lambda U, Vt: Vt.T @ np.diag([_sign(U, Vt), 1.0]) @ U.T)


@mistake("align_svd", credit=0.5)
def align_svd__transposed(source, target):
    """This is R transposed: U and V are swapped, or H was made the other way round."""
    return _kabsch(source, target, lambda U, Vt: U @ np.diag([1.0, _sign(U, Vt)]) @ Vt)


@mistake("align_svd", credit=0.6)
def align_svd__v_transposed(source, target):
    """`np.linalg.svd` returns V transposed; R = V diag(1, s) Uᵀ needs V."""
    answers = []
    for signs in itertools.product([1.0, -1.0], repeat=2):  # the SVD may choose them

        def fix(U, Vt, signs=signs):
            U, Vt = U @ np.diag(signs), np.diag(signs) @ Vt
            return Vt @ np.diag([1.0, _sign(U, Vt)]) @ U.T

        answers.append(_kabsch(source, target, fix))
    return Several(tuple(answers))


@mistake("align_svd", credit=0.5)
def align_svd__swapped(source, target):
    """Source and target are swapped: this maps the target onto the source."""
    return right.align(target, source)


@mistake("align_svd", credit=0.3)
def align_svd__not_centred(source, target):
    """The points are not centred: H is a sum over the points less their centroids."""
    R, _ = right.align_svd(np.vstack([source, -source]), np.vstack([target, -target]))
    return _mapped(source.mean(axis=0), target.mean(axis=0), R)


@mistake("align_svd", credit=0.5, chapter="chapter 2, “The best translation”")
def align_svd__centroid_not_turned(source, target):
    """The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R p̄."""
    R, _ = right.align_svd(source, target)
    return R, target.mean(axis=0) - source.mean(axis=0)


def _sign(U, Vt):
    return np.sign(np.linalg.det(Vt.T @ U.T))


@mistake("align_svd", credit=0.6, chapter=DETERMINANT)
def align_svd__column_of_r(source, target):
    """Against the reflection a column of R is negated; the one to negate is V's last, before
    R = V Uᵀ is formed."""
    p_mean, q_mean = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((source - p_mean).T @ (target - q_mean))
    turns = []
    for column in (0, 1):
        R = Vt.T @ U.T
        if np.linalg.det(R) < 0:
            R[:, column] *= -1
        turns.append((R, q_mean - R @ p_mean))
    return Several(tuple(turns))
