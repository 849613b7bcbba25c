"""Undo the skew of a sweep: the scanner moves on while its beams turn.

A scan has one pose, but beam k is measured ``k · time_increment`` later than the first. At 10 Hz a
robot that turns by 90 degrees a second has turned by 9 degrees when the last beam comes back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.scan import Scan
from labkit.support.arrays import FloatArray, as_numbers, check_kind


def deskew(scan: Scan, velocity: ArrayLike) -> Scan:
    """Move each point to where the scanner would have seen it at the time of the first beam.

    Parameters
    ----------
    scan : Scan
        With `beams` and `time_increment`; where one of them is missing, it comes back as it is.
    velocity : array_like, shape (3,)
        Of the scanner in its own frame: m/s ahead, m/s to the left, rad/s.

    Notes
    -----
    When beam k sees ``p_k``, the scanner has moved on for ``t = k · time_increment``. At the first
    beam the point lay at ``p = R(ω t) p_k + t (v_x, v_y)``.

    Examples
    --------
    >>> sweep = Scan.from_ranges([1.0, 1.0], [0.0, 0.0], time_increment=0.1)
    >>> deskew(sweep, (5.0, 0.0, 0.0)).points.tolist()
    [[1.0, 0.0], [1.5, 0.0]]
    """
    check_kind(scan, "scan", Scan)
    v_x, v_y, omega = as_numbers(velocity, "velocity", "m/s, m/s, rad/s")
    if scan.time_increment == 0.0 or scan.beams is None:
        return scan
    t = scan.beams * scan.time_increment
    c, s = np.cos(omega * t), np.sin(omega * t)
    x, y = scan.points.T
    points = np.column_stack([c * x - s * y + v_x * t, s * x + c * y + v_y * t])
    return replace(scan, points=points, time_increment=0.0)


class Skew:
    """The skew of the sweeps of a run, which are given one after the other.

    While sweep k lasts, the scanner moves on to the pose of sweep k + 1. Its velocity comes from
    the wheels. Without wheels it is the mean velocity of the last two steps; for the first sweep
    it is that from the first sweep to the second. (The velocity of the last step alone would not
    do: an error of one step would come back in the next one with the other sign.)
    """

    def __init__(
        self, increments: FloatArray | None, scans: Any, match: Callable[[Any], FloatArray]
    ) -> None:
        """Prepare for scans; `match` finds the motion from the first to the second, as they are."""
        self._of_wheels = None if increments is None else _wheel_velocities(increments, scans)
        self._of_steps: list[FloatArray] = []  # velocity of each step so far
        if increments is None and isinstance(scans, Sequence) and len(scans) > 1:
            self._match_first_two(scans[:2], match)
        self._stamps: list[float] = []

    def _match_first_two(self, pair: Sequence[Any], match: Callable[[Any], FloatArray]) -> None:
        """Find the first velocity from two sweeps as they are: both are skewed nearly alike."""
        if any(getattr(scan, "time_increment", 0.0) == 0.0 for scan in pair):
            return
        duration = pair[1].stamp - pair[0].stamp
        if duration > 0.0:
            self._of_steps.append(match(pair) / duration)

    def undo(self, scan: Any, last_motion: FloatArray | None) -> Any:
        """Straighten the next scan of the run; `last_motion` led to the scan before it."""
        k = len(self._stamps)
        self._stamps.append(getattr(scan, "stamp", math.nan))
        if k >= 2 and last_motion is not None:
            duration = self._stamps[k - 1] - self._stamps[k - 2]
            if duration > 0.0:
                self._of_steps.append(last_motion / duration)
        if getattr(scan, "time_increment", 0.0) == 0.0:
            return scan
        if self._of_wheels is not None and np.isfinite(self._of_wheels[k]).all():
            return deskew(scan, self._of_wheels[k])
        if not self._of_steps:
            return scan
        return deskew(scan, np.mean(self._of_steps[-2:], axis=0))


def _wheel_velocities(increments: FloatArray, scans: Sequence[Any]) -> FloatArray:
    """Velocity of the wheels during each sweep; NaN without an increment or a time."""
    durations = np.diff([getattr(scan, "stamp", math.nan) for scan in scans])
    durations[~(durations > 0.0)] = np.nan
    rows = increments / durations[:, None]
    return np.vstack([rows, rows[-1:]])  # the last sweep moves on as the one before it
