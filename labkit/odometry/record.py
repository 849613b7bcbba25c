"""What one step of the odometry decided, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from labkit.arrays import FloatArray
from labkit.result import Termination


class Decision(Enum):
    """Where a step's motion came from; the value is the word for a table.

    HOLD is a motion that was held; where that is no motion at all, the decision is STAND.
    """

    START = "start"
    ICP = "icp"
    RETRY = "retry"
    SEARCH = "search"
    PRIOR = "prior"
    HOLD = "hold"
    STAND = "stand"

    @property
    def matched(self) -> bool:
        """Whether the motion came from matching the scans."""
        return self in (Decision.ICP, Decision.RETRY, Decision.SEARCH)

    @property
    def skipped(self) -> bool:
        """Whether the update was skipped."""
        return self in (Decision.HOLD, Decision.STAND)


@dataclass(frozen=True, eq=False, kw_only=True)
class StepRecord:
    """What one step decided, and why.

    The numbers are those of the match that was judged best; NaN where there was none.

    Attributes
    ----------
    increment : ndarray, shape (3,)
        (Δx, Δy, Δψ) taken, in the frame of scan k, [m, m, rad].
    decision : Decision
        Where it came from.
    reason : str
        The checks that failed on the way; empty where the first match passed.
    inlier_count, inlier_ratio, rotation : float
        Kept pairs, their share of the source, and the match's |Δψ| [rad].
    rmse : float
        Root mean square of the kept pairs' residuals [m]; see `SanityLimits`.
    cost : float
        The truncated Huber cost J [m²]; see `labkit.icp`.
    seen_through : float
        Share of the target's points in view that beams look through; see
        `labkit.odometry.agreement`.
    agreement : float
        1 where all of the scan lies on the target, 0 where none of it does, and less where
        its beams look through the target; −∞ where the match failed.
    margin : float
        By how much the match agrees better than the best one that ended elsewhere and passes
        the checks; NaN where there is none.
    ambiguous : bool
        Whether `margin` is too small to tell which match is right. Then the prior is taken;
        without one, the match nearest to the expected motion.
    against_prior : bool
        Whether the match was believed although it lies beyond the limits around the prior.
    information : float
        Smallest eigenvalue of the information: near 0 where a direction is free.
    degenerate : bool
        Whether a direction is free. The point-to-line metric leaves it at the prior, or with
        the search where the last motions suggest. Then the step is believed; without either
        it is not.
    spread : float
        The lesson's cheap corridor test; see `labkit.degeneracy.spread_ratio`.
    iterations : int
        ICP steps of the match.
    termination : Termination or None
        How it ended.
    """

    increment: FloatArray
    decision: Decision
    reason: str = ""
    inlier_count: int = 0
    inlier_ratio: float = math.nan
    rmse: float = math.nan
    cost: float = math.nan
    seen_through: float = math.nan
    agreement: float = math.nan
    margin: float = math.nan
    ambiguous: bool = False
    against_prior: bool = False
    rotation: float = math.nan
    information: float = math.nan
    spread: float = math.nan
    iterations: int = 0
    degenerate: bool = False
    termination: Termination | None = None
