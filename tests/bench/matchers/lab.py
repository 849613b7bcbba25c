"""labkit itself, with the parameters of its odometry."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from labkit import IcpParameters, Scan, icp
from labkit.odometry import OdometryParameters
from labkit.support.arrays import FloatArray

TAKES_SCANS = True
POINT_TO_LINE = OdometryParameters().icp
PEERS_STOP = 1e-3  # [m] and [rad]: where KISS-ICP, MRPT and small_gicp end, too
# As small_gicp's ICP: all pairs within the gate count, and count alike.
POINT_TO_POINT = IcpParameters(
    overlap_ratio=1.0,
    huber_delta=math.inf,
    translation_tolerance=PEERS_STOP,
    rotation_tolerance=PEERS_STOP,
)


def point_to_line(
    source: Scan, target: Scan, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Distances to the lines through the target's surface; normals by beams where it has them."""
    return _match(source, target, T_init, _with_gate(POINT_TO_LINE, gate))


def point_to_point(
    source: Scan, target: Scan, T_init: FloatArray, gate: float
) -> tuple[FloatArray, int]:
    """Distances to the target's points, of all pairs alike: at the error of its peers."""
    return _match(source, target, T_init, _with_gate(POINT_TO_POINT, gate))


@cache
def _with_gate(parameters: IcpParameters, gate: float) -> IcpParameters:
    """Parameters are checked when they are made, and made once for a log."""
    return replace(parameters, max_correspondence_distance=gate)


def _match(
    source: Scan, target: Scan, T_init: FloatArray, parameters: IcpParameters
) -> tuple[FloatArray, int]:
    result = icp(source, target, T_init, parameters)
    return result.T_target_source, result.iterations


MATCHERS = {"labkit point-to-line": point_to_line, "labkit point-to-point": point_to_point}
