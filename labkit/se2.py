"""SE(2), the rigid motions of the plane (section 2 of the lesson).

A transform is a (3, 3) array ``T_a_b`` that takes coordinates in frame b to
coordinates in frame a::

    p_a = T_a_b @ p_b        T_a_c = T_a_b @ T_b_c        T_b_a = invert(T_a_b)

Every function takes stacks too: a leading shape ``...`` goes through unchanged.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.support.arrays import FloatArray


def wrap(angle: ArrayLike) -> FloatArray:
    """Wrap angles [rad] into (−π, π].

    An angle that lies there already comes back bit for bit.

    >>> float(wrap(-np.pi)) == np.pi
    True
    """
    theta = np.asarray(angle, dtype=np.float64)
    if theta.ndim == 0 and -math.pi < float(theta) <= math.pi:  # the short way of a single one
        return theta.copy()
    turned = np.pi - np.mod(np.pi - theta, 2.0 * np.pi)
    turned = np.where(turned == -np.pi, np.pi, turned)  # mod rounds up to 2π just above π
    return np.where((theta > -np.pi) & (theta <= np.pi), theta, turned)


def rotation(theta: ArrayLike) -> FloatArray:
    """Rotation matrices R(θ), counter-clockwise, shape (..., 2, 2), from angles [rad]."""
    if np.ndim(theta) == 0:  # the short way of a single one
        angle = float(theta)  # type: ignore[arg-type]
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, -s], [s, c]])
    theta = np.asarray(theta, dtype=np.float64)
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def transform(x: ArrayLike, y: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Build T = [[R(θ), t], [0, 1]] with t = (x, y).

    Parameters
    ----------
    x, y : array_like, shape (...)
        Translation in metres.
    theta : array_like, shape (...)
        Rotation in radians, counter-clockwise.

    Returns
    -------
    ndarray, shape (..., 3, 3)

    Examples
    --------
    >>> T = transform(1.0, 2.0, np.pi / 2)
    >>> np.round(apply(T, [[1.0, 0.0]]), 12).tolist()
    [[1.0, 3.0]]
    """
    if np.ndim(x) == np.ndim(y) == np.ndim(theta) == 0:  # the short way of a single one
        angle = float(theta)  # type: ignore[arg-type]
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])
    x, y, theta = np.broadcast_arrays(x, y, theta)
    T = np.zeros((*x.shape, 3, 3))
    T[..., :2, :2] = rotation(theta)
    T[..., 0, 2], T[..., 1, 2], T[..., 2, 2] = x, y, 1.0
    return T


def from_xytheta(poses: ArrayLike) -> FloatArray:
    """Transforms of shape (..., 3, 3) from rows (x [m], y [m], θ [rad]) of shape (..., 3)."""
    poses = np.asarray(poses, dtype=np.float64)
    return transform(poses[..., 0], poses[..., 1], poses[..., 2])


def to_xytheta(T: ArrayLike) -> FloatArray:
    """Rows (x [m], y [m], θ [rad]) with θ in (−π, π], shape (..., 3); undoes `from_xytheta`."""
    T = np.asarray(T, dtype=np.float64)
    if T.ndim == 2:  # the short way of a single one
        (c, _, x), (s, _, y), _ = T.tolist()
        return np.array([x, y, wrap(math.atan2(s, c))])
    theta = wrap(np.arctan2(T[..., 1, 0], T[..., 0, 0]))
    return np.stack([T[..., 0, 2], T[..., 1, 2], theta], axis=-1)


def compose(*transforms: ArrayLike) -> FloatArray:
    """Chain transforms from left to right: ``compose(T_a_b, T_b_c)`` is T_a_c."""
    T = np.eye(3)
    for factor in transforms:
        T = T @ np.asarray(factor, dtype=np.float64)
    return T


def invert(T: ArrayLike) -> FloatArray:
    """Invert by structure, R⁻¹ = Rᵀ and t ↦ −Rᵀt: exact where a general solve is not."""
    T = np.asarray(T, dtype=np.float64)
    inverse = np.zeros_like(T)
    R_inverse = np.swapaxes(T[..., :2, :2], -1, -2)
    inverse[..., :2, :2] = R_inverse
    inverse[..., :2, 2] = -np.einsum("...ij,...j->...i", R_inverse, T[..., :2, 2])
    inverse[..., 2, 2] = 1.0
    return inverse


def relative(T_w_a: ArrayLike, T_w_b: ArrayLike) -> FloatArray:
    """The pose of b seen from a: ``T_a_b = invert(T_w_a) @ T_w_b``."""
    return invert(T_w_a) @ np.asarray(T_w_b, dtype=np.float64)


def apply(T_a_b: ArrayLike, points_b: ArrayLike) -> FloatArray:
    """Move points of shape (N, 2) [m] from frame b to frame a: R p + t for each row."""
    T = np.asarray(T_a_b, dtype=np.float64)
    points = np.asarray(points_b, dtype=np.float64)
    moved: FloatArray = (T[..., :2, :2] @ points.mT + T[..., :2, 2:]).mT
    return moved
