"""Chapter 4: the cost of the loop, its order, its stops, gates that close, wrong headings."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from labkit import IcpParameters, Target, align, apply, icp, invert, to_xytheta, transform, wrap
from labkit.arrays import FloatArray
from labkit.correspondences import huber_loss
from labkit.course.exercises.exercise import Arguments, exercise
from labkit.simulation import Lidar, cast, room

R = np.array([0.9, 0.02, 0.3, 0.05, 2.0, 0.6, 0.15, 0.01, 0.4, 0.08, 0.7])


def _charged(r: FloatArray, d: float, count: int, delta: float, by: int = len(R)) -> Any:
    return huber_loss(np.minimum(np.sort(r)[:count], d), delta).sum() / by


# fmt: off
@exercise("The cost that cannot rise", {
    "eleven pairs, of which the overlap keeps eight and the gate seven": (R, 0.5, 0.8, 0.1),
    "eleven pairs, of which the overlap keeps seven": (R, 0.35, 0.68, 0.1),
    "eleven pairs, of which the overlap keeps nine": (R, 0.65, 0.85, 0.2),
}, {
    "The sum is divided by the number of kept pairs. That number changes, and then the cost can "
    "rise; divide by all N.": lambda r, d, o, h: _charged(r, d, c := int(o * len(r)), h, c),
    "Pairs outside the gate are charged nothing, so the scan could lower its cost by losing pairs; "
    "charge them as if they stood on the gate.":
        lambda r, d, o, h: huber_loss(s[s <= d], h).sum() / len(r)
        if len(s := np.sort(r)[:int(o * len(r))]) else 0,
    "Pairs outside the gate are left out, and the sum is divided by what is left; charge d_max.":
        lambda r, d, o, h: huber_loss((s := np.sort(r)[:int(o * len(r))])[s <= d], h).mean(),
    "These are plain squares; Huber's loss grows linearly beyond δ.":
        lambda r, d, o, h: _charged(r, d, int(o * len(r)), 1e9),
    "All pairs are in the sum; only the closest ⌊ρN⌋ are.":
        lambda r, d, o, h: _charged(r, d, len(r), h),
    "ρN is rounded up; the count is ⌊ρN⌋, rounded down.":
        lambda r, d, o, h: _charged(r, d, math.ceil(o * len(r)), h),
    "ρN is rounded to the nearest; the count is ⌊ρN⌋, rounded down.":
        lambda r, d, o, h: _charged(r, d, round(o * len(r)), h),
    "The distances are not sorted: these are the first ⌊ρN⌋, not the closest.":
        lambda r, d, o, h: _charged(r[:int(o * len(r))], d, len(r), h),
    "The trimming comes after the gate: ⌊ρN⌋ of *all* N pairs are in the sum.":
        lambda r, d, o, h: _charged(s := r[r <= d], d, int(o * len(s)), h),
    "This is Huber's loss with ½, as in many textbooks; this book's is r² up to δ.":
        lambda r, d, o, h: cost_of(r, d, o, h) / 2,
    "The distances are squared before Huber's loss; it takes lengths in metres.":
        lambda r, d, o, h: _charged(r**2, d, int(o * len(r)), h),
    "This is the sum; divide it by N.": lambda r, d, o, h: cost_of(r, d, o, h) * len(r),
    "The farthest pairs are in the sum; the closest ⌊ρN⌋ are to be.":
        lambda r, d, o, h: huber_loss(np.minimum(np.sort(r)[-int(o * len(r)):], d), h).sum() / 11,
}, tolerance=1e-9)
def cost_of(distances: FloatArray, d_max: float, overlap_ratio: float, delta: float) -> float:
    """Huber's loss by its two branches."""
    closest = [min(r, d_max) for r in sorted(distances)[: int(overlap_ratio * len(distances))]]
    losses = [r * r if r <= delta else 2 * delta * r - delta**2 for r in closest]
    return math.fsum(losses) / len(distances)


@cache
def _turned() -> Arguments:
    looks = {degrees: transform(0.3, 0.2, np.radians(degrees)) for degrees in (10.0, 25.0)}
    older = _look(np.eye(3))
    return {f"a robot that turned by {d:g}°": (_look(T), older) for d, T in looks.items()}


def _steps(p: FloatArray, q: FloatArray, chain: Any, rounds: int = 30) -> FloatArray:
    target, total = Target(q), np.eye(3)
    for _ in range(rounds):
        dT = align(p, target.points[target.search.query(p)[0]])
        p, total = apply(dT, p), chain(dT, total)
    return total


@exercise("Find the bug", _turned, {
    "The steps are multiplied in the wrong order: think of which step acts first on a point.":
        lambda p, q: _steps(p, q, lambda dT, T: T @ dT),
    "This is the last step alone; the answer is the product of all.":
        lambda p, q: _steps(p, q, lambda dT, T: dT),
    "This is the inverse: it maps the target onto the source.":
        lambda p, q: invert(colleagues_icp(p, q)),
    "Each step is inverted before it is multiplied; it maps source onto target already.":
        lambda p, q: _steps(p, q, lambda dT, T: invert(dT) @ T),
    "The translations are added; each step turns what was moved before it.":
        lambda p, q: _steps(p, q, lambda dT, T: np.block([
            [(dT @ T)[:2, :2], T[:2, 2:] + dT[:2, 2:]], [0.0, 0.0, 1.0]])),
    "This is one step; asked for are thirty.":
        lambda p, q: _steps(p, q, lambda dT, T: dT @ T, rounds=1),
})
def colleagues_icp(source: FloatArray, target: FloatArray) -> FloatArray:
    """Each step acts after all before it."""
    return _steps(source, target, lambda dT, T: dT @ T)


def _first(mask: Any) -> int:
    return int(np.argmax(mask))


@exercise("Any, or both", {
    "a run whose translation is small once by chance": (
        np.array([0.1, 0.02, 0.0005, 0.004, 0.002, 0.0008, 0.0004, 0.0]),
        np.array([0.2, 0.1, 0.05, 0.02, 0.0009, 0.003, 0.0002, 0.0]), 1e-3),
    "a run whose rotation is small first, and once exactly at the tolerance": (
        np.array([0.5, 0.25, 0.25, 0.25, 0.1, 0.1, 0.3, 0.1]),
        np.array([0.5, 0.5, 0.25, 0.1, 0.3, 0.2, 0.1, 0.1]), 0.25),
}, {
    "The two are exchanged: any holds first, both later.":
        lambda t, r, e: first_stops(t, r, e)[::-1],
    "These are the first small steps of each kind; both have to be small in the *same* iteration.":
        lambda t, r, e: (_first(t < e), _first(r < e)),
    "The second is where the later kind is small first; both have to be small at the same time.":
        lambda t, r, e: (first_stops(t, r, e)[0], max(_first(t < e), _first(r < e))),
    "These count from 1; an index counts from 0.":
        lambda t, r, e: tuple(one + 1 for one in first_stops(t, r, e)),
    "A step exactly at the tolerance is not below it.":
        lambda t, r, e: first_stops(t, r, e * (1 + 1e-9)),
    "The two steps are added; hold each against the tolerance by itself.":
        lambda t, r, e: (first_stops(t, r, e)[0], _first(t + r < e)),
    "These are the last iterations that move; asked for are the first that stop.":
        lambda t, r, e: tuple(one - 1 for one in first_stops(t, r, e)),
    "These are numbers of iterations that are small; asked for are indices.":
        lambda t, r, e: (np.sum((t < e) | (r < e)), np.sum((t < e) & (r < e))),
})
def first_stops(translation_steps: Any, rotation_steps: Any, tolerance: float) -> tuple[int, int]:
    """One iteration after the other."""
    small = [(t < tolerance, r < tolerance)
             for t, r in zip(translation_steps, rotation_steps, strict=True)]
    return [any(one) for one in small].index(True), [all(one) for one in small].index(True)


@cache
def _two_gates() -> Arguments:
    T = transform(0.5, 0.2, 1.2)
    older, newer = _look(np.eye(3)), _look(T).copy()
    newer[::5] += (0.6, 0.3)  # what has moved between the scans
    far = T @ transform(-0.3, -0.2, -0.1)
    return {f"gates of {a:g} m and {b:g} m": (newer, older, far, (a, b))
            for a, b in ((1.0, 0.1), (0.8, 0.15))}


def _end(p: FloatArray, q: FloatArray, T: FloatArray, gate: float | None) -> FloatArray:
    gates = {} if gate is None else {"max_correspondence_distance": gate}
    return icp(p, q, T, IcpParameters(**gates)).T_target_source


def _through(p: FloatArray, q: FloatArray, T: FloatArray, gates: Any) -> FloatArray:
    for gate in gates:
        T = _end(p, q, T, gate)
    return T


@exercise("Start wide, end narrow", _two_gates, {
    "Each run starts from the first guess again; start it from where the last one ended.":
        lambda p, q, T, gates: _end(p, q, T, gates[-1]),
    "The narrow gate comes first; take the gates in their order.":
        lambda p, q, T, gates: _through(p, q, T, gates[::-1]),
    "Only the first gate is used: is the `return` inside the loop?":
        lambda p, q, T, gates: _end(p, q, T, gates[0]),
    "The guess is not used: the first run starts from `T_init`.":
        lambda p, q, T, gates: _through(p, q, np.eye(3), gates),
    "The gates do not reach the runs: pass `IcpParameters(max_correspondence_distance=gate)`.":
        lambda p, q, T, gates: _through(p, q, T, [None, None]),
    "The ends are multiplied; a run returns the whole motion, its guess included.":
        lambda p, q, T, gates: _through(p, q, T, gates) @ _end(p, q, T, gates[0]),
    "The ends are multiplied; a run returns the whole motion, guess included.":
        lambda p, q, T, gates: _end(p, q, _end(p, q, T, gates[0]), gates[1]) @ _end(
            p, q, T, gates[0]) @ T,
    "Source and target are swapped: the newer scan is the source.":
        lambda p, q, T, gates: _through(q, p, T, gates),
    "The guess comes back as it was: no run reaches it.": lambda p, q, T, gates: T,
}, tolerance=1e-9)
def match_through_gates(source: Any, target: Any, T_init: Any, gates: Any) -> FloatArray:
    """Each run from where the last one ended."""
    return _through(source, target, T_init, gates)


@cache
def _errors() -> Arguments:
    T = transform(0.8, -0.6, 0.5)
    errors = np.radians([-170.0, -8.0, 0.0, 8.0, 100.0])
    told = IcpParameters(max_correspondence_distance=0.5)
    return {"guesses turned by −170°, −8°, 0°, 8° and 100°": (
        _look(T), _look(np.eye(3)), T, errors, told)}


def _headings(p: Any, q: Any, guesses: Any, told: Any) -> Any:
    return to_xytheta(np.array([icp(p, q, T, told).T_target_source for T in guesses]))[:, 2]


def _missed(p: Any, q: Any, T: Any, errors: Any, told: Any) -> Any:
    guesses = [T @ transform(0, 0, each) for each in errors]
    return wrap(_headings(p, q, guesses, told) - to_xytheta(T)[2])


@exercise("How far the heading may be off", _errors, {
    "This asks how far a run went from its guess; ask how far its end is from the truth.":
        lambda p, q, T, e, told: abs(wrap(_missed(p, q, T, e, told) - e)) < np.radians(2),
    "A heading is compared with 2 as if it were in degrees; it is in radians.":
        lambda p, q, T, e, told: abs(_missed(p, q, T, e, told)) < 2,
    "These are the runs that end at a *wrong* heading.":
        lambda p, q, T, e, told: abs(_missed(p, q, T, e, told)) >= np.radians(2),
    "The error keeps its sign, so that a heading far to the right passes: take its size.":
        lambda p, q, T, e, told: _missed(p, q, T, e, told) < np.radians(2),
    "The errors are turned into radians once more; they are radians already.":
        lambda p, q, T, e, told: headings_that_work(p, q, T, np.radians(e), told),
    "The heading is held against 0, not against the true one.":
        lambda p, q, T, e, told: abs(_missed(p, q, T, e, told) + to_xytheta(T)[2]) < np.radians(2),
    "These are the headings' errors; asked for is a mask: which are below 2°?":
        lambda p, q, T, e, told: _missed(p, q, T, e, told),
})
def headings_that_work(
    source: Any, target: Any, T_true: Any, errors: Any, parameters: Any
) -> FloatArray:
    """The error of the end, in either direction."""
    return np.asarray(abs(_missed(source, target, T_true, errors, parameters)) < np.radians(2))


def _changes(a: FloatArray, b: FloatArray, first: Any, second: Any) -> tuple[Any, Any]:
    return first(b) - first(a), second(b) - second(a)


@exercise("The price of a lost pair", {
    "a pair that leaves the gate": (np.array([0.1, 0.2, 0.4]), np.array([0.1, 0.2, 0.9]), 0.5),
    "a pair that comes in through the gate": (
        np.array([0.3, 0.1, 0.8, 0.6]), np.array([0.2, 0.1, 0.4, 0.7]), 0.5),
}, {
    "The signs are wrong: a change is the value after the step minus the value before.":
        lambda a, b, g: change_of_both(b, a, g),
    "The cost charges nothing for a pair outside; charge it as if it stood on the gate.":
        lambda a, b, g: _changes(a, b, lambda d: (d[d <= g] ** 2).mean(),
                                 lambda d: (d**2 * (d <= g)).mean()),
    "The mean square is divided by all pairs; divide it by the pairs within the gate.":
        lambda a, b, g: _changes(a, b, lambda d: (d**2 * (d <= g)).mean(),
                                 lambda d: (np.minimum(d, g) ** 2).mean()),
    "The cost is not cut off at the gate.":
        lambda a, b, g: _changes(a, b, lambda d: (d[d <= g] ** 2).mean(), lambda d: (d**2).mean()),
    "The pairs within the gate are those *before* the step, for both numbers.":
        lambda a, b, g: ((b[a <= g] ** 2).mean() - (a[a <= g] ** 2).mean(),
                         change_of_both(a, b, g)[1]),
    "The first is the change of the RMSE; asked for is that of the mean square.":
        lambda a, b, g: _changes(a, b, lambda d: (d[d <= g] ** 2).mean() ** 0.5,
                                 lambda d: (np.minimum(d, g) ** 2).mean()),
    "These are means of distances; asked for are means of their squares.":
        lambda a, b, g: _changes(a, b, lambda d: d[d <= g].mean(),
                                 lambda d: np.minimum(d, g).mean()),
    "These are sums; asked for are means.":
        lambda a, b, g: _changes(a, b, lambda d: (d[d <= g] ** 2).sum(),
                                 lambda d: (np.minimum(d, g) ** 2).sum()),
    "The cost is a sum here; divide it by all N pairs.":
        lambda a, b, g: _changes(a, b, lambda d: (d[d <= g] ** 2).mean(),
                                 lambda d: (np.minimum(d, g) ** 2).sum()),
}, tolerance=1e-9)
def change_of_both(before: FloatArray, after: FloatArray, gate: float) -> tuple[Any, Any]:
    """After minus before."""
    return _changes(before, after, lambda d: (d[d <= gate] ** 2).mean(),
                    lambda d: (np.minimum(d, gate) ** 2).mean())


def _look(T_first_scanner: FloatArray) -> FloatArray:
    scanner = Lidar(beam_count=361, field_of_view=2 * np.pi)
    return cast(room(), transform(1.0, -0.5, 0.3) @ T_first_scanner, scanner, rng=8).points
