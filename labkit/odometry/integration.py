"""From increments to poses (section 5): where scan matching becomes odometry."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike

from labkit.se2 import from_xytheta, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray, as_finite, as_floats, as_numbers, as_transforms
from labkit.support.errors import InvalidPointsError

TRANSFORMS = ((3, 3), (4, 4))
MOST_TILT = 1e-3  # of a motion that counts as planar [rad]


def integrate_step(pose: ArrayLike, increment: ArrayLike) -> FloatArray:
    """Move the pose (x, y, ψ) of scan k by an increment (Δx, Δy, Δψ) in its own frame.

    Returns
    -------
    ndarray, shape (3,)
        (x, y, ψ) at scan k+1 [m, m, rad], ψ in (−π, π].

    Examples
    --------
    >>> np.round(integrate_step([1.0, 0.0, np.pi / 2], [0.5, 0.0, 0.1]), 3).tolist()
    [1.0, 0.5, 1.671]
    """
    x, y, heading = as_row(pose, "pose").tolist()
    dx, dy, turn = as_row(increment, "increment").tolist()
    c, s = math.cos(heading), math.sin(heading)
    moved = [x + (c * dx - s * dy), y + (s * dx + c * dy)]  # (5.2)
    return np.array([*moved, wrap(heading + turn)])  # (5.1)


def integrate(increments: ArrayLike, start: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Poses (K+1, 3) from K increments (K, 3), each in the frame of the pose before it."""
    still = np.zeros((1, 3))  # only wraps the heading of the start
    steps = np.vstack([still, as_rows(increments, "increments")])
    return np.array(list(accumulate(steps, integrate_step, initial=as_row(start, "start"))))[1:]


def increments_between(poses: ArrayLike) -> FloatArray:
    """Increments (K−1, 3) that `integrate` turns back into the poses (K, 3) or (K, 3, 3)."""
    T_world = from_xytheta(as_rows(poses, "poses"))
    return to_xytheta(relative(T_world[:-1], T_world[1:]))


def as_row(pose: ArrayLike, name: str) -> FloatArray:
    """Check one pose, (x, y, ψ) or a transform (3, 3) or (4, 4): the row (3,)."""
    given = as_floats(pose, name, hint="give three numbers: metres, metres, radians")
    return as_rows([given], name)[0] if given.shape in TRANSFORMS else as_numbers(given, name)


def as_rows(poses: ArrayLike, name: str, *, gaps: bool = False) -> FloatArray:
    """Check poses, rows (K, 3) or transforms (K, 3, 3) or (K, 4, 4): the rows (K, 3).

    With `gaps`, a row of NaN is allowed. The height of a transform in space is dropped.
    """
    given = as_floats(poses, name, hint="give rows (x, y, ψ) or (Δx, Δy, Δψ)")
    if given.ndim == 3 and given.shape[1:] == (4, 4):
        tilt = given[:, [0, 1, 2, 2, 2], [2, 2, 0, 1, 2]] - [0.0, 0.0, 0.0, 0.0, 1.0]
        for k in np.flatnonzero((np.abs(tilt) > MOST_TILT).any(axis=1)):
            raise InvalidPointsError(
                f"`{name}` must be planar motions, which turn about z alone, got "
                f"{given[k].tolist()}; drop roll and pitch first"
            )
        given = given[:, [0, 1, 3]][:, :, [0, 1, 3]]
    if given.ndim == 3 and given.shape[1:] == (3, 3):
        given = to_xytheta(as_transforms(given, name))
    if given.ndim != 2 or given.shape[1] != 3:
        raise InvalidPointsError(
            f"`{name}` must be rows (x, y, ψ), shape (K, 3), or transforms, shape (K, 3, 3), "
            f"got shape {given.shape}"
        )
    as_finite(given[~(gaps & np.isnan(given).all(axis=1))], name)
    return given
