"""Candidates for the motion of a step: poses from which ICP is worth trying.

What a robot does next is expected: by its wheels, or, without wheels, to be like one of its last
motions. Where the match that begins there is poor, a search looks around the wheels' pose, or
around the last one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from labkit.line_alignment import Information
from labkit.odometry.sanity import SanityLimits
from labkit.odometry.search import MAX_STARTS, drop_duplicates, search
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target

SEARCH_FACTOR = 1.5  # reach of a search over the longest of the last motions, or the wheels' turn
WHEEL_SEARCH_FACTOR = 3.0  # the same beside wheels, over the usual error of their way

WHEEL_SHIFT_ERROR = 0.1  # [m]: usual error of wheels at rest
DOUBLING_SHIFT = 0.5  # [m]: so long a motion adds the error at rest once more,
DOUBLING_TURN = math.radians(20.0)  # [rad]: and so does a turn this large
WHEEL_TURN_ERROR = math.radians(30.0)  # [rad]: wheels tell a turn less well than a shift
WHEEL_COST = 0.4  # of agreement, at most, for a motion unlike that of the wheels
MOTION_SHIFT_CHANGE = 0.5  # [m]: usual change from one motion to the next
MOTION_TURN_CHANGE = math.radians(20.0)  # [rad]: the same, of the turn
MOTION_COST = 0.1  # of agreement, at most, for a motion unlike the last ones
RETURN_HANDICAP = 0.3  # of the pose that goes on from a refused match
AGE_HANDICAP = 0.05  # of a past motion, for each step since
SURE_SCORE_ALONE = 0.8  # without wheels: a match that scores as much needs no search
SURE_SCORE_AT_REST = 0.2  # the same beside wheels, if they had no error
SURE_SCORE_SLOPE = 0.7  # [1/m]: what each metre of their usual error adds


class Expectation(NamedTuple):
    """Expected poses of the newest scan in the map's frame, and what another pose costs."""

    poses: FloatArray  # (K, 3, 3), the likeliest first
    handicap: FloatArray  # (J,): added to the squared distance from each of the first J poses,
    # by which a pose is judged; the others are only tried
    shift: float  # usual error [m]
    turn: float  # usual error [rad]
    max_cost: float  # of a pose that is unlike all
    sure_score: float  # of a match that needs no search
    T_search: FloatArray  # (3, 3): the pose around which a search looks
    search_shift: float  # how far it looks at least [m]
    search_turn: float  # the same, to either side [rad]

    def distance(self, T: FloatArray, free: FloatArray | None = None) -> FloatArray:
        """Squared distance u of T from each pose that it is judged by, over the usual error.

        The directions `free`, shape (F, 2), do not count.
        """
        poses = self.poses[: len(self.handicap)]
        offset = poses[:, :2, 2] - T[:2, 2]
        if free is not None:
            offset = offset - (offset @ free.T) @ free
        R = T[:2, :2].T @ poses[:, :2, :2]
        turn = np.arctan2(R[:, 1, 0], R[:, 0, 0]) / self.turn
        shift = np.hypot(offset[:, 0], offset[:, 1]) / self.shift
        return np.asarray(shift**2 + turn**2 + self.handicap)

    def cost(self, T: FloatArray) -> float:
        """The last term of (5.3): c u / (1 + u), u to the nearest pose."""
        u = float(self.distance(T).min())
        return self.max_cost * u / (1.0 + u)

    def fill_free(self, T: FloatArray, observability: Information) -> FloatArray:
        """The pose T, moved to the likeliest expected pose along the directions that are free."""
        free = free_shifts(observability)
        likeliest = self.poses[int(self.distance(T, free).argmin())]
        offset = likeliest[:2, 2] - T[:2, 2]
        T_filled = T.copy()
        T_filled[:2, 2] += (offset @ free.T) @ free
        return T_filled


def free_shifts(observability: Information) -> FloatArray:
    """Unit vectors along the free directions that shift more than they turn, shape (F, 2)."""
    shifts = observability.free[:2].T
    turns = np.abs(observability.free[2])
    lengths = np.hypot(shifts[:, 0], shifts[:, 1])
    is_shift = lengths > turns
    return np.asarray(shifts[is_shift] / lengths[is_shift, None])


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
        return Expectation(
            poses=poses,
            handicap=np.asarray(AGE_HANDICAP * np.arange(len(poses)), np.float64),
            shift=MOTION_SHIFT_CHANGE,
            turn=MOTION_TURN_CHANGE,
            max_cost=MOTION_COST,
            sure_score=SURE_SCORE_ALONE,
            T_search=T_map_last,
            search_shift=SEARCH_FACTOR * float(np.hypot(motions[:, 0], motions[:, 1]).max()),
            search_turn=SEARCH_FACTOR * float(np.abs(motions[:, 2]).max()),
        )
    x, y, turn = prior.tolist()
    growth = 1.0 + math.hypot(x, y) / DOUBLING_SHIFT + abs(turn) / DOUBLING_TURN
    shift_error = WHEEL_SHIFT_ERROR * growth
    starts = [np.eye(3)]
    if T_last_refused is not None:
        starts.append(T_last_refused)
    by_wheels = np.array(starts) @ from_xytheta(prior)
    poses = T_map_last @ np.concatenate([by_wheels, from_xytheta(motions)])
    return Expectation(
        poses=poses,
        handicap=np.asarray(RETURN_HANDICAP * np.arange(len(starts)), np.float64),
        shift=shift_error,
        turn=WHEEL_TURN_ERROR,
        max_cost=WHEEL_COST,
        sure_score=min(SURE_SCORE_ALONE, SURE_SCORE_AT_REST + SURE_SCORE_SLOPE * shift_error),
        T_search=poses[0],
        search_shift=WHEEL_SEARCH_FACTOR * shift_error,
        search_turn=SEARCH_FACTOR * abs(turn),
    )


def propose(
    scan: Scan, target: Target, expected: Expectation, limits: SanityLimits
) -> Iterator[list[FloatArray]]:
    """Candidates in rounds, each tried only if no match of those before is sure.

    The most expected pose; then the other expected ones, and those that a search finds, as far as
    the limits of a motion reach, or farther if that is expected.
    """
    yield [expected.poses[0]]
    max_shift = max(limits.max_translation, expected.search_shift)
    max_turn = min(max(limits.max_rotation, expected.search_turn), math.pi)
    others = drop_duplicates(expected.poses, MAX_STARTS)[1:]
    yield [*others, *search(scan, target, expected.T_search, (max_shift, max_turn))]
