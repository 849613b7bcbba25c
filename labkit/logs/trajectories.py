"""Trajectories and pose graphs as text: TUM, which `evo` reads, and g2o."""

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
    parse_finite,
    parse_time,
    read_lines,
)
from labkit.se2 import wrap

TUM = "timestamp tx ty tz qx qy qz qw"


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
        file.write(f"# {TUM}\n")
        for t, x, y, qz, qw in table.tolist():
            file.write(f"{t!r} {x!r} {y!r} 0.0 0.0 0.0 {qz!r} {qw!r}\n")


def read_tum(path: str | os.PathLike[str]) -> tuple[FloatArray, FloatArray]:
    """Read a planar trajectory, plain, in gzip or in zip.

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
    report = DamageReport(os.fspath(path), strict=True)
    rows = []
    for number, line in read_lines(report):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        try:
            rows.append(_parse_tum(fields))
        except DamagedLine as damage:
            report.skip(number, damage)
    if not rows:
        raise LogError(f"{path}: a trajectory without any pose, expected lines `{TUM}`")
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _parse_tum(fields: Sequence[str]) -> tuple[float, float, float, float]:
    """Time and x, y, θ of one line; the angle of a rotation about z is 2·atan2(qz, qw)."""
    expect_fields(fields, 8, f"`{TUM}`")
    t = parse_time(fields[0], "timestamp")
    x, y, _, qx, qy, qz, qw = map(parse_finite, fields[1:], TUM.split()[1:])
    expect_near(x, y, "the position")
    norm = math.hypot(qx, qy, qz, qw)
    if abs(norm - 1.0) > 1e-3:
        raise DamagedLine(f"the quaternion has length {norm:.4g}, expected 1 (order qx qy qz qw)")
    if max(abs(qx), abs(qy)) > 1e-6:
        raise DamagedLine(
            f"a rotation out of the plane, qx = {qx:g} and qy = {qy:g}, expected 0 and 0"
        )
    return t, x, y, float(wrap(2.0 * math.atan2(qz, qw)))


def write_g2o(path: str | os.PathLike[str], poses: ArrayLike, increments: ArrayLike) -> None:
    """Write a pose graph: a ``VERTEX_SE2`` per pose, an ``EDGE_SE2`` from each to the next.

    Parameters
    ----------
    path : path-like
        The file, written whole or not at all.
    poses : array_like, shape (K, 3)
        Vertices in the world, rows (x [m], y [m], θ [rad]).
    increments : array_like, shape (K − 1, 3)
        Edges: the pose of vertex k + 1 in the frame of vertex k. All have the identity for
        information matrix.

    Raises
    ------
    InvalidPointsError
        If shapes do not fit together, or a number is not finite.
    WriteError
        If the file cannot be written.
    """
    vertices, edges = as_poses(poses, "poses"), as_poses(increments, "increments", minimum=0)
    if len(edges) != len(vertices) - 1:
        raise InvalidPointsError(
            f"`increments` must have one row fewer than `poses`, got {len(edges)} and "
            f"{len(vertices)}"
        )
    with atomic_write(path) as file:
        for k, (x, y, theta) in enumerate(vertices.tolist()):
            file.write(f"VERTEX_SE2 {k} {x!r} {y!r} {theta!r}\n")
        for k, (x, y, theta) in enumerate(edges.tolist()):
            file.write(f"EDGE_SE2 {k} {k + 1} {x!r} {y!r} {theta!r} 1 0 0 1 0 1\n")
