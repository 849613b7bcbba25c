"""The lesson's own experiment (section 6), repeated draw for draw.

The lesson does not cast rays. It scatters world points, half of them on the two walls of an
L and half anywhere. A scan is all points in reach, with noise and a few spurious returns.
Nothing hides anything: its scans contain points behind a wall. This is enough to try a
registration on, and the same seed gives the same numbers, so results can be compared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from labkit.scan import Scan
from labkit.se2 import transform
from labkit.support.arrays import FloatArray

ROOM_WIDTH = 8.0  # [m]: length of the wall along x
ROOM_DEPTH = 6.0  # [m]: length of the wall along y
RANGE_MAX = 10.0  # [m]
FIELD_OF_VIEW = math.radians(270.0)
NOISE_STD = 0.01  # [m], of x and of y
CLUTTER_EXTENT = 2.0  # [m]: spurious returns lie within ± this in x and in y


@dataclass(frozen=True, eq=False, kw_only=True)
class LessonExperiment:
    """Two scans, a guess (3°, 0.20 m along x), and the truth (6°, 0.35 m along x, 0.10 along y)."""

    source: Scan
    target: Scan
    T_init: FloatArray
    T_target_source: FloatArray


def lesson_experiment() -> LessonExperiment:
    """Repeat the lesson's run: 600 world points from seed 7, scans from seeds 1 and 2.

    Examples
    --------
    >>> experiment = lesson_experiment()
    >>> len(experiment.target), len(experiment.source)
    (615, 597)
    """
    world = lesson_world(600, rng=7)
    T_target_source = transform(0.35, 0.10, math.radians(6.0))
    return LessonExperiment(
        source=sample_scan(world, T_target_source, rng=2),
        target=sample_scan(world, np.eye(3), rng=1),
        T_init=transform(0.20, 0.0, math.radians(3.0)),
        T_target_source=T_target_source,
    )


def lesson_world(count: int, rng: np.random.Generator | int) -> FloatArray:
    """Draw points (count, 2) [m]: a quarter on each wall of the L, half scattered between."""
    generator = np.random.default_rng(rng)
    along_x = generator.uniform(0.0, ROOM_WIDTH, size=count // 4)
    along_y = generator.uniform(0.0, ROOM_DEPTH, size=count // 4)
    scatter = generator.uniform([0.0, 0.0], [ROOM_WIDTH, ROOM_DEPTH], size=(count // 2, 2))
    wall_x = np.column_stack([along_x, np.zeros_like(along_x)])
    wall_y = np.column_stack([np.zeros_like(along_y), along_y])
    return np.vstack([wall_x, wall_y, scatter])


def sample_scan(world: FloatArray, T: FloatArray, *, rng: np.random.Generator | int) -> Scan:
    """Take all world points within range of the pose T, in its frame, with noise and clutter.

    One spurious return for every forty points, at least five, comes after them.
    """
    generator = np.random.default_rng(rng)
    # invert(T) would round otherwise in the last bit; the lesson subtracts t first.
    p = (world - T[:2, 2]) @ T[:2, :2]
    distance = np.hypot(p[:, 0], p[:, 1])
    angle = np.arctan2(p[:, 1], p[:, 0])
    seen = p[(distance <= RANGE_MAX) & (np.abs(angle) <= FIELD_OF_VIEW / 2.0)]
    measured = seen + generator.normal(0.0, NOISE_STD, size=seen.shape)
    clutter_count = max(5, len(measured) // 40)
    clutter = generator.uniform(-CLUTTER_EXTENT, CLUTTER_EXTENT, size=(clutter_count, 2))
    return Scan.from_points(np.vstack([measured, clutter]))
