"""A path that ends where it is said to, or beside it."""

import numpy as np
import pytest

from labkit.evaluation import loop_closure

POLYGON = [(0.7, 0.2, 2.0 * np.pi / 12)] * 12
CORNER = [(1.0, 0.0, 0.0), (1.0, 0.0, np.pi / 2)]


@pytest.mark.parametrize(
    ("steps", "closing", "metres", "radians"),
    [
        (POLYGON, (0.0, 0.0, 0.0), 0.0, 0.0),
        (CORNER, (2.0, 0.0, np.pi / 2), 0.0, 0.0),
        (CORNER, (0.0, 0.0, 0.0), 2.0, np.pi / 2),
    ],
)
def test_a_path_misses_its_known_end_by_the_closing_error(steps, closing, metres, radians):
    errors = loop_closure(steps, closing)

    assert errors.translation.max == pytest.approx(metres, abs=1e-12)
    assert errors.rotation.max == pytest.approx(radians, abs=1e-12)
