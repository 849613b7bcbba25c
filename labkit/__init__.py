"""ICP-based motion estimation from 2D LiDAR scans."""

from importlib import import_module
from typing import TYPE_CHECKING

from labkit.support.interrupts import loading

with loading():
    from labkit.alignment import align, align_svd
    from labkit.icp import icp
    from labkit.parameters import ACCURATE, IcpParameters
    from labkit.result import IcpResult, Termination
    from labkit.scan import Scan
    from labkit.se2 import apply, compose, from_xytheta, invert, to_xytheta, transform, wrap
    from labkit.support.errors import LabkitError
    from labkit.target import Target

if TYPE_CHECKING:
    from labkit.logs import read_log

__all__ = [
    "ACCURATE",
    "IcpParameters",
    "IcpResult",
    "LabkitError",
    "Scan",
    "Target",
    "Termination",
    "align",
    "align_svd",
    "apply",
    "compose",
    "from_xytheta",
    "icp",
    "invert",
    "read_log",
    "to_xytheta",
    "transform",
    "wrap",
]

__version__ = "0.3.0"

_PACKAGES = ("evaluation", "logs", "odometry", "plotting", "simulation")


def __getattr__(name: str) -> object:
    """Load a part when it is first asked for: a match needs neither a log nor a picture."""
    if name == "read_log":
        return import_module("labkit.logs").read_log
    if name not in _PACKAGES:
        raise AttributeError(f"module 'labkit' has no attribute {name!r}")
    return import_module(f"labkit.{name}")
