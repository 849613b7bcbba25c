"""The ladder on any log, and the class's rungs read back from what was handed in."""

import numpy as np
import pytest

import labkit
from labkit.course.ladder import (
    Rung,
    class_table,
    judge_rung,
    read_class,
    stretch_of,
    write_rungs,
)
from labkit.logs import Log
from labkit.odometry import increments_between, integrate
from labkit.simulation import Lidar, room, scan_along
from labkit.support.errors import InvalidParameterError, LogError

PATH = np.column_stack([np.arange(0.0, 1.2, 0.1), np.zeros(12), np.linspace(0.0, 0.3, 12)])
SCANS = tuple(scan_along(room(), PATH, Lidar(), rng=1))


def log_with(**poses):
    return Log(scans=SCANS, name="room", format="points", **poses)


def test_a_stretch_holds_the_motions_between_its_own_scans():
    stretch = stretch_of(log_with(odometry=PATH, reference=PATH), first=3, count=5)

    assert stretch.scans == SCANS[3:8]
    assert np.allclose(integrate(stretch.wheels, PATH[3]), stretch.truth)
    assert np.array_equal(stretch.truth, PATH[3:8])


def test_wheels_that_are_given_count_before_the_log_s_own():
    wheels = 2.0 * increments_between(PATH)

    stretch = stretch_of(log_with(odometry=PATH, reference=PATH), 3, 5, wheels)

    assert np.array_equal(stretch.wheels, wheels[3:7])


def test_without_a_reference_the_lab_s_odometry_stands_for_it():
    stretch = stretch_of(log_with())

    assert not stretch.wheels.any()
    driven = labkit.se2.relative(*labkit.from_xytheta(PATH[[0, -1]]))
    assert np.allclose(stretch.truth[-1], labkit.to_xytheta(driven), atol=0.03)


def test_a_stretch_beyond_the_log_is_refused():
    with pytest.raises(InvalidParameterError, match=r"`first` must leave two scans .* 12, got 11"):
        stretch_of(log_with(), first=11)


def test_a_longer_drive_with_the_same_steps_ends_farther_off_and_drifts_alike():
    truth = np.column_stack([np.arange(61.0), np.zeros(61), np.zeros(61)])
    path = truth * [1.02, 1.0, 1.0]

    short, long = judge_rung(path[:31], truth[:31]), judge_rung(path, truth)

    assert np.allclose(short, (0.2, 0.6))
    assert np.allclose(long, (0.2, 1.2))


def test_what_students_write_is_what_the_class_reads(tmp_path):
    rungs = {"2 gate": (0.18, 9.4), "5 lines": (0.1, 2.75)}
    for student, first in (("Ada", 0), ("Bo, jr.", 600)):
        folder = tmp_path / student
        folder.mkdir()
        write_rungs(folder / f"ladder-{first}.csv", student, "killian", first, rungs)

    read = read_class(tmp_path)

    assert read[1] == Rung("Ada", "killian", 0, "5 lines", 0.1, 2.75)
    assert {(rung.student, rung.first) for rung in read} == {("Ada", 0), ("Bo, jr.", 600)}


def test_a_line_that_is_no_rung_is_named_with_its_place(tmp_path):
    file = tmp_path / "ladder-ada.csv"
    file.write_text("student,log,first,rung,drift,end\nAda,killian,0,2 gate,small,9.4\n", "utf-8")

    with pytest.raises(LogError, match=r"ladder-ada\.csv:2: .* got .*small"):
        read_class(tmp_path)


def test_the_table_leaves_a_gap_where_somebody_left_out_a_rung():
    rungs = [
        Rung("Ada", "killian", 0, "2 gate", 0.2, 9.0),
        Rung("Ada", "killian", 0, "5 lines", 0.1, 2.0),
        Rung("Bo", "intel", 40, "2 gate", 0.4, 8.0),
    ]

    rows = class_table(rungs).splitlines()

    assert rows[2:] == [
        "| Ada | killian 0 | 0.20 | 0.10 | 2.0 |",
        "| Bo | intel 40 | 0.40 |  | 8.0 |",
    ]
