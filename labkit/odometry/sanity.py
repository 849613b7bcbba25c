"""Sanity checks on a matched step: box D of the lesson's second flow chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from labkit.arrays import FloatArray, check_range
from labkit.line_alignment import MIN_INFORMATION


@dataclass(frozen=True, kw_only=True)
class SanityLimits:
    """What a step may look like before it is believed; checked when it is made.

    Attributes
    ----------
    max_translation, max_rotation : float
        The farthest the robot can move between two scans, [m] and [rad].
    max_prior_translation, max_prior_rotation : float
        How far the step may lie from the prior, where there is one, [m] and [rad]. Set them
        to three standard deviations of your wheels' error a step if you know it: at one of
        them, a third of the right steps would be refused.
    min_inlier_ratio : float
        Kept pairs over source points. It cannot exceed ICP's overlap ratio.
    max_rmse : float
        Inlier RMSE [m].
    max_rmse_share : float
        Inlier RMSE over the gate near the answer. Pairs that fit by chance fill the gate
        evenly, so that their RMSE is 1/√3 = 0.58 of it.
    min_information : float
        Smallest eigenvalue of the information; see `labkit.line_alignment.Information`.
    """

    max_translation: float = field(
        default=2.0, metadata={"unit": "m", "help": "farthest motion of a step"}
    )
    max_rotation: float = field(
        default=math.radians(90.0), metadata={"unit": "rad", "help": "largest rotation of a step"}
    )
    max_prior_translation: float = field(
        default=0.75, metadata={"unit": "m", "help": "farthest shift from the prior"}
    )
    max_prior_rotation: float = field(
        default=math.radians(30.0),
        metadata={"unit": "rad", "help": "largest rotation from the prior"},
    )
    min_inlier_ratio: float = field(default=0.33, metadata={"help": "smallest share of inliers"})
    max_rmse: float = field(default=0.2, metadata={"unit": "m", "help": "largest inlier RMSE"})
    max_rmse_share: float = field(
        default=0.5, metadata={"help": "largest share of the gate that the inlier RMSE may be"}
    )
    min_information: float = field(
        default=MIN_INFORMATION, metadata={"help": "smallest eigenvalue of the information"}
    )

    def __post_init__(self) -> None:
        for each in fields(self):
            if unit := each.metadata.get("unit"):
                check_range(getattr(self, each.name), each.name, above=0.0, unit=unit)
        check_range(self.min_inlier_ratio, "min_inlier_ratio", at_least=0.0, at_most=1.0)
        check_range(self.max_rmse_share, "max_rmse_share", above=0.0, at_most=1.0)
        check_range(self.min_information, "min_information", at_least=0.0, at_most=0.5)


def motion_complaints(
    increment: FloatArray, prior: FloatArray | None, limits: SanityLimits
) -> list[str]:
    """Why a robot would not have moved by `increment`; empty where it may have."""
    complaints = []
    x, y, turn = increment.tolist()
    distance = math.hypot(x, y)
    if distance > limits.max_translation:
        complaints.append(f"translation {distance:.2f} m > {limits.max_translation:.2f} m")
    if abs(turn) > limits.max_rotation:
        complaints.append(f"rotation {_degrees(turn)} > {_degrees(limits.max_rotation)}")
    if prior is not None:
        prior_x, prior_y, prior_turn = prior.tolist()
        apart = math.hypot(x - prior_x, y - prior_y)
        turned = math.remainder(turn - prior_turn, math.tau)
        if apart > limits.max_prior_translation:
            complaints.append(
                f"{apart:.2f} m from the prior > {limits.max_prior_translation:.2f} m"
            )
        if abs(turned) > limits.max_prior_rotation:
            complaints.append(
                f"{_degrees(turned)} from the prior > {_degrees(limits.max_prior_rotation)}"
            )
    return complaints


def quality_complaints(
    inlier_ratio: float, rmse: float, limits: SanityLimits, gate: float = math.inf
) -> list[str]:
    """Why a match is not good enough, under a gate [m]; empty where it is. NaN never is."""
    complaints = []
    if not inlier_ratio >= limits.min_inlier_ratio:
        complaints.append(f"inlier ratio {inlier_ratio:.3f} < {limits.min_inlier_ratio:.3f}")
    share = limits.max_rmse_share * gate
    if not rmse <= limits.max_rmse:
        complaints.append(f"RMSE {rmse:.3f} m > {limits.max_rmse:.3f} m")
    elif rmse > share:
        complaints.append(f"RMSE {rmse:.3f} m > {share:.3f} m, as by chance")
    return complaints


def _degrees(angle: float) -> str:
    return f"{abs(math.degrees(angle)):.1f}°"
