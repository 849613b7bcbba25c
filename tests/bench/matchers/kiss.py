"""The registration of KISS-ICP: point-to-point with a robust kernel, over a voxel map."""

from __future__ import annotations

import numpy as np
from kiss_icp.mapping import VoxelHashMap
from kiss_icp.registration import Registration

from labkit.support.arrays import FloatArray
from matchers.space import drop_transform, lift, lift_transform

POINTS_PER_VOXEL = 100  # of a voxel as wide as the gate: points down to 1/10 of it apart
KERNEL = 1.0 / 3.0  # of the gate, the rule of its pipeline; less is more exact and loses the basin
RANGE_MAX = 1e3  # m, farther than any point
REGISTRATION = Registration(max_num_iterations=60, convergence_criterion=1e-3, max_num_threads=1)


def registration(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, None]:
    """One frame against the map of one other, without the pipeline's downsampling."""
    surface = VoxelHashMap(gate, RANGE_MAX, POINTS_PER_VOXEL)
    surface.add_points(lift(target))
    T = REGISTRATION.align_points_to_map(
        lift(source), surface, lift_transform(T_init), gate, KERNEL * gate
    )
    return drop_transform(np.asarray(T)), None


MATCHERS = {"KISS-ICP registration": registration}
