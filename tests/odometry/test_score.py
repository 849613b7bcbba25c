"""The score of a match, and the choice among several."""

import math

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target, icp
from labkit.correspondences import huber_loss
from labkit.odometry import propose as proposing
from labkit.odometry.constants import (
    CLEARANCE,
    LEAST_WHEEL_ERROR,
    LOOKED_THROUGH_COST,
    WHEEL_COST,
)
from labkit.odometry.map_odometry import choose, is_plainly_better, margin_of
from labkit.odometry.match import Match
from labkit.odometry.propose import propose
from labkit.odometry.record import Scales
from labkit.odometry.score import bearing, score, share_looked_through
from labkit.parameters import ACCURATE
from labkit.se2 import from_xytheta, transform
from labkit.simulation import Lidar, cast, room

STILL = np.zeros(3)
MOTION = np.array([0.1, 0.05, math.radians(3.0)])


SCALES = Scales(*LEAST_WHEEL_ERROR, 1.0, 0.9, 1.0, 2.0, math.pi / 2.0)


def expect(T_map_last, prior, motions, T_last_refused=None, scales=SCALES):
    return proposing.expect(T_map_last, prior, motions, scales, T_last_refused)


def two_scans():
    rng = np.random.default_rng(0)
    older, newer = (cast(room(), from_xytheta(x), Lidar(), rng=rng) for x in (STILL, MOTION))
    return newer, Target(older)


def looked_through(source, target, T):
    source, target = (Scan.from_points(points).points for points in (source, target))
    return share_looked_through(source, target, T)


def test_beams_look_through_a_wall_that_is_not_there():
    wall = np.column_stack([np.full(41, 4.0), np.linspace(-1.0, 1.0, 41)])
    curtain = wall * [0.5, 0.4]

    assert looked_through(wall, wall, np.eye(3)) == 0.0
    assert looked_through(wall, curtain, np.eye(3)) == 1.0
    both = np.vstack([wall, curtain])
    assert looked_through(wall, both, np.eye(3)) == pytest.approx(0.5, abs=0.02)


def test_nobody_knows_what_is_hidden_or_out_of_view():
    wall = np.column_stack([np.full(41, 4.0), np.linspace(-1.0, 1.0, 41)])
    hidden = wall + np.array([9.0, 0.0])

    assert math.isnan(looked_through(wall, hidden, np.eye(3)))
    assert math.isnan(looked_through(wall, -wall, np.eye(3)))


@pytest.mark.parametrize("count", [4, 41, 72, 360, 361])
def test_a_point_on_a_beam_lies_between_that_beam_and_the_one_before(count):
    """As a search among all bearings tells, however they round: ±180° are the ends of the line."""
    angles = np.linspace(-math.pi, math.pi, count)
    ring = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    x, y = np.indices((9, 9)) - 4.0
    bearings = np.sort([bearing(*point) for point in ring])

    for point in [*ring, *np.column_stack([x.ravel(), y.ravel()])]:
        k = np.searchsorted(bearings, bearing(*point))
        is_in_view = 0 < k < count and math.hypot(*point) < 3.0 + CLEARANCE
        assert np.isfinite(looked_through(ring, [point], np.eye(3))) == is_in_view


def test_beams_are_looked_along_from_the_pose():
    wall = np.column_stack([np.full(41, 4.0), np.linspace(-1.0, 1.0, 41)])
    back = from_xytheta([-2.0 * CLEARANCE, 0.0, 0.0])
    nearer_wall = wall - np.array([2.0 * CLEARANCE, 0.0])

    assert looked_through(wall, nearer_wall, back) == 0.0  # the wall moved along
    assert looked_through(wall, nearer_wall, np.eye(3)) > 0.9


def test_a_bearing_grows_as_the_angle_does():
    """From −π to π, its ends and the axes included."""
    angles = np.array([-math.pi, *np.random.default_rng(0).uniform(-math.pi, math.pi, 99), math.pi])
    x, y = np.cos(angles), np.sin(angles)
    x[[0, -1]], y[[0, -1]] = -1.0, [-0.0, 0.0]
    bearings = [bearing(*point) for point in zip(x, y, strict=True)]

    np.testing.assert_array_equal(np.argsort(bearings), np.argsort(angles))
    assert [bearing(*axis) for axis in np.eye(2)] == [0.0, 1.0]
    assert (min(bearings), max(bearings)) == (-2.0, 2.0)


def test_the_score_is_the_formula():
    """(5.3), each term by itself; beyond the gate of 8 δ a point costs as at the gate."""
    newer, target = two_scans()
    result = icp(newer, target, from_xytheta(MOTION), ACCURATE)
    expected = expect(np.eye(3), MOTION + np.array([0.3, 0.0, 0.1]), np.zeros((1, 3)))

    found = score(result, expected)

    fit = 1.0 - result.cost / huber_loss(8 * ACCURATE.huber_delta, ACCURATE.huber_delta)
    T = np.array(result.T_target_source)
    through = share_looked_through(newer.points, target.points, T)
    u = expected.distance(T)[0]
    assert found.agreement == pytest.approx(fit - LOOKED_THROUGH_COST * through, rel=1e-12)
    assert found.score == pytest.approx(found.agreement - WHEEL_COST * math.log(1.0 + u), rel=1e-12)


@pytest.mark.parametrize("budget", [1, 2])
def test_no_match_agrees_less_than_not_at_all_wherever_its_budget_ended(budget):
    """Coarse pairs lie up to half a metre apart: they cost more than none near by."""
    newer, target = two_scans()
    told = IcpParameters(metric="point_to_line", huber_delta=0.02, max_iterations=budget)
    result = icp(newer, target, from_xytheta([1.0, 0.0, 0.0]), told)

    found = score(result, expect(np.eye(3), None, np.zeros((1, 3))))

    assert found.agreement >= -LOOKED_THROUGH_COST


def test_a_failed_match_has_no_score():
    newer, target = two_scans()
    result = icp(newer, target, from_xytheta([50.0, 0.0, 0.0]), ACCURATE)

    assert score(result, expect(np.eye(3), MOTION, np.zeros((1, 3)))).score == -math.inf


@pytest.mark.parametrize("prior", [MOTION, None])
def test_an_expected_pose_costs_nothing_and_one_ten_times_as_far_a_step_more(prior):
    expected = expect(np.eye(3), prior, np.array([MOTION, STILL]))

    costs = [expected.cost(transform(x, 0.0, 0.0)) for x in (1e2, 1e3, 1e4)]

    assert expected.cost(from_xytheta(MOTION)) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.diff(costs), expected.cost_scale * math.log(100.0), rtol=1e-2)


def test_a_refused_match_is_gone_back_to_at_a_small_cost():
    T_last_refused = transform(1.0, 0.0, 1.0)
    expected = expect(np.eye(3), MOTION, np.zeros((1, 3)), T_last_refused)

    back = expected.cost(T_last_refused @ from_xytheta(MOTION))

    assert 0.0 < back < 0.3 * WHEEL_COST
    np.testing.assert_allclose(expected.poses[1], T_last_refused @ from_xytheta(MOTION))


def test_wheels_are_the_less_sure_the_farther_they_drove():
    off = transform(0.2, 0.0, 0.0)
    near, far = (np.array([x, 0.0, 0.0]) for x in (0.1, 1.0))
    costs = [
        expect(np.eye(3), prior, np.zeros((1, 3))).cost(from_xytheta(prior) @ off)
        for prior in (near, far)
    ]

    assert costs[0] > costs[1]


def test_the_less_sure_the_wheels_the_higher_the_score_that_needs_no_search():
    motions = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [9.0, 0.0, 0.0])

    sure = [expect(np.eye(3), np.array(prior), np.zeros((1, 3))).sure_score for prior in motions]

    alone = expect(np.eye(3), None, np.zeros((3, 3))).sure_score
    assert 0.0 < sure[0] < sure[1] < sure[2] < sure[3] == alone


def test_nothing_is_searched_for_unless_it_is_asked_for(monkeypatch):
    def refuse(*_):
        raise AssertionError("searched")

    monkeypatch.setattr("labkit.odometry.propose.search", refuse)
    newer, target = two_scans()
    expected = expect(np.eye(3), MOTION, np.zeros((1, 3)))
    rounds = propose(newer, target, expected, (2.0, math.pi / 2.0))

    np.testing.assert_allclose(next(rounds), [from_xytheta(MOTION)])
    with pytest.raises(AssertionError, match="searched"):
        next(rounds)


@pytest.mark.parametrize(
    ("agreement", "error", "leads"),
    [(0.5, 1.0, False), (0.5, 2.0, True), (0.7, 2.0, False), (0.4, 1.0, True)],
)
def test_wheels_that_matches_bear_out_lead_only_where_scans_fit_less(agreement, error, leads):
    """A sparse scanner fits little, and well."""
    shift, turn = LEAST_WHEEL_ERROR

    scales = SCALES._replace(wheel_shift=error * shift, wheel_turn=turn, agreement=agreement)

    assert scales.wheels_lead == leads


def test_where_a_refused_match_ended_is_tried_in_the_first_round_too():
    """A corridor fits as well after wheels that slipped: a match there looks sure."""
    newer, target = two_scans()
    T_last_refused = transform(1.0, 0.0, 1.0)
    expected = expect(np.eye(3), MOTION, np.zeros((1, 3)), T_last_refused)

    first = next(propose(newer, target, expected, (2.0, math.pi / 2.0)))

    np.testing.assert_allclose(first, [np.eye(3), T_last_refused] @ from_xytheta(MOTION))


@pytest.mark.parametrize(
    ("prior", "around", "shift", "turn"),
    [
        (None, [0.0, 0.0, 0.0], 1.5 * 4.0, 1.5 * 2.0),
        ([8.0, 0.0, 0.0], [8.0, 0.0, 0.0], 9.0 * 0.03 * (1.0 + 8.0 / 0.5), math.pi / 2.0),
        ([0.1, 0.0, 1.8], [0.1, 0.0, 1.8], 2.0, 1.5 * 1.8),
    ],
)
def test_a_search_looks_around_the_wheels_as_far_as_they_err(
    monkeypatch, prior, around, shift, turn
):
    asked = []
    monkeypatch.setattr("labkit.odometry.propose.search", lambda *each: asked.append(each) or [])
    newer, target = two_scans()
    told = None if prior is None else np.array(prior)
    expected = expect(np.eye(3), told, np.array([[0.1, 0.0, 2.0], [4.0, 0.0, 0.0]]))

    list(propose(newer, target, expected, (2.0, math.pi / 2.0)))

    ((_, _, T, window),) = asked
    np.testing.assert_allclose(T, from_xytheta(around))
    assert window == pytest.approx((shift, turn))


def matches_of(*scores):
    """Matches that end a metre apart, of these scores, which are their agreements."""
    newer, target = two_scans()
    result = icp(newer, target, from_xytheta(MOTION), ACCURATE)
    found = []
    for k, value in enumerate(scores):
        moved = np.array([transform(float(k), 0.0, 0.0)])
        fields = {name: getattr(result, name) for name in ("source", "target", "parameters")}
        ended = type(result)(poses=moved, termination=result.termination, coarse_poses=0, **fields)
        found.append(Match(ended, value, value))
    return found


@pytest.mark.parametrize(
    ("scores", "taken", "margin"),
    [
        ([0.5, 0.6, 0.4], 1, 0.1),
        ([-math.inf, 0.6], 1, math.nan),
        ([0.4, 0.6, 0.6], 1, 0.0),
        ([0.6, 0.0], 0, math.nan),
    ],
)
def test_the_highest_score_is_chosen_and_the_first_of_equals(scores, taken, margin):
    matches = matches_of(*scores)

    best = choose(matches)

    assert best is matches[taken]
    assert margin_of(best, matches) == pytest.approx(margin, nan_ok=True)


@pytest.mark.parametrize(
    ("scores", "is_believed"),
    [
        ([0.3, 0.7], True),
        ([0.5, 0.7], False),
        ([0.3, 0.7, 0.66], False),
        ([-0.9, 0.4], False),  # it hardly agrees
    ],
)
def test_far_from_the_wheels_a_match_is_believed_if_it_is_plainly_better_and_alone(
    scores, is_believed
):
    matches = matches_of(*scores)
    expected = expect(np.eye(3), STILL, np.zeros((1, 3)))

    assert is_plainly_better(matches[1], matches[0], matches, expected) == is_believed


def test_a_match_that_goes_on_from_a_refused_one_may_agree_less():
    matches = matches_of(-0.9, 0.4)
    expected = expect(np.eye(3), STILL, np.zeros((1, 3)), transform(1.05, 0.0, 0.0))

    assert is_plainly_better(matches[1], matches[0], matches, expected)


@pytest.mark.parametrize("refused", [None, transform(4.0, 0.0, 0.0)])
@pytest.mark.parametrize("off", [[1.9, 0, 1.5], [2.1, 0, 0], [0, 0, 1.6]])
def test_wheels_err_by_no_more_than_a_step_however_many_were_missed(off, refused):
    """Nor do they if they go on from a refused match, 4 m away."""
    scales = SCALES._replace(steps=6.0)
    start = np.eye(3) if refused is None else refused
    expected = expect(np.eye(3), MOTION, np.zeros((1, 3)), refused, scales)

    is_allowed = expected.allows(start @ from_xytheta(MOTION) @ from_xytheta(off))

    assert is_allowed == (off == [1.9, 0, 1.5])
    assert not expected.allows(np.full((3, 3), np.nan))
    assert expect(np.eye(3), None, np.zeros((1, 3))).allows(from_xytheta([9.0, 0.0, 3.0]))
