"""Selection: held against sorting."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from labkit.selection import kth_smallest


@given(st.lists(st.integers(0, 9), min_size=1), st.data())
def test_a_selected_value_is_that_of_its_rank(values, data):
    rank = data.draw(st.integers(0, len(values) - 1))
    for stage in (kth_smallest, kth_smallest.__wrapped__):  # compiled, and as Python reads it
        assert stage(np.array(values, dtype=float), rank) == sorted(values)[rank]
