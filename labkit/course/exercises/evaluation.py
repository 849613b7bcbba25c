"""Chapter 8: what a figure is worth, and errors of a trajectory."""

import math

import numpy as np

from labkit import se2
from labkit.course.exercises.exercise import exercise


# fmt: off
@exercise("How often the bad one looks worse", {
    "figures that overlap": (np.array([3.0, 5.0, 9.0]), np.array([1.0, 2.0, 4.0, 6.0])),
    "figures with ties": (np.array([2.0, 2.0, 5.0]), np.array([1.0, 2.0, 2.0, 2.0])),
    "figures with one far off": (np.array([2.0, 1.0, 4.0]), np.array([3.0, 0.5, 30.0, 2.5, 2.0])),
}, {
    "A draw counts as a half: a figure that never changes would get 0, a coin 0.5.": {"draw": 0.0},
    "A draw counts as a whole here; it counts as a half.": {"draw": 1.0},
    "This compares pairwise; each bad meets each good one.": lambda b, g: np.mean(b > g[: len(b)]),
    "The means are compared; compare each with each.": lambda b, g: float(b.mean() > g.mean()),
    "Each bad one is compared with the mean of the good ones; compare it with each.":
        lambda b, g: np.mean(b > g.mean()),
    "This is the number of draws; divide it by the number of all.": {"over": np.sum},
})
def looks_worse(bad, good, *, draw=0.5, over=np.mean):
    """Draw by draw."""
    return over((bad[:, None] > good) + draw * (bad[:, None] == good))


def _figures():
    rng = np.random.default_rng(8)
    good, bad = rng.gamma(2.0, 1.0, 400), rng.gamma(5.0, 1.2, 90)
    return {f"{alarms:.0%} false alarms": (good, bad, alarms) for alarms in (0.05, 0.2)}


def _above(limit, figures):
    return (figures > limit).mean()


@exercise("A threshold, and what it catches", _figures, {
    "The threshold is taken from the bad ones; the false alarms are among the good.":
        {"threshold": lambda g, b, a: np.quantile(b, 1 - a)},
    "So nearly all good ones raise an alarm: the threshold is their upper quantile.":
        {"threshold": lambda g, b, a: np.quantile(g, a)},
    "The threshold is taken from all matches; the false alarms are among the good.":
        {"threshold": lambda g, b, a: np.quantile(np.append(g, b), 1 - a)},
    "The second number is the share of all matches; asked is that of the bad.":
        {"share": lambda limit, g, b: _above(limit, np.append(g, b))},
    "The second is the share *not* caught.": {"share": lambda limit, g, b: 1 - _above(limit, b)},
    "The second is a count; give a share.": {"share": lambda limit, g, b: (b > limit).sum()},
    "The share is taken as a percentage: `np.percentile` takes 100 times what `np.quantile` takes.":
        {"threshold": lambda g, b, a: np.percentile(g, 1 - a)},
}, tolerance=0.02)  # each threshold that parts the good ones so is right
def caught_share(good, bad, alarms, *, threshold=lambda g, b, a: np.quantile(g, 1 - a),
                 share=lambda limit, g, b: _above(limit, b)):
    """A quantile of the good ones."""
    limit = threshold(good, bad, alarms)
    return limit, share(limit, good, bad)


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
    "by the heading before it.": {"gap": lambda s: np.hypot(*s.sum(0)[:2])},
    "A full turn is no error: wrap the angle.": {"turn": lambda angles: abs(angles.sum())},
    "The increments are added along the same axes, and the angle is not wrapped.":
        lambda s: (np.hypot(*s.sum(0)[:2]), abs(s[:, 2].sum())),
    "The angle keeps its sign; asked for is its size.":
        {"turn": lambda angles: math.remainder(angles.sum(), math.tau)},
    "The angle is in degrees; it is to be in radians.":
        lambda s: closing_gap(s) * np.array([1, 180 / math.pi]),
    "This is the length of the way; asked for is how far its end is from its start.":
        {"gap": lambda s: np.hypot(*s[:, :2].T).sum()},
    "The angle is that of all turns, whichever way: add them with their signs.":
        {"turn": lambda angles: abs(angles).sum()},
    "The product is in the wrong order: each increment stands on the right of those before.":
        {"gap": lambda s: np.hypot(*_path(s, lambda T, step: step @ T)[-1, :2])},
    "Each step is turned by the heading *after* it; it is measured in the frame before.":
        {"gap": lambda s: abs((s[:, :2] @ (1, 1j) * np.exp(1j * np.cumsum(s[:, 2]))).sum())},
})
def closing_gap(increments, *, gap=lambda s: np.hypot(*_path(s)[-1, :2]),
                turn=lambda angles: abs(math.remainder(angles.sum(), math.tau))):
    """Distance and turn from the start of the path to its end."""
    return gap(increments), turn(increments[:, 2])


def _drifting():
    true = np.column_stack(
        [np.full(30, 0.5), np.zeros(30), np.random.default_rng(3).normal(0.0, 0.2, 30)]
    )
    estimate, reference = _path(true + np.array([0.01, 0.0, 0.03])), _path(true)
    turned = se2.to_xytheta(se2.transform(1.0, 2.0, 0.7) @ se2.from_xytheta(reference))
    return {"stretches of 1": (estimate, reference, 1), "stretches of 5": (estimate, turned, 5)}


def _moved(path, n):
    """Displacements in the frame of each stretch's first pose."""
    x, y = (path[n:] - path[:-n])[:, :2].T
    c, s = np.cos(path[:-n, 2]), np.sin(path[:-n, 2])
    return np.column_stack([c * x + s * y, c * y - s * x])


def _gap(a, b):
    return np.hypot(*(a - b)[:, :2].T)


@exercise("Relative errors", _drifting, {
    "The two displacements are compared in one frame, the world's, where the heading error of all "
    "that came before counts as well; see each from its own pose.":
        {"moved": lambda path, n: path[n:] - path[:-n]},
    "Only the lengths are compared; a step to the wrong side is an error, too.":
        {"apart_by": lambda a, b: abs(np.hypot(*a.T) - np.hypot(*b.T))},
    "This is the absolute error at the end of each stretch.": {"moved": lambda path, n: path[n:]},
    "These are steps from pose to pose; the stretches are `apart` poses long.":
        lambda e, r, n: stretch_errors(e, r, 1),
    "The stretches follow one another; asked for is one from *each* pose.":
        lambda e, r, n: stretch_errors(e, r, n)[::n],
    "The displacements are turned the wrong way: into the robot's frame it is R(−ψ).":
        {"moved": lambda path, n: _moved(path * (1, 1, -1), n)},
    "This is one number, the mean; asked for is one for each stretch.":
        lambda e, r, n: np.array([stretch_errors(e, r, n).mean()]),
})
def stretch_errors(estimate, reference, apart, *, moved=_moved, apart_by=_gap):
    """Both displacements seen from their own first pose."""
    return apart_by(moved(estimate, apart), moved(reference, apart))
