"""How far an answer may lie from the reference: what single precision does to the question.

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

from labkit.arrays import FloatArray
from labkit.authoring.references import READINGS, step
from labkit.grading.assignment.questions import Answer
from labkit.grading.contract import Value
from labkit.grading.judging.reading import read

EPSILON = 2.0**-24
DRAWS = 6
MARGIN = 16.0
FLOOR = 64.0 * EPSILON
STOP_BELOW = 1e-5  # m and rad; the question asks for 1e-6, but ten times that is no mistake
SETTLED, FAR_FROM_STOPPING = 1e-9, 1e-3
LOOP_FLOOR = 1e-4  # m and rad; the noise of the scans is 1 cm
LARGEST = 1e-3  # beyond it a case is drawn anew: it says more about rounding than about skill

Answers = Callable[..., tuple[Value, ...]]


def tolerance(answer: Answer, answers: Answers, arguments: tuple[Value, ...]) -> float:
    """The tolerance of one case, rounded up to two digits.

    Parameters
    ----------
    answer : Answer
        How the answers are read.
    answers : callable
        The reference: from arguments to the right answers, one for each reading.
    arguments : tuple of Value
        The case.

    Returns
    -------
    float
        In the answer's units; ``inf`` where the smallest perturbation changes its shape.
    """
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
    return MARGIN * worst


def round_up(number: float) -> float:
    """The next number with two digits."""
    if not math.isfinite(number):
        return number
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return float(f"{math.ceil(number / unit - 1e-9) * unit:.1e}")
