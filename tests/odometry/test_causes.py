"""A run says in one remark what most probably happened: each cause on each drive, by its name."""

import math
import warnings

import numpy as np
import pytest

from labkit import Scan, wrap
from labkit.odometry import Decision, StepRecord, estimate_odometry, increments_between
from labkit.odometry.remarks import Step, remarks_on
from labkit.se2 import from_xytheta, relative
from labkit.simulation import Lidar, WheelNoise, room, scan_along, two_rooms, wheel_increments

HALF_VIEW = Lidar(beam_count=181, field_of_view=math.pi)
FULL_VIEW = Lidar(beam_count=181, field_of_view=math.radians(270.0))
COUNT = 41


def loop(width, depth):
    """Poses along an ellipse, driven now faster and now slower; no step is like the one before."""
    time = np.arange(COUNT)
    angle = 0.13 * time + 0.25 * np.sin(0.9 * time) + 0.1 * np.sin(2.3 * time)
    heading = angle + 0.5 * math.pi + 0.2 * np.sin(1.7 * time)
    return np.column_stack([width * np.cos(angle), depth * np.sin(angle), heading])


DRIVES = {
    "room": (room(), loop(1.3, 0.9), HALF_VIEW),
    "two rooms": (two_rooms(), loop(1.2, 1.1), FULL_VIEW),
}


def drive(name):
    """Scans 0.1 s apart, and what exact wheels tell."""
    world, path, lidar = DRIVES[name]
    scans = scan_along(world, path, lidar, rng=3, stamps=0.1 * np.arange(COUNT))
    return scans, increments_between(path)


def remarks_of(scans, wheels):
    with warnings.catch_warnings(action="ignore"):
        return estimate_odometry(scans, wheels).remarks


def with_ranges(scan, ranges, angles=None):
    return Scan.from_ranges(ranges, scan.angles if angles is None else angles, stamp=scan.stamp)


def mirror(scan):
    return with_ranges(scan, scan.ranges, -scan.angles)


def turn_mount(scan, angle):
    return with_ranges(scan, scan.ranges, scan.angles + angle)


def widen(scan, factor):
    fits = abs(scan.angles * factor) < math.pi
    return with_ranges(scan, scan.ranges[fits], factor * scan.angles[fits])


def see_robot(scan):
    return with_ranges(scan, np.where(abs(scan.angles) > 0.3, 0.3, scan.ranges))


def in_degrees(wheels):
    return np.column_stack([wheels[:, :2], wrap(np.degrees(wheels[:, 2]))])


def jump(wheels):
    return wheels - np.outer(np.arange(len(wheels)) % 9 == 8, [20.48, 0.0, 0.0])


FAULTS_OF_SCANS = {
    "upside down": mirror,
    "add 1.57 to the third number": lambda scan: turn_mount(scan, -0.5 * math.pi),
    "does it look backwards": lambda scan: turn_mount(scan, math.pi),
    "told 1.4 times as wide": lambda scan: widen(scan, 1.4),
    "angles of the beams were told 0.7": lambda scan: widen(scan, 0.7),
    "see the robot itself": see_robot,
    "more beams end at 2 m": lambda scan: with_ranges(scan, np.minimum(scan.ranges, 2.0)),
    "are ranges (up to": lambda scan: with_ranges(scan, 100.0 * scan.ranges),
}
FAULTS_OF_WHEELS = {
    "or headings, in degrees": in_degrees,
    "in millimetres?": lambda wheels: wheels * [1000.0, 1000.0, 1.0],
    "in centimetres?": lambda wheels: wheels * [100.0, 100.0, 1.0],
    "do they count turns clockwise? If so": lambda wheels: wheels * [1.0, 1.0, -1.0],
    "are the ranges in feet?": lambda wheels: wheels * [0.3048, 0.3048, 1.0],
    "they in feet?": lambda wheels: wheels * [3.28, 3.28, 1.0],
    "divided by 100 once too often": lambda wheels: wheels * [0.01, 0.01, 1.0],
    "divided by 1000 once too often": lambda wheels: wheels * [0.001, 0.001, 1.0],
    "are their metres right": lambda wheels: wheels * [0.8, 0.8, 1.0],
    "turn 1.5 times as far": lambda wheels: wheels * [1.0, 1.0, 1.5],
    "wheels come 0.5 s too late": lambda wheels: np.roll(wheels, 5, axis=0),
    "wheels come 0.2 s too early": lambda wheels: np.roll(wheels, -2, axis=0),
    "stands while its scans moved": lambda wheels: wheels * (np.arange(40) < 25)[:, None],
    "does their counter wrap": jump,
    "are the wheels of this drive": lambda wheels: np.random.default_rng(0).permutation(wheels),
}


@pytest.mark.parametrize("name", DRIVES)
def test_a_clean_drive_has_no_remark(name):
    scans, wheels = drive(name)
    noisy = wheel_increments(DRIVES[name][1], WheelNoise(), rng=0)

    assert [remarks_of(scans, each) for each in (wheels, noisy, None)] == [(), (), ()]


@pytest.mark.parametrize("words", FAULTS_OF_SCANS)
@pytest.mark.parametrize("name", DRIVES)
def test_a_fault_of_the_scans_is_told_once_by_its_name(name, words):
    scans, wheels = drive(name)

    (remark,) = remarks_of([FAULTS_OF_SCANS[words](scan) for scan in scans], wheels)

    assert words in remark


@pytest.mark.parametrize("words", FAULTS_OF_WHEELS)
@pytest.mark.parametrize("name", DRIVES)
def test_a_fault_of_the_wheels_is_told_once_by_its_name(name, words):
    scans, wheels = drive(name)

    (remark,) = remarks_of(scans, FAULTS_OF_WHEELS[words](wheels))

    assert words in remark


def test_matches_that_were_refused_beside_wrong_wheels_tell_the_cause():
    _, wheels = drive("room")
    backwards = wheels * [-1.0, -1.0, 1.0]
    steps = [
        Step(
            record=StepRecord(
                increment=told,
                decision=Decision.PRIOR,
                T_taken_refused=relative(from_xytheta(told), from_xytheta(match)),
            ),
            told=told,
        )
        for told, match in zip(backwards, wheels, strict=True)
    ]

    (remark,) = remarks_on(steps)

    assert "does it look backwards" in remark
