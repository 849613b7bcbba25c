"""CARMEN logs and g2o graphs: beams, times, and which of their poses are the scanner's."""

import math
import sys

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.se2 import from_xytheta, relative, to_xytheta, transform, wrap
from labkit.support.errors import InvalidParameterError, LogError
from labkit.support.extras import MissingExtraError

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


@pytest.mark.parametrize(("n", "step"), [(180, 1.0), (181, 1.0), (361, 0.5), (5, 45.0)])
def test_beams_start_at_minus_90_degrees(save, flaser, n, step):
    angles = np.degrees(read_log(save(flaser([1.0] * n))).scans[0].angles)
    np.testing.assert_allclose(angles, -90.0 + step * np.arange(n), atol=1e-12)


@pytest.mark.parametrize("code", [0, "nan", 3.4028235e38])
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


def test_robotlaser_declares_beams_maximum_and_remissions(save, robotlaser):
    path = save(robotlaser([1.0, 49.9, 50.0, 51.16], stamp=7.5, remissions=(3, 4)))
    scan = read_log(path).scans[0]
    assert scan.beams.tolist() == [0, 1]
    assert scan.stamp == 7.5
    np.testing.assert_allclose(np.degrees(scan.angles), -90.0 + np.arange(4), atol=1e-4)
    assert read_log(path, range_max=10.0).scans[0].beams.tolist() == [0]


def test_other_first_words_are_passed_over(save, flaser):
    text = "NEFF 3\nRAWLASER1 garbage\nTRUEPOS 1 2 3\n\n" + flaser(FOUR) + "SYNC x\n"
    log = read_log(save(text + "ODOM 1 2 3 0 0 0 5.0 host 6.0\n"), strict=True)
    assert (len(log), log.skipped) == (1, ())


@pytest.mark.parametrize(
    ("clocks", "stamps"),
    [
        ([(0.0, 3.5)], [3.5]),  # the logger's stands in
        ([(0.0, 0.0), (0.0, 0.0)], [np.nan, np.nan]),
        ([(0.0, 0.0), (0.1, 0.0)], [0.0, 0.1]),
    ],
)
def test_clocks(save, flaser, clocks, stamps):
    log = read_log(save("".join(flaser(FOUR, ipc=ipc, logger=logger) for ipc, logger in clocks)))
    np.testing.assert_array_equal(log.stamps, stamps)


def test_a_clock_that_stands_still_or_runs_backwards_is_told(save, flaser):
    stamps = [10.0, 11.0, 11.0, 10.5, 12.0, 11.5]
    log = read_log(save("".join(flaser(FOUR, ipc=stamp) for stamp in stamps)))
    assert log.remarks == (
        "the clock of the scans runs backwards 2 times, first at line 4: 10.5 s after 11 s",
        "the clock of the scans stands still 1 times, first at line 3: 11 s after 11 s",
    )


FLASER_DAMAGE = [
    (lambda f: f[:1], "1 fields, the line ends before the number of beams"),
    (lambda f: [f[0], "-4", *f[2:]], "the number of beams is '-4', expected an integer ≥ 2"),
    (lambda f: [f[0], "5", *f[2:]], "15 fields, expected 16 for FLASER with 5 beams"),
    (lambda f: [*f[:3], "2..0", *f[4:]], "range 2 is '2..0', expected a number"),
    (lambda f: [*f[:8], "inf", *f[9:]], "theta of the laser pose is 'inf', expected a finite"),
    (lambda f: [*f[:9], "2e9", *f[10:]], "the robot pose is (2e+09, 0), expected to lie within"),
    (lambda f: [*f[:12], "never", *f[13:]], "the timestamp beside host 'host' is 'never'"),
]
ROBOTLASER_DAMAGE = [
    (lambda f: f[:11], "the line ends before the number of remissions"),
    (lambda f: f[:-1], "27 fields, expected 28 for ROBOTLASER1 with 4 beams and 0 remissions"),
    (
        lambda f: [*f[:2], "-90", *f[3:]],
        "`angles` must be radians within one turn, got -90 to 0: are these degrees",
    ),
    (lambda f: [*f[:5], "-1", *f[6:]], "the maximum range is -1, expected a positive number"),
]


@pytest.mark.parametrize(
    ("word", "damage", "reason"),
    [("flaser", *case) for case in FLASER_DAMAGE]
    + [("robotlaser", *case) for case in ROBOTLASER_DAMAGE],
)
def test_a_damaged_line_is_skipped_or_raised_by_its_number(save, request, word, damage, reason):
    good = request.getfixturevalue(word)(FOUR)
    path = save(good + " ".join(damage(good.split())) + "\n")
    log = read_log(path)
    assert (len(log), log.skipped[0].line) == (1, 2)
    assert reason in log.skipped[0].reason
    with pytest.raises(LogError) as raised:
        read_log(path, strict=True)
    assert str(raised.value) == f"{path}:2: {log.skipped[0].reason}" == str(log.skipped[0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ODOM 1 2 3 0 0 0 5.0 host 6.0\n", r"a carmen log without any scan, expected FLASER"),
        ("PARAM x\nFLASER 180\n", r"1 damaged, the first is 2: 2 fields"),
        ("VERTEX_SE2 0 0 0 0\n", "a g2o log without any scan, expected a ROBOTLASER1 line below"),
    ],
)
def test_a_log_without_any_scan(save, text, message):
    with pytest.raises(LogError, match=message):
        read_log(save(text))


# Whose pose is it?


def carmen(flaser, laser, robot):
    return "".join(flaser(FOUR, a, b) for a, b in zip(laser, robot, strict=True))


def test_odometry_angles_are_wrapped(save, flaser):
    log = read_log(save(flaser(FOUR, (0.0, 0.0, -math.pi)) + flaser(FOUR, (0.0, 0.0, 4.0))))
    np.testing.assert_allclose(log.odometry[:, 2], [math.pi, 4.0 - 2.0 * math.pi])


ROBOT = np.array([[0.7 * k, 0.1 * k, wrap(0.9 * k)] for k in range(6)])


def mounted(mount):
    return to_xytheta(from_xytheta(ROBOT) @ transform(*mount))


def test_a_declared_mounting_gives_the_pose_of_the_laser(save, flaser):
    laser = mounted((0.2, 0.05, 3.0)).round(6)
    path = save(carmen(flaser, laser, ROBOT.round(6)))
    log = read_log(path)
    np.testing.assert_allclose(log.odometry, laser, atol=1e-6)
    assert log.reference is None
    with pytest.raises(LogError, match=r"run\.log: the log itself says.*0\.200 m, 0\.050 m"):
        read_log(path, laser_offset=(0.1, 0.0, 0.0))


@pytest.mark.parametrize("count", [4, 300])
def test_a_laser_pose_that_leaves_the_robot_is_a_correction(save, flaser, count):
    k = np.arange(count)
    robot = np.column_stack([0.1 * k, np.sin(0.1 * k), wrap(0.3 * k)])
    drift = np.column_stack([k, -0.5 * k, k]) * (0.3 if count == 4 else 0.001)
    corrected = to_xytheta(from_xytheta(drift) @ from_xytheta(robot))
    path = save(carmen(flaser, corrected, robot))
    log = read_log(path, strict=True)
    np.testing.assert_allclose(log.odometry, robot, atol=1e-12)
    np.testing.assert_allclose(log.reference, corrected, atol=1e-12)
    offset = (0.092, -0.002, 0.1)
    expected = to_xytheta(from_xytheta(robot) @ transform(*offset))
    np.testing.assert_allclose(read_log(path, laser_offset=offset).odometry, expected, atol=1e-12)


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (-0.2, 0.1, math.pi)])
@pytest.mark.parametrize("field", [6, 8, 9, 11])
def test_one_damaged_pose_makes_no_correction(save, flaser, mount, field):
    lines = carmen(flaser, mounted(mount).round(6), ROBOT.round(6)).splitlines(keepends=True)
    whole = read_log(save("".join(lines)))
    fields = lines[3].split()
    fields[field] = str(float(fields[field]) + 101.5)
    log = read_log(save("".join([*lines[:3], " ".join(fields) + "\n", *lines[4:]])))
    assert log.reference is None
    others = np.arange(6) != 3
    assert (log.odometry[others] == whole.odometry[others]).all()


def graph(robotlaser, vertices, robots, mount=0.0):
    text = ""
    for index, (vertex, robot) in enumerate(zip(vertices, robots, strict=True)):
        laser = (robot[0] + mount, *robot[1:])
        text += f"VERTEX_SE2 {index} {' '.join(map(str, vertex))}\n{robotlaser(FOUR, laser, robot)}"
    return text + "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"


STRAIGHT = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]
DRIFTED = [(0.0, 0.0, 0.0), (1.1, 0.1, 0.0)]


def test_vertices_are_the_reference_and_their_echo_is_no_odometry(save, robotlaser):
    log = read_log(save(graph(robotlaser, STRAIGHT, STRAIGHT), "run.g2o"))
    assert (log.format, len(log), log.odometry) == ("g2o", 2, None)
    assert log.reference.tolist() == [list(row) for row in STRAIGHT]


@pytest.mark.parametrize(("mount", "offset"), [(0.0, (0.0, 0.25, 0.5)), (0.25, (0.0, 0.0, 0.0))])
def test_poses_of_their_own_are_odometry_and_both_move_to_the_scanner(
    save, robotlaser, mount, offset
):
    path = save(graph(robotlaser, STRAIGHT, DRIFTED, mount=mount))
    log = read_log(path, laser_offset=offset)
    np.testing.assert_allclose(log.reference, np.add(STRAIGHT, offset) + np.array([mount, 0, 0]))
    np.testing.assert_allclose(log.odometry, np.add(DRIFTED, offset) + np.array([mount, 0, 0]))
    if mount:
        with pytest.raises(LogError, match="leave `laser_offset` out"):
            read_log(path, laser_offset=(0.1, 0.0, 0.0))


@pytest.mark.parametrize("where", ["vertex", "robot"])
def test_one_damaged_pose_makes_no_odometry_of_an_echo(save, robotlaser, where):
    poses = {"vertex": [(0.5 * k, 0.1 * k * k, 0.4 * k) for k in range(5)]}
    poses["robot"] = list(poses["vertex"])
    poses[where][3] = (9.0, 0.0, 2.0)
    assert read_log(save(graph(robotlaser, poses["vertex"], poses["robot"]))).odometry is None


def test_a_scan_whose_vertex_is_damaged_is_skipped_with_it(save, robotlaser):
    text = graph(robotlaser, STRAIGHT, STRAIGHT).replace("VERTEX_SE2 1 1.0", "VERTEX_SE2 1 one")
    log = read_log(save(text))
    assert len(log) == len(log.reference) == 1
    assert [(s.line, s.reason) for s in log.skipped] == [
        (3, "x of the vertex is 'one', expected a finite number"),
        (4, "a scan of no vertex, expected a VERTEX_SE2 line above it"),
    ]


# The built-in run


def test_killian_is_the_run_that_the_book_describes(killian):
    assert (len(killian), killian.name, killian.format) == (3873, "killian", "g2o")
    assert killian.skipped == ()
    assert killian.odometry is None
    assert (np.diff(killian.stamps) > 0.0).all()
    for scan in killian.scans:
        assert len(scan) == np.count_nonzero(scan.ranges < 50.0)
    np.testing.assert_allclose(
        np.degrees(killian.scans[0].angles), -90.0 + np.arange(180), atol=1e-4
    )
    T = from_xytheta(killian.reference)
    steps = to_xytheta(relative(T[:-1], T[1:]))
    length, turn = np.hypot(steps[:, 0], steps[:, 1]), np.degrees(np.abs(steps[:, 2]))
    assert np.median(length) == pytest.approx(0.52, abs=0.005)
    assert length.sum() == pytest.approx(1906.0, abs=1.0)
    assert np.percentile(turn, 95) == pytest.approx(13.0, abs=0.5)


def test_the_name_wins_over_a_file_of_that_name(save, run, monkeypatch, killian):
    monkeypatch.chdir(save(run, "killian").parent)
    log = read_log("killian", range_max=5.0, laser_offset=(0.1, 0.0, 0.0), strict=True)
    assert all((scan.ranges[scan.beams] < 5.0).all() for scan in log.scans)
    moved = np.hypot(*(log.reference - killian.reference)[:, :2].T)
    np.testing.assert_allclose(moved, 0.1)
    assert len(read_log("./killian")) == 5


def test_a_missing_package_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtbdata", None)
    with pytest.raises(MissingExtraError, match=r'rtb-data, .* install "labkit\[killian\]"$'):
        read_log("killian")
