import gzip
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit.logs import interpolate_poses, read_tum, write_tum
from labkit.support.errors import InvalidPointsError, LogError

HALF = math.sqrt(0.5)
coordinates = st.floats(-1e6, 1e6)


@given(
    rows=hnp.arrays(np.float64, st.tuples(st.integers(1, 10), st.just(3)), elements=coordinates),
    angles=st.lists(
        st.floats(-math.pi, math.pi, exclude_min=True) | st.sampled_from([math.pi, -1e-300]),
        min_size=10,
        max_size=10,
    ),
)
def test_a_trajectory_comes_back(scratch, rows, angles):
    poses = np.column_stack([rows[:, :2], angles[: len(rows)]])
    write_tum(scratch, rows[:, 2], poses)
    stamps, read = read_tum(scratch)
    assert (stamps == rows[:, 2]).all()
    assert (read[:, :2] == poses[:, :2]).all()
    turn = np.abs(read[:, 2] - poses[:, 2])
    assert (np.minimum(turn, 2.0 * np.pi - turn) < 1e-15).all()
    assert (np.abs(read[:, 2]) <= np.pi).all()


def test_evo_reads_it(tmp_path):
    file_interface = pytest.importorskip("evo.tools.file_interface")
    poses = np.array([[1.0, 2.0, 0.3], [2.0, 2.5, -3.1]])
    write_tum(tmp_path / "out.tum", [10.5, 11.25], poses)
    trajectory = file_interface.read_tum_trajectory_file(str(tmp_path / "out.tum"))
    assert trajectory.timestamps.tolist() == [10.5, 11.25]
    assert (trajectory.positions_xyz[:, :2] == poses[:, :2]).all()
    angles = [math.atan2(T[1, 0], T[0, 0]) for T in trajectory.poses_se3]
    np.testing.assert_allclose(angles, poses[:, 2], atol=1e-15)


def test_comments_and_gzip(save):
    text = "# one\n\n1 2 3 9 0 0 0 1\n  # two\n2 2 3 9 0 0 1 0\n"
    stamps, poses = read_tum(save(gzip.compress(text.encode())))
    assert stamps.tolist() == [1.0, 2.0]
    assert poses.tolist() == [[2.0, 3.0, 0.0], [2.0, 3.0, math.pi]]


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("1 2 3 0 0 0 1", "7 fields, expected 8 for `timestamp tx ty tz qx qy qz qw`"),
        ("nan 2 3 0 0 0 0 1", "timestamp is 'nan', expected a finite number"),
        ("1 1e10 3 0 0 0 0 1", "the position is (1e+10, 3), expected to lie within 1e+09 m"),
        ("1 2 3 0 0 0 1 1", "the quaternion has length 1.414, expected 1"),
        (f"1 2 3 0 0 {HALF} {HALF} 0", "a rotation out of the plane, qx = 0 and qy = 0.707107"),
    ],
)
def test_a_bad_line_is_named(save, line, reason):
    with pytest.raises(LogError) as raised:
        read_tum(save(f"# t\n1 2 3 0 0 0 0 1\n{line}\n", "path.tum"))
    assert f"path.tum:3: {reason}" in str(raised.value)


def test_a_file_without_poses(save):
    with pytest.raises(LogError, match=r"run\.log: a trajectory without any pose"):
        read_tum(save("# nothing\n"))
    with pytest.raises(LogError, match=r"gone\.tum: no such file"):
        read_tum("gone.tum")


@given(turn=st.floats(-3.1, 3.1), start=st.floats(-3.1, 3.1), share=st.floats(0.0, 1.0))
def test_poses_turn_along_the_shorter_arc(turn, start, share):
    times, poses = [11.0, 10.0], [[1.0, 4.0, start + turn], [0.0, 2.0, start]]
    ((x, y, theta),) = interpolate_poses([10.0 + share], times, poses)
    assert (x, y) == pytest.approx((share, 2.0 + 2.0 * share), abs=1e-9)
    assert math.remainder(theta - start - share * turn, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < theta <= math.pi


def test_stamps_a_little_outside_are_covered():
    assert len(interpolate_poses([-0.05, 1.05], [0.0, 1.0], STILL)) == 2


STILL, AWAY = np.zeros((2, 3)), [[0.0, np.inf, 0.0]]


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (interpolate_poses, ([0, 1.2], [0, 1], STILL), "`times`, from 0 to 1 s, got 1.2 s at"),
        (interpolate_poses, ([0], [0], STILL), r"`times` \(2,\), one per pose, got \(1,\) and \(1"),
        (interpolate_poses, ([0], [0, np.inf], STILL), "`times` must be finite, got inf at ind"),
        (write_tum, ("out.tum", [1], STILL), r"`stamps` must have shape \(2,\), one per pose, got"),
        (write_tum, ("out.tum", [1], AWAY), r"`poses` must be finite, got \[0.0, inf, 0.0\] at"),
    ],
)
def test_what_does_not_belong_together(tmp_path, monkeypatch, function, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidPointsError, match=message):
        function(*arguments)
    assert list(tmp_path.iterdir()) == []
