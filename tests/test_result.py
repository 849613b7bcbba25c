"""Results that do not contradict themselves, nor change once they are made."""

import numpy as np
import pytest

from labkit import Target, icp


def test_a_result_cannot_be_written_to(in_the_room):
    points, target, T_init = in_the_room.source.points.copy(), Target(in_the_room.target), np.eye(3)
    result = icp(points, target, T_init)
    assert result.target is target
    seen = result.observability.values.copy()
    points[:], T_init[:] = 0.0, 0.0  # the caller's own
    np.testing.assert_array_equal(result.source.points, in_the_room.source.points)
    np.testing.assert_array_equal(result.history[0].T_target_source, np.eye(3))
    for array in (
        result.T_target_source,
        result.poses,
        result.source.points,
        result.target.points,
        result.target.normals,
        result.correspondences.distances,
        result.history[0].correspondences.weights,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    np.testing.assert_array_equal(result.observability.values, seen)
    np.testing.assert_array_equal(result.T_target_source, result.history[-1].T_target_source)
    assert result.history[-1].correspondences is result.correspondences


def test_a_result_is_told_in_one_line(in_the_room):
    result = icp(in_the_room.source, in_the_room.target)
    assert repr(result) == (
        f"<IcpResult: converged: the last step was below both pose tolerances; "
        f"{result.iterations} iterations, 459 of {len(in_the_room.source)} pairs kept>"
    )
