"""Worlds for the scanner: walls as line segments, objects that move, and places to scan.

Each place shows one thing that helps or harms a scan matcher.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.simulation.lesson import ROOM_DEPTH, ROOM_WIDTH
from labkit.support.arrays import (
    MAX_DISTANCE,
    FloatArray,
    as_finite,
    as_floats,
    as_generator,
    as_numbers,
    as_points,
    check_count,
    check_kind,
    check_kinds,
    check_range,
)

MAX_COUNT = 1_000_000  # of people, of sides
MAX_LENGTH = 1e4  # [m] of a room, a doorway, a radius
PERSON_RADIUS = 0.25  # [m]
CROWD_START = 1.0  # [m]: nobody in the crowd stands nearer to the origin
MAX_SPEED = 100.0  # [m/s] of a person


@dataclass(frozen=True, eq=False, kw_only=True)
class MovingObject:
    """Segments that move as one body, straight on and without turning.

    They are (M, 2, 2) end points [m] in the world frame at time 0; `velocity` is (2,) [m/s].
    """

    segments: FloatArray
    velocity: FloatArray

    def __post_init__(self) -> None:
        velocity = as_numbers(self.velocity, "velocity", "vx, vy [m/s]")
        check_range(float(np.abs(velocity).max()), "velocity", at_most=MAX_DISTANCE, unit="m/s")
        object.__setattr__(self, "segments", as_segments(self.segments, "segments"))
        object.__setattr__(self, "velocity", velocity)

    def at(self, stamp: float) -> FloatArray:
        """Segments [m] at time `stamp` [s], shape (M, 2, 2)."""
        return self.segments + as_time(stamp) * self.velocity


@dataclass(frozen=True, eq=False, kw_only=True)
class World:
    """Walls that stay, (M, 2, 2) pairs of end points [m], and objects that move."""

    segments: FloatArray
    moving: tuple[MovingObject, ...] = ()

    def __post_init__(self) -> None:
        check_kinds(self.moving, "moving", MovingObject)
        object.__setattr__(self, "segments", as_segments(self.segments, "segments"))

    def at(self, stamp: float) -> FloatArray:
        """All segments [m] at time `stamp` [s], shape (M, 2, 2)."""
        time = as_time(stamp)
        return np.concatenate([self.segments, *(thing.at(time) for thing in self.moving)])


def as_segments(segments: ArrayLike, name: str) -> FloatArray:
    """Check line segments: M pairs of end points (x, y) [m], shape (M, 2, 2), finite."""
    checked = as_finite(as_floats(segments, name, "give end points in metres", ("M", 2, 2)), name)
    as_points(checked.reshape(-1, 2), name, minimum=0)  # within reach of the arithmetic
    return checked


def as_time(stamp: float) -> float:
    """Check a time [s]."""
    check_range(stamp, "stamp", at_least=-1e12, at_most=1e12, unit="s")
    return float(stamp)


def polyline(vertices: ArrayLike, *, closed: bool = False) -> FloatArray:
    """Segments from each of the (N, 2) vertices [m] to the next, shape (N − 1, 2, 2).

    A closed one has N segments: the last leads back to the first vertex.
    """
    v = as_points(vertices, "vertices")
    check_kind(closed, "closed", bool)
    if closed:
        v = np.vstack([v, v[:1]])
    return np.stack([v[:-1], v[1:]], axis=1)


def circle(center: ArrayLike, radius: float, sides: int = 16) -> FloatArray:
    """A round thing as a polygon inscribed in its circle [m], shape (sides, 2, 2)."""
    check_count(sides, "sides", at_least=3, at_most=MAX_COUNT)
    (r,) = as_lengths(radius=radius)
    turn = 2.0 * np.pi * np.arange(sides) / sides
    rim = r * np.column_stack([np.cos(turn), np.sin(turn)])
    return polyline(as_numbers(center, "center", "x, y") + rim, closed=True)


def box(x: float, y: float, half: float) -> FloatArray:
    """An upright square around (x, y) whose sides are 2 · `half` long [m]."""
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    return polyline(np.array([x, y]) + corners, closed=True)


def as_lengths(**lengths: float) -> tuple[float, ...]:
    """Check lengths [m], each by its name: positive, and no longer than `MAX_LENGTH`."""
    for name, value in lengths.items():
        check_range(value, name, above=0.0, at_most=MAX_LENGTH, unit="m")
    return tuple(map(float, lengths.values()))


def room(width: float = ROOM_WIDTH, depth: float = ROOM_DEPTH) -> World:
    """A room around the origin that looks the same from no two places.

    An alcove, a cut corner and a pillar break the rectangle's symmetry, so a scan tells
    where it was taken, and which way the scanner looked. The width [m] lies along
    x, the depth [m] along y; the alcove reaches beyond it by an eighth.
    """
    width, depth = as_lengths(width=width, depth=depth)
    x, y = width / 2.0, depth / 2.0
    corner_cut = [[x, 0.4 * y], [0.6 * x, y]]
    alcove = [[-0.1 * x, y], [-0.1 * x, 1.25 * y], [-0.5 * x, 1.25 * y], [-0.5 * x, y]]
    outline = [[x, -y], *corner_cut, *alcove, [-x, y], [-x, -y]]  # counter-clockwise
    pillar = box(-0.3 * width, -0.3 * depth, 0.05 * min(width, depth))
    return World(segments=np.concatenate([polyline(outline, closed=True), pillar]))


def corner() -> World:
    """The lesson's L as solid walls, from the origin 8 m along x and 6 m along y."""
    return World(segments=polyline([[ROOM_WIDTH, 0.0], [0.0, 0.0], [0.0, ROOM_DEPTH]]))


def corridor() -> World:
    """Two parallel walls along x, 200 m long and 2 m apart, centred at the origin.

    As long as both ends are out of reach, every place along it looks the same: no scan
    tells how far the robot drove (problem 4 of the lesson).
    """
    x, y = 100.0, 1.0
    return World(segments=np.array([[[-x, -y], [x, -y]], [[x, y], [-x, y]]]))


def doorways(period: float = 2.0, opening: float = 0.8) -> World:
    """The corridor, 120 m of it, with a niche for a doorway in both walls in every `period` [m].

    Places a period apart look alike, so a match may end one doorway away from the truth. An
    `opening` [m] is as wide as its niche, which is 0.4 m deep.
    """
    period, opening = as_lengths(period=period, opening=opening)
    check_range(period, "period", above=opening, unit="m")
    start = np.arange(-60.0, 60.0, period)
    x = start[:, None] + [0.0, period - opening, period - opening, period]
    y = np.tile([1.0, 1.0, 1.4, 1.4], len(start))
    north = np.column_stack([x.ravel(), y])
    south = north * [1.0, -1.0]
    return World(segments=np.concatenate([polyline(north), polyline(south)]))


def two_rooms(doorway: float = 1.2, width: float = 5.0, depth: float = ROOM_DEPTH) -> World:
    """Two rooms side by side, `width` by `depth` [m] each, joined by a `doorway` [m] at the origin.

    From (−1.5, 0) most of a scan is the west room, from (0.5, 0) most of it is the
    east one: the two overlap in part, and only the shared part can be matched.
    """
    doorway, width, depth = as_lengths(doorway=doorway, width=width, depth=depth)
    check_range(depth, "depth", above=doorway, unit="m")
    y, jamb = depth / 2.0, doorway / 2.0
    east = np.array([[0.0, -y], [width, -y], [width, 0.4 * y], [0.6 * width, y], [0.0, y]])
    west = np.array([[-0.5 * width, y], [-0.5 * width, 0.7 * y], [-width, 0.7 * y], [-width, -y]])
    outline = polyline(np.vstack([east, west]), closed=True)
    wall = np.array([[[0.0, -y], [0.0, -jamb]], [[0.0, jamb], [0.0, y]]])
    shelf = box(0.4 * width, -0.7 * y, 0.1 * width)
    return World(segments=np.concatenate([outline, wall, shelf]))


def crowd(count: int = 8, *, rng: np.random.Generator | int, speed: float = 1.0) -> World:
    """The room with round people in it, half a metre wide, who walk straight on and through walls.

    At time 0 they stand anywhere in the ring around the origin that begins at 1 m and ends at
    the nearer walls; each walks in a direction of its own, at one `speed` [m/s]. `rng` places
    them and sets their directions.
    """
    check_count(count, "count", at_least=0, at_most=MAX_COUNT)
    check_range(speed, "speed", at_least=0.0, at_most=MAX_SPEED, unit="m/s")
    generator = as_generator(rng)
    nearest = CROWD_START + PERSON_RADIUS
    farthest = ROOM_DEPTH / 2.0 - PERSON_RADIUS
    distance = generator.uniform(nearest, farthest, size=count)
    bearing, heading = generator.uniform(0.0, 2.0 * math.pi, size=(2, count))
    centers = distance[:, None] * _direction(bearing)
    velocities = float(speed) * _direction(heading)
    people = tuple(
        MovingObject(segments=circle(center, PERSON_RADIUS), velocity=velocity)
        for center, velocity in zip(centers, velocities, strict=True)
    )
    return World(segments=room().segments, moving=people)


def _direction(angle: FloatArray) -> FloatArray:
    """Unit vectors, shape (N, 2), at angles [rad] from the x axis."""
    return np.column_stack([np.cos(angle), np.sin(angle)])
