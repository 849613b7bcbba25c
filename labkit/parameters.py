"""The parameters of the ICP loop: one frozen object, checked when it is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

from labkit.support.arrays import check_choice, check_count, check_kind, check_range
from labkit.support.compiled import record

Metric = Literal["point_to_point", "point_to_line"]


def _describe(default: Any, label: str, meaning: str, **unit: str) -> Any:
    """A field with the words that the command line and the sliders show."""
    return field(default=default, metadata={"label": label, "help": meaning, **unit})


@record
@dataclass(frozen=True)
class IcpParameters:
    """All parameters of the ICP loop; checked when the object is made.

    Attributes
    ----------
    max_correspondence_distance : float
        The gate d_max [m]: pairs farther apart are rejected. ``inf`` turns it off.
    overlap_ratio : float
        ρ in (0, 1]: the share of the source points, closest first, that is kept.
    huber_delta : float
        δ [m]: residuals beyond it weigh δ/r. ``inf`` turns it off.
    max_iterations : int
        The budget k_max.
    translation_tolerance, rotation_tolerance : float
        ε_t [m] and ε_ψ [rad]: converged when a step stays below *both*.
    cost_tolerance : float
        ε_J [m²]: converged when the cost changes by less. 0 turns the test off.
    metric : {"point_to_point", "point_to_line"}
        Kind of residual: the distance between the points of a pair, or the distance of
        the source point from the line through the target's surface.
    step_fraction : float
        The share of each step that is taken, in (0, 1]; below 1 calms a run that swings.
    approach : bool
        Whether to begin with a wide δ and to end with a gate of 8 δ; see `labkit.schedule`.

    Examples
    --------
    >>> IcpParameters(overlap_ratio=1.3)
    Traceback (most recent call last):
    ...
    labkit.support.errors.InvalidParameterError: `overlap_ratio` must be in (0, 1], got 1.3
    """

    max_correspondence_distance: float = _describe(
        0.5, "gate", "gate: pairs farther apart are rejected; inf turns it off", unit="m"
    )
    overlap_ratio: float = _describe(
        0.85, "overlap ρ", "share of the source points that is kept, closest first, in (0, 1]"
    )
    huber_delta: float = _describe(
        0.2, "Huber δ", "residuals beyond it weigh delta/r; inf turns it off", unit="m"
    )
    max_iterations: int = 60
    translation_tolerance: float = 1e-6
    rotation_tolerance: float = 1e-6
    cost_tolerance: float = 1e-12
    metric: Metric = _describe("point_to_point", "metric", "what a residual is")  # noqa: RUF009
    step_fraction: float = 1.0
    approach: bool = _describe(
        False, "begin wide, end narrow", "begin with a wide delta, end with a gate of 8 delta"
    )

    def __post_init__(self) -> None:
        gate = self.max_correspondence_distance
        check_range(gate, "max_correspondence_distance", above=0.0, unit="m")
        check_range(self.overlap_ratio, "overlap_ratio", above=0.0, at_most=1.0)
        check_range(self.huber_delta, "huber_delta", above=0.0, unit="m")
        check_count(self.max_iterations, "max_iterations", at_least=1)
        check_range(self.max_iterations, "max_iterations", at_least=1, at_most=1e9)
        check_range(self.translation_tolerance, "translation_tolerance", at_least=0.0, unit="m")
        check_range(self.rotation_tolerance, "rotation_tolerance", at_least=0.0, unit="rad")
        check_range(self.cost_tolerance, "cost_tolerance", at_least=0.0, unit="m²")
        check_range(self.step_fraction, "step_fraction", above=0.0, at_most=1.0)
        check_choice(self.metric, "metric", *get_args(Metric))
        check_kind(self.approach, "approach", bool)


def adjust(parameters: IcpParameters, settings: Mapping[str, Any]) -> IcpParameters:
    """Return the parameters with some of them set anew, by their names."""
    check_kind(parameters, "parameters", IcpParameters)
    return replace(parameters, **settings) if settings else parameters


#: The odometry's matcher: the most accurate one for scans of walls, at 180 beams as at 1,000.
ACCURATE = IcpParameters(
    metric="point_to_line",
    overlap_ratio=1.0,
    huber_delta=0.02,
    translation_tolerance=5e-4,
    rotation_tolerance=1.25e-4,
    cost_tolerance=0.0,
    approach=True,
)
