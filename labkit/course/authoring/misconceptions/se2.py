"""Mistakes in rotations and transforms."""

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes
from labkit.course.authoring.references import rigid


def _composed(translation):
    """Composition with another translation, made of R_a_b and both translations."""
    return lambda T, U: rigid((T @ U)[:2, :2], translation(T[:2, :2], T[:2, 2], U[:2, 2]))


# fmt: off
mistakes("rotation", {
    "transposed": (0.5, "R is transposed: a positive angle turns counter-clockwise.",
        {"[[c, -s], [s, c]]": "[[c, s], [-s, c]]"}),
    "degrees": (0.5, "The angle is taken for degrees; `theta` is in radians already.",
        lambda theta: right.rotation(np.deg2rad(theta))),
    "reflection": (0.25, "This is a reflection, [[c, s], [s, −c]]: its determinant is −1.",
        {"[[c, -s], [s, c]]": "[[c, s], [s, -c]]"}),
    "sine_and_cosine_swapped": (0.25, "Sine and cosine are swapped: at angle 0, R is the identity.",
        {"c, s = np.cos(theta), np.sin(theta)": "s, c = np.cos(theta), np.sin(theta)"}),
    "no_minus": (0.25, "The minus before the sine is missing: the columns are not at right angles.",
        {"[[c, -s], [s, c]]": "[[c, s], [s, c]]"}),
    "small_angle": (0.25, "This is the small-angle [[1, −θ], [θ, 1]]: it stretches what it turns.",
        {"np.cos(theta), np.sin(theta)": "1.0, theta"}),
})
mistakes("compose", {
    "reversed": (0.5, "The factors are in the wrong order: in T_a_b @ T_b_c equal letters meet.",
        lambda T, U: U @ T),
    "elementwise": (0.1, "The matrices are multiplied entry by entry (`*`); the product is `@`.",
        lambda T, U: T * U),
    "translations_added": (0.25, "The translations are added; turn the second by R_a_b first.",
        _composed(lambda R, t, u: t + u)),
    "turned_backwards": (0.25, "The second translation is turned by R_a_b transposed: take R_a_b.",
        _composed(lambda R, t, u: t + R.T @ u)),
    "translation_lost": (0.25, "Only the second translation is in the result; add the first.",
        _composed(lambda R, t, u: R @ u)),
})
mistakes("invert", {
    "whole_matrix_transposed": (0.1, "The whole (3, 3) is transposed: R⁻¹ = Rᵀ holds for the "
        "rotation, not for the transform.", lambda T: T.T),
    "translation_negated": (0.4, "The translation is only negated; in the other frame it is −Rᵀ t.",
        {"-R.T @ t": "-t"}),
    "sign_lost": (0.4, "The minus is missing: the inverse translation is −Rᵀ t.",
        {"-R.T @ t": "R.T @ t"}),
    "translation_turned_forwards": (0.4, "The translation is turned by R, not by Rᵀ: it is −Rᵀ t.",
        {"-R.T @ t": "-R @ t"}),
    "rotation_kept": (0.25, "The rotation is left as it was; the inverse turns back, by Rᵀ.",
        {"= R.T\n": "= R\n"}),
})
mistakes("wrap", {
    "as_it_came": (0.05, "The angle comes back as it came: whole turns are to be taken off.",
        lambda angle: angle),
    "to_a_full_turn": (0.45, "The angle is wrapped to [0, 2π); the lab's convention is (−π, π].",
        lambda angle: angle % (2 * np.pi)),
    "one_turn": (0.75, "One turn is taken off, and no more: an angle may hold several.",
        lambda angle: angle - 2 * np.pi * (angle > np.pi) + 2 * np.pi * (angle <= -np.pi)),
    "half_turns": (0.75, "Half turns are taken off, as `arctan` does, which cannot tell an angle "
        "from its opposite: take whole turns off.",
        lambda angle: np.pi / 2 - (np.pi / 2 - angle) % np.pi),
    "half_open": (0.9, "The angle is wrapped to [−π, π); the lab's range is (−π, π], π stays π.",
        lambda angle: (angle + np.pi) % (2 * np.pi) - np.pi),
    "cut_off": (0.6, "`math.fmod`'s remainder keeps the sign of the angle: turns right go wrong.",
        lambda angle: np.fmod(angle + np.pi, 2 * np.pi) - np.pi),
    "degrees": (0.3, "A turn is taken for 360; the angle is in radians, so a turn is 2π.",
        lambda angle: 180 - (180 - angle) % 360 if abs(angle) > np.pi else (angle + 180) % 360),
})
