"""Scan-matching odometry with sanity checks and fallbacks (section 5 of the lesson)."""

from labkit.odometry.estimator import OdometryResult, ScanMatchingOdometry, estimate_odometry
from labkit.odometry.integration import increments_between, integrate, integrate_step
from labkit.odometry.lesson import LessonOdometry
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.sanity import SanityLimits
from labkit.odometry.step import estimate_step

__all__ = [
    "Decision",
    "LessonOdometry",
    "OdometryParameters",
    "OdometryResult",
    "SanityLimits",
    "ScanMatchingOdometry",
    "StepRecord",
    "estimate_odometry",
    "estimate_step",
    "increments_between",
    "integrate",
    "integrate_step",
]
