"""The protocol of an odometry: one scan at a time, each with what the wheels tell of its step.

An estimator says how one step is taken (`advance`), from one state to the next. What all of
them have in common stands here: the checks of what a caller passes, the filters, and that a scan is
taken as a whole or not at all, wherever an interrupt falls.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from labkit.odometry.parameters import OdometryParameters
from labkit.odometry.record import StepRecord
from labkit.scan import Scan, check_angles
from labkit.se2 import check_headings, wrap
from labkit.support.arrays import FloatArray, as_pose, check_kind
from labkit.support.errors import InvalidPointsError

NO_POINTS = Scan(points=np.empty((0, 2)))
State = TypeVar("State", bound=Any)  # with a `pose`, and the number of its `scans`


class Odometry(ABC, Generic[State]):
    """Odometry one scan at a time, for a robot that is driving now.

    Parameters
    ----------
    parameters : OdometryParameters, optional
        Matcher, limits and filters.
    start : array_like, shape (3,) or (3, 3)
        Pose of the first scan.
    """

    def __init__(
        self, parameters: OdometryParameters | None = None, start: ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        self.parameters = OdometryParameters() if parameters is None else parameters
        check_kind(self.parameters, "parameters", OdometryParameters)
        pose = as_pose(start, "start")
        check_angles(pose[2:], "start")
        self._state = self.begin(pose)

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
        filtered = self._filter(scan)
        record, self._state = self.advance(self._state, filtered, expected)
        return replace(record, increment=record.increment.copy())  # the caller may change it

    @property
    def pose(self) -> FloatArray:
        """Pose (x, y, ψ) of the newest scan [m, m, rad], a copy."""
        return np.array(self._state.pose)

    def __repr__(self) -> str:
        """One line: the number of scans, and the pose."""
        x, y, heading = self.pose.tolist()
        pose = f"({x:.3f} m, {y:.3f} m, {heading:.3f} rad)"
        return f"{type(self).__name__}({self._state.scans} scans, pose {pose})"

    def _check_prior(self, prior: ArrayLike | None) -> FloatArray | None:
        """The prior as a row (3,), or None where there is none."""
        if prior is None:
            return None
        expected = as_pose(prior, "prior", gaps=True)
        if np.isnan(expected[0]):
            return None
        check_headings(expected[2:], "prior")
        expected[2] = wrap(expected[2])  # of a difference of two headings
        if self._state.scans == 0:
            raise InvalidPointsError(
                f"the first scan has no `prior`: pass None, got {expected.tolist()}"
            )
        return expected

    def _filter(self, scan: Scan | ArrayLike) -> Scan:
        """The scan after the filters; an error names it."""
        is_empty_array = isinstance(scan, np.ndarray) and scan.shape[:1] == (0,)
        if is_empty_array or (isinstance(scan, list | tuple) and not scan):
            return NO_POINTS
        try:
            return self.parameters.preprocessing(scan)
        except InvalidPointsError as error:
            raise InvalidPointsError(f"scan {self._state.scans}: {error}") from None
