"""``python -m labkit.support.warm``: compile all stages now, not in a first cell."""

import numpy as np

from labkit import IcpParameters, Scan, align, correspondences, covariance, icp, line_alignment
from labkit.icp import minimise
from labkit.odometry import estimate_odometry


def warm() -> None:
    """Call every stage that Python calls, on a room of a few points."""
    angles = np.linspace(-2.0, 2.0, 90)
    room = Scan.from_ranges(2.0 + np.cos(angles), angles)
    points = room.points
    normals = points / np.hypot(points[:, :1], points[:, 1:])
    ones = np.ones(len(room))
    for scan in (room, points):
        for metric in ("point_to_point", "point_to_line"):
            result = icp(scan, scan, None, IcpParameters(metric=metric, step_fraction=0.9))
            minimise(result.history[0].correspondences)
            _ = result.cost, result.observability  # computed when they are asked for
            covariance.censi_covariance(result, 0.01)
    result.target.search.query(points)
    align(points, points)
    line_alignment.align_to_lines(points, points, normals, ones)
    correspondences.distance_gate(ones, 0.5)
    correspondences.overlap(ones, 0.5)
    correspondences.huber_weights(ones, 0.5)
    correspondences.huber_loss(ones, 0.5)
    estimate_odometry([room, room, Scan.from_points(points + 5.0), room])


if __name__ == "__main__":
    warm()
