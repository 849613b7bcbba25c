"""Normals of a scan's surface: what the point-to-line metric and the covariance need.

A scan that knows its beams gets the normal of each point from a line through its
neighbours along the sweep; bare points get it from their neighbours in space. Either
way the line is the total-least-squares one, and a point without enough neighbours on a
surface gets NaN: it has no normal, and no later stage may invent one.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from labkit.arrays import FloatArray, IntArray, dots
from labkit.scan import Scan

HALF_WIDTH = 0.3  # [m]: how far a window along the sweep reaches to either side
HALF_BEAMS = 3  # and at the least this many beams
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
REACH = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
MIN_ON_LINE = 3  # points that a line needs
EPSILON = float(np.finfo(float).eps)


def estimate_normals(scan: Scan) -> FloatArray:
    """Find the direction of the surface at every point.

    Parameters
    ----------
    scan : Scan
        N points; in beam order where ``scan.beams`` is set.

    Returns
    -------
    ndarray, shape (N, 2)
        Unit normals, turned towards the scanner; NaN where the neighbourhood is no line
        (a lone return, scatter, an edge sharper than a right angle).

    Examples
    --------
    >>> wall = Scan.from_points([[2.0, -0.1], [2.0, 0.0], [2.0, 0.1]])
    >>> np.round(estimate_normals(wall)[1], 12).tolist()
    [-1.0, 0.0]
    """
    if len(scan) < MIN_ON_LINE:
        return np.full((len(scan), 2), np.nan)
    normals = _normals_in_space if scan.beams is None else _normals_along_sweep
    return normals(scan.points)


def _normals_along_sweep(points: FloatArray) -> FloatArray:
    """Normals of the total-least-squares lines through a window of the sweep.

    A window reaches `HALF_WIDTH` to either side, at least `HALF_BEAMS` beams, and ends
    with the surface. Sums over windows are differences of running sums.
    """
    count = len(points)
    x, y = (points - points.mean(axis=0)).T  # running sums round by their own size
    step = np.hypot(x[1:] - x[:-1], y[1:] - y[:-1])
    before, after = np.concatenate([step[:1], step]), np.concatenate([step, step[-1:]])
    gap = step > np.maximum(GAP_RATIO * np.minimum(before[:-1], after[1:]), GAP_FLOOR)
    gap |= step > REACH
    breaks = np.flatnonzero(gap)
    surface = np.concatenate([[0], np.cumsum(gap)])
    first = np.concatenate([[0], breaks + 1])[surface]
    last = np.concatenate([breaks, [count - 1]])[surface]
    spacing = np.maximum(np.minimum(before, after), 1e-3 * HALF_WIDTH)
    beams = np.maximum(HALF_WIDTH / spacing, HALF_BEAMS).astype(np.intp)
    here = np.arange(count)
    start, stop = np.maximum(here - beams, first), np.minimum(here + beams, last) + 1

    running = np.zeros((5, count + 1))
    np.cumsum([x, y, x * x, x * y, y * y], axis=1, out=running[:, 1:])
    size = stop - start
    mx, my, mxx, mxy, myy = (running.take(stop, axis=1) - running.take(start, axis=1)) / size
    rounding = 64.0 * EPSILON * (running[2, -1] + running[4, -1])
    spread = (mxx - mx * mx, mxy - mx * my, myy - my * my)
    return _line_normals(points, spread, size, rounding)


def _normals_in_space(points: FloatArray) -> FloatArray:
    """Normals of the total-least-squares lines through the nearest neighbours."""
    k = min(NEIGHBORS, len(points))
    distance, neighbors = cKDTree(points).query(points, k=k)
    near = distance <= REACH
    on_line = near.sum(axis=1)
    offset = points[neighbors] - points[:, None, :]
    mean = np.einsum("nk,nkd->nd", near, offset) / on_line[:, None]
    centered = (offset - mean[:, None, :]) * near[:, :, None]
    cxx, cxy, cyy = (
        np.einsum("nk,nk->n", centered[..., i], centered[..., j])
        for i, j in ((0, 0), (0, 1), (1, 1))
    )
    return _line_normals(points, (cxx, cxy, cyy), on_line)


def _line_normals(
    points: FloatArray,
    moments: tuple[FloatArray, FloatArray, FloatArray],
    count: IntArray,
    rounding: float = 0.0,
) -> FloatArray:
    """Directions of least spread, from the second moments about the mean; NaN for no line."""
    cxx, cxy, cyy = moments
    along = 0.5 * np.arctan2(2.0 * cxy, cxx - cyy)
    mean, half_difference = 0.5 * (cxx + cyy), np.hypot(0.5 * (cxx - cyy), cxy)
    smaller, larger = mean - half_difference, mean + half_difference
    no_line = (smaller >= LINEARITY**2 * larger) | (larger <= rounding)
    along[no_line | (count < MIN_ON_LINE)] = np.nan
    normals = np.column_stack([-np.sin(along), np.cos(along)])
    normals[dots(normals, points) > 0.0] *= -1.0  # towards the scanner
    return normals
