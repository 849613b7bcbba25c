"""Trajectories in the TUM format, which `evo` reads: ``timestamp tx ty tz qx qy qz qw``."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, as_floats, as_poses
from labkit.errors import InvalidPointsError, LogError
from labkit.files import atomic_write
from labkit.logs.lines import (
    DamagedLine,
    DamageReport,
    expect_fields,
    expect_near,
    finite,
    time,
)
from labkit.logs.source import TextSource
from labkit.se2 import wrap


def write_tum(path: str | os.PathLike[str], stamps: ArrayLike, poses: ArrayLike) -> None:
    """Write a planar trajectory: z = 0 and the quaternion (0, 0, sin θ/2, cos θ/2).

    Numbers are written with all their digits: times and positions come back from
    `read_tum` bit for bit, θ (wrapped into (−π, π]) within a few 1e-16.

    Parameters
    ----------
    path : path-like
        The file, written whole or not at all.
    stamps : array_like, shape (K,)
        Times in seconds; finite, so a run without times needs its indices here.
    poses : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]).

    Raises
    ------
    InvalidPointsError
        If the shapes do not fit together, or a number is not finite.
    WriteError
        If the file cannot be written.
    """
    rows = as_poses(poses, "poses")
    times = as_floats(stamps, "stamps", hint="give one time per pose")
    if times.shape != (len(rows),):
        raise InvalidPointsError(
            f"`stamps` must have shape ({len(rows)},), one per pose, got {times.shape}"
        )
    if not np.isfinite(times).all():
        index = int(np.flatnonzero(~np.isfinite(times))[0])
        raise InvalidPointsError(
            f"`stamps` must be finite, got {times[index]} at index {index}; "
            f"a run without times takes its indices, `np.arange({len(rows)})`"
        )
    half = wrap(rows[:, 2]) / 2.0
    table = np.column_stack([times, rows[:, :2], np.sin(half), np.cos(half)])
    with atomic_write(path) as file:
        file.write("# timestamp tx ty tz qx qy qz qw\n")
        for t, x, y, qz, qw in table.tolist():
            file.write(f"{t!r} {x!r} {y!r} 0.0 0.0 0.0 {qz!r} {qw!r}\n")


def read_tum(path: str | os.PathLike[str]) -> tuple[FloatArray, FloatArray]:
    """Read a planar trajectory.

    The height tz is dropped. Blank lines and ``#`` comments are passed over; a trajectory
    with a damaged line is refused as a whole, since a gap in it would go unseen.

    Returns
    -------
    stamps : ndarray, shape (K,)
        Times in seconds.
    poses : ndarray, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) with θ in (−π, π].

    Raises
    ------
    LogError
        If the file cannot be read, holds no pose, or has a damaged line, a time beyond
        1e20 s, a position beyond 1e9 m or a rotation out of the plane; the message names the line.
    """
    source = TextSource(path)
    report = DamageReport(source.file, strict=True)
    source.verify(report)
    rows = []
    for number, line in source.lines(report):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        try:
            rows.append(_parse_pose(fields))
        except DamagedLine as damage:
            report.skip(number, damage)
    if not rows:
        raise LogError(
            f"{source.file}: a trajectory without any pose, expected lines "
            f"`timestamp tx ty tz qx qy qz qw`"
        )
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _parse_pose(fields: Sequence[str]) -> tuple[float, float, float, float]:
    """Time and x, y, θ of one line; the angle of a rotation about z is 2·atan2(qz, qw)."""
    expect_fields(fields, 8, "`timestamp tx ty tz qx qy qz qw`")
    names = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
    t = time(fields[0], "timestamp")
    x, y, _, qx, qy, qz, qw = (
        finite(field, name) for field, name in zip(fields[1:], names, strict=True)
    )
    expect_near(x, y, "the position")
    norm = math.hypot(qx, qy, qz, qw)
    if abs(norm - 1.0) > 1e-3:
        raise DamagedLine(f"the quaternion has length {norm:.4g}, expected 1 (order qx qy qz qw)")
    if max(abs(qx), abs(qy)) > 1e-6:
        raise DamagedLine(
            f"a rotation out of the plane, qx = {qx:g} and qy = {qy:g}, expected 0 and 0"
        )
    return t, x, y, float(wrap(2.0 * math.atan2(qz, qw)))
