"""The convergence test, a step of ICP and the loop: scans that overlap in part."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.correspondences import distance_gate as labkits_gate
from labkit.correspondences import huber_weights as labkits_weights
from labkit.correspondences import overlap as labkits_overlap
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
    from_no_motion,
    on_the_spot,
    scans,
    stop_error,
    straight_ahead,
    turned,
    walls,
    whole_loop,
)
from labkit.course.authoring.questions.se2 import invert
from labkit.course.exercises.entries import Arguments
from labkit.course.grading.assignment.questions import Answer
from labkit.neighbors import NearestNeighbors
from labkit.result import step_length

EPS_T, EPS_PSI, EPS_COST, K_MAX = 1e-3, 1e-3, 1e-6, 50  # of the convergence test
DIAGONAL = math.pi / 4
OFF = 50.0  # m: a gate or a δ that does nothing

ANY = "the errata, “Convergence: any test, or both?”"
WHEN = "chapter 4, “When to stop”"
LEFT = "chapter 4, “Ten lines”"
STAGES = "chapter 3, “Each remedy by itself”"
ON_THE_RIGHT = (
    "The increment is composed on the right, T @ dT: it acts on points that T has moved already, "
    "so it belongs on the left, dT @ T."
)
UPDATE, GATE, WEIGHTS = "return dT @ T", "distance_gate(d, max_distance)", "huber_weights(d[kept], "
MOVED = "moved = source @ T[:2, :2].T + T[:2, 2]"
SEARCH = "nearest_neighbors(moved, target)"
ALIGNED = "    R, t = align_weighted(moved[kept]"
RESULT = "break\n    return T"
SHIFT, TURN = "np.hypot(*dT[:2, 2])", "abs(np.arctan2(dT[1, 0], dT[0, 0]))"
STOP = f"{SHIFT} < 1e-13 and {TURN} < 1e-13"
BUDGET = "range(max_iterations)"
STEP = "T, icp_step(source, target, T, max_distance, overlap_ratio, delta)"
WIDER = (2, 1.2, 1.5, 3)
RMSE = "np.sqrt(np.mean(nearest_neighbors(source @ T[:2, :2].T + T[:2, 2], target)[1] ** 2))"
KEPT = "    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)\n"
KEPT_OF_GATED = f"    kept = {GATE}\n    kept[kept] = overlap(d[kept], overlap_ratio)\n"
ENOUGH = """\
    if np.count_nonzero(kept) < 2:
        raise ValueError("fewer than two pairs are left")
"""
READINGS = [{KEPT: kept + ENOUGH, "1e-7": "1e-13"} for kept in (KEPT, KEPT_OF_GATED)]


@recipe
def _ending(
    rng: Rng,
    step: float,
    turn: float,
    cost: float = -0.01,
    iteration: int = 10,
    heading: float | None = None,
    half_turn: bool = False,
) -> Arguments:
    """A step of that many tolerances; ``step=0.5`` is half of ε_t. A heading fixes its way."""
    way = rng.number(-3.0, 3.0) if heading is None else heading
    vary = rng.number(0.95, 1.05)
    x, y = vary * step * EPS_T * math.cos(way), vary * step * EPS_T * math.sin(way)
    dT = labkit.transform(x, y, math.pi * half_turn + vary * turn * EPS_PSI)
    return dT, vary * cost, iteration, EPS_T, EPS_PSI, EPS_COST, K_MAX


def _ending_at(step: float, cost: float) -> Exact:
    """A step whose shift, or change of cost, may be the tolerance itself."""
    dT = labkit.transform(EPS_T * step, 0.0, 0.2 * EPS_PSI)
    return Exact((dT, cost, 10, EPS_T, EPS_PSI, EPS_COST, K_MAX))


LOOP_AT_THE_GATE = about_the_gate([0.05, 6.0], 2.0, 1.0, 0.02, LOOP_BUDGET, apart=0.02)


def _has_converged(dT, cost_change, iteration, eps_t, eps_psi, eps_cost, k_max):  # type: ignore[no-untyped-def]
    shift, turn = step_length(np.eye(3), dT)
    return (shift < eps_t and turn < eps_psi) or abs(cost_change) < eps_cost or iteration >= k_max


def _by_labkit(p: Any, q: Any, T: Any, *limits: float) -> Any:
    """The loop, or its step, with ρ of all points, as labkit reads it."""
    tight = {"translation_tolerance": 1e-9, "rotation_tolerance": 1e-9, "cost_tolerance": 0.0}
    gate, ratio, delta, most = limits if len(limits) == 4 else (*limits, 1)
    parameters = labkit.IcpParameters(gate, ratio, delta, int(most), **tight)
    return labkit.icp(p, q, T, parameters).T_target_source


def _of_gated(
    p: Any, q: Any, T: Any, gate: float, ratio: float, delta: float, most: int = 1
) -> Any:
    """ρ of the pairs that pass the gate, by labkit's stages."""
    for _ in range(most):
        moved = labkit.apply(T, p)
        index, d = NearestNeighbors(q).query(moved)
        kept = np.flatnonzero(labkits_gate(d, gate))
        kept = kept[labkits_overlap(d[kept], ratio)]
        T = labkit.align(moved[kept], q[index[kept]], labkits_weights(d[kept], delta)) @ T
    return T


# fmt: off
WRONG_STAGES: dict[str, Any] = {  # with the credits in a step, and in the whole loop
    "no_weights": (0.65, 0.6, "Huber's weights are not used in the alignment.",
        {f"{WEIGHTS}delta)": "np.ones(kept.sum())"}),
    "weights_of_squares": (0.65, 0.6, "Huber's weights are taken of squared distances; they take "
        "distances in metres.", {WEIGHTS: "huber_weights(d[kept] ** 2, "}),
    "gate_on_squares": (0.65, 0.95, "The gate is held against squared distances; both are in "
        "metres.", {GATE: "distance_gate(d**2, max_distance)"}),
    "no_gate": (0.6, 0.85, "The distance gate is not applied.", {GATE: "distance_gate(d, np.inf)"}),
    "no_trimming": (0.9, 0.75, "The trimming is not applied: all pairs within the gate are "
        "aligned.", {" & overlap(d, overlap_ratio)": ""}),
    "wide_gate": (0.65, 0.85, "The gate is too wide, as if doubled: no pair beyond `max_distance` "
        "stays.", [{GATE: f"distance_gate(d, {wider} * max_distance)"} for wider in WIDER]),
    "gate_or_trimming": (0.3, 0.55, "A pair stays that passes the gate or the trimming; it has to "
        "pass both.", {"& overlap": "| overlap"}),
    "wide_delta": (0.65, 0.35, "Huber's δ is twice as large as asked: is δ doubled, or the "
        "residual halved?", {f"{WEIGHTS}delta": f"{WEIGHTS}2 * delta"}),
}
@question("The convergence test", points=5, answer=Answer.FLAG, chance=0.5,
    chapter="chapter 4, “When to stop”",
    task=r"""
Stop when any one of three things holds: the step is small in *both* translation
($\lVert\Delta\mathbf{t}\rVert < \varepsilon_t$) and rotation ($|\Delta\psi| < \varepsilon_\psi$);
the cost stands still ($|\Delta J| < \varepsilon_J$); the budget is spent ($k \ge k_{\max}$).
""", oracle=_has_converged, visible={
    "a tiny step": _ending(0.3, 0.3),
    "a long step": _ending(90.0, 90.0, cost=0.01),
    "no shift, but a turn to the left": _ending(0.1, 60.0),
    "a cost that stands still": _ending(90.0, 90.0, cost=1e-7),
    "a shift, but no turn": _ending(60.0, 0.1, cost=0.02),
    "no shift, but a turn to the right": _ending(0.1, -60.0),
    "the last iteration of the budget": _ending(90.0, 90.0, iteration=50),
    "the last but one iteration": _ending(90.0, 90.0, iteration=49),
    "a cost that fell by next to nothing": _ending(60.0, 60.0, cost=-1e-7),
    "a tiny step to the right": _ending(0.4, -0.4, cost=0.01),
}, hidden={
    "a step below both tolerances": _ending(0.6, 0.5),
    "a step below both, to the right": _ending(0.5, -0.6),
    "a step just below both tolerances": _ending(0.8, 0.8),
    "a cost that rose by next to nothing": _ending(80.0, 70.0, cost=2e-7),
    "a cost that fell by next to nothing": _ending(80.0, -70.0, cost=-2e-7),
    "the last iteration of the budget": _ending(80.0, 70.0, iteration=50),
    "an iteration past the budget": _ending(80.0, -70.0, iteration=51),
    "a cost that did not change": _ending(200.0, 150.0, cost=0.0),
    "a turn to the left without a shift": _ending(0.2, 60.0, cost=0.01),
    "a turn to the right without a shift": _ending(0.2, -60.0),
    "a turn of a few tolerances": _ending(0.2, 8.0),
    "a shift of a few tolerances": _ending(8.0, 0.2, cost=0.02),
    "a shift aslant": _ending(1.3, 0.2, heading=DIAGONAL),
    "a cost that fell much": _ending(40.0, 90.0, cost=-0.5),
    "the last but one iteration": _ending(80.0, 70.0, cost=0.01, iteration=49),
    "half a turn on the spot": _ending(0.2, -0.4, half_turn=True),
    "a shift exactly at its tolerance": _ending_at(1.0, 0.01),
    "a cost exactly at its tolerance": _ending_at(80.0, EPS_COST),
    "a cost just below its tolerance": _ending(70.0, 60.0, cost=8e-7),
    "a tiny step, a cost that stands still": _ending(0.3, -0.2, cost=1e-7),
}, mistakes={
    "any": (0.5, "One of the two pose tests is enough here; a scan that turns on the spot would "
        "stop the loop at once. Both must hold.",
        {"small_shift and": "small_shift or"}, ANY),
    "all": (0.5, "Pose and cost must both be still here; either of them ends the loop.",
        {"or abs(cost_change)": "and abs(cost_change)"}),
    "signed_turn": (0.9, "The angle keeps its sign: every turn to the right looks small.",
        {"small_turn = abs(": "small_turn = ("}),
    "signed_cost": (0.6, "The cost's change keeps its sign: every cost that falls ends the loop.",
        {"abs(cost_change)": "cost_change"}),
    "each_axis": (0.9, "Each axis is held against ε_t by itself; the test is on the length ‖Δt‖.",
        {"np.hypot(dT[0, 2], dT[1, 2])": "np.abs(dT[:2, 2]).max()"}),
    "squared_step": (0.7, "‖Δt‖² is held against ε_t; both are lengths in metres.",
        {" < eps_t": " ** 2 < eps_t"}),
    "degrees": (0.7, "The angle is in degrees here; ε_ψ is in radians.",
        {" < eps_psi": " * 180 / np.pi < eps_psi"}),
    "one_more": (0.9, "The budget is overdrawn by one: at k = k_max the loop ends.",
        {">= k_max": "> k_max"}),
    "one_less": (0.9, "The budget is cut by one: the loop ends at k = k_max, not before.",
        {">= k_max": ">= k_max - 1"}),
    "no_budget": (0.8, "The budget k_max is not looked at, so the loop may never end.",
        {" or iteration >= k_max": ""}),
    "budget_alone": (0.2, "Only the budget ends the loop: look at the step and the cost, too.",
        {"(small_shift and small_turn) or abs(cost_change) < eps_cost or ": ""}),
    "no_cost": (0.6, "The change of the cost is not looked at; a cost that stands still ends the "
        "loop, too.", {" or abs(cost_change) < eps_cost": ""}),
    "no_turn": (0.7, "The rotation is not looked at: a scan may turn on the spot.",
        {"small_shift and small_turn": "small_shift"}),
    "closed": (0.8, "A step or a change right at its tolerance is not small: it has to be below.",
        {"< eps_": "<= eps_"}),
    "sine": (0.9, "The sine is taken for the angle: at half a turn it is zero, too. Use arctan2.",
        {"np.arctan2(dT[1, 0], dT[0, 0])": "dT[1, 0]"}),
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
""", oracle=[_by_labkit, _of_gated],
    readings=READINGS, alike=turned, visible={
    "all stages at work": scans(20, 0.8, 0.7, 0.12),
    "the guess is no motion": from_no_motion,
    "the gate alone": scans(20, 0.6, 1.0, OFF),
    "trimming alone": scans(20, OFF, 0.7, OFF),
    "the weights alone": scans(20, OFF, 1.0, 0.1),
    "a pair on the gate": Exact(about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
    "a pair a little beyond a wide gate": about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
}, hidden={
    "the gate alone": scans(24, 0.6, 1.0, OFF),
    "the gate alone, in clutter": scans(30, 0.5, 1.0, OFF),
    "trimming alone": scans(24, OFF, 0.65, OFF),
    "the weights alone": scans(24, OFF, 1.0, 0.1),
    "all stages at work": scans(30, 0.45, 0.9, 0.1),
    "a guess far from no motion": scans(24, 0.5, 0.95, 0.15, turn=FAR),
    "a pair on the gate": Exact(about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
    "a pair a little beyond a wide gate": about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
}, mistakes={
    "update_on_the_right": (0.5, ON_THE_RIGHT, {UPDATE: "return T @ dT"}, LEFT),
    "increment_alone": (0.5, "This is the increment dT alone; the new transform is dT @ T.",
        {UPDATE: "return dT"}, LEFT),
    "translation_not_turned": (0.5, "The translations are added, t + Δt; it is ΔR t + Δt.",
        {UPDATE: f"dT[:2, 2] += T[:2, 2] - R @ T[:2, 2]\n    {UPDATE}"}, LEFT),
    "unmoved_source": (0.4, "The pairs are found at T, but the aligned points are not moved by T.",
        {"align_weighted(moved[kept]": "align_weighted(source[kept]"}, LEFT),
    "unmoved_pairs": (0.3, "The pairs are those of the unmoved points: move the source by T before "
        "you look for its neighbours.", {MOVED: "moved = source"}, LEFT),
    "sign_of_b": (0.5, "The increment turns the wrong way: in b = Σ w (x v − y u) the sign is "
        "lost, or R is transposed.", {"np.arctan2(b, a)": "np.arctan2(-b, a)"},
        "chapter 2, “In the plane: one `atan2`”"),
    "swapped": (0.4, "Source and target are swapped in the alignment: the step leads away.",
        {UPDATE: "return invert(dT) @ T"}),
    "strict_gate": (0.9, "A pair right on the gate is rejected: the gate is d <= d_max.",
        {GATE: "(d < max_distance)"}, STAGES),
    "worst_kept": (0.65, "Trimming keeps the worst pairs; it should keep the closest ones.",
        {"np.argsort(distances)": "np.argsort(-distances)"}, STAGES),
    **{id: (credit, *wrong, STAGES) for id, (credit, _, *wrong) in WRONG_STAGES.items()},
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
""", oracle=[_by_labkit, _of_gated],
    readings=READINGS, alike=turned, slack=stop_error, visible={
    "all stages at work": scans(20, 0.9, 0.8, 0.1, LOOP_BUDGET),
    "a guess far from no motion": whole_loop(20, 0.8, 0.8, 0.1),
    "a budget that ends the loop": scans(20, 1.5, 0.8, 0.1, 3, error=0.15),
    "a way straight ahead, without a turn": straight_ahead,
    "a turn on the spot, without a shift": on_the_spot,
    "a pair a little beyond a wide gate": LOOP_AT_THE_GATE,
}, hidden={
    "the gate alone": whole_loop(28, 0.45, 1.0, OFF),
    "trimming alone": whole_loop(24, OFF, 0.7, OFF),
    "the weights alone": whole_loop(24, OFF, 1.0, 0.1),
    "all stages at work": whole_loop(30, 0.5, 0.9, 0.1),
    "a guess far from no motion": whole_loop(24, 0.6, 1.0, 0.15),
    "a budget that ends the loop": scans(24, 1.5, 0.8, 0.1, 3, error=0.15),
    "a small budget that ends the loop": scans(24, 1.2, 0.9, 0.1, 2, error=0.12),
    "five pairs": whole_loop(5, 2.0, 0.85, 0.1),
    "walls along which each step slides a little": walls,
    "a way straight ahead, without a turn": straight_ahead,
    "a turn on the spot, without a shift": on_the_spot,
    "a pair a little beyond a wide gate": LOOP_AT_THE_GATE,
}, mistakes={
    "update_on_the_right": (0.4, ON_THE_RIGHT, {UPDATE: "return T @ dT"}, LEFT),
    "one_step": (0.05, "This is where one step leads; go on until a step is below the tolerances.",
        {"range(max_iterations)": "range(1)"}),
    "last_increment": (0.4, "This is the last increment alone; the steps have to be chained.",
        {RESULT: "break\n    return dT"}),
    "pairs_found_once": (0.5, "The pairs are found once; each iteration has to find them anew.",
        {"T = T_init": "global T_first\n    T = T_first = T_init",
         SEARCH: "nearest_neighbors(source @ T_first[:2, :2].T + T_first[:2, 2], target)",
         ALIGNED: f"    d = np.linalg.norm(moved - target[indices], axis=1)\n{ALIGNED}"}),
    "guess_ignored": (0.5, "The initial guess is not used: the loop starts from no motion.",
        {"T = T_init": "T = np.eye(3)"}, "chapter 4, “The basin of convergence”"),
    "guess_lost": (0.6, "This is the motion since the guess, which is a part of the answer.",
        {RESULT: "break\n    return T @ invert(T_init)"}),
    **{id: (credit, *wrong, STAGES) for id, (_, credit, *wrong) in WRONG_STAGES.items()},
    "budget_ignored": (0.85, "Another budget ends the loop: take at most `max_iterations` steps.",
        [{BUDGET: f"range({most})"} for most in (10, 20, 200)]),
    "one_less": (0.85, "A step of the budget is lost, or the transform before the last returned.",
        {BUDGET: "range(max_iterations - 1)"}),
    "one_more": (0.85, "The budget is overdrawn by one step.",
        {BUDGET: "range(max_iterations + 1)"}),
    "stops_early": (0.85, "The loop stops while it still moves: go on until a step is below 1e-6.",
        [{STOP: f"{SHIFT} < {e} and {TURN} < {e}"} for e in (1e-4, 1e-3, 1e-2)], WHEN),
    "loose_translation": (0.95, "The loop stops while it shifts: that, too, is to be below 1e-6.",
        [{STOP: f"{SHIFT} < {e} and {TURN} < 1e-6"} for e in (1e-3, 1e-2)], WHEN),
    "loose_rotation": (0.95, "The loop stops while it turns: that, too, is to be below 1e-6.",
        [{STOP: f"{SHIFT} < 1e-6 and {TURN} < {e}"} for e in (1e-3, 1e-2)], WHEN),
    "no_rotation_test": (0.95, "Only the translation is tested: a scan may still turn on the spot.",
        {STOP: f"{SHIFT} < 1e-6"}, WHEN),
    "no_translation_test": (0.95, "Only the rotation is tested: a scan may still shift without it.",
        {STOP: f"{TURN} < 1e-6"}, WHEN),
    "rmse_change": (0.95, "The loop stops where the RMSE hardly changes; a scan may still slide.",
        [{"T = T_init": "T, rmse = T_init, np.inf",
          "dT = T @ invert(T_before)": f"last, rmse = rmse, {RMSE}",
          STOP: f"abs(last - rmse) < {e}"} for e in (1e-6, 1e-5)], WHEN),
    "any": (0.85, "The loop stops when the translation or the rotation is small: both have to be.",
        {STOP: f"{SHIFT} < 1e-6 or {TURN} < 1e-6"}, WHEN),
    "gives_up": (0.95, "The loop ends where too few pairs are left; three are enough.",
        [{ALIGNED: f"    if kept.sum() < {least}:\n        return T\n{ALIGNED}"}
         for least in (6, 10)]),
    "composed_again": (0.4, "The result of a step is composed with the transform once more; it is "
        "the new transform already.",
        [{STEP: f"{STEP} @ T"}, {STEP: STEP.replace("icp", "T @ icp")}], LEFT),
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
