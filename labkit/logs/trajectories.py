"""Trajectories: TUM, which `evo` reads, and poses between two stamps."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from labkit.logs.lines import DamageReport
from labkit.logs.options import LogOptions
from labkit.logs.reader import Source
from labkit.logs.wheels import read_poses, titled
from labkit.scan import Scan, scanner_poses
from labkit.se2 import wrap
from labkit.support.arrays import FloatArray, as_poses, as_stamps, check_kind
from labkit.support.errors import InvalidPointsError, LogError
from labkit.support.files import atomic_write

TUM = "timestamp tx ty tz qx qy qz qw"
TUM_COLUMNS = TUM.replace(" ", ",")
MAX_HOLD = 0.1  # [s]: a scan this near in time to a pose takes it, whatever lies on its other side
MAX_GAP = 2.0  # [s]: between two poses farther apart nobody knows the way


def write_tum(
    path: str | os.PathLike[str], stamps: ArrayLike, poses: ArrayLike, comment: str = ""
) -> None:
    """Write a planar trajectory: z = 0 and the quaternion (0, 0, sin θ/2, cos θ/2).

    Parameters
    ----------
    path : path-like
        The file, written whole or not at all, numbers with all their digits.
    stamps : array_like, shape (K,)
        Times in seconds; a run without times needs its indices here.
    poses : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]).
    comment : str
        A line on whose poses they are, in which axes.
    """
    check_kind(path, "path", str, os.PathLike)
    check_kind(comment, "comment", str)
    rows = as_poses(poses, "poses")
    times = as_stamps(stamps, "stamps", len(rows))
    half = wrap(rows[:, 2]) / 2.0
    table = np.column_stack([times, rows[:, :2], np.sin(half), np.cos(half)])
    with atomic_write(path) as file:
        if comment:
            file.write(f"# {' '.join(comment.split())}\n")
        file.write(f"# {TUM}\n")
        for t, x, y, qz, qw in table.tolist():
            file.write(f"{t!r} {x!r} {y!r} 0.0 0.0 0.0 {qz!r} {qw!r}\n")


def read_tum(path: str | os.PathLike[str]) -> tuple[FloatArray, FloatArray]:
    """Read a planar trajectory, plain, in gzip or in zip; tz and a small lean are dropped.

    A trajectory with a damaged line is refused as a whole, since a gap in it would go unseen.

    Returns
    -------
    stamps : ndarray, shape (K,)
        Times in seconds.
    poses : ndarray, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) with θ in (−π, π].

    Raises
    ------
    LogError
        If the file cannot be read, holds no pose, or has a damaged line, which is named.
    """
    source = Source(DamageReport(path, strict=True), LogOptions())
    table, _ = read_poses(source, titled(TUM_COLUMNS))
    return table[:, 0], table[:, 1:]


def interpolate_poses(stamps: ArrayLike, times: ArrayLike, poses: ArrayLike) -> FloatArray:
    """Interpolate a trajectory at the times of scans: x and y linearly, θ along the shorter arc.

    Parameters
    ----------
    stamps : array_like, shape (K,)
        Times of the scans [s].
    times, poses : array_like, shapes (M,) and (M, 3)
        Times [s] and rows (x [m], y [m], θ [rad]) of the trajectory, in any order.

    Returns
    -------
    ndarray, shape (K, 3)
        A pose for each scan, θ in (−π, π]; NaN where no pose lies within 0.1 s of the scan, nor two
        around it within 2 s of each other.
    """
    rows = as_poses(poses, "poses")
    t = as_stamps(stamps, "stamps")
    known = as_stamps(times, "times", len(rows))
    order = np.argsort(known, kind="stable")
    known, rows = known[order], rows[order]
    bounds = np.array([-np.inf, *known, np.inf])
    k = np.searchsorted(known, t)
    before, after = bounds[k], bounds[k + 1]
    is_near = np.minimum(t - before, after - t) <= MAX_HOLD
    has_pose = is_near | (after - before <= MAX_GAP)
    if np.count_nonzero(has_pose) < min(len(t), 2):
        raise InvalidPointsError(
            f"`stamps` must lie within `times`, {known[0]:.10g} to {known[-1]:.10g} s and at most "
            f"{MAX_GAP:g} s apart, got {t.min():.10g} to {t.max():.10g} s; bring both to one "
            f"clock, in seconds"
        )
    theta = np.interp(t, known, np.unwrap(rows[:, 2]))
    x, y = (np.interp(t, known, rows[:, axis]) for axis in (0, 1))
    return np.where(has_pose[:, None], np.column_stack([x, y, wrap(theta)]), np.nan)


def scanner_track(
    scans: Sequence[Scan], file: str, times: FloatArray, poses: FloatArray, offset: ArrayLike
) -> tuple[FloatArray, list[str]]:
    """Poses of the scanner at its scans by the robot's trajectory in a file, a remark on gaps."""
    stamps = np.array([scan.stamp for scan in scans])
    try:
        track = interpolate_poses(stamps, times, poses)
    except InvalidPointsError as error:
        raise LogError(f"{file}: {error}") from None
    remarks = list[str]()
    for low, high in _overlaps(times):
        track[(stamps >= low) & (stamps <= high)] = np.nan
        remarks.append(
            f"the clock of the odometry jumps back: {low:.10g} to {high:.10g} s come twice, and "
            f"scans in between have no odometry"
        )
    has_pose = np.isfinite(track[:, 0])
    if not has_pose.any():
        raise LogError(f"{file}: {'; '.join(remarks)}, that is all of them")
    track[has_pose] = scanner_poses(track[has_pose], offset)
    if has_pose.all() or remarks:
        return track, remarks
    return track, [
        f"{np.count_nonzero(~has_pose)} of {len(has_pose)} scans have no odometry, the first at "
        f"{stamps[~has_pose][0]:.10g} s: it is silent there for longer than {MAX_GAP:g} s"
    ]


def _overlaps(times: FloatArray) -> list[tuple[float, float]]:
    """Stretches of time that come twice, where a clock jumps back; a swap of two rows is none."""
    jumps = np.flatnonzero(np.diff(times) < -MAX_HOLD) + 1
    epochs = np.split(times, jumps)
    overlaps = []
    for one, other in combinations(epochs, 2):
        low = max(float(one.min()), float(other.min()))
        high = min(float(one.max()), float(other.max()))
        if low <= high:
            overlaps.append((low, high))
    return overlaps


def odd_steps(odometry: FloatArray, scans: Sequence[Scan]) -> list[str]:
    """Remark on odometry one step in ten of which, or more, leads beyond all that a scan sees."""
    steps = np.hypot(*np.diff(odometry[:, :2], axis=0).T)
    far = np.quantile(steps[np.isfinite(steps)], 0.9) if np.isfinite(steps).any() else 0.0
    reach = np.median([np.hypot(*scan.points.T).max(initial=0.0) for scan in scans])
    if not far > reach > 0.0:
        return []
    return [
        f"a tenth of the odometry's steps are longer than {far:.4g} m, and the scans reach "
        f"{reach:.4g} m: are the odometry and the ranges in metres?"
    ]
