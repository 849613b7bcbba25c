"""Chapter 7: what a prior can tell before a match, and what to keep of many."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labkit.course.exercises.exercise import exercise

PI = math.pi


# fmt: off
@exercise("How much two views share", {
    f"a turn by {turn:g}° with {field:g}° in view": (math.radians(turn), math.radians(field))
    for field, turn in ((180, 60), (180, -150), (270, 180), (90, 120), (360, 90), (90, -30))
}, {
    "Behind the robot the two views meet again: a turn by 180° leaves a scanner of 270° more than "
    "a third.": lambda t, f: max(0.0, 1 - abs(t) / f),
    "A turn to the right is negative: take |turn|.":
        lambda t, f: (max(0, f - t) + max(0, f + t - 2 * PI)) / f,
    "A turn to the right is negative, and the two views meet again behind the robot.":
        lambda t, f: 1 - t / f,
    "A turn to the right is negative, and behind the robot the two views meet again.":
        lambda t, f: max(0.0, 1 - t / f),
    "Two views that do not meet share 0, not less; and wide ones meet again behind the robot.":
        lambda t, f: 1 - abs(t) / f,
    "This is the share that is *not* seen again.": lambda t, f: 1 - shared_view(t, f),
    "This is the share that is not seen again, and wide views meet behind the robot.":
        lambda t, f: abs(t) / f,
    "The share is taken of a whole turn, 2π; it is one of the field of view.":
        lambda t, f: shared_view(t, f) * f / (2 * PI),
    "The share is taken of a whole turn, 2π, and wide views meet again behind the robot.":
        lambda t, f: max(0.0, f - abs(t)) / (2 * PI),
    "This is the angle that both see; divide it by the field of view.":
        lambda t, f: shared_view(t, f) * f,
    "This is the angle that both see; divide it by the field of view, and mind wide views.":
        lambda t, f: max(0.0, f - abs(t)),
    "The turn is counted twice: both edges move the same way, so one side loses |turn|.":
        lambda t, f: max(0.0, 1 - 2 * abs(t) / f),
    "The turn is halved; one side of the view loses all of |turn|.":
        lambda t, f: max(0.0, 1 - abs(t) / 2 / f),
}, tolerance=1e-9)
def shared_view(turn: float, field: float) -> float:
    """In front and behind."""
    return (max(0.0, field - abs(turn)) + max(0.0, field + abs(turn) - 2 * PI)) / field


@exercise("The step that doorways show", {
    f"a step of {s:g} m, a door each {p:g} m": (s, p)
    for s, p in ((0.7, 2.0), (1.4, 2.0), (3.3, 2.0), (2.6, 1.5), (-1.3, 2.0))
}, {
    "This is always ahead; the nearest valley may lie behind: the robot seems to drive backwards.":
        lambda s, p: s % p,
    "This is the true step; a match from no motion ends in the valley nearest to it.":
        lambda s, p: s,
    "One period is always taken off; take off as many as lead nearest to zero.":
        lambda s, p: s - p,
    "One period is taken off where the step is long; it may take several.":
        lambda s, p: s - p if s > p / 2 else s,
    "The periods are rounded up: this is never ahead; round to the nearest.":
        lambda s, p: s - p * math.ceil(s / p),
    "The periods are cut off towards zero; round to the nearest.": lambda s, p: math.fmod(s, p),
    "The sign is lost: behind is negative.": lambda s, p: abs(apparent_step(s, p)),
    "The sign is turned round: this is the true step's valley seen backwards.":
        lambda s, p: -apparent_step(s, p),
    "Half periods are taken off; the valleys lie whole periods apart.":
        lambda s, p: s - p / 2 * round(2 * s / p),
    "This is the number of periods; take them off the step.": lambda s, p: round(s / p),
    "These are the metres that are taken off; subtract them from the step.":
        lambda s, p: p * round(s / p),
    "This is a share of the period; asked for are metres.":
        lambda s, p: s / p - round(s / p),
    "The step is never longer than half a period: it does not stop there, it starts again behind.":
        lambda s, p: max(-p / 2, min(p / 2, s)),
})
def apparent_step(step: float, period: float) -> float:
    """The nearest to zero of all candidates."""
    return min((step - period * k for k in range(-9, 10)), key=abs)


@exercise("The fastest that may be driven", {
    f"a door each {p:g} m and {r:g} scans a second": (p, r) for p, r in ((2.0, 5.0), (1.2, 10.0))
}, {
    "A whole period between two scans looks like no motion at all: only half a period is safe.":
        lambda p, r: p * r,
    "Divided by the rate the unit is m·s: the time between two scans is 1 / rate.":
        lambda p, r: 0.5 * p / r,
    "A whole period, divided by the rate: half a period is safe, in the time 1 / rate.":
        lambda p, r: p / r,
    "The rate is divided by the period: a speed is metres a second.": lambda p, r: r / p,
    "The rate is divided by half the period: a speed is metres a second.":
        lambda p, r: 2 * r / p,
    "The rate is divided by the period, and halved: a speed is metres a second.":
        lambda p, r: 0.5 * r / p,
    "This is twice a period in the time of one scan; half a period is safe.":
        lambda p, r: 2 * p * r,
    "This is a quarter of a period; half a period is safe.": lambda p, r: 0.25 * p * r,
    "This is the longest step; the speed is that step times the scans a second.":
        lambda p, r: 0.5 * p,
})
def fastest_speed(period: float, rate: float) -> float:
    """Half a period in the time of one scan."""
    return period / 2 / (1 / rate)


def _flags(*flags: int) -> Any:
    return np.array(flags, dtype=bool)


@exercise("Which of many starts to keep", {
    "five ends, of which the cheapest has not converged": (
        np.array([0.005, 0.02, 0.0012, 0.0009, 0.031]), _flags(1, 0, 1, 0, 1)),
    "five ends, of which the cheapest has converged": (
        np.array([0.004, 0.031, 0.005, 0.0008, 0.006]), _flags(0, 1, 0, 1, 1)),
    "three ends of which none has converged": (
        np.array([0.031, 0.0009, 0.0012]), _flags(0, 0, 0)),
}, {
    "This takes the smallest cost of all; that run had not converged.":
        lambda c, ok: int(c.argmin()),
    "This takes the smallest cost of all where any has converged; look at those alone.":
        lambda c, ok: int(c.argmin()) if ok.any() else -1,
    "This takes the first that converged; take the cheapest of them.":
        lambda c, ok: int(ok.argmax()) if ok.any() else -1,
    "This takes the first that converged, and the first of all where none has.":
        lambda c, ok: int(ok.argmax()),
    "None has converged: say so by −1 instead of choosing one.":
        lambda c, ok: int(np.where(ok, c, np.inf).argmin()),
    "The index counts among those that converged; asked for is that among all.":
        lambda c, ok: int(c[ok].argmin()) if ok.any() else -1,
    "This takes the largest cost of those that converged; take the smallest.":
        lambda c, ok: int(np.where(ok, c, -np.inf).argmax()) if ok.any() else -1,
    "This takes the last that converged; take the cheapest of them.":
        lambda c, ok: int(np.flatnonzero(ok)[-1]) if ok.any() else -1,
    "This is the smallest cost; asked for is the index of that run.":
        lambda c, ok: c[ok].min() if ok.any() else -1,
    "The index counts from 1; an index counts from 0.":
        lambda c, ok: best_start(c, ok) + 1 if ok.any() else -1,
    "The costs of the others are set to 0, which is the smallest of all: set them to infinity.":
        lambda c, ok: int((c * ok).argmin()) if ok.any() else -1,
    "The costs of the others are set to 0, the smallest of all, and none is said by −1.":
        lambda c, ok: int((c * ok).argmin()),
    "This chooses among the runs that did *not* converge.":
        lambda c, ok: int(np.where(ok, np.inf, c).argmin()) if ok.any() else -1,
})
def best_start(costs: Any, converged: Any) -> int:
    """The smallest of those that may be kept."""
    kept = [i for i in range(len(costs)) if converged[i]]
    return min(kept, key=lambda i: costs[i]) if kept else -1
