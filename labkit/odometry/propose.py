"""Candidates for the motion of a step: poses from which ICP is worth trying.

What a robot does next is expected: by its wheels, or, without wheels, to be like one of its last
motions. Where the match that begins there is poor, a search looks around the last pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from labkit.correspondences import MIN_PAIRS
from labkit.line_alignment import Information
from labkit.odometry.carried import stands
from labkit.odometry.sanity import SanityLimits
from labkit.odometry.search import STARTS, apart, search
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target

AT_REST = 0.02, math.radians(0.5)  # [m] and [rad]: wheels that tell less say that they stand
SAME_VIEW = 0.9  # share of points that lie as they lay, where the robot stands
WIDEN = 1.5  # times the longest of the last motions: the search reaches as far

WHEEL_SHIFT = 0.1  # [m]: usual error of wheels at rest; it grows with the motion,
DOUBLES_AFTER = 0.5, math.radians(20.0)  # by as much for so many metres or radians
WHEEL_TURN = math.radians(30.0)  # wheels tell a turn less well than a way
WHEEL_COST = 0.4  # of agreement, at most, for a motion unlike that of the wheels
MOTION_SHIFT, MOTION_TURN = 0.5, math.radians(20.0)  # from one motion to the next
MOTION_COST = 0.1  # of agreement, at most, for a motion unlike the last ones
RETURN = 0.3  # what going back to a refused match adds to its squared distance
AGE = 0.05  # what each step since a motion adds to its squared distance
SURE_ALONE = 0.8  # a score above which nothing else is tried, without wheels,
SURE_AT_REST, SURE_PER_METRE = 0.2, 0.7  # and beside wheels, more by their usual error [m]


class Expectation(NamedTuple):
    """Expected poses of the newest scan in the map's frame, and what another pose costs."""

    poses: FloatArray  # (K, 3, 3), the likeliest first
    handicap: FloatArray  # (J,): added to the squared distance from each of the first J poses,
    # by which a pose is judged; the others are only tried
    shift: float  # usual error [m]
    turn: float  # usual error [rad]
    most: float  # cost of a pose that is unlike all
    sure: float  # score of a match that needs no search

    def distance(self, T: FloatArray, free: FloatArray | None = None) -> FloatArray:
        """Squared distance u of T from each pose that it is judged by, over the usual error.

        The directions `free`, shape (F, 2), do not count.
        """
        poses = self.poses[: len(self.handicap)]
        offset = poses[:, :2, 2] - T[:2, 2]
        if free is not None:
            offset = offset - (offset @ free.T) @ free
        turn = T[:2, :2].T @ poses[:, :2, :2]
        turned = np.arctan2(turn[:, 1, 0], turn[:, 0, 0]) / self.turn
        moved = np.hypot(offset[:, 0], offset[:, 1]) / self.shift
        return np.asarray(moved**2 + turned**2 + self.handicap)

    def cost(self, T: FloatArray) -> float:
        """The last term of (5.3): c u / (1 + u), u to the nearest pose."""
        u = float(self.distance(T).min())
        return self.most * u / (1.0 + u)

    def fill_free(self, T: FloatArray, seen: Information) -> FloatArray:
        """The pose T, moved to the likeliest expected pose along the directions that are free."""
        shifts = seen.free.T[np.hypot(seen.free[0], seen.free[1]) > np.abs(seen.free[2])]
        free = shifts[:, :2] / np.hypot(shifts[:, :1], shifts[:, 1:2])
        likeliest = self.poses[int(self.distance(T, free).argmin())]
        moved = T.copy()
        moved[:2, 2] += ((likeliest[:2, 2] - T[:2, 2]) @ free.T) @ free
        return moved


def expect(
    T_map_last: FloatArray,
    prior: FloatArray | None,
    motions: FloatArray,
    T_last_refused: FloatArray | None = None,
) -> Expectation:
    """Expected poses after the pose `T_map_last`, and what others cost.

    By the wheels, (3,), or None; and by the last motions (K, 3), the newest first. If the last
    match was refused, the wheels may go on from `T_last_refused`, where it ended, too.
    """
    if prior is None:
        poses = T_map_last @ from_xytheta(motions)
        handicap = np.asarray(AGE * np.arange(len(poses)), np.float64)
        return Expectation(poses, handicap, MOTION_SHIFT, MOTION_TURN, MOTION_COST, SURE_ALONE)
    x, y, turn = prior.tolist()
    growth = 1.0 + math.hypot(x, y) / DOUBLES_AFTER[0] + abs(turn) / DOUBLES_AFTER[1]
    T_wheels = from_xytheta(prior)
    starts = [np.eye(3)] if T_last_refused is None else [np.eye(3), T_last_refused]
    poses = T_map_last @ np.concatenate([np.array(starts) @ T_wheels, from_xytheta(motions)])
    handicap = np.asarray(RETURN * np.arange(len(starts)), np.float64)
    shift = WHEEL_SHIFT * growth
    sure = min(SURE_ALONE, SURE_AT_REST + SURE_PER_METRE * shift)
    return Expectation(poses, handicap, shift, WHEEL_TURN, WHEEL_COST, sure)


def believable_wheels(
    prior: FloatArray | None, scan: Scan, before: Target | None
) -> FloatArray | None:
    """The prior, or None if it says that the robot stands while the scan has moved."""
    if prior is None or before is None or len(scan) < MIN_PAIRS:
        return prior
    moved, turned = step_length(np.eye(3), from_xytheta(prior))
    if moved > AT_REST[0] or turned > AT_REST[1]:
        return prior
    return prior if np.mean(stands(scan, before)) >= SAME_VIEW else None


def propose(
    scan: Scan, target: Target, T_map_last: FloatArray, expected: Expectation, limits: SanityLimits
) -> Iterator[list[FloatArray]]:
    """Candidates in rounds, each tried only if no match of those before is sure.

    The most expected pose; then the other expected ones, and those that a search finds. The search
    reaches as far as the limits, or `WIDEN` times the longest expected motion.
    """
    yield [expected.poses[0]]
    motions = [step_length(T_map_last, T) for T in expected.poses]
    shift = max(limits.max_translation, *(WIDEN * moved for moved, _ in motions))
    turn = max(limits.max_rotation, *(WIDEN * turned for _, turned in motions))
    others = apart(expected.poses, STARTS)[1:]
    yield [*others, *search(scan, target, T_map_last, (shift, min(turn, math.pi)))]
