"""Cases on correspondences: neighbours, gate, overlap, weights and their quality."""

from __future__ import annotations

import numpy as np

from labkit.course.authoring.entries import Draw, Recipe, Recipes, points, uniform, whole_points
from labkit.course.grading.contract import Value


def _clouds(count: int, targets: int) -> Draw:
    return lambda rng: (points(rng, count), points(rng, targets))


def _whole_clouds(rng: np.random.Generator) -> tuple[Value, ...]:
    return whole_points(rng, 6), whole_points(rng, 9)


def _distances(rng: np.random.Generator, count: int, low: float, high: float) -> Value:
    """Distinct distances in no order."""
    return np.round(rng.permutation(np.linspace(low, high, count)), 3)


def _gated(count: int, low: float, high: float, gate: tuple[float, float]) -> Draw:
    return lambda rng: (_distances(rng, count, low, high), uniform(rng, *gate))


def _on_the_gate(*shares: float) -> Draw:
    """Distances that are such shares of the gate, one of them the gate itself."""

    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        gate = float(rng.choice([0.25, 0.75, 1.5]))
        return gate * rng.permutation([*shares, 1.0]), gate

    return draw


def _trimmed(count: int, ratio: float) -> Draw:
    return lambda rng: (_distances(rng, count, 0.02, uniform(rng, 0.8, 2.0)), ratio)


def _whole(low: int, high: int, count: int, limit: float) -> Draw:
    """Distinct whole numbers in no order, the smallest and the largest never first."""
    return lambda rng: (rng.permutation(np.arange(low, high))[:count].astype(np.int64), limit)


def _whole_gate(rng: np.random.Generator) -> tuple[Value, ...]:
    return rng.permutation(np.arange(8)).astype(np.int64), int(rng.choice([3, 4]))


def _weighed(count: int, low: float, high: float, delta: float) -> Draw:
    return lambda rng: (np.round(rng.uniform(low, high, count), 3), delta)


def _kept(count: int, share: float) -> Draw:
    def draw(rng: np.random.Generator) -> tuple[Value, ...]:
        kept = rng.permutation(np.arange(count) < round(share * count))
        return np.round(rng.uniform(0.05, 0.8, count), 3), kept

    return draw


RECIPES = {
    "nearest_neighbors": Recipes(
        visible=[
            Recipe(
                "three points and four",
                lambda _: (
                    np.array([[0.0, 0.1], [2.0, 2.5], [0.4, 0.3]]),
                    np.array([[2.0, 2.0], [5.0, 5.0], [0.0, 0.0], [-1.0, 3.0]]),
                ),
            ),
            Recipe(
                "three points that share two",
                lambda _: (
                    np.array([[0.0, 0.5], [0.0, -0.25], [3.0, 2.0]]),
                    np.array([[4.0, 2.0], [0.0, 0.0]]),
                ),
            ),
        ],
        hidden=[
            Recipe("more target points than source points", _clouds(10, 25)),
            Recipe("more source points than target points", _clouds(25, 6)),
            Recipe("as many of both", _clouds(12, 12)),
            Recipe("points given as whole numbers", _whole_clouds),
        ],
    ),
    "distance_gate": Recipes(
        visible=[
            Recipe(
                "five pairs, one of them on the gate",
                lambda _: (np.array([0.125, 0.75, 0.5, 0.625, 0.25]), 0.5),
                exact=True,
            ),
            Recipe("a wide gate", lambda _: (np.array([3.5, 1.7, 0.4, 2.2]), 2.0)),
        ],
        hidden=[
            Recipe("a narrow gate", _gated(12, 0.03, 1.2, (0.3, 0.6))),
            Recipe("a wide gate", _gated(12, 0.2, 6.0, (1.7, 2.2))),
            Recipe("a pair on the gate", _on_the_gate(0.25, 0.5, 2.0, 3.0), exact=True),
            Recipe("a gate that one pair reaches", _on_the_gate(1.5, 2.0, 4.0), exact=True),
            Recipe("a gate that all pass", _on_the_gate(0.125, 0.5, 0.75), exact=True),
            Recipe("a gate that nothing passes", _gated(6, 0.6, 2.0, (0.2, 0.35))),
            Recipe("distances given as whole numbers", _whole_gate, exact=True),
        ],
    ),
    "overlap": Recipes(
        visible=[
            Recipe(
                "three quarters of ten",
                lambda _: (
                    np.array([0.31, 0.02, 0.9, 0.45, 0.11, 0.73, 0.2, 1.4, 0.64, 0.57]),
                    0.75,
                ),
            ),
            Recipe("all", lambda _: (np.array([0.5, 0.1, 0.9]), 1.0)),
            Recipe("at least three", lambda _: (np.array([0.5, 0.1, 0.9, 0.2, 0.4, 0.7]), 0.3)),
        ],
        hidden=[
            Recipe("a share that is rounded down much", _trimmed(11, 0.7)),
            Recipe("a share that is rounded down little", _trimmed(9, 0.6)),
            Recipe("a share without remainder", _trimmed(16, 0.5)),
            Recipe("a large share", _trimmed(13, 0.85)),
            Recipe("few pairs", _trimmed(5, 0.25)),
            Recipe("distances given as whole numbers", _whole(0, 15, 9, 0.4)),
        ],
    ),
    "huber_weights": Recipes(
        visible=[
            Recipe(
                "five residuals, one of them zero",
                lambda _: (np.array([0.0, 0.125, 0.25, 0.5, 1.0]), 0.25),
                exact=True,
            ),
            Recipe("whole numbers", lambda _: (np.array([1, 2, 4]), 2.0)),
        ],
        hidden=[
            Recipe("residuals to both sides of δ", _weighed(10, 0.0, 0.8, 0.15)),
            Recipe("a δ above one metre", _weighed(10, 0.0, 6.0, 1.5)),
            Recipe("residuals below δ", _weighed(6, 0.01, 0.2, 0.25)),
            Recipe("residuals beyond δ", _weighed(6, 0.3, 3.0, 0.1)),
            Recipe("residuals given as whole numbers", _whole(0, 12, 7, 3.0)),
        ],
    ),
    "inlier_rmse": Recipes(
        visible=[
            Recipe(
                "two of three pairs",
                lambda _: (np.array([0.3, 5.0, 0.4]), np.array([True, False, True])),
            ),
            Recipe("no pair left", lambda _: (np.array([0.3, 0.4]), np.array([False, False]))),
        ],
        hidden=[
            Recipe("most pairs kept", _kept(10, 0.7)),
            Recipe("few pairs kept", _kept(20, 0.2)),
            Recipe("all pairs kept", _kept(6, 1.0)),
            Recipe("one pair kept", _kept(8, 0.125)),
            Recipe("no pair kept", _kept(7, 0.0)),
        ],
    ),
    "fitness": Recipes(
        visible=[
            Recipe("three of four", lambda _: (np.array([True, False, True, True]),)),
        ],
        hidden=[
            Recipe("most pairs kept", lambda rng: _kept(11, 0.7)(rng)[1:]),
            Recipe("few pairs kept", lambda rng: _kept(23, 0.2)(rng)[1:]),
            Recipe("no pair kept", lambda rng: _kept(7, 0.0)(rng)[1:]),
            Recipe("all pairs kept", lambda rng: _kept(6, 1.0)(rng)[1:]),
        ],
    ),
}
