"""Places to scan. Each shows one thing that helps or harms a scan matcher."""

from __future__ import annotations

import math

import numpy as np

from labkit.simulation.lesson import DEPTH, WIDTH
from labkit.simulation.world import MovingObject, World, circle, polyline
from labkit.support.arrays import FloatArray, check_count, check_range

PERSON, CLEARANCE = 0.25, 1.0  # m: radius of a person, free space around the origin


def room(width: float = WIDTH, depth: float = DEPTH) -> World:
    """A room around the origin that looks the same from no two places.

    An alcove, a cut corner and a pillar break the rectangle's symmetry, so a scan tells
    where it was taken, and which way the scanner looked. The width [m] lies along
    x, the depth [m] along y; the alcove reaches beyond it by an eighth.
    """
    _check_lengths(width=width, depth=depth)
    x, y = width / 2.0, depth / 2.0
    outline = [  # counter-clockwise from the south-east
        *([x, -y], [x, 0.4 * y], [0.6 * x, y]),  # with the cut corner
        *([-0.1 * x, y], [-0.1 * x, 1.25 * y], [-0.5 * x, 1.25 * y], [-0.5 * x, y]),  # the alcove
        *([-x, y], [-x, -y]),
    ]
    pillar = _box(-0.3 * width, -0.3 * depth, 0.05 * min(width, depth))
    return World(segments=np.concatenate([polyline(outline, closed=True), pillar]))


def corner() -> World:
    """The lesson's L as solid walls, from the origin 8 m along x and 6 m along y."""
    return World(segments=polyline([[WIDTH, 0.0], [0.0, 0.0], [0.0, DEPTH]]))


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
    _check_lengths(period=period, opening=opening)
    check_range(period, "period", above=opening, unit="m")
    start = np.arange(-60.0, 60.0, period)
    x = start[:, None] + [0.0, period - opening, period - opening, period]
    y = np.tile([1.0, 1.0, 1.4, 1.4], len(start))
    side = np.column_stack([x.ravel(), y])
    return World(segments=np.concatenate([polyline(side), polyline(side * [1.0, -1.0])]))


def crowd(count: int = 8, *, rng: np.random.Generator | int, speed: float = 1.0) -> World:
    """The room with round people in it, half a metre wide, who walk straight on and through walls.

    At time 0 they stand anywhere in the ring around the origin that begins at 1 m and ends at
    the nearer walls; each walks in a direction of its own, at one `speed` [m/s]. `rng` places
    them and sets their directions.
    """
    check_count(count, "count", at_least=0)
    check_range(speed, "speed", at_least=0.0, at_most=100.0, unit="m/s")
    rng = np.random.default_rng(rng)
    distance = rng.uniform(CLEARANCE + PERSON, DEPTH / 2.0 - PERSON, size=count)
    bearing, heading = rng.uniform(0.0, 2.0 * math.pi, size=(2, count))
    centers = distance[:, None] * _direction(bearing)
    people = tuple(
        MovingObject(segments=circle(center, PERSON), velocity=velocity)
        for center, velocity in zip(centers, speed * _direction(heading), strict=True)
    )
    return World(segments=room().segments, moving=people)


def two_rooms(doorway: float = 1.2, width: float = 5.0, depth: float = DEPTH) -> World:
    """Two rooms side by side, `width` by `depth` [m] each, joined by a `doorway` [m] at the origin.

    From (−1.5, 0) most of a scan is the west room, from (0.5, 0) most of it is the
    east one: the two overlap in part, and only the shared part can be matched.
    """
    _check_lengths(doorway=doorway, width=width, depth=depth)
    check_range(depth, "depth", above=doorway, unit="m")
    y, jamb = depth / 2.0, doorway / 2.0
    east = np.array([[0.0, -y], [width, -y], [width, 0.4 * y], [0.6 * width, y], [0.0, y]])
    west = np.array([[-0.5 * width, y], [-0.5 * width, 0.7 * y], [-width, 0.7 * y], [-width, -y]])
    outline = polyline(np.vstack([east, west]), closed=True)
    wall = np.array([[[0.0, -y], [0.0, -jamb]], [[0.0, jamb], [0.0, y]]])
    shelf = _box(0.4 * width, -0.7 * y, 0.1 * width)
    return World(segments=np.concatenate([outline, wall, shelf]))


def _box(x: float, y: float, half: float) -> FloatArray:
    """An upright square around (x, y)."""
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    return polyline(np.array([x, y]) + corners, closed=True)


def _direction(angle: FloatArray) -> FloatArray:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _check_lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        check_range(value, name, above=0.0, at_most=1e4, unit="m")
