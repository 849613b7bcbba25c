"""The right answers, and how far another answer may lie from them.

They are those of the `solution`, in each reading that is right.

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
from decimal import ROUND_CEILING, Context
from itertools import pairwise
from typing import Any

import numpy as np

from labkit.course.authoring.entries import Arguments, Function, readings
from labkit.course.grading.assignment.questions import Answer
from labkit.course.grading.inside.data import plain
from labkit.course.grading.judging.kinds import read
from labkit.support.arrays import FloatArray

EPSILON = 2.0**-24
DRAWS = 4
MARGIN, STOP_MARGIN = 16.0, 2.0
FLOOR = 64.0 * EPSILON
STOP_BELOW = 1e-5  # m and rad; the question asks for 1e-6, but ten times that is no mistake
SETTLED, FAR_FROM_STOPPING = 1e-9, 1e-3
LOOP_FLOOR = 2e-5  # m and rad; the noise of the scans is 1 cm
STANDSTILL = 1e-13
TWO_DIGITS = Context(prec=2, rounding=ROUND_CEILING)


def answers(question: str, arguments: Arguments) -> Arguments:
    """The right answers to a call, one for each reading.

    Raises
    ------
    ValueError
        If too few pairs are left in a step of ICP.
    """
    found = [function(*arguments) for function in readings(question)]
    if question.startswith("align"):  # (R, t)
        found = [read(Answer.TRANSFORM, answer) for answer in found]
    return tuple(map(plain, found))


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
    worst = 0.0
    for step in readings("icp_step"):
        found = path(step, *arguments)
        moves = [apart(a, b) for a, b in pairwise(found)]
        if moves[-1] > SETTLED:  # the budget ends it: no rule may come near to ending it before
            if min(moves) < FAR_FROM_STOPPING:
                return math.inf
            continue
        stop = next(k for k, move in enumerate(moves) if move < STOP_BELOW)
        worst = max(worst, apart(found[stop + 1], found[-1]))
    return STOP_MARGIN * worst


def path(
    step: Function, source: Any, target: Any, T: FloatArray, *settings: Any
) -> list[FloatArray]:
    """The transforms of the loop, one a step, until its budget is spent or nothing moves."""
    *limits, iterations = settings
    found = [T]
    for _ in range(iterations):
        found.append(step(source, target, found[-1], *limits))
        if apart(found[-2], found[-1]) < STANDSTILL:
            break
    return found


def round_up(number: float) -> float:
    """The next number with two digits."""
    return float(TWO_DIGITS.create_decimal(repr(float(number))))
