"""Coarse iterations: a wide delta that narrows, a share of point-to-point, a gate that closes."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import IcpParameters, Termination, icp
from labkit.correspondences import pairs_at
from labkit.covariance import censi_covariance
from labkit.degeneracy import observability
from labkit.schedule import DELTA_PER_MEDIAN, GATE_PER_DELTA, LONG_STEP, displacement
from labkit.se2 import apply, transform
from labkit.target import Target

PARAMETERS = IcpParameters(
    metric="point_to_line",
    approach=True,
    overlap_ratio=1.0,
    huber_delta=0.02,
    translation_tolerance=3e-3,
    rotation_tolerance=7.5e-4,
    cost_tolerance=0.0,
)
GUESS = transform(0.5, 0.4, math.radians(24.0))

poses = st.builds(transform, st.floats(-5, 5), st.floats(-5, 5), st.floats(-math.pi, math.pi))


def motion_of(points, T_before, T):
    """Root mean square distance between the points at two poses."""
    motions = apply(T, points) - apply(T_before, points)
    return math.sqrt(np.mean((motions**2).sum(axis=1)))


@given(st.integers(0, 2**32 - 1), poses, st.floats(1e-3, 1.0), st.floats(-math.pi, math.pi))
def test_a_motion_is_that_of_the_points(seed, T_before, way, turn):
    points = np.random.default_rng(seed).normal(0.0, 3.0, (20, 2))
    T = transform(way, -0.5 * way, 0.1 * turn) @ T_before

    motion = displacement(points, T_before, T)

    assert motion == pytest.approx(motion_of(points, T_before, T), rel=1e-7, abs=1e-12)


@pytest.fixture(scope="module")
def ends_coarse(in_the_room):
    """A run from far away whose budget is spent in a coarse iteration."""
    guess = GUESS @ in_the_room.T_target_source
    parameters = replace(PARAMETERS, max_iterations=1)
    return icp(in_the_room.source, in_the_room.target, guess, parameters)


def test_a_run_that_ends_coarse_is_judged_by_its_thinned_pairs(ends_coarse):
    pairs = ends_coarse.correspondences

    information = observability(pairs, ends_coarse.target)

    assert ends_coarse.termination is Termination.BUDGET_SPENT
    assert ends_coarse.history[-1].coarse
    assert len(pairs.kept) == len(ends_coarse.source.points[:: pairs.stride])
    np.testing.assert_allclose(information.values, ends_coarse.observability.values, rtol=1e-9)


def test_nothing_is_promised_where_the_normals_of_the_scans_contradict_each_other(ends_coarse):
    covariance = censi_covariance(ends_coarse, 0.01)

    assert np.isposinf(covariance.diagonal()).all()


@pytest.fixture(scope="module")
def history(in_the_room):
    """The iterations of a run from far away."""
    guess = GUESS @ in_the_room.T_target_source
    return icp(in_the_room.source, in_the_room.target, guess, PARAMETERS).history


def test_coarse_iterations_come_first_and_the_last_one_is_fine(history):
    coarse = [step.coarse for step in history]

    assert coarse[0]
    assert not coarse[-1]
    assert coarse == sorted(coarse, reverse=True)


def test_a_coarse_delta_is_as_wide_as_the_median_residual_asks(history):
    for step in history:
        if step.coarse:
            pairs = step.correspondences
            residuals = np.sort(pairs.residuals[pairs.kept])
            median = residuals[len(residuals) // 2]
            assert pairs.huber_delta == max(0.02, DELTA_PER_MEDIAN * median)
            assert np.count_nonzero(pairs.weights == 1.0) >= len(residuals) / 2


def test_a_coarse_iteration_has_the_whole_gate_and_a_share_of_point_to_point(history):
    for step in history:
        if step.coarse:
            pairs = step.correspondences
            share = min(1.0, (pairs.huber_delta / 0.02) ** 2 / 4000.0)
            assert pairs.point_share == pytest.approx(share, rel=1e-12)
            assert pairs.max_correspondence_distance == PARAMETERS.max_correspondence_distance


def test_a_fine_iteration_has_the_delta_of_the_parameters_and_a_narrow_gate(history):
    for step in history:
        if not step.coarse:
            pairs = step.correspondences
            assert pairs.max_correspondence_distance == GATE_PER_DELTA * 0.02
            assert (pairs.huber_delta, pairs.point_share) == (0.02, 0.0)


def test_an_iteration_is_coarse_while_the_next_motion_is_expected_to_be_long(history, in_the_room):
    """Each motion is expected to shrink as the last one did."""
    motions = [
        motion_of(in_the_room.source.points, before.T_target_source, now.T_target_source)
        for before, now in pairwise(history)
    ]

    for k, motion in enumerate(motions):
        shrinkage = min(1.0, motion / motions[k - 1]) if k else 1.0
        is_long = shrinkage * motion > LONG_STEP * 0.02
        assert history[k + 1].coarse == (history[k].coarse and is_long)


def test_without_a_delta_nothing_is_widened_and_no_gate_closes(in_the_room):
    open_wide = replace(PARAMETERS, huber_delta=math.inf)
    history = icp(in_the_room.source, in_the_room.target, GUESS, open_wide).history
    assert [step.coarse for step in history[:2]] == [True, False]
    for step in history:
        pairs = step.correspondences
        assert (pairs.huber_delta, pairs.point_share) == (math.inf, 0.0)
        assert pairs.max_correspondence_distance == PARAMETERS.max_correspondence_distance


@pytest.mark.parametrize(("count", "every"), [(1, 1), (239, 1), (240, 2), (1000, 8)])
def test_a_coarse_iteration_thins_a_large_scan(count, every):
    rng = np.random.default_rng(0)
    source = rng.uniform(-3.0, 3.0, (count, 2))
    target = Target(rng.uniform(-3.0, 3.0, (50, 2)))

    fine = pairs_at(source, target, np.eye(3), PARAMETERS)
    coarse = pairs_at(source, target, np.eye(3), PARAMETERS, coarse=True)

    assert (fine.stride, coarse.stride) == (1, every)
    np.testing.assert_array_equal(coarse.source, fine.source[::every])
    np.testing.assert_array_equal(coarse.target_index, fine.target_index[::every])


def test_no_run_converges_by_a_coarse_step(in_the_room):
    """Not even where the guess is the answer and the first step is none."""
    source, target = in_the_room.source, in_the_room.target
    T = icp(source, target, None, replace(PARAMETERS, translation_tolerance=1e-9)).T_target_source
    result = icp(source, target, T, PARAMETERS)
    assert result.termination is Termination.CONVERGED_POSE
    assert [step.coarse for step in result.history] == [True, False, False]
