"""``python -m labkit.support.warm``: compile all stages now, not in a first cell."""

import numpy as np

from labkit import IcpParameters, Scan, align, correspondences, covariance, icp, line_alignment
from labkit.icp import minimise
from labkit.odometry import estimate_odometry


def warm() -> None:
    """Call every stage that Python calls, on a room of a few points."""
    room = Scan.from_ranges(2.0 + np.cos(angles := np.linspace(-2.0, 2.0, 90)), angles)
    p, ones = room.points, np.ones(len(room))
    normals = p / np.hypot(*p.T)[:, None]
    for scan in (room, p):
        for metric in ("point_to_point", "point_to_line"):
            result = icp(scan, scan, None, IcpParameters(metric=metric, step_fraction=0.9))
            minimise(result.history[0].correspondences), result.cost, result.observability
    covariance.censi_covariance(result, 0.01), result.target.search.query(p)
    align(p, p), line_alignment.align_to_lines(p, p, normals, ones)
    for stage in ("distance_gate", "overlap", "huber_weights", "huber_loss"):
        getattr(correspondences, stage)(ones, 0.5)
    estimate_odometry([room, room, Scan.from_points(p + 5.0), room])


if __name__ == "__main__":
    warm()
