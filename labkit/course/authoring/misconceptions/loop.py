"""Mistakes in one step of ICP and in the whole loop, each in both readings of the trimming."""

import functools

import numpy as np

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import Several, mistake
from labkit.course.authoring.references import READINGS

LEFT = "chapter 4, “The flow chart, line by line”"
STAGES = "chapter 3, “Each stage by itself”"


def either(question, credit, chapter=""):
    """Enter a mistake in each reading of gate and trimming; the function itself stays."""

    def entered(function):
        @functools.wraps(function)
        def answers(*arguments):
            return Several(tuple(function(*arguments, keep=keep) for keep in READINGS))

        mistake(question, credit, chapter)(answers)
        return function

    return entered


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


def _gate_on_squares(d, gate, ratio, keep):
    """A gate on squared distances in either reading: the gate is its root, in metres."""
    return keep(d, np.sqrt(gate), ratio)


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


_SEEN = {}


def right_step(source, target, T, *settings, keep):
    """The right step; many mistakes go the same way, so each step is computed once."""
    key = (source.tobytes(), target.tobytes(), T.tobytes(), settings, keep)
    if key not in _SEEN:
        if len(_SEEN) > 20_000:
            _SEEN.clear()
        _SEEN[key] = step(source, target, T, *settings, keep)
    return _SEEN[key]


@either("icp_step", credit=0.5, chapter=LEFT)
def icp_step__update_on_the_right(*arguments, keep):
    """The increment is composed on the right, T @ dT: it acts on points that T has moved
    already, so it belongs on the left, dT @ T."""
    return step(*arguments, keep, update=lambda dT, T: T @ dT)


@either("icp_step", credit=0.5, chapter=LEFT)
def icp_step__increment_alone(*arguments, keep):
    """This is the increment dT alone; the new transform is dT @ T."""
    return step(*arguments, keep, update=lambda dT, T: dT)


@either("icp_step", credit=0.5, chapter=LEFT)
def icp_step__translation_not_turned(*arguments, keep):
    """The translations are added, t + Δt; the increment turns the old one: ΔR t + Δt."""
    return step(*arguments, keep, update=_add_translation)


@either("icp_step", credit=0.4, chapter=LEFT)
def icp_step__unmoved_source(source, target, T, gate, ratio, delta, *, keep):
    """The pairs are found at T, but the points that are aligned have not been moved by T."""
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    return aligned(source[kept], target[indices[kept]], huber(d[kept], delta)) @ T


@either("icp_step", credit=0.5, chapter="chapter 2, “In the plane: one `atan2`”")
def icp_step__sign_of_b(source, target, T, gate, ratio, delta, *, keep):
    """The increment turns the wrong way: in b = Σ w (x v − y u) the sign is lost, or R is
    transposed."""
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    p, q, w = moved[kept], target[indices[kept]], huber(d[kept], delta)
    dT = aligned(p, q, w)
    dT[:2, :2] = dT[:2, :2].T
    dT[:2, 2] = (w @ q - dT[:2, :2] @ (w @ p)) / w.sum()
    return dT @ T


@either("icp_step", credit=0.4)
def icp_step__swapped(*arguments, keep):
    """Source and target are swapped in the alignment: the step leads away from the target."""
    return step(*arguments, keep, update=lambda dT, T: right.invert(dT) @ T)


@either("icp_step", credit=0.6, chapter=STAGES)
def icp_step__no_weights(*arguments, keep):
    """Huber's weights are not used in the alignment."""
    return step(*arguments, keep, weigh=lambda d, delta: np.ones(len(d)))


@either("icp_step", credit=0.6, chapter=STAGES)
def icp_step__weights_of_squares(*arguments, keep):
    """Huber's weights are taken of squared distances; they take distances in metres."""
    return step(*arguments, keep, weigh=lambda d, delta: huber(d**2, delta))


@either("icp_step", credit=0.6, chapter=STAGES)
def icp_step__gate_on_squares(*arguments, keep):
    """The gate is held against squared distances; both are in metres."""
    return step(*arguments, functools.partial(_gate_on_squares, keep=keep))


@either("icp_step", credit=0.6, chapter=STAGES)
def icp_step__no_gate(*arguments, keep):
    """The distance gate is not applied."""
    return step(*arguments, lambda d, gate, ratio: right.overlap(d, ratio))


@either("icp_step", credit=0.6, chapter=STAGES)
def icp_step__no_trimming(*arguments, keep):
    """The trimming is not applied: all pairs within the gate are aligned."""
    return step(*arguments, lambda d, gate, ratio: d <= gate)


@either("icp_step", credit=0.4, chapter=STAGES)
def icp_step__worst_kept(*arguments, keep):
    """Trimming keeps the worst pairs; it should keep the closest ones."""
    return step(*arguments, functools.partial(_keep_worst, keep=keep))


def _loop(one_step, source, target, T, *rest, keep):
    *settings, iterations = rest
    for _ in range(iterations):
        T_before, T = T, one_step(source, target, T, *settings, keep=keep)
        if np.abs(T - T_before).max() < 1e-14:
            break
    return T


@either("icp", credit=0.4, chapter=LEFT)
def icp__update_on_the_right(*arguments, keep):
    """The increment is composed on the right, T @ dT: it acts on points that T has moved
    already, so it belongs on the left, dT @ T."""
    return _loop(icp_step__update_on_the_right, *arguments, keep=keep)


@either("icp", credit=0.4)
def icp__one_step(*arguments, keep):
    """This is where one step leads; go on until the step is below the tolerances."""
    return step(*arguments[:-1], keep)


@either("icp", credit=0.4)
def icp__last_increment(*arguments, keep):
    """This is the last increment alone, next to the identity; the steps have to be chained."""
    T = _loop(right_step, *arguments, keep=keep)
    return step(*arguments[:2], T, *arguments[3:-1], keep, update=lambda dT, _: dT)


@either("icp", credit=0.5)
def icp__pairs_found_once(source, target, T, gate, ratio, delta, iterations, *, keep):
    """The pairs are found once, before the loop; each iteration has to find them anew."""
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    p, q = source[kept], target[indices[kept]]
    for _ in range(iterations):
        moved = p @ T[:2, :2].T + T[:2, 2]
        d = np.linalg.norm(moved - q, axis=1)
        T = aligned(moved, q, huber(d, delta)) @ T
    return T


@either("icp", credit=0.5, chapter="chapter 4, “The basin of convergence”")
def icp__guess_ignored(source, target, T, *rest, keep):
    """The initial guess is not used: the loop starts from no motion."""
    return _loop(right_step, source, target, np.eye(3), *rest, keep=keep)


@either("icp", credit=0.6)
def icp__guess_lost(source, target, T, *rest, keep):
    """The result is the motion since the initial guess; the guess is a part of the answer."""
    return _loop(right_step, source, target, T, *rest, keep=keep) @ right.invert(T)


@either("icp", credit=0.6)
def icp__inverse(*arguments, keep):
    """This is the inverse: it maps the target onto the source."""
    return right.invert(_loop(right_step, *arguments, keep=keep))


@either("icp", credit=0.6, chapter=STAGES)
def icp__no_weights(*arguments, keep):
    """Huber's weights are not used in the alignment."""
    return _loop(icp_step__no_weights, *arguments, keep=keep)


@either("icp", credit=0.6, chapter=STAGES)
def icp__weights_of_squares(*arguments, keep):
    """Huber's weights are taken of squared distances; they take distances in metres."""
    return _loop(icp_step__weights_of_squares, *arguments, keep=keep)


@either("icp", credit=0.6, chapter=STAGES)
def icp__gate_on_squares(*arguments, keep):
    """The gate is held against squared distances; both are in metres."""
    return _loop(icp_step__gate_on_squares, *arguments, keep=keep)


@either("icp", credit=0.6, chapter=STAGES)
def icp__no_gate(*arguments, keep):
    """The distance gate is not applied."""
    return _loop(icp_step__no_gate, *arguments, keep=keep)


@either("icp", credit=0.6, chapter=STAGES)
def icp__no_trimming(*arguments, keep):
    """The trimming is not applied: all pairs within the gate are aligned."""
    return _loop(icp_step__no_trimming, *arguments, keep=keep)
