"""The best of several matches, or none."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labkit.odometry.match import Match
from labkit.odometry.search import alike

MIN_SCORE = 0.25  # a match that scores less tells less than the wheels
MIN_SCORE_ALONE = 0.1  # without wheels: one that scores less tells less than the last motion
WATCHED = 40  # steps whose best scores tell whether matches are to be believed beside wheels
GOOD_MEAN_SCORE = 0.6  # of these steps: below it a match has to score more,
STEEPNESS = 3.0  # by so much for each point that the mean is lower
USUAL_SCORE, USUAL_STEPS = 0.9, 10  # a run begins as if so many steps had scored so much
TIE = 0.01  # scores that differ by less are equal: the first tried wins


def choose(matches: Sequence[Match]) -> tuple[Match, float]:
    """The match of the highest score, and its margin.

    The margin is by how much its agreement exceeds that of the best match that ended elsewhere;
    NaN where none did. Whether the best is believed, `MIN_SCORE` or `MIN_SCORE_ALONE` says.
    """
    highest = max(each.score for each in matches)
    best = next(each for each in matches if each.score >= highest - TIE)
    elsewhere = [
        each.agreement for each in matches if each.score > MIN_SCORE and not alike(best.T, each.T)
    ]
    return best, best.agreement - max(elsewhere, default=math.nan)


def min_score(scores: Sequence[float]) -> float:
    """Score that a match must exceed to be believed beside wheels, by the last best `scores`.

    Where something moves or hides the view, all scores are low, and a wrong match scores as well as
    a right one. Then the wheels lead: their errors undo one another in part over many steps in a
    row, and among single matches they do not.
    """
    total = sum(scores) + USUAL_STEPS * USUAL_SCORE
    mean = total / (len(scores) + USUAL_STEPS)
    return MIN_SCORE + STEEPNESS * max(0.0, GOOD_MEAN_SCORE - mean)
