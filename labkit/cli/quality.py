"""The quality file: one CSV row a step, with what the step decided and on what grounds."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from labkit.arrays import FloatArray
from labkit.files import atomic_write
from labkit.odometry import StepRecord

# What a match tells, by its column: a field of the record. Empty without a match.
OF_A_MATCH = {
    "inliers": "inlier_count",
    "inlier_ratio": "inlier_ratio",
    "rmse_m": "rmse",
    "cost_m2": "cost",
    "seen_through": "seen_through",
    "margin": "margin",
    "ambiguous": "ambiguous",
    "rotation_rad": "rotation",
    "information": "information",
    "degenerate": "degenerate",
    "spread_ratio": "spread",
    "iterations": "iterations",
}
MOTION = ("dx_m", "dy_m", "dtheta_rad")
COLUMNS = ("scan", "stamp", "decision", *MOTION, *OF_A_MATCH, "termination", "reason")


def write_quality(path: str | Path, stamps: FloatArray, records: Sequence[StepRecord]) -> None:
    """Write the records of a run, shape of `stamps` (K,); an empty field has no number."""
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for scan, (stamp, record) in enumerate(zip(stamps, records, strict=True)):
            writer.writerow([scan, _number(stamp), *_cells(record)])


def _cells(record: StepRecord) -> list[str]:
    told = [getattr(record, name) for name in OF_A_MATCH.values()]
    ending = record.termination
    return [
        record.decision.value,
        *map(_number, record.increment),
        *("" if ending is None else _number(value) for value in told),
        "" if ending is None else ending.name.lower(),
        record.reason,
    ]


def _number(value: float) -> str:
    if isinstance(value, int):  # a truth, too
        return str(int(value))
    return "" if math.isnan(value) else repr(float(value))
