"""Results that do not contradict themselves, nor change once they are made."""

import math

import numpy as np
import pytest

from labkit import Target, Termination, icp
from labkit.correspondences import Correspondences


def test_every_ending_is_one_kind_and_says_so():
    kinds = {
        ending: (ending.converged, ending.failed, ending.value.split(":")[0])
        for ending in Termination
    }
    assert kinds == {
        Termination.CONVERGED_POSE: (True, False, "converged"),
        Termination.CONVERGED_COST: (True, False, "converged"),
        Termination.BUDGET_SPENT: (False, False, "not converged"),
        Termination.TOO_FEW_CORRESPONDENCES: (False, True, "failed"),
        Termination.DEGENERATE: (False, True, "failed"),
    }


def correspondences(distances, kept):
    kept = np.array(kept, dtype=bool)
    d = np.array(distances, dtype=float)
    return Correspondences(
        source=np.zeros((len(d), 2)),
        target=np.column_stack([d, 0 * d]),
        target_index=np.arange(len(d)),
        distances=d,
        normals=None,
        residuals=d,
        kept=kept,
        weights=kept.astype(float),
        gate=10.0,
    )


def test_numbers_count_the_kept_pairs_alone():
    pairs = correspondences([3.0, 4.0, 100.0, 50.0], [1, 1, 0, 0])
    assert pairs.inlier_count == 2
    assert pairs.fitness == 0.5
    assert pairs.inlier_rmse == math.sqrt((9.0 + 16.0) / 2.0)
    none = correspondences([0.0, 0.0], [0, 0])
    assert (none.inlier_count, none.fitness) == (0, 0.0)
    assert math.isnan(none.inlier_rmse)  # rather than a perfect one


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
        result.correspondences.kept,
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
