"""A whole log, fed scan by scan to an odometry: its poses, its records, and what is odd."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Sized
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.odometry.base import Odometry
from labkit.odometry.constants import KEPT_STEPS
from labkit.odometry.integration import increments_between
from labkit.odometry.map_odometry import MapOdometry
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Decision, StepRecord
from labkit.odometry.remarks import Step, remarks_on
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, as_poses, check_function, check_kinds
from labkit.support.errors import InvalidParameterError, InvalidPointsError


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class OdometryResult:
    """A whole run.

    Attributes
    ----------
    poses : ndarray, shape (K, 3)
        x, y, ψ of each scan [m, m, rad].
    records : tuple of StepRecord
        One of each scan.
    remarks : tuple of str
        The likeliest cause of what is odd in the run as a whole, or nothing.
    """

    poses: FloatArray
    records: tuple[StepRecord, ...]
    remarks: tuple[str, ...] = ()

    def count(self, *decisions: Decision) -> int:
        """Number of steps that ended in one of `decisions`."""
        check_kinds(decisions, "decisions", Decision)
        return sum(record.decision in decisions for record in self.records)

    @property
    def against_prior(self) -> int:
        """Number of matches that were believed against a prior."""
        return sum(record.against_prior for record in self.records)

    def __repr__(self) -> str:
        decisions = Counter(record.decision.value for record in self.records)
        words = ", ".join(f"{name} {count}" for name, count in decisions.items())
        against = f"; {self.against_prior} against the prior" if self.against_prior else ""
        return f"OdometryResult({len(self.records)} scans: {words}{against})"


def estimate_odometry(
    scans: Any,
    priors: ArrayLike | None = None,
    parameters: OdometryParameters | None = None,
    *,
    laser_offset: ArrayLike | None = None,
    estimator: type[Odometry[Any]] = MapOdometry,
    start: ArrayLike = (0.0, 0.0, 0.0),
    deskew: bool = True,
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> OdometryResult:
    """Estimate the motion of a whole log.

    Parameters
    ----------
    scans : iterable of Scan or array_like, length K, or Log
        In the order of time; they are gone through once. A log brings its own odometry.
    priors : array_like, shape (K, 3) or (K−1, 3), optional
        Wheel odometry: K poses, or the K−1 increments between them, as rows or as transforms,
        (3, 3) or (4, 4) each. A row of NaN says that there are no wheels here.
    parameters : OdometryParameters, optional
        Matcher, limits and filters.
    laser_offset : array_like, shape (3,), optional
        Pose of the scanner on the robot (x [m], y [m], θ [rad]), where `priors` are the robot's.
    estimator : type
        `MapOdometry`, the lab's own, or `LessonOdometry`.
    start : array_like, shape (3,) or (3, 3)
        Pose of the first scan.
    deskew : bool
        Undo the skew of sweeps that tell the time between their beams; see `MapOdometry`.
    progress : callable
        Wraps the scans while they are matched, e.g. ``tqdm.tqdm``.

    Examples
    --------
    >>> from labkit.simulation import Lidar, room, scan_along
    >>> path = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.2, 0.0, 0.04]]
    >>> estimate_odometry(scan_along(room(), path, Lidar(), rng=0))
    OdometryResult(3 scans: start 1, icp 2)
    """
    sweeps = getattr(scans, "scans", scans)
    is_number = isinstance(sweeps, np.ndarray) and sweeps.ndim == 0
    if is_number or isinstance(sweeps, str | Scan) or not isinstance(sweeps, Iterable):
        raise InvalidPointsError(
            f"`scans` must be a series of scans or a log, got {scans!r}; "
            f"`labkit.read_log` reads a file, one match is `labkit.icp`"
        )
    if laser_offset is not None and priors is None:
        raise InvalidParameterError(
            "moves `priors`, and there are none; for the odometry of a log give it to `read_log`",
            parameter="laser_offset",
        )
    if priors is None:
        priors = getattr(scans, "odometry", None)
    check_function(progress, "progress")
    if not (isinstance(estimator, type) and issubclass(estimator, Odometry)):
        raise InvalidParameterError(
            f"must be `MapOdometry` or `LessonOdometry`, the class itself, got {estimator!r}",
            parameter="estimator",
        )
    odometry = estimator(parameters, start, laser_offset=laser_offset, deskew=deskew)
    expected: Iterable[FloatArray | None] = repeat(None)
    if priors is not None:
        sweeps = sweeps if isinstance(sweeps, Sized) else list(sweeps)
        expected = chain([None], _as_increments(priors, len(sweeps)))
    poses: list[FloatArray] = []
    records: list[StepRecord] = []
    steps: list[Step] = []
    for scan, prior in zip(progress(sweeps), expected, strict=False):
        records.append(odometry.update(scan, prior))
        steps.append(odometry.last_step)
        poses.append(odometry.pose)
        if len(records) > KEPT_STEPS:
            oldest = -KEPT_STEPS - 1
            records[oldest] = records[oldest].let_match_go()
    result = OdometryResult(
        poses=np.array(poses).reshape(-1, 3),
        records=tuple(records),
        remarks=remarks_on(steps),
    )
    for remark in result.remarks:
        warnings.warn(remark, stacklevel=2)
    return result


def _as_increments(priors: ArrayLike, scan_count: int) -> FloatArray:
    rows = as_poses(priors, "priors", gaps=True)
    if len(rows) not in (scan_count, scan_count - 1):
        raise InvalidPointsError(
            f"`priors` must have shape ({scan_count}, 3), a pose a scan, or "
            f"({scan_count - 1}, 3), an increment a step, got {np.shape(priors)}"
        )
    return rows if len(rows) < scan_count else increments_between(rows)
