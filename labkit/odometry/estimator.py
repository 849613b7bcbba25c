"""Scan-matching odometry: a streaming estimator, and the same over a whole log."""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Sequence, Sized
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.correspondences import MIN_PAIRS
from labkit.deskew import Skew
from labkit.odometry.carried import NEAR
from labkit.odometry.integration import increments_between, increments_of_scanner, integrate_step
from labkit.odometry.lesson import LessonOdometry
from labkit.odometry.local_map import LocalMap
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import STILL, Decision, StepRecord
from labkit.odometry.sanity import LED, Trust, grown
from labkit.odometry.search import REMEMBERED
from labkit.odometry.step import ALIKE, estimate_step, unmatched
from labkit.result import step_length
from labkit.scan import Scan
from labkit.se2 import from_xytheta, relative, to_xytheta
from labkit.support.arrays import FloatArray, as_pose, as_poses, check_kind
from labkit.support.errors import InvalidParameterError, InvalidPointsError
from labkit.target import Target

NOTHING = Scan(points=np.empty((0, 2)))
AGAINST, BLIND = 3, 10  # matches against the prior, and steps without a match, in a row: odd
RECOVERED = "the match refused before was right: this scan fits better from there"
RESTING = 0.02, math.radians(0.5)  # [m] and [rad]: wheels that tell less say that they stand
SAME_VIEW = 0.9  # share of a scan that lies as it lay, where the robot does stand
REPEATED, SAME_SCAN = 1e-6, 0.8  # [m] a point that repeats, and their share in a scan that does


class _View(NamedTuple):
    """The last scan with points, or the first of those that repeat, and the wheels' way since."""

    scan: Target
    T_told: FloatArray = np.eye(3)

    def moved(self, prior: FloatArray | None) -> _View:
        """The same view, after the wheels told one more motion."""
        return self if prior is None else self._replace(T_told=self.T_told @ from_xytheta(prior))


class _State(NamedTuple):
    """State of the estimator between two scans."""

    pose: FloatArray
    seen: LocalMap
    taken: int = 0  # scans
    lost: int = 0  # steps since the last one that was matched
    view: _View | None = None
    motions: tuple[FloatArray, ...] = ()  # that were matched, the newest first
    last_motion: FloatArray = STILL
    trust: Trust = Trust()
    rival: _State | None = None  # the same, had the last match been believed that was refused

    def after(self, record: StepRecord, scan: Scan, prior: FloatArray | None) -> _State:
        """The state after a step, which keeps no rival."""
        matched, moved = record.decision.matched, record.increment
        # A motion is held once: nobody saw it, so it is no ground for holding it again.
        held = record.decision in (Decision.HOLD, Decision.STAND)
        sure = (moved,) if matched and not record.degenerate else ()
        return _State(
            pose=integrate_step(self.pose, moved),
            seen=self.seen.moved(scan, moved, prior, matched=matched),
            taken=self.taken + 1,
            lost=0 if matched else self.lost + 1,
            motions=(*sure, *self.motions)[:REMEMBERED],
            last_motion=STILL if held else moved,
            trust=self.trust,
        )


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
        seen = LocalMap(last_scan=self.parameters.against == "scan")
        self._state = _State(pose=as_pose(start, "start"), seen=seen)

    def __repr__(self) -> str:
        """One line: the number of scans, and the pose."""
        x, y, heading = self._state.pose.tolist()
        pose = f"({x:.3f} m, {y:.3f} m, {heading:.3f} rad)"
        return f"ScanMatchingOdometry({self._state.taken} scans, pose {pose})"

    @property
    def pose(self) -> FloatArray:
        """Pose (x, y, ψ) of the newest scan [m, m, rad], a copy."""
        return self._state.pose.copy()

    def update(self, scan: Scan | ArrayLike, prior: ArrayLike | None = None) -> StepRecord:
        """Take the next scan and move the pose.

        Parameters
        ----------
        scan : Scan or array_like, shape (N, 2)
            The newest scan, in metres; one without points is allowed.
        prior : array_like, shape (3,) or a transform, optional
            The increment (Δx, Δy, Δψ) that wheels or an IMU report; NaN stands for none. The
            first scan has none.
        """
        was, expected = self._state, None if prior is None else as_pose(prior, "prior", gaps=True)
        if expected is not None and np.isnan(expected[0]):
            expected = None
        if expected is not None and was.taken == 0:
            raise InvalidPointsError(
                f"`prior` tells the step that ends in a scan, and no step ends in the first, "
                f"got {expected.tolist()}"
            )
        filtered = self._filtered(scan)
        believed, expected, view = self._witnesses(filtered, expected)
        record, state = self._step(was, believed, expected)
        if was.rival is not None:
            other, there = self._step(was.rival, believed, expected)
            if recovers(other, record):
                wide = unmatched(expected, STILL, self._parameters(was, expected).limits)
                way = to_xytheta(relative(*from_xytheta([was.pose, there.pose])))
                record, state = returned(other, way, wide["covariance"]), there
        if believed is not filtered:  # put aside
            record = replace(record, reason="the scan repeats while the wheels move")
        self._state = state._replace(view=view)  # at once: an interrupt leaves the state before
        return replace(record, increment=record.increment.copy())

    def _witnesses(
        self, scan: Scan, prior: FloatArray | None
    ) -> tuple[Scan, FloatArray | None, _View | None]:
        """Scan and prior without the one that stands while the other moves, and the view."""
        view = self._state.view
        if not self.parameters.search or len(scan) < MIN_PAIRS:
            return scan, prior, view and view.moved(prior)
        here = _View(Target(scan))
        if view is None:
            return scan, prior, here
        off, view = view.scan.search.query(scan.points)[1], view.moved(prior)
        repeats = np.mean(off < REPEATED) >= SAME_SCAN
        if prior is not None:
            moved, turned = step_length(np.eye(3), view.T_told)
            rests = moved <= RESTING[0] and turned <= RESTING[1]
            if rests and np.mean(off < NEAR) < SAME_VIEW:
                prior = None
            elif repeats and not rests:
                scan = NOTHING
        return scan, prior, view if repeats else here

    def _step(
        self, was: _State, scan: Scan, expected: FloatArray | None
    ) -> tuple[StepRecord, _State]:
        """One step from a state, and the state after it."""
        record, trust = StepRecord(increment=STILL, decision=Decision.START), was.trust
        if was.taken > 0:
            motions = np.array([was.last_motion, *was.motions])
            parameters = self._parameters(was, expected)
            record = estimate_step(scan, was.seen, expected, motions, parameters, trust)
            if expected is not None and parameters.search and len(scan) >= MIN_PAIRS:
                matched, doubtful = record.decision.matched, record.is_doubtful
                trust = trust.after(record.increment, expected, matched=matched, doubtful=doubtful)
                if trust.wheels_lead:
                    instead = unmatched(expected, STILL, parameters.limits)
                    why = "; ".join(filter(None, [record.reason, LED]))
                    record = replace(record, **instead, reason=why)
        told = expected if self.parameters.search else None
        was = was._replace(trust=trust)
        state = was.after(record, scan, told)
        if record.refused is not None:
            believed = replace(record, increment=record.refused, decision=Decision.SEARCH)
            state = state._replace(rival=was.after(believed, scan, told))
        return record, state

    def _filtered(self, scan: Scan | ArrayLike) -> Scan:
        """The scan after the filters; an error names it."""
        if isinstance(scan, list | tuple | np.ndarray) and len(scan) == 0:
            return NOTHING
        try:
            return self.parameters.preprocessing(scan)
        except InvalidPointsError as error:
            raise InvalidPointsError(f"scan {self._state.taken}: {error}") from None

    def _parameters(self, was: _State, expected: FloatArray | None) -> OdometryParameters:
        """The step's parameters; with the search, its limits follow the motions of the run.

        If wheels tell the step, neither lost steps nor what wheels alone told before widens them.
        """
        parameters = self.parameters
        if not parameters.search:
            return parameters
        motions, lost = was.motions, 0
        if expected is None:
            motions, lost = (was.last_motion, *motions), was.lost
        return replace(parameters, limits=grown(parameters.limits, motions, lost))


def returned(other: StepRecord, way: FloatArray, covariance: FloatArray) -> StepRecord:
    """The record of a step back to a refused match, `way` from a pose of this covariance."""
    return replace(
        other,
        increment=way,
        rotation=abs(float(way[2])),
        covariance=other.covariance + covariance,
        against_prior=True,
        reason="; ".join(filter(None, [other.reason, RECOVERED])),
    )


def recovers(other: StepRecord, record: StepRecord) -> bool:
    """True if a match from where the last one was refused is to be believed, and not `record`."""
    margin = ALIKE if record.decision.matched else -ALIKE
    return not other.is_doubtful and other.agreement >= record.agreement + margin


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
        """Number of matches that were believed against a prior."""
        return sum(record.against_prior for record in self.records)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Oddities of the run: without a match, led by the wheels, or against them, for long."""
        found, steps = [], self.records[1:]
        led = [LED in record.reason for record in steps]
        blind = [not record.decision.matched for record in steps]
        if sum(blind) > 0.5 * len(steps):
            first = steps[blind.index(True)].reason.partition(", ")[0]
            found.append(
                f"{sum(blind)} of {len(steps)} steps had no match that is believed, the first "
                f"since {first}; are ranges and wheels in metres, and angles in radians? If so, "
                f"does something hide the view?"
            )
        else:
            found += [
                f"scans {first} to {last} were not matched, the first since "
                f"{self.records[first].reason.partition(', ')[0]}: their motion is the prior's, "
                f"or none"
                for first, last in _runs(
                    [b and not each for b, each in zip(blind, led, strict=True)], BLIND
                )
            ]
        found += [f"scans {first} to {last}: {LED}" for first, last in _runs(led, 1)]
        found += [
            f"scans {first} to {last} were all matched against the prior: either the wheels "
            f"failed there (are they in metres?), or something that moves was taken for the room"
            for first, last in _runs([record.against_prior for record in steps], AGAINST)
        ]
        return tuple(found)

    def __repr__(self) -> str:
        counts = Counter(record.decision.value for record in self.records)
        words = ", ".join(f"{name} {count}" for name, count in counts.items())
        against = f"; {self.against_prior} against the prior" if self.against_prior else ""
        return f"OdometryResult({len(self.records)} scans: {words}{against})"


def estimate_odometry(
    scans: Any,
    priors: ArrayLike | None = None,
    parameters: OdometryParameters | None = None,
    *,
    laser_offset: ArrayLike | None = None,
    estimator: type[ScanMatchingOdometry | LessonOdometry] | None = None,
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
        Matcher, limits and fallbacks.
    laser_offset : array_like, shape (3,), optional
        Pose of the scanner on the robot (x [m], y [m], θ [rad]), where `priors` are the robot's.
    estimator : type, optional
        `ScanMatchingOdometry` by default, or `LessonOdometry`.
    start : array_like, shape (3,) or (3, 3)
        Pose of the first scan.
    deskew : bool
        Undo the skew of sweeps that tell the time between their beams (`labkit.deskew`), by the
        wheels, or else by the mean of the last two motions.
    progress : callable
        Wraps the scans while they are matched, e.g. ``tqdm.tqdm``.

    Examples
    --------
    >>> from labkit.simulation import Lidar, room, scan_along
    >>> path = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.02], [0.2, 0.0, 0.04]]
    >>> estimate_odometry(scan_along(room(), path, Lidar(), rng=0), priors=path)
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
    check_kind(deskew, "deskew", bool)
    odometry = (estimator or ScanMatchingOdometry)(parameters, start)
    increments: FloatArray | None = None
    expected: Iterable[FloatArray | None] = repeat(None)
    if priors is not None:
        sweeps = sweeps if isinstance(sweeps, Sized) else list(sweeps)
        increments = _as_increments(priors, len(sweeps))
        if laser_offset is not None:
            increments = increments_of_scanner(increments, laser_offset)
        expected = chain([None], increments)
    match = partial(_match_pair, parameters=parameters)
    skew = Skew(increments, sweeps, match) if deskew else None
    poses, records = list[FloatArray](), list[StepRecord]()
    for scan, prior in zip(progress(sweeps), expected, strict=False):
        last_motion = records[-1].increment if records else None
        straight = scan if skew is None else skew.undo(scan, last_motion)
        records.append(odometry.update(straight, prior))
        poses.append(odometry.pose)
    result = OdometryResult(poses=np.array(poses).reshape(-1, 3), records=tuple(records))
    for remark in result.remarks:
        warnings.warn(remark, stacklevel=2)
    return result


def _runs(odd: Iterable[bool], least: int) -> Iterable[tuple[int, int]]:
    """First and last scan of each run of odd steps, of at least so many; step k ends in scan k."""
    for is_odd, run in groupby(enumerate(odd, 1), lambda each: each[1]):
        scans = [k for k, _ in run]
        if is_odd and len(scans) >= least:
            yield scans[0], scans[-1]


def _match_pair(pair: Sequence[Scan], parameters: OdometryParameters | None) -> FloatArray:
    """The motion from the first scan to the second, both taken as they are."""
    return estimate_odometry(pair, parameters=parameters, deskew=False).records[1].increment


def _as_increments(priors: ArrayLike, scan_count: int) -> FloatArray:
    rows = as_poses(priors, "priors", gaps=True)
    if len(rows) not in (scan_count, scan_count - 1):
        raise InvalidPointsError(
            f"`priors` must have shape ({scan_count}, 3), a pose a scan, or "
            f"({scan_count - 1}, 3), an increment a step, got {np.shape(priors)}"
        )
    return rows if len(rows) < scan_count else increments_between(rows)
