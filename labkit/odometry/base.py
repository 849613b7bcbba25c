"""The protocol of an odometry: one scan at a time, each with what the wheels tell of its step.

An estimator says how one step is taken (`advance`), from one state to the next. What all of
them have in common stands here: the checks of what a caller passes, the place of the scanner on the
robot, the skew of sweeps, the filters, the remarks, and that a scan is taken as a whole or not at
all, wherever an interrupt falls.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from labkit.deskew import Velocities, deskew, is_skewed
from labkit.odometry.bent_walls import curvature, is_sampled
from labkit.odometry.constants import KEPT_STEPS
from labkit.odometry.integration import increments_of_scanner
from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import Evidence, StepRecord
from labkit.odometry.remarks import Step, largest_range, remarks_on
from labkit.scan import Scan, check_angles
from labkit.se2 import check_headings, wrap
from labkit.support.arrays import FloatArray, as_pose, check_kind
from labkit.support.errors import InvalidPointsError

NO_POINTS = Scan(points=np.empty((0, 2)))
State = TypeVar("State", bound=Any)  # with a `pose`, and the number of its `scans`


class Run(NamedTuple):
    """State of a run between two scans."""

    state: Any  # of the estimator
    velocities: Velocities = Velocities()
    first_scan: Any = None  # as it came: the second one tells its velocity, and how it was skewed
    steps: tuple[Step, ...] = ()  # the last ones


class Odometry(ABC, Generic[State]):
    """Odometry one scan at a time, for a robot that is driving now.

    Parameters
    ----------
    parameters : OdometryParameters, optional
        Matcher, limits and filters.
    start : array_like, shape (3,) or (3, 3)
        Pose of the first scan.
    laser_offset : array_like, shape (3,), optional
        Pose of the scanner on the robot (x [m], y [m], θ [rad]), where priors are the robot's.
    deskew : bool
        Undo the skew of sweeps that tell the time between their beams (`labkit.deskew`), by the
        wheels, or else by the mean of the last two motions. The first sweep is straightened when
        the second one tells how fast the scanner moved.
    """

    def __init__(
        self,
        parameters: OdometryParameters | None = None,
        start: ArrayLike = (0.0, 0.0, 0.0),
        *,
        laser_offset: ArrayLike | None = None,
        deskew: bool = True,
    ) -> None:
        self.parameters = OdometryParameters() if parameters is None else parameters
        check_kind(self.parameters, "parameters", OdometryParameters)
        check_kind(deskew, "deskew", bool)
        pose = as_pose(start, "start")
        check_angles(pose[2:], "start")
        if laser_offset is not None:
            increments_of_scanner(np.zeros((1, 3)), laser_offset)  # refuses what is none
        self._laser_offset = laser_offset
        self._deskew = deskew
        self._run = Run(self.begin(pose))

    @abstractmethod
    def begin(self, pose: FloatArray) -> State:
        """The state before the first scan."""

    @abstractmethod
    def advance(
        self, state: State, scan: Scan, prior: FloatArray | None
    ) -> tuple[StepRecord, State]:
        """One step: its record, and the state after it. It changes nothing else."""

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
        expected = self._check_prior(prior)
        record, self._run = self._advance_run(self._run, scan, expected)
        return replace(record, increment=record.increment.copy())  # the caller may change it

    def _advance_run(
        self, run: Run, scan: Scan | ArrayLike, prior: FloatArray | None
    ) -> tuple[StepRecord, Run]:
        """One step of the run, of a scan as it came."""
        count = run.state.scans
        if count == 1 and (first_sweep := self._skewed(run.first_scan)) is not None:
            run = self._straighten_first(run, first_sweep, scan, prior)
        skewed = self._skewed(scan)
        velocity = run.velocities.during(scan, prior)
        straight = scan if skewed is None or velocity is None else deskew(skewed, velocity)
        record, state = self.advance(run.state, self._filter(straight), prior)
        bare = replace(record, evidence=Evidence(record.evidence.std))
        step = Step(
            record=bare,
            told=prior,
            stamp=scan.stamp if isinstance(scan, Scan) else math.nan,
            largest=largest_range(scan),
            curvature=curvature(scan, run.first_scan) if is_sampled(count) else math.nan,
        )
        after = Run(
            state=state,
            velocities=run.velocities.after(scan, record.increment),
            first_scan=scan if count == 0 else run.first_scan,
            steps=(*run.steps[1 - KEPT_STEPS :], step),
        )
        return record, after

    def _skewed(self, scan: Any) -> Scan | None:
        """The scan if its skew is undone; else None."""
        return scan if self._deskew and isinstance(scan, Scan) and is_skewed(scan) else None

    def _straighten_first(
        self, run: Run, first_sweep: Scan, scan: Scan | ArrayLike, prior: FloatArray | None
    ) -> Run:
        """The run after its first sweep, straightened: the second one tells its velocity.

        Without wheels both are matched as they are: they are skewed nearly alike.
        """
        duration = run.velocities.time_to(scan)
        if math.isnan(duration):
            return run
        motion = prior
        if motion is None:
            motion = self.advance(run.state, self._filter(scan), None)[0].increment
        velocity = motion / duration
        straight = self._filter(deskew(first_sweep, velocity))
        _, state = self.advance(self.begin(np.array(run.state.pose)), straight, None)
        return run._replace(state=state, velocities=run.velocities._replace(of_steps=(velocity,)))

    @property
    def pose(self) -> FloatArray:
        """Pose (x, y, ψ) of the newest scan [m, m, rad], a copy."""
        return np.array(self._run.state.pose)

    @property
    def remarks(self) -> tuple[str, ...]:
        """The likeliest cause of what is odd in the last 500 steps as a whole, or nothing."""
        return remarks_on(self._run.steps, self._run.state.scans - len(self._run.steps))

    @property
    def last_step(self) -> Step:
        """The newest step, as the remarks on a run need it."""
        return self._run.steps[-1]

    def __repr__(self) -> str:
        """One line: the number of scans, and the pose."""
        x, y, heading = self.pose.tolist()
        pose = f"({x:.3f} m, {y:.3f} m, {heading:.3f} rad)"
        return f"{type(self).__name__}({self._run.state.scans} scans, pose {pose})"

    def _check_prior(self, prior: ArrayLike | None) -> FloatArray | None:
        """The prior as a row (3,), or None where there is none."""
        if prior is None:
            return None
        expected = as_pose(prior, "prior", gaps=True)
        if np.isnan(expected[0]):
            return None
        check_headings(expected[2:], "prior")
        expected[2] = wrap(expected[2])  # of a difference of two headings
        if self._run.state.scans == 0:
            raise InvalidPointsError(
                f"the first scan has no `prior`: pass None, got {expected.tolist()}"
            )
        if self._laser_offset is not None:
            expected = increments_of_scanner(expected[None], self._laser_offset)[0]
        return expected

    def _filter(self, scan: Scan | ArrayLike) -> Scan:
        """The scan after the filters; an error names it."""
        is_empty_array = isinstance(scan, np.ndarray) and scan.shape[:1] == (0,)
        if is_empty_array or (isinstance(scan, list | tuple) and not scan):
            return NO_POINTS
        try:
            return self.parameters.preprocessing(scan)
        except InvalidPointsError as error:
            raise InvalidPointsError(f"scan {self._run.state.scans}: {error}") from None
