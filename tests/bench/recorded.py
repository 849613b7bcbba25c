"""Pairs from recorded logs: a built-in run with a reference, any log with a survey."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from data import GATE, Pair, PairSet, split_rng
from labkit import from_xytheta, read_log
from labkit.cli.odometry import SIMULATED_WHEELS
from labkit.evaluation.pose_errors import pose_differences
from labkit.logs import Log
from labkit.odometry import increments_between
from labkit.se2 import relative
from labkit.simulation import wheel_increments
from labkit.support.arrays import FloatArray, IntArray
from relations import read_relations

STRETCH = 50  # so many consecutive pairs go to one split, the next ones to the other
MIN_POINTS = 30  # a scan with fewer returns is left out
SURVEY_GATE = 1.0  # m, wide enough for raw odometry
MAX_PRIOR_ERROR = 0.3, math.radians(10.0)  # a surveyed pair with a worse prior is left out


def killian_pairs(split: str, count: int) -> PairSet:
    """Consecutive scans of Killian Court; the guess is what `labkit odometry` simulates."""
    log = read_log("killian")
    assert log.reference is not None
    priors = from_xytheta(wheel_increments(log.reference, SIMULATED_WHEELS, rng=0))
    steps = from_xytheta(increments_between(log.reference))
    points = np.array([len(scan) for scan in log.scans])
    first = np.arange(len(steps))
    usable = (np.minimum(points[:-1], points[1:]) >= MIN_POINTS) & _in_split(
        first // STRETCH, split
    )
    chosen = split_rng(split, 2).permutation(first[usable])[:count]
    return PairSet(
        name="killian",
        title="Killian Court, 180 beams",
        reference="pose graph, good to about 33 mm",
        gate=GATE,
        pairs=tuple(_consecutive(log, int(k), priors[k], steps[k]) for k in chosen),
    )


def surveyed_pairs(
    split: str,
    count: int,
    *,
    log: str | Path,
    relations: str | Path,
    laser_offset: tuple[float, float, float],
    source: str,
) -> PairSet:
    """Consecutive scans whose relation was surveyed; the guess is the log's odometry.

    `source` names where the two files come from, for they are not in the project.

    Raises
    ------
    ValueError
        For a log without odometry.
    """
    run = read_log(log, laser_offset=laser_offset)
    if run.odometry is None:
        raise ValueError(f"{run.name} holds no odometry to start from")
    survey = read_relations(relations)
    i, j = survey.scan_indices(run.stamps).T
    T_world = from_xytheta(run.odometry)
    priors, surveyed = relative(T_world[i], T_world[j]), from_xytheta(survey.increments)
    translation, rotation = pose_differences(surveyed, priors)
    usable = (j == i + 1) & (translation <= MAX_PRIOR_ERROR[0]) & (rotation <= MAX_PRIOR_ERROR[1])
    rows = np.flatnonzero(usable)
    rows = rows[_in_split(np.arange(len(rows)), split)][:count]
    beams = len(run.scans[0].ranges if run.scans[0].ranges is not None else run.scans[0])
    return PairSet(
        name=run.name,
        title=f"{run.name}, {beams} beams",
        reference="survey, good to about 10 mm",
        gate=SURVEY_GATE,
        pairs=tuple(_consecutive(run, int(i[r]), priors[r], surveyed[r]) for r in rows),
        source=source,
    )


def _consecutive(log: Log, k: int, T_init: FloatArray, T_reference: FloatArray) -> Pair:
    return Pair(
        source=log.scans[k + 1],
        target=log.scans[k],
        T_init=T_init,
        T_reference=T_reference,
    )


def _in_split(number: IntArray, split: str) -> np.ndarray:
    """Even numbers are for tuning, odd ones for reporting."""
    return number % 2 == (split == "reporting")
