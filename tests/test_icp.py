"""The loop: the lesson's run, symmetries, a cost that never rises, and every ending."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import IcpParameters, Target, Termination, icp
from labkit.se2 import apply, invert, to_xytheta, transform, wrap
from labkit.simulation import Lidar, cast, lesson_experiment, room

PI = math.pi
BY_POINT = IcpParameters()
BY_LINE = IcpParameters(metric="point_to_line")
AROUND = Lidar(beam_count=720, field_of_view=2.0 * PI, noise_std=0.0)
FROM_AFAR = replace(BY_LINE, approach=True, huber_delta=0.02)
METRICS = pytest.mark.parametrize(
    "parameters", [BY_POINT, BY_LINE, FROM_AFAR], ids=["point", "line", "approach"]
)
# So wide apart that no point has a normal.
SPARSE = 3.0 * np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
ANGLES = pytest.mark.parametrize("theta", [-PI, *np.radians([-90, 0, 45, 135])])

# Nothing rejected, nothing weighed down, and only the pose decides when to stop.
PLAIN = IcpParameters(
    max_correspondence_distance=math.inf,
    overlap_ratio=1.0,
    huber_delta=math.inf,
    cost_tolerance=0.0,
)


def error(T, T_true):
    """Distance [m] and angle [rad] between two transforms."""
    x, y, theta = to_xytheta(invert(T_true) @ T)
    return math.hypot(x, y), abs(theta)


def scatter(seed, count=80, size=4.0):
    return np.random.default_rng(seed).uniform(-size, size, (count, 2))


# ---------------------------------------------------------------- the lesson's own run


def test_the_lessons_experiment():
    """The numbers that the lesson's program prints; its RMSE is over all points."""
    experiment = lesson_experiment()
    result = icp(experiment.source, experiment.target, experiment.T_init)
    x, y, theta = to_xytheta(result.T_target_source)
    rmse = math.sqrt(np.mean(result.correspondences.distances**2))
    assert round(math.degrees(theta), 3) == 6.011
    assert (round(x, 4), round(y, 4)) == (0.3496, 0.1008)
    assert round(rmse, 4) == 0.1283
    assert result.converged
    assert result.inlier_count == math.floor(0.85 * len(experiment.source)) == 507


# ---------------------------------------------------------------- symmetries


@METRICS
@ANGLES
def test_moving_the_scans_moves_the_estimate(parameters, theta, in_the_room):
    """Bare points, so that both metrics see the same geometry in every frame."""
    source, target = in_the_room.source.points, in_the_room.target.points
    A, B = transform(1.5, -0.7, theta), transform(-0.4, 0.9, 0.5 - theta)
    plain = icp(source, target, None, parameters)
    moved = icp(apply(B, source), apply(A, target), A @ invert(B), parameters)
    expected = A @ plain.T_target_source @ invert(B)
    np.testing.assert_allclose(moved.T_target_source, expected, atol=1e-9)
    assert (moved.iterations, moved.termination) == (plain.iterations, plain.termination)


@METRICS
def test_the_order_of_the_source_does_not_matter(parameters, in_the_room):
    source = in_the_room.source.points[::3]
    order = np.random.default_rng(0).permutation(len(source))

    plain = icp(source, in_the_room.target, None, parameters)
    shuffled = icp(source[order], in_the_room.target, None, parameters)

    np.testing.assert_allclose(shuffled.T_target_source, plain.T_target_source, atol=1e-10)
    kept = plain.correspondences.kept[order]
    np.testing.assert_array_equal(shuffled.correspondences.kept, kept)


def test_the_order_of_a_large_source_leads_another_way_to_the_same_place(in_the_room):
    """Coarse iterations look at every n-th point."""
    source = in_the_room.source.points
    order = np.random.default_rng(0).permutation(len(source))

    plain = icp(source, in_the_room.target, None, FROM_AFAR)
    shuffled = icp(source[order], in_the_room.target, None, FROM_AFAR)

    np.testing.assert_allclose(shuffled.T_target_source, plain.T_target_source, atol=1e-4)


@METRICS
@ANGLES
def test_every_angle_is_reached_from_a_near_guess(parameters, theta):
    """A right-hand composition is harmless near 0° and fails from 90° on."""
    T = transform(0.3, 0.2, theta)
    target, source = (cast(room(), pose, AROUND, rng=8) for pose in (np.eye(3), T))
    guess = transform(0.38, 0.14, theta + math.radians(5.0))
    result = icp(source, target, guess, parameters)
    assert result.converged
    distance, angle = error(result.T_target_source, T)
    assert distance < 0.01
    assert angle < math.radians(0.2)
    assert result.inlier_rmse < 0.03


# ---------------------------------------------------------------- the cost never rises


def assert_cost_never_rises(result, scale):
    for before, now in pairwise(result.history):
        assert now.cost <= before.cost + 1e-13 * scale**2


parameter_sets = st.builds(
    IcpParameters,
    max_correspondence_distance=st.sampled_from([0.05, 0.3, 1.0, math.inf]),
    overlap_ratio=st.floats(0.2, 1.0),
    huber_delta=st.sampled_from([0.02, 0.2, 1.0, math.inf]),
    max_iterations=st.just(40),
    cost_tolerance=st.just(0.0),
)
guesses = st.builds(transform, st.floats(-1, 1), st.floats(-1, 1), st.floats(-PI, PI))


@given(st.integers(0, 2**32 - 1), guesses, parameter_sets)
def test_no_step_raises_the_cost_between_any_two_clouds(seed, guess, parameters):
    source, target = scatter(seed, 40), scatter(seed + 1, 50)
    assert_cost_never_rises(icp(source, target, guess, parameters), scale=4.0)


# ---------------------------------------------------------------- the endings


def test_ends_when_the_cost_stops_changing(in_the_room):
    parameters = IcpParameters(
        translation_tolerance=0.0, rotation_tolerance=0.0, cost_tolerance=1e-6
    )
    result = icp(in_the_room.source, in_the_room.target, None, parameters)
    assert result.termination is Termination.CONVERGED_COST
    assert result.converged
    changes = [abs(now.cost - before.cost) for before, now in pairwise(result.history)]
    assert changes[-1] < 1e-6
    assert min(changes[:-1]) >= 1e-6


@pytest.mark.parametrize("budget", [1, 3])
def test_ends_with_the_budget(budget, in_the_room):
    result = icp(in_the_room.source, in_the_room.target, None, IcpParameters(max_iterations=budget))
    assert result.termination is Termination.BUDGET_SPENT
    assert result.iterations == budget
    assert not result.converged
    assert not result.termination.failed


@pytest.mark.parametrize("name", ["translation_tolerance", "rotation_tolerance"])
def test_a_step_as_long_as_the_tolerance_is_no_short_one(name, in_the_room):
    """Both tests ask for less, so that a tolerance of zero turns them off."""
    loose = replace(PLAIN, translation_tolerance=10.0, rotation_tolerance=10.0)
    step_name = name.replace("tolerance", "step")
    steps = icp(in_the_room.source, in_the_room.target, None, PLAIN).history[1:6]
    k, shortest = min(enumerate(steps, 1), key=lambda each: getattr(each[1], step_name))
    for tolerance, stops in (
        (getattr(shortest, step_name), False),
        (math.nextafter(getattr(shortest, step_name), math.inf), True),
    ):
        end = icp(in_the_room.source, in_the_room.target, None, replace(loose, **{name: tolerance}))
        assert (end.iterations == k) is stops


FAR_AWAY = transform(100.0, 0.0, 0.3)


@METRICS
@pytest.mark.parametrize(
    ("source", "target", "guess"),
    [
        (scatter(1), scatter(2), FAR_AWAY),
        (scatter(4, 1), scatter(4, 1), np.eye(3)),
        (scatter(4, 2), scatter(4, 2), np.eye(3)),
        (np.vstack([SPARSE[:2], SPARSE + 100.0]), SPARSE, np.eye(3)),
    ],
    ids=["too far off", "one point", "two points", "two near points, on no surface"],
)
def test_ends_where_too_few_pairs_are_left(source, target, guess, parameters):
    result = icp(source, target, guess, parameters)

    assert result.termination is Termination.TOO_FEW_CORRESPONDENCES
    assert result.iterations == 0
    assert_failed(result, guess)


@METRICS
def test_without_pairs_there_is_no_rmse(parameters):
    result = icp(scatter(1), scatter(2), FAR_AWAY, parameters)

    assert (result.inlier_count, result.fitness) == (0, 0.0)
    assert math.isnan(result.inlier_rmse)


def test_ends_where_a_step_leaves_too_few_pairs():
    """Offsets of +, − and + 0.4 m meet at a mean that puts the middle pair outside the gate."""
    target = np.array([[0.0, 0.0], [0.0, 50.0], [0.0, 100.0]])
    source = target + np.array([[0.4, 0.0], [-0.4, 0.0], [0.4, 0.0]])
    result = icp(source, target, None, replace(PLAIN, max_correspondence_distance=0.45))
    assert result.termination is Termination.TOO_FEW_CORRESPONDENCES
    assert [step.inlier_count for step in result.history] == [3, 2]
    assert_failed(result, result.history[1].T_target_source)
    np.testing.assert_allclose(
        result.history[1].T_target_source, transform(-0.4 / 3.0, 0.0, 0.0), atol=1e-14
    )


def assert_failed(result, last_tried):
    """No estimate, yet the last pose that was tried is on record."""
    assert result.termination.failed
    assert not result.converged
    assert np.isnan(result.T_target_source).all()
    np.testing.assert_array_equal(result.history[-1].T_target_source, last_tried)


@METRICS
@pytest.mark.parametrize("count", [3, 10])
def test_a_source_in_one_spot_is_degenerate(parameters, count):
    wall = np.column_stack([np.linspace(-1.0, 1.0, 41), np.ones(41)])

    result = icp(np.tile([0.1, 0.9], (count, 1)), wall, None, parameters)

    assert result.termination is Termination.DEGENERATE
    assert_failed(result, np.eye(3))
    assert result.inlier_count >= 3


def test_a_target_in_one_spot_is_degenerate():
    result = icp(0.1 * scatter(3), np.tile([0.1, 0.0], (5, 1)), None, BY_POINT)

    assert result.termination is Termination.DEGENERATE


def test_lines_without_any_surface_are_degenerate_not_far_away():
    """Scatter wider than a surface: every point has a partner, none has a normal."""
    result = icp(SPARSE, SPARSE, None, BY_LINE)
    assert result.termination is Termination.DEGENERATE
    assert_failed(result, np.eye(3))
    assert result.inlier_count == 0
    assert np.isnan(result.correspondences.residuals).all()
    assert icp(SPARSE, SPARSE, None, BY_POINT).converged


# ---------------------------------------------------------------- the record


@METRICS
def test_history_and_result_agree(parameters, in_the_room):
    result = icp(in_the_room.source, in_the_room.target, None, parameters)
    first, last = result.history[0], result.history[-1]
    assert result.iterations == len(result.history) - 1 > 1
    np.testing.assert_array_equal(first.T_target_source, np.eye(3))
    assert math.isnan(first.translation_step)
    assert math.isnan(first.rotation_step)
    np.testing.assert_array_equal(last.T_target_source, result.T_target_source)
    assert result.fitness == result.inlier_count / len(in_the_room.source)
    assert result.message == result.termination.value


@METRICS
def test_a_step_is_the_difference_of_two_poses(parameters, in_the_room):
    result = icp(in_the_room.source, in_the_room.target, None, parameters)

    for before, now in pairwise(result.history):
        x, y, theta = to_xytheta(now.T_target_source) - to_xytheta(before.T_target_source)
        assert now.translation_step == pytest.approx(math.hypot(x, y), abs=1e-15)
        assert now.rotation_step == pytest.approx(abs(wrap(theta)), abs=1e-15)


@METRICS
def test_correspondences_belong_to_the_final_pose(parameters, in_the_room):
    source, target = in_the_room.source, Target(in_the_room.target)
    result = icp(source, target, None, parameters)
    pairs = result.correspondences
    moved = apply(result.T_target_source, source.points)
    index, distances = target.search.query(moved)
    np.testing.assert_allclose(pairs.source, moved, atol=1e-14)
    np.testing.assert_array_equal(pairs.target, target.points[index])
    np.testing.assert_array_equal(pairs.target_index, index)
    np.testing.assert_allclose(pairs.distances, distances, atol=1e-13)


@METRICS
def test_kept_are_the_pairs_that_every_stage_accepts(parameters, in_the_room):
    source = in_the_room.source
    result = icp(source, in_the_room.target, None, parameters)

    pairs = result.correspondences

    is_accepted = pairs.within_gate & pairs.within_overlap & np.isfinite(pairs.residuals)
    np.testing.assert_array_equal(pairs.kept, is_accepted)
    assert pairs.within_overlap.sum() == math.floor(parameters.overlap_ratio * len(source))
    np.testing.assert_array_equal(pairs.weights > 0.0, pairs.kept)
    assert (pairs.residuals[pairs.kept] <= pairs.distances[pairs.kept] + 1e-15).all()
    inliers = pairs.distances[pairs.kept]
    assert result.inlier_rmse == pytest.approx(math.sqrt(np.mean(inliers**2)))


def test_the_cost_by_hand():
    """Four points: two matched, one trimmed, and one outside the gate, charged at its edge."""
    target = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [30.0, 0.0]])
    source = target + np.array([[0.0, 0.1], [0.0, 0.3], [0.0, 2.0], [0.0, 3.0]])
    parameters = IcpParameters(
        max_correspondence_distance=1.0, overlap_ratio=0.75, huber_delta=0.2, max_iterations=1
    )
    first = icp(source, target, None, parameters).history[0]
    expected = (0.1**2 + (2 * 0.2 * 0.3 - 0.2**2) + (2 * 0.2 * 1.0 - 0.2**2)) / 4
    assert first.cost == pytest.approx(expected, rel=1e-12)
    assert first.inlier_count == 2


def test_a_calmer_step_is_the_same_way_in_smaller_strides(in_the_room):
    """Half the turn, and half the way of the pairs' centroid, wherever the origin is."""
    target = Target(in_the_room.target)
    full = icp(in_the_room.source, target, None, BY_LINE)
    half = icp(in_the_room.source, target, None, replace(BY_LINE, step_fraction=0.5))
    kept = full.history[0].correspondences.kept

    def centroid(iteration):
        return iteration.correspondences.source[kept].mean(axis=0)

    way = centroid(full.history[1]) - centroid(full.history[0])
    half_way = centroid(half.history[1]) - centroid(half.history[0])
    np.testing.assert_allclose(half_way, 0.5 * way, atol=1e-12)
    half_turn = 0.5 * full.history[1].rotation_step
    assert half.history[1].rotation_step == pytest.approx(half_turn, rel=1e-9)


def test_calmer_steps_are_more_steps_to_the_same_place(in_the_room):
    target = Target(in_the_room.target)

    full = icp(in_the_room.source, target, None, BY_LINE)
    half = icp(in_the_room.source, target, None, replace(BY_LINE, step_fraction=0.5))

    assert half.iterations > full.iterations
    distance, angle = error(half.T_target_source, full.T_target_source)
    assert distance < 1e-3
    assert angle < 1e-3
