"""The parameters of the odometry: matcher, target, filters, limits and fallbacks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from labkit.filters import Preprocessing
from labkit.odometry.constants import RETRY_SHARE
from labkit.odometry.sanity import SanityLimits
from labkit.parameters import ACCURATE, IcpParameters
from labkit.support.arrays import check_kind


@dataclass(frozen=True, kw_only=True)
class OdometryParameters:
    """All parameters of the odometry; checked when the object is made.

    Attributes
    ----------
    icp : IcpParameters
        The matcher's parameters.
    limits : SanityLimits
        What a step must pass.
    preprocessing : Preprocessing
        Filters that every scan goes through first.
    """

    icp: IcpParameters = ACCURATE
    limits: SanityLimits = field(default_factory=SanityLimits)
    preprocessing: Preprocessing = field(default_factory=Preprocessing)

    def __post_init__(self) -> None:
        kinds = {"icp": IcpParameters, "limits": SanityLimits, "preprocessing": Preprocessing}
        for name, kind in kinds.items():
            check_kind(getattr(self, name), name, kind)

    @property
    def retry(self) -> IcpParameters:
        """The matcher's parameters for the second attempt: a reduced gate, reduced steps."""
        return replace(
            self.icp,
            max_correspondence_distance=RETRY_SHARE * self.icp.max_correspondence_distance,
            step_fraction=RETRY_SHARE * self.icp.step_fraction,
        )
