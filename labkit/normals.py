"""Normals of a scan's surface: what the point-to-line metric and the covariance need.

A scan that knows its beams gets the normal of each point from a line through its
neighbours along the sweep; bare points get it from their neighbours in space. Either
way the line is the total-least-squares one, and a point without enough neighbours on a
surface gets NaN: it has no normal, and no later stage may invent one.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are loaded when they are used

from labkit.arrays import FloatArray, IntArray
from labkit.scan import Scan

HALF_WIDTH = 0.3  # [m]: how far a window along the sweep reaches to either side
HALF_BEAMS = 3  # and at the least this many beams
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
REACH = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
ROUND = (1.0 - LINEARITY**2) / (1.0 + LINEARITY**2)  # the same, as difference over sum
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
    moments = np.zeros((5, count + 1))
    middle = points[count // 2, :, None]  # running sums round by their own size
    x, y = xy = np.subtract(points.T, middle, out=moments[:2, 1:])
    stride = xy[:, 1:] - xy[:, :-1]
    stride *= stride
    step = np.sqrt(stride[0] + stride[1])
    beside = np.concatenate([step[:1], step, step[-1:]])  # the steps before and after a point
    limit = np.maximum(GAP_RATIO * np.minimum(beside[:-2], beside[2:]), GAP_FLOOR)
    gap = step > np.minimum(limit, REACH)
    edges = np.array([0, *(np.flatnonzero(gap) + 1).tolist(), count])
    points_on = edges[1:] - edges[:-1]  # each surface
    spacing = np.maximum(np.minimum(beside[:-1], beside[1:]), 1e-3 * HALF_WIDTH)
    beams = np.maximum(HALF_WIDTH / spacing, HALF_BEAMS).astype(np.intp)
    here = np.arange(count)
    start = np.maximum(here - beams, edges[:-1].repeat(points_on))
    beams += 1
    stop = np.minimum(here + beams, edges[1:].repeat(points_on))

    np.multiply(xy, x, out=moments[2:4, 1:])
    np.multiply(y, y, out=moments[4, 1:])
    np.cumsum(moments, axis=1, out=moments)
    size = stop - start
    mean = moments.take(stop, axis=1)  # of x, y, x², xy and y² in each window
    mean -= moments.take(start, axis=1)
    mean /= size
    spread = mean[2:]
    spread[:2] -= mean[:2] * mean[0]
    spread[2] -= mean[1] * mean[1]
    rounding = 64.0 * EPSILON * float(moments[2, -1] + moments[4, -1])
    return _line_normals(points, spread, size, rounding)


def _normals_in_space(points: FloatArray) -> FloatArray:
    """Normals of the total-least-squares lines through the nearest neighbours."""
    k = min(NEIGHBORS, len(points))
    distance, neighbors = scipy.spatial.cKDTree(points).query(points, k=k)
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
    moments: FloatArray | tuple[FloatArray, FloatArray, FloatArray],
    count: IntArray,
    rounding: float = 0.0,
) -> FloatArray:
    """Directions of least spread, from the second moments about the mean; NaN for no line."""
    cxx, cxy, cyy = moments
    mean, half_difference = 0.5 * (cxx + cyy), 0.5 * (cxx - cyy)
    radius = np.sqrt(half_difference * half_difference + cxy * cxy)  # eigenvalues: mean ± radius
    no_line = radius <= ROUND * mean
    no_line |= mean + radius <= rounding
    no_line |= count < MIN_ON_LINE
    # The eigenvector of the larger one, in the form that no difference of equals spoils. It
    # needs no angle: without its three functions this takes two thirds of the time.
    major = radius + np.abs(half_difference)
    lies = half_difference >= 0.0
    along_x, along_y = np.where(lies, major, cxy), np.where(lies, cxy, major)
    x, y = points.T
    length = np.sqrt(2.0 * radius * major)  # = √(major² + cxy²)
    length[no_line] = np.nan
    length *= np.where(along_x * y > along_y * x, -1.0, 1.0)  # towards the scanner
    normals = np.empty((2, len(points)))
    np.divide(-along_y, length, out=normals[0])
    np.divide(along_x, length, out=normals[1])
    return normals.T
