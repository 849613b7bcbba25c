"""A balanced k-d tree: the index of crowds, and of very many points (`labkit.engine.nearest`)."""

from __future__ import annotations

import math

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.engine.index import NOT_LESS, Index, Queries, look_at, no_farther, nothing_yet, settle
from labkit.engine.jit import compiled, inlined

LEAF = 8  # points in a leaf of the tree, about


@compiled
def build_tree(points: FloatArray) -> Index:
    """Points in the leaves of a balanced tree, cut across its longer extent at each node."""
    count, depth = len(points), 1
    while count >> depth > LEAF:
        depth += 1
    row = np.empty(count, np.intp)
    for i in range(count):
        row[i] = i
    split, axis = np.empty((1 << depth) - 1), np.empty((1 << depth) - 1, np.intp)
    for level in range(depth):
        for k in range(1 << level):
            begin, end = (count * k) >> level, (count * (k + 1)) >> level
            middle = (count * (2 * k + 1)) >> (level + 1)
            node = (1 << level) - 1 + k
            axis[node] = longer_extent(points, row, begin, end)
            select(points, axis[node], row, begin, end, middle)
            split[node] = points[row[middle], axis[node]]
    start = np.empty((1 << depth) + 1, np.intp)
    for k in range((1 << depth) + 1):
        start[k] = (count * k) >> depth
    x, y = np.empty(count), np.empty(count)
    for k in range(count):
        x[k], y[k] = points[row[k], 0], points[row[k], 1]
    return Index(x, y, row, start, 0.0, 0.0, 0.0, 0, 0, depth, split, axis)


@compiled
def longer_extent(points: FloatArray, row: IntArray, begin: int, end: int) -> int:
    """The axis along which the points of a node reach farther."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(begin, end):
        x, y = points[row[k], 0], points[row[k], 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    return 0 if high_x - low_x >= high_y - low_y else 1


@compiled
def select(points: FloatArray, axis: int, row: IntArray, begin: int, end: int, middle: int) -> None:
    """Reorder ``row[begin:end]`` by a coordinate, so that the one at `middle` has its rank."""
    low, high = begin, end - 1
    while low < high:
        pivot = points[row[(low + high) >> 1], axis]
        i, j = low, high
        while i <= j:
            while points[row[i], axis] < pivot:
                i += 1
            while points[row[j], axis] > pivot:
                j -= 1
            if i <= j:
                row[i], row[j] = row[j], row[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled
def find_in_tree(index: Index, target: FloatArray, queries: Queries) -> None:
    """`find_nearest` by descending to each point's leaf, and then what else may be nearer.

    A row of the stack is a branch still to be visited: its node, how far the point lies
    outside it along x and y [m], and the square of that distance.
    """
    x, y, gate, asked, row = queries.x, queries.y, queries.gate, queries.asked, queries.row
    start, split, axis, inner = index.start, index.split, index.axis, len(index.split)
    found, stack, most = -1, np.zeros((64, 4)), gate * gate * NOT_LESS
    for i in asked:
        bound = no_farther(target, row[i] if row[i] >= 0 else found, x[i], y[i], most)
        seen, passed_by, waiting = nothing_yet(), math.inf, 1
        stack[0, 0] = stack[0, 1] = stack[0, 2] = stack[0, 3] = 0.0
        while waiting > 0:
            waiting -= 1
            if stack[waiting, 3] <= bound * NOT_LESS:
                leaf, waiting = descend(split, axis, x[i], y[i], stack, waiting)
                leaf -= inner
                seen = look_at(index, start[leaf], start[leaf + 1], x[i], y[i], seen)
                bound = min(bound, seen.least)
            else:
                passed_by = min(passed_by, stack[waiting, 3])
        found = settle(index, queries, i, seen, passed_by, most, found)


@inlined
def descend(
    split: FloatArray, axis: IntArray, px: float, py: float, stack: FloatArray, waiting: int
) -> tuple[int, int]:
    """The leaf on p's side below branch ``stack[waiting]``; the other sides wait in its place."""
    node, out_x, out_y = int(stack[waiting, 0]), stack[waiting, 1], stack[waiting, 2]
    while node < len(split):
        along_x = axis[node] == 0
        across = (px if along_x else py) - split[node]
        near, far = 2 * node + 1, 2 * node + 2
        if across > 0.0:
            near, far = far, near
        far_x, far_y = (across, out_y) if along_x else (out_x, across)
        stack[waiting, 0], stack[waiting, 1], stack[waiting, 2] = far, far_x, far_y
        stack[waiting, 3] = far_x * far_x + far_y * far_y
        waiting += 1
        node = near
    return node, waiting


@compiled
def in_leaf_order(index: Index, points: FloatArray, T: FloatArray) -> IntArray:
    """The rows of `points`, moved by T, leaf by leaf of the tree that they fall into.

    Asked for in this order, points find what they look at in the processor's cache.
    """
    split, axis, count = index.split, index.axis, len(points)
    leaf, order = np.empty(count, np.intp), np.empty(count, np.intp)
    fill = np.zeros(len(split) + 2, np.intp)
    for i in range(count):
        x = T[0, 0] * points[i, 0] + T[0, 1] * points[i, 1] + T[0, 2]
        y = T[1, 0] * points[i, 0] + T[1, 1] * points[i, 1] + T[1, 2]
        node = 0
        while node < len(split):
            node = 2 * node + 1 + ((x if axis[node] == 0 else y) > split[node])
        leaf[i] = node - len(split)
        fill[leaf[i] + 1] += 1
    for k in range(len(split) + 1):
        fill[k + 1] += fill[k]
    for i in range(count):
        order[fill[leaf[i]]] = i
        fill[leaf[i]] += 1
    return order
