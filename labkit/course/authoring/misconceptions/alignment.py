"""Mistakes in the alignment of known pairs."""

import itertools

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes

WEIGHTS = "chapter 2, “Weights, and one outlier”"
DETERMINANT = "chapter 2, “What the determinant is for”"
TRANSLATION = "chapter 2, “The best translation”"
SWAPPED = (0.5, "Source and target are swapped: this maps the target onto the source.",
    lambda p, q, *w: right.align_weighted(q, p, w[0] if w else np.ones(len(p))))  # fmt: skip
NOT_TURNED = "The rotation is right, but t is q̄ − p̄: the centroid p̄ has to be turned, t = q̄ − R p̄."


def _closed(means=None, sums=None, angle=np.arctan2, center=True):
    """The closed form with other weights in the centroids or in a and b, or with another angle."""

    def align(p, q, w=None):
        w = np.ones(len(p)) if w is None else w
        of_means, of_sums = means(w) if means else w / w.sum(), sums(w) if sums else w
        p_mean, q_mean = of_means @ p, of_means @ q
        x, y = (p - p_mean, q - q_mean) if center else (p, q)
        a = of_sums @ (x * y).sum(axis=1)
        b = of_sums @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
        R = right.rotation(angle(b, a))
        return R, q_mean - R @ p_mean

    return align


def _changed(change, align=right.align):
    """The right R and t, changed."""
    return lambda *pairs: change(*align(*pairs))


def _kabsch(rotation, center=True):
    """Alignment by the SVD, with a last step that may be wrong."""

    def align(p, q):
        p_mean, q_mean = p.mean(axis=0), q.mean(axis=0)
        U, _, Vt = np.linalg.svd((p - center * p_mean).T @ (q - center * q_mean))
        R = rotation(U, Vt)
        return R, q_mean - R @ p_mean

    return align


def _sign(U, Vt):
    return np.sign(np.linalg.det(Vt.T @ U.T))


def _v_transposed(p, q):
    answers = []
    for signs in itertools.product([1.0, -1.0], repeat=2):  # the SVD may choose them

        def rotation(U, Vt, signs=signs):
            U, Vt = U @ np.diag(signs), np.diag(signs) @ Vt
            return Vt @ np.diag([1.0, _sign(U, Vt)]) @ U.T

        answers.append(_kabsch(rotation)(p, q))
    return answers


def _column_of_r(p, q):
    def negated(column):
        signs = np.where(np.arange(2) == column, -1.0, 1.0)
        return lambda U, Vt: Vt.T @ U.T * (signs if _sign(U, Vt) < 0 else 1.0)

    return [_kabsch(negated(column))(p, q) for column in (0, 1)]


# fmt: off
mistakes("best_translation", {
    "not_turned": (0.1, "The source's centroid is not turned: t = q̄ − R p̄, and not q̄ − p̄.",
        lambda R, p, q: q.mean(axis=0) - p.mean(axis=0)),
    "transposed": (0.5, "The source's centroid is turned by R transposed: t = q̄ − R p̄.",
        lambda R, p, q: q.mean(axis=0) - R.T @ p.mean(axis=0)),
    "negative": (0.5, "The sign is the wrong way round: t = q̄ − R p̄ goes from source to target.",
        lambda R, p, q: R @ p.mean(axis=0) - q.mean(axis=0)),
    "difference_turned": (0.4, "The difference of the centroids is turned as one; turn p̄ alone.",
        lambda R, p, q: R @ (q.mean(axis=0) - p.mean(axis=0))),
    "first_pair": (0.4, "Only the first pair is used; least squares takes the centroids of all of "
        "them.", lambda R, p, q: q[0] - R @ p[0]),
    "sums": (0.5, "These are sums over the points; the centroid divides them by their number.",
        lambda R, p, q: q.sum(axis=0) - R @ p.sum(axis=0)),
})
mistakes("align", {
    "sign_of_b": (0.5, "The angle has the wrong sign: b = Σ (x v − y u), (x, y) of the source.",
        _closed(angle=lambda b, a: np.arctan2(-b, a))),
    "transposed": (0.5, "This is R transposed, next to the right t.",
        _changed(lambda R, t: (R.T, t))),
    "swapped": SWAPPED,
    "arctan_of_ratio": (0.6, "arctan(b / a) cannot tell (a, b) from (−a, −b): take arctan2.",
        _closed(angle=lambda b, a: np.arctan(b / a))),
    "arctan2_swapped": (0.4, "The arguments of arctan2 are swapped: it takes b first, then a.",
        _closed(angle=lambda b, a: np.arctan2(a, b))),
    "degrees": (0.5, "The angle is turned into degrees before its sine and cosine are taken.",
        _closed(angle=lambda b, a: np.rad2deg(np.arctan2(b, a)))),
    "not_centred": (0.3, "The points are not centred: a and b sum the points less centroids.",
        _closed(center=False)),
    "centroid_not_turned": (0.5, NOT_TURNED,
        lambda p, q: (right.align(p, q)[0], q.mean(axis=0) - p.mean(axis=0)), TRANSLATION),
    "translation_zero": (0.5, "The rotation is right, but the translation is left out.",
        _changed(lambda R, t: (R, 0.0 * t)), TRANSLATION),
})
mistakes("align_weighted", {
    "ignored": (0.1, "The weights are not used: every pair counts alike.",
        lambda p, q, w: right.align(p, q), WEIGHTS),
    "centroids_unweighted": (0.6, "The centroids are plain means: they need the weights, too.",
        _closed(means=lambda w: np.ones(len(w)) / len(w)), WEIGHTS),
    "sums_unweighted": (0.6, "The centroids are weighted, but the sums for the rotation are not.",
        _closed(sums=lambda w: np.ones(len(w))), WEIGHTS),
    "squared": (0.6, "The weights enter squared: each belongs in every sum once.",
        lambda p, q, w: right.align_weighted(p, q, w ** 2), WEIGHTS),
    "rooted": (0.6, "The weights enter by their square roots: each belongs in every sum as it is.",
        lambda p, q, w: right.align_weighted(p, q, np.sqrt(w)), WEIGHTS),
    "twice_in_sums": (0.6, "Both factors of the sums are weighted: the weights count twice there.",
        _closed(sums=lambda w: w ** 2), WEIGHTS),
    "divided_by_count": (0.4, "The weighted centroid is divided by N; divide it by Σ w.",
        _closed(means=lambda w: w / len(w)), WEIGHTS),
    "sign_of_b": (0.5, "The angle has the wrong sign: b = Σ w (x v − y u), (x, y) the source.",
        _closed(angle=lambda b, a: np.arctan2(-b, a))),
    "swapped": SWAPPED,
    "transposed": (0.5, "This is R transposed, next to the right t.",
        _changed(lambda R, t: (R.T, t), right.align_weighted)),
    "not_normalised": (0.5, "The weighted sums are taken for means: divide Σ w p and Σ w q by Σ w.",
        _closed(means=lambda w: w), WEIGHTS),
})
mistakes("align_svd", {
    "reflection_kept": (0.6, "A mirror image yields a reflection: correct the determinant.",
        _kabsch(lambda U, Vt: Vt.T @ U.T), DETERMINANT),
    "wrong_column": (0.7, "The wrong singular vector is turned; it is that of the smallest value.",
        _kabsch(lambda U, Vt: Vt.T @ np.diag([_sign(U, Vt), 1.0]) @ U.T), DETERMINANT),
    "transposed": (0.5, "This is R transposed: U and V, or the two factors of H, are swapped.",
        _kabsch(lambda U, Vt: U @ np.diag([1.0, _sign(U, Vt)]) @ Vt)),
    "v_transposed": (0.6, "`np.linalg.svd` returns V transposed; R = V diag(1, s) Uᵀ needs V.",
        _v_transposed),
    "swapped": SWAPPED,
    "not_centred": (0.3, "The points are not centred: H sums the points less their centroids.",
        _kabsch(lambda U, Vt: Vt.T @ np.diag([1.0, _sign(U, Vt)]) @ U.T, center=False)),
    "centroid_not_turned": (0.5, NOT_TURNED,
        lambda p, q: (right.align_svd(p, q)[0], q.mean(axis=0) - p.mean(axis=0)), TRANSLATION),
    "column_of_r": (0.6, "Against the reflection a column of R is negated; the one to negate is "
        "V's last, before R = V Uᵀ is formed.", _column_of_r, DETERMINANT),
})
