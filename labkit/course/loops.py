"""Killian Court with its loops, for chapter 10 and for the map on the first page."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from labkit import from_xytheta, icp, invert, read_log, to_xytheta
from labkit.course.exercises.graph import solve_graph
from labkit.logs import Log
from labkit.logs.read_log import killian_archive
from labkit.odometry import (
    LessonOdometry,
    OdometryParameters,
    OdometryResult,
    estimate_odometry,
    increments_between,
)
from labkit.simulation import WheelNoise, wheel_increments
from labkit.support.arrays import FloatArray

WHEELS = WheelNoise(along=0.10, across=0.05, turn=0.10, drift=0.05)  # as in chapter 5
EDGE_STD = np.array([0.05, 0.05, 0.01])  # of each edge of the graph [m, m, rad]
Progress = Callable[[Iterable[Any]], Iterable[Any]]


@dataclass(frozen=True, eq=False, kw_only=True)
class ClosedMap:
    """The whole log, the motions of its wheels, its odometry, and its poses once loops close it.

    `prior` (K - 1, 3) and `closed` (K, 3) are rows (x [m], y [m], θ [rad]).
    """

    log: Log
    prior: FloatArray
    run: OdometryResult
    closed: FloatArray


def wheels_of(log: Log, *, rng: int = 0) -> FloatArray:
    """The motions (K - 1, 3) that simulated wheels count along the log's reference."""
    assert log.reference is not None  # the log brings it
    return wheel_increments(log.reference, WHEELS, rng=rng)


def drive_killian(
    progress: Progress = iter, *, rng: int = 0
) -> tuple[Log, FloatArray, OdometryResult]:
    """The log, the motions of simulated wheels (K - 1, 3), and the lesson's odometry of both."""
    log = read_log("killian")
    assert log.reference is not None  # the log brings it
    prior = wheels_of(log, rng=rng)
    start = log.reference[0]
    run = estimate_odometry(
        log.scans, prior, estimator=LessonOdometry, start=start, progress=progress
    )
    return log, prior, run


def listed_pairs() -> tuple[np.ndarray, FloatArray]:
    """Pairs of scans that the log lists as taken at the same place, and their rough motions.

    Returns their numbers (N, 2), the older scan first, and (x [m], y [m], θ [rad]) of the newer
    scan as seen from the older one, (N, 3).
    """
    with zipfile.ZipFile(killian_archive()) as archive:
        lines = archive.read("killian.g2o").decode().splitlines()
    rows = [line.split()[1:6] for line in lines if line.startswith("EDGE_SE2")]
    edges = np.array(rows, dtype=float)
    loops = edges[edges[:, 1] != edges[:, 0] + 1]  # not from one scan to the next
    return loops[:, :2].astype(int), loops[:, 2:]


def match_loop(log: Log, i: int, j: int, guess: FloatArray) -> tuple[FloatArray, bool]:
    """Motion (x, y, θ) of scan j as seen from scan i, and whether it passes the checks."""
    match = icp(log.scans[j], log.scans[i], guess, OdometryParameters().icp)
    x, y, turn = to_xytheta(invert(guess) @ match.T_target_source)
    distance = np.hypot(x, y)
    is_near_guess = distance < 0.5 and abs(turn) < np.radians(20)
    is_sane = match.converged and match.fitness > 0.33 and is_near_guess
    return to_xytheta(match.T_target_source), bool(is_sane)


def match_loops(log: Log) -> tuple[np.ndarray, FloatArray]:
    """Match each listed pair; return those that pass, (N, 2), and their motions (N, 3)."""
    pairs, guesses = listed_pairs()
    matches = [
        match_loop(log, i, j, T) for (i, j), T in zip(pairs, from_xytheta(guesses), strict=True)
    ]
    passed = np.array([is_sane for _, is_sane in matches])
    motions = np.array([motion for motion, _ in matches])
    return pairs[passed], motions[passed]


def close_map() -> ClosedMap:
    """Chapter 10 in one call: the odometry, the loops, and the graph of both, solved."""
    log, prior, run = drive_killian()
    loop_ends, loop_motions = match_loops(log)
    numbers = np.arange(len(run.poses))
    chain = np.column_stack([numbers[:-1], numbers[1:]])
    edges = np.concatenate([chain, loop_ends])
    measured = np.concatenate([increments_between(run.poses), loop_motions])
    closed = solve_graph(run.poses, edges, measured, EDGE_STD)
    return ClosedMap(log=log, prior=prior, run=run, closed=closed)
