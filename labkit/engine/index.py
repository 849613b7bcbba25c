"""What a grid and a tree of points have in common: the points in their order, and a start.

A search begins from a guess, mostly the partner of the iteration before or its neighbour on
the wall: what is farther than that, or than the gate, need not be looked at.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from labkit.arrays import FloatArray, IntArray
from labkit.engine.jit import inlined

SLACK = 1e-3  # of a cell, by which a box is widened against rounding
NOT_LESS = 1.0 + 1e-9  # against rounding in lower bounds


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
def no_farther(target: FloatArray, guess: int, px: float, py: float, most: float) -> float:
    """A square [m²] that the nearest point's is not above: the guess's, a neighbour's or `most`."""
    if guess >= 0:
        for row in range(max(guess - 1, 0), min(guess + 2, len(target))):
            dx, dy = px - target[row, 0], py - target[row, 1]
            most = min(most, dx * dx + dy * dy)
    return most


class Nearest(NamedTuple):
    """What a search has seen so far."""

    entry: int  # of the index; of equally near ones that whose row comes first
    least: float  # its squared distance [m²]; inf before any
    second: float  # the least of all others


@inlined
def nothing_yet() -> Nearest:
    """Before a search."""
    return Nearest(0, math.inf, math.inf)


@inlined
def look_at(index: Index, first: int, last: int, px: float, py: float, seen: Nearest) -> Nearest:
    """The nearest of what was `seen` and of the entries ``first`` to ``last - 1``.

    Which is the nearer one is chosen without a branch, for nobody foretells it.
    """
    entry, least, second = seen
    for k in range(first, last):
        dx, dy = px - index.x[k], py - index.y[k]
        square = dx * dx + dy * dy
        if square == least and index.row[k] < index.row[entry]:
            entry = k
        second = min(second, max(square, least))
        entry = k if square < least else entry
        least = min(least, square)
    return Nearest(entry, least, second)


@inlined
def settle(
    index: Index,
    queries: Queries,
    i: int,
    seen: Nearest,
    beyond: float,
    most: float,
    found: int,
) -> int:
    """Write what was found for point i; `beyond` is the least square of what was not looked at.

    Returns its partner, or `found` where none is nearer than the square `most`.
    """
    if seen.least < most:
        found = index.row[seen.entry]
        queries.row[i], queries.square[i] = found, seen.least
        queries.clear[i] = min(seen.second, beyond)
    else:
        queries.row[i], queries.square[i] = -1, math.inf
        queries.clear[i] = min(seen.least, beyond)
    return found
