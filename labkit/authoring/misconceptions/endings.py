"""Mistakes in how the whole loop ends, and in what it makes of a step."""

import numpy as np

from labkit.authoring import solution as right
from labkit.authoring.misconceptions.loop import LEFT, _loop, both, right_step
from labkit.authoring.mistake import Several, mistake
from labkit.authoring.references import READINGS


@mistake("icp", credit=0.7)
def icp__budget_ignored(*arguments):
    """The budget is not what ends the loop: take at most `max_iterations` steps."""
    return _in_both(arguments, 10, 20, 500)


@mistake("icp", credit=0.8)
def icp__one_less(*arguments):
    """One step of the budget is lost, or the transform before the last step is returned."""
    return _in_both(arguments, arguments[-1] - 1)


@mistake("icp", credit=0.8)
def icp__one_more(*arguments):
    """The budget is overdrawn by one step."""
    return _in_both(arguments, arguments[-1] + 1)


@mistake("icp", credit=0.7, chapter="chapter 4, “When to stop”")
def icp__stops_early(*arguments):
    """The loop stops while it still moves: go on until a step is below 1e-6."""
    return _ended(arguments, *(lambda d, a, e=e: d < e and a < e for e in (1e-3, 1e-2)))


@mistake("icp", credit=0.7, chapter="chapter 4, “When to stop”")
def icp__any(*arguments):
    """The loop stops when the translation or the rotation is small: both have to be."""
    return _ended(arguments, lambda d, a: d < 1e-6 or a < 1e-6)


@mistake("icp", credit=0.7)
@both
def icp__gives_up(source, target, T, gate, ratio, delta, iterations, *, keep):
    """The guess is returned where fewer than ten pairs are left; three are enough for a step."""
    for _ in range(iterations):
        moved = source @ T[:2, :2].T + T[:2, 2]
        if keep(right.nearest_neighbors(moved, target)[1], gate, ratio).sum() < 10:
            break
        T = right_step(source, target, T, gate, ratio, delta, keep=keep)
    return T


@mistake("icp", credit=0.4, chapter=LEFT)
def icp__composed_again(*arguments):
    """The result of a step is composed with the transform once more; it is the new transform
    already."""
    source, target, T_init, *settings, iterations = arguments
    answers = []
    for compose in (lambda new, T: new @ T, lambda new, T: T @ new):
        for keep in READINGS:
            T = T_init
            for _ in range(iterations):
                T = compose(right_step(source, target, T, *settings, keep=keep), T)
            answers.append(T)
    return Several(tuple(answers))


def _in_both(arguments, *budgets):
    """The right loop with other budgets, in each reading of the trimming."""
    return Several(
        tuple(
            _loop(right_step, *arguments[:-1], budget, keep=keep)
            for budget in budgets
            for keep in READINGS
        )
    )


def _ended(arguments, *rules):
    """The right loop with other rules for its end, of the last step's shift and turn."""
    source, target, T_init, *settings, iterations = arguments
    answers = []
    for ends in rules:
        for keep in READINGS:
            T = T_init
            for _ in range(iterations):
                before, T = T, right_step(source, target, T, *settings, keep=keep)
                dT = T @ right.invert(before)
                if ends(np.hypot(*dT[:2, 2]), abs(np.arctan2(dT[1, 0], dT[0, 0]))):
                    break
            answers.append(T)
    return Several(tuple(answers))
