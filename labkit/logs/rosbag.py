"""ROS 1 and ROS 2 bags: ``sensor_msgs/LaserScan`` with ``nav_msgs/Odometry``, without ROS.

The package `rosbags` reads the bag; it is optional and imported only when a bag is read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from labkit.logs.laser_lines import beam_angles
from labkit.logs.lines import DamagedLine, DamageReport, expect_near, shorten
from labkit.logs.sweeps import Sweep
from labkit.logs.trajectories import planar_heading, scanner_track
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError, LogError
from labkit.support.extras import need

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
BAGS = (".bag", ".db3", ".mcap")  # the first is of ROS 1

Bag = tuple[Any, Callable[[bytes, str], Any]]  # the reader, and the decoder of its messages


def is_bag(path: Path) -> bool:
    """Recognise a bag by its suffix, a directory of ROS 2 by its metadata."""
    return path.suffix in BAGS or os.path.isfile(path / "metadata.yaml")


def read_bag(
    path: Path,
    report: DamageReport,
    *,
    laser_offset: FloatArray,
    topic: str | None,
    odometry_topic: str | None,
) -> tuple[list[Sweep], FloatArray | None]:
    """Read the sweeps of a bag, and the scanner's odometry (K, 3) at their times."""
    bag = _open(path, report.file)
    with closing(bag[0]):
        chosen = _choose(bag, LASER_SCAN, topic, "topic", report.file)
        if chosen is None:
            raise LogError(f"{report.file}: a bag without any scan, expected {LASER_SCAN} messages")
        wheel = _choose(bag, ODOMETRY, odometry_topic, "odometry_topic", report.file)
        sweeps = list(_sweeps(bag, chosen, report))
        if wheel is None or not sweeps:
            return sweeps, None
        track = _track(bag, wheel, report)
    scans = [sweep.scan for sweep in sweeps]
    odometry, gaps = scanner_track(scans, report.file, track[:, 0], track[:, 1:], laser_offset)
    report.remarks.extend(gaps)
    return sweeps, odometry


def _open(path: Path, file: str) -> Bag:
    need("rosbags", purpose=f"{file}: reading a ROS bag", extra="ros")
    from rosbags import rosbag1, rosbag2  # noqa: PLC0415
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415

    is_ros1 = path.suffix == BAGS[0]
    store = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    try:
        opened = (rosbag1 if is_ros1 else rosbag2).Reader(path)
        opened.open()
    except Exception as error:  # a damaged bag makes rosbags raise errors of many kinds
        reason = shorten(str(error)) or type(error).__name__
        raise LogError(f"{file}: the bag cannot be opened: {reason}") from error
    return opened, store.deserialize_ros1 if is_ros1 else store.deserialize_cdr


def _choose(bag: Bag, msgtype: str, wanted: str | None, parameter: str, file: str) -> str | None:
    """The topic of a type that the caller wants, or the only one, or None."""
    topics = sorted({each.topic for each in bag[0].connections if each.msgtype == msgtype})
    listed = shorten(", ".join(topics), 100)
    if wanted is None and len(topics) > 1:
        raise LogError(
            f"{file}: {len(topics)} topics of one type ({listed}); choose one by `{parameter}`"
        )
    if wanted is not None and wanted not in topics:
        raise LogError(f"{file}: `{parameter}` is {wanted!r}, the bag has {listed or None}")
    return wanted or next(iter(topics), None)


def _messages(
    bag: Bag, topic: str, msgtype: str, report: DamageReport
) -> Iterator[tuple[int, float, Any]]:
    """Number, time of the header [s] (of the bag, if that is 0) and message of a topic."""
    reader, decode = bag
    connections = [c for c in reader.connections if (c.topic, c.msgtype) == (topic, msgtype)]
    stream = reader.messages(connections=connections)
    for number in count(1):
        try:
            _, nanoseconds, raw = next(stream)
            message = decode(raw, msgtype)
            header = message.header.stamp
            stamp = header.sec + 1e-9 * header.nanosec or 1e-9 * nanoseconds
        except StopIteration:
            return
        except Exception as error:  # rosbags again: the stream cannot go on behind it
            report.skip(number, f"the bag breaks off at this {msgtype} message: {error!r}")
            return
        yield number, stamp, message


def _sweeps(bag: Bag, topic: str, report: DamageReport) -> Iterator[Sweep]:
    """Yield the good scan messages, counter-clockwise from `angle_min`."""
    for number, stamp, message in _messages(bag, topic, LASER_SCAN, report):
        start, step = float(message.angle_min), float(message.angle_increment)
        band = {"range_min": float(message.range_min), "range_max": float(message.range_max)}
        try:
            with np.errstate(invalid="ignore", over="ignore"):  # what is not finite makes no point
                angles = beam_angles(start, step, len(message.ranges))
                scan = Scan.from_ranges(message.ranges, angles, stamp=stamp, **band)
        except LabkitError as damage:
            report.skip(number, f"a damaged {LASER_SCAN} message: {damage}")
        else:
            yield Sweep(number, scan)


def _track(bag: Bag, topic: str, report: DamageReport) -> FloatArray:
    """The usable odometry messages as rows (t, x, y, θ) in the order of time."""
    rows = []
    for number, stamp, message in _messages(bag, topic, ODOMETRY, report):
        try:
            place, q = message.pose.pose.position, message.pose.pose.orientation
            expect_near(place.x, place.y, "the pose")
            rows.append((stamp, place.x, place.y, planar_heading(q.x, q.y, q.z, q.w)))
        except DamagedLine as damage:
            report.skip(number, f"a damaged {ODOMETRY} message: {damage}")
    if not rows:
        raise LogError(f"{report.file}: no usable {ODOMETRY} message on {topic}{report.summary()}")
    return np.array(sorted(rows, key=lambda row: row[0]))
