"""The quality file: one CSV row a step, with what the step decided and on what grounds."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from labkit.arrays import FloatArray
from labkit.files import atomic_write
from labkit.odometry import StepRecord

COLUMNS = (
    "scan",
    "stamp",
    "decision",
    "dx_m",
    "dy_m",
    "dtheta_rad",
    "inliers",
    "inlier_ratio",
    "rmse_m",
    "rotation_rad",
    "information",
    "degenerate",
    "spread_ratio",
    "iterations",
    "termination",
    "reason",
)


def write_quality(path: str | Path, stamps: FloatArray, records: Sequence[StepRecord]) -> None:
    """Write the records of a run, shape of `stamps` (K,); an empty field has no number."""
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for scan, (stamp, record) in enumerate(zip(stamps, records, strict=True)):
            writer.writerow([scan, _number(stamp), *_cells(record)])


def _cells(record: StepRecord) -> list[str | int]:
    matched = record.termination is not None
    return [
        record.decision.value,
        *(_number(value) for value in record.increment),
        record.inlier_count if matched else "",
        *(
            _number(value)
            for value in (record.inlier_ratio, record.rmse, record.rotation, record.information)
        ),
        int(record.degenerate) if matched else "",
        _number(record.spread),
        record.iterations if matched else "",
        record.termination.name.lower() if record.termination else "",
        record.reason,
    ]


def _number(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))
