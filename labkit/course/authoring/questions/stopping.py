"""The convergence test."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.course.authoring.entries import Exact, Rng, question, recipe
from labkit.course.exercises.entries import Arguments
from labkit.grading.questions import Answer
from labkit.result import step_length

EPS_T, EPS_PSI, EPS_COST, K_MAX = 1e-3, 1e-3, 1e-6, 50
WHEN = "chapter 4, “When to stop”"


@recipe
def _ending(
    rng: Rng,
    step: float,
    turn: float,
    cost: float = 0.01,
    iteration: int = 10,
    heading: float | None = None,
    half_turn: bool = False,
    k_max: int = K_MAX,
) -> Arguments:
    """A step of that many tolerances; ``step=0.5`` is half of ε_t. A heading fixes its way.

    The tolerances are others in each case, and differ; the change of cost goes with its own.
    """
    direction = rng.number(-3.0, 3.0) if heading is None else heading
    vary = rng.number(0.95, 1.05)
    eps_t, eps_psi = rng.permutation([0.25, 4.0]) * (EPS_T, EPS_PSI)
    scale = rng.choice([0.25, 4.0])
    shift = vary * step * eps_t * np.array([math.cos(direction), math.sin(direction)])
    dT = labkit.transform(*shift, math.pi * half_turn + vary * turn * eps_psi)
    return dT, vary * cost * scale, iteration, eps_t, eps_psi, EPS_COST * scale, k_max


def _ending_at(step: float, cost: float) -> Exact:
    """A step whose shift, or change of cost, may be the tolerance itself."""
    dT = labkit.transform(EPS_T * step, 0.0, 0.0)
    return Exact((dT, cost, 10, EPS_T, EPS_PSI, EPS_COST, K_MAX))


def _has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):  # type: ignore[no-untyped-def]
    shift, turn = step_length(np.eye(3), np.array(dT, dtype=float))
    return (shift < eps_t and turn < eps_psi) or abs(cost_change) < eps_cost or iteration >= k_max


# fmt: off
@question("The convergence test", points=5, answer=Answer.FLAG,
    chapter=WHEN,
    task=r"""
Stop when any one of three things holds: the step is small in *both* translation
($\lVert\Delta\mathbf{t}\rVert < \varepsilon_t$) and rotation ($|\Delta\psi| < \varepsilon_\psi$);
the cost stands still ($|\Delta J| < \varepsilon_J$); the budget is spent ($k \ge k_{\max}$).
""", oracle=_has_converged, visible={
    "a small step": _ending(0.3, 0.3, iteration=1),
    "a tiny step": _ending(0.04, 0.04, iteration=2),
    "a long step, and a cost that falls": _ending(90.0, 90.0, cost=-0.01),
    "a cost that stands still": _ending(90.0, 90.0, cost=1e-7),
    "a shift, but no turn": _ending(60.0, 0.1, cost=5e-4),
    "no shift, but a turn to the right": _ending(0.1, -1.6),
    "no shift, but a turn to the left": _ending(0.1, 1.7),
    "the last iteration of the budget": _ending(90.0, 90.0, iteration=50),
    "the last but one iteration": _ending(90.0, 90.0, iteration=49),
    "a cost that fell by next to nothing": _ending(60.0, 60.0, cost=-1e-7),
    "a shift aslant": _ending(1.3, 0.2, heading=math.pi / 4),
    "a shift to the left": _ending(1.4, 0.2, heading=math.pi / 2),
    "half a turn on the spot": _ending(0.2, -0.4, half_turn=True),
    "a shift exactly at its tolerance": _ending_at(1.0, 0.01),
    "a cost exactly at its tolerance": _ending_at(80.0, EPS_COST),
    "a turn of less than its tolerance": _ending(0.2, 0.9),
    "a step aslant, just below both tolerances": _ending(0.9, -0.8, heading=math.pi / 4),
    "an iteration past the budget": _ending(80.0, -70.0, iteration=31, k_max=30),
    "a cost just below its tolerance": _ending(70.0, 60.0, cost=8e-7),
    "a small shift without a turn": _ending(0.5, 0.001),
}, hidden={
    "the translation": {
        "a step aslant, just below both tolerances": _ending(0.9, 0.8, heading=math.pi / 4),
        "a small step to the left": _ending(0.7, 0.3, cost=-0.02, heading=math.pi / 2),
        "a small step, first iteration": _ending(0.5, 0.6, cost=-0.03, iteration=1, heading=-0.4),
        "a shift to the left": _ending(50.0, 0.1, cost=5e-4, heading=math.pi / 2),
        "a shift to the right": _ending(6.0, 0.2, heading=-math.pi / 2),
        "a shift aslant": _ending(1.3, 0.2, heading=math.pi / 4),
        "a shift of a few tolerances": _ending(7.0, 0.1, heading=math.pi),
        "a step and a turn that are too long": _ending(3.0, -4.0, cost=4e-6),
    },
    "the rotation": {
        "a step aslant, back, and most of the turn": _ending(0.8, -0.9, heading=-0.75 * math.pi),
        "a small step back in the second iteration":
            _ending(0.6, -0.7, cost=0.02, iteration=2, heading=math.pi),
        "a turn to the right without a shift": _ending(0.2, -60.0, cost=5e-4),
        "half a turn on the spot": _ending(0.2, 0.6, half_turn=True),
        "a turn to the left in the first iteration": _ending(0.1, 40.0, cost=0.02, iteration=1),
        "half a turn on the spot, to the right": _ending(0.3, 0.4, half_turn=True),
    },
    "the cost": {
        "a cost that rose by next to nothing": _ending(80.0, 70.0, cost=2e-7),
        "a cost that fell by next to nothing": _ending(80.0, -70.0, cost=-2e-7),
        "a cost just below its tolerance": _ending(70.0, 60.0, cost=-8e-7),
        "a cost that falls by much": _ending(60.0, -70.0, cost=-0.02),
        "a cost that falls by a few tolerances": _ending(50.0, 80.0, cost=-4e-6),
    },
    "the tolerances themselves": {
        "a shift exactly at its tolerance": _ending_at(1.0, 0.01),
        "a shift a little below its tolerance": _ending_at(0.96875, 0.01),
        "a cost exactly at its tolerance": _ending_at(80.0, EPS_COST),
    },
    "the budget": {
        "the last iteration of the budget": _ending(80.0, 70.0, iteration=20, k_max=20),
        "the last iteration, a cost that rose": _ending(2.0, 70.0, cost=0.02, iteration=50),
        "the last iteration of a short budget": _ending(50.0, -6.0, iteration=4, k_max=4),
        "an iteration past the budget": _ending(80.0, -70.0, iteration=51),
        "an iteration past a short budget": _ending(7.0, 80.0, iteration=6, k_max=4),
        "the last but one iteration": _ending(60.0, 70.0, iteration=29, k_max=30),
    },
}, mistakes={
    "any": ("One of the two pose tests is enough here; a scan that turns on the spot would "
        "stop the loop at once. Both must hold.",
        {"small_shift and": "small_shift or"}, "the errata, “Convergence: any test, or both?”"),
    "all": ("Pose and cost must both be still here; either of them ends the loop.",
        {"or abs(cost_change)": "and abs(cost_change)"}),
    "signed_turn": ("The angle keeps its sign: every turn to the right looks small.",
        {"small_turn = abs(": "small_turn = ("}),
    "signed_cost": ("The cost's change keeps its sign: every cost that falls ends the loop.",
        {"abs(cost_change)": "cost_change"}),
    "each_axis": ("Each axis is held against ε_t by itself; the test is on the length ‖Δt‖.",
        {"np.hypot(dT[0, 2], dT[1, 2])": "np.abs(dT[:2, 2]).max()"}),
    "x_alone": ("Only Δx is held against ε_t; the test is on the length ‖Δt‖.",
        {"np.hypot(dT[0, 2], dT[1, 2])": "abs(dT[0, 2])"}),
    "sum_of_axes": ("|Δx| + |Δy| is held against ε_t; the test is on the length ‖Δt‖.",
        {"np.hypot(dT[0, 2], dT[1, 2])": "abs(dT[0, 2]) + abs(dT[1, 2])"}),
    "degrees": ("The angle is in degrees here; ε_ψ is in radians.",
        {" < eps_psi": " * 180 / np.pi < eps_psi"}),
    "one_more": ("The budget is overdrawn by one: at k = k_max the loop ends.",
        {">= k_max": "> k_max"}),
    "one_less": ("The budget is cut by one: the loop ends at k = k_max, not before.",
        {">= k_max": ">= k_max - 1"}),
    "budget_met_exactly": ("Only an iteration equal to k_max ends the loop: one past it goes on.",
        {">= k_max": "== k_max"}),
    "no_budget": ("The budget k_max is not looked at, so the loop may never end.",
        {" or iteration >= k_max": ""}),
    "no_cost": ("The change of the cost is not looked at; a cost that stands still ends the "
        "loop, too.", {" or abs(cost_change) < eps_cost": ""}),
    "no_turn": ("The rotation is not looked at: a scan may turn on the spot.",
        {"small_shift and small_turn": "small_shift"}),
    "no_step": ("The step is not looked at: one that is small in both ends the loop, too.",
        {"(small_shift and small_turn) or ": ""}),
    "one_norm": ("The norm of dT − I mixes metres and radians: test ‖Δt‖ and |Δψ| apart.",
        {"(small_shift and small_turn)": "np.linalg.norm(dT - np.eye(3)) < eps_t"}),
    "closed": ("A step or a change right at its tolerance is not small: it has to be below.",
        {"< eps_": "<= eps_"}),
})
def has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):
    """Whether the loop ends after this iteration.

    dT: array (3, 3), the step of this iteration.
    cost_change: float, J_k - J_(k-1), negative where the cost fell.
    iteration: int, k, counted from 1.
    eps_t, eps_psi, eps_cost: floats, the tolerances in m, rad and m².
    k_max: int, the budget.
    Returns a bool: True to stop.

    >>> print(has_converged(np.eye(3), -0.1, 3, 1e-3, 1e-3, 1e-6, 50))
    True
    """
    small_shift = np.hypot(dT[0, 2], dT[1, 2]) < eps_t
    small_turn = abs(np.arctan2(dT[1, 0], dT[0, 0])) < eps_psi
    return (small_shift and small_turn) or abs(cost_change) < eps_cost or iteration >= k_max
