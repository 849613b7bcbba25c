"""simpleICP: point-to-plane, solved as a general non-linear problem."""

from __future__ import annotations

import os
from contextlib import redirect_stdout

import numpy as np
from simpleicp import PointCloud, SimpleICP

from labkit import Scan, to_xytheta
from labkit.support.arrays import FloatArray
from matchers.space import drop_transform, wall

COLUMNS = ["x", "y", "z"]
SLOW = True  # a good second a pair
MOST_POINTS = 2_000  # 5,000 take many seconds
WALL_HEIGHT = 0.1  # m
MAX_ITERATIONS = 60
IN_PLANE = (np.inf, np.inf, 0.0, 0.0, 0.0, np.inf)  # weights that fix roll, pitch and z
SILENCE = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - as long as the process


def can_match(scan: Scan) -> bool:
    """Whether a pair takes no more than a few seconds."""
    return len(scan) <= MOST_POINTS


def match(
    source: FloatArray, target: FloatArray, T_init: FloatArray, gate: float
) -> tuple[FloatArray, None]:
    """Standing wall to standing wall; it prints as it goes, which is caught."""
    x, y, theta = to_xytheta(T_init)
    problem = SimpleICP()
    problem.add_point_clouds(_cloud(target), _cloud(source))
    with redirect_stdout(SILENCE):
        T, *_ = problem.run(
            correspondences=2 * len(target),
            max_overlap_distance=gate,
            max_iterations=MAX_ITERATIONS,
            min_planarity=0.0,  # every wall was made one
            rbp_observed_values=(0.0, 0.0, np.degrees(theta), x, y, 0.0),
            rbp_observation_weights=IN_PLANE,
        )
    return drop_transform(T), None


def _cloud(points: FloatArray) -> PointCloud:
    return PointCloud(wall(points, WALL_HEIGHT), columns=COLUMNS)


MATCHERS = {"simpleICP": match}
