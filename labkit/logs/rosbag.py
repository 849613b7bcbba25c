"""ROS 1 and ROS 2 bags: ``sensor_msgs/LaserScan`` with ``nav_msgs/Odometry``, without ROS.

Of a ``MultiEchoLaserScan`` the first echo of each beam counts. The transforms of the bag tell
where the scanner sits on the robot and, where no odometry topic does, how the robot moved. The
package `rosbags` reads the bag; it is optional and imported only when a bag is read.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from labkit.logs.columns import DECLARED
from labkit.logs.lines import (
    MAX_LEAN,
    DamagedLine,
    DamageReport,
    expect_near,
    planar_heading,
    shorten,
)
from labkit.logs.log import Content
from labkit.logs.mounting import (
    Mounting,
    Transforms,
    find_motion,
    find_mounting,
    read_transforms,
)
from labkit.logs.reader import Reader, Reading, Source, Sweep
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError, LogError
from labkit.support.extras import need

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO = "sensor_msgs/msg/MultiEchoLaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
SCANS = (LASER_SCAN, MULTI_ECHO)
OTHER_MOTIONS = (  # types that tell a motion, and are not read
    "sensor_msgs/msg/Imu",
    *(f"geometry_msgs/msg/{name}" for name in ("PoseStamped", "PoseWithCovarianceStamped")),
)
TRANSFORM_FIELDS = "geometry_msgs/TransformStamped[] transforms"
MESSAGES_OF_A_START = 50  # a clock that stands at 0 for so many messages is none
FIRST_BYTES = {  # of a bag, and the suffix that rosbags wants to see
    b"#ROSBAG": ".bag",
    b"SQLite format 3": ".db3",
    b"\x89MCAP": ".mcap",
}
DIRECTORY = "directory"


class Topic(NamedTuple):
    """A topic and the type of its messages."""

    name: str
    msgtype: str


class Bag(NamedTuple):
    """An open bag: the reader, and the decoder of its messages."""

    reader: Any
    decode: Callable[[bytes, str], Any]

    def counts(self) -> dict[Topic, int]:
        """Number of messages of each topic."""
        counts = dict[Topic, int]()
        for connection in self.reader.connections:
            topic = Topic(connection.topic, connection.msgtype)
            counts[topic] = counts.get(topic, 0) + connection.msgcount
        return dict(sorted(counts.items()))

    def topics(self, msgtypes: Sequence[str]) -> list[Topic]:
        """Topics of some types, by name."""
        return [topic for topic in self.counts() if topic.msgtype in msgtypes]


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
    with closing(bag.reader):
        scans = _choose(bag, SCANS, options.topic, "topic", report.file)
        if scans is None:
            raise LogError(
                f"{report.file}: a bag without any scan, expected {LASER_SCAN} messages; "
                f"{_list_topics(bag)}"
            )
        odometry = _choose(bag, (ODOMETRY,), options.odometry_topic, "odometry_topic", report.file)
        transforms = Transforms()
        for topic in bag.topics(TRANSFORMS):
            _read_transforms(bag, topic, report, transforms)
        sweeps, mounting, track = _read_scans(bag, scans, odometry, transforms, source)
        contents = [
            Content(topic.name, f"{topic.msgtype}, {number} messages", _use(topic, scans, odometry))
            for topic, number in bag.counts().items()
        ]
        frame = sweeps[0].frame if sweeps else ""
        contents.append(Content(frame or "-", "frame of the scanner", "scans"))
    return Reading(
        sweeps=sweeps,
        track=track,
        offset=None if mounting is None else mounting.offset,
        clock_is_named=True,
        contents=contents,
    )


def read_wheels(source: Source) -> FloatArray:
    """Wheels by the bag's topic of odometry, or by the transforms that move on ``odom``."""
    report = source.report
    bag = _open(source.path, bag_kind(source), report.file)
    wanted = source.options.odometry_topic
    with closing(bag.reader):
        topic = _choose(bag, (ODOMETRY,), wanted, "odometry_topic", report.file)
        if topic is not None:
            return _track(bag, topic, report)
        transforms = Transforms()
        for each in bag.topics(TRANSFORMS):
            _read_transforms(bag, each, report, transforms)
        on_odometry = [
            name for name in transforms.moving if "odom" in transforms.first[name].parent
        ]
        motion = find_motion(on_odometry[0], transforms) if len(on_odometry) == 1 else None
        if motion is None:
            raise LogError(f"{report.file}: a bag without wheels; {_list_topics(bag)}")
        return motion.track


def _list_topics(bag: Bag) -> str:
    """A clause on the topics of a bag."""
    held = (f"{each.name} ({each.msgtype}, {count})" for each, count in bag.counts().items())
    return f"it holds {', '.join(held) or 'nothing'}"


def _read_scans(
    bag: Bag, scans: Topic, odometry: Topic | None, transforms: Transforms, source: Source
) -> tuple[list[Sweep], Mounting | None, FloatArray | None]:
    """Sweeps, the scanner's place, and the robot's track by odometry or transforms."""
    report = source.report
    laser = source.options.frame or _first(bag, scans, report, "header.frame_id")
    track = None
    if odometry is not None:
        robot = _first(bag, odometry, report, "child_frame_id")
        track = _track(bag, odometry, report)
    else:
        motion = find_motion(laser, transforms)
        robot = "" if motion is None else motion.child
        if motion is not None:
            track = motion.track
            report.remarks.append(
                f"no topic of {ODOMETRY}: the transforms from {motion.parent!r} to "
                f"{motion.child!r} count as wheel odometry"
            )
    mounting = find_mounting(laser, robot, transforms.fixed)
    mounting = _told_mounting(mounting, transforms, report)
    if mounting is not None and source.options.mirrored is None:
        source.scanner.mirrored = mounting.is_upside_down
    sweeps = source.sweeps(source.progress(_sweeps(bag, scans, source)))
    return sweeps, mounting, track if sweeps else None


def _use(topic: Topic, scans: Topic, odometry: Topic | None) -> str:
    """Use of a topic; nothing where it might tell a motion that no wheels tell."""
    if topic == scans:
        return "scans"
    if topic == odometry:
        return "wheels"
    if topic.msgtype in TRANSFORMS:
        return "transforms"
    is_missed = odometry is None and topic.msgtype in OTHER_MOTIONS
    return "" if is_missed else "left aside"


def _first(bag: Bag, topic: Topic, report: DamageReport, field: str) -> str:
    """A field of the first message of a topic."""
    message = next((message for _, _, message in _messages(bag, topic, report)), None)
    for name in field.split("."):
        message = getattr(message, name, "")
    return str(message)


def _read_transforms(bag: Bag, topic: Topic, report: DamageReport, transforms: Transforms) -> None:
    for number, _, message in _decode_messages(bag, topic, report):
        try:
            for transform in read_transforms(message):
                transforms.add(transform)
        except DamagedLine as damage:
            report.skip(number, f"a damaged {topic.msgtype} message: {damage}")


def _told_mounting(
    mounting: Mounting | None, transforms: Transforms, report: DamageReport
) -> Mounting | None:
    """The mounting, with a remark on it; None where the scanner leans too much."""
    if mounting is None or not mounting.is_told:
        return mounting
    hangs = ", upside down" if mounting.is_upside_down else ""
    place = ", ".join(f"{value:.4g}" for value in mounting.offset)
    told = f"transforms tell that the scanner sits at ({place}) (m, m, rad){hangs} on the frame "
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
    for name in set(TRANSFORMS) - store.types.keys():
        store.register(get_types_from_msg(TRANSFORM_FIELDS, name))
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
    return Bag(opened, store.deserialize_ros1 if is_ros1 else store.deserialize_cdr)


def _choose(
    bag: Bag, msgtypes: Sequence[str], wanted: str | None, parameter: str, file: str
) -> Topic | None:
    """The topic of some types that the caller wants, or the only one, or None."""
    topics = {topic.name: topic for topic in bag.topics(msgtypes)}
    listed = shorten(", ".join(topics), 100)
    if wanted is None and len(topics) > 1:
        raise LogError(
            f"{file}: {len(topics)} topics of one type ({listed}); choose one by `{parameter}` "
            f"(`--{parameter.replace('_', '-')}`)"
        )
    if wanted is not None and wanted not in topics:
        raise LogError(f"{file}: `{parameter}` is {wanted!r}, the bag has {listed or None}")
    return topics.get(wanted or next(iter(topics), ""))


def _decode_messages(
    bag: Bag, topic: Topic, report: DamageReport
) -> Iterator[tuple[int, float, Any]]:
    """Number, time of the bag [s] and message of a topic."""
    connections = [c for c in bag.reader.connections if (c.topic, c.msgtype) == topic]
    stream = enumerate(bag.reader.messages(connections=connections), 1)
    number = 0
    while True:
        try:
            number, (_, nanoseconds, raw) = next(stream)
            message = bag.decode(raw, topic.msgtype)
        except StopIteration:
            return
        except Exception as error:  # rosbags again: the stream cannot go on behind it
            reason = f"the bag breaks off at this {topic.msgtype} message: {error!r}"
            report.skip(number + 1, reason)
            return
        yield number, 1e-9 * nanoseconds, message


def _messages(bag: Bag, topic: Topic, report: DamageReport) -> Iterator[tuple[int, float, Any]]:
    """Number, time of the header [s] and message of a topic.

    Where no header has a time, that of the bag counts. A simulation's clock begins at 0.
    """
    stream = _decode_messages(bag, topic, report)
    start = list(islice(stream, MESSAGES_OF_A_START))
    is_stamped = any(_header_stamp(message) for _, _, message in start)
    for number, arrival, message in chain(start, stream):
        yield number, _header_stamp(message) if is_stamped else arrival, message


def _header_stamp(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _sweeps(bag: Bag, topic: Topic, source: Source) -> Iterator[Sweep]:
    """Yield the good scan messages, counter-clockwise from `angle_min`."""
    for number, stamp, message in _messages(bag, topic, source.report):
        ranges = message.ranges
        if topic.msgtype == MULTI_ECHO:
            ranges = [beam.echoes[0] if len(beam.echoes) else np.nan for beam in ranges]
        declared = {name: (float(getattr(message, name)), 1.0) for name in DECLARED}
        try:
            with np.errstate(invalid="ignore", over="ignore"):  # what is not finite makes no point
                scan = source.scanner.sweep(ranges, declared, stamp=stamp)
        except LabkitError as damage:
            source.report.skip(number, f"a damaged {topic.msgtype} message: {damage}")
        else:
            yield Sweep(number, scan, message.header.frame_id)


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
            f"{report.file}: no usable {ODOMETRY} message on {topic.name}{report.summary()}"
        )
    return np.array(rows)


def _is_bag(source: Source) -> bool:
    return bool(bag_kind(source))


READER = Reader(
    name="ros",
    files="ROS 1 and ROS 2 bags",
    recognises=_is_bag,
    uses=(
        *("angles", "no_return", "laser_offset", "time_increment", "angle_unit"),
        "blind_beams",
        *("topic", "odometry_topic", "frame"),
    ),
    read=read,
    read_wheels=read_wheels,
)
