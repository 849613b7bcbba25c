"""How the time of a match grows with the number of points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from data import ray_pairs
from matchers.lab import with_quality
from peers import Matcher
from timing import measure

SIZES = (50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000)
PAIRS = 3
PATIENCE = 3.0  # s a pair; a matcher that needs more is spared the larger sizes
ORDERS = {"time_ms": True, "shuffled_ms": False}


def growth(
    matchers: Sequence[Matcher], split: str, rounds: int, largest: int, clock: str
) -> dict[str, Any]:
    """Median time a pair [ms] for scans of so many beams, in their order and shuffled.

    None where patience ran out. labkit runs once more, and tells its inliers and its history.
    """
    if any(matcher.takes_scans for matcher in matchers):
        named = {"name": "labkit point-to-line with its history", "function": with_quality}
        matchers = [*matchers, Matcher(**named, takes_scans=True, slow=False)]
    sizes = [size for size in SIZES if size <= largest]
    result: dict[str, Any] = {"points": sizes}
    for key, ordered in ORDERS.items():
        times: dict[str, list[float | None]] = {matcher.name: [] for matcher in matchers}
        patient = list(matchers)
        for size in sizes:
            runs = measure(patient, ray_pairs(split, PAIRS, size, ordered=ordered), rounds)
            for name, column in times.items():
                run = runs.get(name)
                column.append(None if run is None else 1e3 * float(np.median(run.seconds(clock))))
            patient = [matcher for matcher in patient if times[matcher.name][-1] <= 1e3 * PATIENCE]
        result[key] = times
    return result
