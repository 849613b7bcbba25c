"""Nearest neighbours, exact: of equally near points the first, as by brute force.

A scan's points lie along walls, so that a grid of cells answers in a few comparisons. A grid
is no index where points crowd into few of its cells, nor where they are very many; then a
k-d tree is asked. Both also say how far all other points are at least, so that nobody asks
again before a point has moved as far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.engine.grid import build_grid, find_in_grid
from labkit.engine.index import Index, Queries
from labkit.engine.jit import compiled
from labkit.engine.tree import build_tree, find_in_tree, in_leaf_order

GRID_MAX = 30_000  # points from which on a tree is safer, whatever lies where
CROWDED = 24.0  # points in a point's own cell, on average, beyond which a tree is faster


@compiled
def build(points: FloatArray) -> Index:
    """The index that suits `points`, shape (M, 2)."""
    if len(points) <= GRID_MAX:
        index, crowd = build_grid(points)
        if crowd <= CROWDED:
            return index
    return build_tree(points)


class Partners(NamedTuple):
    """The nearest target point of each of N points, as it was found last."""

    order: IntArray  # in which the points are asked for: those near one another follow each other
    row: IntArray  # in the target; −1 for none
    x: FloatArray  # where the point was then [m]
    y: FloatArray
    clear: FloatArray  # how far from there all other target points were at least [m]


@compiled
def no_partners(index: Index, points: FloatArray, T: FloatArray) -> Partners:
    """Room for the partners of `points`, moved by T or about so, which nobody has looked for."""
    count = len(points)
    order, row, clear = np.empty(count, np.intp), np.empty(count, np.intp), np.empty(count)
    for i in range(count):
        order[i], row[i], clear[i] = i, -1, 0.0
    if index.depth > 0:
        order = in_leaf_order(index, points, T)
    return Partners(order, row, np.empty(count), np.empty(count), clear)


@compiled
def find_nearest(index: Index, target: FloatArray, queries: Queries) -> None:
    """The nearest target point of each point that is asked for, up to the gate."""
    if index.depth > 0:
        find_in_tree(index, target, queries)
    else:
        find_in_grid(index, target, queries)
