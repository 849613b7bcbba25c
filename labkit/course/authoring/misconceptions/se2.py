"""Mistakes in rotations and transforms."""

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistake


@mistake("rotation", credit=0.5)
def rotation__transposed(theta):
    """R is transposed: it turns clockwise where a positive angle turns counter-clockwise."""
    return right.rotation(theta).T


@mistake("rotation", credit=0.5)
def rotation__degrees(theta):
    """The angle is taken for degrees; `theta` is in radians already."""
    return right.rotation(np.deg2rad(theta))


@mistake("rotation", credit=0.25)
def rotation__reflection(theta):
    """This is a reflection, [[c, s], [s, −c]]: its determinant is −1, and no robot drives it."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [s, -c]])


@mistake("rotation", credit=0.25)
def rotation__sine_and_cosine_swapped(theta):
    """Sine and cosine have changed places: at angle zero the result is not the identity."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[s, -c], [c, s]])


@mistake("rotation", credit=0.25)
def rotation__no_minus(theta):
    """The minus before the sine is missing, so the columns are not at right angles."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [s, c]])


@mistake("rotation", credit=0.25)
def rotation__small_angle(theta):
    """This is the small-angle approximation [[1, −θ], [θ, 1]]: it stretches what it turns."""
    return np.array([[1.0, -theta], [theta, 1.0]])


@mistake("compose", credit=0.5)
def compose__reversed(T_a_b, T_b_c):
    """The factors are in the wrong order: T_a_c = T_a_b @ T_b_c, equal letters in the middle."""
    return T_b_c @ T_a_b


@mistake("compose", credit=0.25)
def compose__elementwise(T_a_b, T_b_c):
    """The matrices are multiplied entry by entry (`*`); composition is the product `@`."""
    return T_a_b * T_b_c


@mistake("compose", credit=0.25)
def compose__translations_added(T_a_b, T_b_c):
    """The translations are added as they are; the second one must be turned by R_a_b first."""
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, 2] + T_b_c[:2, 2])


@mistake("compose", credit=0.25)
def compose__turned_backwards(T_a_b, T_b_c):
    """The second translation is turned by R_a_b transposed: it has to be turned by R_a_b."""
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, 2] + T_a_b[:2, :2].T @ T_b_c[:2, 2])


@mistake("compose", credit=0.25)
def compose__translation_lost(T_a_b, T_b_c):
    """Only the second translation is in the result; the first one is to be added to it."""
    T = T_a_b @ T_b_c
    return _transform(T[:2, :2], T_a_b[:2, :2] @ T_b_c[:2, 2])


@mistake("invert", credit=0.25)
def invert__whole_matrix_transposed(T_a_b):
    """The whole (3, 3) is transposed: R⁻¹ = Rᵀ holds for the rotation, not for the transform."""
    return T_a_b.T


@mistake("invert", credit=0.4)
def invert__translation_negated(T_a_b):
    """The translation is only negated; seen from the other frame it is −Rᵀ t."""
    return _transform(T_a_b[:2, :2].T, -T_a_b[:2, 2])


@mistake("invert", credit=0.4)
def invert__sign_lost(T_a_b):
    """The minus is missing: the inverse translation is −Rᵀ t."""
    return _transform(T_a_b[:2, :2].T, T_a_b[:2, :2].T @ T_a_b[:2, 2])


@mistake("invert", credit=0.4)
def invert__translation_turned_forwards(T_a_b):
    """The translation is turned by R, not by Rᵀ: the inverse translation is −Rᵀ t."""
    return _transform(T_a_b[:2, :2].T, -T_a_b[:2, :2] @ T_a_b[:2, 2])


@mistake("invert", credit=0.25)
def invert__rotation_kept(T_a_b):
    """The rotation is left as it was; the inverse turns the other way, by Rᵀ."""
    return _transform(T_a_b[:2, :2], -T_a_b[:2, :2].T @ T_a_b[:2, 2])


def _transform(R, t):
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = R, t
    return T


@mistake("wrap", credit=0.0)
def wrap__as_it_came(angle):
    """The angle comes back as it came: whole turns are to be taken off."""
    return angle


@mistake("wrap", credit=0.4)
def wrap__to_a_full_turn(angle):
    """The angle is wrapped to [0, 2π); the lab's convention is (−π, π]."""
    return angle % (2 * np.pi)


@mistake("wrap", credit=0.6)
def wrap__one_turn(angle):
    """One turn is taken off, and no more: an angle may hold several."""
    return angle - 2 * np.pi * (angle > np.pi) + 2 * np.pi * (angle <= -np.pi)


@mistake("wrap", credit=0.4)
def wrap__half_turns(angle):
    """Half turns are taken off, as for a line, which has no front: take whole turns off."""
    return np.pi / 2 - (np.pi / 2 - angle) % np.pi


@mistake("wrap", credit=0.3)
def wrap__degrees(angle):
    """A turn is taken for 360; the angle is in radians, so a turn is 2π."""
    return 180.0 - (180.0 - angle) % 360.0 if abs(angle) > np.pi else (angle + 180.0) % 360.0
