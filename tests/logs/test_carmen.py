"""CARMEN logs and g2o graphs: beams, times, and which of their poses are the scanner's."""

import math

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.se2 import from_xytheta, to_xytheta, transform, wrap
from labkit.support.errors import InvalidParameterError, InvalidPointsError, LogError

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


def test_robotlaser_declares_beams_maximum_and_remissions(save, robotlaser):
    text = robotlaser([1.0, 39.9, 40.0, 41.16], maximum=40.0, stamp=7.5, remissions=(3, 4))
    scan = read_log(save(text)).scans[0]
    assert scan.beams.tolist() == [0, 1]
    assert scan.stamp == 7.5
    np.testing.assert_allclose(np.degrees(scan.angles), -90.0 + np.arange(4), atol=1e-4)


def test_degrees_are_refused_by_name(save, robotlaser):
    fields = robotlaser(FOUR).split()
    log = read_log(save(robotlaser(FOUR) + " ".join([*fields[:2], "-90", *fields[3:]])))
    assert (
        "within one turn, got -90 to -89.9476: are these degrees? `angle_unit`"
        in log.skipped[0].reason
    )


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
    with pytest.raises(LogError, match=r"run\.log: the log itself .*\[0\.2, 0\.05, 3\.0\] .*leave"):
        read_log(path, laser_offset=(0.1, 0.0, 0.0))
    with pytest.raises(InvalidPointsError, match=r"`laser_offset` must have shape \(3,\), got"):
        read_log(path, laser_offset=(0.0, 0.0))
    with pytest.raises(InvalidParameterError, match=r"`laser_offset` must be radians .* degrees\?"):
        read_log(path, laser_offset=(0.0, 0.0, 180.0))


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


@pytest.mark.parametrize("where", ["vertex", "robot"])
def test_one_damaged_pose_makes_no_odometry_of_an_echo(save, robotlaser, where):
    poses = {"vertex": [(0.5 * k, 0.1 * k * k, 0.4 * k) for k in range(5)]}
    poses["robot"] = list(poses["vertex"])
    poses[where][3] = (9.0, 0.0, 2.0)
    assert read_log(save(graph(robotlaser, poses["vertex"], poses["robot"]))).odometry is None


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


@pytest.mark.usefixtures("killian")
def test_the_name_wins_over_a_file_of_that_name(save, run, monkeypatch):
    monkeypatch.chdir(save(run, "killian").parent)
    assert [len(read_log(name)) for name in ("killian", "./killian")] == [3873, 5]


def test_lines_of_another_laser_are_named(save, flaser):
    rear = "RLASER" + flaser(FOUR)[6:]
    log = read_log(save("ODOM 1 2 3\n" + "".join(flaser(FOUR, ipc=t) + rear for t in (1, 2, 3))))
    assert (len(log), log.remarks) == (3, ("not read: 'RLASER' (3 lines)",))
