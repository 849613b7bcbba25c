"""Normals of a scan's surface: what the point-to-line metric and the covariance need.

A scan that knows its beams gets the normal of each point from a line through its
neighbours along the sweep; bare points get it from their neighbours in space. Either
way the line is the total-least-squares one, and a point without enough neighbours on a
surface gets NaN: it has no normal, and no later stage may invent one.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from labkit.arrays import BoolArray, FloatArray, IntArray
from labkit.scan import Scan

HALF_WINDOW = 3  # neighbours looked at on either side along the sweep
HALF_WIDTH = 0.2  # [m]: where beams are denser than this over the window, take every n-th
NEIGHBORS = 9  # neighbours looked at in space, the point itself included
REACH = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.6  # largest ratio of the spreads across and along that still is a line
MIN_ON_LINE = 3  # points that a line needs


def estimate_normals(scan: Scan) -> FloatArray:
    """Fit a line around every point.

    Parameters
    ----------
    scan : Scan
        N points; in beam order where ``scan.beams`` is set.

    Returns
    -------
    ndarray, shape (N, 2)
        Unit normals, turned towards the scanner; NaN where the neighbourhood is no line
        (a corner, a lone return, scatter).

    Examples
    --------
    >>> wall = Scan.from_points([[2.0, -0.1], [2.0, 0.0], [2.0, 0.1]])
    >>> np.round(estimate_normals(wall)[1], 12).tolist()
    [-1.0, 0.0]
    """
    if len(scan) < MIN_ON_LINE:
        return np.full((len(scan), 2), np.nan)
    look_around = _neighbors_in_space if scan.beams is None else _neighbors_along_sweep
    neighbors, on_surface = look_around(scan.points)
    return _fit_lines(scan.points, neighbors, on_surface)


def _neighbors_along_sweep(points: FloatArray) -> tuple[IntArray, BoolArray]:
    """Indices (N, 2h + 1) of the neighbours by scan order, and which share the surface."""
    count = len(points)
    step = np.hypot(*np.diff(points, axis=0).T)
    padded = np.concatenate([step[:1], step, step[-1:]])
    shorter_neighbor = np.minimum(padded[:-2], padded[2:])
    gap = step > np.maximum(GAP_RATIO * shorter_neighbor, GAP_FLOOR)
    surface = np.concatenate([[0], np.cumsum(gap)])
    spacing = np.maximum(np.minimum(padded[:-1], padded[1:]), 1e-3 * HALF_WIDTH)
    stride = np.maximum(HALF_WIDTH / (HALF_WINDOW * spacing), 1.0).astype(np.intp)
    offsets = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
    index = np.arange(count)[:, None] + stride[:, None] * offsets
    inside = (index >= 0) & (index < count)
    index = np.clip(index, 0, count - 1)
    return index, inside & (surface[index] == surface[:, None])


def _neighbors_in_space(points: FloatArray) -> tuple[IntArray, BoolArray]:
    """Indices (N, k) of the nearest neighbours, the point itself included."""
    k = min(NEIGHBORS, len(points))
    _, index = cKDTree(points).query(points, k=k)
    return index, np.ones(index.shape, dtype=bool)


def _fit_lines(points: FloatArray, neighbors: IntArray, on_surface: BoolArray) -> FloatArray:
    """Total-least-squares line through each point's neighbours; its normal, or NaN."""
    offset = points[neighbors] - points[:, None, :]
    weight = on_surface & ((offset * offset).sum(axis=2) <= REACH * REACH)
    on_line = weight.sum(axis=1)
    mean = np.einsum("nk,nkd->nd", weight, offset) / on_line[:, None]
    centered = (offset - mean[:, None, :]) * weight[:, :, None]
    cxx, cxy, cyy = (
        np.einsum("nk,nk->n", centered[..., i], centered[..., j])
        for i, j in ((0, 0), (0, 1), (1, 1))
    )
    along = 0.5 * np.arctan2(2.0 * cxy, cxx - cyy)
    half_difference = np.hypot(0.5 * (cxx - cyy), cxy)
    smaller = 0.5 * (cxx + cyy) - half_difference
    larger = 0.5 * (cxx + cyy) + half_difference
    normals = np.column_stack([-np.sin(along), np.cos(along)])
    normals[(normals * points).sum(axis=1) > 0.0] *= -1.0
    normals[(on_line < MIN_ON_LINE) | (smaller >= LINEARITY**2 * larger)] = np.nan
    return normals
