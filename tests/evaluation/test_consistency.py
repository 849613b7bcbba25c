"""The checks without a reference: a path that ends where it is said to, or beside it."""

import numpy as np
import pytest

from labkit.evaluation import loop_closure


@pytest.mark.parametrize("sides", [3, 12])
def test_a_polygon_closes(sides):
    errors = loop_closure([(0.7, 0.2, 2 * np.pi / sides)] * sides)
    assert errors.translation.max < 1e-12
    assert errors.rotation.max < 1e-12
    assert len(errors) == 1


def test_a_loop_may_close_anywhere():
    steps = [(1.0, 0.0, 0.0), (1.0, 0.0, np.pi / 2)]
    assert loop_closure(steps, (2.0, 0.0, np.pi / 2)).translation.max < 1e-12
    assert np.isclose(loop_closure(steps).translation.max, 2.0)
    assert np.isclose(loop_closure(steps).rotation.max, np.pi / 2)
