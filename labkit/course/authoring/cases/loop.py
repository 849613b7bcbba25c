"""Cases on the convergence test, the ICP step and the loop: scans that overlap in part."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.authoring.edits import readings
from labkit.course.authoring.entries import Arguments, Draw, Exact, Recipes, Rng, points, uniform
from labkit.course.authoring.references import apart, path

STEP, TURN, COST, BUDGET = 1e-3, 1e-3, 1e-6, 50  # of the convergence test
DIAGONAL = math.pi / 4
LOOP_BUDGET = 60
FAR = 1.0  # rad: at less than 60° an update on the wrong side slows down; it does not diverge
OFF = 50.0  # m: a gate or a δ that does nothing


def _ending(
    step: float,
    turn: float,
    cost: float = -0.01,
    iteration: int = 10,
    heading: float | None = None,
    half_turn: bool = False,
) -> Draw:
    """A step of that many tolerances; ``step=0.5`` is half of ε_t. A heading fixes its way."""

    def draw(rng: Rng) -> Arguments:
        way = uniform(rng, -3.0, 3.0) if heading is None else heading
        vary = uniform(rng, 0.95, 1.05)
        x, y = vary * step * STEP * math.cos(way), vary * step * STEP * math.sin(way)
        dT = labkit.transform(x, y, math.pi * half_turn + vary * turn * TURN)
        return dT, vary * cost, iteration, STEP, TURN, COST, BUDGET

    return draw


def _ending_at(step: float, cost: float) -> Exact:
    """A step whose shift, or change of cost, may be the tolerance itself."""
    dT = labkit.transform(STEP * step, 0.0, 0.2 * TURN)
    return Exact((dT, cost, 10, STEP, TURN, COST, BUDGET))


def _scans(
    count: int,
    gate: float,
    ratio: float,
    delta: float,
    *,
    turn: float = 0.1,
    error: float = 0.05,
    loop: int = 0,
) -> Draw:
    """Two scans of the same posts, each with some that the other does not see.

    `loop` is the budget of the whole loop, 0 for a single step. `turn` [rad] is the size of the
    true rotation, `error` [rad, and thrice it in m] that of the guess. Posts that moved a little
    between the scans keep Huber's weights at work.
    """

    def draw(rng: Rng) -> Arguments:
        x, y, side, other = rng.choice([-1.0, 1.0], 4)
        T = labkit.transform(0.4 * x, 0.4 * y, side * turn * uniform(rng, 0.95, 1.03))
        posts = points(rng, count, 5.0)
        shifted = posts + rng.normal(0.0, 0.01, posts.shape)
        some = rng.permutation(count)[: count // 4]
        shifted[some] += rng.normal(0.0, 0.15, (len(some), 2)) + 0.1
        source = np.vstack([_back(T, shifted), points(rng, count // 5, 6.0)])
        target = np.vstack([posts, points(rng, 3, 6.0)])
        away = other * error * uniform(rng, 0.8, 1.2)
        guess = labkit.transform(3.0 * away, -2.0 * away, away) @ T
        arguments = (np.round(source, 3), np.round(target, 3), guess, gate, ratio, delta)
        return (*arguments, loop) if loop else arguments

    return draw


def _back(T: FloatArray, q: FloatArray) -> FloatArray:
    """The points before the motion T."""
    return labkit.apply(labkit.invert(T), q)


def _loop(count: int, gate: float, ratio: float, delta: float) -> Draw:
    """The whole loop from a guess far from no motion, with a budget that is enough."""
    return _scans(count, gate, ratio, delta, turn=FAR, loop=LOOP_BUDGET)


def _from_no_motion(rng: Rng) -> Arguments:
    source, target, _, *limits = _scans(16, 1.2, 0.8, 0.15, turn=0.03)(rng)
    return source, target, np.eye(3), *limits


def _walls(rng: Rng) -> Arguments:
    """Dense walls about a corner: each step slides a little, and the last ones are short."""
    along, across = np.arange(0.0, 3.6, 0.24), np.arange(0.2, 2.4, 0.22)

    def look() -> FloatArray:
        x = np.append(along + rng.uniform(0.0, 0.1), np.full(len(across), 3.6))
        y = np.append(np.zeros(len(along)), across + rng.uniform(0.0, 0.1))
        return np.column_stack([x, y]) + rng.normal(0.0, 0.012, (len(x), 2))

    T = labkit.transform(uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5), uniform(rng, 0.97, 1.02))
    guess = labkit.transform(uniform(rng, 0.15, 0.3), uniform(rng, -0.2, -0.1), 0.06) @ T
    scans = np.round(_back(T, look()), 3), np.round(look(), 3)
    return *scans, guess, 1.5, 0.9, 0.05, 2 * LOOP_BUDGET


def _straight_ahead(rng: Rng) -> Arguments:
    """A scene with two equal sides and a guess that is off straight ahead: no step turns."""
    side = np.column_stack([rng.permutation(np.arange(-6.0, 6.0, 1.2)), rng.uniform(1.0, 4.0, 10)])
    moved = side + np.column_stack([rng.normal(0.0, 0.15, 10), np.zeros(10)])
    posts, seen = (np.round(np.vstack([one, one * (1.0, -1.0)]), 3) for one in (side, moved))
    ahead = labkit.transform(uniform(rng, 0.2, 0.5), 0.0, 0.0)
    lonely = posts[[0, 10]] + [(0.0, 60.0), (0.0, -60.0)]  # beyond the gate, and heavy in an RMSE
    guess = labkit.transform(uniform(rng, 0.7, 0.9), 0.0, 0.0) @ ahead
    source = np.round(_back(ahead, np.vstack([seen, lonely])), 6)
    return source, posts, guess, 3.0, 1.0, 0.02, 2 * LOOP_BUDGET


def _on_the_spot(rng: Rng) -> Arguments:
    """A scene that looks the same from behind, and a guess that is turned: no step shifts.

    It is drawn until twenty steps do not lead to the end.
    """
    while True:
        arguments: Any = _about_the_origin(rng)
        found = path(readings("icp_step")[0], *arguments)
        if apart(found[min(20, len(found) - 1)], found[-1]) > 3e-4:
            return tuple(arguments)


def _about_the_origin(rng: Rng) -> Arguments:
    angle, far = rng.permutation(np.arange(10) * 0.31), rng.uniform(2.0, 5.0, 10)
    T = labkit.transform(0.0, 0.0, uniform(rng, 0.3, 0.5))
    guess = labkit.transform(0.0, 0.0, uniform(rng, 0.1, 0.15)) @ T
    half, seen = (
        np.column_stack([far * np.cos(one), far * np.sin(one)])
        for one in (angle, angle + rng.normal(0.0, 0.15, 10))
    )
    source, posts = np.round(_back(T, seen), 6), np.round(half, 6)
    both = np.vstack([source, -source]), np.vstack([posts, -posts])
    return *both, guess, 3.0, 1.0, 0.05, 2 * LOOP_BUDGET


CORNERS = np.array([[0, 0], [8, 0], [16, 2], [2, 10], [12, 12], [-8, 6], [-20, -20]])


def _about_the_gate(
    gate: float, *beyond: float, apart: float = 0.25, delta: float = 10.0, loop: int = 0
) -> Draw:
    """Pairs that are some `apart` [m], and others that lie so far `beyond` the gate, or on it."""

    def draw(rng: Rng) -> Arguments:
        target = CORNERS[: 5 + len(beyond)]
        target = gate * (target + rng.integers(-4, 5, target.shape) / 4)
        source = target.copy()
        source[:5] += apart * np.array([[1, 0], [0, 1], [1, 1], [-1, 2], [2, 1]])
        source[5:, 1] -= gate + np.array(beyond)
        arguments = (source, target, np.eye(3), gate, 1.0, delta)
        return (*arguments, loop) if loop else arguments

    return draw


_LOOP_AT_THE_GATE = _about_the_gate(2.0, 0.05, 6.0, apart=0.02, delta=0.02, loop=LOOP_BUDGET)


# fmt: off
RECIPES = {
    "has_converged": Recipes({
        "a tiny step": _ending(0.3, 0.3),
        "a long step": _ending(90.0, 90.0, cost=0.01),
        "no shift, but a turn to the left": _ending(0.1, 60.0),
        "a cost that stands still": _ending(90.0, 90.0, cost=1e-7),
        "a shift, but no turn": _ending(60.0, 0.1, cost=0.02),
        "no shift, but a turn to the right": _ending(0.1, -60.0),
        "the last iteration of the budget": _ending(90.0, 90.0, iteration=50),
        "the last but one iteration": _ending(90.0, 90.0, iteration=49),
        "a cost that fell by next to nothing": _ending(60.0, 60.0, cost=-1e-7),
        "a tiny step to the right": _ending(0.4, -0.4, cost=0.01),
    }, {
        "a step below both tolerances": _ending(0.6, 0.5),
        "a step below both, to the right": _ending(0.5, -0.6),
        "a step just below both tolerances": _ending(0.8, 0.8),
        "a cost that rose by next to nothing": _ending(80.0, 70.0, cost=2e-7),
        "a cost that fell by next to nothing": _ending(80.0, -70.0, cost=-2e-7),
        "the last iteration of the budget": _ending(80.0, 70.0, iteration=50),
        "an iteration past the budget": _ending(80.0, -70.0, iteration=51),
        "a cost that did not change": _ending(200.0, 150.0, cost=0.0),
        "a turn to the left without a shift": _ending(0.2, 60.0, cost=0.01),
        "a turn to the right without a shift": _ending(0.2, -60.0),
        "a shift without a turn": _ending(300.0, 0.2),
        "a shift of a few tolerances": _ending(8.0, 0.2, cost=0.02),
        "a shift aslant": _ending(1.3, 0.2, heading=DIAGONAL),
        "a cost that fell much": _ending(40.0, 90.0, cost=-0.5),
        "the last but one iteration": _ending(80.0, 70.0, cost=0.01, iteration=49),
        "half a turn on the spot": _ending(0.2, -0.4, half_turn=True),
        "a shift exactly at its tolerance": _ending_at(1.0, 0.01),
        "a cost exactly at its tolerance": _ending_at(80.0, COST),
        "a cost just below its tolerance": _ending(70.0, 60.0, cost=8e-7),
        "a tiny step, a cost that stands still": _ending(0.3, -0.2, cost=1e-7),
    }),
    "icp_step": Recipes({
        "all stages at work": _scans(20, 0.8, 0.7, 0.12),
        "the guess is no motion": _from_no_motion,
        "the gate alone": _scans(20, 0.6, 1.0, OFF),
        "trimming alone": _scans(20, OFF, 0.7, OFF),
        "the weights alone": _scans(20, OFF, 1.0, 0.1),
        "a pair on the gate": Exact(_about_the_gate(0.5, 0.0, apart=0.0625)),
        "a pair a little beyond a wide gate": _about_the_gate(2.0, 0.0005, 6.0),
    }, {
        "the gate alone": _scans(24, 0.6, 1.0, OFF),
        "the gate alone, in clutter": _scans(30, 0.5, 1.0, OFF),
        "trimming alone": _scans(24, OFF, 0.65, OFF),
        "the weights alone": _scans(24, OFF, 1.0, 0.1),
        "all stages at work": _scans(30, 0.45, 0.9, 0.1),
        "a guess far from no motion": _scans(24, 0.5, 0.95, 0.15, turn=FAR),
        "a pair on the gate": Exact(_about_the_gate(0.5, 0.0, apart=0.0625)),
        "a pair a little beyond a wide gate": _about_the_gate(2.0, 0.0005, 6.0),
    }),
    "icp": Recipes({
        "all stages at work": _scans(20, 0.9, 0.8, 0.1, loop=LOOP_BUDGET),
        "a guess far from no motion": _loop(20, 0.8, 0.8, 0.1),
        "a budget that ends the loop": _scans(20, 1.5, 0.8, 0.1, error=0.15, loop=3),
        "a way straight ahead, without a turn": _straight_ahead,
        "a turn on the spot, without a shift": _on_the_spot,
        "a pair a little beyond a wide gate": _LOOP_AT_THE_GATE,
    }, {
        "the gate alone": _loop(28, 0.45, 1.0, OFF),
        "trimming alone": _loop(24, OFF, 0.7, OFF),
        "the weights alone": _loop(24, OFF, 1.0, 0.1),
        "all stages at work": _loop(30, 0.5, 0.9, 0.1),
        "a guess far from no motion": _loop(24, 0.6, 1.0, 0.15),
        "a budget that ends the loop": _scans(24, 1.5, 0.8, 0.1, error=0.15, loop=3),
        "a small budget that ends the loop": _scans(24, 1.2, 0.9, 0.1, error=0.12, loop=2),
        "five pairs": _loop(5, 2.0, 0.85, 0.1),
        "walls along which each step slides a little": _walls,
        "a way straight ahead, without a turn": _straight_ahead,
        "a turn on the spot, without a shift": _on_the_spot,
        "a pair a little beyond a wide gate": _LOOP_AT_THE_GATE,
    }),
}
