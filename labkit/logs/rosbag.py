"""ROS 1 and ROS 2 bags: ``sensor_msgs/LaserScan`` with ``nav_msgs/Odometry``, without ROS.

The package `rosbags` reads the bag; it is optional and imported only when a bag is read.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from labkit.arrays import FARTHEST, FloatArray
from labkit.errors import LogError
from labkit.extras import need
from labkit.logs.laser_lines import beam_angles
from labkit.logs.lines import DamagedLine, DamageReport, shorten
from labkit.logs.log import LogStream, ScanStream
from labkit.logs.no_return import Beams, RangeCounts, ScanSettings, declared_maximum, settle
from labkit.logs.poses import move_to_scanner
from labkit.logs.remarks import tell_places, tell_silence, tell_stamps
from labkit.scan import Scan
from labkit.se2 import wrap

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"

ROS1_MAGIC = b"#ROSBAG V"
ROS2_MAGICS = (b"SQLite format 3\0", b"\x89MCAP0\r\n")

UNIT = 1e-3
"""The length of a quaternion differs from 1 by no more than its digits."""

MOST_TILTED = 15.0
"""A robot that leans further [degrees] does not drive, or its odometry is damaged."""

LARGEST_METADATA = 1 << 23
"""Bytes of a metadata.yaml: reading more takes minutes."""

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
        return path.is_file() and _first_bytes(path).startswith((ROS1_MAGIC, *ROS2_MAGICS))
    except (OSError, ValueError):
        return False


def read_bag(
    path: Path,
    report: DamageReport,
    settings: ScanSettings,
    *,
    name: str,
    laser_offset: FloatArray,
    topic: str | None,
    odometry_topic: str | None,
) -> LogStream:
    """Read a bag; see `labkit.logs.read_log` for the parameters.

    The odometry is interpolated at the time of each scan: x and y linearly, θ along the
    shorter arc, between the two messages around it. A scan that lies more than 0.1 s
    outside the odometry has no pose, and is skipped.
    """
    counts = RangeCounts()
    kept: dict[int, Beams] = {}
    times: dict[int, float] = {}
    track: FloatArray | None = None
    with _open(path, report.file) as bag:
        topics = _topics(bag, LASER_SCAN)
        if not topics:
            raise LogError(f"{report.file}: a bag without any scan, expected {LASER_SCAN} messages")
        chosen = _choose(topics, topic, "topic", report.file)
        odometry_topics = _topics(bag, ODOMETRY)
        if odometry_topics or odometry_topic is not None:
            wheels = _choose(odometry_topics, odometry_topic, "odometry_topic", report.file)
        for number, beams in _sweeps(bag, chosen, report):
            counts.add(beams)
            times[number] = beams.stamp
            if settings.keep:
                kept[number] = beams
        if odometry_topics:
            track = _track(bag, wheels, report)
    numbers = [n for n, t in times.items() if track is None or _is_covered(n, t, track, report)]
    if not numbers:
        raise LogError(f"{report.file}: no usable scan in the bag{report.summary()}")
    stamps = np.array([times[number] for number in numbers])
    odometry = None
    if track is not None:
        odometry = move_to_scanner(_interpolate(track, stamps), laser_offset)
        tell_silence(report, track[:, 0], stamps)
        tell_places(report, odometry, np.array(numbers), "the robot's pose")
    tell_stamps(report, stamps, np.array(numbers))
    no_returns = settle(counts, settings, report, sick=False)

    def scans() -> Iterator[Scan]:
        if kept:
            yield from (no_returns.scan(kept[number]) for number in numbers)
            return
        wanted = set(numbers)
        with _open(path, report.file) as again:
            for number, beams in _sweeps(again, chosen, None):
                if number in wanted:
                    yield no_returns.scan(beams)

    return LogStream(
        scans=ScanStream(len(numbers), scans),
        stamps=stamps,
        odometry=odometry,
        name=name,
        format="ros",
        skipped=report.skipped,
        remarks=report.remarks,
    )


@contextmanager
def _open(path: Path, file: str) -> Iterator[OpenBag]:
    need("rosbags", purpose=f"{file}: reading a ROS bag", extra="ros")
    from rosbags import rosbag1, rosbag2  # noqa: PLC0415
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415

    metadata = path / "metadata.yaml"
    if metadata.is_file() and metadata.stat().st_size > LARGEST_METADATA:
        raise LogError(f"{file}: metadata.yaml has more than {LARGEST_METADATA:,} bytes")
    try:
        if _first_bytes(path).startswith(ROS1_MAGIC):
            opened: Any = rosbag1.Reader(path)
            decode: Any = get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
        else:
            opened = rosbag2.Reader(path)
            decode = get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr
        opened.open()
    except Exception as error:  # a damaged bag makes rosbags raise errors of many kinds
        reason = shorten(str(error)) or type(error).__name__
        raise LogError(f"{file}: the bag cannot be opened: {reason}") from error
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
    """The topics of one type; in a damaged bag, those whose name is a text."""
    topics = {c.topic for c in bag.reader.connections if c.msgtype == msgtype}
    return sorted(topic for topic in topics if isinstance(topic, str))


def _choose(topics: Sequence[str], wanted: str | None, parameter: str, file: str) -> str:
    """The topic that the caller wants, or the only one there is."""
    listed = shorten(", ".join(topics), 100)
    if wanted is None and len(topics) > 1:
        raise LogError(
            f"{file}: {len(topics)} topics of one type ({listed}); choose one by `{parameter}`"
        )
    if wanted is not None and wanted not in topics:
        raise LogError(f"{file}: `{parameter}` is {wanted!r}, the bag has {listed or None}")
    return topics[0] if wanted is None else wanted


def _messages(
    bag: OpenBag, topic: str, msgtype: str, report: DamageReport | None
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
            if report is not None:
                reason = str(error) or type(error).__name__
                report.skip(number, f"the bag breaks off at this {msgtype} message: {reason}")
            return
        yield number, stamp, message


def _sweeps(bag: OpenBag, topic: str, report: DamageReport | None) -> Iterator[tuple[int, Beams]]:
    """Number and sweep of each good scan message, counter-clockwise from `angle_min`."""
    for number, stamp, message in _messages(bag, topic, LASER_SCAN, report):
        start, step = float(message.angle_min), float(message.angle_increment)
        if not (math.isfinite(start) and math.isfinite(step)):
            if report is not None:
                report.skip(
                    number, f"a damaged {LASER_SCAN} message: beams from {start:g} by {step:g} rad"
                )
            continue
        with np.errstate(invalid="ignore", over="ignore"):  # what is not finite makes no point
            ranges = np.asarray(message.ranges, dtype=np.float64)
        beams = Beams(
            ranges=ranges,
            angles=beam_angles(start, step, len(ranges)),
            stamp=stamp,
            range_min=float(message.range_min),
            range_max=declared_maximum(float(message.range_max)),
        )
        yield number, beams


def _track(bag: OpenBag, topic: str, report: DamageReport) -> FloatArray:
    """The odometry messages as rows (t, x, y, θ) in the order of time, the usable ones only."""
    rows = array("d")
    for number, stamp, message in _messages(bag, topic, ODOMETRY, report):
        try:
            rows.extend((stamp, *_planar_pose(message.pose.pose)))
        except DamagedLine as damage:
            report.skip(number, f"a damaged {ODOMETRY} message: {damage}")
    if not rows:
        raise LogError(f"{report.file}: no usable {ODOMETRY} message on {topic}{report.summary()}")
    track = np.array(rows).reshape(-1, 4)
    ordered: FloatArray = track[np.argsort(track[:, 0], kind="stable")]
    return ordered


def _planar_pose(pose: Any) -> tuple[float, float, float]:
    """The pose (x, y, θ) of a robot that stands on the floor, or `DamagedLine`."""
    x, y, q = pose.position.x, pose.position.y, pose.orientation
    if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST):
        raise DamagedLine(f"its pose is not within {FARTHEST:g} m")
    norm = math.hypot(q.x, q.y, q.z, q.w)
    if not abs(norm - 1.0) <= UNIT:
        raise DamagedLine(f"its quaternion has length {norm:.4g}, expected 1")
    tilt = math.degrees(math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q.x * q.x + q.y * q.y)))))
    if tilt > MOST_TILTED:
        raise DamagedLine(f"it tilts the robot by {tilt:.3g}°, expected at most {MOST_TILTED:g}°")
    sine = 2.0 * (q.w * q.z + q.x * q.y)
    cosine = 1.0 - 2.0 * (q.y * q.y + q.z * q.z)
    return x, y, math.atan2(sine, cosine)


def _is_covered(number: int, stamp: float, track: FloatArray, report: DamageReport) -> bool:
    gap = max(track[0, 0] - stamp, stamp - track[-1, 0])
    if gap <= MAX_EXTRAPOLATION:
        return True
    report.skip(number, f"a scan {gap:.3f} s outside the odometry, expected at most 0.1 s")
    return False


def _interpolate(track: FloatArray, stamps: FloatArray) -> FloatArray:
    times, theta = track[:, 0], np.unwrap(track[:, 3])
    x, y = (np.interp(stamps, times, track[:, axis]) for axis in (1, 2))
    return np.column_stack([x, y, wrap(np.interp(stamps, times, theta))])
