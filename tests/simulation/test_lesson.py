"""The lesson's generator: its numbers, taken from a run of its own listing."""

import numpy as np
import pytest

from labkit.simulation.lesson import lesson_experiment, lesson_world

# (count, last point, sum of all coordinates), printed by the lesson's listing
WORLD = (600, [4.943302735075616, 0.602284154423552], 3113.3364930170974)
TARGET = (615, [1.7052582419824311, -0.04078524510803394], 3120.9613200724443)
SOURCE = (597, [-0.7926177064669173, 1.764908584069453], 2794.9123139707335)


def assert_anchored(points, anchor):
    count, last, total = anchor
    assert points.shape == (count, 2)
    np.testing.assert_allclose(points[-1], last, rtol=0, atol=1e-14)
    assert points.sum() == pytest.approx(total, rel=1e-13)


def test_the_numbers_are_the_lessons():
    experiment = lesson_experiment()
    assert_anchored(lesson_world(600, rng=7), WORLD)
    assert_anchored(experiment.target.points, TARGET)
    assert_anchored(experiment.source.points, SOURCE)
