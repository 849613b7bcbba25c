"""What a caller cannot mean is refused, with the value that was received."""

import math
from functools import partial

import numpy as np
import pytest

from labkit import Scan, Target, icp
from labkit.alignment import align
from labkit.correspondences import distance_gate, huber_loss, huber_weights, overlap
from labkit.covariance import censi_covariance, fuse
from labkit.degeneracy import spread_ratio
from labkit.filters import Preprocessing, range_band, remove_isolated, voxel_downsample
from labkit.line_alignment import align_to_lines, line_information
from labkit.neighbors import NearestNeighbors
from labkit.support.errors import (
    DegenerateAlignmentError,
    InvalidParameterError,
    InvalidPointsError,
)

NAN, INF = math.nan, math.inf
POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [4.0, 1.0]])
SPARSE = 3.0 * np.stack(np.meshgrid(np.arange(1.0, 6), np.arange(4.0)), axis=-1).reshape(-1, 2)
ONES = np.ones(4)
UNIT = np.tile([0.0, 1.0], (4, 1))
NORMALS = np.array([[0.0, -1.0], [NAN, NAN], [0.0, -1.0], [0.0, -2.0]])


def scan(ranges, angles, beams=None):
    return Scan(points=POINTS, ranges=ranges, angles=angles, beams=beams)


@pytest.fixture(scope="module")
def result(in_the_room):
    return icp(in_the_room.source, in_the_room.target)


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        (scan, (None, None, np.arange(3)), r"`beams` must be 4 whole .*, got shape \(3,\)"),
        (
            scan,
            (None, None, [0, 2, 2, 3]),
            r"`beams` must all rise or all fall, got \[2, 2\] at in",
        ),
        (scan, (ONES, None, [0, 1, 2, 4]), "`beams` must count `ranges` from 0 to 3, got 0 to 4"),
        (scan, (ONES, None, [-1, 0, 1, 2]), "`beams` must count `ranges` from 0 to 3, got -1 to 2"),
        (scan, (None, None, np.arange(4.0)), r"`beams` must be 4 whole .*, got shape \(4,\)"),
        (NearestNeighbors, (POINTS + INF,), r"`target` must be finite, got \[inf, inf\] at"),
        (NearestNeighbors(POINTS).query, (POINTS * NAN,), "`points` must be finite, .* at index 0"),
        (Target, (POINTS, NORMALS), "`normals` must be unit vectors, .* at index 3"),
        (Target, (POINTS, NORMALS[:2]), r"`normals` must have shape \(4, 2\), got"),
        (
            align_to_lines,
            (POINTS, POINTS, NORMALS[:2], ONES),
            r"`normals` must have shape \(4, 2\)",
        ),
        (
            align_to_lines,
            (POINTS, POINTS, NORMALS, ONES),
            "`normals` must be finite, .* at index 1",
        ),
        (line_information, (POINTS, UNIT, None, NORMALS[:2]), "`other_normals` must have shape"),
        (Target, (POINTS * NAN,), r"`target` must be finite, got \[nan, nan\]"),
        (
            align,
            (POINTS, POINTS, [1, 1]),
            r"`weights` must have shape \(4,\), got \(2,\); give one",
        ),
        (align, (POINTS, POINTS, [1, 1, -2, 1]), r"finite and not negative, got -2\.0 at index 2"),
        (align, (POINTS, POINTS, [1, INF, 1, 1]), "finite and not negative, got inf at index 1"),
        (align, (POINTS, POINTS, "heavy"), "`weights` must hold numbers, got 'heavy'; give one n"),
        (icp, (POINTS, Scan.from_ranges([INF], [0.0])), r"`target` is empty, got shape \(0, 2\)"),
        (spread_ratio, (POINTS, [1, 0, 0]), r"`motion` must have shape \(2,\), got \(3,"),
        (huber_weights, ([0.1, -0.1], 0.5), "distances, .* got -0.1 at index 1"),
        (huber_loss, ([0.1, NAN], 0.5), "distances, .* got nan at index 1"),
        (overlap, ([0.1, NAN], 0.5), "distances, .* got nan at index 1"),
        (distance_gate, ([0.1, -0.1], 0.5), "distances, .* got -0.1 at index 1"),
    ],
)
def test_arrays(call, arguments, message):
    with pytest.raises(InvalidPointsError, match=message):
        call(*arguments)


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        (range_band, (POINTS, -1.0), r"`minimum` must be in \[0, inf\] m, got -1\.0"),
        (range_band, (POINTS, 2.0, 2.0), r"`maximum` must be in \(2, inf\] m, got 2\.0"),
        (voxel_downsample, (POINTS, 0.0), r"`size` must be in \[1e-100, inf\] m, got 0\.0"),
        (remove_isolated, (POINTS, -0.1), r"`radius` must be in \(0, inf\] m, got -0\.1"),
        (partial(Preprocessing, range_min=NAN), (), r"`range_min` must be in \[0, inf\] m"),
        (partial(Preprocessing, range_min=3, range_max=2), (), r"`range_max` must be in \(3, inf"),
        (partial(Preprocessing, voxel_size=-1), (), r"`voxel_size` must be in \[0, inf\] m, got"),
        (partial(Preprocessing, isolation_radius=-1), (), "`isolation_radius` must be in .*, got"),
        (icp, (POINTS, POINTS, None, 0.7), "`parameters` must be of the class IcpParam"),
        (huber_weights, ([0.1], 0.0), r"`huber_delta` must be in \(0, inf\] m, got 0.0"),
        (huber_loss, ([0.1], 0.0), r"`huber_delta` must be in \(0, inf\] m, got 0.0"),
        (overlap, ([0.1], 0.0), r"`overlap_ratio` must be in \(0, 1\], got 0.0"),
        (distance_gate, ([0.1], 0.0), r"`max_correspondence_distance` must be in .*, got 0.0"),
    ],
)
def test_parameters(call, arguments, message):
    with pytest.raises(InvalidParameterError, match=message):
        call(*arguments)


@pytest.mark.parametrize("std", [0.0, -0.01, NAN])
def test_noise(result, std):
    with pytest.raises(InvalidParameterError, match=rf"`range_std` must be in .* m, got {std}"):
        censi_covariance(result, std)


def test_a_target_without_noise_needs_its_number():
    wall = np.column_stack([np.linspace(-1.0, 1.0, 40), np.full(40, 2.0)])
    result = icp(wall, wall, metric="point_to_line")

    with pytest.raises(InvalidParameterError, match="no point of the target shows any noise"):
        censi_covariance(result)


@pytest.mark.parametrize(
    ("prior", "message"),
    [
        (np.eye(2), r"must have shape \(3, 3\), got \(2, 2\); take a block"),
        (np.diag([1.0, 1.0, 0.0]), "must be symmetric and positive definite, got"),
        (np.eye(3) + np.eye(3, k=1), "must be symmetric and positive definite, got"),
    ],
)
def test_covariances_of_a_prior(result, prior, message):
    with pytest.raises(InvalidPointsError, match=message):
        fuse(result, 0.01, np.zeros(3), prior)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (POINTS[:2], "without an estimate: failed: fewer than 3"),
        (SPARSE, "no pair lies on a surface"),
    ],
)
def test_what_has_no_covariance(points, message):
    with pytest.raises(DegenerateAlignmentError, match=message):
        censi_covariance(icp(points, points), 0.01)
