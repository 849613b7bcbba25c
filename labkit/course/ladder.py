"""The ladder of chapter 5: a stretch of any log, how good a rung is on it, the class's rungs."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.course.report import Table
from labkit.evaluation import rpe
from labkit.logs import Log
from labkit.odometry import estimate_odometry, increments_between
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, check_count
from labkit.support.errors import InvalidParameterError, LogError

DRIFT_LENGTH = 10.0  # m over which a drift is counted
COLUMNS = ("student", "log", "first", "rung", "drift", "end")


class Stretch(NamedTuple):
    """K scans of a log, the wheels' increments (K − 1, 3) between them, and true poses (K, 3)."""

    scans: tuple[Scan, ...]
    wheels: FloatArray
    truth: FloatArray


class Rung(NamedTuple):
    """Drift over 10 m and error of the end [m] on one rung of one student."""

    student: str
    log: str
    first: int
    rung: str
    drift: float
    end: float


def stretch_of(
    log: Log, first: int = 0, count: int = 200, wheels: ArrayLike | None = None
) -> Stretch:
    """Part of a log to climb the ladder on.

    Parameters
    ----------
    log : Log
        A log with two scans or more.
    first, count : int
        The first scan, and how many.
    wheels : array_like, shape (len(log) - 1, 3), optional
        Increments of the wheels over the whole log. By default those of the log's odometry, and
        no motion where it has none.

    Returns
    -------
    Stretch
        Its `truth` is the log's reference. Where there is none, it is the lab's odometry, which is
        no truth either: then a drift says how far a rung is from a better estimate.

    Raises
    ------
    InvalidParameterError
        If the log has no such stretch of two scans or more.

    Examples
    --------
    >>> scans = (Scan.from_points([(1.0, 0.0), (0.0, 1.0)]),) * 3
    >>> poses = np.array([(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.7, 0.0, 0.0)])
    >>> log = Log(scans=scans, odometry=poses, reference=poses, name="ahead", format="points")
    >>> stretch_of(log, first=1).wheels.round(3).tolist()
    [[0.2, 0.0, 0.0]]
    """
    check_count(first, "first", at_least=0)
    check_count(count, "count", at_least=2)
    part = slice(first, first + count)
    scans = tuple(log.scans[part])
    if len(scans) < 2:
        problem = f"must leave two scans or more of the log's {len(log)}, got {first}"
        raise InvalidParameterError(problem, parameter="first")
    increments = None
    if wheels is not None:
        increments = np.asarray(wheels, dtype=np.float64)[first : first + len(scans) - 1]
    elif log.odometry is not None:
        increments = increments_between(log.odometry[part])
    if log.reference is None:
        truth = estimate_odometry(scans, increments).poses
    else:
        truth = log.reference[part]
    still = np.zeros((len(scans) - 1, 3))
    return Stretch(scans, still if increments is None else increments, truth)


def judge_rung(path: ArrayLike, truth: FloatArray) -> tuple[float, float]:
    """Drift over 10 m (the median over all stretches) and error of the end [m].

    Examples
    --------
    >>> truth = np.column_stack([np.arange(31.0), np.zeros(31), np.zeros(31)])
    >>> drift, end = judge_rung(truth * [1.01, 1.0, 1.0], truth)
    >>> round(drift, 3), round(end, 3)
    (0.1, 0.3)
    """
    drift = rpe(path, truth, DRIFT_LENGTH, "metres").translation.median
    return drift, float(np.hypot(*(np.asarray(path) - truth)[-1, :2]))


def write_rungs(
    file: str | os.PathLike[str],
    student: str,
    log: str,
    first: int,
    rungs: Mapping[str, tuple[float, float]],
) -> None:
    """Write a student's rungs, drift and end by name, for the table of the class.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_rungs(f"{folder}/ladder-ada.csv", "Ada", "killian", 600, {"2 gate": (0.18, 9.4)})
    ...     read_class(folder)
    [Rung(student='Ada', log='killian', first=600, rung='2 gate', drift=0.18, end=9.4)]
    """
    with Path(file).open("w", newline="", encoding="utf-8") as sheet:
        rows = csv.writer(sheet)
        rows.writerow(COLUMNS)
        for name, (drift, end) in rungs.items():
            rows.writerow([student, log, first, name, f"{drift:.4f}", f"{end:.3f}"])


def read_class(folder: str | os.PathLike[str]) -> list[Rung]:
    """All rungs of the files ``ladder-*.csv`` in a folder and below it.

    Raises
    ------
    LogError
        If a line is no rung; the message names file and line.
    """
    rungs = []
    for file in sorted(Path(folder).rglob("ladder-*.csv")):
        with file.open(newline="", encoding="utf-8-sig") as sheet:
            lines = csv.DictReader(sheet)
            for row in lines:
                try:
                    rungs.append(_rung(row))
                except (KeyError, TypeError, ValueError) as error:
                    hint = f"a rung has {', '.join(COLUMNS)}; write the file with `write_rungs`"
                    place = f"{file}:{lines.line_num}"
                    raise LogError(f"{place}: {hint}, got {list(row.values())}") from error
    return rungs


def _rung(row: Mapping[str, str]) -> Rung:
    student, log, first, name, drift, end = (row[column] for column in COLUMNS)
    return Rung(student, log, int(first), name, float(drift), float(end))


def class_table(rungs: Sequence[Rung]) -> Table:
    """A row for each stretch, with the drift on each rung and the end on the last.

    Examples
    --------
    >>> print(class_table([Rung("Ada", "killian", 600, "2 gate", 0.18, 9.4)]))
    | student | from | 2 gate | last end [m] |
    |---|--:|--:|--:|
    | Ada | killian 600 | 0.18 | 9.4 |
    """
    names = sorted({rung.rung for rung in rungs})
    rows = []
    for (student, log, first), by_name in _by_stretch(rungs).items():
        drifts = [f"{by_name[name].drift:.2f}" if name in by_name else "" for name in names]
        last_rung = by_name[max(by_name)]
        rows.append([student, f"{log} {first}", *drifts, f"{last_rung.end:.1f}"])
    return Table.of(["student", "from", *names, "last end [m]"], rows)


def _by_stretch(rungs: Sequence[Rung]) -> dict[tuple[str, str, int], dict[str, Rung]]:
    stretches: dict[tuple[str, str, int], dict[str, Rung]] = {}
    for rung in rungs:
        stretches.setdefault((rung.student, rung.log, rung.first), {})[rung.rung] = rung
    return stretches
