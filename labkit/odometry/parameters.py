"""The parameters of the odometry: matcher, target, filters, limits and fallbacks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, get_args

from labkit.filters import Preprocessing
from labkit.odometry.sanity import SanityLimits
from labkit.parameters import ACCURATE, IcpParameters
from labkit.support.arrays import check_kind
from labkit.support.errors import InvalidParameterError

Against = Literal["scan", "map"]
RETRY = 0.5  # share of the gate and of each ICP step in the second attempt


@dataclass(frozen=True, kw_only=True)
class OdometryParameters:
    """All parameters of the odometry; checked when the object is made.

    Attributes
    ----------
    icp : IcpParameters
        The matcher's parameters.
    limits : SanityLimits
        What a step must pass.
    against : {"map", "scan"}
        What a scan is matched against: a map of the last key scans, or the scan before.
    preprocessing : Preprocessing
        Filters that every scan goes through first.
    search : bool
        Whether to search the window of possible motions where no match is believed, or the
        best one is doubtful; see `labkit.odometry.search`. Without it the lesson's checks hold
        as they are, and nothing else is asked of wheels and scans.
    """

    icp: IcpParameters = ACCURATE
    limits: SanityLimits = field(default_factory=SanityLimits)
    against: Against = "map"
    preprocessing: Preprocessing = field(default_factory=Preprocessing)
    search: bool = True

    def __post_init__(self) -> None:
        kinds = {"icp": IcpParameters, "limits": SanityLimits, "preprocessing": Preprocessing}
        for name, kind in (kinds | {"search": bool}).items():
            check_kind(getattr(self, name), name, kind)
        if self.against not in get_args(Against):
            raise InvalidParameterError(
                f"must be one of {', '.join(get_args(Against))}, got {self.against!r}",
                parameter="against",
            )

    @property
    def retry(self) -> IcpParameters:
        """The matcher's parameters for the second attempt: a reduced gate, reduced steps."""
        return replace(
            self.icp,
            max_correspondence_distance=RETRY * self.icp.max_correspondence_distance,
            step_fraction=RETRY * self.icp.step_fraction,
        )
