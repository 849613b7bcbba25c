"""Selection: the value of a rank, without sorting."""

from __future__ import annotations

from labkit.support.arrays import FloatArray
from labkit.support.compiled import compiled


@compiled
def kth_smallest(values: FloatArray, rank: int) -> float:
    """The value of that rank, counted from 0 in ascending order (Hoare's quickselect)."""
    v = values.copy()
    low, high = 0, len(v) - 1
    while low < high:
        pivot = v[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while v[i] < pivot:
                i += 1
            while v[j] > pivot:
                j -= 1
            if i <= j:
                v[i], v[j] = v[j], v[i]
                i += 1
                j -= 1
        if rank <= j:
            high = j
        elif rank >= i:
            low = i
        else:
            break
    return float(v[rank])
