"""Chapter 7: what a prior can tell before a match, and what to keep of many."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labkit.course.exercises.exercise import Case, exercise


@exercise("How much two views share")
def shared_view() -> Iterator[Case]:
    """Counted beam by beam; also where the fields of view meet again behind the robot."""
    for field, turn in (
        (180.0, 60.0),
        (180.0, -150.0),
        (270.0, 180.0),
        (90.0, 120.0),
        (360.0, 90.0),
    ):
        f, t = math.radians(field), math.radians(turn)
        beams = (np.arange(200_000) + 0.5) / 200_000 * f - f / 2
        seen = np.abs(np.remainder(beams + t + np.pi, 2 * np.pi) - np.pi) <= f / 2
        right = float(np.mean(seen))
        if abs(right - max(0.0, 1 - abs(t) / f)) > 1e-3:
            wrong = {
                "Behind the robot the two views meet again: a turn by 180° leaves a scanner of "
                "270° more than a third.": max(0.0, 1 - abs(t) / f)
            }
        elif t < 0.0:
            wrong = {"A turn to the right is negative: take |turn|.": 1 - t / f}
        elif t > f:
            wrong = {"Two views that do not meet share 0, not less.": 1 - t / f}
        else:
            wrong = {"This is the share that is *not* seen again.": t / f}
        yield Case(f"a turn by {turn:g}° with {field:g}° in view", (t, f), right, wrong, 1e-4)


@exercise("The step that doorways show")
def apparent_step() -> Iterator[Case]:
    """For steps in the right valley, in the next and in the one after it."""
    for step, period in ((0.7, 2.0), (1.4, 2.0), (3.3, 2.0), (2.6, 1.5)):
        candidates = step - period * np.arange(-5, 6)
        right = float(candidates[np.argmin(np.abs(candidates))])
        ahead = {
            "This is always ahead; the nearest valley may lie behind: the robot seems to drive "
            "backwards.": step % period,
        }
        true = {
            "This is the true step; a match from no motion ends in the valley nearest to it.": step
        }
        answers = ahead | true if step > period else true
        wrong = {says: each for says, each in answers.items() if abs(each - right) > 1e-6}
        yield Case(f"a step of {step:g} m, a door each {period:g} m", (step, period), right, wrong)


@exercise("The fastest that may be driven")
def fastest_speed() -> Iterator[Case]:
    """For two scanners."""
    for period, rate in ((2.0, 5.0), (1.2, 10.0)):
        yield Case(
            f"a door each {period:g} m and {rate:g} scans a second",
            (period, rate),
            0.5 * period * rate,
            {
                "A whole period between two scans looks like no motion at all: only half a period "
                "is safe.": period * rate,
                "Divided by the rate the unit is m·s: the time between two scans is 1 / rate.": 0.5
                * period
                / rate,
            },
        )


@exercise("Which of many starts to keep")
def best_start() -> Iterator[Case]:
    """For ends of which the cheapest has not settled, and for none that has."""
    costs = np.array([0.031, 0.0012, 0.0009, 0.0040])
    settled = np.array([True, True, False, True])
    yield Case(
        "four ends, of which the cheapest has not converged",
        (costs, settled),
        1,
        {
            "This takes the smallest cost of all; that run had not converged.": 2,
            "This takes the first that converged.": 0,
        },
    )
    yield Case(
        "three ends of which none has converged",
        (costs[:3], np.zeros(3, dtype=bool)),
        -1,
        {"None has converged: say so by −1 instead of choosing one.": 0},
    )
