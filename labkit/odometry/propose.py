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
from labkit.odometry.constants import (
    MAX_STARTS,
    MOTION_COST,
    SEARCH_FACTOR,
    SURE_SCORE,
    SURE_SCORE_SLOPE,
    UNUSUAL,
    USUAL_CHANGE,
    WHEEL_COST,
)
from labkit.odometry.record import Scales
from labkit.odometry.scales import growth_of
from labkit.odometry.search import drop_duplicates, search
from labkit.scan import Scan
from labkit.se2 import from_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target


class Expectation(NamedTuple):
    """Expected poses of the newest scan in the map's frame, and what another pose costs."""

    poses: FloatArray  # (K, 3, 3), the likeliest first
    first_count: int  # of them: those that are tried in the first round
    judged_count: int  # of them: those by which a pose is judged; the others are only tried
    shift: float  # to either side: half of the window in which a match is expected [m]
    turn: float  # the same [rad]
    cost_scale: float  # c, of agreement: what a pose so unlike all costs that u = 1.7
    sure_score: float  # of a match that needs no search
    T_search: FloatArray  # (3, 3): the pose around which a search looks
    search_shift: float  # how far it looks at least [m]
    search_turn: float  # the same, to either side [rad]
    max_shift: float = math.inf  # the farthest that wheels can err, in no more than one step [m]
    max_turn: float = math.inf  # the same [rad]

    def offsets(
        self, T: FloatArray, free: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """How far T lies from each pose that it is judged by, [m], and is turned [rad].

        The directions `free`, shape (F, 2), do not count.
        """
        poses = self.poses[: self.judged_count]
        offset = poses[:, :2, 2] - T[:2, 2]
        if free is not None:
            offset = offset - (offset @ free.T) @ free
        R = T[:2, :2].T @ poses[:, :2, :2]
        return np.hypot(offset[:, 0], offset[:, 1]), np.arctan2(R[:, 1, 0], R[:, 0, 0])

    def distance(self, T: FloatArray, free: FloatArray | None = None) -> FloatArray:
        """Squared distance u of T from each pose that it is judged by, over the window."""
        shift, turn = self.offsets(T, free)
        return np.asarray((shift / self.shift) ** 2 + (turn / self.turn) ** 2)

    def allows(self, T: FloatArray) -> bool:
        """True if the wheels can have erred so much; NaN is not allowed."""
        shift, turn = self.offsets(T)
        return bool(((shift <= self.max_shift) & (abs(turn) <= self.max_turn)).any())

    def holds(self, T: FloatArray) -> bool:
        """True if a pose lies in the window around the likeliest one; NaN does not."""
        return bool(self.distance(T)[0] <= 1.0)

    def goes_on(self, T: FloatArray) -> bool:
        """True if a pose lies in the window around the one that goes on from a refused match."""
        return bool((self.distance(T)[1:] <= 1.0).any())

    def cost(self, T: FloatArray) -> float:
        """The last term of (5.3): c log(1 + u), u to the nearest pose; Cauchy's heavy tails."""
        return self.cost_scale * math.log1p(float(self.distance(T).min()))

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
    scales: Scales,
    T_last_refused: FloatArray | None = None,
) -> Expectation:
    """Expected poses after the pose `T_map_last`, and what others cost.

    By the wheels, (3,), or None; and by motions (K, 3): that of the last step, then those that were
    measured, the newest first. Where none was measured no match is sure, so that a search looks
    around. If the last match was refused, the wheels may go on from `T_last_refused`, where it
    ended, too: however well the scan fits at the wheels, that is tried in the first round.
    """
    if prior is None:
        poses = T_map_last @ from_xytheta(motions)
        has_measured = len(motions) > 1
        return Expectation(
            poses=poses,
            first_count=1,
            judged_count=len(poses),
            shift=USUAL_CHANGE[0],
            turn=USUAL_CHANGE[1],
            cost_scale=MOTION_COST,
            sure_score=SURE_SCORE if has_measured else math.inf,
            T_search=T_map_last,
            search_shift=SEARCH_FACTOR * float(np.hypot(motions[:, 0], motions[:, 1]).max()),
            search_turn=SEARCH_FACTOR * float(np.abs(motions[:, 2]).max()),
        )
    growth = growth_of(prior)
    shift = UNUSUAL * growth * scales.wheel_shift
    turn = UNUSUAL * growth * scales.wheel_turn
    starts = [np.eye(3)]
    if T_last_refused is not None:
        starts.append(T_last_refused)
    by_wheels = np.array(starts) @ from_xytheta(prior)
    poses = T_map_last @ np.concatenate([by_wheels, from_xytheta(motions)])
    return Expectation(
        poses=poses,
        first_count=len(starts),
        judged_count=len(starts),
        shift=shift,
        turn=turn,
        cost_scale=WHEEL_COST,
        sure_score=min(SURE_SCORE, SURE_SCORE_SLOPE * shift),
        T_search=poses[0],
        search_shift=UNUSUAL * shift,
        search_turn=max(turn, SEARCH_FACTOR * abs(float(prior[2]))),
        max_shift=scales.max_shift,
        max_turn=scales.max_turn,
    )


def propose(
    scan: Scan, target: Target, expected: Expectation, reach: FloatArray
) -> Iterator[list[FloatArray]]:
    """Candidates in rounds, each tried only if no match of those before is sure.

    The most expected poses; then the other expected ones, and those that a search finds within
    `reach`, [m] and [rad], or farther if that is expected.
    """
    first = drop_duplicates(expected.poses[: expected.first_count], MAX_STARTS)
    yield first
    max_shift = max(reach[0], expected.search_shift)
    max_turn = min(max(reach[1], expected.search_turn), math.pi)
    others = drop_duplicates(expected.poses, MAX_STARTS)[len(first) :]
    yield [*others, *search(scan, target, expected.T_search, (max_shift, max_turn))]
