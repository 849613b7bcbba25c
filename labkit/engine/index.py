"""What a grid and a tree of points have in common: the points in their order, and a start.

A search begins from a guess, mostly the partner of the iteration before or its neighbour on
the wall: what is farther than that, or than the gate, need not be looked at.
"""

from __future__ import annotations

from typing import NamedTuple

from labkit.arrays import FloatArray, IntArray
from labkit.engine.jit import inlined

SLACK = 1e-3  # of a cell, by which a box is widened against rounding
NOT_LESS = 1.0 + 1e-9  # against rounding in lower bounds

Entries = tuple[FloatArray, FloatArray, IntArray, IntArray]  # x, y, row, start of an index


class Index(NamedTuple):
    """Points in the order of a grid's cells, or of a tree's leaves where `depth` > 0.

    Entries ``start[k]`` to ``start[k + 1]`` are those of cell k, row by row, or of leaf k.
    """

    x: FloatArray
    y: FloatArray
    row: IntArray  # of each in the target
    start: IntArray
    low_x: float  # the grid's corner [m]
    low_y: float
    per_metre: float  # cells
    columns: int
    rows: int
    depth: int  # of the tree
    split: FloatArray  # [m], of each inner node; its children are 2 k + 1 and 2 k + 2
    axis: IntArray


class Queries(NamedTuple):
    """Points whose nearest target points are looked for, and room for what is found.

    `row` holds a row of the target for each to begin from, or −1 to begin from the partner of
    the one before.
    """

    x: FloatArray  # [m]
    y: FloatArray
    gate: float  # [m]: nobody looks farther
    asked: IntArray  # which of the points
    row: IntArray  # takes the partner; −1 where none is within the gate
    square: FloatArray  # takes its squared distance [m²]; inf for none
    clear: FloatArray  # takes the square of how far all others are at least


@inlined
def guess_near(
    target: FloatArray, guess: int, px: float, py: float, most: float
) -> tuple[int, float]:
    """A row to begin from, of a guess and its neighbours, and its squared distance.

    −1 and `most` where none is nearer than that.
    """
    best, least = -1, most
    if guess >= 0:
        best, least = nearer(target, guess, px, py, best, least)
        if guess > 0:
            best, least = nearer(target, guess - 1, px, py, best, least)
        if guess + 1 < len(target):
            best, least = nearer(target, guess + 1, px, py, best, least)
    return best, least


@inlined
def nearer(
    target: FloatArray, row: int, px: float, py: float, best: int, least: float
) -> tuple[int, float]:
    """The nearer one of `best` and `row`, and its squared distance."""
    dx, dy = px - target[row, 0], py - target[row, 1]
    square = dx * dx + dy * dy
    return (row, square) if square < least else (best, least)


@inlined
def scan_cells(
    entries: Entries,
    first: int,
    last: int,
    px: float,
    py: float,
    best: int,
    least: float,
    second: float,
) -> tuple[int, float, float]:
    """The nearest among `best` and the entries of cells `first` to `last`.

    With it goes the least squared distance of all others, if it is below `second`.
    """
    x, y, row, start = entries
    for k in range(start[first], start[last + 1]):
        dx, dy = px - x[k], py - y[k]
        square = dx * dx + dy * dy
        if square <= second and row[k] != best:
            if square < least or (square == least and row[k] < best):
                second = least if best >= 0 else second
                best, least = row[k], square
            else:
                second = square
    return best, least, second
