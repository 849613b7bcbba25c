"""Remarks on whole runs: each oddity is told, and a right run has none."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from labkit import Scan
from labkit.odometry import (
    Decision,
    LessonOdometry,
    OdometryParameters,
    SanityLimits,
    StepRecord,
    estimate_odometry,
    increments_between,
    integrate,
)
from labkit.odometry.remarks import Step, remarks_on
from labkit.se2 import from_xytheta, relative
from labkit.simulation import Lidar, corridor, room, scan_along

EMPTY = Scan.from_ranges([math.inf], [0.0])
PATH = integrate([[0.12, 0.02, math.radians(4.0)]] * 30, start=[-0.5, -0.3, 0.2])
SCANS = scan_along(room(), PATH, Lidar(beam_count=181), rng=5)
WHEELS = increments_between(PATH)


def remarks_of(scans, priors):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = estimate_odometry(scans, priors)
    assert [str(each.message) for each in told] == list(run.remarks)
    return run.remarks


@pytest.mark.parametrize("priors", [WHEELS, None])
def test_a_right_run_has_no_remark(priors):
    assert remarks_of(SCANS, priors) == ()


def test_noise_of_wheels_along_a_straight_way_is_no_scanner_upside_down():
    path = np.column_stack([np.linspace(-0.5, 0.5, 31), np.zeros((31, 2))])
    scans = scan_along(room(), path, Lidar(beam_count=181), rng=5)
    wheels = increments_between(path)
    wheels[:, 2] += np.random.default_rng(0).normal(0.0, math.radians(4.0), len(wheels))

    assert remarks_of(scans, wheels) == ()


@pytest.mark.parametrize(
    "scans", [np.repeat(np.arange(15), 2), [*range(9), 8, 8, 8, *range(12, 31)]]
)
def test_scans_that_come_twice_or_hang_are_told_and_their_steps_are_doubtful(scans):
    with pytest.warns(UserWarning, match=r"\d+ of \d+ scans repeat the one before"):
        run = estimate_odometry([SCANS[k] for k in scans])

    repeats = [record for record in run.records if record.repeats]
    assert len(repeats) == np.sum(np.diff(scans) == 0)
    assert all(record.is_doubtful and not record.increment.any() for record in repeats)


@pytest.mark.parametrize("widening", [0.6, 1.4])
def test_wrong_angles_are_told_without_wheels_by_walls_that_look_bent(widening):
    wide = [Scan.from_ranges(scan.ranges[40:-40], scan.angles[40:-40] * widening) for scan in SCANS]

    (remark,) = remarks_of(wide, None)

    assert remark.startswith("straight walls look bent, as if the angles of the beams were told")


def test_many_stretches_of_one_kind_get_one_remark():
    """Of three stretches that were not matched, the longest is named."""
    matched = [Decision.ICP] * 12
    blind = [Decision.HOLD] * 11
    decisions = matched + blind + matched + [Decision.HOLD] * 15 + matched + blind + matched * 3
    records = [StepRecord(increment=np.zeros(3), decision=each) for each in decisions]

    (remark,) = remarks_on([Step(record) for record in records])

    assert remark.startswith("scans 35 to 49, and those of 2 other stretches, were not matched")


def test_a_way_along_walls_that_nothing_measured_is_told():
    path = np.column_stack([np.linspace(-3.0, 3.0, 31), np.zeros((31, 2))])
    scans = scan_along(corridor(), path, Lidar(beam_count=181, range_max=4.0), rng=1)

    untold = remarks_of(scans, None)
    told = remarks_of(scans, increments_between(path))

    assert any("nothing measured how far" in remark for remark in untold)
    assert told == ()


def test_sweeps_without_a_return_are_told_once_though_they_are_deskewed():
    blind = [replace(EMPTY, stamp=0.1 * k, time_increment=1e-3) for k in range(5)]

    (remark,) = remarks_of(blind, None)

    assert remark.startswith("4 of 4 steps had no match that is believed, 4 of them since a scan")
    assert "does the scanner run?" in remark


@pytest.mark.parametrize("ranges", [[], SCANS[0].ranges])
def test_ranges_of_unknown_beams_are_no_largest_range(ranges):
    scans = [Scan(points=SCANS[0].points + 1e-6 * k, ranges=ranges) for k in range(12)]

    assert remarks_of(scans, None) == ()


def test_units_that_fit_nothing_are_named_with_how_far_the_scans_reach():
    millimetres = [Scan.from_ranges(1e3 * scan.ranges, scan.angles) for scan in SCANS]

    remarks = [remarks_of(millimetres, WHEELS), remarks_of([s.points for s in millimetres], WHEELS)]

    farthest = np.median([np.nanmax(scan.ranges) for scan in millimetres])
    assert all("had no match that is believed" in remark for (remark,) in remarks)
    assert f"are ranges (up to {farthest:.4g} m) in metres" in remarks[0][0]
    assert "are ranges in metres" in remarks[1][0]


@pytest.mark.parametrize("priors", [WHEELS, None])
@pytest.mark.parametrize("blocked", [8, 9, 10, 14])
def test_a_scanner_that_is_blocked_for_long_is_told(priors, blocked):
    seen = [EMPTY if 8 <= k < 8 + blocked else scan for k, scan in enumerate(SCANS)]

    remarks = remarks_of(seen, priors)

    first = f"scans 8 to {7 + blocked} were not matched, the first because the newer scan has few"
    if blocked == 9:  # the step after it is doubtful, too
        first = "scans 8 to 17 may all be wrong, the first one: the newer scan has few"
    assert [remark.startswith(first) for remark in remarks] == [True] * (blocked >= 9)


def test_a_run_most_of_whose_steps_are_doubtful_says_so():
    ambiguous = StepRecord(increment=np.zeros(3), decision=Decision.ICP, margin=-0.1)
    sure = replace(ambiguous, margin=0.5)

    (remark,) = remarks_on([Step(ambiguous)] * 7 + [Step(sure)] * 6)

    assert remark.startswith("7 of 13 steps may be wrong, the first one to scan 0")
    assert remarks_on([Step(ambiguous)] * 6 + [Step(sure)] * 7) == ()


def test_matches_that_the_lesson_refuses_are_no_empty_scans():
    """Its records tell no agreement."""
    limits = SanityLimits(max_translation=0.01)
    with pytest.warns(UserWarning, match="had no match that is believed, the first because"):
        estimate_odometry(SCANS, None, OdometryParameters(limits=limits), estimator=LessonOdometry)


def test_a_stretch_of_doubtful_steps_is_told_in_a_run_that_is_right_for_the_most():
    sure = StepRecord(increment=np.zeros(3), decision=Decision.ICP, margin=0.5)
    doubtful = replace(sure, margin=0.02, reason="ambiguous")
    steps = [Step(sure)] * 20 + [Step(doubtful)] * 10 + [Step(sure)] * 20

    (remark,) = remarks_on(steps)

    assert remark.startswith("scans 20 to 29 may all be wrong, the first one: ambiguous")
    assert remarks_on(steps[1:29] + steps[30:]) == ()


def test_where_people_hide_the_view_matches_that_are_refused_explain_no_wheels():
    """Of matches of so little agreement many a drive is made, turned clockwise, or in degrees."""
    turns = np.random.default_rng(0).uniform(-1.0, 1.0, 40)
    told = np.column_stack([np.full(40, 0.2), np.zeros(40), turns])
    remarks = {}
    for agreement in (0.3, 0.8):
        steps = [
            Step(
                StepRecord(
                    increment=motion,
                    decision=Decision.PRIOR,
                    prior=motion,
                    agreement=agreement,
                    T_taken_refused=relative(*from_xytheta([motion, motion * [1.0, 1.0, -1.0]])),
                    reason="of people",
                ),
                told=motion,
            )
            for motion in told
        ]
        (remarks[agreement],) = remarks_on(steps)

    assert "clockwise" in remarks[0.8]
    assert remarks[0.3].startswith("40 of 40 steps had no match that is believed")


def test_a_stretch_where_the_wheels_lead_is_told():
    steps = [StepRecord(increment=np.zeros(3), decision=Decision.ICP)] * 30
    led = [StepRecord(increment=np.zeros(3), decision=Decision.PRIOR, led=True)] * 12

    (remark,) = remarks_on([Step(record) for record in [*steps, *led]])

    assert remark.startswith("scans 30 to 41 follow the wheels")
