"""The files of a run: trajectory, quality and map, each written whole or not at all."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

from labkit.logs import Log, write_tum
from labkit.odometry import OdometryResult, StepRecord
from labkit.support.arrays import FloatArray
from labkit.support.errors import InvalidParameterError, WriteError
from labkit.support.files import atomic_write, refuse_unwritable

COLUMNS = (
    *("scan", "stamp", "decision", "doubtful", "dx_m", "dy_m", "dtheta_rad"),
    *("cov_xx", "cov_xy", "cov_xt", "cov_yy", "cov_yt", "cov_tt"),  # [m², m rad, rad²]
    *("inliers", "inlier_ratio", "rmse_m", "agreement", "score", "margin", "ambiguous"),
    *("against_prior", "rotation_rad", "information", "degenerate", "iterations"),
    *("termination", "reason"),
)
DIGITS = 7  # of a number: micrometres of a step, and no digit that means nothing
BYTES_OF_MAP, BYTES_A_SCAN = 1 << 20, 600  # about what the files of a run take
OF_A_MATCH = (  # fields of the record, empty without a match
    *("inlier_count", "inlier_ratio", "rmse", "agreement", "score", "margin", "ambiguous"),
    *("against_prior", "rotation", "information", "degenerate", "iterations"),
)


def output_paths(out: str | None, name: str, inputs: Sequence[str | None]) -> list[str]:
    """Names of the files to write; raise `WriteError` where one must or can not be written."""
    if out == "none":
        return []
    if out == "":
        raise InvalidParameterError("must name files, or be `none`, got ''", parameter="out")
    is_folder = out is not None and (out.endswith(("/", os.sep)) or os.path.isdir(out))
    prefix = name if out is None else os.path.join(out, name) if is_folder else out
    paths = [f"{prefix}{ending}" for ending in WRITERS]
    read_from = [Path(file).resolve() for file in inputs if file]
    for path in paths:
        refuse_unwritable(path)
        if Path(path).resolve() in read_from:
            raise WriteError(f"cannot write {path}: it is read from; choose another --out")
    return paths


def make_sure_of_room(paths: Sequence[str], scan_count: int) -> None:
    """Raise `WriteError` where the files of a run would find no room, before the matching."""
    for path in paths[:1]:  # all lie in one folder
        try:
            with TemporaryFile(dir=os.path.dirname(path) or ".") as file:
                file.write(bytes(BYTES_OF_MAP + BYTES_A_SCAN * scan_count))
                file.flush()
        except OSError as error:
            reason = error.strerror or error
            raise WriteError(f"cannot write {path}: {reason}; choose another --out") from error


def write_files(
    paths: Sequence[str], log: Log, result: OdometryResult, wheels: FloatArray | None
) -> tuple[list[str], list[WriteError]]:
    """Write all files that can be written; their names, and what stopped the others."""
    written, errors = list[str](), list[WriteError]()
    for path, write in zip(paths, WRITERS.values(), strict=False):
        try:
            write(path, log, result, wheels)
            written.append(path)
        except WriteError as error:
            errors.append(error)
    return written, errors


def _write_trajectory(
    path: str, log: Log, result: OdometryResult, wheels: FloatArray | None
) -> None:
    """Write the poses, in the format TUM."""
    write_tum(path, _stamps(log), result.poses)


def _write_quality(path: str, log: Log, result: OdometryResult, wheels: FloatArray | None) -> None:
    """Write one CSV row a step: its decision and the grounds; an empty field has no number."""
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for scan, (stamp, record) in enumerate(zip(_stamps(log), result.records, strict=True)):
            writer.writerow([scan, repr(float(stamp)), *_cells(record)])


def _write_map(path: str, log: Log, result: OdometryResult, wheels: FloatArray | None) -> None:
    """Draw the scans at the estimated poses, the trajectory, the wheels and the reference."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow)

    from labkit.plotting import plot_trajectory  # noqa: PLC0415

    figure = Figure(figsize=(7.0, 5.6), layout="constrained")  # letters are read on a page
    ax = figure.add_subplot()
    plot_trajectory(ax, result.poses, log.scans, log.reference, wheels=wheels)
    ax.set_title(f"{log.name}: map and trajectory by scan matching")
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format="png", dpi=200)


WRITERS = {
    "-odometry.tum": _write_trajectory,
    "-quality.csv": _write_quality,
    "-map.png": _write_map,
}


def _stamps(log: Log) -> FloatArray:
    """Times of the scans [s], or their numbers if the log has no times."""
    return np.arange(len(log), dtype=float) if np.isnan(log.stamps).any() else log.stamps


def _cells(record: StepRecord) -> list[str]:
    ending = record.termination
    was_matched = record.decision.matched or ending is not None
    told = (getattr(record, name) for name in OF_A_MATCH)
    return [
        record.decision.value,
        _number(record.is_doubtful),
        *map(_number, record.increment),
        *map(_number, record.covariance[np.triu_indices(3)]),
        *(_number(value) if was_matched else "" for value in told),
        "" if ending is None else ending.name.lower(),
        record.reason,
    ]


def _number(value: float) -> str:
    if isinstance(value, int):  # a truth, too
        return str(int(value))
    return "" if math.isnan(value) else f"{value:.{DIGITS}g}"
