"""The lines through a scan's points: normals, and points that lie on them (chapter 6).

The line of a point runs through the mean p̄ of its neighbours. Its normal is the direction in which
they spread least: the eigenvector of their moment matrix

    M = mean of (p − p̄)(p − p̄)ᵀ

to the smaller eigenvalue (total least squares). A scan that knows its beams takes the neighbours
along the sweep; bare points take the nearest ones. A point without enough neighbours on a line gets
NaN: it has no normal, and no later stage may invent one.

Where the points are denser than their noise is wide, such neighbours form a cloud. Its direction is
chance, and so is the distance to its nearest point: near, wherever the other scan lies. So all
points within `line_width` are the neighbours there, a width that follows the noise, and the point
itself is moved onto their line, along the normal. The more points, the less of their noise is left.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from labkit.neighbors import (
    Grid,
    NearestNeighbors,
    cells_around,
    neighbors_of,
    squared,
)
from labkit.scan import Scan, as_scan
from labkit.selection import kth_smallest
from labkit.support.arrays import EPSILON, FloatArray, IntArray
from labkit.support.compiled import compiled

HALF_BEAMS = 3  # beams to either side that a window along the sweep reaches at the least
NEIGHBORS = 2 * HALF_BEAMS + 1  # points looked at in space, the point itself included
CIRCLE_GROWTH = 1.3  # first circle of a search over the last circle of the point before
MAX_NEIGHBOR_DISTANCE = 0.5  # [m]: neighbours farther than this are not on the same surface
GAP_RATIO = 4.0  # a step this much longer than its shorter neighbour leaves the surface
GAP_FLOOR = 0.05  # [m]: a step this short never does
LINEARITY = 0.5  # largest ratio of the spreads across and along that still is a line
MIN_ON_LINE = 3  # points that a line needs
WIDTH_PER_NOISE = 12.0  # radius over noise from which on a neighbourhood shows its line well
WIDE_LINEARITY = 3.0 / WIDTH_PER_NOISE  # as `LINEARITY`, at that radius: noise explains no more
CORE_PER_NOISE = 5.0  # radius over noise of the core of a neighbourhood, and of the shortest one
FILLED = 0.3  # least spread along a line over the radius; √0.2 where points lie evenly
HALF_WIDTH = 0.25  # [m]: how far the window of a sparse sweep reaches to either side
SPARSE_WIDTH_PER_NOISE = 25.0  # half-width of its window over the noise, if that is less
MAX_WIDTH = 2.0  # [m]: no scanner's noise asks for more
SHRINKAGE = math.sqrt(0.5)  # of one circle to the next smaller one
STEADY = 0.7  # spread in that core over that of the whole from which on it is noise
MIN_SPACING = 1e-3 * HALF_WIDTH  # [m]: points closer together count as this far apart
STD_PER_MEDIAN = 1.4826  # standard deviation of normal noise over its median size
SAMPLE_SIZE = 18  # points that tell the width; 17 steps, a prime, sample stacked sweeps evenly
WIDE_SAMPLE = 96  # points of a wide neighbourhood that are looked at

Sums = tuple[float, float, float, float, float, float]  # of w, w x, w y, w x², w x y, w y²
Line = tuple[float, float, float, float, float]  # normal; p̄ along it; spreads across and along [m]
NO_SUMS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_LINE = (math.nan, math.nan, 0.0, 0.0, 0.0)
SPARSE = (HALF_WIDTH, LINEARITY, False)  # `line_width` of points that are no cloud


def estimate_normals(scan: Scan | ArrayLike) -> FloatArray:
    """Unit normals (N, 2) of the surface at the points of a scan, turned towards the scanner.

    They are NaN where the neighbourhood is no line: at a lone return, in scatter, at an edge.

    Examples
    --------
    >>> wall = Scan.from_points([[2.0, -0.1], [2.0, 0.0], [2.0, 0.1]])
    >>> np.round(estimate_normals(wall)[1], 12).tolist()
    [-1.0, 0.0]
    """
    scan = as_scan(scan)
    if len(scan) < MIN_ON_LINE:
        return np.full((len(scan), 2), np.nan)
    grid = NearestNeighbors(scan).grid
    return fit_lines(scan, grid, *line_width(grid))[0]


def fit_lines(
    scan: Scan, grid: Grid, width: float, linearity: float, dense: bool
) -> tuple[FloatArray, FloatArray]:
    """Normals (N, 2) at a scan's points, and the points (N, 2) moved onto their lines.

    `grid` is that of the points, the others are what `line_width` tells of it. Among dense points
    those stay whose neighbours are sparse.
    """
    if scan.beams is None:
        return lines_in_space(grid, width, linearity, dense)
    return lines_along_sweep(grid, width, linearity, dense)


def line_noise(points: FloatArray, on_lines: FloatArray, normals: FloatArray) -> float:
    """Standard deviation [m] of ranges, from the distances between points and their lines.

    Half of the points are enough, so that surfaces which are no lines do not count. It is NaN
    where no point was moved onto a line. A range that meets its surface aslant shows less noise.
    """
    distances = np.hypot(*(points - on_lines).T)
    is_moved = distances > 64.0 * EPSILON * np.abs(points).max(initial=0.0)  # rounding
    if not is_moved.any():
        return math.nan
    depths = (normals[is_moved] * points[is_moved]).sum(axis=1)
    cosines = depths / np.hypot(*points[is_moved].T).clip(np.finfo(float).tiny)
    return float(STD_PER_MEDIAN * np.median(distances[is_moved]) / math.sqrt(np.mean(cosines**2)))


@compiled
def line_width(grid: Grid) -> tuple[float, float, bool]:
    """Radius [m] of neighbourhoods in which points show their lines, their linearity, if dense.

    The circle about the points of a sample shrinks until it shows lines, or grows if what they
    spread is noise, as large in half the circle. Where no circle shows them well, since surfaces
    are short for their noise, one of the smaller ones that shows them at all is taken, and more
    counts as linear. Then it shrinks as far as it shows lines. Points are dense if `NEIGHBORS` of
    them lie in the core of the circle, and if it is noise: about as large in the core, unless they
    leave gaps there. What bent surfaces spread falls. The width of sparse points is at most
    `HALF_WIDTH`.
    """
    sample = spread_out(grid.points)
    radius = MAX_NEIGHBOR_DISTANCE
    spreads = median_spreads(sample, radius, grid)
    half = median_spreads(sample, 0.5 * radius, grid)
    factor = 1.0 / SHRINKAGE if half[0] >= STEADY * spreads[0] else SHRINKAGE
    short_radius, short_spreads = 0.0, spreads
    while not shows_line(spreads, radius, WIDTH_PER_NOISE):
        if radius <= MAX_NEIGHBOR_DISTANCE and shows_line(spreads, radius, CORE_PER_NOISE):
            short_radius, short_spreads = radius, spreads
        if spreads[2] < NEIGHBORS or factor * radius > MAX_WIDTH:
            break
        radius *= factor
        spreads = median_spreads(sample, radius, grid)

    per_noise, linearity = WIDTH_PER_NOISE, WIDE_LINEARITY
    if not shows_line(spreads, radius, WIDTH_PER_NOISE):
        if short_radius == 0.0:
            return SPARSE
        radius, spreads = short_radius, short_spreads
        per_noise, linearity = CORE_PER_NOISE, LINEARITY

    while True:
        noise = spreads[0]
        core_radius = min(CORE_PER_NOISE * noise, 0.5 * radius)
        core = median_spreads(sample, core_radius, grid)
        if core[2] < NEIGHBORS:
            return min(HALF_WIDTH, SPARSE_WIDTH_PER_NOISE * noise), LINEARITY, False
        spreads = median_spreads(sample, SHRINKAGE * radius, grid)
        if not shows_line(spreads, SHRINKAGE * radius, per_noise):
            break
        radius *= SHRINKAGE
    is_steady = core[0] >= STEADY * noise or core[1] < FILLED * core_radius
    return (radius, linearity, True) if is_steady else SPARSE


@compiled
def shows_line(spreads: tuple[float, float, float], radius: float, per_noise: float) -> bool:
    """True if neighbourhoods fill this radius [m] along a line, so many times as wide as they."""
    across, along, count = spreads
    is_filled = count >= NEIGHBORS and along >= FILLED * radius
    return is_filled and per_noise * across <= radius


def is_cloud(grid: Grid, noise: float) -> bool:
    """True if points lie closer together than their noise [m]: three within it."""
    _, _, count = median_spreads(spread_out(grid.points), noise, grid)
    return count >= MIN_ON_LINE


@compiled
def spread_out(points: FloatArray) -> FloatArray:
    """A sample of the points from the first to the last one, alike in either order."""
    size = min(SAMPLE_SIZE, len(points))
    steps = max(1, size - 1)
    sample = np.empty((size, 2))
    for i in range(size):
        sample[i] = points[(i * (len(points) - 1) + steps // 2) // steps]  # the nearest row
    return sample


@compiled
def median_spreads(sample: FloatArray, radius: float, grid: Grid) -> tuple[float, float, float]:
    """Medians over a sample: spreads across and along its neighbourhoods [m], and their points."""
    size = len(sample)
    across = np.empty(size)
    along = np.empty(size)
    counts = np.empty(size)
    for i in range(size):
        sums, counts[i] = sums_within(sample[i, 0], sample[i, 1], radius, grid, 0)
        _, _, _, across[i], along[i] = line_of(sums, counts[i])
    middle = size // 2
    return (
        kth_smallest(across, middle),
        kth_smallest(along, middle),
        kth_smallest(counts, middle),
    )


@compiled
def lines_along_sweep(
    grid: Grid, width: float, linearity: float, dense: bool
) -> tuple[FloatArray, FloatArray]:
    """Normals, and points on their lines, by a window of beams around each point, (N, 2) each."""
    points = grid.points
    start, stop = windows_along_sweep(points, width)
    normals = np.empty(points.shape)
    on_lines = points.copy()
    for i in range(len(points)):
        sums = NO_SUMS
        for k in range(start[i], stop[i]):
            sums = add_point(sums, points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], 1.0)
        line = line_of(sums, stop[i] - start[i])
        put_on_line(i, line, grid, width, linearity, dense, normals, on_lines)
    return normals, on_lines


@compiled
def lines_in_space(
    grid: Grid, width: float, linearity: float, dense: bool
) -> tuple[FloatArray, FloatArray]:
    """Normals, and points on their lines, by the `NEIGHBORS` nearest in space, (N, 2) each."""
    points = grid.points
    normals = np.empty(points.shape)
    on_lines = points.copy()
    rows = np.empty(NEIGHBORS, np.intp)
    squares = np.empty(NEIGHBORS)
    radius = 0.0
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        count = neighbors_of(x, y, grid, MAX_NEIGHBOR_DISTANCE, radius, rows, squares)
        if count == NEIGHBORS:
            radius = CIRCLE_GROWTH * math.sqrt(squares[-1])
        else:
            radius = MAX_NEIGHBOR_DISTANCE
        sums = NO_SUMS
        for row in rows[:count]:
            sums = add_point(sums, points[row, 0] - x, points[row, 1] - y, 1.0)
        put_on_line(i, line_of(sums, count), grid, width, linearity, dense, normals, on_lines)
    return normals, on_lines


@compiled
def put_on_line(
    i: int,
    line: Line,
    grid: Grid,
    width: float,
    linearity: float,
    dense: bool,
    normals: FloatArray,
    on_lines: FloatArray,
) -> None:
    """Write row i of the normals, and of the points on lines."""
    x, y = grid.points[i, 0], grid.points[i, 1]
    nx, ny, offset, across, along = line
    is_cloud = dense and math.sqrt(3.0) * along < width
    if is_cloud:
        nx, ny, offset, across, along = wide_line(x, y, i, grid, width)
    else:
        linearity = LINEARITY
    if not across < linearity * along:
        nx, ny = math.nan, math.nan
    elif nx * x + ny * y > 0.0:  # away from the scanner
        nx, ny, offset = 0.0 - nx, 0.0 - ny, 0.0 - offset
    normals[i, 0] = nx
    normals[i, 1] = ny
    if is_cloud == dense and math.isfinite(nx):
        on_lines[i, 0] = x + offset * nx
        on_lines[i, 1] = y + offset * ny


@compiled
def wide_line(x: float, y: float, i: int, grid: Grid, width: float) -> Line:
    """The line of point i at (x, y), through all points within `width` [m], or a wider circle.

    The circle grows until the points fill it: points on one beam are no wall.
    """
    radius = width
    while radius <= max(width, MAX_NEIGHBOR_DISTANCE):
        sums, count = sums_within(x, y, radius, grid, i)
        line = line_of(sums, count)
        if count >= NEIGHBORS and line[4] >= FILLED * radius:
            return line
        radius *= 2.0
    return NO_LINE


@compiled
def sums_within(x: float, y: float, radius: float, grid: Grid, first: int) -> tuple[Sums, int]:
    """Sums over the points within a radius [m] of (x, y), relative to it, and their number.

    Of many points every n-th is looked at; which one is the `first` differs from point to point, so
    that all points together look at all.
    """
    left, right, low, high = cells_around(x, y, radius, grid)
    total = 0
    for line in range(low, high + 1):
        row = line * grid.columns
        total += grid.start[row + right + 1] - grid.start[row + left]
    stride = max(1, total // WIDE_SAMPLE)

    sums = NO_SUMS
    count = 0
    skipped = first % stride
    for line in range(low, high + 1):
        row = line * grid.columns
        k = grid.start[row + left] + skipped
        end = grid.start[row + right + 1]
        while k < end:
            weight = radius * radius - squared(x, y, grid.entries, k)
            if weight > 0.0:
                dx, dy = grid.entries[k, 0] - x, grid.entries[k, 1] - y
                sums = add_point(sums, dx, dy, weight)
                count += 1
            k += stride
        skipped = k - end
    return sums, count


@compiled
def add_point(sums: Sums, x: float, y: float, w: float) -> Sums:
    """The sums with one more point, of weight w."""
    total, wx, wy, xx, xy, yy = sums
    return total + w, wx + w * x, wy + w * y, xx + w * x * x, xy + w * x * y, yy + w * y * y


@compiled
def line_of(sums: Sums, count: int) -> Line:
    """The line fitted to `count` points, given their sums about a point; NaN if all coincide.

    Its unit normal (nx, ny), how far it lies from that point along the normal [m], and how far the
    points spread across and along it [m].
    """
    if count < MIN_ON_LINE:
        return NO_LINE
    x, y = sums[1] / sums[0], sums[2] / sums[0]  # p̄
    xx = sums[3] / sums[0] - x * x  # the entries of M
    xy = sums[4] / sums[0] - x * y
    yy = sums[5] / sums[0] - y * y
    half = 0.5 * (xx - yy)
    root = math.sqrt(half * half + xy * xy)
    smaller = max(0.0, 0.5 * (xx + yy) - root)  # the eigenvalues of M
    larger = 0.5 * (xx + yy) + root
    u, v = (-xy, root + half) if half > 0.0 else (half - root, xy)  # eigenvector to the smaller
    length = math.sqrt(u * u + v * v)
    if not length > 0.0:
        return NO_LINE
    nx, ny = u / length, v / length
    return nx, ny, nx * x + ny * y, math.sqrt(smaller), math.sqrt(larger)


@compiled
def windows_along_sweep(points: FloatArray, width: float) -> tuple[IntArray, IntArray]:
    """First point of each point's window along the sweep, and the point after its last one.

    A window reaches `width` [m] to either side, at least `HALF_BEAMS` beams, and ends with the
    surface.
    """
    count = len(points)
    step = np.empty(count + 1)  # entry i: from point i − 1 to point i [m]
    for i in range(1, count):
        step[i] = math.sqrt(squared(points[i, 0], points[i, 1], points, i - 1))
    step[0] = step[1]  # both ends take the step beside them
    step[count] = step[count - 1]

    start = np.empty(count, np.intp)
    stop = np.empty(count, np.intp)
    surface_start = 0
    for i in range(count):
        if leaves_surface(step, i):
            surface_start = i
        spacing = max(min(step[i], step[i + 1]), MIN_SPACING)
        beams = max(int(width / spacing), HALF_BEAMS)
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
