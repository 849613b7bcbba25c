"""Normals: exact on a wall, absent where there is no line, turned towards the scanner."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit import Scan, Target
from labkit.normals import estimate_normals
from labkit.se2 import apply, rotation, transform
from labkit.simulation import Lidar, World, cast, room
from labkit.simulation.world import polyline

QUIET = Lidar(noise_std=0.0)


def look(*walls):
    """A noise-free scan of polylines from the origin."""
    segments = np.concatenate([polyline(np.array(wall, dtype=float)) for wall in walls])
    return cast(World(segments=segments), np.eye(3), QUIET, rng=0)


def unordered(scan):
    return Scan.from_points(scan.points)


@pytest.mark.parametrize("order", [lambda scan: scan, unordered])
@given(direction=st.floats(-2.0, 2.0), distance=st.floats(0.5, 5.0))
def test_a_wall_has_its_own_normal_everywhere(order, direction, distance):
    away, along = rotation(direction).T
    scan = order(look([distance * away - 1.2 * along, distance * away + 1.2 * along]))
    normals = estimate_normals(scan)
    seen = np.isfinite(normals[:, 0])
    assert seen.mean() > 0.9
    np.testing.assert_allclose(normals[seen], np.broadcast_to(-away, (seen.sum(), 2)), atol=1e-10)


@pytest.mark.parametrize("order", [lambda scan: scan, unordered])
@pytest.mark.parametrize("theta", [-3.0, 0.8, math.pi])
def test_normals_turn_with_the_scan(order, theta, in_the_room):
    scan = order(in_the_room.target)
    turned = replace(scan, points=apply(transform(0.0, 0.0, theta), scan.points))
    expected = estimate_normals(scan) @ rotation(theta).T
    np.testing.assert_allclose(estimate_normals(turned), expected, atol=1e-9)


def test_the_sweep_order_may_run_backwards(in_the_room):
    scan = in_the_room.target
    backwards = scan.select(np.arange(len(scan))[::-1])
    np.testing.assert_allclose(estimate_normals(backwards)[::-1], estimate_normals(scan), atol=1e-9)


def test_two_walls_at_different_depth_do_not_mix():
    """A pillar's face before a wall: the sweep jumps, and no line bridges the jump."""
    scan = look([[2.0, -0.4], [2.0, 0.4]], [[2.3, -3.0], [2.3, 3.0]])
    normals = estimate_normals(scan)
    is_near = np.isclose(scan.points[:, 0], 2.0)
    assert is_near.any()
    assert not is_near.all()
    np.testing.assert_allclose(normals, np.broadcast_to([-1.0, 0.0], normals.shape), atol=1e-10)


def test_around_a_sharp_corner_there_is_no_normal():
    """60° at the tip: the neighbours spread ahead as much as across; farther off is a wall."""
    rise = math.tan(math.radians(30.0))
    scan = look([[3.0, -rise], [2.0, 0.0], [3.0, rise]])
    normals = estimate_normals(scan)
    from_tip = np.hypot(*(scan.points - [2.0, 0.0]).T)
    assert np.isnan(normals[from_tip.argmin()]).all()
    far = from_tip > 0.35
    expected = np.where(scan.points[far, 1:] > 0.0, [[-0.5, 0.75**0.5]], [[-0.5, -(0.75**0.5)]])
    np.testing.assert_allclose(normals[far], expected, atol=1e-9)


def test_bare_points_get_the_line_through_their_seven_nearest(in_the_room):
    """Against numpy: of those within 0.5 m, three or more, spread twice as far along as across."""
    points = in_the_room.target.points[::9]
    expected = np.full_like(points, np.nan)
    for i, point in enumerate(points):
        distance = np.hypot(*(points - point).T)
        nearest_rows = distance.argsort(kind="stable")[:7]
        neighbors = points[nearest_rows][distance[nearest_rows] <= 0.5]
        if len(neighbors) >= 3:
            (smaller, larger), vectors = np.linalg.eigh(np.cov(neighbors.T))
            if smaller < 0.25 * larger:
                normal = vectors[:, 0]
                expected[i] = -np.sign(normal @ point) * normal

    normals = estimate_normals(Scan.from_points(points))

    assert np.isnan(expected).any()
    np.testing.assert_allclose(normals, expected, atol=1e-9)


@pytest.mark.parametrize("order", [lambda scan: scan, unordered])
def test_a_lone_return_has_no_normal(order):
    lone = np.array([[1.0, 0.0]])
    walls = [np.column_stack([np.full(21, 3.0), s * np.linspace(0.5, 1.5, 21)]) for s in (-1, 1)]
    points = np.vstack([walls[0][::-1], lone, walls[1]])
    scan = order(Scan(points=points, beams=np.arange(43)))
    normals = estimate_normals(scan)
    assert np.isnan(normals[21]).all()
    assert np.isfinite(np.delete(normals, 21, axis=0)).all()


def shuffled_wall(count):
    """Bare points of a wall 2 m ahead, 4 m wide, with 1 cm of noise across it."""
    rng = np.random.default_rng(count)
    across = rng.normal(0.0, 0.01, count)
    return Scan.from_points(np.column_stack([2.0 + across, rng.uniform(-2.0, 2.0, count)]))


@pytest.mark.parametrize("count", [2_000, 20_000])
def test_dense_points_lie_on_their_wall(count):
    target = Target(shuffled_wall(count))

    has_normal = np.isfinite(target.normals[:, 0])
    off_the_wall = np.abs(target.points[has_normal, 0] - 2.0)
    assert has_normal.mean() > 0.97  # all but a few at the wall's ends
    assert np.median(off_the_wall) < 0.01 / math.sqrt(count / 200)  # of 1 cm of noise
    assert np.max(np.abs(target.normals[has_normal, 1])) < 0.3


def test_copies_of_points_change_no_normal(in_the_room):
    points = in_the_room.target.points[::4]
    expected = estimate_normals(Scan.from_points(points))

    normals = estimate_normals(Scan.from_points(np.repeat(points, 20, axis=0)))

    np.testing.assert_array_equal(normals, np.repeat(expected, 20, axis=0))


def test_sparse_points_stay_as_they_were_measured(in_the_room):
    target = Target(in_the_room.target.select(np.arange(0, 541, 5)))

    assert not target.dense
    assert target.points is target.scan.points


def test_sweeps_that_lie_on_one_another_have_no_lines_along_their_beams():
    """Twenty sweeps from one place: the seven nearest of a point lie on its own beam."""
    world = World(segments=polyline(np.array([[3.0, -4.0], [3.0, 4.0]])))
    sweeps = [cast(world, np.eye(3), Lidar(noise_std=0.003), rng=k).points for k in range(20)]

    normals = Target(np.vstack(sweeps)).normals

    tilt = np.abs(normals[:, 1])[np.isfinite(normals[:, 1])]
    assert len(tilt) > 0.9 * len(normals)
    assert np.max(tilt) < 0.5


@pytest.mark.parametrize("noise", [0.003, 0.01, 0.03, 0.06])
def test_the_width_of_a_neighbourhood_follows_the_noise(noise):
    scan = cast(room(), np.eye(3), Lidar(beam_count=20_000, noise_std=noise), rng=0)

    width = Target(scan).line_width

    assert 8.0 * noise < width < 25.0 * noise


LATTICE = 2.0 * np.stack(np.meshgrid(np.arange(5), np.arange(5)), axis=-1).reshape(-1, 2) + 1.0


@pytest.mark.parametrize("beams", [True, False])
@pytest.mark.parametrize(
    "points",
    [np.empty((0, 2)), LATTICE[:1], [[1.0, 0.0], [1.0, 0.1]], LATTICE, np.full((12, 2), 0.1)],
    ids=["none", "one", "two", "wider than the reach", "coinciding"],
)
def test_where_no_line_is_there_is_no_normal(beams, points):
    scan = Scan(points=points, beams=np.arange(len(points)) if beams else None)
    normals = estimate_normals(scan)
    assert normals.shape == (len(points), 2)
    assert np.isnan(normals).all()
