"""What the wheels tell, as far as matches bear it out."""

import math

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.evaluation import ate
from labkit.odometry import Decision, estimate_odometry, increments_between, integrate
from labkit.odometry.constants import HISTORY
from labkit.odometry.sanity import SanityLimits
from labkit.odometry.scales import History
from labkit.odometry.wheels import believable_wheels, is_at_rest, scale_of
from labkit.simulation import Lidar, room, scan_along

STEP = [0.12, 0.02, math.radians(4.0)]
TRUTH = integrate([STEP] * 60, start=[-0.5, -0.9, 0.2])
SCANS = scan_along(room(), TRUTH, Lidar(beam_count=271), rng=4)
TOLD = increments_between(TRUTH)
EMPTY = Scan.from_ranges([math.inf], [0.0])


@pytest.mark.parametrize(
    ("told", "stands"),
    [([0, 0, 0], True), ([0.01, 0.01, 0], True), ([0.03, 0, 0], False), ([0, 0, 0.02], False)],
)
def test_wheels_that_hardly_move_stand(told, stands):
    assert is_at_rest(np.array(told, float)) == stands


def test_the_scale_is_the_way_measured_over_the_way_told_along_it():
    told = np.array([0.2, 0.0, 0.1])

    assert scale_of(told, np.array([0.25, 0.0, 0.3])) == pytest.approx(1.25)
    assert scale_of(np.array([0.2, 0.5, 0.0]), np.array([0.25, 0.0, 0.0])) == pytest.approx(1.25)
    assert scale_of(told, -told) == pytest.approx(-1.0)
    assert math.isnan(scale_of(told, np.array([0.0, 0.2, 0.0])))
    assert math.isnan(scale_of(told, np.array([0.01, 0.0, 0.3])))
    assert math.isnan(scale_of(0.1 * told, told))


def scales_of(**history):
    return History(**history).scales(EMPTY, None, SanityLimits())


def test_few_factors_change_nothing_and_most_of_a_history_all():
    factors = [(1.3,) * 5, (1.3,) * HISTORY, (1.3,) * 12 + (1.0,) * 9, (-1.0,) * 11]

    few, many, half_wrong, reversed_wheels = (
        scales_of(wheel_factors=each).wheel_factor for each in factors
    )

    assert (few, many, half_wrong, reversed_wheels) == (1.0, 1.3, 1.0, -1.0)  # never 0, a mean


def test_the_factor_lengthens_ways_and_no_turns():
    told = np.array([0.2, 0.1, 0.3])
    scales = scales_of(wheel_factors=(1.3,) * HISTORY)

    wheels = believable_wheels(told, scales, SCANS[0], None)

    np.testing.assert_allclose(wheels, told * [1.3, 1.3, 1.0])


def test_wheels_stand_beside_a_scan_that_stands_and_tell_nothing_beside_one_that_moves():
    still = np.zeros(3)
    before = Target(SCANS[0])

    assert believable_wheels(still, scales_of(), SCANS[5], before) is None
    assert believable_wheels(None, scales_of(), SCANS[5], before) is None
    for scan in (SCANS[0], EMPTY):
        np.testing.assert_array_equal(believable_wheels(still, scales_of(), scan, before), still)


@pytest.mark.filterwarnings("ignore::UserWarning")  # remarks on the run
@pytest.mark.parametrize("factor", [-1.0, 0.5, 0.8, 1.25, 3.28])
def test_wheels_that_tell_all_ways_short_or_long_lead_as_right_ones_where_nothing_is_seen(factor):
    """Blind for the last ten steps, so that the wheels alone carry them."""
    scans = [*SCANS[:-10], *[EMPTY] * 10]

    run = estimate_odometry(scans, TOLD * [factor, factor, 1.0], start=TRUTH[0])

    assert run.count(Decision.PRIOR) == 10
    assert ate(run.poses, TRUTH, align="origin").translation.rmse < 0.05
    np.testing.assert_allclose(run.records[3].prior, TOLD[2] * [factor, factor, 1.0])
