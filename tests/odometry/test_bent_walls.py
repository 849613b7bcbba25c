"""Curvature of walls: 1/s² where the angles of the beams are told s times too wide."""

import math

import numpy as np
import pytest

from labkit import Scan
from labkit.odometry.bent_walls import curvature, is_sampled
from labkit.simulation import Lidar, room, scan_along

PATH = [[0.1 * k, -0.05 * k, 0.3 * k] for k in range(12)]
SCANS = scan_along(room(), PATH, Lidar(beam_count=361), rng=3)


@pytest.mark.parametrize("widening", [0.5, 0.8, 1.0, 1.25, 1.5])
def test_walls_bend_by_the_square_of_how_much_too_wide_angles_are(widening):
    angles = SCANS[0].angles * widening
    fits = np.abs(angles) < math.pi
    scans = [Scan.from_ranges(scan.ranges[fits], angles[fits]) for scan in SCANS]

    measured = np.nanmedian([curvature(scan) for scan in scans])

    assert measured == pytest.approx(widening**-2, rel=0.1)


def test_a_ring_around_the_scanner_is_no_wall():
    angles = SCANS[0].angles
    ring = np.full(len(angles), 0.3)
    half = np.where(angles < 0.0, 0.3, SCANS[0].ranges)

    assert math.isnan(curvature(Scan.from_ranges(ring, angles)))
    assert curvature(Scan.from_ranges(half, angles)) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(
    "scan",
    [
        np.zeros((5, 2)),
        Scan(points=np.ones((5, 2))),
        Scan.from_ranges([1.0], [0.0]),
        Scan.from_ranges([1.0, 1.0, 1.0], [0.0, 0.0, 0.0]),
        Scan.from_ranges([math.inf] * 90, np.linspace(0.0, 1.5, 90)),
    ],
)
def test_a_scan_without_beams_that_could_show_a_wall_has_none(scan):
    assert math.isnan(curvature(scan))


def test_the_walls_of_a_short_run_are_all_looked_at_and_few_of_a_long_one():
    samples = [is_sampled(number) for number in range(4000)]

    assert all(samples[:40])
    assert sum(samples) < 0.1 * len(samples)
    assert any(samples[2000:2100])
