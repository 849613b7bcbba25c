"""A world for the scanner: walls as line segments, and objects that move between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.support.arrays import (
    FloatArray,
    as_finite,
    as_floats,
    as_numbers,
    check_count,
    check_range,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class MovingObject:
    """Segments that move as one body, straight on and without turning.

    They are (M, 2, 2) end points [m] in the world frame at time 0; `velocity` is (2,) [m/s].
    """

    segments: FloatArray
    velocity: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", as_segments(self.segments, "segments"))
        object.__setattr__(self, "velocity", as_numbers(self.velocity, "velocity", "vx, vy [m/s]"))

    def at(self, stamp: float) -> FloatArray:
        """The segments [m] at time `stamp` [s], shape (M, 2, 2)."""
        return self.segments + stamp * self.velocity


@dataclass(frozen=True, eq=False, kw_only=True)
class World:
    """Walls that stay, (M, 2, 2) pairs of end points [m], and objects that move."""

    segments: FloatArray
    moving: tuple[MovingObject, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", as_segments(self.segments, "segments"))

    def at(self, stamp: float) -> FloatArray:
        """All segments [m] at time `stamp` [s], shape (M, 2, 2)."""
        check_range(stamp, "stamp", at_least=-1e12, at_most=1e12, unit="s")
        return np.concatenate([self.segments, *(thing.at(stamp) for thing in self.moving)])


def polyline(vertices: ArrayLike, *, closed: bool = False) -> FloatArray:
    """Segments from each of the (N, 2) vertices [m] to the next, shape (N − 1, 2, 2).

    A closed one has N segments: the last leads back to the first vertex.
    """
    v = np.asarray(vertices, dtype=np.float64)
    if closed:
        v = np.vstack([v, v[:1]])
    return np.stack([v[:-1], v[1:]], axis=1)


def circle(center: ArrayLike, radius: float, sides: int = 16) -> FloatArray:
    """A round thing as a polygon inscribed in its circle [m], shape (sides, 2, 2)."""
    check_count(sides, "sides", at_least=3)
    turn = 2.0 * np.pi * np.arange(sides) / sides
    rim = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return polyline(np.asarray(center, dtype=np.float64) + rim, closed=True)


def as_segments(segments: ArrayLike, name: str) -> FloatArray:
    """Check line segments: M pairs of end points (x, y) [m], shape (M, 2, 2), finite."""
    return as_finite(as_floats(segments, name, "give end points in metres", ("M", 2, 2)), name)
