"""SE(2), the rigid motions of the plane (section 2 of the lesson).

A transform is a (3, 3) array ``T_a_b`` that takes coordinates in frame b to
coordinates in frame a::

    p_a = T_a_b @ p_b        T_a_c = T_a_b @ T_b_c        T_b_a = invert(T_a_b)

Every function takes stacks, too: a leading shape ``...`` goes through unchanged. Anything else
than transforms, poses or points raises an `InvalidPointsError`, which names the call that was
probably meant. The NaN of a failed match stays NaN.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.support.arrays import (
    FloatArray,
    PointSet,
    as_finite,
    as_floats,
    as_points,
    as_pose_rows,
    as_transforms,
)
from labkit.support.errors import InvalidPointsError


def wrap(angle: ArrayLike) -> FloatArray:
    """Wrap angles [rad] into (−π, π].

    An angle in that interval comes back bit for bit.

    >>> float(wrap(-np.pi)) == np.pi
    True
    """
    theta = _as_angles(angle, "angle")
    wrapped = np.pi - np.mod(np.pi - theta, 2.0 * np.pi)
    wrapped = np.where(wrapped == -np.pi, np.pi, wrapped)  # mod rounds up to 2π just above π
    is_within = (theta > -np.pi) & (theta <= np.pi)
    return np.where(is_within, theta, wrapped)


def _as_angles(angles: ArrayLike, name: str) -> FloatArray:
    """Check angles [rad]: none is infinite; NaN passes."""
    checked = as_floats(angles, name, hint="give radians")
    if np.isinf(checked).any():
        raise InvalidPointsError(
            f"`{name}` must be angles in radians, got {checked.tolist()!s:.80}"
        )
    return checked


def rotation(theta: ArrayLike) -> FloatArray:
    """Rotation matrices R(θ), counter-clockwise, shape (..., 2, 2), from angles [rad]."""
    angle = _as_angles(theta, "theta")
    c = np.cos(angle)
    s = np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def transform(x: ArrayLike, y: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Build T = [[R(θ), t], [0, 1]] with t = (x, y).

    Parameters
    ----------
    x, y : array_like, shape (...)
        Translation in metres.
    theta : array_like, shape (...)
        Rotation in radians, counter-clockwise, within one turn to either side.

    Returns
    -------
    ndarray, shape (..., 3, 3)

    Examples
    --------
    >>> T = transform(1.0, 2.0, np.pi / 2)
    >>> np.round(apply(T, [[1.0, 0.0]]), 12).tolist()
    [[1.0, 3.0]]
    """
    x = as_floats(x, "x")
    y = as_floats(y, "y")
    theta = as_floats(theta, "theta")
    try:
        rows = np.stack(np.broadcast_arrays(x, y, theta), axis=-1)
    except ValueError:
        raise InvalidPointsError(
            f"`x`, `y` and `theta` must be numbers or have one shape, got shapes {x.shape}, "
            f"{y.shape} and {theta.shape}"
        ) from None
    check_headings(theta, "theta")
    return matrices_of(as_finite(rows, "x, y, theta"))


def from_xytheta(poses: ArrayLike) -> FloatArray:
    """Transforms of shape (..., 3, 3) from rows (x [m], y [m], θ [rad]) of shape (..., 3).

    Headings beyond one turn are refused, since they are mostly degrees. `wrap` first the headings
    of a robot that has turned several times.
    """
    rows = as_pose_rows(poses, "poses")
    check_headings(rows[..., 2], "theta")
    return matrices_of(rows)


def matrices_of(rows: FloatArray) -> FloatArray:
    """Transforms from checked rows (x, y, θ), whose headings may exceed one turn."""
    c = np.cos(rows[..., 2])
    s = np.sin(rows[..., 2])
    T = np.zeros((*rows.shape, 3))
    T[..., 0, 0] = c
    T[..., 0, 1] = -s
    T[..., 1, 0] = s
    T[..., 1, 1] = c
    T[..., :2, 2] = rows[..., :2]
    T[..., 2, 2] = 1.0
    return T


def check_headings(theta: FloatArray, name: str) -> None:
    """Raise an error for an angle [rad] beyond one turn: it mostly is in degrees."""
    largest = np.abs(theta).max(initial=0.0)
    if np.isfinite(largest) and largest > 2.0 * np.pi:
        raise InvalidPointsError(
            f"`{name}` must be radians within one turn, got {largest:.6g}: are these degrees? use "
            f"`np.radians`; `labkit.wrap` brings back the headings of several turns"
        )


def to_xytheta(T: ArrayLike) -> FloatArray:
    """Rows (x [m], y [m], θ [rad]) with θ in (−π, π], shape (..., 3); undoes `from_xytheta`."""
    T = as_transforms(T, "T")
    s = T[..., 1, 0]
    c = T[..., 0, 0]
    theta = math.atan2(s, c) if T.ndim == 2 else np.arctan2(s, c)  # math is faster for a single one
    poses = T[..., 2].copy()
    poses[..., 2] = np.where(theta == -np.pi, np.pi, theta)  # a sine of −0.0 gives −π
    return poses


def compose(*transforms: ArrayLike) -> FloatArray:
    """Chain transforms from left to right: ``compose(T_a_b, T_b_c)`` is T_a_c."""
    T = np.eye(3)
    if len(transforms) == 1 and isinstance(transforms[0], list | tuple):
        raise InvalidPointsError(
            "`transforms` are given one by one, got a list; `compose(*transforms)` chains a list"
        )
    for k, factor in enumerate(transforms):
        right = as_transforms(factor, f"transforms[{k}]")
        try:
            T = T @ right
        except ValueError:
            raise InvalidPointsError(
                f"stacks of transforms must have one leading shape, got {T.shape} and {right.shape}"
            ) from None
    return T


def invert(T: ArrayLike) -> FloatArray:
    """Invert a transform by its structure: R becomes Rᵀ and t becomes −Rᵀt, which rounds least."""
    T = as_transforms(T, "T")
    inverse = np.zeros_like(T)
    R_inverse = np.swapaxes(T[..., :2, :2], -1, -2)
    inverse[..., :2, :2] = R_inverse
    inverse[..., :2, 2:] = -(R_inverse @ T[..., :2, 2:])
    inverse[..., 2, 2] = 1.0
    return inverse


def relative(T_w_a: ArrayLike, T_w_b: ArrayLike) -> FloatArray:
    """Pose of b in the frame of a: ``T_a_b = invert(T_w_a) @ T_w_b``."""
    return compose(invert(T_w_a), as_transforms(T_w_b, "T_w_b"))


def apply(T_a_b: ArrayLike, points_b: PointSet | ArrayLike) -> FloatArray:
    """Move points (N, 2) [m], or those of a scan, from frame b to frame a: R p + t for each row."""
    T = as_transforms(T_a_b, "T_a_b")
    points = as_points(points_b, "points_b", minimum=0)
    moved: FloatArray = (T[..., :2, :2] @ points.mT + T[..., :2, 2:]).mT
    return moved
