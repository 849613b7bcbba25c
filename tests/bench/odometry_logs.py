"""What the odometry makes of whole logs, against a reference: drift, wrong steps, time.

``python tests/bench/odometry_logs.py FOLDER killian --out FILE`` runs the defaults on each
``NAME.log.gz`` of a folder, with the log's wheels, with wheels that jump in twelve steps by 44°,
70° or 81°, and without, against the map and scan to scan, and writes one table.
``--set key_scans=15 huber_delta=0.03`` changes parameters by their names. ``NAME.ref.tum.gz``
beside a log holds better poses of its scans, ``NAME.relations.csv`` surveyed relations. Without
a reference, the first run is the reference of the others. The columns:

- RPE over 10 m, median, and ATE (RMSE);
- steps that are off by more than 0.2 m or 5° (wrong), and by more than 0.5 m or 10° (lost);
- steps that held the last motion or stood still, that were taken from the prior, and that were
  believed against it;
- the median error of surveyed relations between scans that do not follow one another (far);
- the processor time of a step.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
import time
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from labkit import from_xytheta, read_log
from labkit.cli.odometry import SIMULATED_WHEELS
from labkit.evaluation import ate, rpe
from labkit.logs import Log, read_tum
from labkit.odometry import (
    Decision,
    LessonOdometry,
    MapOdometry,
    OdometryParameters,
    OdometryResult,
    estimate_odometry,
    increments_between,
)
from labkit.se2 import relative, to_xytheta
from labkit.simulation import wheel_increments
from labkit.support.arrays import BoolArray, FloatArray
from labkit.support.warm import warm
from relations import read_relations, relation_errors
from tables import markdown

STRETCH = 10.0  # m
SAME_MOMENT = 0.02  # s
WRONG = 0.2, np.radians(5.0)
LOST = 0.5, np.radians(10.0)
ESTIMATORS = {"map": MapOdometry, "scan": LessonOdometry}
PRIORS = ("log", "jumps", "none")
JUMPS = np.radians([44.0, -70.0, 81.0] * 4)
HEADER = (
    "log",
    "against",
    "prior",
    "RPE mm",
    "°",
    "ATE m",
    "wrong %",
    "lost %",
    "held",
    "prior",
    "against it",
    "far mm",
    "ms",
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Reference:
    """Better poses of some of the scans: their numbers in the log, and (K, 3) poses."""

    scans: np.ndarray
    poses: FloatArray


def logs_in(names: list[str]) -> list[tuple[Log, Reference | None, Path | None]]:
    """The logs of files and folders, each with its reference and its relations."""
    found = []
    for name in names:
        paths = sorted(Path(name).glob("*.log.gz")) if Path(name).is_dir() else [name]
        for path in map(str, paths):
            log, stem = read_log(path), path.removesuffix(".log.gz")
            relations = Path(f"{stem}.relations.csv")
            reference = None
            if log.reference is not None:
                reference = Reference(scans=np.arange(len(log)), poses=log.reference)
            elif Path(f"{stem}.ref.tum.gz").exists():
                stamps, poses = read_tum(f"{stem}.ref.tum.gz")
                gaps = np.abs(log.stamps[:, None] - stamps)
                ours = np.flatnonzero(gaps.min(axis=1) <= SAME_MOMENT)
                reference = Reference(scans=ours, poses=poses[gaps.argmin(axis=1)[ours]])
            found.append((log, reference, relations if relations.exists() else None))
    return found


def wheels_of(log: Log) -> FloatArray:
    """The log's odometry, or wheels simulated from its reference: increments (K−1, 3)."""
    if log.odometry is not None:
        return increments_between(log.odometry)
    return wheel_increments(log.reference, SIMULATED_WHEELS, rng=0)


def with_jumps(wheels: FloatArray) -> FloatArray:
    """The same wheels (K−1, 3), but that their heading jumps in twelve steps, evenly spread."""
    jumping = wheels.copy()
    jumping[np.linspace(0, len(wheels), len(JUMPS) + 2).astype(int)[1:-1], 2] += JUMPS
    return jumping


def steps_off(poses: FloatArray, reference: Reference, limits: tuple[float, float]) -> BoolArray:
    """Which steps between two scans that follow one another exceed either of the limits."""
    T, T_true = from_xytheta(poses[reference.scans]), from_xytheta(reference.poses)
    errors = to_xytheta(relative(relative(T_true[:-1], T_true[1:]), relative(T[:-1], T[1:])))
    off = (np.hypot(errors[:, 0], errors[:, 1]) > limits[0]) | (np.abs(errors[:, 2]) > limits[1])
    return off[np.diff(reference.scans) == 1]


def changed(parameters: Any, names: dict[str, str]) -> Any:
    """The parameters with fields replaced by name, in the objects inside them too."""
    changes = {}
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        if field.name in names:
            text = names[field.name]
            changes[field.name] = text if isinstance(value, str) else type(value)(float(text))
        elif is_dataclass(value):
            changes[field.name] = changed(value, names)
    return replace(parameters, **changes)


def row(
    log: Log,
    result: OdometryResult,
    reference: Reference | None,
    relations: Path | None,
    seconds: float,
) -> list[str]:
    """The columns of one run, from RPE on; a dash where nothing is known."""
    cells = ["–"] * 5
    if reference is not None:
        poses = result.poses[reference.scans]
        drift = rpe(poses, reference.poses, STRETCH, "metres")
        lost, wrong = (steps_off(result.poses, reference, limit) for limit in (LOST, WRONG))
        cells = [
            f"{1e3 * drift.translation.median:.0f}",
            f"{np.degrees(drift.rotation.median):.2f}",
            f"{ate(poses, reference.poses).translation.rmse:.2f}",
            f"{100 * wrong.mean():.1f}",
            f"{100 * lost.mean():.1f}",
        ]
    far = "–"
    if relations is not None:
        errors, pairs = relation_errors(read_relations(relations), result.poses, log.stamps)
        apart = np.diff(pairs)[:, 0] > 1
        far = f"{1e3 * np.median(errors.translation_errors[apart]):.0f}"
    held, prior = result.count(Decision.HOLD, Decision.STAND), result.count(Decision.PRIOR)
    cells += [f"{held}", f"{prior}", f"{result.against_prior}", far]
    return [*cells, f"{1e3 * seconds / len(log):.2f}"]


def main() -> int:
    """Run the odometry on each log, print a line for each run, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", metavar="LOG|FOLDER")
    parser.add_argument("--prior", choices=PRIORS, action="append")
    parser.add_argument("--against", choices=("map", "scan"), action="append")
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    parser.add_argument("--out", metavar="FILE", help="the table in Markdown")
    args = parser.parse_args()
    chosen = changed(OdometryParameters(), dict(text.split("=") for text in args.set))
    ways = list(product(args.against or ["map", "scan"], args.prior or PRIORS))
    warm()
    rows: list[list[str]] = []
    for log, better, relations in logs_in(args.logs):
        reference = better
        for against, prior in ways:
            priors = None if prior == "none" else wheels_of(log)
            if prior == "jumps":
                priors = with_jumps(priors)
            began = time.process_time()
            result = estimate_odometry(log.scans, priors, chosen, estimator=ESTIMATORS[against])
            seconds = time.process_time() - began
            rows.append([log.name, against, prior])
            rows[-1] += row(log, result, reference, relations, seconds)
            print("  ".join(f"{cell:>6}" for cell in rows[-1]), result, flush=True)
            if reference is None:
                reference = Reference(scans=np.arange(len(log)), poses=result.poses)
    if args.out:
        Path(args.out).write_text(markdown(HEADER, rows) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
