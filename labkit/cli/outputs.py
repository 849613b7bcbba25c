"""The files of a run: trajectory, quality and map, each written whole or not at all."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

from labkit.cli.grid_map import GridMap, occupancy, write_pgm, write_yaml
from labkit.logs import Log, write_tum
from labkit.odometry import OdometryResult, StepRecord
from labkit.scan import scanner_poses
from labkit.se2 import from_xytheta, matrices_of, to_xytheta
from labkit.support.arrays import FloatArray
from labkit.support.errors import InvalidParameterError, WriteError
from labkit.support.files import atomic_write, refuse_unwritable

COLUMNS = (
    *("scan", "stamp", "x_m", "y_m", "theta_rad", "robot_x_m", "robot_y_m", "robot_theta_rad"),
    *("decision", "doubtful", "dx_m", "dy_m", "dtheta_rad"),
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """A log, its odometry, and the paths that its files hold.

    Attributes
    ----------
    wheels : ndarray, shape (K, 3), or None
        The scanner's path by the wheels alone.
    """

    log: Log
    result: OdometryResult
    wheels: FloatArray | None

    @property
    def axes(self) -> str:
        """The axes of the scanner's poses."""
        return "its first scan" if self.log.reference is None else "the log's reference"

    @cached_property
    def stamps(self) -> FloatArray:
        """Times of the scans [s], or their numbers if the log has no times."""
        if np.isnan(self.log.stamps).any():
            return np.arange(len(self.log), dtype=float)
        return self.log.stamps

    @cached_property
    def robot(self) -> FloatArray | None:
        """Poses (K, 3) of the robot, where the scanner's place on it is known.

        They stand in the axes of the robot's first pose, or of the log's reference.
        """
        offset = self.log.laser_offset
        if offset is None:
            return None
        T_w_laser = matrices_of(self.result.poses)
        T_w_robot = T_w_laser @ np.linalg.inv(from_xytheta(offset))
        if self.log.reference is None:
            T_w_robot = np.linalg.inv(T_w_robot[0]) @ T_w_robot
        return to_xytheta(T_w_robot)

    @cached_property
    def grid(self) -> GridMap:
        """The map in the axes of the robot's poses, or else of the scanner's."""
        if self.robot is None or self.log.laser_offset is None:
            return occupancy(self.result.poses, self.log.scans)
        return occupancy(scanner_poses(self.robot, self.log.laser_offset), self.log.scans)


def write_files(paths: Sequence[str], run: Run) -> tuple[list[str], list[WriteError]]:
    """Write all files that can be written; their names, and what stopped the others."""
    written, errors = list[str](), list[WriteError]()
    for path, write in zip(paths, WRITERS.values(), strict=False):
        if write is _write_robot and run.robot is None:
            continue
        try:
            write(path, run)
            written.append(path)
        except WriteError as error:
            errors.append(error)
    return written, errors


def _write_trajectory(path: str, run: Run) -> None:
    """Write the poses of the scanner, in the format TUM."""
    write_tum(
        path, run.stamps, run.result.poses, f"poses of the scanner, in the axes of {run.axes}"
    )


def _write_robot(path: str, run: Run) -> None:
    """Write the poses of the robot, in the format TUM."""
    if run.robot is not None:
        write_tum(
            path, run.stamps, run.robot, f"poses of the robot, in the axes of {_axes_of(run)}"
        )


def _axes_of(run: Run) -> str:
    """The axes of the robot's poses, and of the map."""
    return run.axes if run.robot is None or run.log.reference is not None else "its first pose"


def _write_quality(path: str, run: Run) -> None:
    """Write one CSV row a scan: pose, decision and its grounds; an empty field has no number."""
    robot = run.robot
    if robot is None:
        robot = np.full_like(run.result.poses, np.nan)
    with atomic_write(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        rows = zip(run.stamps, run.result.poses, robot, run.result.records, strict=True)
        for scan, (stamp, *poses, record) in enumerate(rows):
            told = [_number(value) for value in np.concatenate(poses).tolist()]
            writer.writerow([scan, repr(float(stamp)), *told, *_cells(record)])


def _write_map(path: str, run: Run) -> None:
    """Draw the scans at the estimated poses, the trajectory, the wheels and the reference."""
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow)

    from labkit.plotting import plot_trajectory  # noqa: PLC0415

    log = run.log
    figure = Figure(figsize=(7.0, 5.6), layout="constrained")  # letters are read on a page
    ax = figure.add_subplot()
    plot_trajectory(ax, run.result.poses, log.scans, log.reference, wheels=run.wheels)
    ax.set_title(f"{log.name}: map and trajectory of the scanner")
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format="png", dpi=200)


def _write_grid(path: str, run: Run) -> None:
    write_pgm(path, run.grid)


def _write_grid_yaml(path: str, run: Run) -> None:
    whose = "the scanner" if run.robot is None else "the robot"
    write_yaml(path, run.grid, f"in the axes of {_axes_of(run)}; poses of {whose} stand in them")


WRITERS = {
    "-odometry.tum": _write_trajectory,
    "-robot.tum": _write_robot,
    "-quality.csv": _write_quality,
    "-map.png": _write_map,
    "-map.pgm": _write_grid,
    "-map.yaml": _write_grid_yaml,
}


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
