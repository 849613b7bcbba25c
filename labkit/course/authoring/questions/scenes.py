"""Scenes for a step of ICP and its loop: scans that overlap in part, and guesses."""

from __future__ import annotations

import numpy as np

import labkit
from labkit.course.authoring.entries import Draw, Rng, recipe
from labkit.course.exercises.entries import Arguments
from labkit.support.arrays import FloatArray

LOOP_BUDGET = 60
CORNERS = np.array([[0, 0], [8, 0], [16, 2], [2, 10], [12, 12], [-8, 6], [-20, -20]])
DELTA = 0.1  # m: Huber's δ of the scenes that take many steps
# m: a little beyond δ, so that steps are short; there and back, so that weights move no end
RESIDUALS = DELTA * np.array([0.0, 1.1, 1.2, 1.3, 1.4, 0.0, -1.1, -1.2, -1.3, -1.4])
FAR = 1.0  # rad: at less than 60° an update on the wrong side slows down; it does not diverge


@recipe
def scans(
    rng: Rng, count: int, *limits: float, turn: float = 0.1, error: float = 0.05
) -> Arguments:
    """Two scans of the same posts, each with some that the other does not see.

    The `limits` are the gate [m], the share to keep, Huber's δ [m], and of the whole loop the
    budget. `turn` [rad] is the size of the true rotation, `error` [rad, and thrice it in m] that of
    the guess. Posts that moved a little between the scans keep Huber's weights at work.
    """
    x, y, side, sign = rng.choice([-1.0, 1.0], 4)
    T = labkit.transform(0.4 * x, 0.4 * y, side * turn * rng.number(0.95, 1.03))
    posts = rng.points(count, 5.0)
    shifted = posts + rng.normal(0.0, 0.01, posts.shape)
    moved = rng.permutation(count)[: count // 4]
    shifted[moved] += rng.normal(0.0, 0.15, (len(moved), 2)) + 0.1
    source = np.vstack([_back(T, shifted), rng.points(count // 5, 6.0)])
    target = np.vstack([posts, rng.points(3, 6.0)])
    away = sign * error * rng.number(0.8, 1.2)
    guess = labkit.transform(3.0 * away, -2.0 * away, away) @ T
    return np.round(source, 3), np.round(target, 3), guess, *limits


def _back(T: FloatArray, q: FloatArray) -> FloatArray:
    """The points before the motion T."""
    return labkit.apply(labkit.invert(T), q)


def whole_loop(count: int, *limits: float) -> Draw:
    """The whole loop from a guess far from no motion, with a budget that is enough."""
    return scans(count, *limits, LOOP_BUDGET, turn=FAR)


def straight_ahead(rng: Rng) -> Arguments:
    """A scene with two equal sides and a guess that is off straight ahead: no step turns.

    For each post that moved ahead another one moved back as far, and what lies beyond the gate is
    right above its post: weights and gate change how many steps it takes, and not where it ends.
    """
    side = np.column_stack([rng.permutation(np.arange(-6.0, 6.0, 1.2)), rng.uniform(1.0, 4.0, 10)])
    moved = side + np.column_stack([RESIDUALS, np.zeros(10)])
    mirror = np.array([1.0, -1.0])
    far = np.array([[0.0, 8.0], [0.0, -8.0]])
    posts = np.round(np.vstack([side, side * mirror, far]), 6)
    beyond = far + np.array([[0.0, 60.0], [0.0, -60.0]])  # the gate, and heavy in an RMSE
    newer_posts = np.round(np.vstack([moved, moved * mirror, beyond]), 6)
    ahead = labkit.transform(rng.number(0.2, 0.5), 0.0, 0.0)
    guess = labkit.transform(rng.number(0.3, 0.34), 0.0, 0.0) @ ahead
    source = np.round(_back(ahead, newer_posts), 6)
    return source, posts, guess, 3.0, 1.0, DELTA, 2 * LOOP_BUDGET


def straight_to_the_left(rng: Rng) -> Arguments:
    """The scene that is off straight ahead, turned by a quarter: no step moves along x."""
    source, posts, guess, *limits = straight_ahead(rng)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = [labkit.apply(quarter, points) for points in (source, posts)]
    return *turned, quarter @ guess @ quarter.T, *limits


def on_the_spot(rng: Rng) -> Arguments:
    """A scene that looks the same from behind, and a guess that is turned: no step shifts.

    For each point that turned one way another one at its radius turned back as far, so the weights
    change how many steps it takes, and not where it ends. Twenty steps do not lead there.
    """
    angle = rng.permutation(np.arange(10) * 0.31)
    radius = np.tile(rng.uniform(3.0, 3.5, 5), 2)
    angle_seen = angle + RESIDUALS / radius
    posts = np.round(_on_circles(radius, angle), 6)
    T = labkit.transform(0.0, 0.0, rng.number(0.3, 0.5))
    source = np.round(_back(T, _on_circles(radius, angle_seen)), 6)
    guess = labkit.transform(0.0, 0.0, rng.number(0.08, 0.09)) @ T
    both = np.vstack([source, -source]), np.vstack([posts, -posts])
    return *both, guess, 3.0, 1.0, DELTA, 2 * LOOP_BUDGET


def _on_circles(radius: FloatArray, angle: FloatArray) -> FloatArray:
    """Points by their polar coordinates [m, rad]."""
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@recipe
def about_the_gate(
    rng: Rng, beyond: list[float], gate: float, *limits: float, apart: float = 0.25
) -> Arguments:
    """Pairs that are some `apart` [m], and others that lie so far `beyond` the gate, or on it."""
    target = CORNERS[: 5 + len(beyond)]
    target = gate * (target + rng.integers(-4, 5, target.shape) / 4)
    source = target.copy()
    source[:5] += apart * np.array([[1, 0], [0, 1], [1, 1], [-1, 2], [2, 1]])
    source[5:, 1] -= gate + np.array(beyond)
    return source, target, np.eye(3), gate, *limits
