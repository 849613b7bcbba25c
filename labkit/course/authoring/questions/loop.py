"""The convergence test, a step of ICP and the loop: scans that overlap in part."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.course.authoring.entries import Exact, Rng, question, recipe
from labkit.course.authoring.questions.alignment import align_weighted
from labkit.course.authoring.questions.correspondences import (
    distance_gate,
    huber_weights,
    nearest_neighbors,
    overlap,
)
from labkit.course.authoring.questions.scenes import (
    FAR,
    LOOP_BUDGET,
    about_the_gate,
    on_the_spot,
    scans,
    straight_ahead,
    straight_to_the_left,
    whole_loop,
)
from labkit.course.authoring.questions.se2 import invert
from labkit.course.exercises.entries import ENTRIES, Arguments
from labkit.grading.questions import Answer
from labkit.result import step_length

EPS_T, EPS_PSI, EPS_COST, K_MAX = 1e-3, 1e-3, 1e-6, 50  # of the convergence test
OFF = 50.0  # m: a gate or a δ that does nothing
EARLY = 2e-5  # m and rad, where the oracles stop: the question asks for 1e-6, 1e-5 is no mistake

WHEN = "chapter 4, “When to stop”"
STAGES = "chapter 3, “Each remedy by itself”"
ON_THE_RIGHT = (
    "The increment is composed on the right, T @ dT: it acts on points that T has moved already, "
    "so it belongs on the left, dT @ T."
)
UPDATE, GATE, WEIGHTS = "return dT @ T", "distance_gate(d, max_distance)", "huber_weights(d[kept], "
SEARCH = "nearest_neighbors(moved, target)"
ALIGNED = "    R, t = align_weighted(moved[kept]"
RESULT = "break\n    return T"
SHIFT, TURN = "np.hypot(*dT[:2, 2])", "abs(np.arctan2(dT[1, 0], dT[0, 0]))"
STOP = f"{SHIFT} < 1e-13 and {TURN} < 1e-13"
WIDER = (2, 1.2, 1.5, 3)
RMSE = "np.sqrt(np.mean(nearest_neighbors(source @ T[:2, :2].T + T[:2, 2], target)[1] ** 2))"
KEPT = "    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)\n"
KEPT_OF_GATED = f"    kept = {GATE}\n    kept[kept] = overlap(d[kept], overlap_ratio)\n"
READINGS = [{KEPT: kept, "1e-7": "1e-13"} for kept in (KEPT, KEPT_OF_GATED)]


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


LOOP_AT_THE_GATE = about_the_gate([-0.1, 0.05], 2.0, 1.0, 0.02, LOOP_BUDGET, apart=0.02)


def _has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):  # type: ignore[no-untyped-def]
    shift, turn = step_length(np.eye(3), np.array(dT, dtype=float))
    return (shift < eps_t and turn < eps_psi) or abs(cost_change) < eps_cost or iteration >= k_max


def _by_labkit(p: Any, q: Any, T: Any, *limits: float) -> Any:
    """The loop, or its step, with ρ of all points, as labkit reads it."""
    tests = {"translation_tolerance": EARLY, "rotation_tolerance": EARLY, "cost_tolerance": 0.0}
    gate, ratio, delta, budget = limits if len(limits) == 4 else (*limits, 1)
    parameters = labkit.IcpParameters(gate, ratio, delta, int(budget), **tests)
    return labkit.icp(p, q, T, parameters).T_target_source


def _ending_early(*arguments: Any) -> Any:
    """The loop with ρ of the pairs that pass the gate, as many a student's may end."""
    return ENTRIES["icp"].apply_edits({"1e-13": f"{EARLY}"})[1](*arguments)


# fmt: off
WRONG_STAGES = {  # of a step, and so of the whole loop
    "no_weights": ("Huber's weights are not used in the alignment.",
        {f"{WEIGHTS}delta)": "np.ones(kept.sum())"}, STAGES),
    "weights_of_squares": ("Huber's weights are taken of squared distances; they take distances in "
        "metres.", {WEIGHTS: "huber_weights(d[kept] ** 2, "}, STAGES),
    "gate_on_squares": ("The gate is held against squared distances; both are in metres.",
        {GATE: "distance_gate(d**2, max_distance)"}, STAGES),
    "wide_gate": ("The gate is too wide, as if doubled: no pair beyond `max_distance` stays.",
        [{GATE: f"distance_gate(d, {wider} * max_distance)"} for wider in WIDER], STAGES),
    "no_gate": ("The gate is not used: no pair beyond `max_distance` stays.",
        {f"{GATE} & ": ""}, STAGES),
    "no_trimming": ("The trimming is not used: only the closest share of the pairs stays.",
        {" & overlap(d, overlap_ratio)": ""}, STAGES),
    "gate_or_trimming": ("A pair stays that passes the gate or the trimming; it has to pass both.",
        {"& overlap": "| overlap"}, STAGES),
}
@question("The convergence test", points=5, answer=Answer.FLAG,
    chapter="chapter 4, “When to stop”",
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


@question("One step of ICP", points=12, answer=Answer.TRANSFORM,
    chapter="chapter 4, “Ten lines”",
    task=r"""
Put the stages together. Move the source points by the current transform, pair each with its nearest
target point, reject what the gate and the trimming reject, weigh the rest with Huber's weights,
align, and update the transform. Whether $\rho$ counts all source points or those within the gate is
left to you: the lesson does both.
""", oracle=_by_labkit, readings=READINGS, visible={
    "all stages at work": scans(20, 0.4, 0.7, 0.12),
    "the gate alone": scans(20, 0.35, 1.0, OFF),
    "trimming alone": scans(20, OFF, 0.7, OFF),
    "the weights alone": scans(20, OFF, 1.0, 0.1),
    "a pair on the gate": Exact(about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
    "a pair a little beyond a wide gate": about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
}, hidden={
    "the gate": {
        "the gate alone": scans(24, 0.6, 1.0, OFF),
        "a pair on the gate": Exact(about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
        "two pairs on a wide gate": Exact(about_the_gate([0.0, 0.0], 2.0, 1.0, 10.0)),
        "a pair a little beyond a wide gate": about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
    },
    "the trimming": {
        "trimming alone": scans(24, OFF, 0.65, OFF),
    },
    "the weights": {
        "the weights alone": scans(24, OFF, 1.0, 0.1),
    },
    "the update": {
        "no stage at work": scans(24, OFF, 1.0, OFF, turn=FAR),
    },
    "all of it": {
        "all stages at work": scans(30, 0.45, 0.75, 0.1),
        "a guess far from no motion": scans(24, 0.5, 0.8, 0.15, turn=FAR),
    },
}, mistakes={
    "update_on_the_right": (ON_THE_RIGHT, {UPDATE: "return T @ dT"}),
    "increment_alone": ("This is the increment dT alone; the new transform is dT @ T.",
        {UPDATE: "return dT"}),
    "turned_back": ("The points are turned by Rᵀ: where points are rows, R p is `points @ R.T`.",
        {"source @ T[:2, :2].T": "source @ T[:2, :2]"}),
    "unmoved_source": ("The pairs are found at T, but the aligned points are not moved by T.",
        {"align_weighted(moved[kept]": "align_weighted(source[kept]"}),
    "unmoved_pairs": ("The pairs are those of the unmoved points: move the source by T first.",
        {"moved = source @ T[:2, :2].T + T[:2, 2]": "moved = source"}),
    "swapped": ("Source and target are swapped in the alignment: the step leads away.",
        {UPDATE: "return invert(dT) @ T"}),
    "strict_gate": ("A pair right on the gate is rejected: the gate is d <= d_max.",
        {GATE: "(d < max_distance)"}, STAGES),
    **WRONG_STAGES,
})
def icp_step(source, target, T, max_distance, overlap_ratio, delta):
    """One iteration: pair, reject, weigh, align, update.

    source, target: arrays (N, 2) and (M, 2), the newer and the older scan, not moved.
    T: array (3, 3), the current T_target_source.
    max_distance, overlap_ratio, delta: gate [m], share to keep, Huber's delta [m].
    Returns the next T_target_source, as one (3, 3) or as (R, t).

    >>> corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
    >>> T = icp_step(corners - 0.2, corners, np.eye(3), 0.5, 1.0, 0.1)
    >>> print(T.round(2)[:2, 2] if isinstance(T, np.ndarray) else np.round(T[1], 2))
    [0.2 0.2]
    """
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = nearest_neighbors(moved, target)
    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)
    R, t = align_weighted(moved[kept], target[indices[kept]], huber_weights(d[kept], delta))
    dT = np.eye(3)
    dT[:2, :2], dT[:2, 2] = R, t
    return dT @ T


@question("The whole loop", points=15, answer=Answer.TRANSFORM,
    chapter="chapter 4, “The same loop, grown up”",
    task=r"""
Repeat the step from the initial guess until one step is small in *both* translation
($< 10^{-6}$ m) and rotation ($< 10^{-6}$ rad), or until the budget of steps is spent. The answer is
the transform after the last step.
""", oracle=[_by_labkit, _ending_early], readings=READINGS, tolerance=5e-5, visible={
    "all stages at work": scans(20, 0.9, 0.8, 0.1, LOOP_BUDGET),
    "a guess far from no motion": whole_loop(20, 0.8, 0.8, 0.1),
    "the gate alone": whole_loop(28, 0.45, 1.0, OFF),
    "a budget that ends the loop": scans(20, 1.5, 0.8, 0.1, 3, error=0.15),
    "a way straight ahead, without a turn": straight_ahead,
    "a turn on the spot, without a shift": on_the_spot,
    "a pair a little beyond a wide gate": LOOP_AT_THE_GATE,
    "a way straight to the left, without a turn": straight_to_the_left,
}, hidden={
    "the stages": {
        "the gate alone": whole_loop(28, 0.45, 1.0, OFF),
        "trimming alone": whole_loop(24, OFF, 0.7, OFF),
        "all stages at work": whole_loop(30, 0.5, 0.8, 0.1),
        "five pairs, and one a little beyond a narrow gate":
            about_the_gate([0.02], 0.5, 1.0, 0.02, LOOP_BUDGET, apart=0.02),
        "a pair a little beyond a wide gate": LOOP_AT_THE_GATE,
    },
    "the budget": {
        "a guess far from no motion, and few steps":
            scans(24, OFF, 1.0, OFF, 4, turn=FAR, error=0.15),
        "a budget that ends the loop": scans(24, OFF, 1.0, OFF, 3, error=0.15),
    },
    "the test of the translation": {
        "a way straight ahead, without a turn": straight_ahead,
        "a way straight to the left, without a turn": straight_to_the_left,
    },
    "the test of the rotation": {
        "a turn on the spot, without a shift": on_the_spot,
    },
}, mistakes={
    "update_on_the_right": (ON_THE_RIGHT, {UPDATE: "return T @ dT"}, "chapter 4, “Ten lines”"),
    "last_increment": ("This is the last increment alone; the steps have to be chained.",
        {RESULT: "break\n    return dT"}),
    "pairs_found_once": ("The pairs are found once; each iteration has to find them anew.",
        {"T = T_init": "global T_first\n    T = T_first = T_init",
         SEARCH: "nearest_neighbors(source @ T_first[:2, :2].T + T_first[:2, 2], target)",
         ALIGNED: f"    d = np.linalg.norm(moved - target[indices], axis=1)\n{ALIGNED}"}),
    **WRONG_STAGES,
    "budget_ignored": ("Another budget ends the loop: take at most `max_iterations` steps.",
        [{"range(max_iterations)": f"range({most})"} for most in (10, 20, 200)]),
    "from_identity": ("The loop begins without a motion; begin with the guess `T_init`.",
        {"T = T_init": "T = np.eye(3)"}),
    "one_step": ("This is one step alone; repeat it until it is small.",
        {"range(max_iterations)": "range(1)"}),
    "stops_early": ("The loop stops while it still moves: go on until a step is below 1e-6.",
        [{STOP: f"{SHIFT} < {e} and {TURN} < {e}"} for e in (1e-4, 1e-3, 1e-2)], WHEN),
    "no_rotation_test": ("Only the translation is tested: a scan may still turn on the spot.",
        {STOP: f"{SHIFT} < 1e-6"}, WHEN),
    "no_translation_test": ("Only the rotation is tested: a scan may still shift without it.",
        {STOP: f"{TURN} < 1e-6"}, WHEN),
    "x_alone": ("Only Δx is held against the tolerance; the test is on the length ‖Δt‖.",
        {STOP: f"abs(dT[0, 2]) < 1e-6 and {TURN} < 1e-6"}, WHEN),
    "rmse_change": ("The loop stops where the RMSE hardly changes; a scan may still slide.",
        [{"T = T_init": "T, rmse = T_init, np.inf",
          "dT = T @ invert(T_before)": f"last, rmse = rmse, {RMSE}",
          STOP: f"abs(last - rmse) < {e}"} for e in (1e-6, 1e-5)], WHEN),
    "any": ("The loop stops when the translation or the rotation is small: both have to be.",
        {STOP: f"{SHIFT} < 1e-6 or {TURN} < 1e-6"}, WHEN),
})
def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    """Match the newer scan onto the older one.

    source, target: arrays (N, 2) and (M, 2), the newer and the older scan.
    T_init: array (3, 3), the initial guess of T_target_source.
    max_distance, overlap_ratio, delta: as for one step.
    max_iterations: int, the budget: this many steps at most.
    Returns T_target_source, as one (3, 3) or as (R, t).

    >>> corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
    >>> T = icp(corners - 0.2, corners, np.eye(3), 0.5, 1.0, 0.1, 50)
    >>> print(T.round(2)[:2, 2] if isinstance(T, np.ndarray) else np.round(T[1], 2))
    [0.2 0.2]
    """
    T = T_init
    for _ in range(max_iterations):
        T_before, T = T, icp_step(source, target, T, max_distance, overlap_ratio, delta)
        dT = T @ invert(T_before)
        if np.hypot(*dT[:2, 2]) < 1e-7 and abs(np.arctan2(dT[1, 0], dT[0, 0])) < 1e-7:
            break
    return T
