"""The lab's odometry: what is proposed, what is chosen, and what a drive makes of it."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target
from labkit.covariance import fuse
from labkit.evaluation import ate
from labkit.icp import icp
from labkit.odometry import (
    Decision,
    MapOdometry,
    OdometryParameters,
    SanityLimits,
    estimate_odometry,
    increments_between,
    integrate,
)
from labkit.odometry.constants import HISTORY
from labkit.odometry.local_map import LocalMap
from labkit.odometry.map_odometry import MapState, why_ignored
from labkit.odometry.match import Match
from labkit.odometry.record import Check, Evidence, Scales, StepRecord, on_matched_points
from labkit.odometry.scales import History, growth_of
from labkit.odometry.score import Score
from labkit.parameters import ACCURATE
from labkit.se2 import apply, from_xytheta, invert
from labkit.simulation import (
    Lidar,
    WheelNoise,
    World,
    cast,
    corridor,
    room,
    scan_along,
    wheel_increments,
)
from labkit.simulation.world import polyline
from labkit.support.errors import InvalidParameterError
from labkit.target import target_on_lines

STILL = np.zeros(3)
EMPTY = Scan.from_ranges([math.inf], [0.0])
MOTION = np.array([0.1, 0.05, math.radians(3.0)])
BESIDE_WHEELS = StepRecord(increment=MOTION, decision=Decision.ICP, prior=MOTION)
PRIOR = MOTION + np.array([0.02, -0.01, 0.005])
STEP = [0.12, 0.02, math.radians(4.0)]
TRUTH = integrate([STEP] * 11, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(beam_count=271), rng=4)
NOISE = np.random.default_rng(0).normal(0.0, [0.01, 0.01, 0.005], (11, 3))
PRIORS = increments_between(TRUTH) + NOISE


def degrees(motion):
    return np.array(motion) * [1.0, 1.0, math.radians(1.0)]


def two_scans(world, motion=MOTION, rng=0):
    rng = np.random.default_rng(rng)
    return [cast(world, from_xytheta(pose), Lidar(), rng=rng) for pose in (STILL, motion)]


def step(older, newer, prior=None, motions=(STILL,)):
    """One step, after motions of which the newest comes first."""
    last_motion, *others = motions
    history = History(last_motion, tuple(others))
    state = MapState(STILL, 1, LocalMap(Target(older)), Target(older), history)
    return MapOdometry().advance(state, newer, prior)[0]


def test_it_drives_the_true_way_better_than_its_wheels():
    run = estimate_odometry(SCANS, PRIORS, start=TRUTH[0])

    wheels = integrate(PRIORS, TRUTH[0])
    error, wheel_error = (np.abs(poses - TRUTH).max() for poses in (run.poses, wheels))
    assert error < min(0.03, wheel_error)
    assert run.count(Decision.ICP) == 11


@pytest.mark.parametrize("motion", [(0.9, 0.3, 60.0), (-0.8, 0.0, -60.0), (0.0, -1.5, 85.0)])
def test_a_step_without_a_guess_is_found_by_the_search(motion):
    older, newer = two_scans(room(), degrees(motion))

    record = step(older, newer)

    assert record.decision is Decision.SEARCH
    np.testing.assert_allclose(record.increment, degrees(motion), atol=0.02)
    assert not record.is_doubtful


@pytest.mark.parametrize("off", [[0, 0, 70.0], [1.5, 0, 0]])
def test_wheels_that_jump_are_overruled_and_the_record_says_so(off):
    older, newer = two_scans(room())

    record = step(older, newer, MOTION + degrees(off))

    np.testing.assert_allclose(record.increment, MOTION, atol=0.01)
    assert record.against_prior
    assert record.is_doubtful
    assert "from the prior" in record.reason


@pytest.mark.parametrize("told", [[-20.48, 0, 0], [0, 0, 100.0], [2.5, 0, 0]])
def test_wheels_that_tell_more_than_the_robot_can_do_tell_nothing(told):
    older, newer = two_scans(room())

    record = step(older, newer, degrees(told))

    assert record.prior is None
    assert "more than the robot can do" in record.reason
    np.testing.assert_allclose(record.increment, MOTION, atol=0.01)


def test_the_reason_counts_the_factor_by_which_wheels_tell_ways_too_short():
    scales = Scales(0.03, 0.03, wheel_factor=1.1, agreement=0.9, steps=1.0, max_shift=1, max_turn=1)

    assert why_ignored(np.array([0.95, 0.0, 0.0]), scales).startswith("the wheels tell 1.04 m")
    assert "stands" in why_ignored(np.array([0.90, 0.0, 0.0]), scales)


def test_wheels_do_not_raise_their_own_limit_without_scans():
    odometry = MapOdometry()
    odometry.update(SCANS[0])

    taken = [odometry.update(EMPTY, [told, 0.0, 0.0]).increment[0] for told in (1.9, 5.6, 16, 48)]

    assert taken == [1.9, 1.9, 0.0, 0.0]  # 5.6 m is too far; the last motion is held once


def test_wheels_that_are_off_by_half_a_turn_give_way_to_a_match_that_agrees():
    older, newer = two_scans(room())
    turn = degrees([0.0, 0.0, 60.0])  # three times as much is possible

    record = step(older, newer, MOTION + degrees([0.0, 0.0, 170.0]), motions=(STILL, turn))

    np.testing.assert_allclose(record.increment, MOTION, atol=0.01)
    assert record.against_prior


LIMITS = SanityLimits(max_translation=0.15, max_rotation=math.radians(6.0))
LATER = replace(SCANS[9], stamp=SCANS[6].stamp)  # three steps farther than a scan can be
FAR = {
    "wheels": ([*SCANS[:6], EMPTY], [*PRIORS[:5], degrees([5.0, 0.0, 0.0])]),
    "turning wheels": ([*SCANS[:6], EMPTY], [*PRIORS[:5], degrees([0.0, 0.0, 90.0])]),
    "a match": ([*SCANS[:6], LATER], None),
    "a match beside wheels": ([*SCANS[:6], LATER], PRIORS[:6]),
    "a match from the beginning": ([SCANS[0], replace(LATER, stamp=SCANS[1].stamp)], None),
    "both": ([*SCANS[:6], LATER], [*PRIORS[:5], degrees([0.4, 0.0, 15.0])]),
}


@pytest.mark.filterwarnings("ignore:1 of 1 steps had no match")
@pytest.mark.parametrize("kind", FAR)
def test_what_a_user_sets_as_the_farthest_motion_bounds_each_step(kind):
    scans, priors = FAR[kind]

    run = estimate_odometry(scans, priors, OdometryParameters(limits=LIMITS))

    steps = increments_between(run.poses)
    assert np.hypot(*steps[:, :2].T).max() <= LIMITS.max_translation + 1e-9
    assert np.abs(steps[:, 2]).max() <= LIMITS.max_rotation + 1e-9


@pytest.mark.filterwarnings("ignore:2 of 2 steps had no match")
def test_where_the_limits_exclude_each_match_the_reason_says_how_far_it_leads():
    limits = SanityLimits(max_translation=0.01)

    run = estimate_odometry(SCANS[:3], None, OdometryParameters(limits=limits))

    reason = run.records[1].reason
    assert reason.startswith("the match leads farther than the robot can do: translation 0.1")
    assert reason.endswith("m > 0.01 m")


def test_after_a_gap_in_time_a_step_may_be_longer():
    times = [*range(6), 9]
    scans = [replace(SCANS[k], stamp=0.1 * k) for k in times]
    limits = SanityLimits(max_translation=0.2, max_rotation=math.radians(10.0))

    run = estimate_odometry(scans, None, OdometryParameters(limits=limits), start=TRUTH[0])

    np.testing.assert_allclose(run.poses, TRUTH[times], atol=0.03)
    assert [record.is_doubtful for record in run.records] == [False] * 6 + [True]
    assert run.records[6].reason.startswith("scans are missing")


@pytest.mark.filterwarnings("ignore:.* steps may be wrong")  # it looks the same turned by half
@pytest.mark.parametrize(("width", "depth"), [(4.0, 2.5), (2.6, 0.6), (4.0, 4.0)])
@pytest.mark.parametrize("cut", [0, 90])
def test_in_a_box_a_robot_at_rest_stays_at_rest(width, depth, cut):
    """Turned by half, a box looks the same; a first sweep that is cut looks the other way."""
    corners = [[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]]
    box = World(segments=polyline(corners, closed=True))
    place = from_xytheta([0.4 * width, 0.4 * depth, 0.3])
    lidar = Lidar(beam_count=240, field_of_view=math.tau)
    first, *scans = [cast(box, place, lidar, rng=k) for k in range(12)]
    first = Scan.from_ranges(first.ranges[cut:], first.angles[cut:])

    run = estimate_odometry([first, *scans])

    assert np.hypot(*run.poses[:, :2].T).max() < 0.05
    assert np.abs(run.poses[:, 2]).max() < 0.05


def test_a_match_that_scores_no_more_than_the_wheels_leaves_the_step_to_them():
    older, _ = two_scans(room())
    newer = Scan.from_points(apply(invert(from_xytheta(MOTION)), older.points))

    record = step(older, newer, MOTION)

    np.testing.assert_allclose(record.increment, MOTION, atol=1e-12)
    assert record.decision is Decision.CONFIRMED
    assert (record.iterations, record.termination, record.reason) == (0, None, "")
    assert not record.is_doubtful


def test_a_scan_that_fits_nowhere_leaves_the_step_to_the_wheels():
    older, _ = two_scans(room())
    scattered = np.random.default_rng(0).uniform(-9.0, 9.0, (181, 2))

    record = step(older, Scan.from_points(scattered), PRIOR)

    assert record.decision is Decision.PRIOR
    assert record.is_doubtful
    np.testing.assert_array_equal(record.increment, PRIOR)


def test_matches_that_all_fail_are_no_place_to_go_on_from(monkeypatch):
    older, newer = two_scans(room())
    failed = icp(newer, older, from_xytheta([50.0, 0.0, 0.0]), ACCURATE)
    monkeypatch.setattr("labkit.odometry.map_odometry.match", lambda *_: Match(failed, *Score()))

    record = step(older, newer, MOTION)

    assert record.decision is Decision.CONFIRMED
    assert record.T_taken_refused is None


def test_a_scanner_that_hangs_leaves_its_steps_to_the_wheels():
    """Else wheels that move beside a scan that does not look like wheels that slip."""
    hanging = [*SCANS[:5], *[SCANS[4]] * 4, *SCANS[9:]]

    with pytest.warns(UserWarning, match="4 of 11 scans repeat the one before"):
        run = estimate_odometry(hanging, PRIORS, start=TRUTH[0])

    frozen = [record for record in run.records if "does the scanner hang" in record.reason]
    assert frozen == list(run.records[5:9])
    assert {record.decision for record in frozen} == {Decision.PRIOR}
    assert np.abs(run.poses - TRUTH).max() < 0.05


def test_a_scan_that_repeats_beside_wheels_that_stand_is_matched():
    older, _ = two_scans(room())

    record = step(older, older, STILL)

    assert record.decision.matched
    np.testing.assert_allclose(record.increment, STILL, atol=1e-9)


def test_where_the_last_scans_fitted_too_little_the_wheels_lead():
    older, newer = two_scans(room())
    history = History(agreements=(0.2,) * HISTORY)
    state = MapState(STILL, 1, LocalMap(Target(older)), history=history)

    record, after = MapOdometry().advance(state, newer, PRIOR)

    assert record.led
    assert record.decision is Decision.PRIOR
    assert "following the wheels" in record.reason
    np.testing.assert_array_equal(record.increment, PRIOR)
    assert after.history.agreements[0] == record.agreement > 0.8


def test_where_the_wheels_lead_a_scan_that_fits_far_from_them_does_not_bear_them_out():
    """A load that the robot carries along fits wherever the robot would stand."""
    older, newer = two_scans(room(), STILL)
    history = History(agreements=(0.2,) * HISTORY)
    state = MapState(STILL, 1, LocalMap(Target(older)), history=history)

    record, after = MapOdometry().advance(state, newer, degrees([1.0, 0.0, 0.0]))

    assert record.led
    assert after.history.agreements[0] == max(0.0, record.agreement) < 0.5


@pytest.mark.parametrize("newer", [EMPTY, Scan.from_points([[1.0, 0.0], [0.0, 1.0]])])
def test_without_points_and_wheels_a_motion_is_held_once(newer):
    older, _ = two_scans(room())

    held = step(older, newer, None, [MOTION])
    stood = step(older, newer, None, [STILL])

    assert (held.decision, stood.decision) == (Decision.HOLD, Decision.STAND)
    np.testing.assert_array_equal(held.increment, MOTION)
    assert held.reason == "the newer scan has fewer than 3 points"


def test_wheels_that_stand_while_the_scan_moves_are_none():
    older, newer = two_scans(room(), degrees([0.4, 0.1, 10.0]))

    moved = step(older, newer, STILL)
    rests = step(older, two_scans(room(), STILL)[1], STILL)

    assert moved.prior is None
    np.testing.assert_allclose(moved.increment, degrees([0.4, 0.1, 10.0]), atol=0.01)
    np.testing.assert_array_equal(rests.prior, STILL)


@pytest.mark.parametrize(
    ("off", "is_doubtful"),
    [
        ([0.07, -0.07, 0.0], False),
        ([0.08, -0.08, 0.0], True),
        ([0.0, 0.0, -2.4], False),
        ([0.0, 0.0, 2.6], True),
        ([math.nan, math.nan, math.nan], True),
    ],
)
def test_a_step_is_doubtful_that_the_scan_before_alone_contradicts(off, is_doubtful):
    half_turn = np.array([0.1, 0.0, math.pi])  # whose differences must be wrapped
    told = half_turn + degrees(off) - [0.0, 0.0, math.tau]

    record = replace(
        BESIDE_WHEELS, increment=half_turn, check=Check(told, noise=0.01, information=0.5)
    )

    assert record.is_doubtful == is_doubtful


@pytest.mark.parametrize("information", [0.0, 0.01, 0.3])
def test_the_weakest_direction_is_told_by_wheels_and_walls_together(information):
    """As of two measurements of one length: their inverse variances add up."""
    evidence = Evidence(np.array([0.2, 0.2, 0.1]))

    check = Check(MOTION, noise=0.02, information=information)
    record = replace(BESIDE_WHEELS, check=check, evidence=evidence)

    variance = 1.0 / (1.0 / 0.2**2 + information / check.noise**2)
    assert record.weakest_std == pytest.approx(math.sqrt(variance))
    assert record.is_doubtful == (information < 0.1)


@pytest.mark.parametrize(
    ("prior", "allowed_std"),
    [
        (MOTION, 0.1),
        (MOTION + degrees([0, 0.59, 0]), 0.1),
        (MOTION + degrees([0, 0.61, 0]), 0.05),
        (None, 0.2),
    ],
)
def test_the_less_wheels_bear_a_step_out_the_better_scans_have_to_measure_it(prior, allowed_std):
    """Wheels whose usual error is 0.3 m; without them a step is doubtful if it may be wrong."""
    for std in (0.99 * allowed_std, 1.01 * allowed_std):
        information = 0.02**2 * (1.0 / std**2 - 1.0 / 0.3**2)
        record = replace(
            BESIDE_WHEELS,
            prior=prior,
            evidence=Evidence(np.array([0.3, 0.3, 0.1])),
            check=Check(MOTION, noise=0.02, information=information),
        )
        assert record.weakest_std == pytest.approx(std)
        assert record.is_doubtful == (std > allowed_std)


def test_a_step_that_makes_up_for_a_wrong_one_is_doubtful_too():
    """Its own match with the map is perfect: the scan before lies where it is not."""
    older, newer = two_scans(room())
    map_of_older = LocalMap(Target(older)).follow(degrees([0.15, 0.0, 0.0]))
    state = MapState(STILL, 2, map_of_older, Target(older))

    record = MapOdometry().advance(state, newer, None)[0]

    assert record.agreement > 0.8
    assert record.is_doubtful
    assert record.reason.startswith("a match with the scan before alone leads 0.15 m")


def test_a_scan_without_points_moves_the_robot_and_leaves_the_map():
    seen = LocalMap(Target(two_scans(room())[0]))

    _, after = MapOdometry().advance(MapState(STILL, 1, seen), EMPTY, PRIOR)

    assert after.map.target is seen.target
    np.testing.assert_allclose(after.map.T_target_last, from_xytheta(PRIOR), atol=1e-12)


@pytest.mark.parametrize("wheels", [PRIORS, None])
def test_after_a_scan_without_points_nothing_bears_the_next_step_out(wheels):
    blind = [EMPTY if k == 5 else scan for k, scan in enumerate(SCANS)]

    records = estimate_odometry(blind, wheels).records

    assert records[6].decision.matched
    assert records[6].reason == "no match with the scan before bears it out"
    assert [k for k in range(12) if records[k].is_doubtful] == [5, 6]


def test_along_a_corridor_the_robot_goes_on_as_before_and_the_step_is_doubtful():
    """What the walls tell is taken from them: the turn, and the way across."""
    motion = degrees((0.9, 0.1, 10.0))
    older, newer = two_scans(corridor(), motion, rng=1)

    record = step(older, newer, None, [degrees((0.8, 0.0, 2.0)), degrees((0.05, 0.0, 30.0))])

    assert record.decision.matched
    assert record.degenerate
    assert record.is_doubtful
    np.testing.assert_allclose(record.increment[[1, 2]], motion[[1, 2]], atol=0.03)
    assert record.increment[0] == pytest.approx(0.8, abs=0.05)


def test_along_a_corridor_the_wheels_tell_the_way():
    older, newer = two_scans(corridor(), rng=1)

    record = step(older, newer, PRIOR)

    assert record.degenerate
    assert not record.is_doubtful
    assert record.increment[0] == pytest.approx(PRIOR[0], abs=0.01)
    np.testing.assert_allclose(record.increment[1:], MOTION[1:], atol=0.006)


def test_along_a_corridor_poor_wheels_leave_the_step_doubtful():
    older, newer = two_scans(corridor(), rng=1)
    history = History(motions=(MOTION,), wheel_errors=((0.2, 0.01),) * HISTORY)
    state = MapState(STILL, 1, LocalMap(Target(older)), Target(older), history)

    record = MapOdometry().advance(state, newer, PRIOR)[0]

    assert record.degenerate
    assert record.is_doubtful


@pytest.mark.parametrize("noise_std", [0.003, 0.02])
def test_the_covariance_is_that_of_the_match_and_wide_without_one(noise_std):
    """It counts the noise that residuals and matched points show, and where ICP stops."""
    rng = np.random.default_rng(0)
    lidar = Lidar(noise_std=noise_std)
    older, newer = (cast(room(), from_xytheta(pose), lidar, rng=rng) for pose in (STILL, MOTION))

    matched = step(older, newer, PRIOR)
    unmatched = step(older, EMPTY, PRIOR)

    local_map = target_on_lines(older.points, Target(older).normals)
    result = on_matched_points(icp(newer, local_map, from_xytheta(PRIOR), ACCURATE))
    wide = np.diag(matched.evidence.std**2)
    noise = matched.rmse
    tolerances = [ACCURATE.translation_tolerance] * 2 + [ACCURATE.rotation_tolerance]
    expected = 2.0 * fuse(result, noise, STILL, 0.5 * wide)[1] + np.diag(np.square(tolerances))
    np.testing.assert_allclose(matched.covariance, expected, rtol=1e-9)
    wheels_std = growth_of(PRIOR) * unmatched.scales.wheel_shift
    np.testing.assert_allclose(np.sqrt(unmatched.covariance[0, 0]), wheels_std)


@pytest.mark.parametrize("noise_std", [0.003, 0.01, 0.03])
def test_steps_err_as_far_as_their_covariances_say(noise_std):
    """The mean of errors over their covariances (NEES) is 3 where these keep their word."""
    truth = integrate([STEP] * 40, start=[-0.5, -0.3, 0.2])
    scans = scan_along(room(), truth, Lidar(beam_count=271, noise_std=noise_std), rng=0)
    motions = increments_between(truth)

    run = estimate_odometry(scans, wheel_increments(truth, WheelNoise(), rng=0))

    records = run.records[1:]
    errors = [record.increment - motion for record, motion in zip(records, motions, strict=True)]
    nees = [e @ np.linalg.solve(r.covariance, e) for e, r in zip(errors, records, strict=True)]
    assert 1.0 < np.mean(nees) < 9.0


def test_steps_in_a_closet_with_loud_ranges_err_no_farther_than_they_say():
    """Residuals of dense points are small wherever the scan lies; the points show their noise."""
    truth = integrate([[0.015, 0.0, math.radians(5.0)]] * 12, start=[0.0, -0.05, 0.1])
    scans = scan_along(room(1.1, 1.0), truth, Lidar(noise_std=0.03), rng=0)

    run = estimate_odometry(scans)

    records = run.records[1:]
    errors = [
        r.increment - motion for r, motion in zip(records, increments_between(truth), strict=True)
    ]
    nees = [e @ np.linalg.solve(r.covariance, e) for e, r in zip(errors, records, strict=True)]
    assert np.median(nees) < 9.0


def test_a_record_holds_no_more_points_than_its_scan_matched():
    """A run of thousands of steps must not keep a map for each of them."""
    run = estimate_odometry(SCANS, PRIORS)

    results = [record.evidence.placement for record in run.records[1:]]
    assert all(len(each.target.points) <= len(each.source) for each in results)
    assert run.records[0].evidence is Evidence(STILL) or run.records[0].evidence.placement is None


def test_a_long_run_lets_matches_go_and_keeps_their_covariances(monkeypatch):
    whole = estimate_odometry(SCANS, PRIORS)
    monkeypatch.setattr("labkit.odometry.run.KEPT_STEPS", 3)

    run = estimate_odometry(SCANS, PRIORS)

    assert all(record.evidence.placement is None for record in run.records[:-3])
    assert all(record.evidence.placement is not None for record in run.records[-3:])
    for record, expected in zip(run.records, whole.records, strict=True):
        np.testing.assert_array_equal(record.covariance, expected.covariance)


def test_a_covariance_leaves_nothing_behind_but_itself():
    record = step(*two_scans(room()), PRIOR)

    assert record.covariance.shape == (3, 3)
    assert "search" not in vars(record.evidence.placement.target)
    assert "correspondences" not in vars(record.evidence.placement)


def test_an_interrupt_anywhere_leaves_the_scan_taken_or_not():
    """Each line of an update is interrupted once; the drive goes on as if nothing had been."""
    told = [None, *PRIORS]
    odometry, taken, lines = MapOdometry(start=TRUTH[0]), 0, 0

    def interrupt(frame, event, _):
        nonlocal lines
        if Path(frame.f_code.co_filename).parent.name != "odometry":
            return None
        lines += event == "line"
        if lines == stop:
            sys.settrace(None)
            raise KeyboardInterrupt
        return interrupt

    before = sys.gettrace()
    for stop in range(1, 400):
        lines = 0
        try:
            sys.settrace(interrupt)
            odometry.update(SCANS[taken], told[taken])
            sys.settrace(before)
            assert lines < stop
            taken += 1
        except KeyboardInterrupt:
            sys.settrace(before)
            taken = int(repr(odometry).split()[0].partition("(")[2])
        if taken == 4:
            break
    while taken < len(SCANS):
        odometry.update(SCANS[taken], told[taken])
        taken += 1

    expected = estimate_odometry(SCANS, PRIORS, start=TRUTH[0]).poses[-1]
    np.testing.assert_array_equal(odometry.pose, expected)


RANGES = {  # disturbances of the ranges (B,), at the angles, in scan k
    "none": lambda r, a, k, rng: r,
    "noise": lambda r, a, k, rng: r + rng.normal(0.0, 0.03, len(r)),
    "ghosts": lambda r, a, k, rng: np.where(
        rng.random(len(r)) < 0.1, rng.uniform(0.3, 9, len(r)), r
    ),
    "dropouts": lambda r, a, k, rng: np.where(rng.random(len(r)) < 0.5, math.nan, r),
    "empty": lambda r, a, k, rng: r if k % 5 else np.full(len(r), math.nan),
}
WHEELS = {  # disturbances of the wheels (K, 3)
    "jump": lambda w, rng: w + np.outer(np.arange(len(w)) % 9 == 5, [0, 0, rng.uniform(0.6, 1.4)]),
    "slip": lambda w, rng: w + np.outer(np.arange(len(w)) % 9 == 5, [rng.uniform(0.6, 2), 0.3, 0]),
    "stand": lambda w, rng: w * (abs(np.arange(len(w)) - 15) > 5)[:, None],
    "longer": lambda w, rng: 1.1 * w,
    "missing": lambda w, rng: np.where(np.arange(len(w))[:, None] % 4 == 3, math.nan, w),
}


@pytest.mark.filterwarnings("ignore:in 11 steps the wheels told that the robot stands")
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", [*RANGES, *WHEELS])
def test_in_a_room_no_disturbance_of_sweeps_or_wheels_costs_the_way(kind, seed):
    rng = np.random.default_rng(seed)
    turns = np.repeat(rng.uniform(-0.3, 0.3, 10), 3)
    truth = integrate(np.column_stack([np.full(30, 0.12), np.zeros(30), turns]))
    wheels = wheel_increments(truth, WheelNoise(along=0.1, turn=0.1, drift=0.1), rng=rng)
    wheels = WHEELS.get(kind, lambda w, _: w)(wheels, rng)
    change = RANGES.get(kind, RANGES["none"])
    scans = [
        Scan.from_ranges(change(scan.ranges, scan.angles, k, rng), scan.angles)
        for k, scan in enumerate(scan_along(room(), truth, Lidar(beam_count=271), rng=rng))
    ]

    found = estimate_odometry(scans, wheels).poses

    assert ate(found, truth).translation.rmse < 0.1


def test_parameters_of_another_kind_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"`parameters` must be .*OdometryParameters, got IcpPar"
    ):
        MapOdometry(IcpParameters())
