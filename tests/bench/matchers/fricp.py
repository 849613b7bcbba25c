"""Fast and Robust ICP (Zhang, Yao, Deng, TPAMI 2022) by fricp-cpp."""

from __future__ import annotations

import fricp_cpp
import numpy as np

from labkit.support.arrays import FloatArray
from matchers.space import drop_transform, lift, lift_transform, normals

NEIGHBORS = 5
# Neither annealing (point-to-point) nor Anderson's acceleration (point-to-plane) pays here.
POINT_TO_POINT = {"anneal": False}
POINT_TO_PLANE = {"use_anderson": False, "tolerance": 1e-4}


def point_to_point(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Its robust method with Welsch's function."""
    surface = fricp_cpp.Target(lift(target))
    return _match(source, surface, T_init, gate, "point_to_point", POINT_TO_POINT)


def point_to_plane(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """The same to planes, with normals of the plane."""
    surface = fricp_cpp.Target(lift(target), lift(normals(target, NEIGHBORS)))
    return _match(source, surface, T_init, gate, "point_to_plane", POINT_TO_PLANE)


def _match(
    source: FloatArray,
    target: fricp_cpp.Target,
    T_init: FloatArray,
    gate: float,
    method: str,
    options: dict[str, float],
) -> tuple[FloatArray, int]:
    result = fricp_cpp.registration_icp(
        lift(source), target, gate, lift_transform(T_init), method, num_threads=1, **options
    )
    T = np.asarray(result.transformation)
    return drop_transform(T), result.robust_info["num_iterations"]


MATCHERS = {"fricp-cpp point-to-point": point_to_point, "fricp-cpp point-to-plane": point_to_plane}
