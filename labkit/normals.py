"""Normals of a scan's surface: what the point-to-line metric and the covariance need.

A scan that knows its beams gets the normal of each point from a line through its
neighbours along the sweep; bare points get it from their neighbours in space. Either
way the line is the total-least-squares one, and a point without enough neighbours on a
surface gets NaN: it has no normal, and no later stage may invent one.

Points are complex numbers z = x + iy here: of the offsets u of a line's points from their
mean, Σu² doubles the line's angle, and |Σu²| / Σ|u|² says how straight it is (1: a line,
0: a round cloud). That takes half as long as the three moments of x and y.
"""

from __future__ import annotations

import math

import numpy as np
import scipy  # its parts are loaded when they are used
from numpy.typing import NDArray

from labkit.arrays import EPSILON, FloatArray, IntArray
from labkit.scan import Scan

ComplexArray = NDArray[np.complex128]

HALF_WIDTH = 0.25  # [m]: how far a window along the sweep reaches to either side
HALF_BEAMS = 3  # and at the least this many beams
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
REACH = 0.5  # [m]: neighbours farther than this are not on the same surface
BEYOND = math.nextafter(REACH, math.inf)  # the search finds what is nearer than this
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
STRAIGHT = (1.0 - LINEARITY**2) / (1.0 + LINEARITY**2)  # the same, as |Σu²| / Σ|u|²
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
    z = np.ascontiguousarray(scan.points).view(np.complex128)[:, 0]
    normals = _normals_in_space(z) if scan.beams is None else _normals_along_sweep(z)
    return normals.view(np.float64).reshape(-1, 2)


def _normals_along_sweep(z: ComplexArray) -> ComplexArray:
    """Normals of the total-least-squares lines through a window of the sweep.

    A window reaches `HALF_WIDTH` to either side, at least `HALF_BEAMS` beams, and ends
    with the surface. Sums over windows are differences of running sums.
    """
    count = len(z)
    start, stop = _windows(np.abs(z[1:] - z[:-1]))
    moments = np.zeros((3, count + 1), dtype=np.complex128)
    u = np.subtract(z, z[count // 2], out=moments[0, 1:])  # running sums round by their size
    np.multiply(u, u, out=moments[1, 1:])
    np.multiply(u, u.conj(), out=moments[2, 1:])
    np.cumsum(moments, axis=1, out=moments)
    sums = moments.take(stop, axis=1)  # of u, u² and |u|² in each window
    sums -= moments.take(start, axis=1)
    stop -= start
    rounding = 64.0 * EPSILON * float(moments[2, -1].real)
    return _line_normals(z, sums, stop, rounding)


def _windows(step: FloatArray) -> tuple[IntArray, IntArray]:
    """The first point of each window and the one after its last, from the steps [m]."""
    count = len(step) + 1
    beside = np.concatenate((step[:1], step, step[-1:]))  # the steps before and after a point
    limit = np.minimum(beside[:-2], beside[2:])
    limit *= GAP_RATIO
    first = np.ones(count + 1, dtype=np.bool_)  # of a surface; the one after the last, too
    np.greater(step, np.minimum(np.maximum(limit, GAP_FLOOR), REACH), out=first[1:-1])
    edges = np.flatnonzero(first)
    points_on = edges[1:] - edges[:-1]  # each surface
    spacing = np.maximum(np.minimum(beside[:-1], beside[1:]), 1e-3 * HALF_WIDTH)
    beams = np.maximum(HALF_WIDTH / spacing, HALF_BEAMS).astype(np.intp)
    here = np.arange(count)
    start = np.maximum(here - beams, edges[:-1].repeat(points_on))
    here += beams
    here += 1
    return start, np.minimum(here, edges[1:].repeat(points_on))


def _normals_in_space(z: ComplexArray) -> ComplexArray:
    """Normals of the total-least-squares lines through the nearest neighbours."""
    points = z.view(np.float64).reshape(-1, 2)
    tree = scipy.spatial.cKDTree(points, balanced_tree=False, compact_nodes=False)
    distance, neighbors = tree.query(points, k=min(NEIGHBORS, len(z)), distance_upper_bound=BEYOND)
    near = np.isfinite(distance.T).astype(np.float64)
    u = z.take(neighbors.T, mode="clip")  # any point will do for one that is missing
    u -= z
    u *= near
    sums = np.array([u.sum(axis=0), (u * u).sum(axis=0), (u * u.conj()).sum(axis=0)])
    return _line_normals(z, sums, near.sum(axis=0))


def _line_normals(
    z: ComplexArray, sums: ComplexArray, size: IntArray | FloatArray, rounding: float = 0.0
) -> ComplexArray:
    """Directions of least spread, from Σu, Σu² and Σ|u|² of `size` points; NaN for no line."""
    mean = sums * (1.0 / size)
    doubled = mean[1] - mean[0] * mean[0]
    spread = mean[2].real - (mean[0] * mean[0].conj()).real
    length = np.abs(doubled)
    no_line = length <= STRAIGHT * spread
    no_line |= length + spread <= 2.0 * rounding
    no_line |= size < MIN_ON_LINE
    length = np.sqrt(length)
    length[no_line] = np.nan
    normal: ComplexArray = 1j * np.sqrt(
        doubled
    )  # turns the line's direction, whose square is `doubled`
    away = np.copysign(1.0 / length, (normal.conj() * z).real)
    normal *= -away  # towards the scanner
    return normal
