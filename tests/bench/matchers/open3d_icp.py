"""Open3D's registration pipeline, point-to-point and point-to-plane with Huber's loss."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from open3d.pipelines import registration

from labkit.support.arrays import FloatArray
from matchers.space import drop_transform, lift, lift_transform, normals

HUBER_DELTA = 0.02  # m
NEIGHBORS = 5
MAX_ITERATIONS = 60
POINT_TO_POINT = registration.TransformationEstimationPointToPoint()
POINT_TO_PLANE = registration.TransformationEstimationPointToPlane(
    registration.HuberLoss(k=HUBER_DELTA)
)

o3d.utility.set_max_threads(1)
o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)


def point_to_point(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, None]:
    """Its default method."""
    return _match(_cloud(source), _cloud(target), T_init, gate, POINT_TO_POINT, 1e-4)


def point_to_plane(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, None]:
    """With normals of the plane, which its own estimate would turn towards z."""
    surface = _cloud(target)
    surface.normals = o3d.utility.Vector3dVector(lift(normals(target, NEIGHBORS)))
    return _match(_cloud(source), surface, T_init, gate, POINT_TO_PLANE, 1e-5)


def _cloud(points: FloatArray) -> o3d.geometry.PointCloud:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(lift(points)))


def _match(
    source: o3d.geometry.PointCloud,
    target: o3d.geometry.PointCloud,
    T_init: FloatArray,
    gate: float,
    method: registration.TransformationEstimation,
    tolerance: float,
) -> tuple[FloatArray, None]:
    stop = registration.ICPConvergenceCriteria(tolerance, tolerance, MAX_ITERATIONS)
    result = registration.registration_icp(
        source, target, gate, lift_transform(T_init), method, stop
    )
    return drop_transform(np.asarray(result.transformation)), None


MATCHERS = {
    "Open3D point-to-point": point_to_point,
    "Open3D point-to-plane + Huber": point_to_plane,
}
