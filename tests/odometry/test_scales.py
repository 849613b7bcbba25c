"""What a run measures on itself: errors of wheels, usual agreement, and the limits of a step."""

import math
from dataclasses import replace

import numpy as np
import pytest

from labkit import Scan
from labkit.odometry import Decision, SanityLimits, StepRecord, estimate_odometry, integrate
from labkit.odometry.constants import HISTORY, LEAST_WHEEL_ERROR
from labkit.odometry.integration import increments_between
from labkit.odometry.scales import History
from labkit.simulation import Lidar, room, scan_along

SCAN = Scan(points=np.eye(3)[:, :2], stamp=1.0)
STEP = [0.12, 0.02, math.radians(4.0)]
TRUTH = integrate([STEP] * 60, start=[-0.5, -0.9, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(beam_count=271), rng=4)


@pytest.mark.parametrize("sigma", [0.04, 0.1])
def test_the_error_of_the_wheels_is_measured_on_the_run(sigma):
    noise = np.random.default_rng(0).normal(0.0, [sigma, sigma, 0.0], (60, 3))

    run = estimate_odometry(SCANS, increments_between(TRUTH) + noise)

    growth = 1.0 + np.hypot(0.12, 0.02) / 0.5 + 4.0 / 20.0
    expected = 1.5 * sigma / growth  # the 80 % quantile of a length in two dimensions
    assert run.records[-1].scales.wheel_shift == pytest.approx(expected, rel=0.3)
    assert run.records[-1].scales.wheel_turn == LEAST_WHEEL_ERROR[1]


def test_good_wheels_have_the_least_error_and_a_scan_its_usual_agreement():
    run = estimate_odometry(SCANS, increments_between(TRUTH))

    scales = run.records[-1].scales
    assert (scales.wheel_shift, scales.wheel_turn) == LEAST_WHEEL_ERROR
    agreements = [record.agreement for record in run.records[1:]]
    assert scales.agreement == pytest.approx(np.median(agreements), abs=0.02)


def test_a_step_is_at_most_three_times_as_long_as_the_longest_of_the_last_ones():
    motions = tuple(np.array([x, 0.0, 0.7 * x]) for x in (0.1, 1.0, 0.2))

    free = History(motions=motions).scales(SCAN, None, SanityLimits())
    bound = History(motions=motions).scales(SCAN, None, SanityLimits(max_translation=0.5))

    assert (free.max_shift, free.max_turn) == pytest.approx((3.0, 2.1))
    assert (bound.max_shift, bound.max_turn) == pytest.approx((0.5, 2.1))


@pytest.mark.parametrize(("stamp", "times"), [(1.1, 1.0), (1.05, 1.0), (1.4, 4.0), (math.nan, 1.0)])
def test_a_step_over_a_gap_in_time_may_be_as_many_times_as_long(stamp, times):
    history = History(intervals=(0.1,) * HISTORY, stamp=1.0)

    scales = history.scales(replace(SCAN, stamp=stamp), None, SanityLimits())

    assert scales.farthest[0] == pytest.approx(2.0 * times)


def test_what_wheels_told_of_a_step_without_a_match_is_what_the_robot_can_do():
    """Else right wheels are left out where nothing matches and the robot drives 2 m a step."""
    usual = History().scales(SCAN, None, SanityLimits())
    told = np.array([1.9, 0.0, 0.1])
    over_a_gap = usual._replace(steps=4.0)
    step = StepRecord(
        increment=told, decision=Decision.PRIOR, prior=told, scales=usual, agreement=0.1
    )
    gap = replace(step, increment=4.0 * told, prior=4.0 * told, scales=over_a_gap)

    scales = History().after(step, SCAN).after(gap, SCAN).scales(SCAN, None, SanityLimits())

    assert scales.max_shift == pytest.approx(3.0 * 1.9)


def test_an_ambiguous_motion_is_not_expected_again():
    seen = np.array([0.1, 0.0, 0.0])
    clear = StepRecord(increment=seen, decision=Decision.ICP)
    ambiguous = StepRecord(increment=9.0 * seen, decision=Decision.SEARCH, margin=0.01)

    history = History().after(clear, SCAN).after(ambiguous, SCAN)

    np.testing.assert_array_equal(history.last_motion, seen)
    assert len(history.motions) == 1


@pytest.mark.filterwarnings("ignore:6 of 8 steps may be wrong")
def test_a_motion_that_makes_up_for_missed_steps_is_held_for_none():
    scans = [Scan.from_points([]) if k in (3, 4, 5, 7) else SCANS[k] for k in range(9)]

    run = estimate_odometry(scans)

    held = run.records[7]
    assert held.decision is Decision.HOLD
    np.testing.assert_allclose(held.increment, STEP, atol=0.02)
