"""Undo the skew of a sweep: the scanner moves on while its beams turn.

A scan has one pose, but beam k is measured ``k · time_increment`` later than the first. At 10 Hz a
robot that turns by 90 degrees a second has turned by 9 degrees when the last beam comes back.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

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


class Velocities(NamedTuple):
    """Velocities of the scanner, by which the next sweep of a run is straightened.

    While sweep k lasts, the scanner moves on to the pose of sweep k + 1, which nobody knows yet. So
    its velocity is that of the wheels since sweep k − 1. Without wheels it is the mean velocity of
    the last two steps. (The velocity of the last step alone would not do: an error of one step
    would come back in the next one with the other sign.)
    """

    stamp: float = math.nan  # of the last scan [s]
    of_steps: tuple[FloatArray, ...] = ()  # of the last two steps

    def time_to(self, scan: Any) -> float:
        """Time from the last scan to the next one [s]; NaN where it is unknown or not positive."""
        duration = float(getattr(scan, "stamp", math.nan)) - self.stamp
        return duration if duration > 0.0 else math.nan

    def during(self, scan: Any, prior: FloatArray | None) -> FloatArray | None:
        """The velocity during the next scan; None where nothing tells it."""
        if prior is not None and math.isfinite(self.time_to(scan)):
            return prior / self.time_to(scan)
        return np.mean(self.of_steps, axis=0) if self.of_steps else None

    def after(self, scan: Any, increment: FloatArray) -> Velocities:
        """The velocities after a step."""
        of_steps = self.of_steps
        if math.isfinite(self.time_to(scan)):
            of_steps = (*of_steps, increment / self.time_to(scan))
        return Velocities(float(getattr(scan, "stamp", math.nan)), of_steps[-2:])


def is_skewed(scan: Any) -> bool:
    """True if a scan tells the time between its beams."""
    return getattr(scan, "time_increment", 0.0) > 0.0
