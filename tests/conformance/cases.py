"""The cases that every port answers: inputs and commands, no answers."""

from __future__ import annotations

import math

import numpy as np

from alignment_cases import alignment, degenerate_alignment
from collection import Case, Cases, Content, Parameters
from labkit import apply, invert, transform
from run_cases import killian, run, step
from scenes import small_pair

__all__ = ["Case", "Cases", "Content", "all_cases"]

PI = math.pi


def all_cases() -> Cases:
    """Every case, in the order of the file."""
    cases = Cases()
    alignment(cases)
    degenerate_alignment(cases)
    step(cases)
    run(cases)
    killian(cases)
    _termination(cases)
    _integration(cases)
    return cases


def _termination(cases: Cases) -> None:
    pair = small_pair(cases)
    by_cost = {"translation_tolerance": 0.0, "rotation_tolerance": 0.0, "cost_tolerance": 2e-5}
    cases.match("termination", "ends_by_pose", *pair, cost_tolerance=0.0)
    cases.match("termination", "ends_by_cost", *pair, **by_cost)
    cases.match("termination", "ends_with_the_budget", *pair, max_iterations=2)
    # A scene turned about its own centre hardly shifts: both tolerances must hold.
    half = np.random.default_rng(3).uniform(-4.0, 4.0, (10, 2))
    scene = np.vstack([half, -half])
    turned = apply(invert(transform(0.0, 0.0, math.radians(8.0))), scene)
    files = (cases.table("symmetric_target", scene), cases.table("symmetric_source", turned))
    cases.match("termination", "turn_on_the_spot", *files, cost_tolerance=0.0, overlap_ratio=1.0)
    cases.match("termination", "too_few_from_the_start", *pair, initial_x=100.0)
    posts = np.array([[0.0, 0.0], [0.0, 50.0], [0.0, 100.0]])
    shaken = posts + np.array([[0.4, 0.0], [-0.4, 0.0], [0.4, 0.0]])
    files = (cases.table("posts", posts), cases.table("posts_shaken", shaken))
    wide: Parameters = {"max_correspondence_distance": 0.45, "huber_delta": None}
    cases.match("termination", "too_few_after_a_step", *files, **wide)
    cases.match("termination", "too_few_as_the_budget_ends", *files, max_iterations=1, **wide)
    _last_step_loses_a_pair(cases)
    two = cases.table("two_points", [[0.0, 0.1], [0.1, 50.0]])
    cases.match("termination", "too_few_points", files[0], two)
    spot = cases.table("spot", np.tile([0.1, 0.9], (5, 1)))
    wall = cases.table("wall", np.column_stack([np.linspace(-1.0, 1.0, 12), np.ones(12)]))
    one = cases.table("one_point", [[0.1, 0.9]])
    cases.match("termination", "degenerate_source", wall, spot, overlap_ratio=1.0)
    near = np.random.default_rng(4).uniform([0.0, 0.8], [0.2, 1.0], (6, 2))
    cluster = cases.table("cluster", near)
    cases.match("termination", "degenerate_target", one, cluster, overlap_ratio=1.0)


def _last_step_loses_a_pair(cases: Cases) -> None:
    """A step of 1e-7 m takes the middle pair across the gate: is the run over before it counts?"""
    row = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    zigzag = row + np.array([[0.0, 0.25], [0.0, -0.5], [0.0, 0.25]])
    files = (cases.table("row", row), cases.table("row_zigzag", zigzag))
    close: Parameters = {
        "initial_y": 1e-7,
        "max_correspondence_distance": 0.49999995,
        "overlap_ratio": 1.0,
        "huber_delta": None,
    }
    cases.match("termination", "ends_by_pose_with_two_pairs_left", *files, **close)
    by_cost: Parameters = {"translation_tolerance": 0.0, "cost_tolerance": 1e-6}
    cases.match("termination", "too_few_as_the_cost_settles", *files, **close, **by_cost)


def _integration(cases: Cases) -> None:
    cases.integrate("one_step", [[0.5, 0.0, 0.1]], (1.0, 0.0, PI / 2))
    cases.integrate("square", [[1.0, 0.0, PI / 2]] * 8, (0.0, 0.0, 0.0))
    cases.integrate("across_pi", [[0.3, 0.1, 0.4]] * 20, (2.0, -1.0, 3.0))
    cases.integrate("across_minus_pi", [[0.3, -0.1, -0.4]] * 20, (2.0, -1.0, -3.0))
    cases.integrate("half_turns", [[1.0, 0.5, PI], [1.0, 0.5, -PI]] * 3, (0.0, 0.0, 0.0))
    cases.integrate("more_than_a_turn", [[1.0, 0.0, 7.0], [1.0, 0.0, -20.0]], (0.0, 0.0, 1.0))
    steps = np.random.default_rng(6).normal([0.1, 0.0, 0.01], [0.02, 0.01, 0.1], (100, 3))
    cases.integrate("many_steps", np.round(steps, 5), (-3.0, 4.0, 0.5))
