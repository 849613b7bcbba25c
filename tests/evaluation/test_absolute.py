"""Absolute trajectory error: symmetries here, the comparison with evo in test_evo.py."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.errors import DegenerateAlignmentError
from labkit.evaluation import ate
from labkit.se2 import from_xytheta, to_xytheta

motions = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi, math.pi))
seeds = st.integers(0, 2**32 - 1)


def walk(seed, length=30):
    steps = np.random.default_rng(seed).normal([0.5, 0.0, 0.0], [0.1, 0.1, 0.3], (length, 3))
    T = [from_xytheta([1.0, -2.0, 0.5])]
    for step in from_xytheta(steps):
        T.append(T[-1] @ step)
    return to_xytheta(T)


def moved(motion, poses):
    return to_xytheta(from_xytheta(motion) @ from_xytheta(poses))


@pytest.mark.parametrize("align", ["rigid", "origin"])
@given(seed=seeds, motion=motions)
def test_a_moved_copy_has_no_error(align, seed, motion):
    errors = ate(moved(motion, walk(seed)), walk(seed), align)
    assert errors.translation.max < 1e-11
    assert errors.rotation.max < 1e-11


@pytest.mark.parametrize("poses", [np.zeros((1, 3)), np.zeros((5, 3)), np.full((7, 3), 0.1)])
def test_a_robot_that_stays_has_no_rigid_alignment(poses):
    with pytest.raises(DegenerateAlignmentError, match="leave the rotation undetermined"):
        ate(poses, np.arange(3.0 * len(poses)).reshape(-1, 3))
    assert ate(poses, poses, "origin").translation.max < 1e-15
