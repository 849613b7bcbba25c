"""Chapter 8: what a figure is worth, and errors of a trajectory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labkit import se2
from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import Arguments, exercise


def _share(bad: Any, good: Any, tie: float = 0.5) -> Any:
    return np.mean([(b > g) + tie * (b == g) for b in bad for g in good])


# fmt: off
@exercise("How often the bad one looks worse", {
    "figures that overlap": (np.array([3.0, 5.0, 9.0]), np.array([1.0, 2.0, 4.0, 6.0])),
    "figures with ties": (np.array([2.0, 2.0, 5.0]), np.array([1.0, 2.0, 2.0, 2.0])),
    "figures with one far off": (np.array([2.0, 1.0, 4.0]), np.array([3.0, 0.5, 30.0, 2.5, 2.0])),
}, {
    "The two are exchanged: this is how often the *good* one looks worse.":
        lambda b, g: _share(g, b),
    "A draw counts as a half: a figure that is always the same would get 0, a coin gets 0.5.":
        lambda b, g: _share(b, g, tie=0.0),
    "A draw counts as a whole here; it counts as a half.": lambda b, g: _share(b, g, tie=1.0),
    "The two are exchanged, and a draw counts as nothing.": lambda b, g: _share(g, b, tie=0.0),
    "This compares pairwise in their order; each bad one meets each good one.":
        lambda b, g: np.mean(b > g[: len(b)]),
    "This compares in their order, with draws as a half; each bad one meets each good one.":
        lambda b, g: np.mean((b > g[: len(b)]) + 0.5 * (b == g[: len(b)])),
    "The means are compared; compare each bad one with each good one.":
        lambda b, g: float(b.mean() > g.mean()),
    "Each bad one is compared with the mean of the good ones; compare it with each.":
        lambda b, g: np.mean(b > g.mean()),
    "Each bad one is compared with the median of the good ones; compare it with each.":
        lambda b, g: np.mean(b > np.median(g)),
    "Each bad one is compared with the largest good one; compare it with each.":
        lambda b, g: np.mean(b > g.max()),
    "This is the number of draws; divide it by the number of all.":
        lambda b, g: _share(b, g) * len(b) * len(g),
    "The number of draws is divided by that of the bad ones alone; divide by all pairs.":
        lambda b, g: _share(b, g) * len(g),
    "The number of draws is divided by that of the good ones alone; divide by all pairs.":
        lambda b, g: _share(b, g) * len(b),
})
def looks_worse(bad: FloatArray, good: FloatArray) -> Any:
    """Draw by draw."""
    return _share(bad, good)


def _figures() -> Arguments:
    rng = np.random.default_rng(8)
    good, bad = rng.gamma(2.0, 1.0, 400), rng.gamma(5.0, 1.2, 90)
    return {f"{alarms:.0%} false alarms": (good, bad, alarms) for alarms in (0.05, 0.2)}


def _shares(answer: Any, good: FloatArray, bad: FloatArray, alarms: float) -> Any:
    """The shares beyond the threshold: each threshold that parts the good ones so is right."""
    try:
        limit, caught = map(float, np.ravel(np.asarray(answer, dtype=float)))
    except (TypeError, ValueError):
        return answer
    return float(np.mean(good > limit)), caught - float(np.mean(bad > limit))


def _caught(limit: Any, bad: FloatArray) -> tuple[Any, Any]:
    return limit, (bad > limit).mean()


@exercise("A threshold, and what it catches", _figures, {
    "The threshold is taken from the bad ones; the false alarms are among the good.":
        lambda g, b, a: _caught(np.quantile(b, 1 - a), b),
    "The threshold is the lower quantile of the bad ones; the false alarms are among the good.":
        lambda g, b, a: _caught(np.quantile(b, a), b),
    "So nearly all good ones raise an alarm: the threshold is their upper quantile.":
        lambda g, b, a: _caught(np.quantile(g, a), b),
    "The threshold is taken from all matches; the false alarms are among the good.":
        lambda g, b, a: _caught(np.quantile(np.append(g, b), 1 - a), b),
    "The second number is the share of all matches; asked is that of the bad.":
        lambda g, b, a: (np.quantile(g, 1 - a), np.mean(np.append(g, b) > np.quantile(g, 1 - a))),
    "The second number is the share that is *not* caught.":
        lambda g, b, a: (np.quantile(g, 1 - a), np.mean(b <= np.quantile(g, 1 - a))),
    "The second number is a count; asked for is the share of the bad.":
        lambda g, b, a: (np.quantile(g, 1 - a), np.sum(b > np.quantile(g, 1 - a))),
    "The second number is the share of the good ones; asked is that of the bad.":
        lambda g, b, a: (np.quantile(g, 1 - a), a),
    "The share is taken as a percentage: `np.percentile` takes 100 times what `np.quantile` takes.":
        lambda g, b, a: _caught(np.percentile(g, 1 - a), b),
    "The threshold is a share of the largest figure; it is a quantile of the good ones.":
        lambda g, b, a: _caught((1 - a) * g.max(), b),
    "The results are in the wrong order: first the threshold, then the share.":
        lambda g, b, a: (np.mean(b > np.quantile(g, 1 - a)), np.quantile(g, 1 - a)),
}, tolerance=0.0026, view=_shares)
def caught_share(good: FloatArray, bad: FloatArray, alarms: float) -> tuple[Any, Any]:
    """The threshold lies between two of the good ones."""
    limit = np.sort(good)[len(good) - round(alarms * len(good)) - 1]
    return _caught(limit, bad)


def _path(steps: Any) -> FloatArray:
    T, poses = np.eye(3), [np.zeros(3)]
    for step in steps:
        T = T @ se2.transform(*step)
        poses.append(se2.to_xytheta(T))
    return np.array(poses)


def _end(steps: Any, wrap: Any = lambda a: math.remainder(a, math.tau)) -> tuple[Any, Any]:
    return math.hypot(*_path(steps)[-1, :2]), abs(wrap(sum(steps[:, 2])))


@exercise("Does the path close?", {
    "a square that closes": (np.array([(2.0, 0.0, math.pi / 2)] * 4),),
    "a way there and back": (np.array([(1.5, 0.1, 0.9), (1.0, 0.0, 2.9), (2.2, -0.3, -0.3)]),),
    "a way round to the right": (np.array([(1.0, 0.0, -1.0), (1.2, 0.1, -1.1), (0.3, 0, -0.7)]),),
}, {
    "The increments are added as if all were measured along the same axes; each has to be turned "
    "by the heading before it.": lambda s: (math.hypot(*s.sum(0)[:2]), _end(s)[1]),
    "A full turn is no error: wrap the angle.": lambda s: _end(s, wrap=lambda a: a),
    "The increments are added along the same axes, and the angle is not wrapped.":
        lambda s: (math.hypot(*s.sum(0)[:2]), abs(s.sum(0)[2])),
    "The angle keeps its sign; asked for is its size.":
        lambda s: (_end(s)[0], math.remainder(s[:, 2].sum(), math.tau)),
    "The angle is in degrees; it is to be in radians.":
        lambda s: (_end(s)[0], math.degrees(_end(s)[1])),
    "The angle is wrapped to [0, 2π); take its size in (−π, π].":
        lambda s: (_end(s)[0], s[:, 2].sum() % math.tau),
    "This is the length of the way; asked for is how far its end is from its start.":
        lambda s: (np.hypot(*s[:, :2].T).sum(), _end(s)[1]),
    "The angle is that of all turns, whichever way: add them with their signs.":
        lambda s: (_end(s)[0], abs(s[:, 2]).sum()),
    "The product is in the wrong order: each increment stands on the right of those before.":
        lambda s: (math.hypot(*_reversed(s)[:2, 2]), _end(s)[1]),
    "Each step is turned by the heading *after* it; it is measured in the frame before.":
        lambda s: (abs(sum(complex(*one[:2]) * np.exp(1j * a)
                           for one, a in zip(s, np.cumsum(s[:, 2]), strict=True))), _end(s)[1]),
    "Only Δx is looked at; the distance is the length.":
        lambda s: (abs(_path(s)[-1, 0]), _end(s)[1]),
    "The last increment is left out: K increments lead through K + 1 poses.":
        lambda s: _end(s[:-1]),
})
def closing_gap(increments: FloatArray) -> tuple[Any, Any]:
    """Where the path ends."""
    return _end(increments)


def _reversed(steps: FloatArray) -> FloatArray:
    T = np.eye(3)
    for step in steps:
        T = se2.transform(*step) @ T
    return T


def _drifting() -> Arguments:
    true = np.column_stack(
        [np.full(30, 0.5), np.zeros(30), np.random.default_rng(3).normal(0.0, 0.2, 30)])
    estimate, reference = _path(true + np.array([0.01, 0.0, 0.03])), _path(true)
    turned = se2.to_xytheta(se2.transform(1.0, 2.0, 0.7) @ se2.from_xytheta(reference))
    return {"stretches of 1": (estimate, reference, 1), "stretches of 5": (estimate, turned, 5)}


def _moved(path: FloatArray, n: int, frame: FloatArray | None = None, every: int = 1) -> Any:
    """Displacements in the frame of each stretch's first pose, or of another path's."""
    heading = (path if frame is None else frame)[:-n, 2]
    c, s = np.cos(heading), np.sin(heading)
    dx, dy = (path[n:, :2] - path[:-n, :2]).T
    return np.column_stack([c * dx + s * dy, c * dy - s * dx])[::every]


def _gap(a: Any, b: Any) -> Any:
    return np.hypot(*(a - b).T)


@exercise("Relative errors", _drifting, {
    "The two displacements are compared in one frame, the world's, where the heading error of all "
    "that came before counts as well; see each from its own pose.":
        lambda e, r, n: _gap(e[n:, :2] - e[:-n, :2], r[n:, :2] - r[:-n, :2]),
    "Only the lengths are compared; a step to the wrong side is an error, too.":
        lambda e, r, n: abs(np.hypot(*_moved(e, n).T) - np.hypot(*_moved(r, n).T)),
    "This is the absolute error at the end of each stretch.":
        lambda e, r, n: _gap(e[n:, :2], r[n:, :2]),
    "This is the growth of the absolute error over each stretch; compare the displacements.":
        lambda e, r, n: np.hypot(*(e - r)[n:, :2].T) - np.hypot(*(e - r)[:-n, :2].T),
    "These are steps from pose to pose; the stretches are `apart` poses long.":
        lambda e, r, n: _gap(_moved(e, 1), _moved(r, 1)),
    "The stretches follow one another; asked for is one from *each* pose.":
        lambda e, r, n: _gap(_moved(e, n, every=n), _moved(r, n, every=n)),
    "The displacements are turned the wrong way: into the robot's frame it is R(−ψ).":
        lambda e, r, n: _gap(_moved(e * (1, 1, -1), n), _moved(r * (1, 1, -1), n)),
    "These are seen from the end of each stretch; asked for is its first pose.":
        lambda e, r, n: _gap(_moved(e[::-1], n)[::-1], _moved(r[::-1], n)[::-1]),
    "The headings are in the differences, too; asked for are errors in metres.":
        lambda e, r, n: np.sqrt(stretch_errors(e, r, n) ** 2 + se2.wrap(
            (e[n:, 2] - e[:-n, 2]) - (r[n:, 2] - r[:-n, 2])) ** 2),
    "This is one number, the mean; asked for is one for each stretch.":
        lambda e, r, n: np.array([stretch_errors(e, r, n).mean()]),
    "The stretches are one pose too long.":
        lambda e, r, n: _gap(_moved(e, n + 1), _moved(r, n + 1)),
})
def stretch_errors(estimate: FloatArray, reference: FloatArray, apart: int) -> FloatArray:
    """Both displacements seen from their own first pose."""
    return np.asarray(_gap(_moved(estimate, apart), _moved(reference, apart)))
