"""The scanner's place on the robot and the robot's motion, by the transforms of a bag."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from labkit.logs.lines import MAX_LEAN, QUATERNION_TOLERANCE, DamagedLine
from labkit.support.arrays import FloatArray

MIN_OFFSET = 1e-4  # [m, rad]: a place that differs less from the robot's own is none
SAME_TRANSFORM = 1e-6  # [m, -]: entries of two transforms that differ by less are one


class Transform(NamedTuple):
    """Pose of a frame in its parent's at a time."""

    stamp: float  # [s]
    parent: str
    child: str
    T_parent_child: FloatArray  # (4, 4)

    @property
    def heading(self) -> float:
        """Direction of the child's x axis in the parent's plane [rad]."""
        return math.atan2(self.T_parent_child[1, 0], self.T_parent_child[0, 0])


class Motion(NamedTuple):
    """How a frame moves in its parent's."""

    parent: str
    child: str
    track: FloatArray  # (M, 4): t [s], x [m], y [m], θ [rad]


@dataclass
class Transforms:
    """The transforms of a bag: of each frame the first one, and its track if it moves."""

    first: dict[str, Transform] = field(default_factory=dict)
    tracks: dict[str, list[tuple[float, float, float, float]]] = field(default_factory=dict)
    moving: set[str] = field(default_factory=set)

    def add(self, transform: Transform) -> None:
        """Take the next transform of its frame."""
        child = transform.child
        first = self.first.setdefault(child, transform)
        difference = np.abs(transform.T_parent_child - first.T_parent_child).max()
        if difference > SAME_TRANSFORM or transform.parent != first.parent:
            self.moving.add(child)
        x, y = transform.T_parent_child[:2, 3].tolist()
        self.tracks.setdefault(child, []).append((transform.stamp, x, y, transform.heading))

    @property
    def fixed(self) -> dict[str, Transform]:
        """Transforms of the frames that never move."""
        return {name: self.first[name] for name in self.first.keys() - self.moving}


class Mounting(NamedTuple):
    """Place of a scanner on its robot: ``T_robot_laser`` in the plane, and which way it hangs."""

    robot: str  # the frame
    offset: FloatArray  # (3,): x [m], y [m], θ [rad]
    lean: float  # [rad] out of the plane: 0 to π/2
    is_upside_down: bool

    @property
    def is_told(self) -> bool:
        """True if the place differs from the robot's own."""
        is_turned = self.is_upside_down or self.lean > MAX_LEAN
        return is_turned or bool(np.abs(self.offset).max() > MIN_OFFSET)


def read_transforms(message: Any) -> Iterable[Transform]:
    """Transforms of a ``TFMessage``; `DamagedLine` names one that is none."""
    for stamped in message.transforms:
        child = stamped.child_frame_id.strip("/")
        place = stamped.transform.translation
        q = stamped.transform.rotation
        T = np.eye(4)
        T[:3, :3] = _rotation(np.array([q.x, q.y, q.z, q.w]), child)
        T[:3, 3] = place.x, place.y, place.z
        if not np.isfinite(T).all():
            raise DamagedLine(f"the place of the frame {child!r} is not finite")
        header = stamped.header
        stamp = header.stamp.sec + 1e-9 * header.stamp.nanosec
        yield Transform(stamp, header.frame_id.strip("/"), child, T)


def _rotation(quaternion: FloatArray, frame: str) -> FloatArray:
    """Rotation (3, 3) by a quaternion (x, y, z, w)."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 (few logs need it)

    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) <= QUATERNION_TOLERANCE:
        raise DamagedLine(f"the quaternion of the frame {frame!r} has length {length:.4g}")
    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


def links_above(frame: str, transforms: Mapping[str, Transform]) -> Iterator[Transform]:
    """The transforms from a frame upwards, each once."""
    passed = set[str]()
    while frame in transforms and frame not in passed:
        passed.add(frame)
        yield transforms[frame]
        frame = transforms[frame].parent


def find_mounting(laser: str, robot: str, fixed: Mapping[str, Transform]) -> Mounting | None:
    """The place of the frame `laser` on `robot`, or on the last frame that is fixed to it."""
    frame = ""
    T_frame_laser = np.eye(4)
    for link in links_above(laser.strip("/"), fixed):
        if link.child == robot.strip("/"):
            break
        T_frame_laser = link.T_parent_child @ T_frame_laser
        frame = link.parent
    if not frame:
        return None
    x, y = T_frame_laser[:2, 3]
    upward = float(np.clip(T_frame_laser[2, 2], -1.0, 1.0))
    heading = math.atan2(T_frame_laser[1, 0], T_frame_laser[0, 0])  # of the first beam's axis
    offset = np.array([x, y, heading])
    return Mounting(frame, offset, math.acos(abs(upward)), upward < 0.0)


def find_motion(laser: str, transforms: Transforms) -> Motion | None:
    """The motion of the scanner's robot in a frame of odometry, by the chain above the scanner.

    Of several frames that move one on another, as below a map, that on ``odom`` counts.
    """
    above = links_above(laser.strip("/"), transforms.first)
    links = [link for link in above if link.child in transforms.moving]
    on_odometry = [link for link in links if "odom" in link.parent]
    chosen = on_odometry or (links if len(links) == 1 else [])
    if not chosen:
        return None
    child = chosen[0].child
    return Motion(chosen[0].parent, child, np.array(transforms.tracks[child]))
