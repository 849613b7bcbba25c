"""The lesson's odometry: the match, the checks, and the fallbacks in the flow chart's order."""

import math
from dataclasses import replace

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target, Termination, icp
from labkit.odometry import (
    Decision,
    LessonOdometry,
    OdometryParameters,
    SanityLimits,
    estimate_odometry,
    increments_between,
    integrate,
)
from labkit.se2 import apply, from_xytheta, to_xytheta
from labkit.simulation import Lidar, cast, corridor, room, scan_along

STILL = np.zeros(3)
LAST = np.array([0.02, 0.0, 0.01])
MOTION = np.array([0.1, 0.05, math.radians(3.0)])
PRIOR = MOTION + np.array([0.02, -0.01, 0.005])
EMPTY = Scan.from_ranges([math.inf], [0.0])
PLACE = np.linspace(0.0, 4.0, 81)
WALLS = np.vstack(
    [np.column_stack([PLACE, np.full(81, -2.0)]), np.column_stack([np.full(81, 5.0), PLACE])]
)
BY_POINTS = IcpParameters(overlap_ratio=1.0, huber_delta=math.inf)


def two_scans(world, motion=MOTION, rng=0):
    rng = np.random.default_rng(rng)
    return [cast(world, from_xytheta(pose), Lidar(), rng=rng) for pose in (STILL, motion)]


def step(older, newer, prior=None, parameters=None):
    odometry = LessonOdometry(parameters)
    odometry.update(older)
    return odometry.update(newer, prior)


def limited(**limits):
    return OdometryParameters(limits=SanityLimits(**limits))


def test_a_good_match_is_taken_with_its_numbers():
    older, newer = two_scans(room())

    record = step(older, newer, PRIOR)

    result = icp(newer, older, from_xytheta(PRIOR), OdometryParameters().icp)
    assert (record.decision, record.reason) == (Decision.ICP, "")
    np.testing.assert_array_equal(record.increment, to_xytheta(result.T_target_source))
    assert (record.inlier_count, record.inlier_ratio) == (result.inlier_count, result.fitness)
    assert record.information == result.observability.values[0]
    assert (record.iterations, record.termination) == (result.iterations, result.termination)


def test_the_rmse_is_that_of_the_distances_from_the_lines():
    older, newer = two_scans(room())

    record = step(older, newer, PRIOR)

    target = Target(older)
    result = icp(newer, target, from_xytheta(PRIOR), OdometryParameters().icp)
    pairs = result.correspondences
    p, q = pairs.source[pairs.kept], target.points[pairs.target_index[pairs.kept]]
    from_line = (target.normals[pairs.target_index[pairs.kept]] * (p - q)).sum(axis=1)
    assert record.rmse == pytest.approx(math.sqrt(np.mean(from_line**2)), rel=1e-9)


def test_the_retry_succeeds_where_the_first_match_failed():
    """A gate of 0.5 m pairs a curtain with the wall 0.3 m behind it; half the gate does not."""
    curtain = np.column_stack([PLACE, 0 * PLACE - 1.7])[::3]
    newer = np.vstack([WALLS, curtain])
    strict = replace(limited(max_rmse=0.05), icp=BY_POINTS)

    record = step(WALLS, newer, parameters=strict)

    assert record.decision is Decision.RETRY
    assert record.reason.startswith("icp: RMSE 0.")
    np.testing.assert_allclose(record.increment, STILL, atol=1e-6)
    assert record.inlier_count == len(WALLS)
    assert strict.retry == replace(BY_POINTS, max_correspondence_distance=0.25, step_fraction=0.5)


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
    record = step(*two_scans(room()), PRIOR, limited(**limits))

    assert record.decision is Decision.PRIOR
    np.testing.assert_array_equal(record.increment, PRIOR)
    for attempt, reason in zip(("icp", "retry"), record.reason.split("; "), strict=True):
        assert reason.startswith(attempt + ": ")
        assert complaint in reason


def test_a_failed_match_is_its_own_complaint():
    record = step(*two_scans(room()), np.array([50.0, 0.0, 0.0]))

    message = Termination.TOO_FEW_CORRESPONDENCES.value
    assert record.decision is Decision.PRIOR
    assert record.reason == f"icp: {message}; retry: {message}"
    assert math.isnan(record.information)


def test_the_turn_from_the_prior_is_measured_across_the_cut_at_pi():
    older, newer = two_scans(room(), np.array([0.0, 0.0, 3.12]))

    record = step(older, newer, np.array([0.0, 0.0, -3.13]), limited(max_rotation=math.pi))

    assert record.decision is Decision.ICP


def test_a_corridor_is_believed_with_a_prior_and_not_without():
    older, newer = two_scans(corridor(), rng=1)

    with_prior = step(older, newer, PRIOR)
    without = step(older, newer)

    assert with_prior.decision is Decision.ICP
    assert with_prior.degenerate
    assert with_prior.increment[0] == pytest.approx(PRIOR[0], abs=0.01)
    assert with_prior.increment[1:] == pytest.approx(MOTION[1:], abs=0.006)
    assert without.decision is Decision.STAND
    assert "degenerate: information" in without.reason


def test_a_free_direction_is_no_measurement_under_the_metric_of_points():
    by_points = OdometryParameters(icp=IcpParameters())

    record = step(*two_scans(corridor(), rng=1), PRIOR, by_points)

    assert record.decision is Decision.PRIOR


PATH = integrate([[0.12, 0.02, math.radians(4.0)]] * 7, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), PATH, Lidar(beam_count=271), rng=4)
PRIORS = increments_between(PATH) + 0.005


def test_a_lost_scan_costs_one_step():
    scans = [*SCANS[:4], EMPTY, *SCANS[5:]]

    run = estimate_odometry(scans, PRIORS, estimator=LessonOdometry, start=PATH[0])

    matched = [record.decision is Decision.ICP for record in run.records]
    assert matched == [False, True, True, True, False, True, True, True]
    assert run.records[4].reason == "the newer scan has fewer than 3 points"
    np.testing.assert_array_equal(run.records[4].increment, PRIORS[3])
    assert np.abs(run.poses[5:] - PATH[5:]).max() < 0.03


def test_without_a_prior_a_motion_is_held_once_and_the_next_scan_finds_its_way():
    scans = [*SCANS[:3], EMPTY, EMPTY, *SCANS[5:]]

    run = estimate_odometry(scans, estimator=LessonOdometry, start=PATH[0])

    _, _, before, held, stood, *_ = run.records
    assert (held.decision, stood.decision) == (Decision.HOLD, Decision.STAND)
    np.testing.assert_array_equal(held.increment, before.increment)
    np.testing.assert_array_equal(stood.increment, STILL)
    assert np.abs(run.poses[5:] - PATH[5:]).max() < 0.03


def test_the_first_scan_may_be_empty():
    run = estimate_odometry([EMPTY, *SCANS[:3]], estimator=LessonOdometry)

    assert run.records[1].reason == "the older scan has fewer than 3 points"
    assert run.records[3].decision is Decision.ICP


def test_frames_do_not_matter_to_a_run():
    """A scanner mounted turned by A sees A⁻¹ p: its increments are A⁻¹ T A."""
    A = from_xytheta([0.0, 0.0, 2.0])
    turned = [replace(scan, points=apply(A.T, scan.points)) for scan in SCANS]
    wheels = from_xytheta(PRIORS)

    plain = estimate_odometry(SCANS, wheels, estimator=LessonOdometry)
    other = estimate_odometry(turned, A.T @ wheels @ A, estimator=LessonOdometry)

    for record, record_turned in zip(plain.records, other.records, strict=True):
        expected = to_xytheta(A.T @ from_xytheta(record.increment) @ A)
        np.testing.assert_allclose(record_turned.increment, expected, atol=1e-8)


@pytest.mark.parametrize("priors", [PRIORS[:3], None])
def test_a_step_is_as_sure_as_the_lab_s_odometry_tells_of_the_same_match(priors):
    with_gap = [*SCANS[:3], EMPTY]

    lesson = estimate_odometry(with_gap, priors, estimator=LessonOdometry)
    lab = estimate_odometry(with_gap, priors)

    assert lesson.records[1].decision is lab.records[1].decision is Decision.ICP
    np.testing.assert_allclose(lesson.records[1].covariance, lab.records[1].covariance, rtol=0.5)
    unmatched, measured = (np.diag(run.records[3].covariance) for run in (lesson, lab))
    assert (unmatched >= measured).all()  # a third of the limits; with wheels, how far they err
    assert all(np.linalg.eigvalsh(each.covariance)[0] > 0.0 for each in lesson.records[1:])
