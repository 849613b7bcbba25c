"""Chapter 8: what a figure is worth, and errors of a trajectory."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labkit import se2
from labkit.arrays import FloatArray, IntArray
from labkit.course.exercises.exercise import Case, exercise


@exercise("How often the bad one looks worse")
def looks_worse() -> Iterator[Case]:
    """With ties and without."""
    samples = {
        "figures that overlap": ([3.0, 5.0, 9.0], [1.0, 2.0, 4.0, 6.0]),
        "figures with ties": ([2.0, 2.0, 5.0], [1.0, 2.0, 2.0, 2.0]),
    }
    for where, (first, second) in samples.items():
        bad, good = np.array(first), np.array(second)
        draws = [(b, g) for b in first for g in second]
        wins, ties = sum(b > g for b, g in draws), sum(b == g for b, g in draws)
        right = (wins + 0.5 * ties) / len(draws)
        answers = {
            "The two are exchanged: this is how often the *good* one looks worse.": 1 - right,
            "A draw counts as a half: a figure that is always the same would get 0 here, where a "
            "coin gets 0.5.": wins / len(draws),
            "This compares pairwise in their order; each bad one meets each good one.": float(
                np.mean(bad > good[: len(bad)])
            ),
        }
        wrong = {says: each for says, each in answers.items() if abs(each - right) > 1e-9}
        yield Case(where, (bad, good), right, wrong)


@exercise("A threshold, and what it catches")
def caught_share() -> Iterator[Case]:
    """For figures whose good and bad ones overlap."""
    rng = np.random.default_rng(8)
    good, bad = rng.gamma(2.0, 1.0, 400), rng.gamma(5.0, 1.2, 90)
    for alarms in (0.05, 0.2):
        limit = float(np.quantile(good, 1 - alarms))
        yield Case(
            f"{alarms:.0%} false alarms",
            (good, bad, alarms),
            (limit, float(np.mean(bad > limit))),
            {
                "The threshold is taken from the bad ones; the false alarms are among the good.": (
                    _caught(float(np.quantile(bad, 1 - alarms)), bad)
                ),
                "So nearly all good ones raise an alarm: the threshold is their upper "
                "quantile.": _caught(float(np.quantile(good, alarms)), bad),
                "The second number is the share of all matches; asked is that of the bad.": (
                    limit,
                    float(np.mean(np.concatenate([good, bad]) > limit)),
                ),
            },
            tolerance=1e-3,
        )


def _caught(limit: float, bad: FloatArray) -> tuple[float, float]:
    return limit, float(np.mean(bad > limit))


@exercise("Does the path close?")
def closing_gap() -> Iterator[Case]:
    """For ways with turns, so that adding up the increments is wrong."""
    ways = {
        "a square that closes": [(2.0, 0.0, math.pi / 2)] * 4,
        "a way there and back": [(1.5, 0.1, 0.4), (1.0, 0.0, 2.9), (2.2, -0.3, 0.1)],
    }
    for where, rows in ways.items():
        increments = np.array(rows)
        x = y = heading = 0.0
        for dx, dy, turn in rows:
            x += math.cos(heading) * dx - math.sin(heading) * dy
            y += math.sin(heading) * dx + math.cos(heading) * dy
            heading += turn
        added = increments.sum(axis=0)
        gap, turned = math.hypot(x, y), abs(math.remainder(heading, math.tau))
        mistakes = {
            "The increments are added as if all were measured along the same axes; each has to be "
            "turned by the heading before it.": (
                float(np.hypot(*added[:2])),
                abs(math.remainder(float(added[2]), math.tau)),
            )
        }
        if abs(abs(heading) - turned) > 1e-9:
            mistakes["A full turn is no error: wrap the angle."] = (gap, abs(heading))
        yield Case(where, (increments,), (gap, turned), mistakes)


@exercise("Relative errors")
def stretch_errors() -> Iterator[Case]:
    """For an estimate whose heading drifts."""
    rng = np.random.default_rng(3)
    true_steps = np.column_stack([np.full(30, 0.5), np.zeros(30), rng.normal(0.0, 0.2, 30)])
    reference = _integrated(true_steps)
    estimate = _integrated(true_steps + np.array([0.01, 0.0, 0.03]))
    for apart in (1, 5):
        first, last = np.arange(31 - apart), np.arange(apart, 31)
        moved = [_step(path, first, last) for path in (estimate, reference)]
        off = [estimate[last, :2] - estimate[first, :2], reference[last, :2] - reference[first, :2]]
        lengths = [np.hypot(*each.T) for each in off]
        yield Case(
            f"stretches of {apart}",
            (estimate, reference, apart),
            np.hypot(*(moved[0] - moved[1]).T),
            {
                "The two displacements are compared in the world's frame, where the heading error "
                "of all that came before counts as well.": np.hypot(*(off[0] - off[1]).T),
                "Only the lengths are compared; a step to the wrong side is an error, too.": (
                    np.abs(lengths[0] - lengths[1])
                ),
                "This is the absolute error at the end of each stretch.": np.hypot(
                    *(estimate[last, :2] - reference[last, :2]).T
                ),
            },
        )


def _integrated(steps: FloatArray) -> FloatArray:
    T, poses = np.eye(3), [np.zeros(3)]
    for step in steps:
        T = T @ se2.transform(*step.tolist())
        poses.append(se2.to_xytheta(T))
    return np.array(poses)


def _step(path: FloatArray, first: IntArray, last: IntArray) -> FloatArray:
    """Displacements in the frame of the first pose of each stretch."""
    c, s = np.cos(path[first, 2]), np.sin(path[first, 2])
    dx, dy = (path[last, :2] - path[first, :2]).T
    return np.column_stack([c * dx + s * dy, c * dy - s * dx])
