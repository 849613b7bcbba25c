"""Chapter 8: what a figure is worth, and errors of a trajectory."""

import math

import numpy as np

from labkit import se2
from labkit.course.exercises import exercise


# fmt: off
@exercise("How often the bad one looks worse", {
    "figures that overlap": (np.array([3.0, 5.0, 9.0]), np.array([1.0, 2.0, 4.0, 6.0])),
    "figures with ties": (np.array([2.0, 2.0, 5.0]), np.array([1.0, 2.0, 2.0, 2.0])),
    "figures with one far off": (np.array([2.0, 1.0, 4.0]), np.array([3.0, 0.5, 30.0, 2.5, 2.0])),
}, {
    "A tie counts as a half: a figure that never changes would get 0, a coin 0.5.": {"0.5": "0.0"},
    "This compares pairwise; each bad meets each good one.": lambda b, g: np.mean(b > g[: len(b)]),
    "The means are compared; compare each with each.": lambda b, g: float(b.mean() > g.mean()),
    "A tie counts fully; it is a half, or a figure that never changes would get 1.":
        {"0.5": "1.0"},
})
def looks_worse(bad, good):
    """Draw by draw."""
    is_larger = bad[:, None] > good
    is_tied = bad[:, None] == good
    return np.mean(is_larger + 0.5 * is_tied)


def _turn_first(T, step):
    turn = step.copy()
    turn[:2, 2] = 0.0
    return T @ turn @ se2.transform(*step[:2, 2], 0.0)


def _path(steps, chain=lambda T, step: T @ step):
    T = [np.eye(3)]
    for step in steps:
        T.append(chain(T[-1], se2.transform(*step)))
    return se2.to_xytheta(np.array(T))


@exercise("Does the path close?", {
    "a square that closes": (np.array([(2.0, 0.0, math.pi / 2)] * 4),),
    "a way there and back": (np.array([(1.5, 0.1, 0.9), (1.0, 0.0, 2.9), (2.2, -0.3, -0.3)]),),
    "a way round to the right": (np.array([(1.0, 0.0, -1.0), (1.2, 0.1, -1.1), (0.3, 0, -0.7)]),),
}, {
    "The increments are added as if all were measured along the same axes; each has to be turned "
    "by the heading before it.": {"_path(increments)[-1, :2]": "increments.sum(0)[:2]"},
    "A full turn is no error: wrap the angle.": {"math.remainder(turn, math.tau)": "turn"},
    "This is the length of the way; asked for is how far its end is from its start.":
        {"*_path(increments)[-1, :2])": "*increments[:, :2].T).sum()"},
    "The product is in the wrong order: each increment stands on the right of those before.":
        {"_path(increments)": "_path(increments, lambda T, step: step @ T)"},
    "Each increment is turned by the heading after it; it is measured in the frame before it.":
        {"_path(increments)": "_path(increments, _turn_first)"},
})
def closing_gap(increments):
    """Distance and turn from the start of the path to its end."""
    turn = increments[:, 2].sum()
    return np.hypot(*_path(increments)[-1, :2]), abs(math.remainder(turn, math.tau))


def _drifting():
    turns = np.random.default_rng(3).normal(0.0, 0.2, 30)
    true = np.column_stack([np.full(30, 0.5), np.zeros(30), turns])
    estimate = _path(true + np.array([0.01, 0.0, 0.03]))
    reference = _path(true)
    turned = se2.to_xytheta(se2.transform(1.0, 2.0, 0.7) @ se2.from_xytheta(reference))
    return {"stretches of 1": (estimate, reference, 1), "stretches of 5": (estimate, turned, 5)}


def _displacements(path, n):
    """Displacements in the frame of each stretch's first pose."""
    x, y = (path[n:] - path[:-n])[:, :2].T
    heading = path[:-n, 2]
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([c * x + s * y, c * y - s * x])


@exercise("Relative errors", _drifting, {
    "The two displacements are compared in one frame, the world's, where the heading error of all "
    "that came before counts as well; see each from its own pose.":
        {"_displacements(path, apart)": "path[apart:] - path[:-apart]"},
    "Only the lengths are compared; a step to the wrong side is an error, too.":
        {"np.hypot(*(estimated - true)[:, :2].T)":
         "abs(np.hypot(*estimated.T) - np.hypot(*true.T))"},
    "This is the absolute error at the end of each stretch.":
        {"_displacements(path, apart)": "path[apart:]"},
    "The stretches follow one another; asked for is one from *each* pose.":
        lambda e, r, n: stretch_errors(e, r, n)[::n],
})
def stretch_errors(estimate, reference, apart):
    """Both displacements seen from their own first pose."""
    estimated, true = (_displacements(path, apart) for path in (estimate, reference))
    return np.hypot(*(estimated - true)[:, :2].T)
