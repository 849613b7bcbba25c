"""Scan-matching odometry with sanity checks and fallbacks (section 5 of the lesson)."""

from labkit.odometry.integration import increments_between, integrate, integrate_step
from labkit.odometry.lesson import LessonOdometry
from labkit.odometry.map_odometry import MapOdometry
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.run import OdometryResult, estimate_odometry
from labkit.odometry.sanity import SanityLimits

__all__ = [
    "Decision",
    "LessonOdometry",
    "MapOdometry",
    "OdometryParameters",
    "OdometryResult",
    "SanityLimits",
    "StepRecord",
    "estimate_odometry",
    "increments_between",
    "integrate",
    "integrate_step",
]
