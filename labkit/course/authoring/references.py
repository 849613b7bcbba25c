"""The right answers, and how far another answer may lie from them.

They are those of the `solution`. The lesson trims in two ways (book, Errata: "Trimming: of which
points?"), so the ICP questions have two right answers each, one a reading; all others have one.

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
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from labkit.arrays import BoolArray, FloatArray
from labkit.course.authoring import solution
from labkit.course.authoring.entries import Arguments
from labkit.course.grading.assignment.questions import Answer
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.kinds import read

Keep = Callable[[FloatArray, float, float], BoolArray]
right: Any = solution
EPSILON = 2.0**-24
DRAWS = 4
MARGIN, STOP_MARGIN = 16.0, 2.0
FLOOR = 64.0 * EPSILON
STOP_BELOW = 1e-5  # m and rad; the question asks for 1e-6, but ten times that is no mistake
SETTLED, FAR_FROM_STOPPING = 1e-9, 1e-3
LOOP_FLOOR = 2e-5  # m and rad; the noise of the scans is 1 cm
MOST_STEPS, STANDSTILL = 500, 1e-13
MOST_BYTES = 1 << 20


def keep_of_all(d: FloatArray, max_distance: float, overlap_ratio: float) -> BoolArray:
    """ρ of all source points, then the gate."""
    kept: BoolArray = right.distance_gate(d, max_distance) & right.overlap(d, overlap_ratio)
    return kept


def keep_of_gated(d: FloatArray, max_distance: float, overlap_ratio: float) -> BoolArray:
    """The gate, then ρ of what it left: the reading of the lesson's other listings."""
    kept: BoolArray = right.distance_gate(d, max_distance)
    kept[kept] = right.overlap(d[kept], overlap_ratio)
    return kept


READINGS: tuple[Keep, ...] = (keep_of_all, keep_of_gated)


def paired(p: FloatArray, q: FloatArray, T: FloatArray, *limits: float, keep: Keep) -> Any:
    """The kept points at T, their partners and distances; and the mask of the kept ones.

    Raises
    ------
    ValueError
        If fewer than two pairs are left.
    """
    moved = p @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, q)
    kept = keep(d, *limits)
    if np.count_nonzero(kept) < 2:
        raise ValueError("fewer than two pairs are left")
    return moved[kept], q[indices[kept]], d[kept], kept


def aligned(p: FloatArray, q: FloatArray, w: FloatArray) -> FloatArray:
    """The best motion of weighted pairs, as (3, 3)."""
    return rigid(*right.align_weighted(p, q, w))


def rigid(R: FloatArray, t: FloatArray) -> FloatArray:
    """The transform (3, 3) of a rotation and a translation."""
    return np.vstack([np.column_stack([R, t]), [0.0, 0.0, 1.0]])


def step(
    p: FloatArray, q: FloatArray, T: FloatArray, gate: float, ratio: float, delta: float,
    keep: Any, *, weigh: Any = right.huber_weights, update: Any = right.compose,
) -> Any:  # fmt: skip
    """One ICP step in one reading: the right one, but for the stages that are handed in."""
    moved, matched, d, _ = paired(p, q, T, gate, ratio, keep=keep)
    return update(aligned(moved, matched, weigh(d, delta)), T)


def path(p: FloatArray, q: FloatArray, T: FloatArray, *settings: float, keep: Keep) -> Any:
    """The transforms of the right loop, one a step, until nothing moves any more."""
    return _path(p.tobytes(), q.tobytes(), T.tobytes(), settings, keep)


@lru_cache(maxsize=8)
def _path(p: bytes, q: bytes, T: bytes, settings: Any, keep: Keep) -> Any:
    source, target = (np.frombuffer(one).reshape(-1, 2) for one in (p, q))
    found = [np.frombuffer(T).reshape(3, 3)]
    while len(found) <= MOST_STEPS:
        gate, ratio, delta = settings
        found.append(step(source, target, found[-1], gate, ratio, delta, keep))
        if np.abs(found[-1] - found[-2]).max() < STANDSTILL:
            break
    return found


def loop(*arguments: Any, keep: Keep) -> Any:
    """The transform at which the budget ends the loop, or where nothing moves any more."""
    found = path(*arguments[:-1], keep=keep)
    return found[min(arguments[-1], len(found) - 1)]


def answers(question: str, arguments: Arguments) -> Arguments:
    """The right answers to a call, one for each reading.

    Raises
    ------
    ValueError
        If too few pairs are left in a step of ICP.
    """
    given: dict[str, Any] = {"icp_step": step, "icp": loop}
    if question in given:
        return tuple(given[question](*arguments, keep=keep) for keep in READINGS)
    answer = getattr(right, question)(*arguments)
    return (rigid(*answer) if question.startswith("align") else plain(answer, MOST_BYTES),)


def tolerance(question: str, answer: Answer, arguments: Arguments) -> float:
    """The tolerance of a case in the answer's units, rounded up to two digits; ``inf`` where the
    smallest perturbation changes the answer's shape, or too few pairs are left."""
    rng, largest = np.random.default_rng(0), 0.0
    try:
        wanted = [read(answer, value) for value in answers(question, arguments)]
        for _ in range(DRAWS):
            moved = answers(question, perturbed(arguments, rng))
            largest = max(largest, *map(apart, [read(answer, one) for one in moved], wanted))
    except ValueError:
        return math.inf
    scale = max(1.0, *(float(np.nan_to_num(np.abs(one)).max(initial=0.0)) for one in wanted))
    allowed = round_up(max(MARGIN * largest, FLOOR * scale))
    if question == "icp":
        allowed = round_up(max(allowed + stop_error(arguments), LOOP_FLOOR))
    return allowed


def perturbed(arguments: Arguments, rng: np.random.Generator) -> Arguments:
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
    """Distance of the loop from its end where it may stop: the first step below `STOP_BELOW`."""
    *begin, iterations = arguments
    worst = 0.0
    for keep in READINGS:
        found = path(*begin, keep=keep)[: iterations + 1]
        moves = [apart(a, b) for a, b in pairwise(found)]
        if moves[-1] > SETTLED:  # the budget ends it: no rule may come near to ending it before
            if min(moves) < FAR_FROM_STOPPING:
                return math.inf
            continue
        stop = next(k for k, move in enumerate(moves) if move < STOP_BELOW)
        worst = max(worst, apart(found[stop + 1], found[-1]))
    return STOP_MARGIN * worst


def round_up(number: float) -> float:
    """The next number with two digits."""
    if not math.isfinite(number):
        return number
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return float(f"{math.ceil(number / unit - 1e-9) * unit:.1e}")
