"""Simulated data with a known truth: worlds, a ray-casting scanner, wheel odometry.

There are two ways to make a scan. `lesson_experiment` repeats the lesson's own point sampler,
number for number. `cast` and `scan_along` look into a world of walls as a real scanner
does: beam by beam, and the nearest wall hides those behind it.

`rng` is a `numpy.random.Generator`, or the seed of one. Arguments out of range raise
`InvalidParameterError`, arrays of another shape or not finite `InvalidPointsError`.
"""

from labkit.simulation.lesson import LessonExperiment, lesson_experiment
from labkit.simulation.lidar import Lidar, cast, scan_along
from labkit.simulation.wheels import WheelNoise, wheel_increments
from labkit.simulation.world import (
    MovingObject,
    World,
    corner,
    corridor,
    crowd,
    doorways,
    room,
    two_rooms,
)

__all__ = [
    "LessonExperiment",
    "Lidar",
    "MovingObject",
    "WheelNoise",
    "World",
    "cast",
    "corner",
    "corridor",
    "crowd",
    "doorways",
    "lesson_experiment",
    "room",
    "scan_along",
    "two_rooms",
    "wheel_increments",
]
