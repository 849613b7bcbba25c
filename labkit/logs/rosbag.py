"""ROS 1 and ROS 2 bags: ``sensor_msgs/LaserScan`` with ``nav_msgs/Odometry``, without ROS.

Of a ``MultiEchoLaserScan`` the first echo of each beam counts. The fixed transforms of
``/tf_static`` tell where the scanner sits on the robot. The package `rosbags` reads the bag; it is
optional and imported only when a bag is read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from labkit.logs.lines import DamagedLine, DamageReport, expect_near, shorten
from labkit.logs.mounting import MAX_LEAN, Mounting, Transform, find_mounting, read_transforms
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.logs.scanner import Scanner
from labkit.logs.trajectories import planar_heading
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError, LogError
from labkit.support.extras import need

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO = "sensor_msgs/msg/MultiEchoLaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TRANSFORM_FIELDS = "geometry_msgs/TransformStamped[] transforms"
FIXED = "tf_static"  # the topic of transforms that never change
FIRST_BYTES = {  # of a bag, and the suffix that rosbags wants to see
    b"#ROSBAG": ".bag",
    b"SQLite format 3": ".db3",
    b"\x89MCAP": ".mcap",
}

DIRECTORY = "directory"

Topic = tuple[str, str]  # its name and the type of its messages
Bag = tuple[Any, Callable[[bytes, str], Any]]  # the reader, and the decoder of its messages


def bag_kind(source: Source) -> str:
    """Usual suffix of a bag by its first bytes, a directory of ROS 2 by its metadata, or none."""
    path, head = source.path, source.first_bytes
    if not head and os.path.isfile(path / "metadata.yaml"):
        return DIRECTORY
    named = path.suffix if path.suffix in FIRST_BYTES.values() else ""  # if its head is lost
    if head.startswith(b"version https:"):  # of Git LFS: the reader of lines says so
        named = ""
    return next((kind for first, kind in FIRST_BYTES.items() if head.startswith(first)), named)


def read(source: Source) -> Reading:
    """Read the sweeps of a bag, the robot's odometry, and the scanner's place on the robot."""
    report, options = source.report, source.options
    bag = _open(source.path, bag_kind(source), report.file)
    with closing(bag[0]):
        scans = _choose(bag, (LASER_SCAN, MULTI_ECHO), options.topic, "topic", report.file)
        if scans is None:
            raise LogError(f"{report.file}: a bag without any scan, expected {LASER_SCAN} messages")
        wheel = _choose(bag, (ODOMETRY,), options.odometry_topic, "odometry_topic", report.file)
        mounting = _mounting(bag, scans, wheel, report)
        scanner = source.scanner
        if mounting is not None and scanner.mirrored is None:
            scanner = replace(scanner, mirrored=mounting.is_upside_down)
        sweeps = source.part(source.progress(_sweeps(bag, scans, report, scanner)))
        track = None if wheel is None or not sweeps else _track(bag, wheel, report)
    offset = None if mounting is None else mounting.offset
    return Reading(sweeps=sweeps, track=track, offset=offset, clock_is_named=True)


def _mounting(bag: Bag, scans: Topic, wheel: Topic | None, report: DamageReport) -> Mounting | None:
    """The scanner's place by the fixed transforms of the bag, with a remark on it."""
    transforms = dict[str, Transform]()
    for connection in bag[0].connections:
        if connection.msgtype == TRANSFORMS and connection.topic.endswith(FIXED):
            topic = connection.topic, connection.msgtype
            for number, _, message in _messages(bag, topic, report):
                try:
                    transforms.update(read_transforms(message))
                except DamagedLine as damage:
                    report.skip(number, f"a damaged {TRANSFORMS} message: {damage}")
    if not transforms:
        return None
    scan = next((message for _, _, message in _messages(bag, scans, report)), None)
    pose = wheel and next((message for _, _, message in _messages(bag, wheel, report)), None)
    laser = "" if scan is None else scan.header.frame_id
    robot = "" if pose is None else pose.child_frame_id
    mounting = find_mounting(laser, robot, transforms)
    if mounting is None or not mounting.is_told:
        return mounting
    hangs = ", upside down" if mounting.is_upside_down else ""
    place = ", ".join(f"{value:.4g}" for value in mounting.offset)
    told = f"/{FIXED} tells that the scanner sits at ({place}) (m, m, rad){hangs} on the frame "
    told += f"{mounting.robot!r}"
    if mounting.lean > MAX_LEAN:
        report.remarks.append(
            f"{told} and leans by {np.degrees(mounting.lean):.0f} degrees: its place is left aside"
        )
        return None
    report.remarks.append(
        f"{told}; `laser_offset` and `mirrored` (`--laser-offset`, `--mirrored`, `--no-mirrored`) "
        f"go before it"
    )
    return mounting


def _open(path: Path, kind: str, file: str) -> Bag:
    need("rosbags", purpose=f"{file}: reading a ROS bag", extra="ros")
    from rosbags import rosbag1, rosbag2  # noqa: PLC0415
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: PLC0415

    is_ros1 = kind == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    if TRANSFORMS not in store.types:
        store.register(get_types_from_msg(TRANSFORM_FIELDS, TRANSFORMS))
    reader: Any = rosbag1.Reader if is_ros1 else rosbag2.Reader
    try:
        if kind not in {".bag", DIRECTORY}:  # rosbags goes by the suffix
            storages = {path.suffix: reader.STORAGE_PLUGINS[kind]}
            reader = type("Reader", (reader,), {"STORAGE_PLUGINS": storages})
        opened = reader(path)
        opened.open()
    except Exception as error:  # a damaged bag makes rosbags raise errors of many kinds
        reason = shorten(str(error)) or type(error).__name__
        raise LogError(f"{file}: the bag cannot be opened: {reason}") from error
    return opened, store.deserialize_ros1 if is_ros1 else store.deserialize_cdr


def _choose(
    bag: Bag, msgtypes: Sequence[str], wanted: str | None, parameter: str, file: str
) -> Topic | None:
    """The topic of some types that the caller wants, or the only one, or None."""
    found = {each.topic: each.msgtype for each in bag[0].connections if each.msgtype in msgtypes}
    topics = sorted(found)
    listed = shorten(", ".join(topics), 100)
    if wanted is None and len(topics) > 1:
        raise LogError(
            f"{file}: {len(topics)} topics of one type ({listed}); choose one by `{parameter}` "
            f"(`--{parameter.replace('_', '-')}`)"
        )
    if wanted is not None and wanted not in topics:
        raise LogError(f"{file}: `{parameter}` is {wanted!r}, the bag has {listed or None}")
    name = wanted or next(iter(topics), None)
    return None if name is None else (name, found[name])


def _messages(bag: Bag, topic: Topic, report: DamageReport) -> Iterator[tuple[int, float, Any]]:
    """Number, time of the header [s] (of the bag, if that is 0) and message of a topic."""
    reader, decode = bag
    msgtype = topic[1]
    connections = [c for c in reader.connections if (c.topic, c.msgtype) == topic]
    stream = reader.messages(connections=connections)
    for number in count(1):
        try:
            _, nanoseconds, raw = next(stream)
            message = decode(raw, msgtype)
            stamp = 1e-9 * nanoseconds
            if msgtype != TRANSFORMS:
                header = message.header.stamp
                stamp = header.sec + 1e-9 * header.nanosec or stamp
        except StopIteration:
            return
        except Exception as error:  # rosbags again: the stream cannot go on behind it
            report.skip(number, f"the bag breaks off at this {msgtype} message: {error!r}")
            return
        yield number, stamp, message


def _sweeps(bag: Bag, topic: Topic, report: DamageReport, scanner: Scanner) -> Iterator[Sweep]:
    """Yield the good scan messages, counter-clockwise from `angle_min`."""
    for number, stamp, message in _messages(bag, topic, report):
        start, step = float(message.angle_min), float(message.angle_increment)
        band = float(message.range_min), float(message.range_max)
        ranges = message.ranges
        if topic[1] == MULTI_ECHO:
            ranges = [beam.echoes[0] if len(beam.echoes) else np.nan for beam in ranges]
        try:
            with np.errstate(invalid="ignore", over="ignore"):  # what is not finite makes no point
                last = float(message.angle_max)
                angles = scanner.beams(len(ranges), start, step, report, last)
                beam_time = float(message.time_increment)
                scan = scanner.scan(
                    ranges, angles, report, stamp=stamp, band=band, time_increment=beam_time
                )
        except LabkitError as damage:
            report.skip(number, f"a damaged {topic[1]} message: {damage}")
        else:
            yield Sweep(number, scan)


def _track(bag: Bag, topic: Topic, report: DamageReport) -> FloatArray:
    """The usable odometry messages as rows (t, x, y, θ)."""
    rows = []
    for number, stamp, message in _messages(bag, topic, report):
        try:
            place = message.pose.pose.position
            q = message.pose.pose.orientation
            expect_near(place.x, place.y, "the pose")
            rows.append((stamp, place.x, place.y, planar_heading(q.x, q.y, q.z, q.w)))
        except DamagedLine as damage:
            report.skip(number, f"a damaged {ODOMETRY} message: {damage}")
    if not rows:
        raise LogError(
            f"{report.file}: no usable {ODOMETRY} message on {topic[0]}{report.summary()}"
        )
    return np.array(rows)


def _is_bag(source: Source) -> bool:
    return bool(bag_kind(source))


READER = Reader(
    name="ros",
    files="ROS 1 and ROS 2 bags",
    recognises=_is_bag,
    uses=("angles", "no_return", "laser_offset", "time_increment", "topic", "odometry_topic"),
    read=read,
)
