"""A trajectory over the map that its own poses make of the scans."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from labkit.plotting.style import (
    BLACK,
    GREEN,
    METHODS,
    REFERENCE,
    SOURCE,
    legend_below,
    style_plane,
)
from labkit.scan import Scan
from labkit.se2 import rotation
from labkit.support.arrays import (
    FloatArray,
    as_poses,
    check_kind,
    check_kinds,
    check_range,
    check_series,
)
from labkit.support.errors import InvalidPointsError

OUTSIDE_SHARE = 0.002  # of the map's points, beyond each of the four sides of the picture
OPAQUE_SCANS = 20  # a map of at most so many scans is opaque,
MIN_ALPHA = 0.2  # one of many scans nearly transparent
SHORT_PATH = 0.05  # of the picture's width: a shorter path hides under its marks
MOST_POINTS = 1_000_000  # of a longer run each second, third or n-th scan makes the map
INSET_HEIGHT = 0.36  # of the picture, which grows upwards: the inset hides no wall
MAP_GREY = "0.55"  # lighter than any trajectory, in grey print too


def plot_trajectory(
    ax: Axes,
    poses: ArrayLike,
    scans: Sequence[Scan] | None = None,
    reference: ArrayLike | None = None,
    *,
    wheels: ArrayLike | None = None,
    range_max: float = math.inf,
) -> Axes:
    """Draw a trajectory, its map, and others to compare it with.

    Single far returns do not stretch the picture. A path that would vanish under its marks is shown
    enlarged in a corner.

    Parameters
    ----------
    poses : array_like, shape (K, 3)
        The trajectory, rows (x [m], y [m], θ [rad]).
    scans : sequence of Scan, length K, optional
        Scan at each pose: grey points, which are one picture even in a PDF. Of more than
        a million points each second, third or n-th scan is drawn.
    reference : array_like, shape (R, 3), optional
        Another trajectory in the same world: a dashed line.
    wheels : array_like, shape (W, 3), optional
        The path by the wheels alone: a dotted line.
    range_max : float
        The map leaves out points farther than this from their scanner [m].
    """
    check_kind(ax, "ax", Axes)
    check_range(range_max, "range_max", above=0.0, unit="m")
    rows = as_poses(poses, "poses")
    reference_rows = None if reference is None else as_poses(reference, "reference")
    wheel_rows = None if wheels is None else as_poses(wheels, "wheels")
    if scans is not None:
        # Nearly transparent pixels: a wall seen often grows dark, a stray return stays faint.
        check_series(scans, "scans")
        _expect_one_to_one(rows, scans)
        beams = max((len(scan) for scan in scans[:: len(scans) // 100 + 1]), default=0)
        drawn = slice(None, None, math.ceil(len(scans) * beams / MOST_POINTS) or 1)
        world = map_points(rows[drawn], scans[drawn], range_max=range_max)
        alpha = min(1.0, max(MIN_ALPHA, OPAQUE_SCANS / max(len(scans), 1)))
        ax.plot(*world.T, ",", color=MAP_GREY, alpha=alpha, rasterized=True, zorder=1.5)
        _limit_view(ax, world, [rows, reference_rows, wheel_rows])
    if reference_rows is not None:
        x, y = reference_rows[:, :2].T
        ax.plot(x, y, "--", color=REFERENCE, linewidth=1.2, label="reference")
    if wheel_rows is not None:
        x, y = wheel_rows[:, :2].T
        ax.plot(x, y, ":", color=METHODS[0], linewidth=1.2, label="wheels")
    x, y = rows[:, :2].T
    ax.plot(x, y, "-", color=SOURCE, linewidth=1.0, label="estimate", zorder=2.1)
    # The start is a ring, which is seen round an end at the same place.
    ax.plot(x[0], y[0], "o", ms=11.0, mfc="none", mew=1.8, color=GREEN, label="start", zorder=4)
    ax.plot(x[-1], y[-1], "s", color=BLACK, label="end", zorder=4, ms=6.0, mec="white")
    ax.set_title(f"Trajectory: {_count(rows)}, {_length(rows)}")
    style_plane(ax)
    handles = ax.get_legend_handles_labels()[0]
    if scans is not None:  # a pixel would not show in a legend
        handles.append(Line2D([], [], linestyle="none", marker=".", color=MAP_GREY, label="map"))
    legend_below(ax, handles)
    width = max(np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()))
    if scans is not None and 0.0 < np.ptp(rows[:, :2], axis=0).max() < SHORT_PATH * width:
        _enlarge_path(ax, rows)
    return ax


def _count(rows: FloatArray) -> str:
    return "1 pose" if len(rows) == 1 else f"{len(rows):,} poses"


def _length(rows: FloatArray) -> str:
    steps = np.diff(rows[:, :2], axis=0)
    metres = np.hypot(steps[:, 0], steps[:, 1]).sum()
    return f"{metres / 1000.0:.2f} km" if metres >= 1000.0 else f"{metres:.1f} m"


def _limit_view(ax: Axes, world: FloatArray, paths: Sequence[FloatArray | None]) -> None:
    """Show all paths and nearly all points: a few far returns do not shrink the rest."""
    if len(world) == 0:
        return
    inner = np.quantile(world, (OUTSIDE_SHARE, 1.0 - OUTSIDE_SHARE), axis=0)
    corners = np.vstack([inner, *(path[:, :2] for path in paths if path is not None)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.05 * (high - low).max()
    ax.set_xlim(low[0] - margin, high[0] + margin)
    ax.set_ylim(low[1] - margin, high[1] + margin)


def _enlarge_path(ax: Axes, rows: FloatArray) -> None:
    """Show a short path by itself, above the map."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, low + (high - low) / (1.0 - INSET_HEIGHT))
    inset = ax.inset_axes((0.35, 1.04 - INSET_HEIGHT, 0.3, INSET_HEIGHT - 0.12))
    x, y = rows[:, :2].T
    inset.plot(x, y, "-", color=SOURCE, linewidth=1.0)
    inset.plot(x[0], y[0], "o", ms=7.0, mfc="none", color=GREEN)
    inset.plot(x[-1], y[-1], "s", ms=4.0, mec="white", color=BLACK)
    inset.set_aspect("equal", adjustable="datalim")
    inset.tick_params(labelsize=7)
    inset.locator_params(nbins=4)
    inset.set_title("the path, enlarged [m]", fontsize=8)


def map_points(
    poses: ArrayLike, scans: Sequence[Scan], *, range_max: float = math.inf
) -> FloatArray:
    """Points of all scans in the frame of the world, shape (P, 2) [m], in the order of the scans.

    Parameters are those of `plot_trajectory`.
    """
    rows = as_poses(poses, "poses")
    check_kinds(scans, "scans", Scan)
    check_range(range_max, "range_max", above=0.0, unit="m")
    _expect_one_to_one(rows, scans)
    worlds = [np.empty((0, 2))]
    for (x, y, theta), scan in zip(rows, scans, strict=True):
        points = scan.points[np.hypot(*scan.points.T) <= range_max]
        worlds.append(points @ rotation(theta).T + [x, y])  # p_w = R(θ_k) p + t_k
    return np.vstack(worlds)


def _expect_one_to_one(poses: FloatArray, scans: Sequence[Scan]) -> None:
    if len(scans) != len(poses):
        raise InvalidPointsError(
            f"`scans` and `poses` must be one to one, got {len(scans)} scans and {len(poses)} poses"
        )
