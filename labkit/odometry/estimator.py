"""Scan-matching odometry: a streaming estimator, and the same over a whole log."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Sized
from dataclasses import dataclass, replace
from itertools import chain, repeat
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.correspondences import MIN_PAIRS
from labkit.odometry.carried import stands
from labkit.odometry.integration import as_row, as_rows, increments_between, integrate_step
from labkit.odometry.local_map import LocalMap
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.sanity import grown
from labkit.odometry.search import REMEMBERED
from labkit.odometry.step import STILL, Decision, StepRecord, estimate_step
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, check_kind
from labkit.support.errors import InvalidPointsError

RESTING = 0.02, math.radians(0.5)  # [m] and [rad]: wheels that tell less say that they stand
SAME_VIEW = 0.9  # share of a scan that lies as it lay, where the robot does stand


class ScanMatchingOdometry:
    """Odometry one scan at a time, for a robot that is driving now.

    Between calls it holds the map (or the scan before), the pose and the last motions, as the
    lesson's Simulink block does in persistent variables: never more, however long the drive.

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
        self, parameters: OdometryParameters | None = None, start: ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        self.parameters = OdometryParameters() if parameters is None else parameters
        check_kind(self.parameters, "parameters", OdometryParameters)
        self.pose = as_row(start, "start")
        self._seen = LocalMap(last_scan=self.parameters.against == "scan")
        self._earlier_motions: deque[FloatArray] = deque(maxlen=REMEMBERED)  # the newest first
        self._last_motion: FloatArray | None = None
        self._lost = 0  # steps since the last one that was matched, or taken from a prior
        self._before = self._seen.key

    def update(self, scan: Scan | ArrayLike, prior: ArrayLike | None = None) -> StepRecord:
        """Take the next scan and move the pose.

        Parameters
        ----------
        scan : Scan or array_like, shape (N, 2)
            The newest scan, in metres.
        prior : array_like, shape (3,) or (3, 3), optional
            The increment (Δx, Δy, Δψ), or its transform, that wheels or an IMU report.
        """
        expected = None if prior is None else as_row(prior, "prior")
        filtered = self.parameters.preprocessing(scan)
        record = StepRecord(increment=STILL, decision=Decision.START)
        if self.parameters.search and expected is not None and self._denies(filtered, expected):
            expected = None
        if self._last_motion is not None:
            motions = np.array([self._last_motion, *self._earlier_motions])
            limits = self.parameters.limits
            if self.parameters.search:
                limits = grown(limits, motions, self._lost)
            record = estimate_step(
                filtered,
                self._seen.target,
                expected,
                motions,
                replace(self.parameters, limits=limits),
                T_target_last=self._seen.T_target_last,
                key=self._seen.key,
            )
        # A motion is held once: nobody saw it, so it is no ground for holding it again.
        held = record.decision in (Decision.HOLD, Decision.STAND)
        self._lost = self._lost + 1 if held else 0
        self._last_motion = STILL if held else record.increment
        if record.decision.matched and not record.degenerate:
            self._earlier_motions.appendleft(record.increment)
        told = self.parameters.search and expected is not None
        self._seen.add(filtered, record.increment, matched=record.decision.matched, told=told)
        self._before = filtered
        self.pose = integrate_step(self.pose, record.increment)
        return record

    def _denies(self, scan: Scan, expected: FloatArray) -> bool:
        """True if wheels stand, and the scan does not."""
        is_still = (
            math.hypot(expected[0], expected[1]) < RESTING[0] and abs(expected[2]) < RESTING[1]
        )
        if not is_still or min(len(self._before), len(scan)) < MIN_PAIRS:
            return False
        return bool(stands(scan, self._before).mean() < SAME_VIEW)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class OdometryResult:
    """A whole run: `poses` (K, 3) of x, y, ψ [m, m, rad] and the K records of the steps."""

    poses: FloatArray
    records: tuple[StepRecord, ...]

    def count(self, *decisions: Decision) -> int:
        """Number of steps that ended in one of `decisions`."""
        return sum(record.decision in decisions for record in self.records)

    @property
    def against_prior(self) -> int:
        """Number of matches that were believed against a prior without support."""
        return sum(record.against_prior for record in self.records)

    def __repr__(self) -> str:
        counts = Counter(record.decision.value for record in self.records)
        words = ", ".join(f"{name} {count}" for name, count in counts.items())
        against = f"; {self.against_prior} against the prior" if self.against_prior else ""
        return f"OdometryResult({len(self.records)} scans: {words}{against})"


def estimate_odometry(
    scans: Iterable[Scan | ArrayLike],
    priors: ArrayLike | None = None,
    parameters: OdometryParameters | None = None,
    *,
    start: ArrayLike = (0.0, 0.0, 0.0),
    progress: Callable[[Iterable[Any]], Iterable[Any]] = iter,
) -> OdometryResult:
    """Estimate the motion of a whole log.

    Parameters
    ----------
    scans : iterable of Scan or array_like, length K
        In the order of time; they are gone through once.
    priors : array_like, shape (K, 3) or (K−1, 3), or (K, 3, 3) or (K−1, 3, 3), optional
        Wheel odometry: K poses, or the K−1 increments between them, as rows or transforms.
    parameters : OdometryParameters, optional
        Matcher, limits and fallbacks.
    start : array_like, shape (3,) or (3, 3)
        Pose of the first scan.
    progress : callable
        Wraps the scans while they are matched, e.g. ``tqdm.tqdm``.

    Examples
    --------
    >>> from labkit.simulation import Lidar, room, scan_along
    >>> path = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.2, 0.0, 0.04]]
    >>> estimate_odometry(scan_along(room(), path, Lidar(), rng=0), priors=path)
    OdometryResult(3 scans: start 1, icp 2)
    """
    odometry = ScanMatchingOdometry(parameters, start)
    expected: Iterable[FloatArray | None] = repeat(None)
    if priors is not None:
        scans = scans if isinstance(scans, Sized) else list(scans)
        expected = chain([None], _as_increments(priors, len(scans)))
    poses, records = list[FloatArray](), list[StepRecord]()
    for scan, prior in zip(progress(scans), expected, strict=False):
        records.append(odometry.update(scan, prior))
        poses.append(odometry.pose)
    return OdometryResult(poses=np.array(poses).reshape(-1, 3), records=tuple(records))


def _as_increments(priors: ArrayLike, scan_count: int) -> FloatArray:
    rows = as_rows(priors, "priors")
    if len(rows) not in (scan_count, scan_count - 1):
        raise InvalidPointsError(
            f"`priors` must have shape ({scan_count}, 3), a pose a scan, or "
            f"({scan_count - 1}, 3), an increment a step, got {np.shape(priors)}"
        )
    return increments_between(rows) if len(rows) == scan_count else rows
