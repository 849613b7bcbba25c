"""small_gicp: ICP, point-to-plane ICP and generalised ICP."""

from __future__ import annotations

import small_gicp

from labkit.support.arrays import FloatArray
from matchers.space import drop_transform, lift, lift_transform, wall

NEIGHBORS = 10  # of the standing wall: half of them in either layer
WALL_HEIGHT = 0.05  # m
MAX_ITERATIONS = 60


def icp(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Point-to-point, flat."""
    return _match(_cloud(lift(source)), _cloud(lift(target)), T_init, gate, "ICP")


def plane_icp(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Point-to-plane against standing walls."""
    surface = _cloud(wall(target, WALL_HEIGHT))
    tree = small_gicp.KdTree(surface)
    small_gicp.estimate_normals(surface, tree, NEIGHBORS)
    return _match(_cloud(lift(source)), surface, T_init, gate, "PLANE_ICP", tree)


def gicp(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Standing wall to standing wall."""
    clouds = _cloud(wall(source, WALL_HEIGHT)), _cloud(wall(target, WALL_HEIGHT))
    trees = [small_gicp.KdTree(cloud) for cloud in clouds]
    for cloud, tree in zip(clouds, trees, strict=True):
        small_gicp.estimate_covariances(cloud, tree, NEIGHBORS)
    return _match(*clouds, T_init, gate, "GICP", trees[1])


def _cloud(points: FloatArray) -> small_gicp.PointCloud:
    return small_gicp.PointCloud(points)


def _match(
    source: small_gicp.PointCloud,
    target: small_gicp.PointCloud,
    T_init: FloatArray,
    gate: float,
    method: str,
    tree: small_gicp.KdTree | None = None,
) -> tuple[FloatArray, int]:
    result = small_gicp.align(
        target,
        source,
        tree,
        lift_transform(T_init),
        method,
        max_correspondence_distance=gate,
        num_threads=1,
        max_iterations=MAX_ITERATIONS,
    )
    return drop_transform(result.T_target_source), result.iterations


MATCHERS = {
    "small_gicp ICP": icp,
    "small_gicp point-to-plane": plane_icp,
    "small_gicp GICP": gicp,
}
