import math
from dataclasses import fields
from typing import NamedTuple

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.se2 import apply, from_xytheta, to_xytheta
from labkit.support.errors import LogError

pytest.importorskip("rosbags")
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

GEOMETRY = "geometry_msgs/msg/"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
OLD_TRANSFORMS = "tf/msg/tfMessage"
RANGES = (1.0, 2.0, math.inf, 0.05, 30.0)


class Bag:
    """A bag under construction: ROS 1 in one file, ROS 2 in a directory."""

    def __init__(self, path, ros):
        self.ros, self.path, self.connections = ros, path, {}
        self.store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
        for name in {TRANSFORMS, OLD_TRANSFORMS} - self.store.types.keys():
            fields_of_transforms = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(fields_of_transforms, name))
        if ros == 1:
            self.writer = rosbag1.Writer(path)
        else:
            plugin = rosbag2.StoragePlugin["MCAP" if ros == "mcap" else "SQLITE3"]
            self.writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
        self.writer.open()

    def made(self, name, **given):
        """A message; numbers that are not given are 0."""
        kind = self.store.types[name]
        for each in fields(kind):
            if each.name not in given and "__msg__" in str(each.type):
                given[each.name] = self.made(str(each.type).replace("__", "/"))
            given.setdefault(each.name, 0)
        return kind(**given)

    def add(self, topic, name, stamp, header=None, frame="laser", **given):
        """Write a message that arrives half a second after it was stamped."""
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.store)
        sec, part = divmod(stamp if header is None else header, 1.0)
        time = self.made("builtin_interfaces/msg/Time", sec=int(sec), nanosec=round(part * 1e9))
        head = self.made("std_msgs/msg/Header", stamp=time, frame_id=frame)
        encode = self.store.serialize_ros1 if self.ros == 1 else self.store.serialize_cdr
        raw = encode(self.made(name, header=head, **given), name)
        self.writer.write(self.connections[topic], round((stamp + 0.5) * 1e9), bytes(raw))

    def scan(self, stamp, ranges=RANGES, topic="/scan", range_max=25.0, **given):
        angles = {"angle_min": -0.5, "angle_max": 0.5, "angle_increment": 0.25}
        angles |= {name: given.pop(name) for name in angles if name in given}
        given |= {"ranges": np.array(ranges, np.float32), "intensities": np.zeros(0, np.float32)}
        limits = {"range_min": 0.1, "range_max": range_max}
        self.add(topic, "sensor_msgs/msg/LaserScan", stamp, **angles, **limits, **given)

    def odometry(self, stamp, x, y, theta, topic="/odom", orientation=None, header=None):
        upright = {"z": math.sin(theta / 2), "w": math.cos(theta / 2)}
        place = self.made(GEOMETRY + "Point", x=x, y=y)
        turn = self.made(GEOMETRY + "Quaternion", **(orientation or upright))
        pose = self.made(GEOMETRY + "Pose", position=place, orientation=turn)
        unsure = {"covariance": np.zeros(36)}
        given = {
            "pose": self.made(GEOMETRY + "PoseWithCovariance", pose=pose, **unsure),
            "twist": self.made(GEOMETRY + "TwistWithCovariance", **unsure),
        }
        name = "nav_msgs/msg/Odometry"
        self.add(topic, name, stamp, header=header, child_frame_id="base", **given)

    def fixed(self, child, parent, place, rotation, topic="/tf_static", stamp=1.0, name=TRANSFORMS):
        """A transform: where the child frame sits on its parent."""
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.store)
        x, y, z, w = rotation
        turn = self.made(GEOMETRY + "Quaternion", x=x, y=y, z=z, w=w)
        shift = self.made(GEOMETRY + "Vector3", x=place[0], y=place[1], z=place[2])
        pose = self.made(GEOMETRY + "Transform", translation=shift, rotation=turn)
        time = self.made("builtin_interfaces/msg/Time", sec=int(stamp))
        head = self.made("std_msgs/msg/Header", stamp=time, frame_id=parent)
        stamped = self.made(
            GEOMETRY + "TransformStamped", header=head, child_frame_id=child, transform=pose
        )
        encode = self.store.serialize_ros1 if self.ros == 1 else self.store.serialize_cdr
        raw = encode(self.made(name, transforms=[stamped]), name)
        self.writer.write(self.connections[topic], round(stamp * 1e9), bytes(raw))

    def close(self):
        self.writer.close()
        return self.path


@pytest.fixture(params=[1, 2, "mcap"])
def any_bag(request, tmp_path):
    return Bag(tmp_path / ("run.bag" if request.param == 1 else "run"), request.param)


@pytest.fixture
def bag(tmp_path):
    return Bag(tmp_path / "run", 2)


def test_scans_and_interpolated_odometry(any_bag):
    any_bag.odometry(10.0, 0.0, 0.0, 3.0)
    any_bag.scan(10.25)
    any_bag.odometry(11.0, 1.0, 2.0, -3.0)
    any_bag.scan(11.0)
    path = any_bag.close()
    log = read_log(path, strict=True)
    assert (len(log), log.name, log.format, log.reference) == (2, "run", "ros", None)
    assert log.stamps.tolist() == [10.25, 11.0]
    scan = log.scans[0]
    assert scan.beams.tolist() == [0, 1]
    np.testing.assert_allclose(scan.angles, [-0.5, -0.25, 0.0, 0.25, 0.5])
    np.testing.assert_allclose(scan.points[0], [math.cos(-0.5), math.sin(-0.5)])
    quarter = 3.0 + 0.25 * (2.0 * math.pi - 6.0)
    np.testing.assert_allclose(log.odometry, [[0.25, 0.5, quarter], [1.0, 2.0, -3.0]])
    log = read_log(path, laser_offset=(0.2, 0.1, 0.3))
    mounted = from_xytheta([1.0, 2.0, -3.0]) @ from_xytheta([0.2, 0.1, 0.3])
    np.testing.assert_allclose(log.odometry[1], to_xytheta(mounted))
    for storage in path.glob("*.db3" if any_bag.ros == 2 else "*.mcap"):
        assert len(read_log(storage)) == 2  # the file inside a bag of ROS 2


@pytest.mark.parametrize("range_max", [math.inf, np.finfo(np.float32).max])
def test_a_number_that_is_no_range_makes_no_point_and_no_warning(bag, range_max):
    signalling = np.array([0x7F800001], dtype=np.uint32).view(np.float32)[0]
    bag.scan(10.0, ranges=(1.0, 3.4e38, 2.0, signalling, 30.0), range_max=range_max)
    assert read_log(bag.close()).scans[0].beams.tolist() == [0, 2, 4]


def test_a_header_without_time_takes_that_of_the_bag(any_bag):
    any_bag.scan(10.0, header=0.0)
    path = any_bag.close()
    log = read_log(path)
    assert (log.stamps.tolist(), log.odometry) == ([10.5], None)
    with pytest.raises(LogError, match="`odometry_topic` is '/odom', the bag has None"):
        read_log(path, odometry_topic="/odom")


def test_a_topic_is_chosen_where_there_are_several(any_bag):
    any_bag.scan(10.0, topic="/front")
    any_bag.scan(11.0, topic="/rear")
    any_bag.odometry(11.0, 0.0, 0.0, 0.0, topic="/wheels")
    any_bag.odometry(11.0, 9.0, 0.0, 0.0, topic="/filtered")
    path = any_bag.close()
    with pytest.raises(LogError, match=r"2 topics of one type \(/front, /rear\); choose .*`topic`"):
        read_log(path)
    with pytest.raises(
        LogError,
        match=r"\(/filtered, /wheels\); choose one by `odometry_topic` \(`--odometry-topic`\)",
    ):
        read_log(path, topic="/rear")
    with pytest.raises(LogError, match="`topic` is '/top', the bag has /front, /rear"):
        read_log(path, topic="/top")
    log = read_log(path, topic="/rear", odometry_topic="/wheels")
    assert (log.stamps.tolist(), log.odometry.tolist()) == ([11.0], [[0.0, 0.0, 0.0]])


def test_a_scan_in_a_silence_of_the_odometry_has_no_pose(bag):
    for stamp in (10.0, 10.1, 10.2, 110.2, 110.3):
        bag.odometry(stamp, stamp, 0.0, 0.0)
    for stamp in (9.95, 10.0, 50.0, 60.0, 110.8):
        bag.scan(stamp)
    log = read_log(bag.close(), strict=True, laser_offset=(0.5, 0.0, 0.0))
    np.testing.assert_allclose(log.odometry, 2 * [[10.5, 0, 0]] + 3 * [[math.nan] * 3])
    assert log.remarks == (
        "3 of 5 scans have no odometry, the first at 50 s: it is silent there for longer than 2 s",
    )


@pytest.mark.parametrize(
    ("stamps", "poses", "message"),
    [
        ((), (0.0,), r"without any scan, .* it holds /odom \(nav_msgs/msg/Odometry, 1\)"),
        ((90.0,), (0.0,), "`stamps` must lie within `times`, 10 to 10 s .* got 90 to 90 s; bri"),
        ((10.0,), (math.inf,), "no usable nav_msgs/msg/Odometry message on /odom; 1 dam"),
    ],
)
def test_bags_without_a_usable_scan_or_pose(bag, stamps, poses, message):
    for stamp in stamps:
        bag.scan(stamp)
    for x in poses:
        bag.odometry(10.0, x, 0.0, 0.0)
    with pytest.raises(LogError, match=message):
        read_log(bag.close())


@pytest.mark.parametrize("length", [2.828, math.nan])
def test_a_pose_that_is_none_is_damage(bag, length):
    bag.scan(10.0)
    bag.odometry(10.0, 1e300, 0.0, 0.0)
    bag.odometry(10.0, 5.0, 0.0, 0.0, orientation={"w": length})
    bag.odometry(10.0, 1.0, 0.0, 0.0)
    bag.odometry(10.05, 1.0, 0.0, 0.0, orientation={"y": math.sin(0.1), "w": math.cos(0.1)})
    log = read_log(bag.close())
    assert log.odometry.tolist() == [[1.0, 0.0, 0.0]]
    assert [skipped.line for skipped in log.skipped] == [1, 2]
    assert "the pose is (1e+300, 0), expected to lie within 1e+09 m" in log.skipped[0].reason
    assert f"the quaternion has length {length}, expected 1" in log.skipped[1].reason


@pytest.mark.parametrize("maximum", [0.0, 0.05, -1.0, math.nan])
def test_a_maximum_that_is_not_above_the_minimum_is_unknown(bag, maximum):
    for stamp in (10.0, 11.0):
        bag.scan(stamp, range_max=maximum)
    log = read_log(path := bag.close(), strict=True)
    assert [scan.beams.tolist() for scan in log.scans] == 2 * [[0, 1, 4]]
    assert log.remarks[-1].startswith("2 scans declare a maximum range that is not above")
    known = read_log(path, range_max=25.0, range_min=1.5)
    assert ([scan.beams.tolist() for scan in known.scans], known.remarks) == (2 * [[1]], ())


class Turn(NamedTuple):
    """A rotation by an angle [rad] about an axis, a unit vector."""

    axis: tuple[float, float, float]
    angle: float

    @property
    def quaternion(self):
        return *(math.sin(self.angle / 2.0) * np.array(self.axis)), math.cos(self.angle / 2.0)

    def apply(self, points):
        """Rodrigues' formula."""
        k = np.array(self.axis)
        along = (points @ k)[:, None] * k
        across = points - along
        return along + math.cos(self.angle) * across + math.sin(self.angle) * np.cross(k, points)


TURNS = {
    "upright": Turn((0.0, 0.0, 1.0), 0.3),
    "upside down": Turn((math.cos(0.35), math.sin(0.35), 0.0), math.pi),
    "pitched over": Turn((-math.sin(0.2), math.cos(0.2), 0.0), math.pi),
    "a little lean": Turn((0.0, 0.01, math.sqrt(1.0 - 1e-4)), 2.0),
}
OVERHEAD = {"upside down", "pitched over"}


@pytest.mark.parametrize("turn", TURNS)
def test_the_fixed_transforms_tell_where_the_scanner_sits(any_bag, turn):
    """The law: points lie on the robot where the transforms in space, one by one, put them."""
    hung, mast = TURNS[turn], Turn((0.0, 0.0, 1.0), -0.5)
    any_bag.odometry(10.0, 0.0, 0.0, 0.0)
    any_bag.scan(10.0)
    any_bag.fixed("laser", "mast", (0.1, 0.2, 0.3), hung.quaternion)
    any_bag.fixed("mast", "/base", (0.5, 0.0, 1.0), mast.quaternion)
    any_bag.fixed("base", "ground", (9.0, 9.0, 0.0), mast.quaternion)

    log = read_log(any_bag.close(), strict=True)

    angles = np.array([-0.5, -0.25])
    seen = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles]) * [[1.0], [2.0]]
    on_mast = hung.apply(seen) + np.array([0.1, 0.2, 0.3])
    expected = mast.apply(on_mast) + np.array([0.5, 0.0, 1.0])
    points = apply(from_xytheta(log.odometry[0]), log.scans[0].points)
    np.testing.assert_allclose(points, expected[:, :2], atol=2e-3)
    assert log.remarks[0].startswith("transforms tell that the scanner sits at (")
    assert ("upside down on the frame 'base'" in log.remarks[0]) == (turn in OVERHEAD)


def test_the_caller_goes_before_the_fixed_transforms(bag):
    bag.odometry(10.0, 0.0, 0.0, 0.0)
    bag.scan(10.0)
    bag.fixed("laser", "base", (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0))
    path = bag.close()

    told, by_caller = read_log(path), read_log(path, mirrored=False, laser_offset=(1, 0, 0))

    np.testing.assert_allclose(told.scans[0].angles, -by_caller.scans[0].angles)
    np.testing.assert_allclose(told.odometry, [[0.1, 0.2, 0.0]], atol=1e-9)
    np.testing.assert_allclose(by_caller.odometry, [[1.0, 0.0, 0.0]], atol=1e-9)


@pytest.mark.parametrize(
    ("rotation", "skipped", "remark"),
    [
        ((0.0, 0.0, 0.0, 0.0), "the quaternion of the frame 'laser' has length 0", ""),
        ((0.0, 0.0, math.nan, 1.0), "the quaternion of the frame 'laser' has length nan", ""),
        ((0.0, math.sin(0.5), 0.0, math.cos(0.5)), "", "leans by 57 degrees: its place is left"),
    ],
)
def test_a_fixed_transform_that_tells_no_place_is_left_aside(bag, rotation, skipped, remark):
    for k in range(12):
        bag.scan(10.0 + k)
    bag.fixed("laser", "base", (0.0, 0.0, 0.3), rotation)

    log = read_log(bag.close())

    assert log.scans[0].beams.tolist() == [0, 1]
    assert all(skipped in line.reason for line in log.skipped)
    assert len(log.skipped) == bool(skipped)
    assert all(remark in each for each in log.remarks)
    assert len(log.remarks) == bool(remark)


@pytest.mark.parametrize("cut", [False, True])
def test_of_several_echoes_the_first_counts(any_bag, cut):
    echoes = [[1.0, 7.0], [2.0], [], [math.inf, 3.0]]
    name = "sensor_msgs/msg/"
    beams = [any_bag.made(name + "LaserEcho", echoes=np.array(beam, np.float32)) for beam in echoes]
    geometry = {"angle_min": -0.5, "angle_max": 0.25, "angle_increment": 0.25}
    band = {"range_min": 0.1, "range_max": 1.5 if cut else 25.0}
    any_bag.add(
        "/echoes",
        name + "MultiEchoLaserScan",
        10.0,
        ranges=beams,
        intensities=[],
        **geometry,
        **band,
    )

    scan = read_log(any_bag.close(), strict=True).scans[0]

    assert scan.beams.tolist() == ([0] if cut else [0, 1])
    np.testing.assert_allclose(scan.ranges, [1.0, 2.0, math.nan, math.inf])


UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0)
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("name", [TRANSFORMS, OLD_TRANSFORMS])
def test_a_transform_of_tf_that_never_changes_is_a_mount(any_bag, name):
    """The law: a mount is a mount wherever it is told."""
    for k in range(3):
        any_bag.scan(10.0 + k)
        any_bag.fixed("laser", "plate", (0.1, 0, 0), UPRIGHT, "/tf", 10.0 + k, name)
        any_bag.fixed("plate", "base", (0.2, 0, 0), UPSIDE_DOWN, "/tf", 10.0 + k, name)

    log = read_log(any_bag.close(), strict=True)

    assert "sits at (0.3, 0, 0) (m, m, rad), upside down on the frame 'base'" in log.remarks[0]
    np.testing.assert_allclose(log.scans[0].angles, [0.5, 0.25, 0.0, -0.25, -0.5])


def test_transforms_that_move_are_wheels_where_no_topic_of_odometry_is(any_bag):
    for k in range(3):
        any_bag.scan(10.0 + k)
        any_bag.fixed("laser", "base", (0.5, 0.0, 0.0), UPRIGHT)
        any_bag.fixed("base", "odom", (1.0 * k, 0.0, 0.0), UPRIGHT, "/tf", 10.0 + k)
        any_bag.fixed("odom", "map", (0.0, 0.1 * k, 0.0), UPRIGHT, "/tf", 10.0 + k)

    log = read_log(any_bag.close(), strict=True)

    np.testing.assert_allclose(log.odometry, [[0.5, 0, 0], [1.5, 0, 0], [2.5, 0, 0]])
    assert "the transforms from 'odom' to 'base' count as wheel odometry" in log.remarks[0]


@pytest.mark.parametrize(("frame", "first"), [(None, 1.0), ("rear", 3.0)])
def test_of_two_scanners_on_one_topic_one_is_read_and_the_other_told(any_bag, frame, first):
    for k in range(4):
        ranges = np.full(5, 1.0 + 2.0 * (k % 2))
        any_bag.scan(10.0 + k, ranges=ranges, frame=["front", "rear"][k % 2])

    log = read_log(any_bag.close(), frame=frame)

    assert [scan.ranges[0] for scan in log.scans] == [first, first]
    other, read = ("rear", "front") if frame is None else ("front", "rear")
    assert f"2 scans of the frame '{other}' are left out: those of '{read}'" in log.remarks[-1]


@pytest.mark.parametrize("zeros", [1, 3])
def test_a_simulation_s_clock_begins_at_zero(any_bag, zeros):
    for k in range(6):
        stamp = max(0.0, 1.0 + k - zeros)
        any_bag.scan(1.7e9 + k, header=stamp)
        any_bag.odometry(1.7e9 + k, stamp, 0.0, 0.0, header=stamp)

    log = read_log(any_bag.close())

    assert log.stamps.tolist() == [max(0.0, 1.0 + k - zeros) for k in range(6)]
    np.testing.assert_allclose(log.odometry[:, 0], log.stamps)


@pytest.mark.parametrize("range_max", [25.0, 25000.0])
def test_a_unit_of_ranges_is_the_caller_s_to_set(bag, range_max):
    for k in range(2):
        bag.scan(10.0 + k, ranges=(1000.0, 2000.0, math.inf, 3000.0, 30000.0), range_max=range_max)

    log = read_log(bag.close(), range_unit="mm")

    np.testing.assert_allclose(log.scans[0].ranges[[0, 1, 3]], [1.0, 2.0, 3.0])
    assert log.scans[0].beams.tolist() == [0, 1, 3]


def test_what_may_tell_a_motion_and_is_not_read_is_named(bag):
    imu = "sensor_msgs/msg/Imu"
    zeros = {f"{name}_covariance": np.zeros(9) for name in ("orientation", "angular_velocity")}
    bag.scan(10.0)
    bag.add("/imu", imu, 10.0, linear_acceleration_covariance=np.zeros(9), **zeros)

    log = read_log(bag.close())

    assert log.remarks == ("not read: '/imu' (sensor_msgs/msg/Imu, 1 messages)",)
