"""Mistakes in when to stop: the convergence test, and how the whole loop ends."""

import math

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes
from labkit.course.authoring.misconceptions.loop import LEFT
from labkit.course.authoring.references import READINGS, path, step

ANY = "the errata, “Convergence: any test, or both?”"
STOP = "chapter 4, “When to stop”"


def _stops(pose=None, cost=None, budget=None):
    """A convergence test of which one part is another."""
    pose = pose or (lambda x, y, turn, e, a: math.hypot(x, y) < e and abs(turn) < a)
    cost = cost or (lambda change, e: abs(change) < e)
    budget = budget or (lambda k, most: k >= most)

    def test(dT, change, k, eps_t, eps_psi, eps_cost, k_max):
        still = pose(dT[0, 2], dT[1, 2], math.atan2(dT[1, 0], dT[0, 0]), eps_t, eps_psi)
        return still or cost(change, eps_cost) or budget(k, k_max)

    return test


def _all(dT, change, k, eps_t, eps_psi, eps_cost, k_max):
    """Nothing but both tests together, or the budget, ends the loop."""
    x, y, turn = dT[0, 2], dT[1, 2], math.atan2(dT[1, 0], dT[0, 0])
    small = math.hypot(x, y) < eps_t and abs(turn) < eps_psi and abs(change) < eps_cost
    return small or k >= k_max


# fmt: off
mistakes("has_converged", {
    "any": (0.5, "One of the two pose tests is enough here; a scan that turns on the spot would "
        "stop the loop at once. Both must hold.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) < e or abs(turn) < a), ANY),
    "all": (0.5, "Pose and cost must both be still here; either of them ends the loop.", _all),
    "signed_turn": (0.9, "The angle keeps its sign: every turn to the right looks small.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) < e and turn < a)),
    "signed_cost": (0.6, "The cost's change keeps its sign: every cost that falls ends the loop.",
        _stops(cost=lambda change, e: change < e)),
    "each_axis": (0.9, "Each axis is held against ε_t by itself; the test is on the length ‖Δt‖.",
        _stops(lambda x, y, turn, e, a: max(abs(x), abs(y)) < e and abs(turn) < a)),
    "squared_step": (0.7, "‖Δt‖² is held against ε_t; both are lengths in metres.",
        _stops(lambda x, y, turn, e, a: x**2 + y**2 < e and abs(turn) < a)),
    "degrees": (0.7, "The angle is in degrees here; ε_ψ is in radians.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) < e and abs(math.degrees(turn)) < a)),
    "one_more": (0.9, "The budget is overdrawn by one: at k = k_max the loop ends.",
        _stops(budget=lambda k, most: k > most)),
    "one_less": (0.9, "The budget is cut by one: the loop ends at k = k_max, not before.",
        _stops(budget=lambda k, most: k >= most - 1)),
    "no_budget": (0.8, "The budget k_max is not looked at, so the loop may never end.",
        _stops(budget=lambda *_: False)),
    "budget_alone": (0.2, "Only the budget ends the loop: look at the step and the cost, too.",
        _stops(lambda *_: False, lambda *_: False)),
    "no_cost": (0.6, "The change of the cost is not looked at; a cost that stands still ends the "
        "loop, too.", _stops(cost=lambda *_: False)),
    "no_turn": (0.7, "The rotation is not looked at: a scan may turn on the spot.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) < e)),
    "closed": (0.8, "A step or a change right at its tolerance is not small: it has to be below.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) <= e and abs(turn) <= a,
               lambda change, e: abs(change) <= e)),
    "sine": (0.9, "The sine is taken for the angle: at half a turn it is zero, too. Use arctan2.",
        _stops(lambda x, y, turn, e, a: math.hypot(x, y) < e and abs(math.sin(turn)) < a)),
    "inverted": (0.0, "True and False are swapped: True means to stop.",
        lambda *arguments: not right.has_converged(*arguments)),
    "always": (0.0, "It says True whatever it is given.", lambda *arguments: True),
    "never": (0.0, "It says False whatever it is given.", lambda *arguments: False),
})
# fmt: on


def _composed_again(*arguments):
    *begin, iterations = arguments
    answers = []
    for compose in (lambda new, T: new @ T, lambda new, T: T @ new):
        for keep in READINGS:
            T = begin[2]
            for _ in range(iterations):
                T = compose(step(*begin[:2], T, *begin[3:], keep), T)
            answers.append(T)
    return answers


def _budgets(*budgets):
    """The right loop with other budgets, made of the one that is given."""

    def answers(*arguments):
        paths = [path(*arguments[:-1], keep=keep) for keep in READINGS]
        ends = [budget(arguments[-1]) for budget in budgets]
        return [one[min(end, len(one) - 1)] for end in ends for one in paths]

    return answers


def _ended(*rules):
    """The right loop with other rules for its end: of the step's shift and turn, of the change
    of the RMSE over all points, and of how many pairs are kept."""
    return lambda *arguments: [_end(rule, keep, *arguments) for rule in rules for keep in READINGS]


def _end(rule, keep, p, q, guess, gate, ratio, delta, iterations):
    before, rmse = None, np.inf
    for T in path(p, q, guess, gate, ratio, delta, keep=keep)[: iterations + 1]:
        d = right.nearest_neighbors(p @ T[:2, :2].T + T[:2, 2], q)[1]
        last, rmse = rmse, np.sqrt(np.mean(d**2))
        shift = turn = np.inf
        if before is not None:
            dT = T @ right.invert(before)
            shift, turn = np.hypot(*dT[:2, 2]), abs(np.arctan2(dT[1, 0], dT[0, 0]))
        if rule(shift, turn, abs(last - rmse), keep(d, gate, ratio).sum()):
            break
        before = T
    return T


# fmt: off
mistakes("icp", {
    "budget_ignored": (0.85, "Another budget ends the loop: take at most `max_iterations` steps.",
        _budgets(lambda most: 10, lambda most: 20, lambda most: 500)),
    "one_less": (0.85, "A step of the budget is lost, or the transform before the last returned.",
        _budgets(lambda most: most - 1)),
    "one_more": (0.85, "The budget is overdrawn by one step.", _budgets(lambda most: most + 1)),
    "stops_early": (0.85, "The loop stops while it still moves: go on until a step is below 1e-6.",
        _ended(*(lambda d, a, *_, e=e: d < e and a < e for e in (1e-4, 1e-3, 1e-2))), STOP),
    "loose_translation": (0.95, "The loop stops while it shifts: that, too, is to be below 1e-6.",
        _ended(*(lambda d, a, *_, e=e: d < e and a < 1e-6 for e in (1e-3, 1e-2))), STOP),
    "loose_rotation": (0.95, "The loop stops while it turns: that, too, is to be below 1e-6.",
        _ended(*(lambda d, a, *_, e=e: d < 1e-6 and a < e for e in (1e-3, 1e-2))), STOP),
    "no_rotation_test": (0.95, "Only the translation is tested: a scan may still turn on the spot.",
        _ended(lambda d, a, *_: d < 1e-6), STOP),
    "no_translation_test": (0.95, "Only the rotation is tested: a scan may still shift without it.",
        _ended(lambda d, a, *_: a < 1e-6), STOP),
    "rmse_change": (0.95, "The loop stops where the RMSE hardly changes; a scan may still slide.",
        _ended(*(lambda d, a, rmse, _, e=e: rmse < e for e in (1e-6, 1e-5))), STOP),
    "any": (0.85, "The loop stops when the translation or the rotation is small: both have to be.",
        _ended(lambda d, a, *_: d < 1e-6 or a < 1e-6), STOP),
    "gives_up": (0.95, "The loop ends where too few pairs are left; three are enough.",
        _ended(*(lambda d, a, rmse, kept, n=n: kept < n for n in (6, 10)))),
    "composed_again": (0.4, "The result of a step is composed with the transform once more; it is "
        "the new transform already.", _composed_again, LEFT),
})
