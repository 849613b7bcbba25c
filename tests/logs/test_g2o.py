import numpy as np
import pytest

from labkit.errors import InvalidPointsError, LogError
from labkit.logs import read_log, write_g2o
from labkit.se2 import from_xytheta, to_xytheta, transform

FOUR = [1.0, 2.0, 3.0, 4.0]


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


def test_a_graph_of_zero_stamps_has_no_times(save, robotlaser):
    text = graph(robotlaser, STRAIGHT, STRAIGHT).replace(" 1.0 host 2.0", " 0 host 0")
    assert np.isnan(read_log(save(text)).stamps).all()


def test_poses_of_their_own_are_odometry(save, robotlaser):
    log = read_log(save(graph(robotlaser, STRAIGHT, DRIFTED)))
    assert log.odometry.tolist() == [list(row) for row in DRIFTED]


def test_a_declared_mounting_moves_both_to_the_scanner(save, robotlaser):
    path = save(graph(robotlaser, STRAIGHT, DRIFTED, mount=0.25))
    log = read_log(path)
    np.testing.assert_allclose(log.reference, np.add(STRAIGHT, (0.25, 0.0, 0.0)))
    np.testing.assert_allclose(log.odometry, np.add(DRIFTED, (0.25, 0.0, 0.0)))
    with pytest.raises(LogError, match=r"leave `laser_offset` out"):
        read_log(path, laser_offset=(0.1, 0.0, 0.0))


def test_laser_offset_moves_both_to_the_scanner(save, robotlaser):
    path = save(graph(robotlaser, STRAIGHT, DRIFTED))
    log = read_log(path, laser_offset=(0.0, 0.25, 0.5))
    np.testing.assert_allclose(log.reference, np.add(STRAIGHT, (0.0, 0.25, 0.5)))
    np.testing.assert_allclose(log.odometry, np.add(DRIFTED, (0.0, 0.25, 0.5)))


WINDING = [(0.5 * k, 0.1 * k * k, 0.4 * k) for k in range(5)]


@pytest.mark.parametrize("damage", [(9.0, 0.0, 0.0), (0.0, -9.0, 0.0), (0.0, 0.0, 2.0)])
@pytest.mark.parametrize("where", ["vertex", "robot and laser", "laser"])
def test_one_damaged_pose_makes_no_odometry_of_an_echo(save, robotlaser, damage, where):
    robots, vertices, lasers = list(WINDING), list(WINDING), list(WINDING)
    for name, poses in (("vertex", vertices), ("robot", robots), ("laser", lasers)):
        if name in where:
            poses[3] = tuple(np.add(poses[3], damage))
    lines = (
        f"VERTEX_SE2 0 {' '.join(map(str, vertex))}\n{robotlaser(FOUR, laser, robot)}"
        for vertex, laser, robot in zip(vertices, lasers, robots, strict=True)
    )
    path = save("".join(lines))
    log = read_log(path, laser_offset=(0.25, 0.0, 0.0))
    assert (len(log), log.odometry) == (4, None)
    assert [s.line for s in log.skipped] == [8]
    whole = read_log(save(graph(robotlaser, WINDING, WINDING)), laser_offset=(0.25, 0.0, 0.0))
    assert (log.reference == np.delete(whole.reference, 3, axis=0)).all()


def test_a_laser_pose_that_leaves_the_robot_is_no_mounting(save, robotlaser):
    text = "".join(
        f"VERTEX_SE2 {k} {k} 0 0\n{robotlaser(FOUR, (k, 0.0, 0.0), (k, 0.5 * k, 0.1 * k))}"
        for k in range(6)
    )
    log = read_log(save(text), laser_offset=(0.25, 0.0, 0.0))
    np.testing.assert_allclose(log.reference, [(k + 0.25, 0.0, 0.0) for k in range(6)])
    robot = from_xytheta([(k, 0.5 * k, 0.1 * k) for k in range(6)])
    np.testing.assert_allclose(log.odometry, to_xytheta(robot @ transform(0.25, 0.0, 0.0)))


def test_a_scan_whose_vertex_is_damaged_is_skipped_with_it(save, robotlaser):
    text = graph(robotlaser, STRAIGHT, STRAIGHT).replace("VERTEX_SE2 1 1.0", "VERTEX_SE2 1 one")
    log = read_log(save(text))
    assert len(log) == len(log.reference) == 1
    assert [(s.line, s.reason) for s in log.skipped] == [
        (3, "x of the vertex is 'one', expected a finite number"),
        (4, "a scan of no vertex, expected a VERTEX_SE2 line above it"),
    ]
    with pytest.raises(LogError, match=r"run\.log:3: x of the vertex"):
        read_log(save(text), strict=True)


def test_a_graph_without_scans(save):
    with pytest.raises(LogError, match="a g2o graph without any scan, expected a ROBOTLASER1 line"):
        read_log(save("VERTEX_SE2 0 0 0 0\n"))


def read_back(path, word):
    rows = [line.split() for line in path.read_text().splitlines()]
    return np.array([list(map(float, row[1:])) for row in rows if row[0] == word])


def test_numbers_come_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(4)
    poses, increments = rng.normal(size=(5, 3)) * 1e3, rng.normal(size=(4, 3)) / 7.0
    write_g2o(tmp_path / "out.g2o", poses, increments)
    vertices = read_back(tmp_path / "out.g2o", "VERTEX_SE2")
    edges = read_back(tmp_path / "out.g2o", "EDGE_SE2")
    assert (vertices[:, 0] == np.arange(5)).all()
    assert (vertices[:, 1:] == poses).all()
    assert (edges[:, :2] == [[0, 1], [1, 2], [2, 3], [3, 4]]).all()
    assert (edges[:, 2:5] == increments).all()
    assert (edges[:, 5:] == [1, 0, 0, 1, 0, 1]).all()


def test_loop_edges_and_their_information(tmp_path):
    information = np.array([np.diag([1.0, 2.0, 3.0]), np.full((3, 3), 0.5)])
    path = tmp_path / "out.g2o"
    write_g2o(
        path, np.zeros((3, 3)), np.ones((2, 3)), pairs=[[0, 2], [1, 0]], information=information
    )
    edges = read_back(path, "EDGE_SE2")
    assert edges[:, :2].tolist() == [[0, 2], [1, 0]]
    assert edges[:, 5:].tolist() == [[1, 0, 0, 2, 0, 3], [0.5] * 6]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"poses": np.zeros((3, 2))}, r"`poses` must have shape \(K, 3\).* got \(3, 2\)"),
        ({"increments": np.zeros((3, 3))}, r"one row fewer than `poses`, got 3 and 3"),
        ({"poses": np.full((3, 3), np.nan)}, r"`poses` must be finite, got \[nan.*index 0"),
        ({"pairs": [[0, 3], [0, 1]]}, r"`pairs` must name vertices 0 to 2, got 0 to 3"),
        ({"pairs": [[0.0, 1.0]] * 2}, r"`pairs` must be integers of shape \(2, 2\)"),
        ({"information": np.eye(2)}, r"`information` must be finite, of shape.*got shape \(2, 2\)"),
    ],
)
def test_shapes_that_do_not_fit(tmp_path, arguments, message):
    fitting = {"poses": np.zeros((3, 3)), "increments": np.zeros((2, 3))}
    with pytest.raises(InvalidPointsError, match=message):
        write_g2o(tmp_path / "out.g2o", **(fitting | arguments))
    assert list(tmp_path.iterdir()) == []
