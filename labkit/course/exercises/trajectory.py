"""Chapter 5: from steps to a path, and from scan to key scan."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labkit import se2
from labkit.course.exercises.exercise import Case, exercise


@exercise("What one wrong turn costs")
def lever_error() -> Iterator[Case]:
    """For turns large enough to tell the chord from its approximation, to either side."""
    for distance, turn in ((100.0, 1.0), (40.0, -2.0)):
        right = math.sqrt(2.0 * distance**2 * (1.0 - math.cos(turn)))
        mistakes = {
            "This is the length of the arc, D·|ε|: right for small turns only. The pose moves "
            "along the chord.": distance * abs(turn),
            "This is the part at a right angle to the old direction, D·sin|ε|; the pose comes "
            "nearer along that direction as well.": distance * math.sin(abs(turn)),
        }
        if turn < 0.0:
            mistakes["A distance is never negative: take |ε|."] = -right
        yield Case(f"{turn:g} rad at {distance:g} m", (distance, turn), right, mistakes)


@exercise("The path as its first pose sees it")
def seen_from_first() -> Iterator[Case]:
    """For paths whose first heading is neither zero nor small."""
    paths = {
        "a path that bends left": [(2.0, 1.0, 0.8), (2.5, 1.6, 1.1), (2.6, 2.4, 1.9)],
        "a path across ±180°": [(-1.0, 3.0, 2.6), (-1.9, 3.2, 3.0), (-2.8, 3.0, -2.9)],
    }
    for where, rows in paths.items():
        poses = np.array(rows)
        away, heading = poses[:, :2] - poses[0, :2], poses[0, 2]
        turned = se2.wrap(poses[:, 2] - heading)
        yield Case(
            where,
            (poses,),
            np.column_stack([away @ se2.rotation(heading), turned]),
            {
                "The positions are shifted to the first one, and still measured along the world's "
                "axes: turn them by the first heading.": np.column_stack([away, turned]),
                "The positions are turned the wrong way: from the world into the robot's frame it "
                "is R(−ψ).": np.column_stack([away @ se2.rotation(-heading), turned]),
                "The positions are right; the headings are still those in the world.": (
                    np.column_stack([away @ se2.rotation(heading), poses[:, 2]])
                ),
            },
        )


@exercise("The guess from the key scan")
def guess_from_key() -> Iterator[Case]:
    """For a robot that has turned since the key scan, so that the order counts."""
    for before, step in (
        ((0.8, 0.3, 0.9), (0.5, 0.05, 0.2)),
        ((-0.2, 1.0, 2.4), (0.4, 0.0, -0.3)),
    ):
        T_key_before, T_step = se2.transform(*before), se2.transform(*step)
        yield Case(
            f"a robot at {before} and a step of {step}",
            (T_key_before, np.array(step)),
            se2.from_xytheta(_chained(before, step)),
            {
                "The step is put on the left: it is measured by the robot, so it acts before the "
                "pose, on its right.": T_step @ T_key_before,
                "This is where the robot was; the step of the wheels is missing.": T_key_before,
                "This goes from the scan before to the key scan and then on: the pose is the other "
                "way round.": se2.invert(T_key_before) @ T_step,
            },
        )


@exercise("How far the key scan is used up")
def key_used_up() -> Iterator[Case]:
    """For robots that use up more of the way or more of the turn, to either side."""
    reach, most = 2.0, math.radians(15.0)
    for where, (x, y, turn) in {
        "a robot that is ahead and aside": (0.9, 0.8, 0.05),
        "a robot that has backed": (-2.6, 0.3, 0.1),
        "a robot that has turned left": (0.5, 0.1, math.radians(12.0)),
        "a robot that has turned right": (0.6, -0.1, -math.radians(20.0)),
    }.items():
        way, angle = math.sqrt(x * x + y * y) / reach, math.degrees(turn) / 15.0
        right = max(way, angle, -angle)
        answers = {
            "A robot that turns to the right has a negative angle: take |Δψ|.": max(way, angle),
            "Only Δx is looked at; a robot moves aside and backwards, too.": (
                max(x / reach, abs(angle))
            ),
            "Each limit is enough alone: take the larger share, not the sum.": way + abs(angle),
        }
        wrong = {says: each for says, each in answers.items() if abs(each - right) > 1e-9}
        yield Case(where, (se2.transform(x, y, turn), reach, most), right, wrong)


def _chained(
    pose: tuple[float, float, float], step: tuple[float, float, float]
) -> tuple[float, float, float]:
    x, y, heading = pose
    dx, dy, turn = step
    c, s = math.cos(heading), math.sin(heading)
    return x + c * dx - s * dy, y + s * dx + c * dy, heading + turn
