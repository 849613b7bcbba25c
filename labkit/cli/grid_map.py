"""An occupancy grid of a run as navigation stacks read it: ``map.pgm`` with ``map.yaml``.

In `nav2`'s and ROS 1's `map_server` a dark cell is occupied, a white one free, a grey one unknown.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from labkit.scan import Scan
from labkit.se2 import apply, from_xytheta
from labkit.support.arrays import FloatArray, IntArray
from labkit.support.files import atomic_write

OCCUPIED, UNKNOWN, FREE = 0, 205, 254  # grey levels of map_server
RESOLUTION = 0.05  # [m] of a cell, doubled until the map has at most so many cells
MOST_CELLS = 10_000_000
MOST_SCANS = 1500  # of a longer run each second, third or n-th scan makes the map
OUTSIDE_SHARE = 0.001  # of the points, beyond each of the four sides of the map
MIN_HIT_SHARE = 0.25  # of the scans that reach a cell end in one that is occupied


class GridMap(NamedTuple):
    """Cells (H, W), from the top row down, and the place of the lower left corner [m]."""

    cells: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]
    resolution: float
    corner: tuple[float, float]


def occupancy(poses: FloatArray, scans: Sequence[Scan]) -> GridMap:
    """The cells in which beams end, and those that they pass, at poses (K, 3) of the scanner."""
    step = math.ceil(len(scans) / MOST_SCANS) or 1
    rows, drawn = poses[::step], scans[::step]
    low, high = _bounds(rows, drawn)
    resolution = RESOLUTION
    while np.prod(np.ceil((high - low) / resolution) + 1.0) > MOST_CELLS:
        resolution *= 2.0
    shape = np.ceil((high - low) / resolution).astype(int) + 1
    hits = np.zeros(shape[0] * shape[1], np.uint16)
    passes = np.zeros_like(hits)
    for pose, scan in zip(rows, drawn, strict=True):
        T_map_laser = from_xytheta(pose)
        ends = _cells(apply(T_map_laser, scan.points), low, resolution, shape)
        way = _cells(apply(T_map_laser, _along_beams(scan, resolution)), low, resolution, shape)
        hits[ends] += 1
        passes[np.setdiff1d(way, ends, assume_unique=True)] += 1
    seen = hits + passes
    is_occupied = hits >= MIN_HIT_SHARE * seen
    levels = np.where(is_occupied, OCCUPIED, FREE)
    levels = np.where(seen == 0, UNKNOWN, levels).astype(np.uint8)
    cells = levels.reshape(shape[0], shape[1]).T[::-1]
    return GridMap(cells, resolution, (float(low[0]), float(low[1])))


def _bounds(poses: FloatArray, scans: Sequence[Scan]) -> tuple[FloatArray, FloatArray]:
    """Corners [m] of a map of all poses and nearly all points."""
    worlds = list(_worlds(poses, scans))
    points = np.vstack(worlds)
    inner = np.quantile(points, (OUTSIDE_SHARE, 1.0 - OUTSIDE_SHARE), axis=0)
    corners = np.vstack([inner, poses[:, :2]])
    return corners.min(axis=0) - RESOLUTION, corners.max(axis=0) + RESOLUTION


def _worlds(poses: FloatArray, scans: Sequence[Scan]) -> Iterator[FloatArray]:
    yield poses[:, :2]
    for pose, scan in zip(poses, scans, strict=True):
        yield apply(from_xytheta(pose), scan.points)


def _along_beams(scan: Scan, spacing: float) -> FloatArray:
    """Points (M, 2) along each beam up to a cell before its end [m]."""
    lengths = np.hypot(*scan.points.T)
    counts = np.maximum(np.ceil(lengths / spacing).astype(int) - 1, 0)
    beam = np.repeat(np.arange(len(lengths)), counts)
    first = np.cumsum(counts) - counts
    number = np.arange(counts.sum()) - first[beam]
    directions = scan.points / np.maximum(lengths, spacing)[:, None]
    return np.asarray(directions[beam] * (number * spacing)[:, None])


def _cells(points: FloatArray, low: FloatArray, resolution: float, shape: IntArray) -> IntArray:
    """Numbers of the cells within the map that points lie in, each once."""
    cell = np.floor((points - low) / resolution).astype(int)
    is_inside = np.asarray((cell >= 0) & (cell < shape)).all(axis=1)
    return np.unique(cell[is_inside, 0] * shape[1] + cell[is_inside, 1])


def write_pgm(path: str, grid: GridMap) -> None:
    """Write the picture of a map."""
    height, width = grid.cells.shape
    with atomic_write(path, "wb") as file:
        file.write(f"P5\n{width} {height}\n255\n".encode())
        file.write(np.ascontiguousarray(grid.cells).tobytes())


def write_yaml(path: str, grid: GridMap, frame: str) -> None:
    """Write what map_server asks of a map beside its picture, which has the same name."""
    x, y = grid.corner
    picture = os.path.basename(path).removesuffix(".yaml") + ".pgm"
    with atomic_write(path) as file:
        file.write(
            f"# {frame}\n"
            f"image: {picture}\n"
            f"mode: trinary\n"
            f"resolution: {grid.resolution:g}\n"
            f"origin: [{x:.4f}, {y:.4f}, 0.0]\n"
            f"negate: 0\n"
            f"occupied_thresh: 0.65\n"
            f"free_thresh: 0.196\n"
        )
