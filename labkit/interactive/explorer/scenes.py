"""Pairs of scans to explore: each shows one thing that helps or harms the match."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.logs import Log, read_log
from labkit.scan import Scan
from labkit.se2 import from_xytheta, relative, transform
from labkit.simulation import (
    Lidar,
    MovingObject,
    World,
    cast,
    corridor,
    lesson_experiment,
    room,
    two_rooms,
)
from labkit.support.arrays import FloatArray, as_transform, check_count, check_kind
from labkit.support.errors import InvalidPointsError

SCENE_LIDAR = Lidar(beam_count=361, field_of_view=2.0 * math.pi)


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Two scans of 3 points or more, the guess `T_init`, and where known the answer.

    `T_reference` is the answer: the "truth" of a simulation or the "reference" of a recording.
    `T_worse` is a guess that `align_by_hand` offers beside `T_init`: from there ICP gets stuck.
    """

    name: str
    source: Scan
    target: Scan
    T_init: FloatArray
    T_reference: FloatArray | None = None
    reference: str = "truth"
    T_worse: FloatArray | None = None

    def __post_init__(self) -> None:
        check_kind(self.name, "name", str)
        check_kind(self.source, "source", Scan)
        check_kind(self.target, "target", Scan)
        object.__setattr__(self, "T_init", as_transform(self.T_init, "T_init"))
        for name in ("T_reference", "T_worse"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, as_transform(getattr(self, name), name))
        fewest = min(len(self.source), len(self.target))
        if fewest < MIN_PAIRS:
            raise InvalidPointsError(
                f"each scan of scene {self.name!r} needs {MIN_PAIRS} points, got {fewest}"
            )


def default_scenes() -> list[Scene]:
    """Three pairs of Killian Court, the lesson's experiment, and five simulated pairs."""
    lesson = lesson_experiment()
    return [
        killian_scene(101, "a room"),
        Scene(
            name="The lesson's experiment",
            source=lesson.source,
            target=lesson.target,
            T_init=lesson.T_init,
            T_reference=lesson.T_target_source,
        ),
        _simulate_scene("Room", room(), (0.30, 0.10, 8.0)),
        _simulate_scene("Turn on the spot", room(), (0.0, 0.0, 20.0)),
        _simulate_scene("Corridor", corridor(), (0.50, 0.05, 2.0), (0.0, 0.0, 0.0)),
        _simulate_scene("A truck drives ahead", _room_with_truck(), (0.20, 0.05, 3.0)),
        _simulate_scene(
            "Two rooms", two_rooms(), (2.0, 0.1, 4.0), (1.8, 0.0, 0.0), (-1.5, 0.0, 0.0)
        ),
        killian_scene(2600, "a corridor"),
        killian_scene(3244, "a turn of 30°"),
    ]


def killian_scene(scan: int, note: str = "") -> Scene:
    """Scans `scan` − 1 and `scan` of Killian Court, from no guess."""
    log = _killian()
    check_count(scan, "scan", at_least=1, at_most=len(log) - 1)
    assert log.reference is not None
    T_world_target, T_world_source = from_xytheta(log.reference[scan - 1 : scan + 1])
    return Scene(
        name=f"Killian Court {scan}" + (f": {note}" if note else ""),
        source=log.scans[scan],
        target=log.scans[scan - 1],
        T_init=np.eye(3),
        T_reference=relative(T_world_target, T_world_source),
        reference="reference",
    )


@cache
def _killian() -> Log:
    return read_log("killian")


Motion = tuple[float, float, float]  # [m], [m], [°]
NO_MOTION: Motion = (0.0, 0.0, 0.0)


def _simulate_scene(
    name: str, world: World, motion: Motion, guess: Motion = NO_MOTION, start: Motion = NO_MOTION
) -> Scene:
    """Take two scans of a world, half a second apart, with a scanner that sees all round."""
    rng = np.random.default_rng(4)
    T_world_target = _to_transform(start)
    T_target_source = _to_transform(motion)
    target = cast(world, T_world_target, SCENE_LIDAR, rng=rng, stamp=0.0)
    source = cast(world, T_world_target @ T_target_source, SCENE_LIDAR, rng=rng, stamp=0.5)
    return Scene(
        name=name,
        source=source,
        target=target,
        T_init=_to_transform(guess),
        T_reference=T_target_source,
    )


def _to_transform(motion: Motion) -> FloatArray:
    x, y, degrees = motion
    return transform(x, y, math.radians(degrees))


def _room_with_truck() -> World:
    """The room, and in it the back of a truck that drives on: 29 % of what is seen."""
    back = np.array([[[1.2, -1.6], [1.2, 1.6]]])
    truck = MovingObject(segments=back, velocity=np.array([1.2, 0.0]))
    return World(segments=room().segments, moving=(truck,))
