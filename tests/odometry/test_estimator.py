"""Odometry over a run: streaming and whole logs, priors, and scans that are lost."""

import math
import sys
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest

from labkit import IcpParameters, Scan
from labkit.evaluation import ate
from labkit.filters import Preprocessing
from labkit.logs import Log
from labkit.odometry import (
    Decision,
    OdometryParameters,
    ScanMatchingOdometry,
    estimate_odometry,
    increments_between,
    integrate,
    integrate_step,
)
from labkit.odometry.carried import OFF
from labkit.odometry.sanity import MISSED, WATCHED
from labkit.se2 import apply, from_xytheta, to_xytheta
from labkit.simulation import Lidar, WheelNoise, room, scan_along, wheel_increments
from labkit.support.errors import InvalidParameterError, InvalidPointsError

EMPTY = Scan.from_ranges([math.inf], [0.0])
STEP = [0.12, 0.02, math.radians(4.0)]
TRUTH = integrate([STEP] * 11, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(beam_count=271), rng=4)
NOISE = np.random.default_rng(0).normal(0.0, [0.01, 0.01, 0.005], (11, 3))
PRIORS = increments_between(TRUTH) + NOISE
SCAN_TO_SCAN = OdometryParameters(against="scan")


def assert_same_records(actual, expected):
    for one, other in zip(actual, expected, strict=True):
        for field in fields(one):
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name))


def test_it_drives_the_true_way():
    result = estimate_odometry(SCANS, PRIORS, start=TRUTH[0])
    increments = [record.increment for record in result.records[1:]]
    np.testing.assert_array_equal(result.poses, integrate(increments, TRUTH[0]))
    np.testing.assert_array_equal(result.records[0].increment, np.zeros(3))
    assert np.abs(result.poses - TRUTH).max() < 0.03
    assert result.records[0].decision is Decision.START
    assert result.count(Decision.START) == 1
    assert result.count(Decision.ICP, Decision.RETRY) == 11
    dead_reckoning = integrate(PRIORS, TRUTH[0])
    errors = [np.hypot(*(p - TRUTH)[:, :2].T).max() for p in (result.poses, dead_reckoning)]
    assert errors[0] < errors[1]


def test_an_interrupt_anywhere_leaves_the_scan_taken_or_not():
    """Each line of an update is interrupted once; the drive goes on as if nothing had been."""
    told = [None, *PRIORS]
    odometry, taken, lines = ScanMatchingOdometry(start=TRUTH[0]), 0, 0

    def interrupt(frame, event, _):
        nonlocal lines
        if "odometry" not in frame.f_code.co_filename:
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


@pytest.mark.parametrize("priors", [None, PRIORS])
def test_streaming_is_the_same_as_the_whole_log(priors):
    odometry = ScanMatchingOdometry(start=TRUTH[0])
    records, poses = [], []
    for k, scan in enumerate(SCANS):
        prior = None if priors is None or k == 0 else priors[k - 1]
        records.append(odometry.update(scan, prior))
        poses.append(odometry.pose)
    whole = estimate_odometry(SCANS, priors, start=TRUTH[0])
    np.testing.assert_array_equal(poses, whole.poses)
    assert_same_records(records, whole.records)


@pytest.mark.parametrize("transform", [np.array, from_xytheta])
def test_priors_may_be_poses_or_increments_with_gaps(transform):
    """Wheels count from anywhere; a pose of NaN takes two steps with it, an increment one."""
    wheels, steps = integrate(PRIORS, start=[7.0, -3.0, 2.0]), PRIORS.copy()
    given = transform(wheels), transform(steps)
    expected = estimate_odometry(SCANS, steps)
    for priors in given:
        found = estimate_odometry(SCANS, priors)
        np.testing.assert_allclose(found.poses, expected.poses, atol=1e-9)
        assert_decisions(found, [record.decision for record in expected.records])
    given[0][5], given[1][4:6], steps[4:6] = math.nan, math.nan, math.nan
    expected = estimate_odometry(SCANS, steps)
    for priors in given:
        np.testing.assert_allclose(
            estimate_odometry(SCANS, priors).poses, expected.poses, atol=1e-9
        )
    odometry = ScanMatchingOdometry(start=np.eye(3))
    odometry.update(SCANS[0])
    record = odometry.update(SCANS[1], transform(PRIORS[0]))
    np.testing.assert_allclose(record.increment, expected.records[1].increment, atol=1e-9)


def test_scans_may_be_bare_points_from_a_generator():
    whole = estimate_odometry([Scan.from_points(scan.points) for scan in SCANS[:6]], PRIORS[:5])
    drawn = estimate_odometry((scan.points for scan in SCANS[:6]), PRIORS[:5])
    np.testing.assert_array_equal(drawn.poses, whole.poses)
    assert estimate_odometry(iter([])).poses.shape == (0, 3)


def test_a_run_is_told_in_one_line():
    lie = PRIORS.copy()
    lie[4] += [0.0, 1.5, 0.0]
    result = estimate_odometry(SCANS, lie)
    assert np.abs(result.poses - estimate_odometry(SCANS, PRIORS).poses).max() < 0.02
    assert result.against_prior == 1
    assert result.records[5].is_doubtful
    assert repr(result).startswith("OdometryResult(12 scans: start 1, ")
    assert repr(result).endswith("; 1 against the prior)")
    odometry = ScanMatchingOdometry(start=[1.0, 2.0, 0.5])
    with pytest.raises(InvalidPointsError, match="`prior` tells the step that ends in a scan"):
        odometry.update(SCANS[0], PRIORS[0])
    odometry.update(SCANS[0])
    odometry.pose[0] = 99.0
    told = "ScanMatchingOdometry(1 scans, pose (1.000 m, 2.000 m, 0.500 rad))"
    assert repr(odometry) == told


def test_wheels_that_are_contradicted_for_long_and_units_that_fit_nothing_are_remarks():
    lie = PRIORS + np.where(np.arange(11)[:, None] < 3, 0.0, [0.0, 3.0, 0.0])
    with pytest.warns(UserWarning, match="scans 4 to .* were all matched against the prior"):
        estimate_odometry(SCANS, lie)
    millimetres = [1e3 * scan.points for scan in SCANS]
    remarks = told_of(millimetres, PRIORS)[1]
    assert "of 11 steps had no match that is believed, the first since icp: " in remarks[0]
    assert "are ranges and wheels in metres" in remarks[0]


def told_of(scans, priors):
    """The run, and its remarks."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = estimate_odometry(scans, priors)
    return run, [str(each.message) for each in told]


@pytest.mark.parametrize("priors", [True, False])
def test_a_scanner_that_is_blocked_for_long_is_a_remark(priors):
    path = integrate([STEP] * 30, start=[-0.5, -0.3, 0.2])
    scans = scan_along(room(), path, Lidar(beam_count=181), rng=5)
    for blocked in (9, 10, 14):
        seen = [EMPTY if 8 <= k < 8 + blocked else scan for k, scan in enumerate(scans)]
        remarks = told_of(seen, increments_between(path) if priors else None)[1]
        last = f"scans 8 to {7 + blocked} were not matched, the first since the newer scan has few"
        assert [each.startswith(last) for each in remarks] == [True] * (blocked >= 10), remarks


@pytest.mark.parametrize("missed", [MISSED - 1, MISSED])
def test_where_many_scans_fit_nothing_the_wheels_lead_and_the_run_says_so(missed):
    """Until the matches are to be trusted again: each step is the wheels', and doubtful."""
    path, rng = integrate([STEP] * 100, start=[-0.5, -0.3, 0.2]), np.random.default_rng(5)
    scans, wheels = (
        scan_along(room(), path, Lidar(beam_count=91), rng=rng),
        increments_between(path),
    )
    for k in range(8, 8 + missed):
        scans[k] = rng.uniform(-9.0, 9.0, (91, 2))
    run, remarks = told_of(scans, wheels)
    first, last = 15, 14 + WATCHED
    told = [each.startswith(f"scans {first} to {last}: the wheels lead") for each in remarks]
    assert told == [True] * (missed == MISSED), remarks
    if told:
        led = run.records[first : last + 1]
        assert all(each.is_doubtful and "the wheels lead" in each.reason for each in led)
        np.testing.assert_array_equal([each.increment for each in led], wheels[first - 1 : last])
    assert run.records[-1].decision.matched


@pytest.mark.parametrize("off", [[1.5, 0.0, 0.0], [0.9, 0.3, 0.0], [0.5, 0.0, 0.8]])
@pytest.mark.parametrize("at", [3, 7])
def test_a_match_that_was_refused_wins_if_the_next_scan_fits_from_there(at, off):
    """Usual wheels that lie cost one step: the pose is wrong once, and then right for good."""
    lie = PRIORS.copy()
    lie[at] += off
    odometry = ScanMatchingOdometry(start=TRUTH[0])
    for k, scan in enumerate(SCANS):
        if k == at + 1:  # as if the robot had driven like this before
            usual = odometry._state.motions
            odometry._state = odometry._state._replace(motions=(lie[at], *usual))
        before = odometry.pose
        record = odometry.update(scan, lie[k - 1] if k else None)
        np.testing.assert_allclose(odometry.pose, integrate_step(before, record.increment))
        if k == at + 1:
            assert record.decision is Decision.PRIOR
            np.testing.assert_allclose(record.refused, PRIORS[at], atol=0.05)
        elif k == at + 2:
            assert record.against_prior
            assert record.is_doubtful
            assert "refused" in record.reason
            assert record.rotation == abs(record.increment[2])
            assert record.covariance[0, 0] > 0.25**2  # of the pose before
        if k != at + 1:
            assert np.abs(odometry.pose - TRUTH[k]).max() < 0.04


@pytest.mark.parametrize("slow", [1, 8])
@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_a_scan_that_repeats_while_the_wheels_move_is_none(slow, lost):
    """A frozen scanner, however slow the robot, and if some of its beams change."""
    rng, frozen = np.random.default_rng(0), 12 * slow
    path = integrate(np.tile(STEP, (20 * slow, 1)) / slow, start=[-0.5, -0.3, 0.2])
    scans = scan_along(room(), path, Lidar(beam_count=181), rng=rng)
    seen = scans[: 4 * slow]
    for _ in range(frozen):
        seen.append(scans[4 * slow].select(rng.random(len(scans[4 * slow])) >= lost))
    run, remarks = told_of([*seen, *scans[len(seen) :]], increments_between(path))
    T = from_xytheta(path[0]) @ from_xytheta(run.poses)
    assert np.abs(to_xytheta(T) - path).max() < 0.08
    reasons = ["repeats while the wheels move" in record.reason for record in run.records]
    assert sum(reasons) >= frozen - 1 - slow // 2
    assert not any(reasons[: len(seen) - frozen] + reasons[len(seen) :])
    assert any("the scan repeats" in each for each in remarks)
    rests = estimate_odometry([SCANS[0]] * 30, np.zeros((29, 3)))
    assert rests.count(Decision.ICP) == 29


def test_what_is_done_to_a_record_changes_no_pose():
    odometry, spoiled = ScanMatchingOdometry(), ScanMatchingOdometry()
    for scan in SCANS:
        record = spoiled.update(scan)
        odometry.update(scan)
        np.testing.assert_array_equal(spoiled.pose, odometry.pose)
        record.increment[:] = 9.0


@pytest.mark.parametrize("start", [(5.0, -2.0, 3.0), from_xytheta([5.0, -2.0, 3.0])])
def test_the_start_moves_the_run_as_a_whole(start):
    plain = estimate_odometry(SCANS[:4])
    moved = estimate_odometry(SCANS[:4], start=start)
    expected = to_xytheta(from_xytheta([5.0, -2.0, 3.0]) @ from_xytheta(plain.poses))
    np.testing.assert_allclose(moved.poses, expected, atol=1e-12)


def assert_decisions(result, decisions):
    assert [record.decision for record in result.records] == decisions


@pytest.mark.parametrize("parameters", [OdometryParameters(), SCAN_TO_SCAN])
def test_a_lost_scan_costs_one_step(parameters):
    scans = [*SCANS[:4], EMPTY, *SCANS[5:8]]
    result = estimate_odometry(scans, PRIORS[:7], parameters, start=TRUTH[0])
    icp, prior = Decision.ICP, Decision.PRIOR
    assert_decisions(result, [Decision.START, icp, icp, icp, prior, icp, icp, icp])
    assert result.records[4].reason == "the newer scan has fewer than 3 points"
    np.testing.assert_array_equal(result.records[4].increment, PRIORS[3])
    assert np.abs(result.poses[5:] - TRUTH[5:8]).max() < 0.03  # though the prior was 2 cm off


def test_without_a_prior_a_motion_is_held_once_and_the_next_scan_finds_its_way():
    scans = [*SCANS[:3], EMPTY, EMPTY, *SCANS[5:7]]
    result = estimate_odometry(scans, parameters=SCAN_TO_SCAN, start=TRUTH[0])
    np.testing.assert_array_equal(result.records[3].increment, result.records[2].increment)
    np.testing.assert_array_equal(result.records[4].increment, np.zeros(3))
    assert [record.decision for record in result.records[3:5]] == [Decision.HOLD, Decision.STAND]
    assert np.abs(result.poses[5:] - TRUTH[5:7]).max() < 0.03


def test_scans_are_filtered_on_both_sides():
    """Filtering inside is filtering beforehand, for the source and for the target."""
    thin = Preprocessing(range_min=0.3, voxel_size=0.1)
    inside = estimate_odometry(SCANS[:4], parameters=OdometryParameters(preprocessing=thin))
    beforehand = estimate_odometry([thin(scan) for scan in SCANS[:4]])
    np.testing.assert_array_equal(inside.poses, beforehand.poses)
    assert not np.array_equal(inside.poses, estimate_odometry(SCANS[:4]).poses)


def test_progress_sees_every_scan():
    seen = []
    estimate_odometry(SCANS[:3], progress=lambda scans: (seen.append(s) or s for s in scans))
    assert [a is b for a, b in zip(seen, SCANS[:3], strict=True)] == [True] * 3


def test_frames_do_not_matter_to_a_run():
    """A scanner mounted turned by A sees A⁻¹ p: its increments are A⁻¹ T A."""
    A = from_xytheta([0.0, 0.0, 2.0])
    turned = [replace(scan, points=apply(A.T, scan.points)) for scan in SCANS[:5]]
    wheels = from_xytheta(PRIORS[:4])
    plain = estimate_odometry(SCANS[:5], wheels, SCAN_TO_SCAN)
    other = estimate_odometry(turned, A.T @ wheels @ A, SCAN_TO_SCAN)
    for one, two in zip(plain.records[1:], other.records[1:], strict=True):
        expected = to_xytheta(A.T @ from_xytheta(one.increment) @ A)
        np.testing.assert_allclose(two.increment, expected, atol=1e-8)


def test_a_log_an_empty_array_and_a_row_of_nan_are_taken_as_they_are():
    log = Log(scans=tuple(SCANS), odometry=integrate(PRIORS), name="room", format="points")
    expected = estimate_odometry(SCANS, PRIORS)
    np.testing.assert_allclose(estimate_odometry(log).poses, expected.poses, atol=1e-9)
    space = np.tile(np.eye(4), (12, 1, 1))
    space[np.ix_(range(12), [0, 1, 3], [0, 1, 3])] = from_xytheta(log.odometry)
    space[:, 2, 3] = 0.4
    np.testing.assert_allclose(estimate_odometry(SCANS, space).poses, expected.poses, atol=1e-9)
    holes = PRIORS.copy()
    holes[[2, 6]] = math.nan
    scans = [*SCANS[:7], np.empty((0, 2)), *SCANS[8:]]
    result = estimate_odometry(scans, holes, start=TRUTH[0])
    assert result.records[7].decision is Decision.HOLD
    assert result.records[7].covariance[0, 0] > 100.0 * result.records[6].covariance[0, 0]
    assert np.abs(result.poses[8:] - TRUTH[8:]).max() < 0.03
    space[3, :3, :3] = space[3, [2, 0, 1], :3]
    with pytest.raises(InvalidPointsError, match="drop roll and pitch first"):
        estimate_odometry(SCANS, space)


@pytest.mark.parametrize("scan", [np.ones(541), np.ones((9, 3)), [[math.nan, 1.0]]])
def test_an_error_names_the_scan(scan):
    with pytest.raises(InvalidPointsError, match=r"^scan 2: `points` must"):
        estimate_odometry([*SCANS[:2], scan])


RANGES = {  # disturbances of the ranges (B,), at the angles, in scan k
    "none": lambda r, a, k, rng: r,
    "noise": lambda r, a, k, rng: r + rng.normal(0.0, 0.03, len(r)),
    "ghosts": lambda r, a, k, rng: np.where(
        rng.random(len(r)) < 0.1, rng.uniform(0.3, 9, len(r)), r
    ),
    "dropouts": lambda r, a, k, rng: np.where(rng.random(len(r)) < 0.5, math.nan, r),
    "carried": lambda r, a, k, rng: np.where(abs(a) < 0.7, np.minimum(r, 0.8 / np.cos(a)), r),
    "walking": lambda r, a, k, rng: np.where(abs(a - 0.05 * k) < 0.7, np.minimum(r, 0.9), r),
    "empty": lambda r, a, k, rng: r if k % 5 else np.full(len(r), math.nan),
}
WHEELS = {  # disturbances of the wheels (K, 3)
    "jump": lambda w, rng: w + np.outer(np.arange(len(w)) % 9 == 5, [0, 0, rng.uniform(0.6, 1.4)]),
    "slip": lambda w, rng: w + np.outer(np.arange(len(w)) % 9 == 5, [rng.uniform(0.6, 2), 0.3, 0]),
    "stand": lambda w, rng: w * (abs(np.arange(len(w)) - 15) > 5)[:, None],
    "longer": lambda w, rng: 1.1 * w,
    "missing": lambda w, rng: np.where(np.arange(len(w))[:, None] % 4 == 3, math.nan, w),
}
ORDERS = {  # of the scans (K+1)
    "frozen": lambda k, rng: np.where(abs(k - (at := rng.integers(6, 25))) < 5, at - 4, k),
}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", [*RANGES, *WHEELS, *ORDERS])
def test_no_single_disturbance_makes_the_odometry_worse_than_its_wheels(kind, seed):
    """The law; wheels count as disturbed as they are.

    A thing is known to be carried once it was carried `OFF` far; until then it may be the room.
    """
    rng = np.random.default_rng(seed)
    turns = np.repeat(rng.uniform(-0.3, 0.3, 10), 3)
    truth = integrate(np.column_stack([np.full(30, 0.12), np.zeros(30), turns]))
    lidar = Lidar(beam_count=271)
    wheels = wheel_increments(truth, WheelNoise(along=0.1, turn=0.1, drift=0.1), rng=rng)
    wheels = WHEELS.get(kind, lambda w, _: w)(wheels, rng)
    scans = [
        Scan.from_ranges(RANGES.get(kind, RANGES["none"])(s.ranges, s.angles, k, rng), s.angles)
        for k, s in enumerate(scan_along(room(), truth, lidar, rng=rng))
    ]
    order = ORDERS.get(kind, lambda k, _: k)(np.arange(len(scans)), rng)
    found = estimate_odometry([scans[k] for k in order], wheels).poses
    alone = integrate(np.nan_to_num(wheels))
    errors = [ate(poses, truth).translation.rmse for poses in (found, alone)]
    assert errors[0] < max(errors[1], 0.5 * OFF)


@pytest.mark.parametrize(
    ("priors", "message"),
    [
        (PRIORS[:5], r"`priors` must have shape \(12, 3\), a pose a scan, or \(11, 3\), an inc"),
        (PRIORS[:, :2], r"rows \(x, y, theta\), .* got shape \(11, 2\)"),
        (PRIORS.ravel(), r"or transforms, shape \(K, 3, 3\), got shape \(33,\)"),
        (
            np.where(PRIORS[2, 0] == PRIORS, math.nan, PRIORS),
            r"`priors` must be finite, got .*nan.*; three times NaN says that there is none",
        ),
        ([["a", "b", "c"]] * 11, r"`priors` must hold numbers"),
    ],
)
def test_bad_priors(priors, message):
    with pytest.raises(InvalidPointsError, match=message):
        estimate_odometry(SCANS, priors)
    mistaken = "`parameters` must be .*OdometryParameters, got IcpParameters"
    for wrong in (ScanMatchingOdometry, lambda told: estimate_odometry(SCANS, parameters=told)):
        with pytest.raises(InvalidParameterError, match=mistaken):
            wrong(IcpParameters())
