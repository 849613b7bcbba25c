"""The files of a run: trajectory, quality and map, each written whole or not at all."""

from __future__ import annotations

import csv
import math

import numpy as np

from labkit.logs import Log, write_tum
from labkit.odometry import OdometryResult, StepRecord
from labkit.support.arrays import FloatArray
from labkit.support.files import atomic_write

COLUMNS = (
    *("scan", "stamp", "decision", "doubtful", "dx_m", "dy_m", "dtheta_rad"),
    *("cov_xx", "cov_xy", "cov_xt", "cov_yy", "cov_yt", "cov_tt"),  # [m², m rad, rad²]
    *("inliers", "inlier_ratio", "rmse_m", "agreement", "seen_through", "margin", "ambiguous"),
    *("against_prior", "rotation_rad", "information", "degenerate", "iterations"),
    *("termination", "reason"),
)
OF_A_MATCH = (  # fields of the record, empty without a match
    *("inlier_count", "inlier_ratio", "rmse", "agreement", "seen_through", "margin", "ambiguous"),
    *("against_prior", "rotation", "information", "degenerate", "iterations"),
)


def write_trajectory(path: str, log: Log, result: OdometryResult) -> None:
    """Write the poses, in the format TUM."""
    write_tum(path, _stamps(log), result.poses)


def write_quality(path: str, log: Log, result: OdometryResult) -> None:
    """Write one CSV row a step: its decision and the grounds; an empty field has no number."""
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for scan, (stamp, record) in enumerate(zip(_stamps(log), result.records, strict=True)):
            writer.writerow([scan, _number(stamp), *_cells(record)])


def write_map(path: str, log: Log, result: OdometryResult) -> None:
    """Draw the scans at the estimated poses, the trajectory and the reference."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow)

    from labkit.plotting import plot_trajectory  # noqa: PLC0415

    figure = Figure(figsize=(7.0, 5.6), layout="constrained")  # letters are read on a page
    ax = figure.add_subplot()
    plot_trajectory(ax, result.poses, scans=log.scans, reference=log.reference)
    ax.set_title(f"{log.name}: map and trajectory by scan matching")
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format="png", dpi=200)


def _stamps(log: Log) -> FloatArray:
    """Times of the scans [s], or their numbers if the log has no times."""
    return np.arange(len(log), dtype=float) if np.isnan(log.stamps).any() else log.stamps


def _cells(record: StepRecord) -> list[str]:
    ending = record.termination
    told = (getattr(record, name) for name in OF_A_MATCH)
    return [
        record.decision.value,
        _number(record.is_doubtful),
        *map(_number, record.increment),
        *map(_number, record.covariance[np.triu_indices(3)]),
        *("" if ending is None else _number(value) for value in told),
        "" if ending is None else ending.name.lower(),
        record.reason,
    ]


def _number(value: float) -> str:
    if isinstance(value, int):  # a truth, too
        return str(int(value))
    return "" if math.isnan(value) else repr(float(value))
