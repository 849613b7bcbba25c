"""Maps for navigation stacks: what is occupied, free and unknown, and where."""

import numpy as np
import pytest

from labkit.cli.grid_map import FREE, OCCUPIED, UNKNOWN, occupancy, write_pgm, write_yaml
from labkit.scan import Scan

POSES = np.array([[x, 0.3, heading] for x in (-0.5, 0.0, 0.4) for heading in (0.0, 1.0, 3.0)])
SIDE = 2.0  # [m] of a square room about the origin


def scan_at(pose):
    """A scan of the square room, by the nearest of its four walls in each direction."""
    angles = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    c, s = np.cos(angles + pose[2]), np.sin(angles + pose[2])
    with np.errstate(divide="ignore"):
        walls = [(SIDE / 2 * np.sign(d) - p) / d for d, p in ((c, pose[0]), (s, pose[1]))]
    return Scan.from_ranges(np.minimum(*walls), angles)


@pytest.fixture(scope="module")
def grid():
    return occupancy(POSES, [scan_at(pose) for pose in POSES])


def places_of(grid, level):
    """Middles of the cells of a level [m]."""
    row, column = np.nonzero(grid.cells == level)
    x = grid.corner[0] + (column + 0.5) * grid.resolution
    y = grid.corner[1] + (len(grid.cells) - row - 0.5) * grid.resolution
    return np.column_stack([x, y])


def test_walls_are_occupied_and_the_room_is_free(grid):
    occupied, free = (np.abs(places_of(grid, level)).max(axis=1) for level in (OCCUPIED, FREE))

    assert len(occupied) >= 4 * SIDE / grid.resolution
    assert np.abs(occupied - SIDE / 2).max() <= grid.resolution
    assert free.max() <= SIDE / 2 + grid.resolution
    assert len(free) >= 0.85 * (SIDE / grid.resolution) ** 2


def test_what_no_beam_reached_is_unknown():
    behind = occupancy(POSES[:1], [Scan.from_points([[0.5, 0.0], [0.0, 2.0]])])
    assert UNKNOWN in behind.cells
    assert np.count_nonzero(behind.cells == OCCUPIED) == 2


def test_a_large_map_takes_coarser_cells(grid, monkeypatch):
    monkeypatch.setattr("labkit.cli.grid_map.MOST_CELLS", grid.cells.size // 2)
    coarse = occupancy(POSES, [scan_at(pose) for pose in POSES])
    assert coarse.resolution == 2 * grid.resolution
    assert coarse.cells.size <= grid.cells.size // 2


def test_the_files_are_those_of_map_server(grid, tmp_path):
    write_pgm(str(tmp_path / "run-map.pgm"), grid)
    write_yaml(str(tmp_path / "run-map.yaml"), grid, "a frame")

    head, size, top, cells = (tmp_path / "run-map.pgm").read_bytes().split(b"\n", 3)
    height, width = grid.cells.shape
    assert (head, size, top) == (b"P5", f"{width} {height}".encode(), b"255")
    assert np.frombuffer(cells, np.uint8).reshape(height, width).tolist() == grid.cells.tolist()
    text = (tmp_path / "run-map.yaml").read_text()
    assert "image: run-map.pgm\n" in text
    assert f"origin: [{grid.corner[0]:.4f}, {grid.corner[1]:.4f}, 0.0]" in text
