"""ICP steps with one stage wrong: what the mistakes in the step and in the loop are made of."""

import functools

import numpy as np

from labkit.authoring.mistake import Several
from labkit.authoring.references import READINGS
from labkit.authoring.variants import vectorised as right

LEFT = "chapter 4, “The flow chart, line by line”"
STAGES = "chapter 3, “Each stage by itself”"


def both(function):
    """Make the mistake in each reading of gate and trimming."""

    @functools.wraps(function)
    def answers(*arguments):
        return Several(tuple(function(*arguments, keep=keep) for keep in READINGS))

    return answers


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


# Steps with one stage wrong; the loops below make the same mistakes over and over.


def step_update_on_the_right(*arguments, keep):
    return step(*arguments, keep, update=lambda dT, T: T @ dT)


def step_translation_not_turned(*arguments, keep):
    return step(*arguments, keep, update=_add_translation)


def step_no_weights(*arguments, keep):
    return step(*arguments, keep, weigh=lambda d, delta: np.ones(len(d)))


def step_weights_of_squares(*arguments, keep):
    return step(*arguments, keep, weigh=lambda d, delta: huber(d**2, delta))


def step_gate_on_squares(*arguments, keep):
    return step(*arguments, functools.partial(_gate_on_squares, keep=keep))


def step_worst_kept(*arguments, keep):
    return step(*arguments, functools.partial(_keep_worst, keep=keep))


def step_no_gate(*arguments, keep):
    return step(*arguments, lambda d, gate, ratio: right.overlap(d, ratio))


def step_no_trimming(*arguments, keep):
    return step(*arguments, lambda d, gate, ratio: d <= gate)


def step_unmoved(source, target, T, gate, ratio, delta, *, keep):
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    return aligned(source[kept], target[indices[kept]], huber(d[kept], delta)) @ T


def step_sign_of_b(source, target, T, gate, ratio, delta, *, keep):
    moved = source @ T[:2, :2].T + T[:2, 2]
    indices, d = right.nearest_neighbors(moved, target)
    kept = keep(d, gate, ratio)
    p, q, w = moved[kept], target[indices[kept]], huber(d[kept], delta)
    dT = aligned(p, q, w)
    dT[:2, :2] = dT[:2, :2].T
    dT[:2, 2] = (w @ q - dT[:2, :2] @ (w @ p)) / w.sum()
    return dT @ T


def step_swapped(*arguments, keep):
    return step(*arguments, keep, update=lambda dT, T: right.invert(dT) @ T)


def _add_translation(dT, T):
    added = dT @ T
    added[:2, 2] = T[:2, 2] + dT[:2, 2]
    return added


def right_step(*arguments, keep):
    return step(*arguments, keep)
