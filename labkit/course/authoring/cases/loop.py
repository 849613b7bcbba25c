"""Cases on the convergence test, the ICP step and the loop: scans that overlap in part."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.arrays import FloatArray
from labkit.course.authoring.entries import Draw, Recipe, Recipes, points, uniform
from labkit.course.grading.contract import Value

STEP, TURN, COST, BUDGET = 1e-3, 1e-3, 1e-6, 50  # of the convergence test
DIAGONAL = math.pi / 4
HALF_TURN = 1000.0 * math.pi
LOOP_BUDGET = 60
FAR = 1.0  # rad: at less than 60° an update on the wrong side slows down; it does not diverge


def _ending(
    step: float = 0.1,
    turn: float = 0.1,
    cost: float = -0.01,
    iteration: int = 10,
    heading: float | None = None,
) -> Draw:
    """A step of that many tolerances; ``step=0.5`` is half of ε_t. A heading fixes its way."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        way = uniform(rng, -3.0, 3.0) if heading is None else heading
        vary = uniform(rng, 0.95, 1.05)
        dT = labkit.transform(
            vary * step * STEP * math.cos(way),
            vary * step * STEP * math.sin(way),
            vary * turn * TURN if abs(turn) < 1000 else turn * TURN - 0.0004 * vary,
        )
        return dT, vary * cost, iteration, STEP, TURN, COST, BUDGET

    return draw


def _scans(
    count: int,
    *,
    gate: float,
    ratio: float,
    delta: float,
    turn: float = 0.1,
    error: float = 0.05,
    loop: int = 0,
) -> Draw:
    """Two scans of the same posts, each with some that the other does not see.

    `loop` is the budget of the whole loop, 0 for a single step. `turn` [rad] is the size of the
    true rotation, `error` [rad, and thrice it in m] that of the guess. Posts that moved a little
    between the scans keep Huber's weights at work.
    """

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        x, y, side, other = rng.choice([-1.0, 1.0], 4)
        T = labkit.transform(0.4 * x, 0.4 * y, side * turn * uniform(rng, 0.95, 1.03))
        posts = points(rng, count, 5.0)
        shifted = posts + rng.normal(0.0, 0.01, posts.shape)
        some = rng.permutation(count)[: count // 4]
        shifted[some] += rng.normal(0.0, 0.15, (len(some), 2)) + 0.1
        source = labkit.apply(labkit.invert(T), shifted)
        lonely = points(rng, count // 5, 6.0)
        source, target = np.vstack([source, lonely]), np.vstack([posts, points(rng, 3, 6.0)])
        away = other * error * uniform(rng, 0.8, 1.2)
        guess = labkit.compose(labkit.transform(3.0 * away, -2.0 * away, away), T)
        arguments = (np.round(source, 3), np.round(target, 3), guess, gate, ratio, delta)
        return (*arguments, loop) if loop else arguments

    return draw


def _from_no_motion(rng: np.random.Generator) -> tuple[Value, ...]:
    source, target, _, *limits = _scans(16, gate=1.2, ratio=0.8, delta=0.15, turn=0.03)(rng)
    return source, target, np.eye(3), *limits


def _walls(rng: np.random.Generator) -> tuple[Value, ...]:
    """Dense walls about a corner: each step slides a little, and the last ones are short."""
    along, across = np.arange(0.0, 3.6, 0.24), np.arange(0.2, 2.4, 0.22)

    def look() -> FloatArray:
        walls = np.vstack(
            [
                np.column_stack([along + rng.uniform(0.0, 0.1), np.zeros(len(along))]),
                np.column_stack([np.full(len(across), 3.6), across + rng.uniform(0.0, 0.1)]),
            ]
        )
        return walls + rng.normal(0.0, 0.012, walls.shape)

    T = labkit.transform(uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5), uniform(rng, 0.97, 1.02))
    source = labkit.apply(labkit.invert(T), look())
    away = labkit.transform(uniform(rng, 0.15, 0.3), uniform(rng, -0.2, -0.1), 0.06)
    guess = labkit.compose(away, T)
    return np.round(source, 3), np.round(look(), 3), guess, 1.5, 0.9, 0.05, 2 * LOOP_BUDGET


def _straight_ahead(rng: np.random.Generator) -> tuple[Value, ...]:
    """A scene with two equal sides and a guess that is off straight ahead: no step turns."""
    side = np.column_stack([rng.permutation(np.arange(-6.0, 6.0, 1.2)), rng.uniform(1.0, 4.0, 10)])
    moved = side + np.column_stack([rng.normal(0.0, 0.15, 10), np.zeros(10)])
    posts, seen = (np.round(np.vstack([one, one * (1.0, -1.0)]), 3) for one in (side, moved))
    ahead = labkit.transform(uniform(rng, 0.2, 0.5), 0.0, 0.0)
    lonely = posts[[0, 10]] + [(0.0, 60.0), (0.0, -60.0)]  # beyond the gate, and heavy in an RMSE
    source = labkit.apply(labkit.invert(ahead), np.vstack([seen, lonely]))
    guess = labkit.compose(labkit.transform(uniform(rng, 0.7, 0.9), 0.0, 0.0), ahead)
    return np.round(source, 6), posts, guess, 3.0, 1.0, 0.02, 2 * LOOP_BUDGET


def _on_the_spot(rng: np.random.Generator) -> tuple[Value, ...]:
    """A scene that looks the same from behind, and a guess that is turned: no step shifts."""
    angle = rng.permutation(np.arange(10) * 0.31)
    half = np.column_stack([np.cos(angle), np.sin(angle)]) * rng.uniform(2.0, 5.0, (10, 1))
    off = rng.normal(0.0, 0.15, 10)[:, None]
    seen = np.cos(off) * half + np.sin(off) * np.column_stack([-half[:, 1], half[:, 0]])
    posts, seen = np.vstack([half, -half]), np.vstack([seen, -seen])
    turned = labkit.transform(0.0, 0.0, uniform(rng, 0.3, 0.5))
    guess = labkit.compose(labkit.transform(0.0, 0.0, uniform(rng, 0.1, 0.15)), turned)
    source = np.round(labkit.apply(labkit.invert(turned), seen[:10]), 6)
    posts = np.round(posts[:10], 6)
    return (
        np.vstack([source, -source]),
        np.vstack([posts, -posts]),
        guess,
        3.0,
        1.0,
        0.05,
        (2 * LOOP_BUDGET),
    )


def _at_the_gate(beyond: float) -> Draw:
    """Pairs of which one lies exactly on the gate, or a little beyond it."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        target = np.array([[0.0, 0.0], [4.0, 0.0], [8.0, 1.0], [1.0, 5.0], [6.0, 6.0], [-4.0, 3.0]])
        target += rng.integers(-4, 5, target.shape) / 8
        off = np.array([[1, 0], [0, 1], [1, 1], [-1, 2], [2, 1], [0, 0]]) / 16
        source = target + off
        source[5] += (0.5, 0.0) if beyond == 0.0 else (0.0, -0.5 - beyond)
        return source, target, np.eye(3), 0.5, 1.0, 10.0

    return draw


def _ending_at(**exact: float) -> Draw:
    """A step whose shift or change of cost is the tolerance itself."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        arguments = list(_ending(exact.get("step", 80.0), 0.2)(rng))
        arguments[0] = labkit.transform(STEP * exact.get("step", 80.0), 0.0, 0.2 * TURN)
        arguments[1] = exact.get("cost", 0.01)
        return tuple(arguments)

    return draw


RECIPES = {
    "has_converged": Recipes(
        visible=[
            Recipe("a tiny step", _ending(0.3, 0.3)),
            Recipe("a long step", _ending(90.0, 90.0, cost=0.01)),
            Recipe("no shift, but a turn to the left", _ending(0.1, 60.0)),
            Recipe("a cost that stands still", _ending(90.0, 90.0, cost=1e-7)),
            Recipe("a shift, but no turn", _ending(60.0, 0.1, cost=0.02)),
            Recipe("no shift, but a turn to the right", _ending(0.1, -60.0)),
            Recipe("the last iteration of the budget", _ending(90.0, 90.0, iteration=50)),
            Recipe("the last but one iteration", _ending(90.0, 90.0, iteration=49)),
            Recipe("a cost that fell by next to nothing", _ending(60.0, 60.0, cost=-1e-7)),
            Recipe("a tiny step to the right", _ending(0.4, -0.4, cost=0.01)),
        ],
        hidden=[
            Recipe("a step below both tolerances", _ending(0.6, 0.5)),
            Recipe("a step below both, to the right", _ending(0.5, -0.6)),
            Recipe("a step just below both tolerances", _ending(0.8, 0.8)),
            Recipe("a cost that rose by next to nothing", _ending(80.0, 70.0, cost=2e-7)),
            Recipe("a cost that fell by next to nothing", _ending(80.0, -70.0, cost=-2e-7)),
            Recipe("the last iteration of the budget", _ending(80.0, 70.0, iteration=50)),
            Recipe("an iteration past the budget", _ending(80.0, -70.0, iteration=51)),
            Recipe("a cost that did not change", _ending(200.0, 150.0, cost=0.0)),
            Recipe("a turn to the left without a shift", _ending(0.2, 60.0, cost=0.01)),
            Recipe("a turn to the right without a shift", _ending(0.2, -60.0)),
            Recipe("a shift without a turn", _ending(300.0, 0.2)),
            Recipe("a shift of a few tolerances", _ending(8.0, 0.2, cost=0.02)),
            Recipe("a shift aslant", _ending(1.3, 0.2, heading=DIAGONAL)),
            Recipe("a cost that fell much", _ending(40.0, 90.0, cost=-0.5)),
            Recipe("the last but one iteration", _ending(80.0, 70.0, cost=0.01, iteration=49)),
            Recipe("half a turn on the spot", _ending(0.2, HALF_TURN)),
            Recipe("a shift exactly at its tolerance", _ending_at(step=1.0), exact=True),
            Recipe("a cost exactly at its tolerance", _ending_at(cost=COST), exact=True),
            Recipe("a cost just below its tolerance", _ending(70.0, 60.0, cost=8e-7)),
            Recipe("a tiny step, a cost that stands still", _ending(0.3, -0.2, cost=1e-7)),
        ],
    ),
    "icp_step": Recipes(
        visible=[
            Recipe("all stages at work", _scans(20, gate=0.8, ratio=0.7, delta=0.12)),
            Recipe("the guess is no motion", _from_no_motion),
            Recipe("the gate alone", _scans(20, gate=0.6, ratio=1.0, delta=50.0)),
            Recipe("trimming alone", _scans(20, gate=50.0, ratio=0.7, delta=50.0)),
            Recipe("the weights alone", _scans(20, gate=50.0, ratio=1.0, delta=0.1)),
            Recipe("a pair on the gate", _at_the_gate(0.0), exact=True),
        ],
        hidden=[
            Recipe("the gate alone", _scans(24, gate=0.6, ratio=1.0, delta=50.0)),
            Recipe("the gate alone, in clutter", _scans(30, gate=0.5, ratio=1.0, delta=50.0)),
            Recipe("trimming alone", _scans(24, gate=50.0, ratio=0.65, delta=50.0)),
            Recipe("the weights alone", _scans(24, gate=50.0, ratio=1.0, delta=0.1)),
            Recipe("all stages at work", _scans(30, gate=0.45, ratio=0.9, delta=0.1)),
            Recipe(
                "a guess far from no motion",
                _scans(24, gate=0.5, ratio=0.95, delta=0.15, turn=FAR),
            ),
            Recipe("a pair on the gate", _at_the_gate(0.0), exact=True),
            Recipe("a pair a little beyond the gate", _at_the_gate(0.0005)),
        ],
    ),
    "icp": Recipes(
        visible=[
            Recipe("all stages at work", _scans(20, gate=0.9, ratio=0.8, delta=0.1, loop=60)),
            Recipe(
                "a guess far from no motion",
                _scans(20, gate=0.8, ratio=0.8, delta=0.1, turn=FAR, loop=60),
            ),
            Recipe(
                "a budget that ends the loop",
                _scans(20, gate=1.5, ratio=0.8, delta=0.1, error=0.15, loop=3),
            ),
            Recipe("a way straight ahead, without a turn", _straight_ahead),
            Recipe("a turn on the spot, without a shift", _on_the_spot),
        ],
        hidden=[
            Recipe(
                "the gate alone", _scans(28, gate=0.45, ratio=1.0, delta=50.0, turn=FAR, loop=60)
            ),
            Recipe(
                "trimming alone", _scans(24, gate=50.0, ratio=0.7, delta=50.0, turn=FAR, loop=60)
            ),
            Recipe(
                "the weights alone", _scans(24, gate=50.0, ratio=1.0, delta=0.1, turn=FAR, loop=60)
            ),
            Recipe(
                "all stages at work", _scans(30, gate=0.5, ratio=0.9, delta=0.1, turn=FAR, loop=60)
            ),
            Recipe(
                "a guess far from no motion",
                _scans(24, gate=0.6, ratio=0.9, delta=0.15, turn=FAR, loop=60),
            ),
            Recipe(
                "a budget that ends the loop",
                _scans(24, gate=1.5, ratio=0.8, delta=0.1, error=0.15, loop=3),
            ),
            Recipe(
                "a small budget that ends the loop",
                _scans(24, gate=1.2, ratio=0.9, delta=0.1, error=0.12, loop=2),
            ),
            Recipe("five pairs", _scans(5, gate=2.0, ratio=0.85, delta=0.1, turn=FAR, loop=60)),
            Recipe("walls along which each step slides a little", _walls),
            Recipe("a way straight ahead, without a turn", _straight_ahead),
            Recipe("a turn on the spot, without a shift", _on_the_spot),
        ],
    ),
}
