"""How good the answers are: errors against the reference, failures, and their summary."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from data import Pair, PairSet
from labkit.evaluation.pose_errors import pose_differences
from labkit.support.arrays import BoolArray, FloatArray
from timing import Attempt, Run

FAILURE = 0.3, math.radians(5.0)  # a match that is off by more has failed
FOUND = 0.05, math.radians(1.0)  # a match from afar that is off by no more has arrived


def errors(pairs: Sequence[Pair], attempts: Sequence[Attempt]) -> tuple[FloatArray, FloatArray]:
    """Translation [m] and rotation [rad] errors; infinite where no answer was given."""
    translation, rotation = pose_differences(
        np.array([pair.T_reference for pair in pairs]),
        np.array([attempt.T for attempt in attempts]),
    )
    answered = np.isfinite(translation) & np.isfinite(rotation)
    return np.where(answered, translation, np.inf), np.where(answered, rotation, np.inf)


def found(pairs: Sequence[Pair], attempts: Sequence[Attempt]) -> BoolArray:
    """Which attempts ended at the reference."""
    translation, rotation = errors(pairs, attempts)
    return (translation <= FOUND[0]) & (rotation <= FOUND[1])


def score(pair_set: PairSet, run: Run, clock: str) -> dict[str, Any]:
    """Time [ms], iterations, errors [mm, degrees] and failures of one matcher on one set."""
    translation, rotation = errors(pair_set.pairs[: len(run.attempts)], run.first)
    iterations = [attempt.iterations for attempt in run.first if attempt.iterations is not None]
    complaints = [attempt.complaint for attempt in run.first if attempt.complaint]
    return {
        "pairs": len(run.attempts),
        "time_ms": _summary(1e3 * run.seconds(clock)),
        "iterations": float(np.median(iterations)) if iterations else None,
        "translation_mm": _summary(1e3 * translation),
        "rotation_deg": _summary(np.degrees(rotation)),
        "failures": int(((translation > FAILURE[0]) | (rotation > FAILURE[1])).sum()),
        "unanswered": len(complaints),
        "complaint": complaints[0] if complaints else "",
    }


def _summary(values: FloatArray) -> dict[str, float]:
    """Median and 95th percentile; an observed value, as infinite ones do not interpolate."""
    median, p95 = np.percentile(values, (50.0, 95.0), method="inverted_cdf")
    return {"median": float(median), "p95": float(p95)}
