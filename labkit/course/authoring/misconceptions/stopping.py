"""Mistakes in when to stop: the convergence test, and how the whole loop ends."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistake
from labkit.course.authoring.misconceptions.loop import LEFT, _loop, either, right_step
from labkit.course.authoring.references import READINGS

ANY = "the errata, “Convergence: any test, or both?”"


def _turn(dT):
    return math.atan2(dT[1, 0], dT[0, 0])


def _shift(dT):
    return math.hypot(dT[0, 2], dT[1, 2])


@mistake("has_converged", credit=0.5, chapter=ANY)
def has_converged__any(dT, cost_change, iteration, step, turn, cost, budget):
    """One of the two pose tests is enough here; a scan that turns on the spot would stop the
    loop at once. Both must hold."""
    pose = _shift(dT) < step or abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.5)
def has_converged__all(dT, cost_change, iteration, step, turn, cost, budget):
    """Pose and cost must both be still here; either of them ends the loop."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return (pose and abs(cost_change) < cost) or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__signed_turn(dT, cost_change, iteration, step, turn, cost, budget):
    """The angle keeps its sign, so that every turn to the right looks small: take |Δψ|."""
    pose = _shift(dT) < step and _turn(dT) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__signed_cost(dT, cost_change, iteration, step, turn, cost, budget):
    """The change of the cost keeps its sign, so that every cost that falls ends the loop."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or cost_change < cost or iteration >= budget


@mistake("has_converged", credit=0.7)
def has_converged__each_axis(dT, cost_change, iteration, step, turn, cost, budget):
    """Each axis is held against ε_t by itself; the test is on the length ‖Δt‖."""
    still = max(abs(dT[0, 2]), abs(dT[1, 2])) < step and abs(_turn(dT)) < turn
    return still or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__squared_step(dT, cost_change, iteration, step, turn, cost, budget):
    """‖Δt‖² is held against ε_t; both are lengths in metres."""
    pose = _shift(dT) ** 2 < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__degrees(dT, cost_change, iteration, step, turn, cost, budget):
    """The angle is in degrees here; ε_ψ is in radians."""
    pose = _shift(dT) < step and abs(math.degrees(_turn(dT))) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.8)
def has_converged__one_more(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget is overdrawn by one: at k = k_max the loop ends."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration > budget


@mistake("has_converged", credit=0.8)
def has_converged__one_less(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget is cut by one: the loop ends at k = k_max, not before."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget - 1


@mistake("has_converged", credit=0.6)
def has_converged__no_budget(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget k_max is not looked at, so the loop may never end."""
    return (_shift(dT) < step and abs(_turn(dT)) < turn) or abs(cost_change) < cost


@mistake("has_converged", credit=0.5)
def has_converged__no_cost(dT, cost_change, iteration, step, turn, cost, budget):
    """The change of the cost is not looked at; a cost that stands still ends the loop, too."""
    return (_shift(dT) < step and abs(_turn(dT)) < turn) or iteration >= budget


@mistake("has_converged", credit=0.4)
def has_converged__no_turn(dT, cost_change, iteration, step, turn, cost, budget):
    """The rotation is not looked at: a scan may turn on the spot."""
    return _shift(dT) < step or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.8)
def has_converged__sine(dT, cost_change, iteration, step, turn, cost, budget):
    """The sine is taken for the angle: at half a turn it is zero as well. Use arctan2."""
    pose = _shift(dT) < step and abs(dT[1, 0]) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.0)
def has_converged__inverted(*arguments):
    """True and False are swapped: True means to stop."""
    return not right.has_converged(*arguments)


@mistake("has_converged", credit=0.0)
def has_converged__always(*arguments):
    """It says True whatever it is given."""
    return True


@mistake("has_converged", credit=0.0)
def has_converged__never(*arguments):
    """It says False whatever it is given."""
    return False


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


@either("icp", credit=0.7)
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
