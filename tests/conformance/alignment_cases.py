"""Pairs to align: weighted, at all angles, near and beyond the edge of degeneracy."""

from __future__ import annotations

import math

import numpy as np

from collection import Cases
from labkit import apply, transform
from labkit.arrays import FloatArray

PI = math.pi
SQUARE = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
CLOUD = np.random.default_rng(11).normal(0.0, 2.0, (12, 2))
WEIGHTS = np.random.default_rng(12).uniform(0.05, 2.0, 12)
NOISE = np.random.default_rng(13).normal(0.0, 0.05, (12, 2))


def _seen(theta: float, points: FloatArray = CLOUD) -> FloatArray:
    return apply(transform(-3.0, 0.5, theta), points)


def alignment(cases: Cases) -> None:
    for degrees in (0, 30, 90, 135, 179, -179, -135, -90, -30):
        name = f"angle_{degrees}".replace("-", "minus_")
        cases.align(name, CLOUD, _seen(math.radians(degrees)) + NOISE)
    for name, theta in (
        ("angle_tiny", 1e-8),
        ("angle_just_below_pi", PI - 1e-9),
        ("angle_just_above_minus_pi", -PI + 1e-9),
    ):
        cases.align(name, CLOUD, _seen(theta), decimals=14)
    cases.align("angle_pi_exactly", SQUARE, -SQUARE)
    cases.align("weighted", CLOUD, _seen(2.1) + NOISE, WEIGHTS)
    cases.align("weights_scaled", CLOUD, _seen(2.1) + NOISE, 1000.0 * WEIGHTS)
    half = np.where(np.arange(12) % 2, WEIGHTS, 0.0)
    wrong = _seen(-1.2) + np.where(half[:, None] > 0.0, NOISE, [7.0, -9.0])
    cases.align("weight_zero_silences_outliers", CLOUD, wrong, half)
    far = np.vstack([CLOUD[:3], [[1e9, -2e9]]]), np.vstack([_seen(0.4)[:3], [[-3e9, 1e9]]])
    cases.align("weight_zero_silences_the_farthest", *far, [1.0, 2.0, 0.5, 0.0])
    cases.align("weights_of_nine_decades", CLOUD, _seen(0.4) + NOISE, np.logspace(-9, 0, 12), 12)
    cases.align("two_pairs", CLOUD[:2], _seen(-2.5, CLOUD[:2]))
    cases.align("two_pairs_that_disagree_in_length", [[0, 0], [1, 0]], [[2, 3], [2, 8]])
    wall = np.column_stack([np.linspace(-4.0, 4.0, 17), np.full(17, 2.0)])
    cases.align("points_on_one_line", wall, _seen(1.9, wall))
    cases.align(
        "far_from_the_origin", CLOUD + np.array([60.0, -40.0]), _seen(1.0) + NOISE + [-50.0, 80.0]
    )
    cases.align("tiny_scale", 1e-6 * CLOUD, 1e-6 * _seen(-0.8), decimals=18)
    cases.align("large_scale", 40.0 * CLOUD, 40.0 * (_seen(-0.8) + NOISE))
    cases.align("reflected_and_noisy", CLOUD, apply(transform(1, 2, 0.6), CLOUD * [1, -1]) + NOISE)
    almost = SQUARE * [1.0, -1.0] + [[0.03, 0.01], [0.0, 0.02], [0.0, 0.0], [0.01, 0.0]]
    cases.align("almost_a_mirror_image", SQUARE, almost)
    light = [1.0, 1e-16]
    cases.align("a_light_second_pair_is_enough", SQUARE[:2], [[1, 1], [3, 4]], light, decimals=20)
    near = np.array([[0.8, 0.3], [0.8, 0.31]])
    cases.align("close_together", near, apply(transform(-3.0, 0.5, 1.3), near), decimals=12)


def degenerate_alignment(cases: Cases) -> None:
    spot = np.tile([0.1, 0.9], (4, 1))
    cases.align("degenerate_one_pair", SQUARE[:1], SQUARE[1:2])
    cases.align("degenerate_source_coincides", spot, SQUARE)
    cases.align("degenerate_target_coincides", SQUARE, spot)
    cases.align("degenerate_all_weights_zero", SQUARE, SQUARE, np.zeros(4))
    cases.align("degenerate_one_weight_left", SQUARE, SQUARE, [0.0, 0.0, 3.0, 0.0])
    light = [1.0, 1e-24, 0.0, 0.0]
    cases.align("degenerate_second_pair_too_light", SQUARE, SQUARE, light, decimals=30)
    grains = np.array([[900.0, 300.0], [900.0, 300.0 + 2.0**-42]])
    cases.align("degenerate_within_rounding", grains, SQUARE[:2], decimals=20)
    cases.align("degenerate_mirror_image", SQUARE, SQUARE * [1.0, -1.0])
    cases.align("degenerate_circulating", SQUARE, [[1, 0], [0, 1], [1, 0], [0, 1]])
