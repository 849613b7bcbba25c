import gzip
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit.logs import interpolate_poses, read_log, read_tum, write_tum
from labkit.logs.trajectories import odd_steps, scanner_track
from labkit.scan import Scan
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
    lean = f"{math.sin(0.1)} 0 0 {math.cos(0.1)}"
    text = f"# one\n\n1 2 3 9 0 0 0 1\n  # two\n2 2 3 9 0 0 1 0\n3 2 3 9 {lean}\n"
    stamps, poses = read_tum(save(gzip.compress(text.encode())))
    assert stamps.tolist() == [1.0, 2.0, 3.0]
    assert poses.tolist() == [[2.0, 3.0, 0.0], [2.0, 3.0, math.pi], [2.0, 3.0, 0.0]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 2 3 0 0 0 1 1\n", "p:1: the quaternion has length 1.414, expected 1"),
        (f"# t\n1 2 3 0 0 {HALF} {HALF} 0\n", "p:2: a rotation out of the plane, qx = 0 and qy"),
        ("# nothing\n", "p: a trajectory without any pose"),
    ],
)
def test_what_is_no_planar_trajectory(save, text, message):
    with pytest.raises(LogError, match=message):
        read_tum(save(text, "p"))


@given(turn=st.floats(-3.1, 3.1), start=st.floats(-3.1, 3.1), share=st.floats(-0.05, 1.05))
def test_poses_turn_along_the_shorter_arc_and_a_little_outside_the_end_holds(turn, start, share):
    times, poses = [11.0, 10.0], [[1.0, 4.0, start + turn], [0.0, 2.0, start]]
    ((x, y, theta),) = interpolate_poses([10.0 + share], times, poses)
    share = min(max(share, 0.0), 1.0)
    assert (x, y) == pytest.approx((share, 2.0 + 2.0 * share), abs=1e-9)
    assert math.remainder(theta - start - share * turn, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < theta <= math.pi


instants = st.lists(st.integers(-60, 60), min_size=1, max_size=40)


@given(clock=instants, scans=instants)
def test_a_scan_has_a_pose_where_the_trajectory_is_not_silent(clock, scans):
    """The law: within 0.1 s of a pose, or between two at most 2 s apart, and nowhere else."""
    times, stamps = np.array(clock) / 8.0, np.array(scans) / 8.0 + 1.0 / 16.0
    told = []
    for t in stamps:
        gap = min(times[times > t], default=math.inf) - max(times[times < t], default=-math.inf)
        told.append(min(abs(times - t)) < 0.1 or gap <= 2.0)
    poses = np.column_stack([2.0 * times, 1.0 - times, 0.1 * times])
    if sum(told) < min(len(told), 2):
        with pytest.raises(InvalidPointsError, match="bring both to one clock, in seconds"):
            interpolate_poses(stamps, times, poses)
        return
    found = interpolate_poses(stamps, times, poses)
    assert np.isnan(found).all(axis=1).tolist() == np.logical_not(told).tolist()
    held = np.clip(stamps, min(times), max(times))[told]
    expected = np.column_stack([2.0 * held, 1.0 - held, 0.1 * held])
    np.testing.assert_allclose(found[told], expected, atol=1e-9)


@given(
    speed=st.floats(0.2, 2.0),
    rate=st.integers(5, 100),
    period=st.floats(0.1, 1.0),
    start=st.sampled_from([0.0, 1.7e9]),
    unit=st.sampled_from([1e-3, 1e3, 1e6, 1e9]),
)
def test_a_clock_in_another_unit_is_refused_or_most_scans_are_told_to_have_no_odometry(
    speed, rate, period, start, unit
):
    times = start + np.arange(0.0, 60.0, 1.0 / rate)
    stamps = np.arange(start, times[-1], period)
    scans = [Scan(points=[[4.0, 0.0]], stamp=stamp) for stamp in stamps]
    poses = np.column_stack([speed * (times - start), 0.0 * times, 0.0 * times])
    track, remarks = scanner_track(scans, "w", times, poses, [0.0, 0.0, 0.0])
    assert (np.isfinite(track).all(), remarks, odd_steps(track, scans)) == (True, [], [])
    assert odd_steps(1e3 * track, scans)
    assert odd_steps(1e3 * track, [Scan(points=[[4e3, 0.0]]), *scans[1:]])
    assert not odd_steps(track * math.nan, scans)
    try:
        track, (remark,) = scanner_track(scans, "w", unit * times, poses, [0.0, 0.0, 0.0])
    except LogError:
        return
    assert np.isnan(track[:, 0]).mean() > 0.8
    assert "scans have no odometry, the first at" in remark


STILL, AWAY = np.zeros((2, 3)), [[0.0, np.inf, 0.0]]


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (
            interpolate_poses,
            ([0, 1.2], [0, 1], STILL),
            "`times`, 0 to 1 s .*, got 0 to 1.2 s; bring",
        ),
        (interpolate_poses, ([0], [0], STILL), r"`times` .* shape \(2,\), got \(1,\); give"),
        (interpolate_poses, ([0], [0, np.inf], STILL), "`times` must be finite, got inf at ind"),
        (write_tum, ("out.tum", [1], STILL), r"`stamps` must have shape \(2,\), got \(1,\)"),
        (write_tum, ("out.tum", [1], AWAY), r"`poses` must be finite, got \[0.0, inf, 0.0\] at"),
    ],
)
def test_what_does_not_belong_together(tmp_path, monkeypatch, function, arguments, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidPointsError, match=message):
        function(*arguments)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("separator", [" ", ",", "; "])
def test_a_trajectory_may_stand_between_commas(save, separator):
    rows = [[k, 0.5 * k, 0, 0, 0, 0, 0, 1] for k in range(3)]
    text = "# a path\n" + "".join(separator.join(map(str, row)) + "\n" for row in rows)
    stamps, poses = read_tum(save(text))
    assert (stamps.tolist(), poses[:, 0].tolist()) == ([0.0, 1.0, 2.0], [0.0, 0.5, 1.0])


@pytest.mark.parametrize("back", [0.05, 3.0, 60.0])
def test_wheels_whose_clock_jumps_back_tell_nothing_of_what_comes_twice(save, back):
    """Rows from 0 to 10 s, and on from there with a clock that is set back."""
    times = np.concatenate([np.arange(0.0, 10.0, 0.1), np.arange(10.0 - back, 15.0 - back, 0.1)])
    poses = np.column_stack([0.2 * np.arange(len(times)), np.zeros((len(times), 2))])
    rows = "".join(f"{t},{','.join(9 * ['2.5'])}\n" for t in (1.0, 6.5, 7.5, 9.0, 11.0))
    table = save(f"stamp,{','.join(f'r{k}' for k in range(9))}\n{rows}")
    log = read_log(table, angles=(-1.0, 1.0), odometry=(times, poses))
    silent = np.isnan(log.odometry[:, 0]).tolist()
    if back == 3.0:
        assert silent == [False, False, True, True, False]
        assert log.remarks[0].startswith("the clock of the odometry jumps back: 7 to 9.9 s come tw")
    else:
        assert silent[:4] == 4 * [False]
        assert not any("jumps back" in remark for remark in log.remarks)
