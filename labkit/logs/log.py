"""A log: the scans of one run, and their poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from labkit.logs.stored import StoredScans
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, check_count


@dataclass(frozen=True, kw_only=True)
class SkippedLine:
    """A damaged line that was left out; in a ROS bag `line` is the number of the message."""

    file: str
    line: int
    reason: str

    def __str__(self) -> str:
        """``FILE:LINE: reason``, the form in which editors jump to the place."""
        return f"{self.file}:{self.line}: {self.reason}"


class Content(NamedTuple):
    """A part of a file: a topic, a column, an array, or lines of one first word."""

    name: str
    kind: str  # type and number
    use: str  # what it is read as; nothing, if it is left out


@dataclass(frozen=True, eq=False, kw_only=True)
class Log:
    """K scans in the order of the file, and the poses of the scanner at each of them.

    Attributes
    ----------
    scans : sequence of Scan, length K
        The scans, each in its own frame; `read_log` makes them when they are asked for, and
        returns the same object as long as somebody holds it.
    odometry, reference : ndarray, shape (K, 3), or None
        Poses of the scanner by raw wheel odometry, and by a better estimate (an optimised pose
        graph, a corrected log): rows (x [m], y [m], θ [rad]) with θ in (−π, π]. The odometry is
        NaN where it is silent.
    laser_offset : ndarray, shape (3,), or None
        Place of the scanner on the robot, ``T_robot_laser`` as (x [m], y [m], θ [rad]), where the
        caller or the file tells it.
    name : str
        Name of the run: the file's, without its suffixes.
    format : str
        Name of the format's reader: ``"carmen"``, ``"ros"``, ``"ranges"``, ``"points"`` and so on.
    skipped : tuple of SkippedLine
        The damaged lines that were left out.
    remarks : tuple of str
        Warnings that drop no line: codes for "no return", clocks, gaps, millimetres.
    contents : tuple of Content
        The parts of the file, and what they are read as.
    """

    scans: Sequence[Scan]
    odometry: FloatArray | None = None
    reference: FloatArray | None = None
    laser_offset: FloatArray | None = None
    name: str
    format: str
    skipped: tuple[SkippedLine, ...] = ()
    remarks: tuple[str, ...] = ()
    contents: tuple[Content, ...] = ()

    def __len__(self) -> int:
        return len(self.scans)

    def __repr__(self) -> str:
        poses = [name for name in ("odometry", "reference") if getattr(self, name) is not None]
        found = ", ".join(poses) or "no poses"
        return f"Log({self.name}: {len(self)} scans, {self.format}, {found})"

    def head(self, count: int) -> Log:
        """The first scans, and the poses that belong to them."""
        check_count(count, "count", at_least=0)
        poses = (p if p is None else p[:count] for p in (self.odometry, self.reference))
        odometry, reference = poses
        return replace(self, scans=self.scans[:count], odometry=odometry, reference=reference)

    @property
    def stamps(self) -> FloatArray:
        """Times of the scans [s], shape (K,); NaN where the file has none."""
        if isinstance(self.scans, StoredScans):
            return self.scans.stamps
        return np.array([scan.stamp for scan in self.scans], dtype=np.float64)
