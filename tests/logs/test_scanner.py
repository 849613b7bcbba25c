"""Headers that contradict themselves: first and last angle, step and count vote."""

import math

import numpy as np
import pytest

from labkit.logs import LogOptions
from labkit.logs.lines import DamageReport
from labkit.logs.scanner import Scanner
from labkit.support.errors import InvalidParameterError

N = 120
STEP = 2.0 * math.pi / N
FIRST, LAST = -math.pi, math.pi - STEP


@pytest.fixture
def report():
    return DamageReport("run.log", strict=False)


@pytest.mark.parametrize(
    ("first", "last", "step", "right", "remark"),
    [
        (FIRST, LAST, STEP, STEP, ""),
        (FIRST, LAST + STEP, STEP, STEP, ""),  # the last one lies a beam off
        (-FIRST, -LAST, STEP, -STEP, "a step whose sign leads away"),
        (-FIRST, -LAST - STEP, STEP, -STEP, "a step whose sign leads away"),
        (FIRST, LAST, 0.0, STEP, "no step between their beams"),
        (FIRST, LAST, 0.986 * STEP, STEP, "first and last close a turn"),
        (FIRST, LAST, 1.02 * STEP, STEP, "first and last close a turn"),
        (-1.5, 1.5, STEP / 3.0, STEP / 3.0, "the first and the step count"),
    ],
)
def test_the_vote_on_the_step(report, first, last, step, right, remark):
    angles = Scanner(LogOptions(), report).beams(N, first, step, last)

    np.testing.assert_allclose(angles, first + right * np.arange(N), atol=1e-9)
    remarks = report.all_remarks(1)
    assert len(remarks) == bool(remark)
    assert all(remark in each for each in remarks)


def test_the_caller_s_directions_need_no_vote(report):
    angles = Scanner(LogOptions(angles=(-1.0, 1.0)), report).beams(N, 0.0, 7.0, 3.0)
    np.testing.assert_allclose(angles[[0, -1]], [-1.0, 1.0])
    assert report.all_remarks(1) == ()


@pytest.mark.parametrize(
    ("unit", "value"), [("range_unit", "km"), ("angle_unit", "mm"), ("range_unit", 1000)]
)
def test_a_unit_that_is_none_is_refused_with_those_that_are(unit, value):
    with pytest.raises(ValueError, match=rf"`{unit}` must be .*, got {value!r}"):
        LogOptions(**{unit: value})


def test_blind_beams_make_no_point_and_those_that_are_not_there_are_told(report):
    scanner = Scanner(LogOptions(blind_beams=[1, 9]), report)
    scan = scanner.scan([1.0, 2.0, 3.0], np.arange(3.0)).make()
    assert scan.beams.tolist() == [0, 2]
    assert "1 scans have fewer beams than `blind_beams`" in report.all_remarks(1)[0]


def test_equal_angles_of_the_first_and_the_last_beam_are_refused():
    with pytest.raises(InvalidParameterError, match=r"`angles` must differ .* got \(0\.5, 0\.5\)"):
        LogOptions(angles=(0.5, 0.5))
