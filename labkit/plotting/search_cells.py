"""The cells of a KD-tree, and those of them that a query has to open."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from labkit.arrays import FloatArray, check_count
from labkit.plotting.scans import draw_target, scan_points, single_point
from labkit.plotting.style import GREY, KEPT, SKY, SOURCE, legend_below, style_plane
from labkit.scan import Scan

Box = tuple[FloatArray, FloatArray]  # lower left and upper right corner [m]


def plot_search_cells(
    ax: Axes, target: Scan | ArrayLike, depth: int, query: ArrayLike | None = None
) -> Axes:
    """Draw how a KD-tree cuts the plane in two, again and again.

    Each cut goes through the median of a cell's points, across their longer extent. A query
    need not open a cell that begins farther away than the nearest point; the others are shaded.

    Parameters
    ----------
    target : Scan or array_like, shape (M, 2)
        The points searched [m].
    depth : int
        How often to cut, at least 0; a cell of one point is not cut.
    query : array_like, shape (2,), optional
        A point whose nearest neighbour is sought [m].
    """
    points = scan_points(target, "target")
    check_count(depth, "depth", at_least=0)
    boxes = list(search_cells(points, depth))
    title = f"{len(boxes)} cell{'' if len(boxes) == 1 else 's'}"
    open_to_query = np.zeros(len(boxes), dtype=bool)
    if query is not None:
        p = single_point(query, "query")
        radius = float(np.hypot(*(points - p).T).min())
        open_to_query = np.array([_gap(p, box) <= radius for box in boxes])
        title += f", {open_to_query.sum()} to open"
    for (low, high), shaded in zip(boxes, open_to_query, strict=True):
        face = (SKY, 0.45) if shaded else "none"
        corner, size = (low[0], low[1]), high - low
        ax.add_patch(Rectangle(corner, *size, edgecolor=GREY, facecolor=face, linewidth=0.8))
    handles = [draw_target(ax, points)]
    if query is not None:
        ax.add_patch(Circle((p[0], p[1]), radius, fill=False, color=KEPT, linestyle="--"))
        handles += ax.plot(*p, "*", color=SOURCE, markersize=11, label="query")
        reach = "distance to its nearest point"
        handles.append(Line2D([], [], color=KEPT, linestyle="--", label=reach))
    ax.autoscale_view()
    ax.set_title(title)
    style_plane(ax)
    legend_below(ax, handles)
    return ax


def search_cells(points: FloatArray, depth: int) -> Iterator[Box]:
    """The cells of points (M, 2) [m] after `depth` cuts, as pairs of corners."""
    tree = cKDTree(points, leafsize=1)
    low, high = np.asarray(tree.mins), np.asarray(tree.maxes)
    margin = 0.02 * float((high - low).max()) or 0.5
    yield from _cut(tree.tree, low - margin, high + margin, depth)


def _cut(node: Any, low: FloatArray, high: FloatArray, depth: int) -> Iterator[Box]:
    if depth == 0 or node.split_dim < 0:
        yield low, high
        return
    below, above = high.copy(), low.copy()
    below[node.split_dim] = above[node.split_dim] = node.split
    yield from _cut(node.lesser, low, below, depth - 1)
    yield from _cut(node.greater, above, high, depth - 1)


def _gap(point: FloatArray, box: Box) -> float:
    """Distance of the point from the box [m]; 0 inside it."""
    low, high = box
    return float(np.hypot(*np.maximum(np.maximum(low - point, point - high), 0.0)))
