"""Sanity checks on a matched step: box D of the lesson's second flow chart."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from labkit.odometry.record import rmse_of
from labkit.odometry.search import USUAL
from labkit.result import IcpResult
from labkit.se2 import wrap
from labkit.support.arrays import FloatArray, check_range
from labkit.support.errors import InvalidParameterError

MISSED, WATCHED = 8, 40  # steps without a match, of so many, after which the wheels lead
LED = (
    f"the wheels lead since {MISSED} of {WATCHED} steps did not match, until {WATCHED} in a row do"
)
COMPARED = 20  # sure matches that tell how far matches usually lie from the wheels
FAR, LEAST = 5.0, 0.15  # times as far may a doubtful one lie, and so far [m] at least
ROOM = 1.5  # times the longest of the last motions: a step that is no surprise


@dataclass(frozen=True, kw_only=True)
class SanityLimits:
    """Limits of a step that is believed; checked when the object is made.

    Attributes
    ----------
    max_translation, max_rotation : float
        The farthest the robot can move between two scans, [m] and [rad]. A search without
        wheels looks this far. With the search, a match within the limits around a prior may
        lie beyond.
    max_prior_translation, max_prior_rotation : float
        How far the step may lie from the prior, where there is one, [m] and [rad]: three
        standard deviations of your wheels' error in a step, if you know it.
    min_inlier_ratio : float
        Kept pairs over source points. It cannot exceed ICP's overlap ratio.
    max_rmse : float
        Root mean square [m] of the kept pairs' residuals, which the metric minimises. The
        odometry's own matcher never reaches this: its gate closes to 0.16 m.
    """

    max_translation: float = field(
        default=2.0,
        metadata={"unit": "m", "help": "the farthest the robot can move between two scans"},
    )
    max_rotation: float = math.radians(90.0)
    max_prior_translation: float = 0.75
    max_prior_rotation: float = math.radians(30.0)
    min_inlier_ratio: float = 0.2
    max_rmse: float = 0.2

    def __post_init__(self) -> None:
        for name in ("max_translation", "max_prior_translation", "max_rmse"):
            check_range(getattr(self, name), name, above=0.0, unit="m")
        for name in ("max_rotation", "max_prior_rotation"):
            check_range(limit := getattr(self, name), name, above=0.0, unit="rad")
            if math.tau < limit < math.inf:
                message = f"must be radians within one turn, got {limit:.6g}: are these degrees?"
                raise InvalidParameterError(message, parameter=name)
        check_range(self.min_inlier_ratio, "min_inlier_ratio", at_least=0.0, at_most=1.0)

    @property
    def window(self) -> tuple[float, float]:
        """How far a step can lead, [m] and [rad]."""
        return self.max_translation, self.max_rotation

    @property
    def prior_window(self) -> tuple[float, float]:
        """How far it may lie from the prior, [m] and [rad]."""
        return self.max_prior_translation, self.max_prior_rotation


def limit_failures(motion: FloatArray, window: tuple[float, float], where: str = "") -> list[str]:
    """Reasons why a motion leads out of a window, [m] and [rad]. NaN never passes."""
    (x, y, turn), (most, most_turn), found = motion.tolist(), window, []
    if not (moved := math.hypot(x, y)) <= most:
        found.append(f"translation{where} {moved:.2f} m > {most:.2f} m")
    if not abs(turn) <= most_turn:
        degrees, most_degrees = math.degrees(abs(turn)), math.degrees(most_turn)
        found.append(f"rotation{where} {degrees:.1f}° > {most_degrees:.1f}°")
    return found


def fit_failures(inlier_ratio: float, rmse: float, limits: SanityLimits) -> list[str]:
    """Reasons why a match fits too poorly. NaN never passes."""
    found = []
    if not inlier_ratio >= limits.min_inlier_ratio:
        found.append(f"inlier ratio {inlier_ratio:.3f} < {limits.min_inlier_ratio:.3f}")
    if not rmse <= limits.max_rmse:
        found.append(f"RMSE {rmse:.3f} m > {limits.max_rmse:.3f} m")
    return found


def failed_checks(
    result: IcpResult, increment: FloatArray, prior: FloatArray | None, limits: SanityLimits
) -> list[str]:
    """Reasons why a match must not be believed (D); empty if it may be.

    A direction that the match leaves free stays where it was guessed. That is a measurement only
    if a prior told it, and if the metric leaves it alone, as lines do.
    """
    if result.termination.failed:
        return [result.message]
    reasons = fit_failures(result.fitness, rmse_of(result), limits)
    reasons += limit_failures(increment, limits.window)
    seen = result.observability
    keeps_prior = prior is not None and result.parameters.metric == "point_to_line"
    if not keeps_prior and (seen is None or seen.degenerate):
        information = 0.0 if seen is None else seen.values[0]
        reasons.append(f"degenerate: information {information:.3f}")
    if prior is not None:
        from_prior = increment - prior
        from_prior[2] = wrap(from_prior[2])
        reasons += limit_failures(from_prior, limits.prior_window, " from the prior")
    return reasons


def grown(limits: SanityLimits, motions: Sequence[FloatArray], lost: int) -> SanityLimits:
    """The limits of a run that has seen longer motions (3,), or lost its last steps."""
    moved = max([math.hypot(x, y) for x, y, _ in motions], default=0.0)
    turned = max([abs(turn) for _, _, turn in motions], default=0.0)
    shift = (1 + lost) * max(limits.max_translation, ROOM * moved)
    turn = (1 + lost) * max(limits.max_rotation, ROOM * turned)
    return replace(limits, max_translation=float(shift), max_rotation=float(min(math.pi, turn)))


class Trust(NamedTuple):
    """Trust in the matches and the wheels of a run, from its last steps with both.

    Over many steps the errors of wheels cancel in part; if few of the steps come from wheels, and
    the others from matches, they do not. So where many steps do not match, the wheels lead alone.
    """

    missed: tuple[bool, ...] = ()  # steps without a match, the newest first
    wheels_lead: bool = False
    apart: tuple[float, ...] = ()  # sure matches from their wheels [m], over `pace`

    def after(
        self, increment: FloatArray, prior: FloatArray, *, matched: bool, doubtful: bool
    ) -> Trust:
        """The trust after one more step."""
        missed = (not matched, *self.missed)[:WATCHED]
        lead = sum(missed) >= (1 if self.wheels_lead else MISSED)
        apart = math.dist(increment[:2], prior[:2]) / pace(prior)
        return Trust(missed, lead, (*(() if doubtful else (apart,)), *self.apart)[:COMPARED])

    def window(self, limits: SanityLimits, prior: FloatArray) -> tuple[float, float]:
        """How far from the wheels a doubtful match may lie, [m] and [rad].

        The turn has no other limit than that of all matches: scans tell it better than wheels.
        """
        most, turn = limits.prior_window
        if len(self.apart) < COMPARED // 4:
            return most, turn
        return min(most, max(LEAST, FAR * pace(prior) * statistics.median(self.apart))), turn


def pace(motion: FloatArray) -> float:
    """The factor by which the errors of wheels grow with a motion: 1 at rest."""
    x, y, turn = motion.tolist()
    return float(1.0 + math.hypot(x, y) / USUAL[0] + abs(turn) / USUAL[1])
