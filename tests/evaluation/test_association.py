"""Association by stamp: one to one, nearest, symmetric."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from labkit.evaluation import associate

# Quarter seconds, so that ties and equal stamps do occur.
times = st.lists(st.integers(-20, 20).map(lambda n: n / 4.0), max_size=25)


@given(times, times, st.sampled_from([0.0, 0.25, 1.0, 100.0]))
def test_pairs_are_one_to_one_and_within_tolerance(a, b, tolerance):
    pairs = associate(a, b, tolerance)
    assert pairs.shape == (len(pairs), 2)
    for column in pairs.T:
        assert len(np.unique(column)) == len(column)
    for i, j in pairs:
        gap = abs(a[i] - b[j])
        assert gap <= tolerance
        assert gap == min(abs(a[i] - t) for t in b) == min(abs(b[j] - t) for t in a)
