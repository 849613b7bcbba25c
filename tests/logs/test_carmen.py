import math

import numpy as np
import pytest

from labkit.errors import InvalidParameterError, LogError
from labkit.logs import read_log
from labkit.se2 import from_xytheta, to_xytheta, transform, wrap

FOUR = [1.0, 2.0, 3.0, 4.0]


def test_flaser_scan_pose_and_time(save, flaser):
    log = read_log(save(flaser(FOUR, (1.0, 2.0, 0.5), ipc=10.25)))
    assert (len(log), log.name, log.format, log.skipped) == (1, "run", "carmen", ())
    assert log.reference is None
    assert log.odometry.tolist() == [[1.0, 2.0, 0.5]]
    assert log.stamps.tolist() == [10.25]
    scan = log.scans[0]
    assert scan.ranges.tolist() == FOUR
    np.testing.assert_allclose(scan.points[0], [0.0, -1.0], atol=1e-15)


@pytest.mark.parametrize(
    ("n", "step"), [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5), (4, 45.0), (5, 45.0)]
)
def test_beams_start_at_minus_90_degrees(save, flaser, n, step):
    angles = np.degrees(read_log(save(flaser([1.0] * n))).scans[0].angles)
    np.testing.assert_allclose(angles, -90.0 + step * np.arange(n), atol=1e-12)


@pytest.mark.parametrize("code", [0, "nan", "inf", -1.0])
def test_what_is_no_range_makes_no_point(save, flaser, code):
    scan = read_log(save(flaser([1.0, code, 40.0, 60.0]))).scans[0]
    assert scan.beams.tolist() == [0, 2, 3]
    assert len(scan.ranges) == 4


def test_range_max_takes_the_place_of_the_codes(save, flaser):
    path = save(flaser([1.0, 50.5, 60.0, 81.83]))
    assert read_log(path).scans[0].beams.tolist() == [0, 1, 2]
    assert read_log(path, range_max=60.0).scans[0].beams.tolist() == [0, 1]
    with pytest.raises(InvalidParameterError, match=r"`range_max` must be in .* got -1"):
        read_log(path, range_max=-1.0)


@pytest.mark.parametrize("word", ["flaser", "robotlaser"])
def test_the_largest_number_there_is_is_no_return(save, request, word):
    line = request.getfixturevalue(word)([1.0, 3.4e38, 40.0, 3.4028235e38])
    path = save(line.replace(" 50.0 ", " 1e300 ") if word == "robotlaser" else line)
    assert read_log(path).scans[0].beams.tolist() == [0, 2]
    assert read_log(path, range_max=1e300).scans[0].beams.tolist() == [0, 2]


def test_robotlaser_declares_beams_maximum_and_remissions(save, robotlaser):
    line = robotlaser([1.0, 49.9, 50.0, 51.16], (1.0, 0.0, 0.0), stamp=7.5, remissions=(3, 4))
    scan = read_log(save(line)).scans[0]
    assert scan.beams.tolist() == [0, 1]
    assert scan.stamp == 7.5
    np.testing.assert_allclose(np.degrees(scan.angles), -90.0 + np.arange(4), atol=1e-4)
    assert read_log(save(line), range_max=10.0).scans[0].beams.tolist() == [0]


def test_robotlaser_step_is_refined_by_the_field_of_view(save, robotlaser):
    line = robotlaser([1.0] * 180).replace(str(180 * 0.017453), "3.141593")
    angles = read_log(save(line)).scans[0].angles
    np.testing.assert_allclose(angles, np.radians(-90.0 + np.arange(180)), atol=1e-6)


def test_robotlaser_of_a_sick_answers_below_its_declared_maximum(save, robotlaser):
    scan = read_log(save(robotlaser([1.0, 81.83, 60.0, 81.91], maximum=81.92))).scans[0]
    assert scan.beams.tolist() == [0, 2]


def test_other_first_words_are_passed_over(save, flaser):
    text = "NEFF 3\nRAWLASER1 garbage\nTRUEPOS 1 2 3\n\n" + flaser(FOUR) + "SYNC x\n"
    odom = "ODOM 1 2 3 0 0 0 5.0 host 6.0\n"
    log = read_log(save(text + odom), strict=True)
    assert (len(log), log.skipped) == (1, ())


def test_logger_stamp_stands_in_for_a_missing_one(save, flaser):
    assert read_log(save(flaser(FOUR, ipc=0.0, logger=3.5))).stamps.tolist() == [3.5]


def test_a_log_of_zero_stamps_has_no_times(save, flaser):
    log = read_log(save(2 * flaser(FOUR, ipc=0.0, logger=0.0)))
    assert np.isnan(log.stamps).all()


def test_a_clock_may_begin_at_zero(save, flaser):
    lines = [flaser(FOUR, ipc=0.1 * k, logger=0.0) for k in range(3)]
    assert read_log(save("".join(lines))).stamps.tolist() == [0.0, 0.1, 0.2]


def test_odometry_angles_are_wrapped(save, flaser):
    log = read_log(save(flaser(FOUR, (0.0, 0.0, -math.pi)) + flaser(FOUR, (0.0, 0.0, 4.0))))
    np.testing.assert_allclose(log.odometry[:, 2], [math.pi, 4.0 - 2.0 * math.pi])


def test_laser_offset_is_composed_on_the_right(save, flaser):
    robot, offset = (1.0, 2.0, math.pi / 2), (0.092, -0.002, 0.1)
    log = read_log(save(flaser(FOUR, robot)), laser_offset=offset)
    expected = to_xytheta(from_xytheta(robot) @ transform(*offset))
    np.testing.assert_allclose(log.odometry, [expected], atol=1e-15)


def mounted_run(flaser, mount):
    robot = np.array([[0.7 * k, 0.1 * k, 0.9 * k] for k in range(6)])
    laser = to_xytheta(from_xytheta(robot) @ transform(*mount))
    lines = [
        flaser(FOUR, a, b) for a, b in zip(np.round(laser, 6), np.round(robot, 6), strict=True)
    ]
    return "".join(lines), laser


def test_a_declared_mounting_gives_the_pose_of_the_laser(save, flaser):
    text, laser = mounted_run(flaser, (0.2, 0.05, 3.0))
    log = read_log(save(text))
    np.testing.assert_allclose(log.odometry, laser, atol=1e-6)
    assert log.reference is None
    with pytest.raises(LogError, match=r"run\.log: the log itself says.*0\.200 m, 0\.050 m"):
        read_log(save(text), laser_offset=(0.1, 0.0, 0.0))


def test_a_laser_pose_that_leaves_the_robot_is_a_correction(save, flaser):
    robot = [(1.0 * k, 0.0, 0.0) for k in range(4)]
    corrected = [(1.0 * k, 0.3 * k, 0.1 * k) for k in range(4)]
    lines = [flaser(FOUR, c, r) for c, r in zip(corrected, robot, strict=True)]
    log = read_log(save("".join(lines)), laser_offset=(0.5, 0.0, 0.0))
    np.testing.assert_allclose(log.odometry, np.add(robot, (0.5, 0.0, 0.0)))
    np.testing.assert_allclose(log.reference, corrected)


def test_a_corrected_log_is_one_however_slowly_its_poses_part(save, flaser):
    k = np.arange(300)
    robot = np.column_stack([0.1 * k, np.sin(0.1 * k), wrap(0.3 * k)])
    corrected = to_xytheta(
        from_xytheta(np.column_stack([0.001 * k, -0.0005 * k, 1e-3 * k])) @ from_xytheta(robot)
    )
    lines = [flaser(FOUR, c, r) for c, r in zip(corrected, robot, strict=True)]
    log = read_log(save("".join(lines)), strict=True)
    np.testing.assert_allclose(log.odometry, robot, atol=1e-12)
    np.testing.assert_allclose(log.reference, corrected, atol=1e-12)


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (0.092, 0.0, 0.0), (-0.2, 0.1, math.pi)])
@pytest.mark.parametrize("field", range(6, 12))
def test_one_damaged_pose_is_one_damaged_line(save, flaser, mount, field):
    text, _ = mounted_run(flaser, mount)
    lines = text.splitlines(keepends=True)
    whole = read_log(save(text))
    fields = lines[3].split()
    fields[field] = str(float(fields[field]) + 101.5)
    path = save("".join([*lines[:3], " ".join(fields) + "\n", *lines[4:]]))
    log = read_log(path)
    assert [s.line for s in log.skipped] == [4]
    assert log.skipped[0].reason.startswith("the laser sits (")
    assert log.reference is None
    assert (log.odometry == np.delete(whole.odometry, 3, axis=0)).all()
    with pytest.raises(LogError, match=r"run\.log:4: the laser sits .* in other lines \("):
        read_log(path, strict=True)


@pytest.mark.parametrize(("damaged", "skipped"), [(4, 4), (5, 0)])
def test_damage_contradicts_no_more_than_2_percent_of_the_lines(save, flaser, damaged, skipped):
    laser = [(9.0 if k < damaged else 0.0, 0.0, 0.0) for k in range(200)]
    log = read_log(save("".join(flaser(FOUR, pose, (0.0, 0.0, 0.0)) for pose in laser)))
    assert len(log.skipped) == skipped
    assert (log.reference is None) == (skipped > 0)


FLASER_DAMAGE = [
    (lambda f: f[:-1], "14 fields, expected 15 for FLASER with 4 beams"),
    (lambda f: [*f, "9"], "16 fields, expected 15"),
    (lambda f: [f[0], "5", *f[2:]], "15 fields, expected 16 for FLASER with 5 beams"),
    (lambda f: [f[0], "four", *f[2:]], "the number of beams is 'four', expected an integer ≥ 2"),
    (lambda f: [f[0], "-4", *f[2:]], "the number of beams is '-4'"),
    (lambda f: f[:1], "the line ends before the number of beams"),
    (lambda f: [*f[:3], "x2", *f[4:]], "range 2 is 'x2', expected a number"),
    (lambda f: [*f[:6], "nan", *f[7:]], "x of the laser pose is 'nan', expected a finite number"),
    (lambda f: [*f[:11], "inf", *f[12:]], "theta of the robot pose is 'inf'"),
    (lambda f: [*f[:7], "1e300", *f[8:]], "expected to lie within 1e+09 m"),
    (
        lambda f: [*f[:8], "-1e300", *f[9:]],
        "theta of the laser pose is -1e+300, expected at most 1e+06 rad",
    ),
    (lambda f: [*f[:12], "1e21", *f[13:]], "beside host 'host' is '1e21', expected at most 1e+20"),
    (lambda f: [*f[:12], "noon", *f[13:]], "the timestamp beside host 'host' is 'noon'"),
]


@pytest.mark.parametrize(("damage", "reason"), FLASER_DAMAGE)
def test_a_damaged_line_is_skipped_or_named(save, flaser, damage, reason):
    good = flaser(FOUR)
    path = save(good + " ".join(damage(good.split())) + "\n" + good)
    log = read_log(path)
    assert len(log) == 2
    assert [(s.file, s.line) for s in log.skipped] == [(str(path), 2)]
    assert reason in log.skipped[0].reason
    with pytest.raises(LogError) as raised:
        read_log(path, strict=True)
    assert str(raised.value) == f"{path}:2: {log.skipped[0].reason}" == str(log.skipped[0])


ROBOTLASER_DAMAGE = [
    (lambda f: f[:5], "5 fields, the line ends before the number of beams"),
    (lambda f: f[:11], "the line ends before the number of remissions"),
    (lambda f: f[:-1], "27 fields, expected 28 for ROBOTLASER1 with 4 beams and 0 remissions"),
    (lambda f: [*f[:4], "0", *f[5:]], "in steps of 0, expected radians and a positive step"),
    (lambda f: [*f[:2], "-90", *f[3:]], "beams from -90 in steps of 0.017453, expected radians"),
    (lambda f: [*f[:5], "-1", *f[6:]], "the maximum range is -1, expected a positive number"),
    (lambda f: [*f[:2], "left", *f[3:]], "start angle is 'left', expected a finite number"),
    (lambda f: [*f[:14], "?", *f[15:]], "x of the laser pose is '?'"),
]


@pytest.mark.parametrize(("damage", "reason"), ROBOTLASER_DAMAGE)
def test_a_damaged_robotlaser_line_is_named(save, robotlaser, damage, reason):
    good = robotlaser(FOUR)
    path = save(good + " ".join(damage(good.split())) + "\n")
    log = read_log(path)
    assert (len(log), log.skipped[0].line) == (1, 2)
    assert reason in log.skipped[0].reason


def test_a_damaged_odom_line_is_reported(save, flaser):
    log = read_log(save(flaser(FOUR) + "ODOM 1 2 nan 0 0 0 5.0 host 6.0\nODOM 1 2\n"))
    assert [str(s).rpartition("run.log:")[2] for s in log.skipped] == [
        "2: theta of the robot pose is 'nan', expected a finite number",
        "3: 3 fields, expected 10 for ODOM",
    ]


def test_a_log_without_any_scan(save):
    odom = "ODOM 1 2 3 0 0 0 5.0 host 6.0\n"
    with pytest.raises(LogError, match=r"run\.log: a CARMEN log without any scan, expected FLASER"):
        read_log(save(odom))
    with pytest.raises(LogError, match=r"1 damaged line was skipped, the first is 2: 2 fields"):
        read_log(save(odom + "FLASER 180\n"))


def test_a_scan_in_which_nothing_came_back_is_kept(save, flaser):
    log = read_log(save(flaser([81.83] * 4)))
    assert (len(log), len(log.scans[0])) == (1, 0)
