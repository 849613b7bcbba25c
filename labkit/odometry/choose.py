"""The best of several matches, and whether it is believed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labkit.odometry.match import Match
from labkit.odometry.search import alike

MIN_AGREEMENT_BESIDE_WHEELS = 0.3  # a match that agrees less tells less than the wheels
MIN_SCORE_ALONE = 0.1  # without wheels: one that scores less tells less than the last motion
WATCHED = 40  # steps whose best scores tell whether matches are to be believed beside wheels
GOOD_MEAN_SCORE = 0.68  # of these steps: below it a match beside wheels has to score
STEEPNESS = 3.5  # so much for each point that the mean is lower
USUAL_SCORE, USUAL_STEPS = 0.9, 10  # a run begins as if so many steps had scored so much
TIE = 0.01  # scores that differ by less are equal: the first tried wins


def choose(matches: Sequence[Match]) -> tuple[Match, float]:
    """The match of the highest score, and its margin.

    The margin is by how much its agreement exceeds that of the best match that ended elsewhere;
    NaN where none did that scores more than 0.
    """
    highest = max(each.score for each in matches)
    best = next(each for each in matches if each.score >= highest - TIE)
    elsewhere = [
        each.agreement for each in matches if each.score > 0.0 and not alike(best.T, each.T)
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
    return STEEPNESS * max(0.0, GOOD_MEAN_SCORE - mean)
