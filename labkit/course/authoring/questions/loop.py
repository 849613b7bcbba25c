"""A step of ICP and the loop: scans that overlap in part."""

from __future__ import annotations

from typing import Any

import numpy as np

import labkit
from labkit.course.authoring.entries import Exact, question
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
from labkit.course.authoring.questions.stopping import WHEN
from labkit.course.exercises.entries import ENTRIES
from labkit.grading.questions import Answer

OFF = 50.0  # m: a gate or a δ that does nothing
EARLY = 1e-5  # m and rad, where the oracles stop: 1e-6 is asked for, this is no mistake

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


LOOP_AT_THE_GATE = about_the_gate([-0.1, 0.05], 2.0, 1.0, 0.02, LOOP_BUDGET, apart=0.02)


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
        "weights of those that gate and trimming leave, which reject the same pairs":
            about_the_gate([2.5, 2.6], 2.0, 0.75, 0.3),
    },
    "the update": {
        "no stage at work": scans(24, OFF, 1.0, OFF, turn=FAR),
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
            scans(24, OFF, 1.0, OFF, 3, turn=FAR, error=0.15),
        "a budget that ends the loop": scans(24, OFF, 1.0, OFF, 2, error=0.15),
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
    max_distance, overlap_ratio, delta: as for one step; max_iterations: int, the most steps.
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
