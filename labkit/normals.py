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
from numpy.typing import ArrayLike

from labkit.neighbors import Grid, NearestNeighbors, neighbors_of
from labkit.scan import Scan, as_scan
from labkit.support.arrays import EPSILON, FloatArray, IntArray
from labkit.support.compiled import compiled

HALF_WIDTH = 0.25  # [m]: how far a window along the sweep reaches to either side
HALF_BEAMS = 3  # and at the least this many beams
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
CIRCLE_GROWTH = 1.3  # a search begins with a circle so much wider than that of the point before
MAX_NEIGHBOR_DISTANCE = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
MIN_ON_LINE = 3  # points that a line needs

Sums = tuple[float, float, float, float, float]  # of x, y, x², xy, y²
EMPTY_SUMS = (0.0, 0.0, 0.0, 0.0, 0.0)


def estimate_normals(scan: Scan | ArrayLike, grid: Grid | None = None) -> FloatArray:
    """Unit normals (N, 2) of the surface at the points of a scan, turned towards the scanner.

    They are NaN where the neighbourhood is no line: at a lone return, in scatter, at an edge
    sharper than a right angle. `grid` is the points' own, where there is one already.

    Examples
    --------
    >>> wall = Scan.from_points([[2.0, -0.1], [2.0, 0.0], [2.0, 0.1]])
    >>> np.round(estimate_normals(wall)[1], 12).tolist()
    [-1.0, 0.0]
    """
    scan = as_scan(scan)
    if len(scan) < MIN_ON_LINE:
        return np.full((len(scan), 2), np.nan)
    if scan.beams is not None:
        return normals_along_sweep(scan.points)
    return normals_in_space(grid or NearestNeighbors(scan.points).grid)


@compiled
def normals_along_sweep(points: FloatArray) -> FloatArray:
    """Normals from a window of beams around each point, shape (N, 2).

    The sums of a window are differences of running sums, so that wide ones cost no more.
    """
    count, middle = len(points), points[len(points) // 2]  # running sums round by their size
    sums = [EMPTY_SUMS]
    for i in range(count):
        sums.append(add_point(sums[i], points[i, 0] - middle[0], points[i, 1] - middle[1]))
    start, stop = windows_along_sweep(points)
    rounding = 64.0 * EPSILON * (sums[count][2] + sums[count][4])
    normals = np.empty((count, 2))
    for i in range(count):
        (x, y, xx, xy, yy), before = sums[stop[i]], sums[start[i]]
        window = x - before[0], y - before[1], xx - before[2], xy - before[3], yy - before[4]
        towards = points[i, 0], points[i, 1]
        normals[i, 0], normals[i, 1] = normal_of(window, stop[i] - start[i], rounding, towards)
    return normals


@compiled
def normals_in_space(grid: Grid) -> FloatArray:
    """Normals from the nearest `NEIGHBORS` points in space, shape (N, 2)."""
    points, normals = grid.points, np.empty(grid.points.shape)
    rows, squares, radius = np.empty(NEIGHBORS, np.intp), np.empty(NEIGHBORS), 0.0
    for i in grid.rows:  # cell by cell: the point before lies near
        x, y, sums = points[i, 0], points[i, 1], EMPTY_SUMS
        found = neighbors_of(x, y, grid, MAX_NEIGHBOR_DISTANCE, radius, rows, squares)
        radius = (
            CIRCLE_GROWTH * math.sqrt(squares[-1]) if found == NEIGHBORS else MAX_NEIGHBOR_DISTANCE
        )
        for row in rows[:found]:
            sums = add_point(sums, points[row, 0] - x, points[row, 1] - y)
        normals[i, 0], normals[i, 1] = normal_of(sums, found, 0.0, (x, y))
    return normals


@compiled
def add_point(sums: Sums, x: float, y: float) -> Sums:
    """The sums with one more point."""
    return sums[0] + x, sums[1] + y, sums[2] + x * x, sums[3] + x * y, sums[4] + y * y


@compiled
def normal_of(
    sums: Sums, count: int, rounding: float, point: tuple[float, float]
) -> tuple[float, float]:
    """Normal of the line fitted to `count` points (given their sums), turned towards the scanner.

    NaN where they lie on no line, or where their spread [m²] is `rounding` alone.
    """
    if count < MIN_ON_LINE:
        return math.nan, math.nan
    x, y = sums[0] / count, sums[1] / count
    xx = sums[2] / count - x * x  # the entries of M
    xy = sums[3] / count - x * y
    yy = sums[4] / count - y * y
    half = 0.5 * (xx - yy)
    root = math.sqrt(half * half + xy * xy)
    smaller = 0.5 * (xx + yy) - root  # the eigenvalues of M
    larger = 0.5 * (xx + yy) + root
    if not smaller < LINEARITY**2 * larger or larger <= rounding:
        return math.nan, math.nan
    u, v = (-xy, root + half) if half > 0.0 else (half - root, xy)  # eigenvector to the smaller
    if u * point[0] + v * point[1] > 0.0:  # away from the scanner
        u, v = 0.0 - u, 0.0 - v
    length = math.sqrt(u * u + v * v)
    return u / length, v / length


@compiled
def windows_along_sweep(points: FloatArray) -> tuple[IntArray, IntArray]:
    """The first point of each point's window along the sweep, and the one after its last.

    A window reaches `HALF_WIDTH` to either side, at least `HALF_BEAMS` beams, and ends
    with the surface.
    """
    count = len(points)
    step = np.empty(count + 1)  # before each point [m]; at both ends that of the neighbour
    for i in range(1, count):
        dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        step[i] = math.sqrt(dx * dx + dy * dy)
    step[0], step[count] = step[1], step[count - 1]
    start, stop, edge = np.empty(count, np.intp), np.empty(count, np.intp), 0
    for i in range(count):
        if leaves_surface(step, i):
            edge = i
        spacing = max(min(step[i], step[i + 1]), 1e-3 * HALF_WIDTH)
        beams = int(max(HALF_WIDTH / spacing, HALF_BEAMS))
        start[i], stop[i] = max(i - beams, edge), i + beams + 1
    edge = count
    for i in range(count - 1, -1, -1):
        stop[i] = min(stop[i], edge)
        if leaves_surface(step, i):
            edge = i
    return start, stop


@compiled
def leaves_surface(step: FloatArray, i: int) -> bool:
    """True if the step before point i is a gap between two surfaces."""
    shorter = min(step[i - 1], step[i + 1])
    return i > 0 and step[i] > min(max(GAP_RATIO * shorter, GAP_FLOOR), MAX_NEIGHBOR_DISTANCE)
