"""Sanity checks on a matched step: box D of the lesson's second flow chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from labkit.odometry.constants import UNUSUAL, USUAL_LIMITS
from labkit.odometry.record import rmse_of
from labkit.result import IcpResult
from labkit.support.arrays import FloatArray, check_range
from labkit.support.errors import InvalidParameterError


@dataclass(frozen=True, kw_only=True)
class SanityLimits:
    """Limits of a step that is believed; checked when the object is made.

    Attributes
    ----------
    max_translation, max_rotation : float or None
        The farthest the robot can move between two scans, [m] and [rad]: nothing beyond is taken
        from a match nor, by `MapOdometry`, from wheels, and no match that lies farther from them,
        unless it agrees by 0.8. None stands for 2 m and 90°; it then lets a step be three times as
        long as the longest of the last ones. After a gap in time, or steps without a match, it lets
        it be as many times as long as steps were missed.
    max_prior_translation, max_prior_rotation : float
        How far the step may lie from the prior, where there is one, [m] and [rad]: three
        standard deviations of your wheels' error in a step, if you know it.
    min_inlier_ratio : float
        Kept pairs over source points. It cannot exceed ICP's overlap ratio.
    max_rmse : float
        Root mean square [m] of the kept pairs' residuals, which the metric minimises. The
        odometry's own matcher never reaches this: its gate closes to 0.16 m.
    """

    max_translation: float | None = field(
        default=None,
        metadata={
            "unit": "m",
            "help": "the farthest the robot can move between two scans",
            "default": f"{USUAL_LIMITS[0]:g}, or three times the longest of the last steps",
        },
    )
    max_rotation: float | None = None
    max_prior_translation: float = 0.75
    max_prior_rotation: float = math.radians(30.0)
    min_inlier_ratio: float = 0.2
    max_rmse: float = 0.2

    def __post_init__(self) -> None:
        for name in ("max_prior_translation", "max_rmse"):
            check_range(getattr(self, name), name, above=0.0, unit="m")
        if self.max_translation is not None:
            check_range(self.max_translation, "max_translation", above=0.0, unit="m")
        check_turn(self.max_prior_rotation, "max_prior_rotation")
        if self.max_rotation is not None:
            check_turn(self.max_rotation, "max_rotation")
        check_range(self.min_inlier_ratio, "min_inlier_ratio", at_least=0.0, at_most=1.0)

    @property
    def window(self) -> tuple[float, float]:
        """How far a step can lead, [m] and [rad]."""
        return self.reach(0.0, 0.0)

    def reach(self, longest_shift: float, longest_turn: float) -> tuple[float, float]:
        """The same where the longest of the last steps are known, [m] and [rad]."""
        shift, turn = self.max_translation, self.max_rotation
        if shift is None:
            shift = max(USUAL_LIMITS[0], UNUSUAL * longest_shift)
        if turn is None:
            turn = max(USUAL_LIMITS[1], UNUSUAL * longest_turn)
        return shift, turn

    @property
    def prior_window(self) -> tuple[float, float]:
        """How far it may lie from the prior, [m] and [rad]."""
        return self.max_prior_translation, self.max_prior_rotation


def check_turn(limit: float, name: str) -> None:
    """Refuse a limit of a rotation [rad] that is none, or looks like degrees."""
    check_range(limit, name, above=0.0, unit="rad")
    if math.tau < limit < math.inf:
        message = f"must be radians within one turn, got {limit:.6g}: are these degrees?"
        raise InvalidParameterError(message, parameter=name)


def limit_failures(motion: FloatArray, window: tuple[float, float], where: str = "") -> list[str]:
    """Reasons why a motion leads out of a window, [m] and [rad]. NaN never passes."""
    x, y, turn = motion.tolist()
    turn = math.remainder(turn, math.tau)  # of a difference of two
    shift = math.hypot(x, y)
    max_shift, max_turn = window
    reasons = []
    if not shift <= max_shift:
        reasons.append(f"translation{where} {shift:.2f} m > {max_shift:.2f} m")
    if not abs(turn) <= max_turn:
        degrees = math.degrees(abs(turn))
        reasons.append(f"rotation{where} {degrees:.1f}° > {math.degrees(max_turn):.1f}°")
    return reasons


def fit_failures(inlier_ratio: float, rmse: float, limits: SanityLimits) -> list[str]:
    """Reasons why a match fits too poorly. NaN never passes."""
    reasons = []
    if not inlier_ratio >= limits.min_inlier_ratio:
        reasons.append(f"inlier ratio {inlier_ratio:.3f} < {limits.min_inlier_ratio:.3f}")
    if not rmse <= limits.max_rmse:
        reasons.append(f"RMSE {rmse:.3f} m > {limits.max_rmse:.3f} m")
    return reasons


def match_failures(
    result: IcpResult, increment: FloatArray, prior: FloatArray | None, limits: SanityLimits
) -> list[str]:
    """Reasons why a match must not be believed (D); empty if it may be.

    A direction that the match leaves free stays where it was guessed. That is a measurement only
    if a prior told it, and if the metric leaves it alone, as lines do.
    """
    if result.termination.failed:
        return [result.message]
    reasons = fit_failures(result.fitness, rmse_of(result.correspondences), limits)
    reasons += limit_failures(increment, limits.window)
    observability = result.observability
    keeps_prior = prior is not None and result.parameters.metric == "point_to_line"
    if not keeps_prior and (observability is None or observability.degenerate):
        information = 0.0 if observability is None else observability.values[0]
        reasons.append(f"degenerate: information {information:.3f}")
    if prior is not None:
        reasons += prior_failures(increment, prior, limits)
    return reasons


def prior_failures(increment: FloatArray, prior: FloatArray, limits: SanityLimits) -> list[str]:
    """Reasons why a motion lies too far from the prior."""
    return limit_failures(increment - prior, limits.prior_window, " from the prior")


def unknown_std(prior: FloatArray | None, limits: SanityLimits) -> FloatArray:
    """Standard deviation (3,) of what no match tells: a third of the limits."""
    shift, turn = limits.window if prior is None else limits.prior_window
    std = np.array([shift, shift, turn]) / 3.0
    usual = np.array([USUAL_LIMITS[0], *USUAL_LIMITS]) / 3.0
    return np.where(np.isfinite(std), std, usual)
