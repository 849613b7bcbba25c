"""Sanity checks on a matched step: box D of the lesson's second flow chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from labkit.support.arrays import FloatArray, check_range

STANDING, EACH_METRE = 0.2, 0.4  # of the limit around a prior: for no motion, and for more
ROOM = 1.5  # times the longest of the last motions: a step that is no surprise


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
        standard deviations of your wheels' error in a step of 2 m, if you know it. With the
        search, shorter steps may lie less far off: by a fifth where the wheels stand.
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

    @property
    def window(self) -> tuple[float, float]:
        """How far a step can lead, [m] and [rad]."""
        return self.max_translation, self.max_rotation

    @property
    def prior_window(self) -> tuple[float, float]:
        """How far it may lie from the prior, [m] and [rad]."""
        return self.max_prior_translation, self.max_prior_rotation


def beyond(motion: FloatArray, window: tuple[float, float], where: str = "") -> list[str]:
    """Reasons why a motion leads out of a window, [m] and [rad]. NaN never passes."""
    (x, y, turn), (most, most_turn), found = motion.tolist(), window, []
    if not (moved := math.hypot(x, y)) <= most:
        found.append(f"translation{where} {moved:.2f} m > {most:.2f} m")
    if not abs(turn) <= most_turn:
        degrees, most_degrees = math.degrees(abs(turn)), math.degrees(most_turn)
        found.append(f"rotation{where} {degrees:.1f}° > {most_degrees:.1f}°")
    return found


def poor(inlier_ratio: float, rmse: float, limits: SanityLimits) -> list[str]:
    """Reasons why a match fits too poorly. NaN never passes."""
    found = []
    if not inlier_ratio >= limits.min_inlier_ratio:
        found.append(f"inlier ratio {inlier_ratio:.3f} < {limits.min_inlier_ratio:.3f}")
    if not rmse <= limits.max_rmse:
        found.append(f"RMSE {rmse:.3f} m > {limits.max_rmse:.3f} m")
    return found


def around(prior: FloatArray, limits: SanityLimits) -> SanityLimits:
    """The limits around a `prior` (Δx, Δy, Δψ): wheels err less in a short step."""
    share = min(1.0, STANDING + EACH_METRE * math.hypot(prior[0], prior[1]))
    return replace(limits, max_prior_translation=share * limits.max_prior_translation)


def grown(limits: SanityLimits, motions: FloatArray, lost: int) -> SanityLimits:
    """The limits of a run that has seen longer motions (K, 3), or lost its last steps."""
    moved, turned = np.hypot(motions[:, 0], motions[:, 1]).max(), np.abs(motions[:, 2]).max()
    shift, turn = max(limits.max_translation, ROOM * moved), max(limits.max_rotation, ROOM * turned)
    return replace(
        limits,
        max_translation=float((1 + lost) * shift),
        max_rotation=float(min(math.pi, (1 + lost) * turn)),
    )
