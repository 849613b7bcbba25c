"""The scanner's place on the robot, by the fixed transforms of a bag (``/tf_static``)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from labkit.logs.lines import QUATERNION_TOLERANCE, DamagedLine
from labkit.support.arrays import FloatArray

MAX_LEAN = math.radians(30.0)  # of a scanner whose scans are taken as level
MIN_OFFSET = 1e-4  # [m, rad]: a place that differs less from the robot's own is none


class Transform(NamedTuple):
    """Pose of a frame in its parent's."""

    parent: str
    T_parent_child: FloatArray  # (4, 4)


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


def read_transforms(message: Any) -> Iterable[tuple[str, Transform]]:
    """Frames and transforms of a ``TFMessage``; `DamagedLine` names one that is none."""
    for stamped in message.transforms:
        child = stamped.child_frame_id.strip("/")
        place = stamped.transform.translation
        q = stamped.transform.rotation
        T = np.eye(4)
        T[:3, :3] = _rotation(np.array([q.x, q.y, q.z, q.w]), child)
        T[:3, 3] = place.x, place.y, place.z
        if not np.isfinite(T).all():
            raise DamagedLine(f"the place of the frame {child!r} is not finite")
        yield child, Transform(stamped.header.frame_id.strip("/"), T)


def _rotation(quaternion: FloatArray, frame: str) -> FloatArray:
    """Rotation (3, 3) by a quaternion (x, y, z, w)."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 (few logs need it)

    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) <= QUATERNION_TOLERANCE:
        raise DamagedLine(f"the quaternion of the frame {frame!r} has length {length:.4g}")
    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


def find_mounting(laser: str, robot: str, transforms: Mapping[str, Transform]) -> Mounting | None:
    """The place of the frame `laser` on `robot`, or on the last frame that is fixed to it."""
    frame = laser.strip("/")
    T_frame_laser = np.eye(4)
    passed = set[str]()
    while frame != robot.strip("/") and frame in transforms and frame not in passed:
        passed.add(frame)
        frame, T_parent_child = transforms[frame]
        T_frame_laser = T_parent_child @ T_frame_laser
    if not passed:
        return None
    x, y = T_frame_laser[:2, 3]
    upward = float(np.clip(T_frame_laser[2, 2], -1.0, 1.0))
    heading = math.atan2(T_frame_laser[1, 0], T_frame_laser[0, 0])  # of the first beam's axis
    offset = np.array([x, y, heading])
    return Mounting(frame, offset, math.acos(abs(upward)), upward < 0.0)
