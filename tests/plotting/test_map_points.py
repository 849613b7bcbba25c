"""The map against the transform of one scan at a time."""

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, InvalidPointsError
from labkit.plotting import map_points
from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta


def make_run(rng, lengths=(5, 0, 1, 12)):
    poses = rng.uniform(-10.0, 10.0, (len(lengths), 3))
    return poses, [Scan.from_points(rng.normal(size=(n, 2))) if n else EMPTY for n in lengths]


EMPTY = Scan.from_ranges([np.inf], [0.0])


def test_the_map_is_each_scan_at_its_pose():
    poses, scans = make_run(np.random.default_rng(3))
    expected = np.vstack(
        [apply(from_xytheta(pose), scan.points) for pose, scan in zip(poses, scans, strict=True)]
    )
    np.testing.assert_allclose(map_points(poses, scans), expected, atol=1e-12)


def test_moving_the_world_moves_the_map():
    poses, scans = make_run(np.random.default_rng(4))
    turned = poses @ np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned[:, 2] += np.pi / 2.0
    quarter = from_xytheta([0.0, 0.0, np.pi / 2.0])
    expected = apply(quarter, map_points(poses, scans))
    np.testing.assert_allclose(map_points(turned, scans), expected, atol=1e-12)


def test_far_points_are_left_out():
    scan = Scan.from_points([[1.0, 0.0], [0.0, 3.0], [9.0, 0.0]])
    assert map_points([[100.0, 0.0, 0.0]], [scan], range_max=3.0).tolist() == [
        [101.0, 0.0],
        [100.0, 3.0],
    ]


def test_scans_without_points_make_no_map():
    assert map_points(np.zeros((2, 3)), [EMPTY, EMPTY]).shape == (0, 2)


@pytest.mark.parametrize(
    ("poses", "count", "message"),
    [
        (np.zeros((2, 3)), 3, "must be one to one, got 3 scans and 2 poses"),
        (np.zeros((2, 2)), 2, r"`poses` must have shape \(K, 3\), .* got \(2, 2\)"),
        (np.zeros((0, 3)), 0, r"K at least 1, got \(0, 3\)"),
        ([[0, 0, np.nan]], 1, r"`poses` must be finite, got \[0.0, 0.0, nan\] at index 0"),
        ("abc", 1, "`poses` must hold numbers, got 'abc'"),
    ],
)
def test_bad_input(poses, count, message):
    with pytest.raises(InvalidPointsError, match=message):
        map_points(poses, [EMPTY] * count)


def test_a_range_of_nothing():
    with pytest.raises(InvalidParameterError, match=r"`range_max` must be in \(0, inf\] m, got 0"):
        map_points([[0, 0, 0]], [EMPTY], range_max=0)
