"""One step: the match, the checks, and the fallbacks in their stated order."""

import math
from dataclasses import replace

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target, Termination, icp
from labkit.degeneracy import observability, spread_ratio
from labkit.errors import InvalidParameterError
from labkit.odometry import (
    Decision,
    OdometryParameters,
    SanityLimits,
    StepRecord,
    estimate_step,
)
from labkit.odometry.expectation import Expectation
from labkit.odometry.free_space import seen_through
from labkit.odometry.step import (
    ALIKE,
    AT_TARGET,
    SAME,
    SURPRISE,
    _agreement,
    _best,
    _Match,
    _Pair,
)
from labkit.se2 import apply, from_xytheta, invert, to_xytheta, transform
from labkit.simulation import Lidar, cast, corridor, room

STILL = np.zeros(3)
LAST = np.array([0.02, 0.0, 0.01])
MOTION = np.array([0.1, 0.05, math.radians(3.0)])
PRIOR = MOTION + np.array([0.02, -0.01, 0.005])
PARAMETERS = OdometryParameters()
EMPTY = Scan.from_ranges([math.inf], [0.0])


def looks(world, motion=MOTION, rng=0):
    """The newer scan and the prepared older one."""
    rng = np.random.default_rng(rng)
    older, newer = (cast(world, from_xytheta(x), Lidar(), rng=rng) for x in (STILL, motion))
    return newer, Target(older)


def no_way(**limits):
    """Parameters under which no match is ever believed."""
    return replace(PARAMETERS, limits=SanityLimits(max_rmse=1e-9), search=False, **limits)


def test_a_good_match_is_taken_and_its_numbers_are_the_matchs():
    source, target = looks(room())
    record = estimate_step(source, target, PRIOR, LAST, PARAMETERS)
    result = icp(source, target, from_xytheta(PRIOR), PARAMETERS.icp)
    increment = to_xytheta(result.T_target_source)
    seen = observability(result.correspondences, target)
    assert record.decision is Decision.ICP
    assert record.reason == ""
    np.testing.assert_array_equal(record.increment, increment)
    np.testing.assert_allclose(record.increment, MOTION, atol=0.006)
    assert record.inlier_count == result.inlier_count
    assert record.inlier_ratio == result.fitness
    assert record.rmse == result.inlier_rmse
    assert record.cost == result.cost
    assert record.seen_through == seen_through(source, target.points, result.T_target_source)
    assert record.rotation == abs(increment[2])
    assert record.information == result.observability.values[0]
    assert record.information == pytest.approx(seen.values[0], rel=1e-9)
    assert not record.degenerate
    assert record.iterations == result.iterations
    assert record.termination is result.termination


@pytest.mark.parametrize("turn", [0.0, 20.0, 45.0, 80.0])
def test_the_spread_does_not_depend_on_how_far_the_robot_turned(turn):
    """The newer scan is the same points, turned: the corridor is as narrow as it was."""
    driven = np.array([0.3, 0.0, 0.0])
    turned = np.array([0.3, 0.0, math.radians(turn)])
    ahead, target = looks(corridor(), driven)
    source = Scan.from_points(apply(from_xytheta([0.0, 0.0, -turned[2]]), ahead.points))
    record = estimate_step(source, target, turned, LAST, PARAMETERS)
    np.testing.assert_allclose(record.increment, turned, atol=0.01)
    assert record.spread == pytest.approx(spread_ratio(ahead, [1.0, 0.0]), rel=0.01)


def test_without_a_prior_the_last_motion_is_the_guess():
    """A jump that only a near guess reaches; whoever stands on a skip starts from rest."""
    jump = np.array([0.9, 0.0, math.radians(75.0)])
    source, target = looks(room(), jump)
    held = estimate_step(source, target, None, jump, PARAMETERS)
    assert held.decision is Decision.ICP
    np.testing.assert_allclose(held.increment, jump, atol=0.006)
    from_rest = replace(PARAMETERS, on_skip="stand", search=False)
    stood = estimate_step(source, target, None, jump, from_rest)
    assert np.abs(stood.increment - jump).max() > 0.1


# An L of two walls; in the newer scan a part of it is seen 0.3 m before the wall, as behind
# a curtain. A gate of 0.5 m pairs the curtain with the wall, one of 0.25 m does not.
PLACE = np.linspace(0.0, 4.0, 81)
WALLS = np.vstack(
    [np.column_stack([PLACE, np.full(81, -2.0)]), np.column_stack([np.full(81, 5.0), PLACE])]
)
CURTAIN = np.column_stack([PLACE[::3], np.full(27, -1.7)])
CURTAINED = Scan.from_points(np.vstack([WALLS, CURTAIN]))
STRICT = OdometryParameters(
    search=False,
    icp=IcpParameters(overlap_ratio=1.0, huber_delta=math.inf),
    limits=SanityLimits(max_rmse=0.05),
)


def test_the_retry_succeeds_where_the_first_match_failed():
    record = estimate_step(CURTAINED, Target(WALLS), None, STILL, STRICT)
    assert record.decision is Decision.RETRY
    assert record.reason.startswith("icp: RMSE 0.")
    assert record.reason.endswith(" m > 0.050 m")
    np.testing.assert_allclose(record.increment, STILL, atol=1e-6)
    assert record.inlier_count == len(WALLS)
    first = icp(CURTAINED, WALLS, None, STRICT.icp)
    assert first.inlier_rmse > 0.05


def test_the_retry_has_a_smaller_gate_and_smaller_steps():
    parameters = replace(STRICT, retry_gate=0.4, retry_step=0.25)
    assert parameters.retry == replace(
        STRICT.icp, max_correspondence_distance=0.2, step_fraction=0.25
    )
    unreduced = replace(STRICT, retry_gate=1.0)
    record = estimate_step(CURTAINED, Target(WALLS), None, LAST, unreduced)
    assert record.decision is Decision.HOLD
    first, second = record.reason.split("; ")
    assert first.startswith("icp: RMSE")
    assert second.startswith("retry: RMSE")


@pytest.mark.parametrize(
    ("prior", "on_skip", "decision", "increment"),
    [
        (PRIOR, "hold", Decision.PRIOR, PRIOR),
        (PRIOR, "stand", Decision.PRIOR, PRIOR),
        (None, "hold", Decision.HOLD, LAST),
        (None, "stand", Decision.STAND, STILL),
    ],
)
def test_the_last_resort(prior, on_skip, decision, increment):
    source, target = looks(room())
    for newer, older, why in (
        (source, target, "icp: RMSE"),
        (EMPTY, target, "the newer scan has fewer than 3 points"),
        (source.select(np.arange(2)), target, "the newer scan has fewer than 3 points"),
        (source, None, "the older scan has fewer than 3 points"),
    ):
        record = estimate_step(newer, older, prior, LAST, no_way(on_skip=on_skip))
        assert record.decision is decision
        np.testing.assert_array_equal(record.increment, increment)
        assert record.reason.startswith(why)
    assert record.inlier_count == 0
    assert math.isnan(record.rmse)
    assert record.termination is None


def test_no_motion_is_no_motion_to_hold():
    """Whatever `on_skip` says: a record of HOLD promises that the robot kept going."""
    for motion, decision in ((STILL, Decision.STAND), (LAST * [0, 0, 1], Decision.HOLD)):
        record = estimate_step(EMPTY, Target(WALLS), None, motion, no_way(on_skip="hold"))
        assert record.decision is decision
        np.testing.assert_array_equal(record.increment, motion)


def test_decisions_know_their_kind():
    matched = {Decision.ICP, Decision.RETRY, Decision.SEARCH}
    assert {d for d in Decision if d.matched} == matched
    assert {d for d in Decision if d.skipped} == {Decision.HOLD, Decision.STAND}


@pytest.mark.parametrize(
    ("limits", "complaint"),
    [
        ({"max_translation": 0.05}, "translation 0.11 m > 0.05 m"),
        ({"max_rotation": 0.01}, "rotation 3.0° > 0.6°"),
        ({"max_prior_translation": 1e-3}, "m from the prior > 0.00 m"),
        ({"max_prior_rotation": 1e-3}, "° from the prior > 0.1°"),
        ({"min_inlier_ratio": 1.0}, "< 1.000"),
        ({"max_rmse": 0.001}, "m > 0.001 m"),
    ],
)
def test_each_check_sends_the_step_to_the_prior(limits, complaint):
    source, target = looks(room())
    parameters = replace(PARAMETERS, limits=SanityLimits(**limits), search=False)
    record = estimate_step(source, target, PRIOR, LAST, parameters)
    assert record.decision is Decision.PRIOR
    for attempt, reason in zip(("icp", "retry"), record.reason.split("; "), strict=True):
        assert reason.startswith(attempt + ": ")
        assert complaint in reason


def test_a_failed_match_is_its_own_complaint():
    source, target = looks(room())
    far_off = np.array([50.0, 0.0, 0.0])
    record = estimate_step(source, target, far_off, LAST, replace(PARAMETERS, search=False))
    assert record.decision is Decision.PRIOR
    message = Termination.TOO_FEW_CORRESPONDENCES.value
    assert record.reason == f"icp: {message}; retry: {message}"
    assert record.termination is Termination.TOO_FEW_CORRESPONDENCES
    assert math.isnan(record.information)
    assert math.isnan(record.rotation)


def test_a_corridor_is_believed_with_a_prior_and_not_without():
    source, target = looks(corridor(), rng=1)
    with_prior = estimate_step(source, target, PRIOR, LAST, PARAMETERS)
    assert with_prior.decision is Decision.ICP
    assert with_prior.degenerate
    assert with_prior.increment[0] == pytest.approx(PRIOR[0], abs=0.01)
    assert with_prior.increment[1:] == pytest.approx(MOTION[1:], abs=0.006)
    alone = replace(PARAMETERS, search=False)
    without = estimate_step(source, target, None, LAST, alone)
    assert without.decision is Decision.HOLD
    assert without.degenerate
    assert "degenerate: information 0.00" in without.reason
    by_points = replace(PARAMETERS, icp=IcpParameters())
    assert estimate_step(source, target, PRIOR, LAST, by_points).decision is Decision.PRIOR


def test_a_room_far_from_degenerate_can_be_called_so_by_the_limit():
    source, target = looks(room())
    demanding = replace(PARAMETERS, limits=SanityLimits(min_information=0.5), search=False)
    record = estimate_step(source, target, None, STILL, demanding)
    assert record.decision is Decision.STAND
    assert record.degenerate
    assert "< 0.500" in record.reason


def test_steps_are_in_the_frame_of_the_older_scan():
    """Source points seen from where the robot stands now: T_target_source, not its inverse."""
    points = np.random.default_rng(6).uniform(-4.0, 4.0, (100, 2))
    T = transform(0.1, 0.0, 0.05)
    by_points = replace(PARAMETERS, icp=IcpParameters(), limits=SanityLimits(min_information=0.0))
    newer = Scan.from_points(apply(invert(T), points))
    record = estimate_step(newer, Target(points), None, STILL, by_points)
    np.testing.assert_allclose(record.increment, [0.1, 0.0, 0.05], atol=1e-9)


def ended(place, score, *complaints):
    """A match that ended at `place` [m] ahead, with that score."""
    T, motions = transform(place, 0.0, 0.0), STILL[None]
    pair = _Pair(EMPTY, Target(WALLS), AT_TARGET, None, motions, PARAMETERS)
    record = StepRecord(increment=to_xytheta(T), decision=Decision.ICP)
    agreement = score + SURPRISE * Expectation(motions, AT_TARGET).unlikeliness(T)
    return _Match(record, list(complaints), T, agreement, pair)


LITTLE = 1e-3


@pytest.mark.parametrize(
    ("tried", "taken"),
    [
        ([ended(0, 0.5), ended(1, 0.6), ended(2, 0.4)], 1),  # the highest score
        ([ended(0, 0.6, "too far"), ended(1, 0.6 - ALIKE + LITTLE)], 1),  # as good, and passes
        ([ended(0, 0.6, "too far"), ended(1, 0.6 - ALIKE - LITTLE)], 0),  # worse
        ([ended(0, 0.6, "too far"), ended(1, 0.59, "too far")], 0),  # none passes
        ([ended(0, 0.6), ended(0.01, 0.6 + SAME - LITTLE)], 0),  # one place: who was first
        ([ended(0, 0.6), ended(0.01, 0.6 + SAME + LITTLE)], 1),
        ([ended(0, 0.6, "too far"), ended(0.01, 0.6 + SAME - LITTLE)], 1),
        ([ended(1, 0.6), ended(0.01, 0.6 + SAME - LITTLE)], 1),  # another place
    ],
)
def test_the_best_match(tried, taken):
    assert _best(tried) is tried[taken]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("retry_gate", 0.0, "`retry_gate` must be in (0, 1], got 0.0"),
        ("retry_gate", 1.5, "`retry_gate` must be in (0, 1], got 1.5"),
        ("retry_step", math.nan, "`retry_step` must be in (0, 1], got nan"),
        ("on_skip", "jump", "`on_skip` must be one of hold, stand, got 'jump'"),
    ],
)
def test_bad_parameters(name, value, message):
    with pytest.raises(InvalidParameterError) as caught:
        OdometryParameters(**{name: value})
    assert str(caught.value) == message


def test_without_a_search_the_last_try_that_fails_is_on_record():
    source, target = looks(room())
    record = estimate_step(source, target, PRIOR, LAST, no_way())
    retried = icp(source, target, from_xytheta(PRIOR), no_way().retry)
    assert (record.iterations, record.inlier_count) == (retried.iterations, retried.inlier_count)


def test_three_points_are_matched_two_are_not():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    by_points = OdometryParameters(icp=IcpParameters(overlap_ratio=1.0), search=False)
    three = Scan.from_points(corner)
    matched = estimate_step(three, Target(three), STILL, STILL, by_points)
    assert matched.termination is Termination.CONVERGED_POSE
    two = estimate_step(Scan.from_points(corner[:2]), Target(three), STILL, STILL, by_points)
    assert two.reason == "the newer scan has fewer than 3 points"


def test_agreement_by_hand():
    """1 where all points lie on the target, 0 where none has a partner, less where seen through."""
    told = IcpParameters(max_correspondence_distance=0.5, huber_delta=0.1)
    nothing = 2 * 0.1 * 0.5 - 0.1**2
    for cost, through, expected in (
        (0.0, 0.0, 1.0),
        (nothing, 0.0, 0.0),
        (nothing / 4, 0.5, 0.5),
        (nothing / 4, math.nan, 0.75),
    ):
        assert _agreement(cost, through, told) == pytest.approx(expected, abs=1e-12)
