"""Mistakes in the integration of increments and in the sanity check."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistake


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


@mistake("integrate", credit=0.4)
def integrate__world_frame(increments, start):
    """The increments are added as they are, in the world's frame: turn each by R(ψ_k)."""
    return _integrated(increments, start, turn=lambda now, after: 0.0)


@mistake("integrate", credit=0.8)
def integrate__not_wrapped(increments, start):
    """The headings grow beyond (−π, π]: wrap them."""
    return _integrated(increments, start, wrap=False)


@mistake("integrate", credit=0.8)
def integrate__wrapped_to_full_turn(increments, start):
    """The headings are wrapped to [0, 2π): the lab's convention is (−π, π]."""
    poses = _integrated(increments, start)
    poses[1:, 2] %= 2 * np.pi
    return poses


@mistake("integrate", credit=0.6)
def integrate__new_heading(increments, start):
    """The step is turned by the new heading ψ_{k+1}; it is expressed in the frame of scan k."""
    return _integrated(increments, start, turn=lambda now, after: after)


@mistake("integrate", credit=0.6)
def integrate__mean_heading(increments, start):
    """The step is turned by the mean of both headings, as wheels are integrated; a scan match
    is expressed in the frame of scan k."""
    return _integrated(increments, start, turn=lambda now, after: (now + after) / 2)


@mistake("integrate", credit=0.5)
def integrate__turned_backwards(increments, start):
    """The step is turned by R(ψ) transposed; it goes from the robot's frame to the world's."""
    return _integrated(increments, start, way=-1.0)


@mistake("integrate", credit=0.7)
def integrate__start_left_out(increments, start):
    """The start is not in the result: K increments lead through K + 1 poses."""
    return right.integrate(increments, start)[1:]


@mistake("integrate", credit=0.5)
def integrate__start_ignored(increments, start):
    """The trajectory starts at the origin, whatever the start is."""
    return right.integrate(increments, np.zeros(3))


@mistake("integrate", credit=0.5)
def integrate__start_added(increments, start):
    """The start's position is added to a trajectory from the origin, but it is not turned by
    the start's heading."""
    poses = right.integrate(increments, np.zeros(3)) + start
    poses[:, 2] = right.integrate(increments, start)[:, 2]
    return poses


@mistake("integrate", credit=0.5)
def integrate__degrees(increments, start):
    """The headings are in degrees here; all angles are in radians."""
    poses = right.integrate(increments, start)
    return np.column_stack([poses[:, :2], np.rad2deg(poses[:, 2])])


@mistake("integrate", credit=0.3)
def integrate__last_pose(increments, start):
    """This is the last pose alone; asked for are all K + 1."""
    return right.integrate(increments, start)[-1:]


def _checks(increment, ratio, rmse, max_translation, max_rotation, min_ratio, max_rmse):
    return [
        math.hypot(increment[0], increment[1]) <= max_translation,
        abs(increment[2]) <= max_rotation,
        ratio >= min_ratio,
        rmse <= max_rmse,
    ]


@mistake("is_plausible", credit=0.3)
def is_plausible__any(*arguments):
    """One check that passes is enough here; all of them must."""
    return any(_checks(*arguments))


@mistake("is_plausible", credit=0.6)
def is_plausible__signed_turn(increment, *rest):
    """The turn keeps its sign, so that turns to the right are never too wide: take |Δψ|."""
    translation, _, *others = _checks(increment, *rest)
    return all([translation, increment[2] <= rest[3], *others])


@mistake("is_plausible", credit=0.7)
def is_plausible__each_axis(increment, *rest):
    """Each axis is held against the limit by itself; the test is on the length ‖Δt‖."""
    return all([max(map(abs, increment[:2])) <= rest[2], *_checks(increment, *rest)[1:]])


@mistake("is_plausible", credit=0.6)
def is_plausible__ahead_only(increment, *rest):
    """Only Δx with its sign is looked at; the test is on the length ‖Δt‖."""
    return all([increment[0] <= rest[2], *_checks(increment, *rest)[1:]])


@mistake("is_plausible", credit=0.7)
def is_plausible__nan_passes(increment, ratio, rmse, *limits):
    """A residual that is NaN passes: every comparison with NaN is False, so ask for
    `rmse <= max_rmse` rather than refuse `rmse > max_rmse`."""
    return all([*_checks(increment, ratio, rmse, *limits)[:3], not rmse > limits[3]])


@mistake("is_plausible", credit=0.8)
def is_plausible__strict(increment, ratio, rmse, *limits):
    """A step right on a limit is refused: the limits themselves are allowed."""
    return bool(
        math.hypot(increment[0], increment[1]) < limits[0]
        and abs(increment[2]) < limits[1]
        and ratio > limits[2]
        and rmse < limits[3]
    )


@mistake("is_plausible", credit=0.6)
def is_plausible__degrees(increment, *rest):
    """The turn is in degrees here; the limit is in radians."""
    translation, _, *others = _checks(increment, *rest)
    return all([translation, abs(math.degrees(increment[2])) <= rest[3], *others])


@mistake("is_plausible", credit=0.5)
def is_plausible__no_motion(*arguments):
    """The motion is not looked at, only the quality of the match."""
    return all(_checks(*arguments)[2:])


@mistake("is_plausible", credit=0.5)
def is_plausible__no_quality(*arguments):
    """The quality of the match is not looked at, only the motion."""
    return all(_checks(*arguments)[:2])


@mistake("is_plausible", credit=0.6)
def is_plausible__no_residual(*arguments):
    """The RMSE is not looked at."""
    return all(_checks(*arguments)[:3])


@mistake("is_plausible", credit=0.5)
def is_plausible__ratio_upside_down(*arguments):
    """The inlier ratio is taken for an upper limit; it must not be too small."""
    checks = _checks(*arguments)
    checks[2] = arguments[1] <= arguments[5]
    return all(checks)


@mistake("is_plausible", credit=0.0)
def is_plausible__inverted(*arguments):
    """True and False are swapped: True means that the step can be believed."""
    return not all(_checks(*arguments))


@mistake("is_plausible", credit=0.0)
def is_plausible__always(*arguments):
    """It says True whatever it is given."""
    return True


@mistake("is_plausible", credit=0.0)
def is_plausible__never(*arguments):
    """It says False whatever it is given."""
    return False
