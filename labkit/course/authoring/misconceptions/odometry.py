"""Mistakes in the integration of increments and in the sanity check."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes


def _integrated(increments, start, turn=lambda now, after: now, wrap=True, way=1.0):
    """Integration that turns each increment by a heading which may be wrong."""
    poses = [np.array(start, dtype=float)]
    for dx, dy, dpsi in increments:
        x, y, psi = poses[-1]
        step = right.rotation(way * turn(psi, psi + dpsi)) @ (dx, dy)
        heading = psi + dpsi
        if wrap:
            heading = np.pi - (np.pi - heading) % (2 * np.pi)
        poses.append(np.array([x + step[0], y + step[1], heading]))
    return np.array(poses)


def _wrapped_to_full_turn(increments, start):
    poses = _integrated(increments, start)
    poses[1:, 2] %= 2 * np.pi
    return poses


def _half_open(increments, start):
    poses = _integrated(increments, start)
    poses[poses[:, 2] == np.pi, 2] = -np.pi
    return poses


def _start_added(increments, start):
    poses = right.integrate(increments, np.zeros(3)) + start
    poses[:, 2] = right.integrate(increments, start)[:, 2]
    return poses


def _degrees(increments, start):
    poses = right.integrate(increments, start)
    return np.column_stack([poses[:, :2], np.rad2deg(poses[:, 2])])


def _checks(increment, ratio, rmse, max_translation, max_rotation, min_ratio, max_rmse):
    return [
        math.hypot(increment[0], increment[1]) <= max_translation,
        abs(increment[2]) <= max_rotation,
        ratio >= min_ratio,
        rmse <= max_rmse,
    ]


def _signed_turn(increment, *rest):
    translation, _, *others = _checks(increment, *rest)
    return all([translation, increment[2] <= rest[3], *others])


def _degrees_(increment, *rest):
    translation, _, *others = _checks(increment, *rest)
    return all([translation, abs(math.degrees(increment[2])) <= rest[3], *others])


def _ratio_upside_down(*arguments):
    checks = _checks(*arguments)
    checks[2] = arguments[1] <= arguments[5]
    return all(checks)


# fmt: off
mistakes("integrate", {
    "world_frame": (0.1,
        "The increments are added as they are, in the world's frame: turn each by R(ψ_k).",
        lambda increments, start: _integrated(increments, start, turn=lambda now, after: 0.0)),
    "not_wrapped": (0.8, "The headings grow beyond (−π, π]: wrap them.",
        lambda increments, start: _integrated(increments, start, wrap=False)),
    "wrapped_to_full_turn": (0.8,
        "The headings are wrapped to [0, 2π): the lab's convention is (−π, π].",
        _wrapped_to_full_turn),
    "half_open": (0.9,
        "The headings are wrapped to [−π, π): the lab's convention is (−π, π], so π stays π.",
        _half_open),
    "new_heading": (0.6,
        "The step is turned by the new heading ψ_{k+1}; it is expressed in the frame of scan k.",
        lambda increments, start: _integrated(increments, start, turn=lambda now, after: after)),
    "mean_heading": (0.6,
        "The step is turned by the mean of both headings, as wheels are integrated; a scan "
        "match is expressed in the frame of scan k.",
        lambda increments, start: _integrated(increments, start, turn=lambda now, after: (now +
            after) / 2)),
    "turned_backwards": (0.5,
        "The step is turned by R(ψ) transposed; it goes from the robot's frame to the world's.",
        lambda increments, start: _integrated(increments, start, way=-1.0)),
    "start_left_out": (0.7,
        "The start is not in the result: K increments lead through K + 1 poses.",
        lambda increments, start: right.integrate(increments, start)[1:]),
    "start_ignored": (0.5, "The trajectory starts at the origin, whatever the start is.",
        lambda increments, start: right.integrate(increments, np.zeros(3))),
    "start_added": (0.5,
        "The start's position is added to a trajectory from the origin, but it is not turned by "
        "the start's heading.",
        _start_added),
    "degrees": (0.5, "The headings are in degrees here; all angles are in radians.",
        _degrees),
    "last_pose": (0.3, "This is the last pose alone; asked for are all K + 1.",
        lambda increments, start: right.integrate(increments, start)[-1:]),
})
mistakes("is_plausible", {
    "residual_alone": (0.15, "Only the RMSE is looked at: all four limits have to be kept.",
        lambda *arguments: _checks(*arguments)[3]),
    "any": (0.3, "One check that passes is enough here; all of them must.",
        lambda *arguments: any(_checks(*arguments))),
    "signed_turn": (0.9,
        "The turn keeps its sign, so that turns to the right are never too wide: take |Δψ|.",
        _signed_turn),
    "each_axis": (0.9,
        "Each axis is held against the limit by itself; the test is on the length ‖Δt‖.",
        lambda increment, *rest: all([max(map(abs, increment[:2])) <= rest[2], *_checks(increment,
            *rest)[1:]])),
    "ahead_only": (0.75, "Only Δx with its sign is looked at; the test is on the length ‖Δt‖.",
        lambda increment, *rest: all([increment[0] <= rest[2], *_checks(increment, *rest)[1:]])),
    "nan_passes": (0.9,
        "A residual that is NaN passes: every comparison with NaN is False, so ask for `rmse <= "
        "max_rmse` rather than refuse `rmse > max_rmse`.",
        lambda increment, ratio, rmse, *limits: all([*_checks(increment, ratio, rmse,
            *limits)[:3], not rmse > limits[3]])),
    "strict": (0.9, "A step right on a limit is refused: the limits themselves are allowed.",
        lambda increment, ratio, rmse, *limits: bool(math.hypot(increment[0], increment[1]) <
            limits[0] and abs(increment[2]) < limits[1] and (ratio > limits[2]) and (rmse <
            limits[3]))),
    "degrees": (0.6, "The turn is in degrees here; the limit is in radians.",
        _degrees_),
    "no_motion": (0.5, "The motion is not looked at, only the quality of the match.",
        lambda *arguments: all(_checks(*arguments)[2:])),
    "no_quality": (0.65, "The quality of the match is not looked at, only the motion.",
        lambda *arguments: all(_checks(*arguments)[:2])),
    "no_residual": (0.75, "The RMSE is not looked at.",
        lambda *arguments: all(_checks(*arguments)[:3])),
    "ratio_upside_down": (0.5,
        "The inlier ratio is taken for an upper limit; it must not be too small.",
        _ratio_upside_down),
    "inverted": (0.0, "True and False are swapped: True means that the step can be believed.",
        lambda *arguments: not all(_checks(*arguments))),
    "always": (0.0, "It says True whatever it is given.",
        lambda *arguments: True),
    "never": (0.0, "It says False whatever it is given.",
        lambda *arguments: False),
})
