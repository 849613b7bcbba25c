"""The options of a caller who knows a log: they go before what the file says."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.columns import METRES, RADIANS
from labkit.scan import check_angles
from labkit.support.arrays import (
    FloatArray,
    IntArray,
    as_numbers,
    check_choice,
    check_count,
    check_kind,
    check_range,
)
from labkit.support.errors import InvalidParameterError

Odometry = str | os.PathLike[str] | tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, eq=False, kw_only=True)
class LogOptions:
    """Options of `read_log`, checked when the object is made.

    An option that the format of the file cannot use is refused.

    Attributes
    ----------
    scans, start : int, optional
        Read so many scans (default all), from this one on, counted from 0. No more of the file
        is read than they need, but of a table of points.
    angles : array_like, shape (2,), optional
        Directions [rad] of the first and the last beam; the others lie between them at one step.
        A table of ranges needs them, unless its columns tell them.
    range_min, range_max : float, optional
        The band in which a range makes a point [m].
    range_unit, angle_unit : str, optional
        Units of the file's ranges (or points) and angles: ``"mm"``, ``"cm"``, ``"m"``; ``"deg"``,
        ``"rad"``. A declared band counts in that unit, too, unless most ranges would lie outside.
    blind_beams : array_like of int, optional
        Numbers of beams, counted from 0, that see the robot itself and make no point.
    mirrored : bool, optional
        The scanner hangs upside down, or counts its angles clockwise: they change their sign. By
        default as the transforms of a bag say, else false.
    time_increment : float, optional
        Time from one beam to the next [s]; 0 if all beams count as measured at once.
    no_return : array_like, optional
        Ranges [m] that mean "nothing came back", to 1.5 mm; ``()`` for none. By default the
        known code with which a log's ranges end, named in `Log.remarks`.
    laser_offset : array_like, shape (3,), optional
        Pose of the scanner on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), for
        a text that does not declare it itself: ``T_w_laser = T_w_robot @ T_robot_laser``. By
        default as the transforms of a bag say, else zero.
    odometry : path-like or tuple (times, poses), optional
        Wheel odometry of the robot in place of the log's own: a file (a table of poses such as
        TUM, a bag, CARMEN), or times [s], shape (M,), with poses, shape (M, 3). They are joined
        by the stamps of the scans; poses of a table without a clock go one a scan.
    topic, odometry_topic : str, optional
        In a bag: the topic of the scans and of the odometry, where there are several.
    frame : str, optional
        The scanner's frame, where scans of several scanners stand on one topic; by default that
        of the first scan.
    strict : bool
        Raise at the first damaged line instead of skipping it into `Log.skipped`.
    name : str, optional
        Name of the file in messages, in place of its path.
    """

    scans: int | None = None
    start: int = 0
    angles: ArrayLike | None = None
    range_min: float | None = None
    range_max: float | None = None
    range_unit: str | None = None
    angle_unit: str | None = None
    blind_beams: ArrayLike | None = None
    mirrored: bool | None = None
    time_increment: float | None = None
    no_return: ArrayLike | None = None
    laser_offset: ArrayLike | None = None
    odometry: Odometry | None = None
    topic: str | None = None
    odometry_topic: str | None = None
    frame: str | None = None
    name: str | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        for name in ("topic", "odometry_topic", "frame", "name"):
            check_kind(getattr(self, name), name, str, type(None))
        check_kind(self.strict, "strict", bool)
        check_angles(self.offset[2:], "laser_offset")
        check_count(self.start, "start", at_least=0, at_most=sys.maxsize)
        if self.scans is not None:
            check_count(self.scans, "scans", at_least=1, at_most=sys.maxsize)
        check_kind(self.mirrored, "mirrored", bool, type(None))
        check_choice(self.range_unit, "range_unit", *METRES, None)
        check_choice(self.angle_unit, "angle_unit", *RADIANS, None)
        low = 0.0 if self.range_min is None else self.range_min
        check_range(low, "range_min", at_least=0.0, unit="m")
        if self.range_max is not None:
            check_range(self.range_max, "range_max", above=low, unit="m")
        if self.time_increment is not None:
            check_range(self.time_increment, "time_increment", at_least=0.0, at_most=1.0, unit="s")
        if self.directions is not None:
            check_angles(np.array(self.directions), "angles")
            if self.directions[0] == self.directions[1]:
                raise InvalidParameterError(
                    f"must differ for the first and the last beam, got {self.directions!r}",
                    parameter="angles",
                )
        if self.blind.dtype.kind not in "iu" or (self.blind < 0).any():
            raise InvalidParameterError(
                f"must be whole numbers of beams, from 0 on, got {self.blind_beams!r:.80}",
                parameter="blind_beams",
            )
        given = self.odometry
        is_pair = isinstance(given, Sequence) and len(given) == 2
        if not (given is None or isinstance(given, str | os.PathLike) or is_pair):
            raise InvalidParameterError(
                f"must be a file, or (times, poses), got {given!r:.80}",
                parameter="odometry",
            )

    @property
    def part(self) -> tuple[int, int | None]:
        """Numbers of the first scan of the part, and of the first one behind it."""
        end = None if self.scans is None else min(self.start + self.scans, sys.maxsize)
        return self.start, end

    @cached_property
    def directions(self) -> tuple[float, float] | None:
        """Directions of the first and the last beam [rad], where the caller tells them."""
        if self.angles is None:
            return None
        first, last = as_numbers(self.angles, "angles", "first, last [rad]")
        return float(first), float(last)

    @cached_property
    def blind(self) -> IntArray:
        """Numbers of the beams that make no point."""
        given = np.zeros(0, np.intp) if self.blind_beams is None else self.blind_beams
        return np.asarray(given).ravel()

    @property
    def offset(self) -> FloatArray:
        """The scanner's place on the robot by the caller, (3,), or zero."""
        given = np.zeros(3) if self.laser_offset is None else self.laser_offset
        return as_numbers(given, "laser_offset")
