"""The pairs of scans that matchers are tried on, each with one guess and one reference.

Every set comes in two splits that share nothing: what is chosen by looking at `tuning`
is reported on `reporting`. The simulated sets, here, draw from other seeds; the recorded
ones, in `recorded`, are cut.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from labkit import Scan, apply, from_xytheta, transform
from labkit.simulation import (
    Lidar,
    World,
    cast,
    lesson_experiment,
    room,
    two_rooms,
)
from labkit.simulation.lesson import lesson_world, sample_scan
from labkit.support.arrays import FloatArray

SPLITS = ("tuning", "reporting")
GATE = 0.5  # m
SET_POINTS = 300_000  # of all targets of a set: three of 100,000
MAX_STEP, MAX_TURN = 0.3, math.radians(10.0)  # of a simulated robot between two scans
GUESS_STD = 0.05, 0.05, math.radians(2.0)  # how far off a simulated guess is: x, y, angle
RANGE_MAX = 30.0  # m, so that a room is always seen whole


@dataclass(frozen=True, eq=False, kw_only=True)
class Pair:
    """Two scans, the guess of ``T_target_source`` and what it should be, both (3, 3)."""

    source: Scan
    target: Scan
    T_init: FloatArray
    T_reference: FloatArray

    def fresh(self) -> Pair:
        """The same pair in new scans: what one match keeps with them serves no other."""
        return replace(self, source=replace(self.source), target=replace(self.target))


@dataclass(frozen=True, eq=False, kw_only=True)
class PairSet:
    """Pairs of one kind, matched under one gate [m].

    `reference` says how far to trust it, and `source` where data from outside come from.
    """

    name: str
    title: str
    reference: str
    gate: float
    pairs: tuple[Pair, ...]
    source: str = ""


def split_rng(split: str, stream: int) -> np.random.Generator:
    """Random numbers that no other split and no other stream uses."""
    return np.random.default_rng([SPLITS.index(split), stream])


def lesson_pairs(split: str, count: int) -> PairSet:
    """The lesson's scene with other points and other noise each time."""
    rng = split_rng(split, 0)
    lesson = lesson_experiment()
    pairs = []
    for _ in range(count):
        world = lesson_world(600, rng=rng)
        pairs.append(
            Pair(
                source=sample_scan(world, lesson.T_target_source, rng=rng),
                target=sample_scan(world, np.eye(3), rng=rng),
                T_init=lesson.T_init,
                T_reference=lesson.T_target_source,
            )
        )
    return PairSet(
        name="lesson",
        title="lesson's scene, 600 points",
        reference="exact",
        gate=GATE,
        pairs=tuple(pairs),
    )


def ray_pairs(
    split: str, count: int, beams: int, degrees: float = 360.0, *, ordered: bool = True
) -> PairSet:
    """Sweeps through rooms of random size, from random poses, with 1 cm of noise.

    The robot moves by up to 0.3 m and 10° between two of them, and the guess is off by
    5 cm along either axis and 2° (standard deviations). Without an order, the points of
    the very same sweeps are shuffled and lose their beams. Sets of long sweeps have fewer pairs.
    """
    lidar = Lidar(beam_count=beams, field_of_view=math.radians(degrees), range_max=RANGE_MAX)
    count = min(count, SET_POINTS // beams)
    pairs = tuple(islice(_swept(lidar, split_rng(split, beams)), count))
    if not ordered:
        pairs = tuple(_shuffled(pair, split_rng(split, 1)) for pair in pairs)
    return PairSet(
        name=f"rays-{beams}" + ("" if ordered else "-unordered"),
        title=f"ray-cast rooms, {beams:,} " + ("beams" if ordered else "shuffled points"),
        reference="exact",
        gate=GATE,
        pairs=pairs,
    )


def _swept(lidar: Lidar, rng: np.random.Generator) -> Iterator[Pair]:
    """Pair after pair, each from a place of its own."""
    while True:
        world, T_world_target = _place(rng)
        distance, bearing = rng.uniform(0.0, [MAX_STEP, 2.0 * math.pi])
        turn = rng.uniform(-MAX_TURN, MAX_TURN)
        T = transform(distance * math.cos(bearing), distance * math.sin(bearing), turn)
        yield Pair(
            source=cast(world, T_world_target @ T, lidar, rng=rng),
            target=cast(world, T_world_target, lidar, rng=rng),
            T_init=off(T, rng.normal(0.0, GUESS_STD)),
            T_reference=T,
        )


def _place(rng: np.random.Generator) -> tuple[World, FloatArray]:
    """A room of some size, and a pose ``T_world_scanner`` well away from its walls."""
    width, depth = rng.uniform([6.0, 5.0], [12.0, 9.0])
    kind = rng.integers(3)
    if kind == 0:
        world = room(width, depth)
    elif kind == 1:
        world = room_with_door(rng.uniform(0.0, math.pi / 2.0), width, depth)
    else:
        world = two_rooms(1.2, width, depth)
    x, y = rng.uniform([-0.18 * width, -0.15 * depth], [0.18 * width, 0.25 * depth])
    if kind == 2:
        x, y = x + 0.4 * width, abs(y)  # the middle of the east room, clear of its shelf
    return world, transform(x, y, rng.uniform(-math.pi, math.pi))


def room_with_door(opening: float, width: float = 8.0, depth: float = 6.0) -> World:
    """The room with a door in its south wall, `opening` [rad], and a passage behind it."""
    *walls, south = room(width, depth).segments[:9]
    pillar = room(width, depth).segments[9:]
    (west, y), (east, _) = south
    hinge, latch = np.array([0.0, y]), np.array([0.9, y])
    swung = apply(transform(0.0, 0.0, opening), [latch - hinge])[0]
    door = [[latch, [east, y]], [[west, y], hinge], [hinge, hinge + swung]]
    passage = [[[west, y - 1.5], [east, y - 1.5]]]
    return World(segments=np.concatenate([walls, pillar, door, passage]))


def _shuffled(pair: Pair, rng: np.random.Generator) -> Pair:
    source, target = (
        Scan.from_points(rng.permutation(scan.points)) for scan in (pair.source, pair.target)
    )
    return replace(pair, source=source, target=target)


def off(T: FloatArray, by: FloatArray) -> FloatArray:
    """`T` moved by (x, y) of its outer frame [m], and turned on the spot by an angle [rad]."""
    wrong = from_xytheta([0.0, 0.0, by[2]]) @ T
    wrong[:2, 2] = T[:2, 2] + by[:2]
    return wrong
