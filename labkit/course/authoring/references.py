"""The right answers, computed by labkit, and how far another answer may lie from them.

One function a question gives one answer a reading. The lesson trims in two ways (book, Errata:
"Trimming: of which points?"), so the ICP questions have two right answers each; all others have
one.

A submission may compute in single precision. Its inputs then carry a relative error of up
to ε = 2⁻²⁴ each, and the answer moves by ε times the condition of the case. That
is measured, not estimated: the reference is asked again with inputs perturbed at random by
one ε. The tolerance is the largest move, times a margin for the roundings on the way, and
never less than a few ε of the answer's own scale. A well-conditioned case gets about 1e-5,
a stretched one as much more as it deserves, in the same units as the answer.

An iteration that stops early lies a little before its end. For the loop the tolerance adds
how far off the iterate is with which the stated stopping rule may end, times a margin; and
it is never less than a hundredth of the scans' noise, which no stopping rule need resolve.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

import labkit
from labkit.arrays import BoolArray, FloatArray
from labkit.correspondences import distance_gate, huber_weights, overlap
from labkit.course.grading.assignment.questions import Answer
from labkit.course.grading.contract import Value
from labkit.course.grading.judging.kinds import read
from labkit.neighbors import nearest_by_brute_force
from labkit.odometry import SanityLimits, integrate
from labkit.odometry.sanity import complaints
from labkit.se2 import rotation, wrap

Keep = Callable[[FloatArray, float, float], BoolArray]
EPSILON = 2.0**-24
DRAWS = 4
MARGIN, STOP_MARGIN = 16.0, 2.0
FLOOR = 64.0 * EPSILON
STOP_BELOW = 1e-5  # m and rad; the question asks for 1e-6, but ten times that is no mistake
SETTLED, FAR_FROM_STOPPING = 1e-9, 1e-3
LOOP_FLOOR = 2e-5  # m and rad; the noise of the scans is 1 cm
LARGEST = 1e-3  # beyond it a case is drawn anew: it says more about rounding than about skill

Answers = Callable[..., tuple[Value, ...]]


def keep_of_all(d: FloatArray, max_distance: float, overlap_ratio: float) -> BoolArray:
    """ρ of all source points, then the gate: labkit's reading."""
    return distance_gate(d, max_distance) & overlap(d, overlap_ratio)


def keep_of_gated(d: FloatArray, max_distance: float, overlap_ratio: float) -> BoolArray:
    """The gate, then ρ of what it left: the reading of the lesson's other listings."""
    kept = distance_gate(d, max_distance)
    kept[kept] = overlap(d[kept], overlap_ratio)
    return kept


READINGS: tuple[Keep, ...] = (keep_of_all, keep_of_gated)


def step(
    source: FloatArray,
    target: FloatArray,
    T: FloatArray,
    max_distance: float,
    overlap_ratio: float,
    delta: float,
    keep: Keep = keep_of_all,
) -> FloatArray:
    """One ICP step from labkit's stages: associate, reject, weigh, align, compose."""
    moved = labkit.apply(T, source)
    matched = target[nearest_by_brute_force(moved, target)]
    d = np.linalg.norm(moved - matched, axis=1)
    kept = keep(d, max_distance, overlap_ratio)
    dT = labkit.align(moved[kept], matched[kept], huber_weights(d[kept], delta))
    return labkit.compose(dT, T)


def loop(
    source: FloatArray,
    target: FloatArray,
    T_init: FloatArray,
    max_distance: float,
    overlap_ratio: float,
    delta: float,
    max_iterations: int,
    keep: Keep = keep_of_all,
) -> FloatArray:
    """ICP until nothing moves any more: where each stopping rule would like to end."""
    T = T_init
    for _ in range(max_iterations):
        T_before, T = T, step(source, target, T, max_distance, overlap_ratio, delta, keep)
        if np.abs(T - T_before).max() < 1e-13:
            break
    return T


def _both_readings(function: Callable[..., Value]) -> Callable[..., tuple[Value, ...]]:
    return lambda *arguments: tuple(function(*arguments, keep=keep) for keep in READINGS)


def _one(function: Callable[..., Value]) -> Callable[..., tuple[Value, ...]]:
    return lambda *arguments: (function(*arguments),)


def _best_translation(R: FloatArray, source: FloatArray, target: FloatArray) -> Value:
    centroid = source.mean(axis=0, keepdims=True)
    T = np.eye(3)
    T[:2, :2] = R
    moved: FloatArray = target.mean(axis=0) - labkit.apply(T, centroid)[0]
    return moved


def _nearest_neighbors(source: FloatArray, target: FloatArray) -> Value:
    index = nearest_by_brute_force(source, target)
    return (index, np.linalg.norm(source - target[index], axis=1))


def _inlier_rmse(distances: FloatArray, kept: BoolArray) -> Value:
    d = distances[kept]
    return math.sqrt(float(d @ d) / len(d)) if len(d) else math.nan


def _has_converged(
    dT: FloatArray,
    cost_change: float,
    iteration: int,
    translation_tolerance: float,
    rotation_tolerance: float,
    cost_tolerance: float,
    max_iterations: int,
) -> Value:
    dx, dy, turn = labkit.to_xytheta(dT)
    still = math.hypot(dx, dy) < translation_tolerance and abs(turn) < rotation_tolerance
    spent = iteration >= max_iterations
    return bool(spent or (iteration > 0 and (still or abs(cost_change) < cost_tolerance)))


def _is_plausible(
    increment: FloatArray,
    inlier_ratio: float,
    rmse: float,
    max_translation: float,
    max_rotation: float,
    min_inlier_ratio: float,
    max_rmse: float,
) -> Value:
    limits = SanityLimits(
        max_translation=max_translation,
        max_rotation=max_rotation,
        min_inlier_ratio=min_inlier_ratio,
        max_rmse=max_rmse,
    )
    return not complaints(increment, inlier_ratio, rmse, limits)


REFERENCES: dict[str, Callable[..., tuple[Value, ...]]] = {
    "rotation": _one(rotation),
    "compose": _one(labkit.compose),
    "invert": _one(labkit.invert),
    "wrap": _one(wrap),
    "best_translation": _one(_best_translation),
    "align": _one(labkit.align),
    "align_weighted": _one(labkit.align),
    "align_svd": _one(labkit.align_svd),
    "nearest_neighbors": _one(_nearest_neighbors),
    "distance_gate": _one(distance_gate),
    "overlap": _one(overlap),
    "huber_weights": _one(huber_weights),
    "inlier_rmse": _one(_inlier_rmse),
    "fitness": _one(lambda kept: float(np.count_nonzero(kept)) / len(kept)),
    "icp_step": _both_readings(step),
    "icp": _both_readings(loop),
    "has_converged": _one(_has_converged),
    "integrate": _one(integrate),
    "is_plausible": _one(_is_plausible),
}


def tolerance(answer: Answer, answers: Answers, arguments: tuple[Value, ...]) -> float:
    """The tolerance of a case in the answer's units, rounded up to two digits; ``inf`` where the
    smallest perturbation changes its shape."""
    right = [read(answer, value) for value in answers(*arguments)]
    scale = max(1.0, *(float(np.nan_to_num(np.abs(one)).max(initial=0.0)) for one in right))
    largest = 0.0
    rng = np.random.default_rng(0)
    for _ in range(DRAWS):
        moved = [read(answer, value) for value in answers(*perturbed(arguments, rng))]
        largest = max(largest, *map(apart, moved, right))
    return round_up(max(MARGIN * largest, FLOOR * scale))


def perturbed(arguments: tuple[Value, ...], rng: np.random.Generator) -> tuple[Value, ...]:
    """The arguments with every entry of a float array off by up to one ε of itself."""
    return tuple(
        value * (1.0 + EPSILON * rng.uniform(-1.0, 1.0, value.shape))
        if isinstance(value, np.ndarray) and value.dtype.kind == "f"
        else value
        for value in arguments
    )


def apart(a: FloatArray, b: FloatArray) -> float:
    """The largest difference of two readings; infinite where they differ in shape or in NaN."""
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return math.inf
    return float(np.nan_to_num(np.abs(a - b)).max(initial=0.0))


def stop_error(arguments: tuple[Any, ...]) -> float:
    """How far from its end the loop may stop: at the first step below `STOP_BELOW`."""
    source, target, T_init, gate, ratio, delta, iterations = arguments
    worst = 0.0
    for keep in READINGS:
        path = [T_init]
        for _ in range(iterations):
            path.append(step(source, target, path[-1], gate, ratio, delta, keep))
        moves = [apart(a, b) for a, b in pairwise(path)]
        if moves[-1] > SETTLED:  # the budget ends it: no rule may come near to ending it before
            if min(moves) < FAR_FROM_STOPPING:
                return math.inf
            continue
        stop = next(k for k, move in enumerate(moves) if move < STOP_BELOW)
        worst = max(worst, apart(path[stop + 1], path[-1]))
    return STOP_MARGIN * worst


def round_up(number: float) -> float:
    """The next number with two digits."""
    if not math.isfinite(number):
        return number
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return float(f"{math.ceil(number / unit - 1e-9) * unit:.1e}")
