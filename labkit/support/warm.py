"""``python -m labkit.support.warm``: compile all stages now, not in a first cell."""

from __future__ import annotations

import numpy as np

from labkit import IcpParameters, Scan, Target, align, covariance, icp
from labkit.correspondences import distance_gate, huber_loss, huber_weights, overlap
from labkit.icp import minimise
from labkit.line_alignment import align_to_lines
from labkit.odometry import estimate_odometry


def warm() -> None:
    """Call every stage that Python calls, on a room of a few points."""
    angles = np.linspace(-2.0, 2.0, 90)
    room = Scan.from_ranges(2.0 / np.maximum(abs(np.cos(angles)), abs(np.sin(angles))), angles)
    for scan in (room, room.points):
        for metric in ("point_to_point", "point_to_line"):
            result = icp(scan, scan, None, IcpParameters(metric=metric, step_fraction=0.9))
            minimise(result.history[0].correspondences), result.cost, result.observability
    covariance.censi_covariance(result, 0.01)
    p, d = room.points, result.correspondences.distances
    align(p, p), align_to_lines(p, p, p, np.ones(len(p))), Target(p).search.query(p)
    distance_gate(d, 0.5), overlap(d, 0.9), huber_weights(d, 0.1), huber_loss(d, 0.1)
    for priors in (None, np.zeros((4, 3))):
        estimate_odometry([room, room, Scan.from_points(room.points + 5.0), room], priors)


if __name__ == "__main__":
    warm()
