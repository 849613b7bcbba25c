"""The engine: the algorithm of `labkit.icp`, compiled, for one pair of scans or many.

`match` is what ``labkit.icp(..., engine="compiled")`` runs. `match_pairs` matches many pairs
of scans on all cores. Both give the textbook's answers to rounding; the tests hold them to
it. numba compiles the engine when it is first called and keeps what it made on disk.

=============  =====================================================
`jit`          how the engine is compiled, and where it is kept
`index`        points in the order of an index, and how a search begins
`grid`         an index of cells, for scans
`tree`         an index of nodes, for crowds and for very many points
`nearest`      nearest neighbours by either
`normals`      normals of the target's surface
`pairs`        boxes D and E: associate, reject, weigh
`solve`        box F: both metrics
`loop`         the loop, for one pair and for many
`lookup`       what the odometry asks of a pose: its score, its look-through
`matching`     what the rest of labkit calls
=============  =====================================================

Importing this package does not import numba.
"""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from labkit.engine.lookup import mean_values
    from labkit.engine.matching import judge, judge_pairs, match, match_pairs, nearest_rows, warm

__all__ = [
    "is_available",
    "judge",
    "judge_pairs",
    "match",
    "match_pairs",
    "mean_values",
    "nearest_rows",
    "warm",
]


@cache
def is_available() -> bool:
    """Whether numba is installed."""
    return find_spec("numba") is not None


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from labkit.engine import matching  # noqa: PLC0415 (imports numba)

    globals()[name] = found = getattr(matching, name)  # from now on it is found at once
    return found
