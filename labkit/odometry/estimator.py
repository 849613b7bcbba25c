"""Scan-matching odometry: a streaming estimator, and the same over a whole log."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats, as_pose
from labkit.correspondences import MIN_PAIRS
from labkit.errors import InvalidPointsError
from labkit.odometry.integration import increments_between, integrate_step
from labkit.odometry.step import (
    STILL,
    Decision,
    OdometryParameters,
    StepRecord,
    estimate_step,
)
from labkit.scan import Scan
from labkit.target import Target


class ScanMatchingOdometry:
    """Odometry one scan at a time, for a robot that is driving now.

    Holds the scan before, the pose and the last motion between calls: what the lesson's
    Simulink block keeps in persistent variables.

    Examples
    --------
    >>> import labkit
    >>> walls = np.random.default_rng(0).uniform(-4, 4, (80, 2))
    >>> T_old_new = labkit.transform(0.1, 0.05, 0.02)
    >>> odometry = ScanMatchingOdometry(OdometryParameters(icp=labkit.IcpParameters()))
    >>> _ = odometry.update(walls)
    >>> record = odometry.update(labkit.apply(labkit.invert(T_old_new), walls))
    >>> np.round(odometry.pose, 6).tolist()
    [0.1, 0.05, 0.02]
    """

    def __init__(
        self,
        parameters: OdometryParameters | None = None,
        start: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        self.parameters = parameters or OdometryParameters()
        self.pose = as_pose(start, "start")
        self._target: Target | None = None
        self._started = False
        self._last_motion: FloatArray = STILL

    def update(self, scan: Scan | ArrayLike, prior: ArrayLike | None = None) -> StepRecord:
        """Take the next scan and move the pose.

        Parameters
        ----------
        scan : Scan or array_like, shape (N, 2)
            The newest scan, in metres.
        prior : array_like, shape (3,), optional
            The increment (Δx, Δy, Δψ) that wheels or an IMU report since the scan before.

        Returns
        -------
        StepRecord
            Of the very first scan, ``Decision.START``.
        """
        filtered = self.parameters.preprocessing(scan)
        if self._started:
            expected = None if prior is None else as_pose(prior, "prior")
            record = estimate_step(
                filtered, self._target, expected, self._last_motion, self.parameters
            )
        else:
            record = StepRecord(increment=STILL, decision=Decision.START)
        self._started = True
        # A motion is held once: nobody saw it, so it is no ground for holding it again.
        self._last_motion = STILL if record.decision.skipped else record.increment
        self._target = Target(filtered) if len(filtered) >= MIN_PAIRS else None
        self.pose = integrate_step(self.pose, record.increment)
        return record


@dataclass(frozen=True, eq=False, kw_only=True)
class OdometryResult:
    """A whole run: `poses` (K, 3) of x, y, ψ [m, m, rad] and the K records of the steps."""

    poses: FloatArray
    records: tuple[StepRecord, ...]

    def count(self, *decisions: Decision) -> int:
        """How many steps ended in one of `decisions`."""
        return sum(record.decision in decisions for record in self.records)


def estimate_odometry(
    scans: Sequence[Scan],
    priors: ArrayLike | None = None,
    parameters: OdometryParameters | None = None,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    progress: Callable[[Iterable[Scan]], Iterable[Scan]] = iter,
) -> OdometryResult:
    """Estimate the motion of a whole log.

    Parameters
    ----------
    scans : sequence of Scan, length K
        In the order of time.
    priors : array_like, shape (K, 3) or (K−1, 3), optional
        Wheel odometry: K poses (x, y, ψ), or the K−1 increments between them.
    parameters : OdometryParameters, optional
        Matcher, limits and fallbacks.
    start : array_like, shape (3,)
        Pose of the first scan.
    progress : callable
        Wraps the scans while they are read, e.g. ``tqdm.tqdm``.

    Returns
    -------
    OdometryResult
    """
    increments = None if priors is None else _as_increments(priors, len(scans))
    odometry = ScanMatchingOdometry(parameters, start)
    poses, records = [], []
    for k, scan in enumerate(progress(scans)):
        prior = None if increments is None or k == 0 else increments[k - 1]
        records.append(odometry.update(scan, prior))
        poses.append(odometry.pose)
    return OdometryResult(poses=np.array(poses).reshape(-1, 3), records=tuple(records))


def _as_increments(priors: ArrayLike, scan_count: int) -> FloatArray:
    rows = as_floats(priors, "priors", hint="give rows (x, y, ψ) or (Δx, Δy, Δψ)")
    if rows.shape == (scan_count, 3):
        return increments_between(rows)
    if rows.shape == (scan_count - 1, 3):
        return rows
    raise InvalidPointsError(
        f"`priors` must have shape ({scan_count}, 3), a pose a scan, or ({scan_count - 1}, 3), "
        f"an increment a step, got {rows.shape}"
    )
