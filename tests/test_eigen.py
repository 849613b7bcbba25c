"""Eigenvalues of a symmetric (3, 3), compiled and in Python, against numpy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.eigen import eigen_symmetric
from labkit.support.compiled import _in_python

in_python = _in_python(eigen_symmetric.__wrapped__)  # as without numba: warnings are errors
entries = st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1.0, 1e-300, 1e-17, 5e-324])


@pytest.mark.parametrize("solve", [eigen_symmetric, in_python], ids=["compiled", "Python"])
@given(st.lists(entries, min_size=6, max_size=6))
def test_eigenvalues_and_vectors_are_numpy_s(solve, six):
    a, b, c, d, e, f = six
    A = np.array([[a, b, c], [b, d, e], [c, e, f]])

    values, vectors = solve(A)

    tolerance = 1e-13 * np.abs(A).max()
    np.testing.assert_allclose(values, np.linalg.eigvalsh(A), atol=tolerance)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(vectors @ np.diag(values) @ vectors.T, A, atol=10.0 * tolerance)


def test_an_entry_below_rounding_needs_no_rotation():
    """Its rotation would divide by it: an overflow, which Python tells."""
    A = np.diag([1.0, 2.0, 3.0])
    A[0, 1] = A[1, 0] = 5e-324

    values, vectors = in_python(A)

    assert values.tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(vectors, np.eye(3))
