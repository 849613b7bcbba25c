"""Sanity checks on a matched step: box D of the lesson's second flow chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from labkit.support.arrays import FloatArray, check_range


@dataclass(frozen=True, kw_only=True)
class SanityLimits:
    """Limits of a step that is believed; checked when the object is made.

    Attributes
    ----------
    max_translation, max_rotation : float
        The farthest the robot can move between two scans, [m] and [rad]. A search without
        wheels looks this far.
    max_prior_translation, max_prior_rotation : float
        How far the step may lie from the prior, where there is one, [m] and [rad]: three
        standard deviations of your wheels' error a step, if you know it.
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
            check_range(getattr(self, name), name, above=0.0, unit="rad")
        check_range(self.min_inlier_ratio, "min_inlier_ratio", at_least=0.0, at_most=1.0)


def complaints(
    increment: FloatArray, inlier_ratio: float, rmse: float, limits: SanityLimits
) -> list[str]:
    """Reasons to reject a match; empty if there is none. NaN never passes."""
    x, y, turn = increment.tolist()
    found = []
    if not (moved := math.hypot(x, y)) <= limits.max_translation:
        found.append(f"translation {moved:.2f} m > {limits.max_translation:.2f} m")
    if not abs(turn) <= limits.max_rotation:
        found.append(f"rotation {_degrees(turn)} > {_degrees(limits.max_rotation)}")
    if not inlier_ratio >= limits.min_inlier_ratio:
        found.append(f"inlier ratio {inlier_ratio:.3f} < {limits.min_inlier_ratio:.3f}")
    if not rmse <= limits.max_rmse:
        found.append(f"RMSE {rmse:.3f} m > {limits.max_rmse:.3f} m")
    return found


def conflicts(increment: FloatArray, prior: FloatArray | None, limits: SanityLimits) -> list[str]:
    """How far a match lies from the prior, where that is too far; empty without a prior."""
    if prior is None:
        return []
    x, y, turn = (increment - prior).tolist()
    turn, most = math.remainder(turn, math.tau), limits.max_prior_rotation
    found = []
    if not (apart := math.hypot(x, y)) <= limits.max_prior_translation:
        found.append(f"{apart:.2f} m from the prior > {limits.max_prior_translation:.2f} m")
    if not abs(turn) <= most:
        found.append(f"{_degrees(turn)} from the prior > {_degrees(most)}")
    return found


def _degrees(angle: float) -> str:
    return f"{abs(math.degrees(angle)):.1f}°"
