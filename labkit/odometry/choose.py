"""The best of several matches, and the score from which it is believed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labkit.odometry.match import Match
from labkit.odometry.search import is_same_pose

MIN_SCORE = 0.1  # a match that scores less tells less than the wheels, or than the last motion
SCORE_HISTORY = 40  # steps: their best scores tell whether to believe matches beside wheels
GOOD_MEAN_SCORE = 0.68  # of these steps: below it a match beside wheels needs a score
MIN_SCORE_SLOPE = 3.5  # this score over what the mean lacks
USUAL_STEPS = 10  # steps that stand in for the history when a run begins
USUAL_SCORE = 0.9  # of each of these steps
TIE = 0.01  # scores that differ by less are equal: the match that was tried first wins


def choose(matches: Sequence[Match]) -> tuple[Match, float]:
    """The match of the highest score, and its margin.

    The margin is by how much its agreement exceeds that of the best match that ended elsewhere;
    NaN where none did that scores more than 0.
    """
    highest = max(match.score for match in matches)
    best = next(match for match in matches if match.score >= highest - TIE)
    elsewhere = [
        match.agreement
        for match in matches
        if match.score > 0.0 and not is_same_pose(best.T, match.T)
    ]
    return best, best.agreement - max(elsewhere, default=math.nan)


def min_score(scores: Sequence[float]) -> float:
    """Score that a match must exceed to be believed, by the last best `scores` beside wheels.

    Where something moves or hides the view, all scores are low, and a wrong match scores as well as
    a right one. Then the wheels lead: their errors undo one another in part over many steps in a
    row, and among single matches they do not.
    """
    total = sum(scores) + USUAL_STEPS * USUAL_SCORE
    mean = total / (len(scores) + USUAL_STEPS)
    return max(MIN_SCORE, MIN_SCORE_SLOPE * (GOOD_MEAN_SCORE - mean))
