"""The convergence test, a step of ICP and the loop: scans that overlap in part."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Arguments, Draw, Exact, Rng, question, readings, recipe
from labkit.course.authoring.references import apart, path
from labkit.support.arrays import FloatArray

EPS_T, EPS_PSI, EPS_COST, K_MAX = 1e-3, 1e-3, 1e-6, 50  # of the convergence test
DIAGONAL = math.pi / 4
LOOP_BUDGET = 60
CORNERS = np.array([[0, 0], [8, 0], [16, 2], [2, 10], [12, 12], [-8, 6], [-20, -20]])
FAR = 1.0  # rad: at less than 60° an update on the wrong side slows down; it does not diverge
OFF = 50.0  # m: a gate or a δ that does nothing

ANY = "the errata, “Convergence: any test, or both?”"
WHEN = "chapter 4, “When to stop”"
LEFT = "chapter 4, “The flow chart, line by line”"
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
STOP = f"{SHIFT} < 1e-7 and {TURN} < 1e-7"
BUDGET = "range(max_iterations)"
STEP = "T, icp_step(source, target, T, max_distance, overlap_ratio, delta)"
WIDER = (2, 1.2, 1.3, 1.4, 1.5, 1.65, 1.8, 2.3, 2.6, 3)
RMSE = "np.sqrt(np.mean(nearest_neighbors(source @ T[:2, :2].T + T[:2, 2], target)[1] ** 2))"


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


@recipe
def _scans(
    rng: Rng, count: int, *limits: float, turn: float = 0.1, error: float = 0.05
) -> Arguments:
    """Two scans of the same posts, each with some that the other does not see.

    The `limits` are the gate [m], the share to keep, Huber's δ [m], and of the whole loop the
    budget. `turn` [rad] is the size of the true rotation, `error` [rad, and thrice it in m] that of
    the guess. Posts that moved a little between the scans keep Huber's weights at work.
    """
    x, y, side, other = rng.choice([-1.0, 1.0], 4)
    T = labkit.transform(0.4 * x, 0.4 * y, side * turn * rng.number(0.95, 1.03))
    posts = rng.points(count, 5.0)
    shifted = posts + rng.normal(0.0, 0.01, posts.shape)
    some = rng.permutation(count)[: count // 4]
    shifted[some] += rng.normal(0.0, 0.15, (len(some), 2)) + 0.1
    source = np.vstack([_back(T, shifted), rng.points(count // 5, 6.0)])
    target = np.vstack([posts, rng.points(3, 6.0)])
    away = other * error * rng.number(0.8, 1.2)
    guess = labkit.transform(3.0 * away, -2.0 * away, away) @ T
    return np.round(source, 3), np.round(target, 3), guess, *limits


def _back(T: FloatArray, q: FloatArray) -> FloatArray:
    """The points before the motion T."""
    return labkit.apply(labkit.invert(T), q)


def _loop(count: int, *limits: float) -> Draw:
    """The whole loop from a guess far from no motion, with a budget that is enough."""
    return _scans(count, *limits, LOOP_BUDGET, turn=FAR)


def _from_no_motion(rng: Rng) -> Arguments:
    source, target, _, *limits = _scans(16, 1.2, 0.8, 0.15, turn=0.03)(rng)
    return source, target, np.eye(3), *limits


def _walls(rng: Rng) -> Arguments:
    """Dense walls about a corner: each step slides a little, and the last ones are short."""
    along, across = np.arange(0.0, 3.6, 0.24), np.arange(0.2, 2.4, 0.22)

    def look() -> FloatArray:
        x = np.append(along + rng.uniform(0.0, 0.1), np.full(len(across), 3.6))
        y = np.append(np.zeros(len(along)), across + rng.uniform(0.0, 0.1))
        return np.column_stack([x, y]) + rng.normal(0.0, 0.012, (len(x), 2))

    T = labkit.transform(rng.number(-0.5, 0.5), rng.number(-0.5, 0.5), rng.number(0.97, 1.02))
    guess = labkit.transform(rng.number(0.15, 0.3), rng.number(-0.2, -0.1), 0.06) @ T
    scans = np.round(_back(T, look()), 3), np.round(look(), 3)
    return *scans, guess, 1.5, 0.9, 0.05, 2 * LOOP_BUDGET


def _straight_ahead(rng: Rng) -> Arguments:
    """A scene with two equal sides and a guess that is off straight ahead: no step turns."""
    side = np.column_stack([rng.permutation(np.arange(-6.0, 6.0, 1.2)), rng.uniform(1.0, 4.0, 10)])
    moved = side + np.column_stack([rng.normal(0.0, 0.15, 10), np.zeros(10)])
    posts, seen = (np.round(np.vstack([one, one * (1.0, -1.0)]), 3) for one in (side, moved))
    ahead = labkit.transform(rng.number(0.2, 0.5), 0.0, 0.0)
    lonely = posts[[0, 10]] + [(0.0, 60.0), (0.0, -60.0)]  # beyond the gate, and heavy in an RMSE
    guess = labkit.transform(rng.number(0.7, 0.9), 0.0, 0.0) @ ahead
    source = np.round(_back(ahead, np.vstack([seen, lonely])), 6)
    return source, posts, guess, 3.0, 1.0, 0.02, 2 * LOOP_BUDGET


def _on_the_spot(rng: Rng) -> Arguments:
    """A scene that looks the same from behind, and a guess that is turned: no step shifts.

    It is drawn until twenty steps do not lead to the end.
    """
    while True:
        angle, far = rng.permutation(np.arange(10) * 0.31), rng.uniform(2.0, 5.0, 10)
        T = labkit.transform(0.0, 0.0, rng.number(0.3, 0.5))
        guess = labkit.transform(0.0, 0.0, rng.number(0.1, 0.15)) @ T
        half, seen = (
            np.column_stack([far * np.cos(one), far * np.sin(one)])
            for one in (angle, angle + rng.normal(0.0, 0.15, 10))
        )
        source, posts = np.round(_back(T, seen), 6), np.round(half, 6)
        both = np.vstack([source, -source]), np.vstack([posts, -posts])
        arguments = (*both, guess, 3.0, 1.0, 0.05, 2 * LOOP_BUDGET)
        found = path(readings("icp_step")[0], *arguments)
        if apart(found[min(20, len(found) - 1)], found[-1]) > 3e-4:
            return arguments


@recipe
def _about_the_gate(
    rng: Rng, beyond: list[float], gate: float, *limits: float, apart: float = 0.25
) -> Arguments:
    """Pairs that are some `apart` [m], and others that lie so far `beyond` the gate, or on it."""
    target = CORNERS[: 5 + len(beyond)]
    target = gate * (target + rng.integers(-4, 5, target.shape) / 4)
    source = target.copy()
    source[:5] += apart * np.array([[1, 0], [0, 1], [1, 1], [-1, 2], [2, 1]])
    source[5:, 1] -= gate + np.array(beyond)
    return source, target, np.eye(3), gate, *limits


LOOP_AT_THE_GATE = _about_the_gate([0.05, 6.0], 2.0, 1.0, 0.02, LOOP_BUDGET, apart=0.02)

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
question("has_converged", visible={
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
    "a shift without a turn": _ending(300.0, 0.2),
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
    "inverted": (0.0, "True and False are swapped: True means to stop.",
        lambda *arguments: not right.has_converged(*arguments)),
    "always": (0.0, "It says True whatever it is given.", lambda *arguments: True),
    "never": (0.0, "It says False whatever it is given.", lambda *arguments: False),
})
question("icp_step", visible={
    "all stages at work": _scans(20, 0.8, 0.7, 0.12),
    "the guess is no motion": _from_no_motion,
    "the gate alone": _scans(20, 0.6, 1.0, OFF),
    "trimming alone": _scans(20, OFF, 0.7, OFF),
    "the weights alone": _scans(20, OFF, 1.0, 0.1),
    "a pair on the gate": Exact(_about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
    "a pair a little beyond a wide gate": _about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
}, hidden={
    "the gate alone": _scans(24, 0.6, 1.0, OFF),
    "the gate alone, in clutter": _scans(30, 0.5, 1.0, OFF),
    "trimming alone": _scans(24, OFF, 0.65, OFF),
    "the weights alone": _scans(24, OFF, 1.0, 0.1),
    "all stages at work": _scans(30, 0.45, 0.9, 0.1),
    "a guess far from no motion": _scans(24, 0.5, 0.95, 0.15, turn=FAR),
    "a pair on the gate": Exact(_about_the_gate([0.0], 0.5, 1.0, 10.0, apart=0.0625)),
    "a pair a little beyond a wide gate": _about_the_gate([0.0005, 6.0], 2.0, 1.0, 10.0),
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
question("icp", visible={
    "all stages at work": _scans(20, 0.9, 0.8, 0.1, LOOP_BUDGET),
    "a guess far from no motion": _loop(20, 0.8, 0.8, 0.1),
    "a budget that ends the loop": _scans(20, 1.5, 0.8, 0.1, 3, error=0.15),
    "a way straight ahead, without a turn": _straight_ahead,
    "a turn on the spot, without a shift": _on_the_spot,
    "a pair a little beyond a wide gate": LOOP_AT_THE_GATE,
}, hidden={
    "the gate alone": _loop(28, 0.45, 1.0, OFF),
    "trimming alone": _loop(24, OFF, 0.7, OFF),
    "the weights alone": _loop(24, OFF, 1.0, 0.1),
    "all stages at work": _loop(30, 0.5, 0.9, 0.1),
    "a guess far from no motion": _loop(24, 0.6, 1.0, 0.15),
    "a budget that ends the loop": _scans(24, 1.5, 0.8, 0.1, 3, error=0.15),
    "a small budget that ends the loop": _scans(24, 1.2, 0.9, 0.1, 2, error=0.12),
    "five pairs": _loop(5, 2.0, 0.85, 0.1),
    "walls along which each step slides a little": _walls,
    "a way straight ahead, without a turn": _straight_ahead,
    "a turn on the spot, without a shift": _on_the_spot,
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
    "inverse": (0.6, "This is the inverse: it maps the target onto the source.",
        {RESULT: "break\n    return invert(T)"}),
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
