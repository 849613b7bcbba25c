"""Chapter 1: motions of the plane, and the order in which they chain."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from labkit import IcpParameters, Target, align, apply, icp, invert, transform
from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import Arguments, exercise
from labkit.se2 import rotation
from labkit.simulation import Lidar, cast, room


def put(T: FloatArray, R: Any = None, t: Any = None) -> FloatArray:
    """The transform with another rotation or translation."""
    T = T.copy()
    T[:2, :2], T[:2, 2] = T[:2, :2] if R is None else R, T[:2, 2] if t is None else t
    return T


# fmt: off
@exercise("Motion between two poses", {
    "a robot that bends left": (transform(2.0, 1.0, 0.5), transform(2.4, 1.3, 0.9)),
    "a robot that bends right": (transform(1.0, 0.0, 1.6), transform(1.1, 1.0, 1.4)),
}, {
    "This is the motion seen from the world: in the names, equal letters must meet in the middle.":
        lambda k, k1: k1 @ invert(k),
    "This is the way back, from the newer pose to the older one: the inverse of what is asked.":
        lambda k, k1: invert(k1) @ k,
    "This is the way back, and seen from the world.": lambda k, k1: k @ invert(k1),
    "The inverse is missing: in `T_w_k @ T_w_k1` the letters `k` and `w` meet.":
        lambda k, k1: k @ k1,
    "The inverse is missing, and the order is wrong: `T_w_k1 @ T_w_k`.": lambda k, k1: k1 @ k,
    "The whole (3, 3) is transposed; that inverts a rotation, not a transform.":
        lambda k, k1: k.T @ k1,
    "The matrices are subtracted; motions are chained by products.": lambda k, k1: k1 - k,
    "The translation is measured along the *world's* axes; the robot at time k is turned.":
        lambda k, k1: put(motion_between(k, k1), t=k1[:2, 2] - k[:2, 2]),
    "The translation is turned by R; from the world into the robot's frame it is R transposed.":
        lambda k, k1: put(motion_between(k, k1), t=k[:2, :2] @ (k1[:2, 2] - k[:2, 2])),
})
def motion_between(T_w_k: FloatArray, T_w_k1: FloatArray) -> FloatArray:
    """Positions are turned into the older frame, headings subtracted."""
    R = T_w_k[:2, :2].T
    return put(np.eye(3), R @ T_w_k1[:2, :2], R @ (T_w_k1[:2, 2] - T_w_k[:2, 2]))


@exercise("Turn about a point", {
    "a turn by 0.7 rad about (2, −1)": (np.array([2.0, -1.0]), 0.7),
    "a turn by −2 rad about (0.5, 3)": (np.array([0.5, 3.0]), -2.0),
}, {
    "This turns about the origin; bring `c` there first.": lambda c, a: turn_about(0 * c, a),
    "This turns about −c: bring `c` *to* the origin first, by a shift of −c.":
        lambda c, a: turn_about(-c, a),
    "The plane is turned about the origin, then moved by `c`: bring `c` to the origin first.":
        lambda c, a: transform(*c, a),
    "`c` is brought to the origin and the plane turned, but `c` is not brought back.":
        lambda c, a: transform(0, 0, a) @ transform(*-c, 0),
    "The plane is moved by `c` and turned: move it by −c, turn it, and move it back.":
        lambda c, a: transform(0, 0, a) @ transform(*c, 0),
    "The angle is taken for degrees; `theta` is in radians.":
        lambda c, a: turn_about(c, math.radians(a)),
    "The angle is turned into degrees before its sine and cosine are taken.":
        lambda c, a: turn_about(c, math.degrees(a)),
    "This turns the other way about `c`: the sign of θ, or R is transposed.":
        lambda c, a: turn_about(c, -a),
})
def turn_about(c: FloatArray, theta: float) -> FloatArray:
    """The point c stays where it is."""
    return put(np.eye(3), rotation(theta), c - rotation(theta) @ c)


@cache
def _two_looks() -> Arguments:
    looks = [_look(T, 181, seed) for seed, T in enumerate((np.eye(3), transform(0.1, 0.05, 0.05)))]
    return {f"a gate of {gate:g} m": (looks[1], looks[0], gate) for gate in (0.05, 2.0)}


def _run(p: FloatArray, q: FloatArray, gate: float) -> Any:
    return icp(p, q, parameters=IcpParameters(max_correspondence_distance=gate))


@exercise("A gate and what it reports", _two_looks, {
    "The gate does not reach the run: it is `max_correspondence_distance` of "
    "`labkit.IcpParameters`, and these are the `parameters=`.":
        lambda p, q, gate: match_and_count(p, q, IcpParameters().max_correspondence_distance),
    "The first number is `fitness`, the share that was kept; the count is `inlier_count`.":
        lambda p, q, gate: (_run(p, q, gate).fitness, _run(p, q, gate).inlier_rmse),
    "Source and target are swapped: the newer scan is the source.":
        lambda p, q, gate: match_and_count(q, p, gate),
    "The first number counts all points; asked for are those that were kept.":
        lambda p, q, gate: (len(p), _run(p, q, gate).inlier_rmse),
    "The gate is squared; it is a length in metres.":
        lambda p, q, gate: match_and_count(p, q, gate**2),
    "The second number is the mean square; asked for is its root.":
        lambda p, q, gate: (_run(p, q, gate).inlier_count, _run(p, q, gate).inlier_rmse ** 2),
})
def match_and_count(source: FloatArray, target: FloatArray, gate: float) -> tuple[int, float]:
    """Both numbers stand in the result."""
    result = _run(source, target, gate)
    return result.inlier_count, result.inlier_rmse


def _shares(off: FloatArray, far: Any) -> tuple[Any, ...]:
    return np.mean(off[~far] > 0.10), np.mean(off[far] > 0.10)


@exercise("Turns harm the far points", {
    "eight points, of which one near and all far ones have a wrong neighbour": (
        np.array([0.01, 0.30, 0.02, 0.05, 0.40, 0.20, 0.15, 0.13]),
        np.array([1.0, 2.0, 1.5, 0.5, 7.0, 6.0, 5.0, 8.0]),
    ),
    "eight points, two of them far away, one exactly 0.10 m off": (
        np.array([0.06, 0.05, 0.3, 0.1, 0.4, 0.02, 0.03, 0.5]),
        np.array([1.4, 1.2, 1.0, 11.0, 20.2, 2.0, 30.2, 60.0]),
    ),
}, {
    "These are counts; a share is the mean of the mask.":
        lambda off, r: tuple(len(r) / 2 * one for one in wrong_near_and_far(off, r)),
    "The shares are of all points; divide by the number of points in each half.":
        lambda off, r: tuple(one / 2 for one in wrong_near_and_far(off, r)),
    "Near and far are exchanged.": lambda off, r: wrong_near_and_far(off, r)[::-1],
    "The halves part at the *mean* range; half of the points lie on either side of the median.":
        lambda off, r: _shares(off, r > r.mean()),
    "The halves part in the middle between the smallest and the largest range; take the median.":
        lambda off, r: _shares(off, r > (r.min() + r.max()) / 2),
    "The halves part at half of the largest range; take the median.":
        lambda off, r: _shares(off, r > r.max() / 2),
    "These are the shares of *right* neighbours, off by at most 0.10 m.":
        lambda off, r: tuple(1 - one for one in wrong_near_and_far(off, r)),
    "A point exactly 0.10 m off counts as wrong here; only those above 0.10 m are.":
        lambda off, r: _shares(off + 1e-9, r > np.median(r)),
    "The points are parted by how far they are off; part them by their range.":
        lambda off, r: _shares(off, off > np.median(off)),
    "These are means of `off`; asked for is the share above 0.10 m.":
        lambda off, r: (off[r <= np.median(r)].mean(), off[r > np.median(r)].mean()),
})
def wrong_near_and_far(off: FloatArray, ranges: FloatArray) -> tuple[Any, ...]:
    """The median parts the points in halves."""
    return _shares(off, ranges > np.median(ranges))


@cache
def _three_turns() -> Arguments:
    cases, older = {}, _look(np.eye(3), 361, 0)
    for degrees in (0.0, 90.0, 180.0):
        T = transform(0.35, 0.10, np.radians(degrees))
        guess = transform(0.0, 0.0, np.radians(8.0)) @ T
        cases[f"a robot that turns by {degrees:g}°"] = (_look(T, 361, 1), older, guess)
    return cases


def _loop(p: FloatArray, q: FloatArray, T: FloatArray, update: Any = lambda dT, T: dT @ T,
          move: Any = apply, rounds: int = 15) -> FloatArray:
    target = Target(q)
    for _ in range(rounds):
        moved = move(T, p)
        T = update(align(moved, target.points[target.search.query(moved)[0]]), T)
    return T


@exercise("Your first loop", _three_turns, {
    "The step is composed on the wrong side, `T @ dT`. It was estimated in the target's frame, so "
    "it acts after `T`: `dT @ T`.": lambda p, q, T: _loop(p, q, T, lambda dT, T: T @ dT),
    "The pairs are those of the unmoved points: move the source by `T` before the search.":
        lambda p, q, T: _loop(p, q, T, move=lambda T, p: p),
    "This is the last step alone, `T = dT`; chain the steps, `dT @ T`.":
        lambda p, q, T: _loop(p, q, T, lambda dT, T: dT),
    "Source and target are swapped in `align`: it maps its first points onto its second.":
        lambda p, q, T: _loop(p, q, T, lambda dT, T: invert(dT) @ T),
    "The guess is not used: begin with `T = T_init`.": lambda p, q, T: _loop(p, q, np.eye(3)),
    "The guess comes back as it was: no step reaches `T`.": lambda p, q, T: T,
    "This is one round; asked for are fifteen.": lambda p, q, T: _loop(p, q, T, rounds=1),
    "R of the step is transposed: it turns the wrong way.":
        lambda p, q, T: _loop(p, q, T, lambda dT, T: put(dT, dT[:2, :2].T) @ T),
    "This is the motion since the guess; the guess is a part of the answer.":
        lambda p, q, T: _loop(p, q, T) @ invert(T),
    "This is the inverse: it maps the target onto the source.":
        lambda p, q, T: invert(_loop(p, q, T)),
}, tolerance=0.02)
def icp_by_hand(source: FloatArray, target: FloatArray, T_init: FloatArray) -> FloatArray:
    """Each loop that converges ends within the tolerance of this one."""
    return _loop(source, target, T_init)
# fmt: on


def _look(T_first_scanner: FloatArray, beams: int, seed: int) -> FloatArray:
    """What a scanner that sees all round finds in a room [m]."""
    scanner = Lidar(beam_count=beams, field_of_view=2 * np.pi)
    T_room_first = transform(1.0, -0.5, 0.3)
    return cast(room(), T_room_first @ T_first_scanner, scanner, rng=seed).points
