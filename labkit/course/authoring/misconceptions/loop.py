"""Mistakes in one step of ICP and in the whole loop, each in both readings of the trimming."""

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistakes
from labkit.course.authoring.references import READINGS

LEFT = "chapter 4, “The flow chart, line by line”"
STAGES = "chapter 3, “Each remedy by itself”"


def both(function):
    """The mistake in each reading of gate and trimming."""
    return lambda *arguments: Several(tuple(function(*arguments, keep=keep) for keep in READINGS))


def left(dT, T):
    return dT @ T


def huber(d, delta):
    return right.huber_weights(d, delta)


def step(source, target, T, gate, ratio, delta, keep, *, weigh=huber, update=left):
    """The right step, but for the stages that are handed in."""
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    dT = aligned(moved[kept], target[indices[kept]], weigh(d[kept], delta))
    return update(dT, T)


def aligned(p, q, w):
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = right.align_weighted(p, q, w)
    return T


def _keep_worst(d, gate, ratio, keep):
    """Trim the closest pairs; of those within the gate, in either reading."""
    if keep is READINGS[0]:
        return (d <= gate) & right.overlap(-d, ratio)
    kept = d <= gate
    kept[kept] = right.overlap(-d[kept], ratio)
    return kept


def _add_translation(dT, T):
    added = dT @ T
    added[:2, 2] = T[:2, 2] + dT[:2, 2]
    return added


def right_step(source, target, T, *settings, keep):
    """The right step, in one of the readings."""
    return step(source, target, T, *settings, keep)


def _unmoved(source, target, T, gate, ratio, delta, *, keep):
    """The pairs at T, but the points as they came."""
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    return aligned(source[kept], target[indices[kept]], huber(d[kept], delta)) @ T


def _sign_of_b(source, target, T, gate, ratio, delta, *, keep):
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    p, q, w = moved[kept], target[indices[kept]], huber(d[kept], delta)
    dT = aligned(p, q, w)
    dT[:2, :2] = dT[:2, :2].T
    dT[:2, 2] = (w @ q - dT[:2, :2] @ (w @ p)) / w.sum()
    return dT @ T


STEPS = {
    "update_on_the_right": lambda *a, keep: step(*a, keep, update=lambda dT, T: T @ dT),
    "no_weights": lambda *a, keep: step(*a, keep, weigh=lambda d, delta: np.ones(len(d))),
    "weights_of_squares": lambda *a, keep: step(
        *a, keep, weigh=lambda d, delta: huber(d**2, delta)
    ),
    "gate_on_squares": lambda *a, keep: step(
        *a, lambda d, gate, ratio: keep(d, np.sqrt(gate), ratio)
    ),
    "no_gate": lambda *a, keep: step(*a, lambda d, gate, ratio: right.overlap(d, ratio)),
    "no_trimming": lambda *a, keep: step(*a, lambda d, gate, ratio: d <= gate),
}


# fmt: off
mistakes("icp_step", {
    "update_on_the_right": (0.5, "The increment is composed on the right, T @ dT: it acts on "
        "points that T has moved already, so it belongs on the left, dT @ T.",
        both(STEPS["update_on_the_right"]), LEFT),
    "increment_alone": (0.5, "This is the increment dT alone; the new transform is dT @ T.",
        both(lambda *a, keep: step(*a, keep, update=lambda dT, T: dT)), LEFT),
    "translation_not_turned": (0.5,
        "The translations are added, t + Δt; the increment turns the old one: ΔR t + Δt.",
        both(lambda *a, keep: step(*a, keep, update=_add_translation)), LEFT),
    "unmoved_source": (0.4,
        "The pairs are found at T, but the points that are aligned have not been moved by T.",
        both(_unmoved), LEFT),
    "unmoved_pairs": (0.3, "The pairs are those of the unmoved points: move the source by T before "
        "you look for its neighbours.",
        both(lambda p, q, T, *rest, keep: step(p, q, np.eye(3), *rest, keep) @ T), LEFT),
    "sign_of_b": (0.5, "The increment turns the wrong way: in b = Σ w (x v − y u) the sign is "
        "lost, or R is transposed.", both(_sign_of_b), "chapter 2, “In the plane: one `atan2`”"),
    "swapped": (0.4,
        "Source and target are swapped in the alignment: the step leads away from the target.",
        both(lambda *a, keep: step(*a, keep, update=lambda dT, T: right.invert(dT) @ T))),
    "no_weights": (0.65, "Huber's weights are not used in the alignment.",
        both(STEPS["no_weights"]), STAGES),
    "weights_of_squares": (0.65,
        "Huber's weights are taken of squared distances; they take distances in metres.",
        both(STEPS["weights_of_squares"]), STAGES),
    "gate_on_squares": (0.6, "The gate is held against squared distances; both are in metres.",
        both(STEPS["gate_on_squares"]), STAGES),
    "no_gate": (0.6, "The distance gate is not applied.", both(STEPS["no_gate"]), STAGES),
    "strict_gate": (0.9, "A pair right on the gate is rejected: the gate is d <= d_max.",
        both(lambda *a, keep: step(
            *a, lambda d, gate, ratio: keep(d, np.nextafter(gate, 0.0), ratio))), STAGES),
    "no_trimming": (0.9, "The trimming is not applied: all pairs within the gate are aligned.",
        both(STEPS["no_trimming"]), STAGES),
    "worst_kept": (0.65, "Trimming keeps the worst pairs; it should keep the closest ones.",
        both(lambda *a, keep: step(*a, lambda *d: _keep_worst(*d, keep=keep))), STAGES),
})
# fmt: on


def _loop(one_step, source, target, T, *rest, keep):
    *settings, iterations = rest
    for _ in range(iterations):
        T_before, T = T, one_step(source, target, T, *settings, keep=keep)
        if np.abs(T - T_before).max() < 1e-13:
            break
    return T


def right_loop(*arguments, keep):
    path = right_path(*arguments[:-1], keep=keep)
    return path[min(arguments[-1], len(path) - 1)][0]


def right_path(source, target, T, *settings, keep):
    """Each transform of the right loop with the distances at it, until nothing moves any more."""
    key = (source.tobytes(), target.tobytes(), T.tobytes(), settings, keep)
    if key not in PATHS:
        if len(PATHS) > 4:
            PATHS.clear()
        path = []
        for _ in range(500):
            moved = source @ T[:2, :2].T + T[:2, 2]
            path.append((T, right.nearest_neighbors(moved, target)[1]))
            if len(path) > 1 and np.abs(T - path[-2][0]).max() < 1e-13:
                break
            T = right_step(source, target, T, *settings, keep=keep)
        PATHS[key] = path
    return PATHS[key]


PATHS = {}


def _last_increment(*arguments, keep):
    T = right_loop(*arguments, keep=keep)
    return step(*arguments[:2], T, *arguments[3:-1], keep, update=lambda dT, _: dT)


def _pairs_found_once(source, target, T, gate, ratio, delta, iterations, *, keep):
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    p, q = source[kept], target[indices[kept]]
    for _ in range(iterations):
        moved = p @ T[:2, :2].T + T[:2, 2]
        d = np.linalg.norm(moved - q, axis=1)
        T = aligned(moved, q, huber(d, delta)) @ T
    return T


def _steps(name):
    return both(lambda *arguments, keep: _loop(STEPS[name], *arguments, keep=keep))


# fmt: off
mistakes("icp", {
    "update_on_the_right": (0.4, "The increment is composed on the right, T @ dT: it acts on "
        "points that T has moved already, so it belongs on the left, dT @ T.",
        _steps("update_on_the_right"), LEFT),
    "one_step": (0.05,
        "This is where one step leads; go on until the step is below the tolerances.",
        both(lambda *a, keep: step(*a[:-1], keep))),
    "last_increment": (0.4,
        "This is the last increment alone, next to the identity; the steps have to be chained.",
        both(_last_increment)),
    "pairs_found_once": (0.5,
        "The pairs are found once, before the loop; each iteration has to find them anew.",
        both(_pairs_found_once)),
    "guess_ignored": (0.5, "The initial guess is not used: the loop starts from no motion.",
        both(lambda p, q, T, *a, keep: right_loop(p, q, np.eye(3), *a, keep=keep)),
        "chapter 4, “The basin of convergence”"),
    "guess_lost": (0.6,
        "The result is the motion since the initial guess; the guess is a part of the answer.",
        both(lambda p, q, T, *a, keep: right_loop(p, q, T, *a, keep=keep) @ right.invert(T))),
    "inverse": (0.6, "This is the inverse: it maps the target onto the source.",
        both(lambda *a, keep: right.invert(right_loop(*a, keep=keep)))),
    "no_weights": (0.6, "Huber's weights are not used in the alignment.",
        _steps("no_weights"), STAGES),
    "weights_of_squares": (0.6,
        "Huber's weights are taken of squared distances; they take distances in metres.",
        _steps("weights_of_squares"), STAGES),
    "gate_on_squares": (0.95, "The gate is held against squared distances; both are in metres.",
        _steps("gate_on_squares"), STAGES),
    "no_gate": (0.85, "The distance gate is not applied.", _steps("no_gate"), STAGES),
    "no_trimming": (0.75, "The trimming is not applied: all pairs within the gate are aligned.",
        _steps("no_trimming"), STAGES),
})
