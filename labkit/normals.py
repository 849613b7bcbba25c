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
HALF_BEAMS = 3  # beams that it reaches at the least
MIN_SPACING = 1e-3 * HALF_WIDTH  # [m]: points closer together count as this far apart
NEIGHBORS = 7  # neighbours looked at in space, the point itself included
CIRCLE_GROWTH = 1.3  # first circle of a search over the last circle of the point before
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
    return normals_in_space(grid or NearestNeighbors(scan).grid)


@compiled
def normals_along_sweep(points: FloatArray) -> FloatArray:
    """Normals from a window of beams around each point, shape (N, 2).

    The sums of a window are differences of running sums, so that wide ones cost no more.
    """
    count = len(points)
    middle = points[count // 2]  # small numbers round less
    running = [EMPTY_SUMS]  # entry i: the sums of the points before point i
    for i in range(count):
        x = points[i, 0] - middle[0]
        y = points[i, 1] - middle[1]
        running.append(add_point(running[i], x, y))
    _, _, squares_x, _, squares_y = running[count]
    rounding = 64.0 * EPSILON * (squares_x + squares_y)  # [m²]

    start, stop = windows_along_sweep(points)
    normals = np.empty((count, 2))
    for i in range(count):
        window = subtract_sums(running[stop[i]], running[start[i]])
        size = stop[i] - start[i]
        point = points[i, 0], points[i, 1]
        normals[i, 0], normals[i, 1] = normal_of(window, size, rounding, point)
    return normals


@compiled
def normals_in_space(grid: Grid) -> FloatArray:
    """Normals from the nearest `NEIGHBORS` points in space, shape (N, 2)."""
    points = grid.points
    normals = np.empty(points.shape)
    rows = np.empty(NEIGHBORS, np.intp)
    squares = np.empty(NEIGHBORS)
    radius = 0.0
    for i in grid.rows:  # cell by cell, so that the point before lies near
        x, y = points[i, 0], points[i, 1]
        count = neighbors_of(x, y, grid, MAX_NEIGHBOR_DISTANCE, radius, rows, squares)
        if count == NEIGHBORS:
            radius = CIRCLE_GROWTH * math.sqrt(squares[-1])
        else:
            radius = MAX_NEIGHBOR_DISTANCE
        sums = EMPTY_SUMS
        for row in rows[:count]:
            sums = add_point(sums, points[row, 0] - x, points[row, 1] - y)
        normals[i, 0], normals[i, 1] = normal_of(sums, count, 0.0, (x, y))
    return normals


@compiled
def add_point(sums: Sums, x: float, y: float) -> Sums:
    """The sums with one more point."""
    return sums[0] + x, sums[1] + y, sums[2] + x * x, sums[3] + x * y, sums[4] + y * y


@compiled
def subtract_sums(sums: Sums, less: Sums) -> Sums:
    """The sums without those of other points."""
    return (
        sums[0] - less[0],
        sums[1] - less[1],
        sums[2] - less[2],
        sums[3] - less[3],
        sums[4] - less[4],
    )


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
    """First point of each point's window along the sweep, and the point after its last one.

    A window reaches `HALF_WIDTH` to either side, at least `HALF_BEAMS` beams, and ends
    with the surface.
    """
    count = len(points)
    step = np.empty(count + 1)  # entry i: from point i − 1 to point i [m]
    for i in range(1, count):
        dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        step[i] = math.sqrt(dx * dx + dy * dy)
    step[0] = step[1]  # both ends take the step beside them
    step[count] = step[count - 1]

    start = np.empty(count, np.intp)
    stop = np.empty(count, np.intp)
    surface_start = 0
    for i in range(count):
        if leaves_surface(step, i):
            surface_start = i
        spacing = max(min(step[i], step[i + 1]), MIN_SPACING)
        beams = int(max(HALF_WIDTH / spacing, HALF_BEAMS))
        start[i] = max(i - beams, surface_start)
        stop[i] = i + beams + 1

    surface_stop = count
    for i in range(count - 1, -1, -1):  # backwards: each surface ends where the next one starts
        stop[i] = min(stop[i], surface_stop)
        if leaves_surface(step, i):
            surface_stop = i
    return start, stop


@compiled
def leaves_surface(step: FloatArray, i: int) -> bool:
    """True if the step before point i is a gap between two surfaces."""
    shorter = min(step[i - 1], step[i + 1])
    return i > 0 and step[i] > min(max(GAP_RATIO * shorter, GAP_FLOOR), MAX_NEIGHBOR_DISTANCE)
