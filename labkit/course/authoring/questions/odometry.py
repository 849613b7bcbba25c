"""The integration of increments, and the sanity check."""

from __future__ import annotations

import math

import numpy as np

from labkit.course.authoring.entries import Exact, Rng, question, recipe
from labkit.course.authoring.questions.se2 import rotation, wrap
from labkit.course.exercises.entries import Arguments
from labkit.grading.questions import Answer
from labkit.odometry import integrate as labkits_integrate
from labkit.odometry.sanity import SanityLimits, fit_failures, limit_failures
from labkit.support.arrays import FloatArray

LIMITS = (0.5, 0.75, 0.375, 0.125)  # m, rad, ratio, m; exact in single precision
ON_ALL_LIMITS = Exact((np.array([0.5, 0.0, 0.75]), 0.375, 0.125, *LIMITS))
DIAGONAL = math.pi / 4

LENGTH = "np.hypot(increment[0], increment[1])"
MOTION = f"{LENGTH} <= max_shift\n        and abs(increment[2]) <= max_turn"
QUALITY = "inlier_ratio >= min_ratio\n        and rmse <= max_rmse"
HEADING = "wrap(psi + increment[2])"


@recipe
def _increments(
    rng: Rng, count: int, low: float, high: float, elsewhere: bool = False
) -> Arguments:
    """Steps of some decimetres that turn by `low` to `high` [rad] each, and a start."""
    steps = rng.uniform((0.2, -0.3, low), (0.8, 0.3, high), (count, 3))
    start = [rng.number(1.0, 3.0), rng.number(-3.0, -1.0), rng.number(0.4, 1.5)]
    return np.round(steps, 3), elsewhere * np.array(start)


def _whole_increments(rng: Rng) -> Arguments:
    steps = np.column_stack([rng.integers(1, 4, 4), rng.integers(-2, 3, 4), [1, -1, 1, 1]])
    return steps.astype(np.int64), np.zeros(3, dtype=np.int64)


def _half_turn(rng: Rng) -> Arguments:
    steps = np.array([[rng.number(0.2, 0.8), 0.3, math.pi], [rng.number(0.2, 0.8), -0.2, 0.4]])
    return steps, np.zeros(3)


@recipe
def _step(
    rng: Rng,
    length: float = 0.3,
    turn: float = 0.2,
    ratio: float = 0.8,
    rmse: float = 0.04,
    heading: float | None = None,
) -> Arguments:
    """A step before the sanity check; `heading` fixes the way that it goes.

    The limits are others in each case, and each quantity goes with its own.
    """
    vary = rng.number(0.9, 1.1)
    direction = rng.number(-0.6, 0.6) if heading is None else heading
    scales = rng.choice([0.5, 1.125], 4)
    shift, rotation, *fit = (vary * scales * (length, turn, ratio, rmse)).tolist()
    increment = np.array([shift * math.cos(direction), shift * math.sin(direction), rotation])
    limits = (scales * LIMITS).tolist()
    return increment, *fit, *limits


def _is_plausible(
    increment: FloatArray, ratio: float, rmse: float, shift: float, turn: float, *fit: float
) -> bool:
    limits = SanityLimits(
        max_translation=shift, max_rotation=turn, min_inlier_ratio=fit[0], max_rmse=fit[1]
    )
    failures = limit_failures(increment, limits.window) + fit_failures(ratio, rmse, limits)
    return not failures


# fmt: off
@question("From increments to poses", points=7, answer=Answer.POSES,
    chapter="chapter 5, “From increments to poses”",
    task=r"""
Each increment $(\Delta x, \Delta y, \Delta\psi)$ is expressed in the frame of the scan before it.
Chain them to poses in the frame of the start. Headings are to lie in $(-\pi, \pi]$.
""", oracle=labkits_integrate, visible={
    "ahead, a quarter turn, ahead": (
        np.array([[1.0, 0.0, math.pi / 2], [1.5, 0.0, 0.0]]), np.array([2, -1, 0])),
    "a curve from another start": _increments(3, 0.2, 0.5, elsewhere=True),
    "a loop past half a turn": _increments(5, 0.8, 0.9),
    "half a turn on the way": Exact(_half_turn),
    "increments given as whole numbers": _whole_increments,
}, hidden={
    "the steps": {
        "a curve from the origin": _increments(5, 0.2, 0.5),
    },
    "the start": {
        "one step from another start": _increments(1, 0.2, 0.6, elsewhere=True),
        "a curve from another start": _increments(3, 0.2, 0.5, elsewhere=True),
    },
    "whole numbers": {
        "increments given as whole numbers": _whole_increments,
    },
    "the headings": {
        "a loop past half a turn": _increments(8, 0.5, 0.9),
        "a loop to the right past half a turn": _increments(9, -0.9, -0.6),
        "half a turn on the way": Exact(_half_turn),
    },
}, mistakes={
    "world_frame": ("The increments are added in the world's frame: turn each by R(ψ_k).",
        [{"rotation(psi) @ increment": "increment"},
         {"rotation(psi) @ increment": "increment", HEADING: "psi + increment[2]"}]),
    "not_wrapped": ("The headings grow beyond (−π, π]: wrap them.",
        {HEADING: "psi + increment[2]"}),
    "wrapped_to_full_turn": ("The headings are wrapped to [0, 2π): the convention is (−π, π].",
        {HEADING: "(psi + increment[2]) % (2 * np.pi)"}),
    "half_open": ("The headings are wrapped to [−π, π); half a turn stays π, in (−π, π].",
        {HEADING: "(psi + increment[2] + np.pi) % (2 * np.pi) - np.pi"}),
    "new_heading": ("The step is turned by the new heading ψ_{k+1}; it is in scan k's frame.",
        {"rotation(psi)": "rotation(psi + increment[2])"}),
    "mean_heading": ("The step is turned by the mean of both headings, as wheels are "
        "integrated; a scan match is expressed in the frame of scan k.",
        {"rotation(psi)": "rotation(psi + increment[2] / 2)"}),
    "from_zero": ("The path begins at 0 in place of `start`.",
        lambda increments, start: integrate(increments, np.zeros(3))),
    "turned_backwards": ("The step is turned by R(ψ)ᵀ; from robot to world it is R(ψ).",
        {"rotation(psi)": "rotation(psi).T"}),
})
def integrate(increments, start):
    """Chain increments to a trajectory.

    increments: array (K, 3), rows (dx, dy, dpsi), each in the frame of the pose before it.
    start: array (3,), the first pose (x, y, psi).
    Returns an array (K + 1, 3), rows (x, y, psi), the first of them the start.

    >>> print(integrate(np.array([[1, 0, np.pi / 2], [1, 0, 0]]), np.zeros(3))[-1].round(2))
    [1.   1.   1.57]
    """
    poses = [np.array(start, dtype=float)]
    for increment in increments:
        x, y, psi = poses[-1]
        dx, dy = rotation(psi) @ increment[:2]
        poses.append(np.array([x + dx, y + dy, wrap(psi + increment[2])]))
    return np.array(poses)


@question("The sanity check", points=5, answer=Answer.FLAG,
    chapter="chapter 5, “Is this step to be believed?”",
    task=r"""
Say whether a step can be believed: it goes no farther and turns no wider than the robot can, enough
pairs are kept, and they agree well enough. The limits themselves are allowed. A match without a
single pair has the RMSE `nan`; nobody should believe it.
""", oracle=_is_plausible, visible={
    "an ordinary step": _step(),
    "too few inliers": _step(ratio=0.2),
    "an ordinary turn": _step(length=0.0, turn=0.5),
    "a turn too far to the right": _step(turn=-1.1),
    "a step on all limits": ON_ALL_LIMITS,
    "a large residual": _step(rmse=0.2),
    "a match without a pair": _step(rmse=math.nan),
    "a poor but sufficient match": _step(ratio=0.42, rmse=0.1),
    "a step aslant, too far": _step(length=0.6, heading=DIAGONAL),
    "an ordinary step aslant": _step(length=0.42, heading=DIAGONAL),
    "a step straight ahead, too far": _step(length=0.6, heading=0.0),
    "a step straight ahead, far too long": _step(length=2.5),
    "an ordinary step back": _step(length=-0.3),
    "a step to the left, far too long": _step(length=2.5, heading=math.pi / 2),
    "an ordinary step to the left": _step(heading=math.pi / 2),
    "a turn too far to the left": _step(turn=1.1),
    "an ordinary turn to the right": _step(turn=-0.4),
}, hidden={
    "the length of the step": {
        "an ordinary step back": _step(length=-0.3),
        "an ordinary step aslant": _step(length=0.42, heading=DIAGONAL),
        "a step aslant, too far": _step(length=0.6, heading=DIAGONAL),
        "a step straight ahead, too far": _step(length=0.6, heading=0.0),
        "a step back, far too long": _step(length=-2.5),
    },
    "the turn": {
        "an ordinary turn to the right": _step(turn=-0.5),
        "an ordinary turn on the spot": _step(length=0.0, turn=0.6),
        "a turn too far to the right": _step(turn=-1.2),
        "a turn too far to the left": _step(turn=1.2),
        "an ordinary turn to the left": _step(turn=0.5),
    },
    "the inliers": {
        "too few inliers": _step(ratio=0.2),
        "a poor but sufficient match": _step(ratio=0.45, rmse=0.11),
    },
    "the residual": {
        "a step on all limits": ON_ALL_LIMITS,
        "a large residual": _step(rmse=0.3),
        "a residual that is no number": _step(rmse=math.nan),
    },
}, mistakes={
    "residual_alone": ("Only the RMSE is looked at: all four limits have to be kept.",
        {f"{MOTION}\n        and {QUALITY}": "rmse <= max_rmse"}),
    "any": ("One check that passes is enough here; all of them must.",
        {"        and": "        or"}),
    "signed_turn": ("The turn keeps its sign, so turns to the right are never too wide.",
        {"abs(increment[2])": "increment[2]"}),
    "each_axis": ("Each axis is held against the limit by itself; test the length ‖Δt‖.",
        {LENGTH: "np.abs(increment[:2]).max()"}),
    "squared_shift": ("The squared length is held against the limit; both are in metres.",
        {LENGTH: f"{LENGTH} ** 2"}),
    "x_alone": ("Only Δx is held against the limit; test the length ‖Δt‖.",
        {LENGTH: "abs(increment[0])"}),
    "nan_passes": ("A residual that is NaN passes: every comparison with NaN is False, so ask "
        "for `rmse <= max_rmse` rather than refuse `rmse > max_rmse`.",
        {"rmse <= max_rmse": "not rmse > max_rmse"}),
    "strict": ("A step right on a limit is refused: the limits themselves are allowed.",
        {"<= max_": "< max_", ">= min_": "> min_"}),
    "no_motion": ("The motion is not looked at, only the quality of the match.", {MOTION: "True"}),
    "no_shift": ("The length of the step is not looked at.", {f"{LENGTH} <= max_shift": "True"}),
    "no_turn": ("The turn is not looked at.", {"abs(increment[2]) <= max_turn": "True"}),
    "degrees": ("The turn is in degrees here; its limit is in radians.",
        {"abs(increment[2])": "abs(increment[2]) * 180 / np.pi"}),
    "no_ratio": ("The inlier ratio is not looked at.", {"inlier_ratio >= min_ratio": "True"}),
    "no_quality": ("The quality of the match is not looked at, only the motion.",
        {QUALITY: "True"}),
    "ratio_upside_down": ("The inlier ratio's limit is taken for an upper one; it is lower.",
        {"inlier_ratio >= min_ratio": "inlier_ratio <= min_ratio"}),
    "no_residual": ("The RMSE is not looked at.", {"rmse <= max_rmse": "True"}),
})
def is_plausible(increment, inlier_ratio, rmse, max_shift, max_turn, min_ratio, max_rmse):
    """Whether a step passes all sanity checks.

    increment: array (3,), (dx, dy, dpsi) in metres and radians.
    inlier_ratio, rmse: floats, kept pairs over source points, and inlier RMSE in metres.
    max_shift, max_turn: floats, the longest way in metres and the widest turn in radians.
    min_ratio, max_rmse: floats, what the match must reach.
    Returns a bool: True where the step can be believed.

    >>> print(is_plausible(np.array([0.3, 0.0, 0.1]), 0.8, 0.05, 0.5, 0.7, 0.4, 0.2))
    True
    """
    return (
        np.hypot(increment[0], increment[1]) <= max_shift
        and abs(increment[2]) <= max_turn
        and inlier_ratio >= min_ratio
        and rmse <= max_rmse
    )
