"""Mistakes in the integration of increments and in the sanity check."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes


def _integrated(turn=lambda now, after: now, heading=right.wrap):
    """Integration that turns each increment, or wraps each heading, by another rule."""

    def integrate(increments, start):
        poses = [np.array(start, dtype=float)]
        for dx, dy, dpsi in increments:
            x, y, psi = poses[-1]
            x, y = (x, y) + right.rotation(turn(psi, psi + dpsi)) @ (dx, dy)
            poses.append(np.array([x, y, heading(psi + dpsi)]))
        return np.array(poses)

    return integrate


def _headings(change):
    """The right poses with other headings after the start."""

    def integrate(increments, start):
        poses = right.integrate(increments, start)
        poses[1:, 2] = change(poses[1:, 2])
        return poses

    return integrate


def _start_added(increments, start):
    poses = right.integrate(increments, np.zeros(3)) + start
    poses[:, 2] = right.integrate(increments, start)[:, 2]
    return poses


def _checks(increment, ratio, rmse, shift, turn, min_ratio, max_rmse):
    way = math.hypot(increment[0], increment[1])
    return [way <= shift, abs(increment[2]) <= turn, ratio >= min_ratio, rmse <= max_rmse]


def _but(place, check):
    """The sanity check with another test in one place, of (step, ratio, rmse) and its limit."""

    def is_plausible(*arguments):
        checks = _checks(*arguments)
        checks[place] = check(*arguments[:3], arguments[3 + place])
        return all(checks)

    return is_plausible


def _some(choose):
    """Make a mistake that knows only some of the four checks, or combines them otherwise."""
    return lambda *arguments: choose(_checks(*arguments))


# fmt: off
mistakes("integrate", {
    "world_frame": (0.1, "The increments are added in the world's frame: turn each by R(ψ_k).",
        _integrated(lambda now, after: 0.0)),
    "not_wrapped": (0.8, "The headings grow beyond (−π, π]: wrap them.",
        _integrated(heading=lambda psi: psi)),
    "wrapped_to_full_turn": (0.8, "The headings are wrapped to [0, 2π): the convention is (−π, π].",
        _headings(lambda psi: psi % (2 * np.pi))),
    "half_open": (0.9, "The headings are wrapped to [−π, π): the lab's are (−π, π], π stays π.",
        _headings(lambda psi: np.where(psi == np.pi, -np.pi, psi))),
    "new_heading": (0.6, "The step is turned by the new heading ψ_{k+1}; it is in scan k's frame.",
        _integrated(lambda now, after: after)),
    "mean_heading": (0.6, "The step is turned by the mean of both headings, as wheels are "
        "integrated; a scan match is expressed in the frame of scan k.",
        _integrated(lambda now, after: (now + after) / 2)),
    "turned_backwards": (0.5, "The step is turned by R(ψ)ᵀ; from robot to world it is R(ψ).",
        _integrated(lambda now, after: -now)),
    "start_left_out": (0.7, "The start is not in the result: K increments make K + 1 poses.",
        lambda increments, start: right.integrate(increments, start)[1:]),
    "start_ignored": (0.5, "The trajectory starts at the origin, whatever the start is.",
        lambda increments, start: right.integrate(increments, np.zeros(3))),
    "start_added": (0.5, "The start's position is added to a trajectory from the origin, but it is "
        "not turned by the start's heading.", _start_added),
    "degrees": (0.5, "The headings are in degrees here; all angles are in radians.",
        lambda increments, start: right.integrate(increments, start) * [1, 1, 180 / np.pi]),
    "last_pose": (0.3, "This is the last pose alone; asked for are all K + 1.",
        lambda increments, start: right.integrate(increments, start)[-1:]),
})
mistakes("is_plausible", {
    "residual_alone": (0.15, "Only the RMSE is looked at: all four limits have to be kept.",
        _some(lambda checks: checks[3])),
    "any": (0.3, "One check that passes is enough here; all of them must.", _some(any)),
    "signed_turn": (0.9, "The turn keeps its sign, so turns to the right are never too wide.",
        _but(1, lambda step, ratio, rmse, limit: step[2] <= limit)),
    "each_axis": (0.9, "Each axis is held against the limit by itself; test the length ‖Δt‖.",
        _but(0, lambda step, ratio, rmse, limit: max(map(abs, step[:2])) <= limit)),
    "ahead_only": (0.75, "Only Δx with its sign is looked at; the test is on the length ‖Δt‖.",
        _but(0, lambda step, ratio, rmse, limit: step[0] <= limit)),
    "nan_passes": (0.9, "A residual that is NaN passes: every comparison with NaN is False, so ask "
        "for `rmse <= max_rmse` rather than refuse `rmse > max_rmse`.",
        _but(3, lambda step, ratio, rmse, limit: not rmse > limit)),
    "strict": (0.9, "A step right on a limit is refused: the limits themselves are allowed.",
        lambda step, ratio, rmse, *limits: bool(
            math.hypot(step[0], step[1]) < limits[0] and abs(step[2]) < limits[1]
            and ratio > limits[2] and rmse < limits[3])),
    "degrees": (0.6, "The turn is in degrees here; the limit is in radians.",
        _but(1, lambda step, ratio, rmse, limit: abs(math.degrees(step[2])) <= limit)),
    "no_motion": (0.5, "The motion is not looked at, only the quality of the match.",
        _some(lambda checks: all(checks[2:]))),
    "no_quality": (0.65, "The quality of the match is not looked at, only the motion.",
        _some(lambda checks: all(checks[:2]))),
    "no_residual": (0.75, "The RMSE is not looked at.", _some(lambda checks: all(checks[:3]))),
    "ratio_upside_down": (0.5, "The inlier ratio's limit is taken for an upper one; it is lower.",
        _but(2, lambda step, ratio, rmse, limit: ratio <= limit)),
    "inverted": (0.0, "True and False are swapped: True means that the step can be believed.",
        _some(lambda checks: not all(checks))),
    "always": (0.0, "It says True whatever it is given.", lambda *arguments: True),
    "never": (0.0, "It says False whatever it is given.", lambda *arguments: False),
})
