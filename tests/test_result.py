"""Results that do not contradict themselves, nor change once they are made."""

import numpy as np
import pytest

from labkit import ACCURATE, IcpParameters, Target, apply, icp, to_xytheta, transform
from labkit.correspondences import pairs_at
from labkit.covariance import censi_covariance
from labkit.evaluation import ErrorSummary
from labkit.simulation import Lidar, room, scan_along


def test_a_result_does_not_change_with_the_arrays_that_it_was_made_of(in_the_room):
    points = in_the_room.source.points.copy()
    T_init = np.eye(3)
    result = icp(points, in_the_room.target, T_init)

    points[:] = 0.0
    T_init[:] = 0.0

    np.testing.assert_array_equal(result.source.points, in_the_room.source.points)
    np.testing.assert_array_equal(result.history[0].T_target_source, np.eye(3))


def test_a_result_holds_the_target_that_was_matched(in_the_room):
    target = Target(in_the_room.target)

    result = icp(in_the_room.source, target)

    assert result.target is target


def test_the_last_iteration_is_the_estimate(in_the_room):
    result = icp(in_the_room.source, in_the_room.target)

    np.testing.assert_array_equal(result.T_target_source, result.history[-1].T_target_source)
    assert result.history[-1].correspondences is result.correspondences


@pytest.mark.parametrize(
    "array",
    [
        lambda result: result.T_target_source,
        lambda result: result.poses,
        lambda result: result.source.points,
        lambda result: result.target.points,
        lambda result: result.target.normals,
        lambda result: result.correspondences.distances,
        lambda result: result.history[0].correspondences.weights,
    ],
)
def test_nobody_writes_to_the_arrays_of_a_result(array, in_the_room):
    result = icp(in_the_room.source, in_the_room.target)

    with pytest.raises(ValueError, match="read-only"):
        array(result)[0] = 0.0


def test_a_result_describes_itself_in_one_line(in_the_room):
    result = icp(in_the_room.source, in_the_room.target)
    assert repr(result) == (
        f"<IcpResult: converged: the last step was below both pose tolerances; "
        f"{result.iterations} iterations, 459 of {len(in_the_room.source)} pairs kept>"
    )


def test_an_iteration_describes_itself_in_one_line(in_the_room):
    last = icp(in_the_room.source, in_the_room.target).history[-1]

    text = repr(last)

    assert text.startswith(f"<Iteration: step {last.translation_step:.3g} m, ")
    assert text.endswith(f"; {last.inlier_count} of {len(in_the_room.source)} pairs kept>")


def test_one_line_takes_parameters_by_name_and_a_guess_in_numbers(in_the_room):
    source, target = in_the_room.source, in_the_room.target
    guess = [0.1, -0.05, 0.02]

    short = icp(source, target, guess, metric="point_to_line", overlap_ratio=0.9)

    parameters = IcpParameters(metric="point_to_line", overlap_ratio=0.9)
    expected = icp(source, target, transform(*guess), parameters)
    np.testing.assert_array_equal(short.poses, expected.poses)
    assert short.parameters == parameters


def test_a_result_tells_its_motion_and_covariance(in_the_room):
    result = icp(in_the_room.source, in_the_room.target, parameters=ACCURATE)
    np.testing.assert_array_equal(result.xytheta, to_xytheta(result.T_target_source))
    np.testing.assert_array_equal(result.covariance(0.01), censi_covariance(result, 0.01))
    assert np.isnan(icp([[0.0, 0.0]], [[0.0, 0.0]]).xytheta).all()


def test_a_scan_stands_for_its_points(in_the_room):
    source, target = in_the_room.source, in_the_room.target
    T = transform(0.1, 0.0, 0.02)

    np.testing.assert_array_equal(apply(T, source), apply(T, source.points))
    of_scans = pairs_at(source, target, T, ACCURATE)
    of_points = pairs_at(source.points, Target(target), T, ACCURATE)
    np.testing.assert_array_equal(of_scans.distances, of_points.distances)


@pytest.mark.parametrize("beams", [180, 1000])
def test_the_readme_s_match_is_accurate(beams):
    """Two scans of a room, 1 cm of noise, no guess: 2 mm and 0.03° in the median, converged."""
    rng = np.random.default_rng(beams)
    lidar = Lidar(beam_count=beams, noise_std=0.01)
    shifts, turns = [], []

    for seed in range(20):
        older = rng.uniform([-1.5, -1.0, -3.0], [1.5, 1.0, 3.0])
        newer = older + rng.normal(0.0, [0.1, 0.1, 0.08])
        scans = scan_along(room(), [older, newer], lidar, rng=seed)
        result = icp(scans[1], scans[0], parameters=ACCURATE)
        true = to_xytheta(np.linalg.inv(transform(*older)) @ transform(*newer))
        shifts.append(np.hypot(*(result.xytheta - true)[:2]))
        turns.append(abs(result.xytheta - true)[2])
        assert result.converged, result

    assert ErrorSummary.of(shifts).median < 0.002
    assert ErrorSummary.of(turns).median < np.radians(0.03)
