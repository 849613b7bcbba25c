"""Odometry over whole logs: what is taken for scans and priors, and streaming beside it."""

import math
from dataclasses import fields

import numpy as np
import pytest

from labkit import IcpParameters, Scan
from labkit.filters import Preprocessing
from labkit.logs import Log
from labkit.odometry import (
    Decision,
    LessonOdometry,
    MapOdometry,
    OdometryParameters,
    estimate_odometry,
    increments_between,
    integrate,
)
from labkit.scan import scanner_poses
from labkit.se2 import from_xytheta, to_xytheta
from labkit.simulation import Lidar, corridor, room, scan_along
from labkit.support.errors import InvalidParameterError, InvalidPointsError

EMPTY = Scan.from_ranges([math.inf], [0.0])
STEP = [0.12, 0.02, math.radians(4.0)]
TRUTH = integrate([STEP] * 11, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(beam_count=271), rng=4)
NOISE = np.random.default_rng(0).normal(0.0, [0.01, 0.01, 0.005], (11, 3))
PRIORS = increments_between(TRUTH) + NOISE


def assert_same_records(actual, expected):
    for one, other in zip(actual, expected, strict=True):
        for field in fields(one):
            if field.name == "evidence":
                continue
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name))


@pytest.mark.parametrize("priors", [None, PRIORS])
def test_streaming_is_the_same_as_the_whole_log(priors):
    odometry = MapOdometry(start=TRUTH[0])
    records, poses = [], []
    for k, scan in enumerate(SCANS):
        prior = None if priors is None or k == 0 else priors[k - 1]
        records.append(odometry.update(scan, prior))
        poses.append(odometry.pose)
    whole = estimate_odometry(SCANS, priors, start=TRUTH[0])
    np.testing.assert_array_equal(poses, whole.poses)
    assert_same_records(records, whole.records)


def test_a_step_stays_doubtful_when_its_match_is_let_go():
    """Along a corridor the wheels alone tell the way, as well as they do."""
    steps = [[0.5, 0.0, 0.0]] * 4
    scans = scan_along(corridor(), integrate(steps, [-3.0, 0.0, 0.0]), Lidar(), rng=1)

    odometry = MapOdometry()
    for k, scan in enumerate(scans):
        record = odometry.update(scan, steps[k - 1] if k > 0 else None)

    assert record.weakest_std > record.allowed_std
    assert record.is_doubtful
    assert odometry.last_step.record.is_doubtful


OFFSET = (0.2, -0.1, 0.4)


@pytest.fixture(scope="module")
def skewed_drive():
    """A robot that speeds up, with its scanner off its centre: its path, and its sweeps."""
    turns = np.radians(np.linspace(1.0, 6.0, 20))
    path = integrate(np.column_stack([np.full(20, 0.05), np.zeros(20), turns]), [-0.5, 0.0, 0.0])
    lidar = Lidar(beam_count=271, field_of_view=math.tau)
    return path, scan_along(room(), scanner_poses(path, OFFSET), lidar, rng=1, skewed=True)


@pytest.mark.parametrize("estimator", [MapOdometry, LessonOdometry])
@pytest.mark.parametrize("has_wheels", [True, False])
def test_a_stream_of_skewed_sweeps_is_the_same_as_the_whole_log(
    skewed_drive, estimator, has_wheels
):
    """Skew, mount, remarks: what a run does, a step does."""
    path, scans = skewed_drive
    wheels, offset = (increments_between(path), OFFSET) if has_wheels else (None, None)

    odometry = estimator(start=path[0], laser_offset=offset)
    told = [None] * len(scans) if wheels is None else [None, *wheels]
    records = [odometry.update(*step) for step in zip(scans, told, strict=True)]
    whole = estimate_odometry(
        scans, wheels, laser_offset=offset, estimator=estimator, start=path[0]
    )

    assert_same_records(records[1:], whole.records[1:])
    np.testing.assert_array_equal(odometry.pose, whole.poses[-1])
    assert odometry.remarks == whole.remarks


def test_a_stream_undoes_the_skew_of_all_its_sweeps(skewed_drive):
    path, scans = skewed_drive
    errors = {}
    for deskew in (True, False):
        odometry = MapOdometry(laser_offset=OFFSET, deskew=deskew)
        for scan, prior in zip(scans, [None, *increments_between(path)], strict=True):
            odometry.update(scan, prior)
        turn = odometry.pose[2] - (path[-1, 2] - path[0, 2])
        errors[deskew] = abs(math.remainder(turn, math.tau))

    assert errors[True] < 0.15 * errors[False]


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
    odometry = MapOdometry(start=np.eye(3))
    odometry.update(SCANS[0])
    record = odometry.update(SCANS[1], transform(PRIORS[0]))
    np.testing.assert_allclose(record.increment, expected.records[1].increment, atol=1e-9)


@pytest.mark.parametrize("estimator", [MapOdometry, LessonOdometry])
def test_a_prior_turns_alike_with_a_full_turn_more_or_less(estimator):
    """Differences of headings in (−π, π] jump by a full turn; a blocked view takes the prior."""
    seen = [*SCANS[:4], EMPTY, *SCANS[5:]]
    jumping = PRIORS - [[0.0, 0.0, 2.0 * math.pi]]

    plain, jumped = (
        estimate_odometry(seen, priors, estimator=estimator) for priors in (PRIORS, jumping)
    )

    turns = [[record.increment[2] for record in run.records] for run in (plain, jumped)]
    np.testing.assert_allclose(turns[1], turns[0], atol=1e-9)
    assert jumped.remarks == plain.remarks == ()


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
    odometry = MapOdometry(start=[1.0, 2.0, 0.5])
    with pytest.raises(InvalidPointsError, match="the first scan has no `prior`"):
        odometry.update(SCANS[0], PRIORS[0])
    odometry.update(SCANS[0])
    odometry.pose[0] = 99.0
    told = "MapOdometry(1 scans, pose (1.000 m, 2.000 m, 0.500 rad))"
    assert repr(odometry) == told


def test_what_is_done_to_a_record_changes_no_pose():
    odometry, spoiled = MapOdometry(), MapOdometry()
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
    for wrong in (MapOdometry, lambda told: estimate_odometry(SCANS, parameters=told)):
        with pytest.raises(InvalidParameterError, match=mistaken):
            wrong(IcpParameters())
