"""Normals of a scan's surface: what the point-to-line metric and the covariance need.

The normal of a point is the direction in which its neighbours spread least: the eigenvector
of their moment matrix

    M = mean of (p − p̄)(p − p̄)ᵀ

to the smaller eigenvalue (total least squares). A scan that knows its beams takes the
neighbours along the sweep; bare points take the nearest ones. A point without enough
neighbours on a line gets NaN: it has no normal, and no later stage may invent one.
"""

from __future__ import annotations

import math

import numpy as np
import scipy  # its parts are loaded when they are used

from labkit.arrays import EPSILON, FloatArray, IntArray
from labkit.scan import Scan

HALF_WIDTH = 0.25  # [m]: how far a window along the sweep reaches to either side
HALF_BEAMS = 3  # and at the least this many beams
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
REACH = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
MIN_ON_LINE = 3  # points that a line needs


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
    if scan.beams is None:
        neighbors = neighbors_in_space(scan.points)
        count = (neighbors >= 0).sum(axis=1)
        M = moments_of_neighbors(scan.points, neighbors)
        rounding = 0.0
    else:
        start, stop = windows_along_sweep(scan.points)
        count = stop - start
        M, rounding = moments_of_windows(scan.points, start, stop)
    values, vectors = np.linalg.eigh(M)
    normals = vectors[:, :, 0]  # to the smaller eigenvalue
    straight = values[:, 0] < LINEARITY**2 * values[:, 1]
    normals[(count < MIN_ON_LINE) | ~straight | (values[:, 1] <= rounding)] = np.nan
    away = (normals * scan.points).sum(axis=1) > 0.0
    normals[away] = 0.0 - normals[away]  # towards the scanner
    return normals


def neighbors_in_space(points: FloatArray) -> IntArray:
    """The rows of the nearest `NEIGHBORS` within `REACH` of each point; −1 for a missing one."""
    tree = scipy.spatial.cKDTree(points)
    beyond = math.nextafter(REACH, math.inf)  # the search finds what is nearer than this
    count = min(NEIGHBORS, len(points))
    distance, neighbors = tree.query(points, k=count, distance_upper_bound=beyond)
    return np.where(np.isfinite(distance), neighbors, -1)


def moments_of_neighbors(points: FloatArray, neighbors: IntArray) -> FloatArray:
    """The moment matrix of the neighbours of each point, shape (N, 2, 2)."""
    there = (neighbors >= 0)[:, :, None]
    offset = np.where(there, points[neighbors] - points[:, None], 0.0)
    count = there.sum(axis=1)
    mean = offset.sum(axis=1) / count
    spread = offset.mT @ offset / count[:, :, None]
    moments: FloatArray = spread - mean[:, :, None] * mean[:, None, :]
    return moments


def windows_along_sweep(points: FloatArray) -> tuple[IntArray, IntArray]:
    """The first point of each point's window along the sweep, and the one after its last.

    A window reaches `HALF_WIDTH` to either side, at least `HALF_BEAMS` beams, and ends
    with the surface.
    """
    step = np.hypot(*np.diff(points, axis=0).T)  # from each point to the next [m]
    before, after = np.r_[step[0], step], np.r_[step, step[-1]]
    shorter = np.minimum(before[:-1], after[1:])  # of the two steps beside each step
    gap = step > np.clip(GAP_RATIO * shorter, GAP_FLOOR, REACH)
    edges = np.r_[0, np.flatnonzero(gap) + 1, len(points)]
    surface = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    spacing = np.maximum(np.minimum(before, after), 1e-3 * HALF_WIDTH)
    beams = np.maximum(HALF_WIDTH / spacing, HALF_BEAMS).astype(np.intp)
    here = np.arange(len(points))
    start = np.maximum(here - beams, edges[surface])
    stop = np.minimum(here + beams + 1, edges[surface + 1])
    return start, stop


def moments_of_windows(
    points: FloatArray, start: IntArray, stop: IntArray
) -> tuple[FloatArray, float]:
    """The moment matrix of ``points[start:stop]`` for each window, and how far it is rounded.

    Sums over windows are differences of running sums, so that wide windows cost no more.
    """
    p = points - points[len(points) // 2]  # running sums round by their size
    squares = p[:, :, None] * p[:, None, :]
    sums, square_sums = (
        np.concatenate((np.zeros((1, *each.shape[1:])), np.cumsum(each, axis=0)))
        for each in (p, squares)
    )
    count = (stop - start)[:, None]
    mean = (sums[stop] - sums[start]) / count
    spread = (square_sums[stop] - square_sums[start]) / count[:, :, None]
    rounding = 64.0 * EPSILON * float(np.trace(square_sums[-1]))
    return spread - mean[:, :, None] * mean[:, None, :], rounding
