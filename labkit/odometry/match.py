"""A candidate, matched: ICP from there, and the directions that it leaves free as expected."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.icp import icp
from labkit.odometry.constants import MARGIN
from labkit.odometry.propose import Expectation
from labkit.odometry.record import Placement
from labkit.odometry.score import score
from labkit.parameters import IcpParameters
from labkit.result import IcpResult, step_length
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.target import Target


class Match(NamedTuple):
    """A match with its score, or a scan placed without one."""

    result: IcpResult | Placement
    score: float
    agreement: float

    @property
    def T(self) -> FloatArray:
        """The pose of the scan in the map's frame, (3, 3); NaN if the match failed."""
        return self.result.T_target_source

    @property
    def is_degenerate(self) -> bool:
        """True if the match leaves a direction free."""
        observability = self.result.observability
        return observability is None or observability.degenerate

    def without_score(self) -> Match:
        """The same match, where the robot cannot be."""
        return self._replace(score=-math.inf, agreement=-math.inf)


def stay(
    scan: Scan, target: Target, expected: Expectation, parameters: IcpParameters, best: Match
) -> Match:
    """The scan as it lies at the most expected pose, without a match.

    If the best match lies in the window, too, it only counts whether this one agrees as well.
    """
    placement = Placement(
        source=scan, target=target, parameters=parameters, T_target_source=expected.poses[0]
    )
    least_agreement = best.agreement if expected.holds(best.T) else -math.inf
    return Match(placement, *score(placement, expected, least_agreement))


def match(
    scan: Scan,
    target: Target,
    T_guess: FloatArray,
    expected: Expectation,
    parameters: IcpParameters,
) -> Match:
    """Match the scan from a guess.

    ICP leaves a free direction, such as the way along a corridor, where the guess had it. There the
    expected motion tells more, unless the scan fits clearly less well.
    """
    result = icp(scan, target, T_guess, parameters)
    from_guess = Match(result, *score(result, expected))
    observability = result.observability
    if observability is None or not observability.degenerate:
        return from_guess
    T_filled = expected.fill_free(from_guess.T, observability)
    shift, _ = step_length(np.array(from_guess.T), T_filled)
    if shift < parameters.translation_tolerance:
        return from_guess
    result = icp(scan, target, T_filled, parameters)
    from_filled = Match(result, *score(result, expected))
    if from_filled.agreement > from_guess.agreement - MARGIN:
        return from_filled
    return from_guess
