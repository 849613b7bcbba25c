"""The simulated scenes that several cases share."""

from __future__ import annotations

import math

import numpy as np

from collection import Cases
from labkit import apply, from_xytheta, transform
from labkit.simulation import Lidar, cast, room


def room_pair(cases: Cases, name: str = "room", beam_count: int = 136) -> tuple[str, str]:
    """A noisy look at the room, and another after (0.12, 0.06) m and 4°."""
    rng = np.random.default_rng(5)
    lidar = Lidar(beam_count=beam_count)
    pose = transform(0.12, 0.06, math.radians(4.0))
    older, newer = (cast(room(), T, lidar, rng=rng) for T in (np.eye(3), pose))
    return (
        cases.table(f"{name}_target", older.points, 4),
        cases.table(f"{name}_source", newer.points, 4),
    )


def small_pair(cases: Cases) -> tuple[str, str]:
    """The same by so few beams that a slow interpreter answers at once."""
    return room_pair(cases, "small", 28)


def moved(cases: Cases, file: str, name: str, pose: tuple[float, float, float]) -> str:
    """The points of `file` moved by `pose`."""
    return cases.table(name, apply(from_xytheta(pose), cases.files[file]))
