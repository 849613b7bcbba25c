"""Wheels are read by the readers that read scans: one track in many spellings."""

import math

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.support.errors import LogError

STAMPS = 100.0 + 0.1 * np.arange(8)
POSES = np.column_stack([0.1 * np.arange(8), 0.05 * np.arange(8), 0.3 * np.arange(8)])
ANGLES = np.linspace(-1.0, 1.0, 12)


@pytest.fixture
def scans(save):
    """A table of eight scans with stamps."""
    titles = ",".join(["stamp", *(f"r{k}" for k in range(12))])
    body = "".join(f"{t:.1f},{','.join(['2.0'] * 12)}\n" for t in STAMPS)
    return save(f"{titles}\n{body}", "scans.csv")


def table(titles, row, digits=6):
    """A table of the poses; a row is made of t, x, y, θ, and the quaternion's z and w."""
    lines = [titles] if titles else []
    for t, (x, y, a) in zip(STAMPS, POSES, strict=True):
        values = {"t": t, "x": x, "y": y, "a": a, "z": math.sin(a / 2), "w": math.cos(a / 2)}
        values = {name: f"{value:.{digits}f}" for name, value in values.items()}
        whole = {"ns": f"{round(t * 1e9)}", "d": f"{math.degrees(a):.5f}"}
        whole |= {"sec": str(int(t)), "part": f"{round((t - int(t)) * 1e9)}"}
        whole |= {"mm": f"{1e3 * x:.3f}", "my": f"{1e3 * y:.3f}"}
        lines.append(row.format(**values, **whole))
    return "\n".join(lines) + "\n"


P, Q = "field.pose.pose.position", "field.pose.pose.orientation"
SPELLINGS = {
    "TUM": ("", "{t} {x} {y} 0 0 0 {z} {w}"),
    "titles": ("stamp,x,y,theta", "{t},{x},{y},{a}"),
    "other titles": ("yaw_deg;Y;X;time", "{d};{y};{x};{t}"),
    "units": ("time [ns],x_mm,y_mm,heading", "{ns},{mm},{my},{a}"),
    "rostopic echo -p": (
        f"%time,field.header.stamp,{P}.x,{P}.y,{P}.z,{Q}.x,{Q}.y,{Q}.z,{Q}.w,"
        f"field.twist.twist.linear.x",
        "{ns},{ns},{x},{y},0,0,0,{z},{w},0.7",
    ),
    "ros2 topic echo --csv": (
        "",
        "{sec},{part},odom,base_link,{x},{y},0.0,0.0,0.0,{z},{w}" + 36 * ",0.0",
    ),
    "no titles": ("", "{t},{x},{y},{a}"),
    "CARMEN": ("", "ODOM {x} {y} {a} 0 0 0 {t} robot 1.0"),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_one_track_in_many_spellings(save, scans, spelling):
    wheels = save(table(*SPELLINGS[spelling]), "wheels")
    log = read_log(scans, angles=(-1.0, 1.0), odometry=wheels)
    np.testing.assert_allclose(log.odometry, POSES, atol=1e-5)
    assert log.remarks[:-1] == ()  # the last is on the scans


@pytest.mark.parametrize("spelling", ["TUM", "rostopic echo -p"])
def test_two_decimals_are_enough(save, scans, spelling):
    wheels = save(table(*SPELLINGS[spelling], digits=2), "wheels")
    log = read_log(scans, angles=(-1.0, 1.0), odometry=wheels)
    np.testing.assert_allclose(log.odometry, POSES, atol=0.02)


@pytest.mark.parametrize("part", [{}, {"start": 2}, {"start": 1, "scans": 4}])
def test_poses_without_a_clock_go_one_a_scan(save, scans, part):
    wheels = save(table("x,y,theta", "{x},{y},{a}"), "wheels")
    log = read_log(scans, angles=(-1.0, 1.0), odometry=wheels, **part)
    start = part.get("start", 0)
    np.testing.assert_allclose(log.odometry, POSES[start : start + len(log)], atol=1e-5)


def test_the_bag_that_holds_the_wheels_alone(tmp_path, scans):
    pytest.importorskip("rosbags")
    from tests.logs.test_rosbag import Bag  # noqa: PLC0415 (needs rosbags)

    bag = Bag(tmp_path / "wheels.bag", 1)
    for t, pose in zip(STAMPS, POSES, strict=True):
        bag.odometry(t, *pose)

    log = read_log(scans, angles=(-1.0, 1.0), odometry=bag.close())

    np.testing.assert_allclose(log.odometry, POSES, atol=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (table("x,y,theta", "{x},{y},{a}")[:50], "wheels:3: 2 fields, expected 3"),
        ("x,y,theta\n1,2,3\n", "1 poses without a clock for 8 scans; give both"),
        ("stamp,x,y\n100,0,0\n", "the columns are stamp, x, y; poses need `x`, `y` and `theta`"),
        ("1.5,2,3,4,5\n", r"5 columns without titles; poses have 8 \(`stamp,x,y,z,qx"),
        ("stamp,x,y,theta\n100,0,0,0\n100.1,0,mud,0\n", "wheels:3: y is 'mud', expected a fin"),
    ],
)
def test_what_is_no_track_is_refused_with_the_way_out(save, scans, text, message):
    with pytest.raises(LogError, match=message):
        read_log(scans, angles=(-1.0, 1.0), odometry=save(text, "wheels"))
