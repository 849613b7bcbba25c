"""Mistakes in the whole loop, each in both readings of the trimming."""

import numpy as np

from labkit.authoring.misconceptions import stages
from labkit.authoring.misconceptions.stages import (
    LEFT,
    STAGES,
    aligned,
    both,
    huber,
    right_step,
    step,
)
from labkit.authoring.mistake import mistake
from labkit.authoring.variants import vectorised as right


def _loop(one_step, source, target, T, *rest, keep):
    *stages, iterations = rest
    for _ in range(iterations):
        T_before, T = T, one_step(source, target, T, *stages, keep=keep)
        if np.abs(T - T_before).max() < 1e-14:
            break
    return T


@mistake("icp", credit=0.4, chapter=LEFT)
@both
def icp__update_on_the_right(*arguments, keep):
    """The increment is composed on the right, T @ dT: it acts on points that T has moved
    already, so it belongs on the left, dT @ T."""
    return _loop(stages.step_update_on_the_right, *arguments, keep=keep)


@mistake("icp", credit=0.4)
@both
def icp__one_step(*arguments, keep):
    """This is where one step leads; go on until the step is below the tolerances."""
    return step(*arguments[:-1], keep)


@mistake("icp", credit=0.4)
@both
def icp__last_increment(*arguments, keep):
    """This is the last increment alone, next to the identity; the steps have to be chained."""
    T = _loop(right_step, *arguments, keep=keep)
    return step(*arguments[:2], T, *arguments[3:-1], keep, update=lambda dT, _: dT)


@mistake("icp", credit=0.5)
@both
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


@mistake("icp", credit=0.5, chapter="chapter 4, “The basin of convergence”")
@both
def icp__guess_ignored(source, target, T, *rest, keep):
    """The initial guess is not used: the loop starts from no motion."""
    return _loop(right_step, source, target, np.eye(3), *rest, keep=keep)


@mistake("icp", credit=0.6)
@both
def icp__guess_lost(source, target, T, *rest, keep):
    """The result is the motion since the initial guess; the guess is a part of the answer."""
    return _loop(right_step, source, target, T, *rest, keep=keep) @ right.invert(T)


@mistake("icp", credit=0.6)
@both
def icp__inverse(*arguments, keep):
    """This is the inverse: it maps the target onto the source."""
    return right.invert(_loop(right_step, *arguments, keep=keep))


@mistake("icp", credit=0.6, chapter=STAGES)
@both
def icp__no_weights(*arguments, keep):
    """Huber's weights are not used in the alignment."""
    return _loop(stages.step_no_weights, *arguments, keep=keep)


@mistake("icp", credit=0.6, chapter=STAGES)
@both
def icp__weights_of_squares(*arguments, keep):
    """Huber's weights are taken of squared distances; they take distances in metres."""
    return _loop(stages.step_weights_of_squares, *arguments, keep=keep)


@mistake("icp", credit=0.6, chapter=STAGES)
@both
def icp__gate_on_squares(*arguments, keep):
    """The gate is held against squared distances; both are in metres."""
    return _loop(stages.step_gate_on_squares, *arguments, keep=keep)


@mistake("icp", credit=0.6, chapter=STAGES)
@both
def icp__no_gate(*arguments, keep):
    """The distance gate is not applied."""
    return _loop(stages.step_no_gate, *arguments, keep=keep)


@mistake("icp", credit=0.6, chapter=STAGES)
@both
def icp__no_trimming(*arguments, keep):
    """The trimming is not applied: all pairs within the gate are aligned."""
    return _loop(stages.step_no_trimming, *arguments, keep=keep)
