"""Chapter 1: motions of the plane, and the order in which they chain."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labkit import IcpParameters, Target, align, icp, se2
from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import Case, exercise
from labkit.simulation import Lidar, cast, room


@exercise("Motion between two poses")
def motion_between() -> Iterator[Case]:
    """For two poses whose headings differ from each other and from the world's."""
    places = {
        "a robot that bends left": ((2.0, 1.0, 0.5), (2.4, 1.3, 0.9)),
        "a robot that faces left and bends right": ((1.0, 0.0, 1.6), (1.1, 1.0, 1.4)),
    }
    for where, (older, newer) in places.items():
        T_w_k, T_w_k1 = se2.transform(*older), se2.transform(*newer)
        turn, step = newer[2] - older[2], T_w_k1[:2, 2] - T_w_k[:2, 2]
        yield Case(
            where,
            (T_w_k, T_w_k1),
            _motion(se2.rotation(-older[2]) @ step, turn),
            {
                "This is the same motion seen from the world, `T_w_k1 @ T_k_w`: in the names, "
                "equal letters must meet in the middle.": T_w_k1 @ se2.invert(T_w_k),
                "This is the way back, from the newer pose to the older one: it is the inverse "
                "of what is asked.": se2.relative(T_w_k1, T_w_k),
                "The translation is the difference of the positions in the *world*; the robot's "
                "frame at time k is turned against it.": _motion(step, turn),
            },
        )


@exercise("Turn about a point")
def turn_about() -> Iterator[Case]:
    """For a turn to the left and one to the right."""
    for c, theta in ((np.array([2.0, -1.0]), 0.7), (np.array([0.5, 3.0]), -2.0)):
        away = c - se2.rotation(theta) @ c
        yield Case(
            f"a turn by {theta:g} rad about ({c[0]:g}, {c[1]:g})",
            (c, theta),
            _motion(away, theta),
            {
                "This turns about the origin; bring `c` there first.": _motion(0 * c, theta),
                "This turns about −c: it moves the plane by `c` first, where it should bring `c` "
                "to the origin.": _motion(-away, theta),
                "This turns about the origin and then moves the plane by `c`; bring `c` to the "
                "origin first, and back afterwards.": _motion(c, theta),
            },
        )


@exercise("A gate and what it reports")
def match_and_count() -> Iterator[Case]:
    """On two looks into a room, with a tight gate and a wide one."""
    T = se2.transform(0.1, 0.05, 0.05)
    older, newer = (_look(turned, 181, seed) for seed, turned in enumerate((np.eye(3), T)))
    usual = icp(newer, older)
    for gate in (0.05, 2.0):
        result = icp(newer, older, parameters=IcpParameters(max_correspondence_distance=gate))
        yield Case(
            f"a gate of {gate:g} m",
            (newer, older, gate),
            (result.inlier_count, result.inlier_rmse),
            {
                "The gate does not reach the run: pass it as `max_correspondence_distance` of "
                "`labkit.IcpParameters`, and these as `parameters=`.": (
                    usual.inlier_count,
                    usual.inlier_rmse,
                ),
                "The first number is `fitness`, the share of the source that was kept; the count "
                "is `inlier_count`.": (result.fitness, result.inlier_rmse),
            }
            if gate < 1.0
            else {},
        )


@exercise("Turns harm the far points")
def wrong_near_and_far() -> Iterator[Case]:
    """For neighbours of which the far ones are wrong more often."""
    off = np.array([0.01, 0.30, 0.02, 0.05, 0.40, 0.20, 0.15, 0.03])
    ranges = np.array([1.0, 2.0, 1.5, 0.5, 7.0, 6.0, 5.0, 8.0])
    yield Case(
        "eight points, of which one near and three far have a wrong neighbour",
        (off, ranges),
        (0.25, 0.75),
        {
            "These are counts; a share is the mean of the mask.": (1, 3),
            "The shares are of all points; divide by the number of points in each half.": (
                0.125,
                0.375,
            ),
            "Near and far are exchanged.": (0.75, 0.25),
        },
    )


@exercise("Your first loop")
def icp_by_hand() -> Iterator[Case]:
    """In a room, for robots that turn by 0°, 90° and 180° between the scans."""
    older = _look(np.eye(3), 361, 0)
    for degrees in (0.0, 90.0, 180.0):
        T = se2.transform(0.35, 0.10, np.radians(degrees))
        newer = _look(T, 361, 1)
        guess = se2.transform(0.0, 0.0, np.radians(5.0)) @ T
        wrong = {
            "The step is composed on the wrong side, `T @ dT`. It was estimated in the target's "
            "frame, so it acts after `T`: `dT @ T`.": _loop(newer, older, guess, right=True),
        }
        unmoved = "The pairs are those of the unmoved points: move the source by `T` before you "
        unmoved += "look for its neighbours."
        yield Case(
            f"a robot that turns by {degrees:g}°",
            (newer, older, guess),
            T,
            {unmoved: _loop(newer, older, guess, still=True)} | (wrong if degrees else {}),
            tolerance=0.03,
        )


def _loop(
    p: FloatArray, q: FloatArray, T: FloatArray, *, right: bool = False, still: bool = False
) -> FloatArray:
    """Fifteen rounds that compose on the `right`, or never move the points."""
    target = Target(q)
    for _ in range(15):
        moved = p if still else se2.apply(T, p)
        dT = align(moved, target.points[target.search.query(moved)[0]])
        T = T @ dT if right else dT @ T
    return T


def _look(T_first_scanner: FloatArray, beams: int, seed: int) -> FloatArray:
    """What a scanner that sees all round finds in a room [m]."""
    scanner = Lidar(beam_count=beams, field_of_view=2 * np.pi)
    T_room_first = se2.transform(1.0, -0.5, 0.3)
    return cast(room(), T_room_first @ T_first_scanner, scanner, rng=seed).points


def _motion(t: FloatArray, theta: float) -> FloatArray:
    return se2.transform(t[0], t[1], theta)
