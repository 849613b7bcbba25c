"""Wheel odometry: the true steps of a trajectory, as the robot's wheels would count them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from labkit.se2 import matrices_of, relative, to_xytheta, wrap
from labkit.support.arrays import FloatArray, as_generator, as_poses, check_kind, check_range


@dataclass(frozen=True, kw_only=True)
class WheelNoise:
    """Errors of wheels, per metre travelled and per radian turned.

    The defaults suit a differential drive on a hard floor. Every one is the standard
    deviation of the error of one step, over the length or the turn of that step.

    Attributes
    ----------
    along, across : float
        Errors in the direction of travel and to the side of it, metres per metre.
    turn, drift : float
        Errors of the heading from turning, radians per radian, and from travelling, radians
        per metre.
    """

    along: float = 0.05
    across: float = 0.02
    turn: float = 0.05
    drift: float = 0.02

    def __post_init__(self) -> None:
        for field in fields(self):
            check_range(getattr(self, field.name), field.name, at_least=0.0, at_most=10.0)


def wheel_increments(
    poses: ArrayLike, noise: WheelNoise, *, rng: np.random.Generator | int
) -> FloatArray:
    """Steps between consecutive poses, with the errors of wheels.

    With d the true displacement of a step, d⊥ the same turned left by 90°, and Δθ its
    turn, the wheels report

        d + n₁ d + n₂ d⊥        n₁ ~ N(0, along²)         n₂ ~ N(0, across²)
        Δθ + n₃                 n₃ ~ N(0, turn² Δθ² + drift² ‖d‖²)

    This is the odometry motion model of [1]_ in its linear form: the spread grows with
    distance and turn, and a robot that rests makes no error. The error to the side stands for
    the first turn of [1]_, which has no meaning at rest.

    Steps err independently. The same path cut into n times as many steps therefore ends
    with a spread smaller by √n: state the step length along with the noise.

    Parameters
    ----------
    poses : array_like, shape (K, 3)
        The true rows (x [m], y [m], θ [rad]), K ≥ 2.
    noise : WheelNoise
        Spread of the errors.
    rng : numpy.random.Generator or int
        Source of the errors.

    Returns
    -------
    ndarray, shape (K − 1, 3)
        Row k is (Δx [m], Δy [m], Δθ [rad]) of pose k + 1 in the frame of pose k, with
        Δθ in (−π, π]: the prior for the scan k + 1 → scan k transform.

    References
    ----------
    .. [1] Thrun, Burgard, Fox, "Probabilistic Robotics", MIT Press, 2005, section 5.4.

    Examples
    --------
    >>> silent = WheelNoise(along=0.0, across=0.0, turn=0.0, drift=0.0)
    >>> wheel_increments([[0, 0, 0], [1, 0, 0], [1, 2, 0]], silent, rng=0).tolist()
    [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]
    """
    T = matrices_of(as_poses(poses, "poses", minimum=2))
    check_kind(noise, "noise", WheelNoise)
    steps = to_xytheta(relative(T[:-1], T[1:]))
    d, turn = steps[:, :2], steps[:, 2]
    d_left = np.column_stack([-d[:, 1], d[:, 0]])
    turn_std = np.hypot(noise.turn * turn, noise.drift * np.hypot(d[:, 0], d[:, 1]))
    n = as_generator(rng).standard_normal((len(steps), 3))
    n_along, n_across, n_turn = n[:, :1], n[:, 1:2], n[:, 2]
    travelled = d + noise.along * n_along * d + noise.across * n_across * d_left
    turned = wrap(turn + turn_std * n_turn)
    return np.column_stack([travelled, turned])
