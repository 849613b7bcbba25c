"""Cases on the ICP step and the loop: scans that overlap in part, and clutter in both."""

from __future__ import annotations

import math

import numpy as np

import labkit
from labkit.authoring.recipe import Draw, Recipe, Recipes, points, uniform
from labkit.grading.contract import Value

ITERATIONS = 60
OFF = math.inf


def _scans(
    count: int,
    *,
    gate: float,
    ratio: float,
    delta: float,
    turn: float = 0.1,
    error: float = 0.05,
    loop: bool = False,
) -> Draw:
    """Two scans of the same posts, each with some that the other does not see.

    `turn` [rad] is the size of the true rotation, `error` [rad, and thrice it in m] that of
    the guess. Posts that moved a little between the scans keep Huber's weights at work.
    """

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        x, y, side, other = rng.choice([-1.0, 1.0], 4)
        T = labkit.transform(0.4 * x, 0.4 * y, side * turn * uniform(rng, 0.8, 1.2))
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
        return (*arguments, ITERATIONS) if loop else arguments

    return draw


def _from_no_motion(rng: np.random.Generator) -> tuple[Value, ...]:
    source, target, _, *limits = _scans(16, gate=1.2, ratio=0.8, delta=0.15, turn=0.03)(rng)
    return source, target, np.eye(3), *limits


RECIPES = {
    "icp_step": Recipes(
        visible=[
            Recipe("all stages at work", _scans(20, gate=0.8, ratio=0.7, delta=0.12)),
            Recipe("the guess is no motion", _from_no_motion),
        ],
        hidden=[
            Recipe("the gate alone", _scans(24, gate=0.6, ratio=1.0, delta=50.0)),
            Recipe("trimming alone", _scans(24, gate=50.0, ratio=0.65, delta=50.0)),
            Recipe("the weights alone", _scans(24, gate=50.0, ratio=1.0, delta=0.1)),
            Recipe("all stages at work", _scans(30, gate=0.7, ratio=0.75, delta=0.1)),
            Recipe(
                "a guess far from no motion",
                _scans(24, gate=0.9, ratio=0.8, delta=0.15, turn=0.9),
            ),
        ],
    ),
    "icp": Recipes(
        visible=[
            Recipe("all stages at work", _scans(20, gate=0.9, ratio=0.8, delta=0.1, loop=True)),
        ],
        hidden=[
            Recipe("the gate alone", _scans(24, gate=0.7, ratio=1.0, delta=50.0, loop=True)),
            Recipe("trimming alone", _scans(24, gate=50.0, ratio=0.7, delta=50.0, loop=True)),
            Recipe("the weights alone", _scans(24, gate=50.0, ratio=1.0, delta=0.1, loop=True)),
            Recipe("all stages at work", _scans(30, gate=0.8, ratio=0.75, delta=0.1, loop=True)),
            Recipe(
                "a guess far from no motion",
                _scans(24, gate=0.9, ratio=0.8, delta=0.15, turn=0.9, loop=True),
            ),
        ],
    ),
}
