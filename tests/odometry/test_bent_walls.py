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

    measured = np.nanmedian([curvature(scan, scans[0]) for scan in scans[1:]])

    assert measured == pytest.approx(widening**-2, rel=0.1)


@pytest.mark.parametrize("bend", [0.0, 0.1])
def test_what_the_robot_carries_along_is_no_wall(bend):
    """A ring around the scanner, or round things: they look as in the first scan."""
    angles = SCANS[0].angles
    load = 1.3 + bend * np.sin(angles / 0.13)
    first, later = (
        [Scan.from_ranges(np.where(hidden, load, scan.ranges), angles) for scan in SCANS]
        for hidden in (np.ones(len(angles), np.bool_), angles < 0.0)
    )

    assert all(math.isnan(curvature(scan, first[0])) for scan in first)
    straight = [curvature(scan, later[0]) for scan in later[1:]]
    assert np.nanmedian(straight) == pytest.approx(1.0, abs=0.1)


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
    assert math.isnan(curvature(scan, SCANS[0]))


def test_the_walls_of_a_short_run_are_all_looked_at_and_few_of_a_long_one():
    samples = [is_sampled(number) for number in range(4000)]

    assert all(samples[:40])
    assert sum(samples) < 0.1 * len(samples)
    assert any(samples[2000:2100])
