"""Mistakes in the convergence test, in one step of ICP and in the whole loop."""

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes

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

# fmt: off
mistakes("has_converged", {
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

WRONG_STAGES = {  # in a step, and in the whole loop
    "no_weights": ("Huber's weights are not used in the alignment.",
        {f"{WEIGHTS}delta)": "np.ones(kept.sum())"}),
    "weights_of_squares": ("Huber's weights are taken of squared distances; they take distances in "
        "metres.", {WEIGHTS: "huber_weights(d[kept] ** 2, "}),
    "gate_on_squares": ("The gate is held against squared distances; both are in metres.",
        {GATE: "distance_gate(d**2, max_distance)"}),
    "no_gate": ("The distance gate is not applied.", {GATE: "distance_gate(d, np.inf)"}),
    "no_trimming": ("The trimming is not applied: all pairs within the gate are aligned.",
        {" & overlap(d, overlap_ratio)": ""}),
    "wide_gate": ("The gate is too wide, as if doubled: no pair beyond `max_distance` stays.",
        [{GATE: f"distance_gate(d, {wider} * max_distance)"} for wider in WIDER]),
    "gate_or_trimming": ("A pair stays that passes the gate or the trimming; it has to pass both.",
        {"& overlap": "| overlap"}),
    "wide_delta": ("Huber's δ is twice as large as asked: is δ doubled, or the residual halved?",
        {f"{WEIGHTS}delta": f"{WEIGHTS}2 * delta"}),
}


def _in_stages(credits):
    """The mistakes in a stage, with the credits that they earn in a question."""
    return {id: (credit, *WRONG_STAGES[id], STAGES) for id, credit in credits.items()}


mistakes("icp_step", {
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
    **_in_stages({
        "no_weights": 0.65, "weights_of_squares": 0.65, "gate_on_squares": 0.65, "no_gate": 0.6,
        "no_trimming": 0.9, "wide_gate": 0.65, "gate_or_trimming": 0.3, "wide_delta": 0.65}),
})
mistakes("icp", {
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
    **_in_stages({
        "no_weights": 0.6, "weights_of_squares": 0.6, "gate_on_squares": 0.95, "no_gate": 0.85,
        "no_trimming": 0.75, "wide_gate": 0.85, "gate_or_trimming": 0.55, "wide_delta": 0.35}),
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
