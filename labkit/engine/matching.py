"""What the rest of labkit calls: from scans and parameters to arrays, and back to results."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_points, read_only
from labkit.engine import lookup, loop
from labkit.engine.jit import announce
from labkit.engine.lookup import mean_values
from labkit.line_alignment import Information
from labkit.parameters import IcpParameters
from labkit.result import FAILED, IcpResult, Termination
from labkit.scan import Scan
from labkit.target import Target

TERMINATIONS = (
    Termination.CONVERGED_POSE,
    Termination.CONVERGED_COST,
    Termination.BUDGET_SPENT,
    Termination.TOO_FEW_CORRESPONDENCES,
    Termination.DEGENERATE,
)  # in the order of their numbers in `loop`
STRETCH = 64  # pairs that a thread takes at a time


def match(source: Scan, target: Target, T: FloatArray, parameters: IcpParameters) -> IcpResult:
    """Run the loop from the guess T; see `labkit.icp`."""
    poses = np.empty((parameters.max_iterations + 1, 3, 3))
    poses[0] = T
    far, numbers, seen = np.empty(len(poses), dtype=np.bool_), np.empty(6), np.empty((5, 3))
    room = numbers_of(parameters), poses, far, numbers, seen
    on_lines = parameters.metric == "point_to_line"
    ready = prepared(target, on_lines)
    if ready is None:
        loop.prepare_and_run(source.points, target.points, target.scan.beams is not None, *room)
    else:
        loop.run(source.points, ready, *room)
    ending, steps, inliers, fitness, rmse, cost = numbers.tolist()
    termination, last = TERMINATIONS[int(ending)], int(steps)
    poses = read_only(poses[: last + 1])
    return IcpResult(
        T_target_source=FAILED if termination.failed else poses[last],
        termination=termination,
        source=source,
        target=target,
        parameters=parameters,
        poses=poses,
        far=read_only(far[: last + 1]),
        inlier_count=int(inliers),
        fitness=fitness,
        inlier_rmse=rmse,
        cost=cost,
        information=information_of(seen),
    )


def information_of(seen: FloatArray) -> Information | None:
    """What the loop wrote of it, shape (5, 3); None where nothing can be said."""
    if np.isnan(seen[0, 0]):
        return None
    center = seen[4, :2]
    return Information(center=center, length=float(seen[4, 2]), values=seen[0], vectors=seen[1:4])


@lru_cache(maxsize=64)
def numbers_of(parameters: IcpParameters) -> FloatArray:
    """The parameters as the loop reads them, in the order of `loop.Told`."""
    return np.array(
        [
            parameters.metric == "point_to_line",
            parameters.approach,
            parameters.max_correspondence_distance,
            parameters.overlap_ratio,
            parameters.huber_delta,
            parameters.max_iterations,
            parameters.translation_tolerance,
            parameters.rotation_tolerance,
            parameters.cost_tolerance,
            parameters.step_fraction,
        ],
        dtype=np.float64,
    )


def prepared(target: Target, on_lines: bool) -> loop.Prepared | None:
    """The target's index and normals, kept with it; None where it is matched for the first time.

    Most targets are matched once, and then it takes less time to hand over their points alone.
    """
    given = target.given_normals if on_lines else None
    if on_lines not in target.kept and given is None:
        target.kept[on_lines] = None
    elif target.kept.get(on_lines) is None:
        if given is None:
            in_order = target.scan.beams is not None
            target.kept[on_lines] = loop.prepare(target.points, in_order, on_lines)
        else:
            target.kept[on_lines] = loop.prepare_with_normals(target.points, given.copy())
    kept: loop.Prepared | None = target.kept[on_lines]
    return kept


@dataclass(frozen=True, eq=False, kw_only=True)
class Matches:
    """The outcomes of K pairs of scans; entry k is what `labkit.icp` returns for pair k.

    Attributes
    ----------
    T_target_source : ndarray, shape (K, 3, 3)
        The last poses, also of runs that failed.
    terminations : tuple of Termination, length K
        How each run ended.
    iterations, inlier_counts : ndarray of int, shape (K,)
        Steps taken, and pairs kept at the last pose.
    fitness, inlier_rmse, cost : ndarray, shape (K,)
        Their share of the source, their RMSE [m], and the cost J [m²] there.
    information : ndarray, shape (K, 3)
        Eigenvalues of the information, ascending; NaN where nothing can be said, and under
        the point-to-point metric. See `labkit.line_alignment.Information`.
    directions : ndarray, shape (K, 3, 3)
        Its eigenvectors (Δx, Δy, ℓΔψ), as columns.
    """

    T_target_source: FloatArray
    terminations: tuple[Termination, ...]
    iterations: IntArray
    inlier_counts: IntArray
    fitness: FloatArray
    inlier_rmse: FloatArray
    cost: FloatArray
    information: FloatArray
    directions: FloatArray


def match_pairs(
    scans: Sequence[Scan],
    pairs: IntArray,
    guesses: FloatArray,
    parameters: IcpParameters,
    jobs: int = 1,
) -> Matches:
    """Match many pairs of scans; the same bytes for any number of threads.

    Parameters
    ----------
    scans : sequence of Scan
        Each with at least one point if a pair names it.
    pairs : ndarray of int, shape (K, 2)
        The rows of the source and of the target in `scans`.
    guesses : ndarray, shape (K, 3, 3)
        The initial guess of ``T_target_source`` of each.
    parameters : IcpParameters
        What the loop is told.
    jobs : int
        Threads that share the pairs.

    Returns
    -------
    Matches
    """
    points, begin = _together(scans)
    in_order = np.array([scan.beams is not None for scan in scans], dtype=np.bool_)
    pairs, guesses = np.ascontiguousarray(pairs, np.intp), np.ascontiguousarray(guesses)
    told, count = numbers_of(parameters), len(pairs)
    poses, outcomes, information = (
        np.empty(shape) for shape in ((count, 3, 3), (count, 6), (count, 5, 3))
    )

    def work(first: int) -> None:
        own = slice(first, first + STRETCH)
        loop.run_stretch(
            points,
            begin,
            in_order,
            pairs[own],
            guesses[own],
            told,
            poses[own],
            outcomes[own],
            information[own],
        )

    stretches = range(0, count, STRETCH)
    if jobs == 1:
        for first in stretches:
            work(first)
    else:
        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(work, stretches))
    return Matches(
        T_target_source=poses,
        terminations=tuple(TERMINATIONS[int(code)] for code in outcomes[:, 0]),
        iterations=outcomes[:, 1].astype(np.intp),
        inlier_counts=outcomes[:, 2].astype(np.intp),
        fitness=outcomes[:, 3],
        inlier_rmse=outcomes[:, 4],
        cost=outcomes[:, 5],
        information=information[:, 0],
        directions=information[:, 1:4],
    )


def judge(
    source: Scan, target: Target, T: FloatArray, motion: FloatArray, clearance: float, gap: float
) -> tuple[float, float]:
    """What beams look through at the pose T, and the spread ratio of a motion (2,).

    See `labkit.odometry.free_space.seen_through` and `labkit.degeneracy.spread_ratio`.
    """
    x, y = motion.tolist()
    judged: tuple[float, float] = lookup.judge(
        source.points, target.points, np.array(T), x, y, clearance, gap
    )
    return judged


def judge_pairs(
    scans: Sequence[Scan], pairs: IntArray, poses: FloatArray, clearance: float, gap: float
) -> FloatArray:
    """The same for many pairs of scans and their poses (K, 3, 3): shape (K, 2)."""
    points, begin = _together(scans)
    judged = np.empty((len(pairs), 2))
    lookup.judge_stretch(points, begin, pairs, poses, clearance, gap, judged)
    return judged


def _together(scans: Sequence[Scan]) -> tuple[FloatArray, IntArray]:
    """The points of all scans, shape (N, 2), and the row at which each of them begins."""
    points = np.concatenate([np.empty((0, 2)), *(scan.points for scan in scans)])
    return read_only(points), np.cumsum([0, *map(len, scans)])


def nearest_rows(points: ArrayLike, target: ArrayLike) -> IntArray:
    """The row of the nearest target point of each point, as brute force finds it.

    Parameters
    ----------
    points, target : array_like, shape (N, 2) and (M, 2)
        In metres.
    """
    rows: IntArray = loop.nearest_rows(
        read_only(as_points(points, "points")), read_only(as_points(target, "target"))
    )
    return rows


def warm() -> None:
    """Compile all of the engine, or find it on disk: nobody waits for it afterwards."""
    wall = Scan(points=np.column_stack([np.linspace(-1.0, 1.0, 9), np.ones(9)]))
    parameters = IcpParameters(metric="point_to_line")
    target = Target(wall)
    for _ in range(2):  # a target's first match, and later ones
        match(wall, target, np.eye(3), parameters)
    match(wall, Target(wall, target.normals), np.eye(3), parameters)
    pair, still = np.array([[1, 0]]), np.eye(3)[None]
    match_pairs([wall, wall], pair, still, parameters)
    judge_pairs([wall, wall], pair, still, 0.0, 0.0)
    judge(wall, target, still[0], wall.points[0], 0.0, 0.0)
    nearest_rows(wall.points, wall.points)
    corner = np.zeros((1, 1, 2), dtype=np.intp)
    mean_values(np.ones((1, 1)), corner, corner[0])


announce()
