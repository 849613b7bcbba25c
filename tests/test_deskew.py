"""Skew within a sweep: straightened sweeps lie on the walls, and odometry keeps its heading."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.deskew import deskew
from labkit.odometry import estimate_odometry
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.simulation import Lidar, cast, room, scan_along
from labkit.simulation.lidar import first_hits
from labkit.support.errors import InvalidParameterError

ROUND = Lidar(beam_count=180, field_of_view=2.0 * math.pi, noise_std=0.0, range_max=30.0)
SWEEP = 0.1  # [s]
speeds = st.floats(-0.15, 0.15)


@given(motion=st.tuples(speeds, speeds, st.floats(-0.3, 0.3)))
def test_a_straightened_sweep_lies_on_the_walls(motion):
    """The oracle looks from the pose of the first beam along each straightened point."""
    pose = from_xytheta([0.3, -0.2, 0.5])
    skewed = cast(room(), pose, ROUND, rng=0, increment=motion, sweep_time=SWEEP)

    x, y = deskew(skewed, np.divide(motion, SWEEP)).points.T

    seen = first_hits(room().at(0.0), pose, np.arctan2(y, x))
    behind_an_edge = seen > np.hypot(x, y) + 1e-9
    hidden_by_one = seen < np.hypot(x, y) - 1e-9
    assert np.count_nonzero(behind_an_edge | hidden_by_one) < 0.1 * len(x)


@pytest.mark.parametrize(
    "scan",
    [
        Scan.from_ranges([1.0, 2.0], [0.0, 0.1]),
        Scan(points=[[1.0, 2.0]], time_increment=0.1),
    ],
)
def test_a_scan_that_tells_no_time_or_no_beams_stays_as_it_is(scan):
    assert deskew(scan, (1.0, 0.0, 1.0)) is scan


def test_a_time_between_beams_that_is_none_is_refused():
    with pytest.raises(InvalidParameterError, match=r"`time_increment` must be in \[0, 1\] s"):
        Scan.from_ranges([1.0], [0.0], time_increment=-0.1)


TURN = math.radians(6.0)  # in each sweep


@pytest.fixture(scope="module")
def turning():
    """A robot that drives a small circle while its beams turn: its path and its sweeps."""
    headings = TURN * np.arange(25)
    steps = 0.04 * np.column_stack([np.cos(headings), np.sin(headings)])
    places = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)[:-1]])
    path = np.column_stack([places, headings])
    lidar = Lidar(beam_count=360, field_of_view=2.0 * math.pi, range_max=30.0)
    return path, scan_along(room(), path, lidar, rng=1, skewed=True)


@pytest.mark.parametrize("wheels", [False, True])
def test_odometry_keeps_its_heading_where_sweeps_are_skewed(turning, wheels):
    path, scans = turning
    prior = path if wheels else None
    errors = {}
    for on in (False, True):
        poses = estimate_odometry(scans, prior, start=path[0], deskew=on).poses
        turned = np.unwrap(poses[:, 2])[-1] - poses[0, 2]
        errors[on] = abs(turned - TURN * (len(path) - 1)), np.hypot(*(poses - path)[:, :2].T).max()
    assert errors[False][0] > math.radians(1.0)
    assert errors[True][0] < 0.2 * errors[False][0]
    assert errors[True][1] < 0.5 * errors[False][1]


def test_a_stream_of_scans_is_straightened_by_its_last_motions(turning):
    path, scans = turning
    poses = estimate_odometry(iter(scans), start=path[0]).poses
    assert abs(np.unwrap(poses[:, 2])[-1] - TURN * (len(path) - 1)) < math.radians(4.0)
