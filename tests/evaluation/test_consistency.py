"""The checks without a reference: a path that ends where it is said to, or beside it."""

import numpy as np
import pytest

from labkit.evaluation import loop_closure

CORNER = [(1.0, 0.0, 0.0), (1.0, 0.0, np.pi / 2)]


@pytest.mark.parametrize(
    ("steps", "closing", "missed"),
    [
        ([(0.7, 0.2, 2 * np.pi / 12)] * 12, (0.0, 0.0, 0.0), (0.0, 0.0)),
        (CORNER, (2.0, 0.0, np.pi / 2), (0.0, 0.0)),
        (CORNER, (0.0, 0.0, 0.0), (2.0, np.pi / 2)),
    ],
)
def test_a_path_closes_where_it_ends(steps, closing, missed):
    errors = loop_closure(steps, closing)
    assert (errors.translation.max, errors.rotation.max) == pytest.approx(missed, abs=1e-12)
