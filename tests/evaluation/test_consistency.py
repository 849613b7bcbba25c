"""The checks without a reference: what they measure, and what they cannot see."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import from_xytheta, invert, to_xytheta
from labkit.evaluation import disagreement, forward_backward, loop_closure

pose = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))


def inverse(increments):
    return to_xytheta(invert(from_xytheta(np.array(increments))))


@given(st.lists(pose, min_size=1, max_size=5))
def test_a_match_and_its_inverse_undo_one_another(increments):
    errors = forward_backward(increments, inverse(increments))
    assert errors.translation.max < 1e-12
    assert errors.rotation.max < 1e-12


@given(pose, pose, pose)
def test_disagreement_does_not_depend_on_the_frame(frame, increment, prior):
    moved = [to_xytheta(from_xytheta(frame) @ from_xytheta(each)) for each in (increment, prior)]
    errors, same = disagreement([increment], [prior]), disagreement(*[[each] for each in moved])
    assert np.allclose(errors.translation_errors, same.translation_errors, atol=1e-9)
    assert np.allclose(errors.rotation_errors, same.rotation_errors, atol=1e-9)


@pytest.mark.parametrize("sides", [3, 12])
def test_a_polygon_closes(sides):
    steps = [(0.7, 0.2, 2 * np.pi / sides)] * sides
    errors = loop_closure(steps)
    assert errors.translation.max < 1e-12
    assert errors.rotation.max < 1e-12
    assert len(errors) == 1


def test_a_loop_may_close_anywhere():
    steps = [(1.0, 0.0, 0.0), (1.0, 0.0, np.pi / 2)]
    assert loop_closure(steps, (2.0, 0.0, np.pi / 2)).translation.max < 1e-12
    assert np.isclose(loop_closure(steps).translation.max, 2.0)
    assert np.isclose(loop_closure(steps).rotation.max, np.pi / 2)
