"""A 2D LiDAR scan: its points, the beams they came from, and its time (section 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labkit.se2 import matrices_of, transform, wrap
from labkit.support.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    as_finite,
    as_floats,
    as_numbers,
    as_points,
    as_poses,
    check_range,
    is_number,
    read_only,
)
from labkit.support.errors import InvalidParameterError, InvalidPointsError

LONGEST_RANGE = 1e5  # [m]; larger values are codes for no return
MOST_TURN = 1.05 * 2.0 * math.pi  # [rad]; scanners that turn all round may overlap a little


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Scan:
    """One sweep of a planar scanner, in the scanner's own frame (x ahead, y left).

    Attributes
    ----------
    points : ndarray, shape (N, 2)
        The returns in metres, in beam order where the scan has beams; checked when it is made.
    beams : ndarray of int, shape (N,), or None
        The beam that each point came from; None for points without a scan order.
    ranges, angles : ndarray, shape (B,), or None
        All B beams as measured [m] and their directions [rad], no-returns included.
    stamp : float
        Time in seconds of the first beam; NaN where the file has none.
    time_increment : float
        Time in seconds from one beam to the next; 0 where it is unknown, or where all beams count
        as measured at once.

    Notes
    -----
    The arrays are the scan's own and read-only: targets, matches and maps may share one scan.
    """

    points: FloatArray
    beams: IntArray | None = None
    ranges: FloatArray | None = None
    angles: FloatArray | None = None
    stamp: float = math.nan
    time_increment: float = 0.0

    def __post_init__(self) -> None:
        points = as_points(self.points, "points", minimum=0)
        object.__setattr__(self, "points", read_only(points))
        if self.beams is not None:
            object.__setattr__(self, "beams", read_only(_as_beams(self.beams, len(points))))
        for name in ("ranges", "angles"):
            if (values := getattr(self, name)) is not None:
                object.__setattr__(self, name, _as_beam_values(values, name))
        if self.ranges is not None and self.angles is not None:
            _expect_alike(self.ranges, self.angles)
        if self.ranges is not None and self.beams is not None:
            _expect_within(self.beams, len(self.ranges))
        _check_times(self.stamp, self.time_increment)

    @classmethod
    def from_ranges(
        cls,
        ranges: ArrayLike,
        angles: ArrayLike,
        *,
        stamp: float = math.nan,
        time_increment: float = 0.0,
        range_min: float = 0.0,
        range_max: float = math.inf,
    ) -> Scan:
        """Points r·(cos α, sin α) of the beams with ``range_min < r < range_max``.

        All others (NaN, masked, beyond 100 km) are no-returns and make no point. A scan in
        which no beam returned is legal and has no points. Angles are radians within one turn.

        Examples
        --------
        >>> Scan.from_ranges([1.0, np.inf], [0.0, 0.1]).points.tolist()
        [[1.0, 0.0]]
        """
        if np.ma.isMaskedArray(ranges):
            ranges = np.ma.filled(ranges.astype(float), np.nan)
        range_min = check_range(range_min, "range_min", unit="m")
        range_max = check_range(range_max, "range_max", above=range_min, unit="m")
        _check_times(stamp, time_increment)
        r = _as_beam_values(ranges, "ranges")
        alpha = _as_beam_values(angles, "angles")
        _expect_alike(r, alpha)
        beams = np.flatnonzero(is_return(r, range_min, range_max))
        if len(beams) == len(r):
            beams = _all_beams(len(r))
        points = np.empty((len(beams), 2))
        points[:, 0] = r[beams] * np.cos(alpha[beams])
        points[:, 1] = r[beams] * np.sin(alpha[beams])
        return scan_of_checked(
            read_only(points),
            beams=read_only(beams),
            ranges=r,
            angles=alpha,
            stamp=stamp,
            time_increment=time_increment,
        )

    @classmethod
    def from_points(cls, points: ArrayLike) -> Scan:
        """A scan of bare points, shape (N, 2) [m], in no particular order; N may be 0."""
        return cls(points=points)  # type: ignore[arg-type]  # checked when it is made

    def __len__(self) -> int:
        return len(self.points)

    def __reduce__(self) -> tuple[Any, ...]:
        """Made anew where it is unpickled: its arrays are read-only there, too."""
        return partial(type(self), **vars(self)), ()

    def __repr__(self) -> str:
        beams = "" if self.ranges is None else f" of {len(self.ranges)} beams"
        stamp = "" if math.isnan(self.stamp) else f", {self.stamp:.10g} s"
        return f"Scan({len(self)} points{beams}{stamp})"

    def select(self, kept: BoolArray | IntArray) -> Scan:
        """Scan of the points named by a mask or by indices, their beams included."""
        kept = as_selection(kept, len(self))
        beams = None if self.beams is None else self.beams[kept]
        return replace(self, points=self.points[kept], beams=beams)


def scan_of_checked(points: FloatArray, **parts: Any) -> Scan:
    """A scan of read-only parts that are checked by now, without a second look at them."""
    scan = object.__new__(Scan)
    vars(scan).update(points=points, **parts)  # the class holds the others' defaults
    return scan


def is_return(ranges: FloatArray, range_min: float, range_max: float) -> BoolArray:
    """Mask of the ranges [m] that make a point: strictly within the band, and no code."""
    return (ranges > range_min) & (ranges < min(range_max, LONGEST_RANGE))


def as_selection(kept: BoolArray | IntArray, count: int) -> BoolArray | IntArray:
    """Check a mask of `count` points, or indices below it."""
    try:
        selection: NDArray[Any] = np.asarray(kept)
    except ValueError:  # ragged
        selection = np.array(None)
    if selection.shape == (0,):
        selection = selection.astype(np.intp)
    is_mask = selection.dtype == np.bool_ and selection.shape == (count,)
    is_index = selection.ndim == 1 and selection.dtype.kind in "iu"
    if is_mask or (is_index and np.all((selection >= -count) & (selection < count))):
        return selection
    raise InvalidPointsError(
        f"`kept` must be a mask of {count} points or their indices, got {kept!r:.80}"
    )


def _as_beam_values(values: ArrayLike, name: str) -> FloatArray:
    """Check ranges or angles, shape (B,); copied unless nobody can write into the array."""
    if is_immutable(values) and values.dtype == np.float64 and values.ndim == 1:
        checked = values
    else:
        hint = "give one per beam; points go through `Scan.from_points`"
        checked = read_only(as_floats(values, name, hint, ("B",)))
    if name == "angles":
        check_angles(checked, name)
    return checked


def check_angles(angles: FloatArray, name: str) -> None:
    """Raise an error unless directions of beams [rad] are finite and within one turn."""
    low = float(angles.min(initial=0.0))
    high = float(angles.max(initial=0.0))
    if not max(high - low, -low, high) <= MOST_TURN:
        as_finite(angles, name)
        raise InvalidParameterError(
            f"must be radians within one turn, got {low:.6g} to {high:.6g}: are these degrees? "
            f"use `np.radians` in Python: 90 degrees are 1.5708",
            parameter=name,
        )


def is_immutable(values: object) -> TypeGuard[NDArray[Any]]:
    """Recognise a read-only array that owns its memory: nobody can write into it."""
    return type(values) is np.ndarray and values.base is None and not values.flags.writeable


def _check_times(stamp: float, time_increment: float) -> None:
    """Check a scan's time and the time from one beam to the next [s]."""
    if not is_number(stamp):
        message = f"must be a time in seconds, or NaN, got {stamp!r:.80}"
        raise InvalidParameterError(message, parameter="stamp")
    check_range(time_increment, "time_increment", at_least=0.0, at_most=1.0, unit="s")


def _expect_alike(ranges: FloatArray, angles: FloatArray) -> None:
    if ranges.shape != angles.shape:
        raise InvalidPointsError(
            f"`ranges` and `angles` must have one shape (B,), got {ranges.shape} and "
            f"{angles.shape}; `np.linspace(first, last, {len(ranges)})` gives each beam its angle"
        )


def _expect_within(beams: IntArray, beam_count: int) -> None:
    if not np.all((beams >= 0) & (beams < beam_count)):
        raise InvalidPointsError(
            f"`beams` must count `ranges` from 0 to {beam_count - 1}, got {beams.min()} to "
            f"{beams.max()}"
        )


@lru_cache(maxsize=64)
def _all_beams(count: int) -> IntArray:
    """Indices of all beams, read-only: scans in which each beam returned share them."""
    return read_only(np.arange(count))


def _as_beams(beams: IntArray, count: int) -> IntArray:
    if is_immutable(beams):
        checked = beams
    else:
        try:
            checked = np.array(beams)
        except ValueError:  # rows of unequal lengths
            checked = np.array(None)
    if checked.shape != (count,) or not (count == 0 or np.issubdtype(checked.dtype, np.integer)):
        raise InvalidPointsError(
            f"`beams` must be {count} whole numbers, one per point, got shape {checked.shape} "
            f"of {checked.dtype}"
        )
    steps = np.diff(checked)
    if not (np.all(steps > 0) or np.all(steps < 0)):  # a sweep may run backwards
        at = int(np.argmax(steps <= 0 if steps[0] > 0 else steps >= 0))
        raise InvalidPointsError(
            f"`beams` must all rise or all fall, got {checked[at : at + 2].tolist()} at index {at}"
        )
    return checked.astype(np.intp, copy=False)


def as_scan(scan: Scan | ArrayLike, name: str = "points", minimum: int = 0) -> Scan:
    """Return `scan` if it is one, else a scan of its points; of at least `minimum` points."""
    if isinstance(scan, Scan) and len(scan) >= minimum:
        return scan
    return Scan(points=as_points(scan, name, minimum))


def scanner_poses(poses: ArrayLike, laser_offset: ArrayLike) -> FloatArray:
    """Poses of the scanner from those of the robot: ``T_w_laser = T_w_robot @ T_robot_laser``.

    Rows (x [m], y [m], θ [rad]), shape (K, 3); `laser_offset` is ``T_robot_laser``, shape (3,).

    >>> scanner_poses([[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 2]], (0.25, 0.0, 0.0)).round(9).tolist()
    [[0.25, 0.0, 0.0], [1.0, 0.25, 1.570796327]]
    """
    rows = as_poses(poses, "poses")
    x, y, theta = offset = as_numbers(laser_offset, "laser_offset")
    check_angles(offset[2:], "laser_offset")
    T_w_laser = matrices_of(rows) @ transform(x, y, 0.0)
    return np.column_stack([T_w_laser[:, :2, 2], wrap(rows[:, 2] + theta)])
