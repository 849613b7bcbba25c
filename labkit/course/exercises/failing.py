"""Chapter 7: what a prior can tell before a match, and what to keep of many."""

import math

import numpy as np

from labkit.course.exercises import exercise

PI = math.pi


# fmt: off
@exercise("How much two views share", {
    f"a turn by {turn:g}° with {field:g}° in view": (math.radians(turn), math.radians(field))
    for field, turn in ((180, 60), (180, -150), (270, 180), (90, 120), (360, 90), (90, -30))
}, {
    "Behind the robot the two views meet again: a turn by 180° leaves a scanner of 270° more than "
    "a third.": lambda t, f: max(0.0, 1 - abs(t) / f),
    "A turn to the right is negative, and the views meet again behind.": lambda t, f: 1 - t / f,
    "Two views that do not meet share 0, not less; and wide ones meet again behind the robot.":
        lambda t, f: 1 - abs(t) / f,
    "This is the share not seen again, and wide views meet behind.": lambda t, f: abs(t) / f,
    "The share is taken of a whole turn, 2π; it is one of the field of view.":
        lambda t, f: shared_view(t, f) * f / (2 * PI),
}, tolerance=1e-9)
def shared_view(turn, field):
    """In front and behind."""
    ahead = max(field - abs(turn), 0.0)
    behind = max(0.0, field + abs(turn) - 2 * PI)
    return (ahead + behind) / field


@exercise("The step that doorways show", {
    f"a step of {s:g} m, a door each {p:g} m": (s, p)
    for s, p in ((0.7, 2.0), (1.4, 2.0), (3.3, 2.0), (2.6, 1.5), (-1.3, 2.0))
}, {
    "This is always ahead; the nearest valley may lie behind the robot.": lambda s, p: s % p,
    "One period is taken off a long step; take several.": lambda s, p: s - p if s > p / 2 else s,
    "The periods are cut off towards zero; round to the nearest.": math.fmod,
})
def apparent_step(step, period):
    """The nearest to zero of all candidates."""
    candidates = [step - period * k for k in range(-9, 10)]
    return min(candidates, key=abs)


@exercise("The fastest that may be driven", {
    f"a door each {p:g} m and {r:g} scans a second": (p, r) for p, r in ((2.0, 5.0), (1.2, 10.0))
}, {
    "A whole period looks like no motion at all: only half a period is safe.": lambda p, r: p * r,
    "A whole period, divided by the rate: half is safe, in the time 1 / rate.": lambda p, r: p / r,
    "The rate is divided by the period: a speed is metres a second.": lambda p, r: r / p,
})
def fastest_speed(period, rate):
    """Half a period in the time of one scan."""
    time = 1 / rate
    return period / 2 / time


CHEAPEST = "np.where(converged, costs, np.inf).argmin()"


@exercise("Which of many starts to keep", {
    "five ends, of which the cheapest has not converged": (
        np.array([0.005, 0.02, 0.0012, 0.0009, 0.031]), np.array([1, 0, 1, 0, 1], dtype=bool)),
    "five ends, of which the cheapest has converged": (
        np.array([0.004, 0.031, 0.005, 0.0008, 0.006]), np.array([0, 1, 0, 1, 1], dtype=bool)),
    "three ends of which none has converged": (
        np.array([0.031, 0.0009, 0.0012]), np.zeros(3, dtype=bool)),
}, {
    "This takes the smallest cost of all; that run had not converged.":
        {"return -1": "return costs.argmin()", CHEAPEST: "costs.argmin()"},
    "This takes the smallest cost of all where any has converged; look at those alone.":
        {CHEAPEST: "costs.argmin()"},
    "This is the first that converged; take the cheapest.": {CHEAPEST: "converged.argmax()"},
    "None has converged: say so by −1 instead of choosing one.": {"return -1": "return 0"},
    "The index counts among those that converged; asked for is that among all.":
        {CHEAPEST: "costs[converged].argmin()"},
})
def best_start(costs, converged):
    """The smallest of those that may be kept."""
    if not converged.any():
        return -1
    return np.where(converged, costs, np.inf).argmin()
