"""Censi's covariance: against the implicit function, and against the spread itself."""

import math

import numpy as np
import pytest

from labkit import IcpParameters, Scan, Target, icp
from labkit.covariance import (
    censi_covariance,
    censi_information,
    fuse,
    range_noise,
)
from labkit.odometry import OdometryParameters
from labkit.se2 import apply, from_xytheta, to_xytheta, transform
from labkit.simulation import Lidar, cast, corner, corridor, room

RANGE_STD = 0.01
HERE = np.eye(3)
MOTION = transform(0.1, 0.05, math.radians(3.0))
ODOMETRY = OdometryParameters().icp
BY_LINE = IcpParameters(metric="point_to_line", translation_tolerance=1e-5, rotation_tolerance=1e-5)


def match_two_scans(seed, metric=BY_LINE, world=None):
    """The result of a match between two noisy scans of a world, by default of the room."""
    rng = np.random.default_rng(seed)
    place = room() if world is None else world
    lidar = Lidar(noise_std=RANGE_STD)
    target = cast(place, HERE, lidar, rng=rng)
    source = cast(place, MOTION, lidar, rng=rng)
    return icp(source, target, None, metric)


def lengthen_ray(points, i, step):
    """The points with the range of the i-th longer by `step` [m]."""
    longer = points.copy()
    longer[i] *= 1.0 + step / np.hypot(*points[i])
    return longer


def minimise_held(result, source_points, target_points):
    """The minimum x of (6.4)'s cost for other points; pairs, normals and weights are the result's.

    Newton's method, from the result on.
    """
    pairs = result.correspondences
    index = pairs.target_index[pairs.kept]
    n, w = result.target.normals[index], pairs.weights[pairs.kept]
    p, q = source_points[pairs.kept], target_points[index]
    x = to_xytheta(result.T_target_source)
    for _ in range(20):
        T = from_xytheta(x)
        arm = p @ T[:2, :2].T
        r = (n * (arm + T[:2, 2] - q)).sum(axis=1)
        slope = np.column_stack([n, n[:, 1] * arm[:, 0] - n[:, 0] * arm[:, 1]])
        gradient = slope.T @ (w * r)
        hessian = (slope * w[:, None]).T @ slope
        hessian[2, 2] -= (w * r * (n * arm).sum(axis=1)).sum()
        x = x - np.linalg.solve(hessian, gradient)
    return x


def derivative_by_range(function, points, i):
    """The derivative of a function of points by the range of the i-th: a central difference."""
    h = 1e-5
    longer = function(lengthen_ray(points, i, h))
    shorter = function(lengthen_ray(points, i, -h))
    return (longer - shorter) / (2.0 * h)


def test_it_is_the_implicit_function_theorem():
    """The law: cov(x) = (∂x/∂z) cov(z) (∂x/∂z)ᵀ, where each range z is moved in turn.

    The scans are noisy, so that no term of the closed form is too small to be seen, and points of
    the target serve several pairs.
    """
    rng = np.random.default_rng(1)
    target = Target(cast(room(), HERE, Lidar(beam_count=61, noise_std=0.05), rng=rng))
    source = cast(room(), MOTION, Lidar(beam_count=121, noise_std=0.05), rng=rng)
    result = icp(source, target, metric="point_to_line", huber_delta=math.inf)
    pairs = result.correspondences
    target_rows = pairs.target_index[pairs.kept]
    p, q = source.points, target.points
    std = 0.1  # [m], more than the residuals show

    covariance = censi_covariance(result, std)

    by_source = [
        derivative_by_range(lambda moved: minimise_held(result, moved, q), p, i)
        for i in np.flatnonzero(pairs.kept)
    ]
    by_target = [
        derivative_by_range(lambda moved: minimise_held(result, p, moved), q, j)
        for j in np.unique(target_rows)
    ]
    jacobian = np.column_stack([*by_source, *by_target])
    expected = std**2 * jacobian @ jacobian.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(covariance / scale, expected / scale, atol=1e-5)
    np.testing.assert_allclose(minimise_held(result, p, q), result.xytheta, atol=1e-6)
    assert np.unique(target_rows).size < target_rows.size


def test_a_point_at_the_scanner_itself_is_no_reason_for_nan():
    """No beam ends there, but a scan in another frame may have such a point."""
    wall = np.linspace(-2.0, 2.0, 41)
    side = np.linspace(0.0, 3.0, 41)
    points = np.vstack([np.column_stack([wall, 0.0 * wall]), np.column_stack([0 * side + 2, side])])
    assert not points[20].any()
    moved = points + np.array([0.02, 0.01])
    result = icp(moved, points, None, BY_LINE)
    covariance = censi_covariance(result, RANGE_STD)
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()


def match_in_corridor(turn):
    """The result of a match in a corridor that runs at an angle `turn` to the x axis."""
    A = from_xytheta([0.0, 0.0, turn])
    result = match_two_scans(3, world=corridor())
    target = Target(apply(A, result.target.points), result.target.normals @ A[:2, :2].T)
    return icp(apply(A, result.source.points), target, None, BY_LINE)


HEADINGS = pytest.mark.parametrize("turn", np.arange(12) * math.pi / 6.0)


@HEADINGS
def test_the_variance_is_infinite_on_the_axes_that_lean_towards_a_corridor(turn):
    result = match_in_corridor(turn)

    variances = np.diag(censi_covariance(result, RANGE_STD))

    is_free = np.abs([math.cos(turn), math.sin(turn), 0.0]) > 0.05
    np.testing.assert_array_equal(np.isinf(variances), is_free)
    assert np.sqrt(variances[~is_free]).max() < 0.01


@HEADINGS
def test_there_is_no_information_along_a_corridor(turn):
    result = match_in_corridor(turn)

    information = censi_information(result, RANGE_STD)

    along = np.array([math.cos(turn), math.sin(turn), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    np.testing.assert_allclose(information, information.T, atol=1e-9 * information.max())
    assert along @ information @ along < 1e-3 * (across @ information @ across)


@pytest.mark.parametrize("told", [None, 1e-4])
def test_a_noise_that_is_told_too_small_is_measured_instead(told):
    result = match_two_scans(3)

    covariance = censi_covariance(result, told)

    assert 0.8 * RANGE_STD < range_noise(result, told) < 1.2 * RANGE_STD
    np.testing.assert_array_equal(covariance, censi_covariance(result, result.target.noise))
    assert range_noise(result, 0.1) == 0.1


def test_what_is_fused_is_the_most_likely_motion():
    """The estimate and the prior, weighted by their informations, across the cut at π, too."""
    result = match_two_scans(3)
    estimate = to_xytheta(result.T_target_source)
    near_estimate = estimate + np.array([3e-3, -2e-3, 1e-3])
    full_turn = np.array([0.0, 0.0, math.tau])
    prior_covariance = np.diag([2e-3, 1e-3, 5e-4]) ** 2

    mean, covariance = fuse(result, RANGE_STD, near_estimate + full_turn, prior_covariance)

    of_match = np.linalg.inv(censi_covariance(result, RANGE_STD))
    of_prior = np.linalg.inv(prior_covariance)
    np.testing.assert_allclose(covariance, np.linalg.inv(of_match + of_prior), rtol=1e-6)
    expected = covariance @ (of_match @ estimate + of_prior @ near_estimate)
    np.testing.assert_allclose(mean - full_turn, expected, atol=1e-9)


def test_the_information_is_the_inverse_of_the_covariance():
    result = match_two_scans(3)

    information = censi_information(result, RANGE_STD)

    inverse = np.linalg.inv(censi_covariance(result, RANGE_STD))
    np.testing.assert_allclose(information, inverse, rtol=1e-6)


@pytest.mark.parametrize(
    ("world", "at", "seen", "along", "beams", "noise"),
    [
        (room(), HERE, 3, 0.05, 180, 0.01),
        (corner(), transform(2.0, 2.0, math.radians(-135.0)), 3, 0.05, 180, 0.01),
        (corridor(), HERE, 2, 0.3, 541, 0.03),
    ],
    ids=["room", "corner", "corridor"],
)
def test_errors_are_as_large_as_promised_at_every_heading(world, at, seen, along, beams, noise):
    """From wheels that are `along` [m] off, with `seen` degrees of freedom: 12 headings, 8 draws.

    The mean NEES a degree of freedom is 1, without the wheels and fused with them. Twice that
    would be errors 1.4 times as large as promised; half of it, 1.4 times as small.
    """
    rng = np.random.default_rng(0)
    lidar = Lidar(beam_count=beams, noise_std=noise)
    wheel_std = np.array([along, 0.03, 0.02])
    truth = to_xytheta(MOTION)
    nees = []
    for turn in 0.1 + np.arange(12) * math.pi / 6.0:
        start = at @ transform(0.0, 0.0, turn)
        world_axes = transform(0.0, 0.0, -turn)
        prior_covariance = world_axes @ np.diag(wheel_std**2) @ world_axes.T
        for _ in range(8):
            target, source = (cast(world, start @ T, lidar, rng=rng) for T in (HERE, MOTION))
            prior = truth + world_axes @ rng.normal(0.0, wheel_std)
            result = icp(source, target, from_xytheta(prior), ODOMETRY)
            mean, covariance = fuse(result, noise, prior, prior_covariance)
            error = result.xytheta - truth
            of_match = error @ censi_information(result, noise) @ error
            of_fusion = (mean - truth) @ np.linalg.solve(covariance, mean - truth)
            nees.append([of_match / seen, of_fusion / 3])

    mean_nees = np.mean(nees, axis=0)
    assert ((mean_nees > 0.5) & (mean_nees < 2.0)).all()


def test_point_to_point_knows_that_its_pairs_stick():
    """Without the slip its mean NEES is 230, where 3 is right."""
    nees = []
    for seed in range(20):
        result = match_two_scans(seed, IcpParameters())
        error = to_xytheta(result.T_target_source) - to_xytheta(MOTION)
        nees.append(error @ np.linalg.solve(censi_covariance(result, RANGE_STD), error))

    assert np.mean(nees) < 12.0


def test_rough_surfaces_count_as_noise():
    """A wall of gravel, measured without noise: its residuals say how far to trust it."""
    rng = np.random.default_rng(0)
    smooth = match_two_scans(2).source
    shape = smooth.points.shape
    rough = [
        Scan(points=smooth.points + rng.normal(0.0, 0.02, shape), beams=smooth.beams)
        for _ in range(2)
    ]
    result = icp(*rough, None, BY_LINE)
    covariance = censi_covariance(result, 1e-4)
    np.testing.assert_allclose(covariance, censi_covariance(result, 1e-3), rtol=1e-9)
    assert np.sqrt(covariance[0, 0]) > 1e-3
