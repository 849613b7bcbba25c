"""The best of several matches, and whether it is believed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labkit.odometry.match import Match
from labkit.odometry.search import is_same_pose

MIN_AGREEMENT_BESIDE_WHEELS = 0.3  # a match that agrees less tells less than the wheels
MIN_SCORE_ALONE = 0.1  # without wheels: a match that scores less tells less than the last motion
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


def is_believed(best: Match, scores: Sequence[float] | None) -> bool:
    """True if a match tells more than the wheels, whose last best `scores` are known.

    Without wheels, `scores` None, it only has to tell more than the last motion.
    """
    if scores is None:
        return best.score > MIN_SCORE_ALONE
    return best.score > min_score(scores) and best.agreement > MIN_AGREEMENT_BESIDE_WHEELS


def min_score(scores: Sequence[float]) -> float:
    """Score that a match must exceed to be believed beside wheels, by the last best `scores`.

    Where something moves or hides the view, all scores are low, and a wrong match scores as well as
    a right one. Then the wheels lead: their errors undo one another in part over many steps in a
    row, and among single matches they do not.
    """
    total = sum(scores) + USUAL_STEPS * USUAL_SCORE
    mean = total / (len(scores) + USUAL_STEPS)
    return MIN_SCORE_SLOPE * max(0.0, GOOD_MEAN_SCORE - mean)
