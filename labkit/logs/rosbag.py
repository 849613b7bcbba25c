"""ROS 1 and ROS 2 bags: ``sensor_msgs/LaserScan`` with ``nav_msgs/Odometry``, without ROS.

The package `rosbags` reads the bag; it is optional and imported only when a bag is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from labkit.arrays import FARTHEST, FloatArray
from labkit.errors import LabkitError, LogError
from labkit.logs.lines import DamageReport
from labkit.logs.log import Log
from labkit.logs.poses import move_to_scanner
from labkit.scan import Scan
from labkit.se2 import wrap

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"

ROS1_MAGIC = b"#ROSBAG V"
ROS2_MAGICS = (b"SQLite format 3\0", b"\x89MCAP0\r\n")

MAX_EXTRAPOLATION = 0.1
"""How long the odometry is held before its first and after its last message [s]."""


@dataclass(frozen=True, kw_only=True)
class OpenBag:
    """An open bag of either kind: its reader, and how its messages are decoded."""

    reader: Any
    decode: Callable[[bytes, str], Any]


def is_bag(path: Path) -> bool:
    """Whether a file begins like a bag, or a directory holds a ROS 2 bag's metadata."""
    try:
        if path.is_dir():
            return (path / "metadata.yaml").is_file()
        return _first_bytes(path).startswith((ROS1_MAGIC, *ROS2_MAGICS))
    except (OSError, ValueError):
        return False


def read_bag(
    path: Path,
    report: DamageReport,
    *,
    name: str,
    range_max: float | None,
    laser_offset: FloatArray,
    topic: str | None,
    odometry_topic: str | None,
) -> Log:
    """Read a bag; see `labkit.logs.read_log` for the parameters.

    The odometry is interpolated at the time of each scan: x and y linearly, θ along the
    shorter arc, between the two messages around it. A scan that lies more than 0.1 s
    outside the odometry has no pose, and is skipped.
    """
    with _open(path, report.file) as bag:
        topics = _topics(bag, LASER_SCAN)
        if not topics:
            raise LogError(f"{report.file}: a bag without any scan, expected {LASER_SCAN} messages")
        chosen = _choose(topics, topic, "topic", report.file)
        scans = [
            (number, scan)
            for number, stamp, message in _messages(bag, chosen, LASER_SCAN, report)
            if (scan := _scan(number, stamp, message, range_max, report)) is not None
        ]
        odometry = None
        odometry_topics = _topics(bag, ODOMETRY)
        if odometry_topics or odometry_topic is not None:
            chosen = _choose(odometry_topics, odometry_topic, "odometry_topic", report.file)
            track = _track(bag, chosen, report)
            scans = [scan for scan in scans if _is_covered(*scan, track[:, 0], report)]
            stamps = np.array([scan.stamp for _, scan in scans])
            odometry = move_to_scanner(_interpolate(track, stamps), laser_offset)
    if not scans:
        raise LogError(f"{report.file}: no usable scan in the bag{report.summary()}")
    return Log(
        scans=tuple(scan for _, scan in scans),
        odometry=odometry,
        name=name,
        format="ros",
        skipped=report.skipped,
    )


@contextmanager
def _open(path: Path, file: str) -> Iterator[OpenBag]:
    try:
        from rosbags import rosbag1, rosbag2  # noqa: PLC0415
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415
    except ImportError:
        raise LogError(
            f'{file}: reading a ROS bag needs the package rosbags: pip install "labkit[ros]"'
        ) from None
    try:
        if _first_bytes(path).startswith(ROS1_MAGIC):
            opened: Any = rosbag1.Reader(path)
            decode: Any = get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
        else:
            opened = rosbag2.Reader(path)
            decode = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr
        opened.open()
    except Exception as error:  # a damaged bag makes rosbags raise errors of many kinds
        raise LogError(f"{file}: the bag cannot be opened: {error}") from error
    try:
        yield OpenBag(reader=opened, decode=decode)
    finally:
        opened.close()


def _first_bytes(path: Path) -> bytes:
    if path.is_dir():
        return b""
    with path.open("rb") as file:
        return file.read(16)


def _topics(bag: OpenBag, msgtype: str) -> list[str]:
    return sorted({c.topic for c in bag.reader.connections if c.msgtype == msgtype})


def _choose(topics: Sequence[str], wanted: str | None, parameter: str, file: str) -> str:
    """The topic that the caller wants, or the only one there is."""
    listed = ", ".join(topics)
    if wanted is None and len(topics) > 1:
        raise LogError(
            f"{file}: {len(topics)} topics of one type ({listed}); choose one by `{parameter}`"
        )
    if wanted is not None and wanted not in topics:
        raise LogError(f"{file}: `{parameter}` is {wanted!r}, the bag has {listed or None}")
    return topics[0] if wanted is None else wanted


def _messages(
    bag: OpenBag, topic: str, msgtype: str, report: DamageReport
) -> Iterator[tuple[int, float, Any]]:
    """Number, time of the header [s] (of the bag, where that is 0) and message of a topic."""
    connections = [c for c in bag.reader.connections if (c.topic, c.msgtype) == (topic, msgtype)]
    stream = bag.reader.messages(connections=connections)
    number = 0
    while True:
        number += 1
        try:
            _, nanoseconds, raw = next(stream)
            message = bag.decode(raw, msgtype)
            header = message.header.stamp
            stamp = header.sec + 1e-9 * header.nanosec or 1e-9 * nanoseconds
        except StopIteration:
            return
        except Exception as error:  # rosbags again: the stream cannot go on behind it
            report.skip(number, f"the bag breaks off at this {msgtype} message: {error}")
            return
        yield number, stamp, message


def _scan(
    number: int, stamp: float, message: Any, range_max: float | None, report: DamageReport
) -> Scan | None:
    """The scan of one message, counter-clockwise from `angle_min`; None for a damaged one."""
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is judged below
        ranges = np.asarray(message.ranges, dtype=np.float64)
        angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    try:
        return Scan.from_ranges(
            ranges,
            angles,
            stamp=stamp,
            range_min=message.range_min,
            range_max=message.range_max if range_max is None else range_max,
        )
    except LabkitError as error:
        report.skip(number, f"a damaged {LASER_SCAN} message: {error}")
        return None


def _track(bag: OpenBag, topic: str, report: DamageReport) -> FloatArray:
    """The odometry messages as rows (t, x, y, θ) in the order of time, the usable ones only."""
    rows = []
    for number, stamp, message in _messages(bag, topic, ODOMETRY, report):
        position, q = message.pose.pose.position, message.pose.pose.orientation
        sine = 2.0 * (q.w * q.z + q.x * q.y)
        cosine = 1.0 - 2.0 * (q.y * q.y + q.z * q.z)
        row = (stamp, position.x, position.y, math.atan2(sine, cosine))
        if all(abs(number) <= FARTHEST for number in row[1:]):
            rows.append(row)
        else:
            report.skip(
                number, f"a damaged {ODOMETRY} message: its pose is not within {FARTHEST:g} m"
            )
    if not rows:
        raise LogError(f"{report.file}: no usable {ODOMETRY} message on {topic}{report.summary()}")
    track = np.array(rows)
    ordered: FloatArray = track[np.argsort(track[:, 0], kind="stable")]
    return ordered


def _is_covered(number: int, scan: Scan, times: FloatArray, report: DamageReport) -> bool:
    gap = max(times[0] - scan.stamp, scan.stamp - times[-1])
    if gap <= MAX_EXTRAPOLATION:
        return True
    report.skip(number, f"a scan {gap:.3f} s outside the odometry, expected at most 0.1 s")
    return False


def _interpolate(track: FloatArray, stamps: FloatArray) -> FloatArray:
    times, theta = track[:, 0], np.unwrap(track[:, 3])
    x, y = (np.interp(stamps, times, track[:, axis]) for axis in (1, 2))
    return np.column_stack([x, y, wrap(np.interp(stamps, times, theta))])
