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
from labkit.support.arrays import FloatArray, as_poses, check_range
from labkit.support.errors import InvalidPointsError

FAR = 0.002  # share of the points, at each of the four sides, that need not be in the picture
FEW_SCANS = 20  # of so many a map of single pixels is drawn in full
SHORT = 0.05  # of the picture's width: a path shorter than this hides under its marks
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
        What was seen at each pose: grey points, one picture also in a PDF.
    reference : array_like, shape (R, 3), optional
        Another trajectory in the same world: a dashed line.
    wheels : array_like, shape (W, 3), optional
        The path by the wheels alone: a dotted line.
    range_max : float
        The map leaves out points farther than this from their scanner [m].
    """
    rows = as_poses(poses, "poses")
    dashed = None if reference is None else as_poses(reference, "reference")
    dotted = None if wheels is None else as_poses(wheels, "wheels")
    if scans is not None:
        # Nearly transparent pixels: what is seen often grows dark, a stray return stays faint.
        world = map_points(rows, scans, range_max=range_max)
        alpha = min(1.0, max(0.2, FEW_SCANS / max(len(scans), 1)))
        ax.plot(*world.T, ",", color=MAP_GREY, alpha=alpha, rasterized=True, zorder=1.5)
        _frame(ax, world, [each for each in (rows, dashed, dotted) if each is not None])
    if dashed is not None:
        ax.plot(*dashed[:, :2].T, "--", color=REFERENCE, linewidth=1.2, label="reference")
    if dotted is not None:
        ax.plot(*dotted[:, :2].T, ":", color=METHODS[0], linewidth=1.2, label="wheels")
    ax.plot(*rows[:, :2].T, "-", color=SOURCE, linewidth=1.0, label="estimate", zorder=2.1)
    # A ring, seen round an end at the same place.
    ax.plot(*rows[0, :2], "o", ms=11.0, mfc="none", mew=1.8, color=GREEN, label="start", zorder=4)
    ax.plot(*rows[-1, :2], "s", color=BLACK, label="end", zorder=4, ms=6.0, mec="white")
    metres = np.hypot(*np.diff(rows[:, :2], axis=0).T).sum()
    length = f"{metres / 1000.0:.2f} km" if metres >= 1000.0 else f"{metres:.1f} m"
    ax.set_title(f"Trajectory: {len(rows):,} pose{'' if len(rows) == 1 else 's'}, {length}")
    style_plane(ax)
    handles = ax.get_legend_handles_labels()[0]
    if scans is not None:  # a pixel would not show in a legend
        handles.append(Line2D([], [], linestyle="none", marker=".", color=MAP_GREY, label="map"))
    legend_below(ax, handles)
    width = max(np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()))
    if scans is not None and 0.0 < np.ptp(rows[:, :2], axis=0).max() < SHORT * width:
        _enlarge(ax, rows)
    return ax


def _frame(ax: Axes, world: FloatArray, paths: Sequence[FloatArray]) -> None:
    """Show all paths and nearly all points: a few far returns do not shrink the rest."""
    if not len(world):
        return
    places = np.vstack([path[:, :2] for path in paths])
    inner = np.quantile(world, (FAR, 1.0 - FAR), axis=0)
    low, high = np.minimum(inner[0], places.min(axis=0)), np.maximum(inner[1], places.max(axis=0))
    margin = 0.05 * (high - low).max()
    ax.set_xlim(low[0] - margin, high[0] + margin)
    ax.set_ylim(low[1] - margin, high[1] + margin)


def _enlarge(ax: Axes, rows: FloatArray) -> None:
    """Show a short path by itself, in the upper right corner."""
    corner = ax.inset_axes((0.68, 0.64, 0.3, 0.3))
    corner.plot(*rows[:, :2].T, "-", color=SOURCE, linewidth=1.0)
    corner.plot(*rows[0, :2], "o", ms=7.0, mfc="none", color=GREEN)
    corner.plot(*rows[-1, :2], "s", ms=4.0, mec="white", color=BLACK)
    corner.set_aspect("equal", adjustable="datalim")
    corner.tick_params(labelsize=7)
    corner.set_title("the path, enlarged [m]", fontsize=8)


def map_points(
    poses: ArrayLike, scans: Sequence[Scan], *, range_max: float = math.inf
) -> FloatArray:
    """The points of all scans in the world's frame, shape (P, 2) [m], in the order of the scans.

    Parameters are those of `plot_trajectory`.
    """
    rows = as_poses(poses, "poses")
    check_range(range_max, "range_max", above=0.0, unit="m")
    if len(scans) != len(rows):
        raise InvalidPointsError(
            f"`scans` and `poses` must be one to one, got {len(scans)} scans and {len(rows)} poses"
        )
    # One long array instead of a loop over scans: p_w = R(θ_k) p + t_k, k by the point.
    points = np.vstack([scan.points.reshape(-1, 2) for scan in scans])
    k = np.repeat(np.arange(len(rows)), [len(scan) for scan in scans])
    near = np.hypot(*points.T) <= range_max
    points, k = points[near], k[near]
    R = rotation(rows[:, 2])
    return np.asarray(np.einsum("nij,nj->ni", R[k], points) + rows[k, :2])
