"""What the odometry makes of a whole log, against a reference: drift, wrong steps, time.

``python tests/bench/odometry_logs.py --log LOG.gz --reference REF.tum.gz`` runs the defaults,
with the log's wheels and without; ``--prior none`` takes the wheels away, ``--set against=scan
key_scans=15`` changes parameters by their names. `killian` needs no files. One line a run:

- RPE over 10 m, median, and the ATE (RMSE), and the errors of surveyed relations;
- steps that are off by more than 0.2 m or 5°, and by more than 0.5 m or 10°;
- how the steps were decided, how many were ambiguous, and what a step took.

Without a reference, the run with wheels is the reference of the run without.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from labkit import from_xytheta, read_log
from labkit.arrays import BoolArray, FloatArray
from labkit.cli.odometry import SIMULATED_WHEELS
from labkit.evaluation import associate, ate, rpe
from labkit.logs import Log, read_tum
from labkit.odometry import (
    OdometryParameters,
    OdometryResult,
    estimate_odometry,
    increments_between,
)
from labkit.se2 import relative, to_xytheta
from labkit.simulation import wheel_increments
from relations import read_relations, relation_errors

STRETCH = 10.0  # m
WRONG = 0.2, np.radians(5.0)
LOST = 0.5, np.radians(10.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Reference:
    """Better poses of some of the scans: their numbers in the log, and (K, 3) poses."""

    scans: np.ndarray
    poses: FloatArray


def read_reference(log: Log, path: str | None) -> Reference | None:
    """The poses of a TUM file at the log's stamps, or those that come with the log."""
    if path is None:
        if log.reference is None:
            return None
        return Reference(scans=np.arange(len(log)), poses=log.reference)
    stamps, poses = read_tum(path)
    ours, theirs = associate(log.stamps, stamps, tolerance=0.02).T
    return Reference(scans=ours, poses=poses[theirs])


def priors_of(log: Log, wanted: str) -> FloatArray | None:
    """The log's odometry, or wheels simulated from the reference; None without any."""
    if wanted == "none":
        return None
    if log.odometry is not None:
        return increments_between(log.odometry)
    return wheel_increments(log.reference, SIMULATED_WHEELS, rng=0)


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
            changes[field.name] = text if isinstance(value, str) else type(value)(eval(text))
        elif is_dataclass(value):
            changes[field.name] = changed(value, names)
    return replace(parameters, **changes)


def row(
    log: Log,
    prior: str,
    result: OdometryResult,
    reference: Reference | None,
    seconds: float,
    relations: str | None,
) -> str:
    """One line about a run."""
    words = [f"{log.name:14} {prior:4}"]
    if reference is not None:
        poses = result.poses[reference.scans]
        drift = rpe(poses, reference.poses, STRETCH, "metres")
        whole = ate(poses, reference.poses)
        lost, wrong = (steps_off(result.poses, reference, limit) for limit in (LOST, WRONG))
        words += [
            f"RPE {1e3 * drift.translation.median:5.0f} mm"
            f" {np.degrees(drift.rotation.median):5.2f}°",
            f"ATE {whole.translation.rmse:6.2f} m",
            f"wrong {100 * wrong.mean():5.2f} % lost {100 * lost.mean():5.2f} %",
        ]
    if relations:
        errors, pairs = relation_errors(read_relations(relations), result.poses, log.stamps)
        gap = np.diff(pairs)[:, 0]
        for name, chosen in (("next", gap == 1), ("far", gap > 1)):
            words.append(
                f"{name} {1e3 * np.median(errors.translation_errors[chosen]):5.0f} mm"
                f" {np.degrees(np.median(errors.rotation_errors[chosen])):5.2f}°"
            )
    decisions = Counter(record.decision.value for record in result.records)
    words.append(" ".join(f"{name}:{count}" for name, count in decisions.items()))
    words.append(f"ambiguous:{sum(record.ambiguous for record in result.records)}")
    words.append(f"{1e3 * seconds / len(log):.2f} ms")
    return "  ".join(words)


def main() -> int:
    """Run the odometry on one log, with and without wheels, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--log", required=True)
    parser.add_argument("--reference", metavar="REF.tum")
    parser.add_argument("--relations", metavar="FILE")
    parser.add_argument("--prior", choices=("log", "none"))
    parser.add_argument("--scans", type=int, metavar="N")
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    parser.add_argument("--save", metavar="POSES")
    args = parser.parse_args()
    log = read_log(args.log)
    reference = read_reference(log, args.reference)
    parameters = changed(OdometryParameters(), dict(text.split("=") for text in args.set))
    for prior in [args.prior] if args.prior else ["log", "none"]:
        priors, began = priors_of(log, prior), time.process_time()
        result = estimate_odometry(log.scans, priors, parameters)
        seconds = time.process_time() - began
        print(row(log, prior, result, reference, seconds, args.relations), flush=True)
        if reference is None:
            reference = Reference(scans=np.arange(len(log)), poses=result.poses)
        if args.save:
            np.save(f"{args.save}-{prior}.npy", result.poses)
    return 0


if __name__ == "__main__":
    sys.exit(main())
