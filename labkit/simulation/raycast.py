"""Ray casting: how far each beam travels before it meets a segment."""

from __future__ import annotations

import numpy as np

from labkit.arrays import FloatArray
from labkit.se2 import to_xytheta


def first_hits(segments: FloatArray, T_world_scanner: FloatArray, angles: FloatArray) -> FloatArray:
    """The distance along each beam to the nearest segment that it crosses.

    Every end point is seen from every beam: `along` is how far ahead it lies on the beam,
    `across` how far to the left of it. A segment whose ends lie on either side of the
    beam crosses it where `across` has gone linearly to zero. One comparison per end
    point decides the side, so two segments that share an end leave no gap between them.

    Parameters
    ----------
    segments : ndarray, shape (M, 2, 2)
        End points in metres in the world frame.
    T_world_scanner : ndarray, shape (3, 3)
        Where the scanner stands.
    angles : ndarray, shape (B,)
        Directions of the beams in the scanner's frame in radians.

    Returns
    -------
    ndarray, shape (B,)
        Metres; infinity where a beam meets nothing. A segment seen exactly edge-on is
        infinitely thin and returns nothing.

    Examples
    --------
    >>> wall = np.array([[[2.0, -1.0], [2.0, 1.0]]])
    >>> first_hits(wall, np.eye(3), np.array([0.0, np.pi])).tolist()
    [2.0, inf]
    """
    x, y, heading = to_xytheta(T_world_scanner)
    beam_x, beam_y = np.cos(heading + angles)[:, None], np.sin(heading + angles)[:, None]
    ends_x, ends_y = (segments[..., 0] - x).T[:, None, :], (segments[..., 1] - y).T[:, None, :]
    along = beam_x * ends_x + beam_y * ends_y  # (2, B, M)
    across = beam_x * ends_y - beam_y * ends_x
    beam, segment = np.nonzero((across[0] < 0.0) != (across[1] < 0.0))
    (along_a, along_b), (across_a, across_b) = along[:, beam, segment], across[:, beam, segment]
    distance = along_a + across_a / (across_a - across_b) * (along_b - along_a)
    ranges = np.full(len(angles), np.inf)
    ahead = distance >= 0.0
    np.minimum.at(ranges, beam[ahead], distance[ahead])
    return ranges
