"""One step: the match, the checks, and the fallbacks in their stated order."""

import math
from dataclasses import replace

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target, Termination, icp
from labkit.degeneracy import spread_ratio
from labkit.odometry import (
    Decision,
    OdometryParameters,
    SanityLimits,
    StepRecord,
    estimate_step,
)
from labkit.odometry.agreement import beams_of, seen_through
from labkit.odometry.sanity import Trust
from labkit.odometry.step import ALIKE, SAME, _Match, _Step
from labkit.se2 import apply, from_xytheta, invert, to_xytheta, transform
from labkit.simulation import Lidar, cast, corridor, room
from labkit.support.errors import InvalidParameterError

STILL = np.zeros(3)
LAST = np.array([0.02, 0.0, 0.01])
MOTION = np.array([0.1, 0.05, math.radians(3.0)])
PRIOR = MOTION + np.array([0.02, -0.01, 0.005])
PARAMETERS = OdometryParameters()
LESSON = replace(PARAMETERS, search=False)
EMPTY = Scan.from_ranges([math.inf], [0.0])


def looks(world, motion=MOTION, rng=0):
    """The newer scan and the prepared older one."""
    rng = np.random.default_rng(rng)
    older, newer = (cast(world, from_xytheta(x), Lidar(), rng=rng) for x in (STILL, motion))
    return newer, Target(older)


def degrees(motion):
    return np.array(motion) * [1.0, 1.0, math.radians(1.0)]


def limited(**limits):
    return replace(LESSON, limits=SanityLimits(**limits))


def test_a_good_match_is_taken_and_its_numbers_are_the_matchs():
    source, target = looks(room())
    record = estimate_step(source, target, PRIOR, LAST, PARAMETERS)
    result = icp(source, target, from_xytheta(PRIOR), PARAMETERS.icp)
    T, pairs = result.T_target_source, result.correspondences
    assert record.decision is Decision.ICP
    assert record.reason == ""
    np.testing.assert_array_equal(record.increment, to_xytheta(T))
    np.testing.assert_allclose(record.increment, MOTION, atol=0.006)
    assert (record.inlier_count, record.inlier_ratio) == (result.inlier_count, result.fitness)
    p, q = pairs.source[pairs.kept], target.points[pairs.target_index[pairs.kept]]
    off_line = (target.normals[pairs.target_index[pairs.kept]] * (p - q)).sum(axis=1)
    assert record.rmse == pytest.approx(math.sqrt(np.mean(off_line**2)), rel=1e-9)
    assert record.seen_through == seen_through(*beams_of(source), target.points, T)
    nothing_fits = 0.02 * (2 * 0.16 - 0.02)  # h_δ at the gate (4.1)
    expected = 1.0 - result.cost / nothing_fits - 0.5 * record.seen_through
    assert record.agreement == pytest.approx(expected, rel=1e-12)
    assert record.rotation == abs(record.increment[2])
    assert record.information == result.observability.values[0]
    assert not record.degenerate
    assert (record.iterations, record.termination) == (result.iterations, result.termination)


@pytest.mark.parametrize("turn", [0.0, 80.0])
def test_the_spread_does_not_depend_on_how_far_the_robot_turned(turn):
    """The newer scan is the same points, turned: the corridor is as narrow as it was."""
    turned = np.array([0.3, 0.0, math.radians(turn)])
    ahead, target = looks(corridor(), np.array([0.3, 0.0, 0.0]))
    source = Scan.from_points(apply(from_xytheta([0.0, 0.0, -turned[2]]), ahead.points))
    record = estimate_step(source, target, turned, LAST, PARAMETERS)
    assert record.spread == pytest.approx(spread_ratio(ahead, [1.0, 0.0]), rel=0.01)


# An L of two walls; in the newer scan a part of it is seen 0.3 m before the wall, as behind
# a curtain. A gate of 0.5 m pairs the curtain with the wall, one of 0.25 m does not.
PLACE = np.linspace(0.0, 4.0, 81)
WALLS = np.vstack(
    [np.column_stack([PLACE, np.full(81, -2.0)]), np.column_stack([np.full(81, 5.0), PLACE])]
)
CURTAINED = Scan.from_points(np.vstack([WALLS, np.column_stack([PLACE, 0 * PLACE - 1.7])[::3]]))
BY_POINTS = IcpParameters(overlap_ratio=1.0, huber_delta=math.inf)


def test_the_retry_succeeds_where_the_first_match_failed():
    strict = replace(limited(max_rmse=0.05), icp=BY_POINTS)
    record = estimate_step(CURTAINED, Target(WALLS), None, STILL, strict)
    assert record.decision is Decision.RETRY
    assert record.reason.startswith("icp: RMSE 0.")
    np.testing.assert_allclose(record.increment, STILL, atol=1e-6)
    assert record.inlier_count == len(WALLS)
    assert strict.retry == replace(BY_POINTS, max_correspondence_distance=0.25, step_fraction=0.5)


@pytest.mark.parametrize(
    ("prior", "decision", "increment"),
    [(PRIOR, Decision.PRIOR, PRIOR), (None, Decision.HOLD, LAST)],
)
def test_the_last_resort(prior, decision, increment):
    source, target = looks(room())
    for newer, older, why in (
        (source, target, "icp: RMSE"),
        (EMPTY, target, "the newer scan has fewer than 3 points"),
        (source.select(np.arange(2)), target, "the newer scan has fewer than 3 points"),
        (source, None, "the older scan has fewer than 3 points"),
    ):
        record = estimate_step(newer, older, prior, LAST, limited(max_rmse=1e-9))
        assert record.decision is decision
        np.testing.assert_array_equal(record.increment, increment)
        assert record.reason.startswith(why)
    assert record.inlier_count == 0
    assert math.isnan(record.rmse)
    assert record.termination is None


def test_no_motion_is_no_motion_to_hold():
    """A record of HOLD promises that the robot kept going."""
    for motion, decision in ((STILL, Decision.STAND), (LAST * [0, 0, 1], Decision.HOLD)):
        record = estimate_step(EMPTY, Target(WALLS), None, motion, PARAMETERS)
        assert record.decision is decision
        np.testing.assert_array_equal(record.increment, motion)


@pytest.mark.parametrize(
    ("limits", "complaint"),
    [
        ({"max_translation": 0.05}, "translation 0.11 m > 0.05 m"),
        ({"max_prior_rotation": 1e-3}, "rotation from the prior"),
        ({"min_inlier_ratio": 1.0}, "< 1.000"),
        ({"max_rmse": 0.001}, "m > 0.001 m"),
    ],
)
def test_each_check_sends_the_step_to_the_prior(limits, complaint):
    record = estimate_step(*looks(room()), PRIOR, LAST, limited(**limits))
    assert record.decision is Decision.PRIOR
    for attempt, reason in zip(("icp", "retry"), record.reason.split("; "), strict=True):
        assert reason.startswith(attempt + ": ")
        assert complaint in reason


def test_the_turn_from_the_prior_is_measured_across_the_cut_at_pi():
    turned, prior = np.array([0.0, 0.0, 3.12]), np.array([0.0, 0.0, -3.13])
    record = estimate_step(*looks(room(), turned), prior, LAST, PARAMETERS)
    assert record.decision is Decision.ICP


def test_a_failed_match_is_its_own_complaint():
    record = estimate_step(*looks(room()), np.array([50.0, 0.0, 0.0]), LAST, LESSON)
    assert record.decision is Decision.PRIOR
    message = Termination.TOO_FEW_CORRESPONDENCES.value
    assert record.reason == f"icp: {message}; retry: {message}"
    assert math.isnan(record.information)


@pytest.mark.parametrize("budget", [1, 2, 3])
def test_a_match_agrees_no_less_than_not_at_all_wherever_its_budget_ended(budget):
    """Pairs of the far phase lie up to half a metre apart: they cost more than none near by."""
    source, target = looks(room())
    told = replace(LESSON, icp=replace(LESSON.icp, max_iterations=budget))
    prior = MOTION + np.array([1.0, 0.0, 0.0])
    record = estimate_step(source, target, prior, LAST, told)
    assert (
        icp(source, target, from_xytheta(prior), told.icp).coarse_poses == budget + 1
    )  # every pose
    assert record.agreement == pytest.approx(-0.5 * record.seen_through, abs=1e-12)


def test_a_failed_first_match_does_not_hide_what_the_search_finds():
    """From 50 m off, ICP has no pairs. The search looks around the last pose."""
    record = estimate_step(*looks(room()), None, np.array([50.0, 0.0, 0.0]), PARAMETERS)
    assert record.decision is Decision.SEARCH
    np.testing.assert_allclose(record.increment, MOTION, atol=0.006)
    assert record.agreement > 0.9


@pytest.mark.parametrize("support", [1.0, 0.7, 0.5])
@pytest.mark.parametrize(
    "off", [[0, 0, 70.0], [0, 0, 100.0], [1.5, 0, 0], [2.5, 0, 0], [50.0, 0, 0]]
)
@pytest.mark.parametrize("usual", [False, True])
def test_wheels_are_overridden_by_one_law(off, support, usual):
    """Wheels that are unlike the last motions yield to support; wheels that are usual never do.

    A part of the newer scan is new, and has no support.
    """
    source, target = looks(room())
    behind = source.points[:: round(1 / (1 / support - 1))] * 2.0 if support < 1.0 else EMPTY.points
    newer, prior = Scan.from_points(np.vstack([source.points, behind])), MOTION + degrees(off)
    record = estimate_step(newer, target, prior, prior if usual else LAST, PARAMETERS)
    wins = record.agreement >= 0.5 and not usual
    assert record.decision.matched == record.against_prior == wins
    if wins:
        np.testing.assert_allclose(record.increment, MOTION, atol=0.01)
        assert "from the prior" in record.reason


@pytest.mark.parametrize("off", [[0.1, 0, 0], [0.4, 0, 0], [0, 0, 12.0]])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_doubtful_match_must_lie_as_near_to_the_wheels_as_sure_ones_did(off, share):
    source, target = looks(room())
    seen = np.arange(len(source)) % 10 < 10 * share
    newer = Scan.from_points(np.vstack([source.points[seen], 2.0 * source.points[~seen]]))
    prior, near = MOTION + degrees(off), Trust(apart=(0.02,) * 20)
    records = [
        estimate_step(newer, target, prior, LAST, PARAMETERS, trust) for trust in (Trust(), near)
    ]
    assert records[0].decision.matched
    assert records[1].decision.matched == (off[0] < 0.2 or not records[0].is_doubtful)
    assert records[0].is_doubtful == (share < 0.5)


def test_along_a_corridor_wheels_that_jump_lose_their_turn():
    jump = MOTION + np.array([0.0, 0.0, math.radians(80.0)])
    record = estimate_step(*looks(corridor(), rng=1), jump, LAST, PARAMETERS)
    assert record.against_prior
    assert record.degenerate
    assert record.increment[0] == pytest.approx(LAST[0], abs=0.01)
    assert record.increment[1:] == pytest.approx(MOTION[1:], abs=0.006)


def test_inside_the_window_around_a_prior_no_absolute_limit_applies():
    told = replace(PARAMETERS, limits=SanityLimits(max_translation=0.05))
    newer, target = looks(room())
    assert estimate_step(newer, target, PRIOR, LAST, told).decision is Decision.ICP
    record = estimate_step(newer, target, None, LAST, told)
    assert record.decision is Decision.HOLD
    assert "translation 0.11 m > 0.05 m" in record.reason
    free = SanityLimits(max_translation=math.inf, max_prior_translation=math.inf)
    for scan in (newer, EMPTY):
        record = estimate_step(scan, target, PRIOR, LAST, replace(PARAMETERS, limits=free))
        assert np.isfinite(record.covariance).all()


def test_a_corridor_is_believed_with_a_prior_and_not_without():
    source, target = looks(corridor(), rng=1)
    with_prior = estimate_step(source, target, PRIOR, LAST, PARAMETERS)
    assert with_prior.decision is Decision.ICP
    assert with_prior.degenerate
    assert with_prior.increment[0] == pytest.approx(PRIOR[0], abs=0.01)
    assert with_prior.increment[1:] == pytest.approx(MOTION[1:], abs=0.006)
    without = estimate_step(source, target, None, LAST, LESSON)
    assert without.decision is Decision.HOLD
    assert "degenerate: information" in without.reason
    by_points = replace(PARAMETERS, icp=IcpParameters())
    assert estimate_step(source, target, PRIOR, LAST, by_points).decision is Decision.PRIOR
    assert not estimate_step(source, target, None, LAST, by_points).decision.matched


def test_steps_are_in_the_frame_of_the_older_scan():
    """Source points seen from where the robot stands now: T_target_source, not its inverse."""
    points = np.random.default_rng(6).uniform(-4.0, 4.0, (100, 2))
    newer = Scan.from_points(apply(invert(transform(0.1, 0.0, 0.05)), points))
    by_points = replace(PARAMETERS, icp=IcpParameters())
    record = estimate_step(newer, Target(points), STILL, STILL, by_points)
    np.testing.assert_allclose(record.increment, [0.1, 0.0, 0.05], atol=1e-9)


@pytest.mark.parametrize(
    ("scores", "complained", "taken"),
    [
        ([0.5, 0.6, 0.4], [], 1),  # the best
        ([-math.inf, 0.6], [0], 1),
        ([-math.inf, 0.6], [0, 1], 1),
        ([0.6, 0.6 - ALIKE + 2 * SAME], [0], 1),  # as good, and passes
        ([0.6, 0.6 - ALIKE], [0], 0),  # worse
        ([0.6, 0.59], [0, 1], 0),  # none passes
        ([0.6, 0.6 + 0.9 * SAME], [], 0),  # alike: whichever was first
    ],
)
def test_the_best_match(scores, complained, taken):
    step = _Step(CURTAINED, Target(WALLS), np.eye(3), None, np.eye(3)[None], PARAMETERS)
    record, tried = StepRecord(increment=STILL, decision=Decision.ICP), []
    for k, score in enumerate(scores):
        T = transform(k, 0.0, 0.0) if score > -math.inf else np.full((3, 3), math.nan)
        tried.append(_Match(record, T, ["too far"] * (k in complained), score))
    assert step.choose(tried).T_target_source is tried[taken].T_target_source


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("against", "x", "`against` must be one of scan, map, got 'x'"),
        ("search", 1, "`search` must be"),
    ],
)
def test_bad_parameters(name, value, message):
    with pytest.raises(InvalidParameterError) as caught:
        OdometryParameters(**{name: value})
    assert str(caught.value).startswith(message)
