"""Mistakes in rotations and transforms."""

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes


def _reflection(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [s, -c]])


def _sine_and_cosine_swapped(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[s, -c], [c, s]])


def _no_minus(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [s, c]])


def _translations_added(T_a_b, T_b_c):
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, 2] + T_b_c[:2, 2])


def _turned_backwards(T_a_b, T_b_c):
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, 2] + T_a_b[:2, :2].T @ T_b_c[:2, 2])


def _translation_lost(T_a_b, T_b_c):
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, :2] @ T_b_c[:2, 2])


def _transform(R, t):
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = R, t
    return T


# fmt: off
mistakes("rotation", {
    "transposed": (0.5,
        "R is transposed: it turns clockwise where a positive angle turns counter-clockwise.",
        lambda theta: right.rotation(theta).T),
    "degrees": (0.5, "The angle is taken for degrees; `theta` is in radians already.",
        lambda theta: right.rotation(np.deg2rad(theta))),
    "reflection": (0.25,
        "This is a reflection, [[c, s], [s, −c]]: its determinant is −1, and no robot drives "
        "it.",
        _reflection),
    "sine_and_cosine_swapped": (0.25,
        "Sine and cosine have changed places: at angle zero the result is not the identity.",
        _sine_and_cosine_swapped),
    "no_minus": (0.25,
        "The minus before the sine is missing, so the columns are not at right angles.",
        _no_minus),
    "small_angle": (0.25,
        "This is the small-angle approximation [[1, −θ], [θ, 1]]: it stretches what it turns.",
        lambda theta: np.array([[1.0, -theta], [theta, 1.0]])),
})
mistakes("compose", {
    "reversed": (0.5,
        "The factors are in the wrong order: T_a_c = T_a_b @ T_b_c, equal letters in the "
        "middle.",
        lambda T_a_b, T_b_c: T_b_c @ T_a_b),
    "elementwise": (0.1,
        "The matrices are multiplied entry by entry (`*`); composition is the product `@`.",
        lambda T_a_b, T_b_c: T_a_b * T_b_c),
    "translations_added": (0.25,
        "The translations are added as they are; the second one must be turned by R_a_b first.",
        _translations_added),
    "turned_backwards": (0.25,
        "The second translation is turned by R_a_b transposed: it has to be turned by R_a_b.",
        _turned_backwards),
    "translation_lost": (0.25,
        "Only the second translation is in the result; the first one is to be added to it.",
        _translation_lost),
})
mistakes("invert", {
    "whole_matrix_transposed": (0.1,
        "The whole (3, 3) is transposed: R⁻¹ = Rᵀ holds for the rotation, not for the "
        "transform.",
        lambda T_a_b: T_a_b.T),
    "translation_negated": (0.4,
        "The translation is only negated; seen from the other frame it is −Rᵀ t.",
        lambda T_a_b: _transform(T_a_b[:2, :2].T, -T_a_b[:2, 2])),
    "sign_lost": (0.4, "The minus is missing: the inverse translation is −Rᵀ t.",
        lambda T_a_b: _transform(T_a_b[:2, :2].T, T_a_b[:2, :2].T @ T_a_b[:2, 2])),
    "translation_turned_forwards": (0.4,
        "The translation is turned by R, not by Rᵀ: the inverse translation is −Rᵀ t.",
        lambda T_a_b: _transform(T_a_b[:2, :2].T, -T_a_b[:2, :2] @ T_a_b[:2, 2])),
    "rotation_kept": (0.25,
        "The rotation is left as it was; the inverse turns the other way, by Rᵀ.",
        lambda T_a_b: _transform(T_a_b[:2, :2], -T_a_b[:2, :2].T @ T_a_b[:2, 2])),
})
mistakes("wrap", {
    "as_it_came": (0.05, "The angle comes back as it came: whole turns are to be taken off.",
        lambda angle: angle),
    "to_a_full_turn": (0.45, "The angle is wrapped to [0, 2π); the lab's convention is (−π, π].",
        lambda angle: angle % (2 * np.pi)),
    "one_turn": (0.75, "One turn is taken off, and no more: an angle may hold several.",
        lambda angle: angle - 2 * np.pi * (angle > np.pi) + 2 * np.pi * (angle <= -np.pi)),
    "half_turns": (0.75,
        "Half turns are taken off, as `arctan` does, which cannot tell an angle from its "
        "opposite: take whole turns off.",
        lambda angle: np.pi / 2 - (np.pi / 2 - angle) % np.pi),
    "half_open": (0.9,
        "The angle is wrapped to [−π, π); the lab's convention is (−π, π], so π stays π.",
        lambda angle: (angle + np.pi) % (2 * np.pi) - np.pi),
    "cut_off": (0.6,
        "The remainder of `math.fmod` keeps the sign of the angle: to the right it goes wrong.",
        lambda angle: np.fmod(angle + np.pi, 2 * np.pi) - np.pi),
    "degrees": (0.3, "A turn is taken for 360; the angle is in radians, so a turn is 2π.",
        lambda angle: 180.0 - (180.0 - angle) % 360.0 if abs(angle) > np.pi else (angle + 180.0) %
            360.0),
})
