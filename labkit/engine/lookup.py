"""The correlative search's inner loop: what stands in a table under points that are shifted."""

from __future__ import annotations

import numpy as np

from labkit.arrays import FloatArray, IntArray
from labkit.engine.jit import entry


@entry
def mean_values(table: FloatArray, cells: IntArray, shifts: IntArray) -> FloatArray:
    """The mean of the table under cells (R, N, 2) moved by shifts (S, 2), shape (R, S).

    A cell beyond the table counts as the nearest one on its border.
    """
    last_row, last_column = table.shape[0] - 1, table.shape[1] - 1
    means = np.empty((len(cells), len(shifts)))
    for r in range(len(cells)):
        for s in range(len(shifts)):
            down, right, total = shifts[s, 0], shifts[s, 1], 0.0
            for n in range(cells.shape[1]):
                i = min(max(cells[r, n, 0] + down, 0), last_row)
                j = min(max(cells[r, n, 1] + right, 0), last_column)
                total += table[i, j]
            means[r, s] = total / cells.shape[1]
    return means
