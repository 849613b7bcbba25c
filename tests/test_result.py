"""Results that do not contradict themselves, nor change once they are made."""

import math

import numpy as np
import pytest

from labkit import IcpParameters, Target, Termination, icp, transform
from labkit.correspondences import Correspondences
from labkit.result import step_length


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


def test_nothing_kept_is_no_number_rather_than_a_perfect_one():
    pairs = correspondences([0.0, 0.0], [0, 0])
    assert (pairs.inlier_count, pairs.fitness) == (0, 0.0)
    assert math.isnan(pairs.inlier_rmse)


def test_a_result_cannot_be_written_to(in_the_room):
    points = in_the_room.source.points.copy()
    result = icp(points, in_the_room.target)
    seen = result.observability.values.copy()
    points[:] = 0.0  # the caller's own
    for array in (
        result.T_target_source,
        result.poses,
        result.far,
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


def test_a_result_keeps_both_scans(in_the_room):
    target = Target(in_the_room.target)
    result = icp(in_the_room.source, target, None, IcpParameters())
    assert result.source is in_the_room.source
    assert result.target is target


@pytest.mark.parametrize("turn", [0.3, -3.0, math.pi])
def test_a_step_is_measured_in_both_ways(turn):
    before = transform(1.0, 2.0, 1.5)
    now = transform(1.3, 1.6, 1.5 + turn)
    assert step_length(before, now) == pytest.approx((0.5, abs(turn)), abs=1e-12)
