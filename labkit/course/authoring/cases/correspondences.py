"""Cases on correspondences: neighbours, gate, overlap, weights and their quality."""

from __future__ import annotations

import numpy as np

from labkit.course.authoring.entries import (
    Arguments,
    Draw,
    Exact,
    Recipes,
    Rng,
    points,
    uniform,
    whole_points,
)
from labkit.course.grading.contract import Value


def _clouds(count: int, targets: int) -> Draw:
    return lambda rng: (points(rng, count), points(rng, targets))


def _distances(rng: Rng, count: int, low: float, high: float) -> Value:
    """Distinct distances in no order."""
    return np.round(rng.permutation(np.linspace(low, high, count)), 3)


def _gated(count: int, low: float, high: float, gate: tuple[float, float]) -> Draw:
    return lambda rng: (_distances(rng, count, low, high), uniform(rng, *gate))


def _on_the_gate(*shares: float) -> Exact:
    """Distances that are such shares of the gate, one of them the gate itself."""

    def draw(rng: Rng) -> Arguments:
        gate = float(rng.choice([0.25, 0.75, 1.5]))
        return gate * rng.permutation([*shares, 1.0]), gate

    return Exact(draw)


def _trimmed(count: int, ratio: float) -> Draw:
    return lambda rng: (_distances(rng, count, 0.02, uniform(rng, 0.8, 2.0)), ratio)


def _whole(below: int, count: int, limit: float) -> Draw:
    """Distinct whole numbers in no order."""
    return lambda rng: (rng.permutation(below)[:count].astype(np.int64), limit)


def _weighed(count: int, low: float, high: float, delta: float) -> Draw:
    return lambda rng: (np.round(rng.uniform(low, high, count), 3), delta)


def _kept(count: int, share: float, distances: bool = True) -> Draw:
    def draw(rng: Rng) -> Arguments:
        kept = rng.permutation(np.arange(count) < round(share * count))
        return (np.round(rng.uniform(0.05, 0.8, count), 3), kept) if distances else (kept,)

    return draw


# fmt: off
RECIPES = {
    "nearest_neighbors": Recipes({
        "three points and four": (
            np.array([[0.0, 0.1], [2.0, 2.5], [0.4, 0.3]]),
            np.array([[2.0, 2.0], [5.0, 5.0], [0.0, 0.0], [-1.0, 3.0]])),
        "three points that share two": (
            np.array([[0.0, 0.5], [0.0, -0.25], [3.0, 2.0]]),
            np.array([[4.0, 2.0], [0.0, 0.0]])),
    }, {
        "more target points than source points": _clouds(10, 25),
        "more source points than target points": _clouds(25, 6),
        "as many of both": _clouds(12, 12),
        "points given as whole numbers": lambda rng: (whole_points(rng, 6), whole_points(rng, 9)),
    }),
    "distance_gate": Recipes({
        "five pairs, one of them on the gate": Exact(
            (np.array([0.125, 0.75, 0.5, 0.625, 0.25]), 0.5)),
        "a wide gate": (np.array([3.5, 1.7, 0.4, 2.2]), 2.0),
    }, {
        "a narrow gate": _gated(12, 0.03, 1.2, (0.3, 0.6)),
        "a wide gate": _gated(12, 0.2, 6.0, (1.7, 2.2)),
        "a pair on the gate": _on_the_gate(0.25, 0.5, 2.0, 3.0),
        "a gate that one pair reaches": _on_the_gate(1.5, 2.0, 4.0),
        "a gate that all pass": _on_the_gate(0.125, 0.5, 0.75),
        "a gate that nothing passes": _gated(6, 0.6, 2.0, (0.2, 0.35)),
        "distances given as whole numbers": Exact(
            lambda rng: (rng.permutation(8).astype(np.int64), int(rng.choice([3, 4])))),
    }),
    "overlap": Recipes({
        "three quarters of ten": (
            np.array([0.31, 0.02, 0.9, 0.45, 0.11, 0.73, 0.2, 1.4, 0.64, 0.57]), 0.75),
        "all": (np.array([0.5, 0.1, 0.9]), 1.0),
        "at least three": (np.array([0.5, 0.1, 0.9, 0.2, 0.4, 0.7]), 0.3),
    }, {
        "a share that is rounded down much": _trimmed(11, 0.7),
        "a share that is rounded down little": _trimmed(9, 0.6),
        "a share without remainder": _trimmed(16, 0.5),
        "a large share": _trimmed(13, 0.85),
        "few pairs": _trimmed(5, 0.25),
        "distances given as whole numbers": _whole(15, 9, 0.4),
    }),
    "huber_weights": Recipes({
        "five residuals, one of them zero": Exact((np.array([0.0, 0.125, 0.25, 0.5, 1.0]), 0.25)),
        "whole numbers": (np.array([1, 2, 4]), 2.0),
    }, {
        "residuals to both sides of δ": _weighed(10, 0.0, 0.8, 0.15),
        "a δ above one metre": _weighed(10, 0.0, 6.0, 1.5),
        "residuals below δ": _weighed(6, 0.01, 0.2, 0.25),
        "residuals beyond δ": _weighed(6, 0.3, 3.0, 0.1),
        "residuals given as whole numbers": _whole(12, 7, 3.0),
    }),
    "inlier_rmse": Recipes({
        "two of three pairs": (np.array([0.3, 5.0, 0.4]), np.array([True, False, True])),
        "no pair left": (np.array([0.3, 0.4]), np.array([False, False])),
    }, {
        "most pairs kept": _kept(10, 0.7),
        "few pairs kept": _kept(20, 0.2),
        "all pairs kept": _kept(6, 1.0),
        "one pair kept": _kept(8, 0.125),
        "no pair kept": _kept(7, 0.0),
    }),
    "fitness": Recipes({"three of four": (np.array([True, False, True, True]),)}, {
        "most pairs kept": _kept(11, 0.7, distances=False),
        "few pairs kept": _kept(23, 0.2, distances=False),
        "no pair kept": _kept(7, 0.0, distances=False),
        "all pairs kept": _kept(6, 1.0, distances=False),
    }),
}
