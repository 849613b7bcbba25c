"""The basin of convergence: from how far away a matcher still finds the answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from tqdm import tqdm

from data import Pair, PairSet, off
from labkit import Target, icp
from labkit.evaluation.pose_errors import pose_differences
from matchers import lab, lesson
from peers import Matcher
from scoring import found
from timing import attempt

STARTS = {"0.3 m, 10°": (0.3, math.radians(10.0)), "0.5 m, 20°": (0.5, math.radians(20.0))}
DRAWS = 3  # starts of each pair: fewer leave two percent to luck
SEED = 3
STRUCTURE = 0.05  # smallest information of a pair that counts, see `labkit.line_alignment`
AT_REST = 1e-5  # [m] and [rad]: a step this short counts as none
AGREEMENT = 0.03, math.radians(0.5)  # two metrics that differ by more leave the answer open


def basin(matchers: Sequence[Matcher], pair_set: PairSet, count: int) -> dict[str, Any]:
    """The share of pairs with enough structure that each matcher solves from each start.

    A pair has it where the residuals of its reference answer any motion with at least
    `STRUCTURE` of what they answer straight motion into a wall. Every start is off by
    exactly the same distance and angle, in a random direction; all matchers get the same
    pairs and the same starts.
    """
    answers = (settled(pair, pair_set.gate) for pair in pair_set.pairs)
    solvable = list(islice((pair for pair in answers if pair is not None), count))
    able = [matcher for matcher in matchers if matcher.share(solvable)]
    shares: dict[str, dict[str, float]] = {matcher.name: {} for matcher in able}
    for label, (distance, angle) in STARTS.items():
        rng = np.random.default_rng(SEED)
        pairs = [_disturbed(pair, distance, angle, rng) for pair in solvable for _ in range(DRAWS)]
        for matcher in tqdm(able, f"{pair_set.name} from {label}", leave=False, disable=None):
            tried = matcher.share(pairs)
            attempts = [attempt(matcher, pair, pair_set.gate) for pair in tried]
            shares[matcher.name][label] = float(found(tried, attempts).mean())
    return {"title": pair_set.title, "pairs": len(solvable), "shares": shares}


def settled(pair: Pair, gate: float) -> Pair | None:
    """The pair with a reference that can be returned to, None where there is none.

    Recorded references are off by as much as what counts as found. So the reference is
    refined: the answer is where point-to-line comes to rest from there, provided that the
    surface fixes the motion in every direction and the lesson's point-to-point agrees.
    """
    target = Target(pair.target)
    parameters = replace(
        lab.POINT_TO_LINE,
        max_correspondence_distance=gate,
        translation_tolerance=AT_REST,
        rotation_tolerance=AT_REST,
    )
    result = icp(pair.source, target, pair.T_reference, parameters)
    seen = result.observability
    if seen is None or seen.values[0] < STRUCTURE:
        return None
    T, _ = lesson.lesson(pair.source.points, pair.target.points, pair.T_reference, gate)
    translation, rotation = pose_differences(T[None], result.T_target_source[None])
    if translation[0] > AGREEMENT[0] or rotation[0] > AGREEMENT[1]:
        return None
    return replace(pair, T_reference=result.T_target_source)


def _disturbed(pair: Pair, distance: float, angle: float, rng: np.random.Generator) -> Pair:
    bearing, side = rng.uniform(0.0, 2.0 * math.pi), rng.choice([-1.0, 1.0])
    by = np.array([distance * math.cos(bearing), distance * math.sin(bearing), side * angle])
    return replace(pair, T_init=off(pair.T_reference, by))
