"""Mistakes in one step of ICP and in the whole loop, each in both readings of the trimming."""

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes
from labkit.course.authoring.references import READINGS, STANDSTILL, aligned, loop, paired, step

LEFT = "chapter 4, “The flow chart, line by line”"
STAGES = "chapter 3, “Each remedy by itself”"
ON_THE_RIGHT = (
    "The increment is composed on the right, T @ dT: it acts on points that T has moved already, "
    "so it belongs on the left, dT @ T."
)


def both(function):
    """The mistake in each reading of gate and trimming."""
    return lambda *arguments: [function(*arguments, keep=keep) for keep in READINGS]


def stepped(**stages):
    """The right step, but for a stage."""
    return lambda *arguments, keep: step(*arguments, keep, **stages)


def kept(change):
    """The right step, but for the pairs that are kept: `change` takes d, gate, ratio and keep."""
    return lambda *arguments, keep: step(*arguments, lambda *limits: change(*limits, keep))


def _worst(d, gate, ratio, keep):
    """Trim the closest pairs; of those within the gate, in either reading."""
    if keep is READINGS[0]:
        return (d <= gate) & right.overlap(-d, ratio)
    inside = d <= gate
    inside[inside] = right.overlap(-d[inside], ratio)
    return inside


def _add_translation(dT, T):
    added = dT @ T
    added[:2, 2] = T[:2, 2] + dT[:2, 2]
    return added


def _unmoved(p, q, T, gate, ratio, delta, *, keep):
    """The pairs at T, but the points as they came."""
    _, matched, d, stays = paired(p, q, T, gate, ratio, keep=keep)
    return aligned(p[stays], matched, right.huber_weights(d, delta)) @ T


def _sign_of_b(p, q, T, gate, ratio, delta, *, keep):
    moved, matched, d, _ = paired(p, q, T, gate, ratio, keep=keep)
    w = right.huber_weights(d, delta)
    dT = aligned(moved, matched, w)
    dT[:2, :2] = dT[:2, :2].T
    dT[:2, 2] = (w @ matched - dT[:2, :2] @ (w @ moved)) / w.sum()
    return dT @ T


STEPS = {
    "update_on_the_right": stepped(update=lambda dT, T: T @ dT),
    "no_weights": stepped(weigh=lambda d, delta: np.ones(len(d))),
    "weights_of_squares": stepped(weigh=lambda d, delta: right.huber_weights(d**2, delta)),
    "gate_on_squares": kept(lambda d, gate, ratio, keep: keep(d, np.sqrt(gate), ratio)),
    "wide_gate": kept(lambda d, gate, ratio, keep: keep(d, 2 * gate, ratio)),
    "gate_or_trimming": kept(lambda d, gate, ratio, keep: (d <= gate) | right.overlap(d, ratio)),
    "wide_delta": stepped(weigh=lambda d, delta: right.huber_weights(d, 2 * delta)),
    "no_gate": kept(lambda d, gate, ratio, keep: right.overlap(d, ratio)),
    "no_trimming": kept(lambda d, gate, ratio, keep: d <= gate),
}
SAID = {  # of a stage in a step, and in the whole loop
    "no_weights": "Huber's weights are not used in the alignment.",
    "weights_of_squares":
        "Huber's weights are taken of squared distances; they take distances in metres.",
    "gate_on_squares": "The gate is held against squared distances; both are in metres.",
    "wide_gate": "The gate is too wide, as if doubled: no pair beyond `max_distance` stays.",
    "no_gate": "The distance gate is not applied.",
    "gate_or_trimming": "A pair stays that passes the gate or the trimming; it has to pass both.",
    "wide_delta": "Huber's δ is twice as large as asked: is δ doubled, or the residual halved?",
    "no_trimming": "The trimming is not applied: all pairs within the gate are aligned.",
}  # fmt: skip


def _stages(function, credits):
    """The mistakes in one stage, as the step or the whole loop makes them, with their credits."""
    return {id: (credit, SAID[id], both(function(STEPS[id])), STAGES)
            for id, credit in credits.items()}  # fmt: skip


# fmt: off
mistakes("icp_step", {
    "update_on_the_right": (0.5, ON_THE_RIGHT, both(STEPS["update_on_the_right"]), LEFT),
    "increment_alone": (0.5, "This is the increment dT alone; the new transform is dT @ T.",
        both(stepped(update=lambda dT, T: dT)), LEFT),
    "translation_not_turned": (0.5, "The translations are added, t + Δt; it is ΔR t + Δt.",
        both(stepped(update=_add_translation)), LEFT),
    "unmoved_source": (0.4, "The pairs are found at T, but the aligned points are not moved by T.",
        both(_unmoved), LEFT),
    "unmoved_pairs": (0.3, "The pairs are those of the unmoved points: move the source by T before "
        "you look for its neighbours.",
        both(lambda p, q, T, *rest, keep: step(p, q, np.eye(3), *rest, keep) @ T), LEFT),
    "sign_of_b": (0.5, "The increment turns the wrong way: in b = Σ w (x v − y u) the sign is "
        "lost, or R is transposed.", both(_sign_of_b), "chapter 2, “In the plane: one `atan2`”"),
    "swapped": (0.4, "Source and target are swapped in the alignment: the step leads away.",
        both(stepped(update=lambda dT, T: right.invert(dT) @ T))),
    "strict_gate": (0.9, "A pair right on the gate is rejected: the gate is d <= d_max.",
        both(kept(lambda d, gate, ratio, keep: keep(d, np.nextafter(gate, 0.0), ratio))), STAGES),
    "worst_kept": (0.65, "Trimming keeps the worst pairs; it should keep the closest ones.",
        both(kept(_worst)), STAGES),
    **_stages(lambda one_step: one_step, {
        "no_weights": 0.65, "weights_of_squares": 0.65, "gate_on_squares": 0.6, "no_gate": 0.6,
        "no_trimming": 0.9, "wide_gate": 0.65, "gate_or_trimming": 0.3, "wide_delta": 0.65}),
})


def _looped(one_step):
    """The whole loop of another step."""

    def icp(p, q, T, *settings, keep):
        *stages, iterations = settings
        for _ in range(iterations):
            T_before, T = T, one_step(p, q, T, *stages, keep=keep)
            if np.abs(T - T_before).max() < STANDSTILL:
                break
        return T

    return icp


def _last_increment(*arguments, keep):
    T = loop(*arguments, keep=keep)
    return step(*arguments[:2], T, *arguments[3:-1], keep, update=lambda dT, _: dT)


def _pairs_found_once(p, q, T, gate, ratio, delta, iterations, *, keep):
    _, matched, _, stays = paired(p, q, T, gate, ratio, keep=keep)
    for _ in range(iterations):
        moved = p[stays] @ T[:2, :2].T + T[:2, 2]
        d = np.linalg.norm(moved - matched, axis=1)
        T = aligned(moved, matched, right.huber_weights(d, delta)) @ T
    return T


mistakes("icp", {
    "update_on_the_right": (0.4, ON_THE_RIGHT, both(_looped(STEPS["update_on_the_right"])), LEFT),
    "one_step": (0.05, "This is where one step leads; go on until a step is below the tolerances.",
        both(lambda *a, keep: step(*a[:-1], keep))),
    "last_increment": (0.4, "This is the last increment alone; the steps have to be chained.",
        both(_last_increment)),
    "pairs_found_once": (0.5, "The pairs are found once; each iteration has to find them anew.",
        both(_pairs_found_once)),
    "guess_ignored": (0.5, "The initial guess is not used: the loop starts from no motion.",
        both(lambda p, q, T, *a, keep: loop(p, q, np.eye(3), *a, keep=keep)),
        "chapter 4, “The basin of convergence”"),
    "guess_lost": (0.6, "This is the motion since the guess, which is a part of the answer.",
        both(lambda p, q, T, *a, keep: loop(p, q, T, *a, keep=keep) @ right.invert(T))),
    "inverse": (0.6, "This is the inverse: it maps the target onto the source.",
        both(lambda *a, keep: right.invert(loop(*a, keep=keep)))),
    **_stages(_looped, {
        "no_weights": 0.6, "weights_of_squares": 0.6, "gate_on_squares": 0.95, "no_gate": 0.85,
        "no_trimming": 0.75, "wide_gate": 0.95, "gate_or_trimming": 0.55, "wide_delta": 0.3}),
})
