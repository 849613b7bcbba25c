"""Pose graphs in g2o's text format: scans and vertices in, vertices and edges out.

::

    VERTEX_SE2 id x y theta
    ROBOTLASER1 …                      (the scan at the vertex above; see `laser_lines`)
    EDGE_SE2 i j dx dy dtheta I11 I12 I13 I22 I23 I33
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_floats, as_poses
from labkit.errors import InvalidPointsError, LogError
from labkit.files import atomic_write
from labkit.logs.laser_lines import Pose, parse_laser_line
from labkit.logs.laser_scans import LaserScans
from labkit.logs.lines import DamagedLine, DamageReport, expect_fields, pose
from labkit.logs.log import LogStream
from labkit.logs.poses import (
    SAME_PLACE,
    PoseTable,
    agree_on_mounting,
    beyond,
    is_few,
    leave_out,
    move_to_scanner,
    refuse_second_offset,
)
from labkit.logs.source import TextSource
from labkit.se2 import wrap

G2O_WORDS = frozenset({"VERTEX_SE2", "EDGE_SE2"})
"""First words of a line that tell a g2o graph."""

REPEATED = 1e-4
"""A pose this near to its vertex [m, rad] is the vertex over again."""


def read_g2o(
    source: TextSource,
    report: DamageReport,
    scans: LaserScans,
    *,
    name: str,
    laser_offset: FloatArray,
) -> LogStream:
    """Read a g2o graph with ``ROBOTLASER1`` lines; see `labkit.logs.read_log`.

    A scan belongs to the vertex above it. The vertices are the reference, carried to the
    scanner by the laser lines' own mounting, or by `laser_offset` where they declare none:
    where laser and robot coincide, or part along the run. The robot's poses are the
    odometry, unless they merely repeat the vertices, as in the Killian graph: then the log
    holds no odometry, and says None. A few lines that contradict the others in this or in
    their mounting are damaged, and skipped.
    """
    vertex: Pose | None = None
    for number, text in source.lines(report):
        word = text.split(maxsplit=1)[:1]
        try:
            if word == ["VERTEX_SE2"]:
                vertex = None
                vertex = _parse_vertex(text.split())
            elif word == ["ROBOTLASER1"]:
                line = parse_laser_line(text.split())
                if vertex is None:
                    raise DamagedLine("a scan of no vertex, expected a VERTEX_SE2 line above it")
                scans.add(number, line, vertex)
                vertex = None
        except DamagedLine as damage:
            report.skip(number, damage)
    if not len(scans):
        raise LogError(
            f"{report.file}: a g2o graph without any scan, expected a ROBOTLASER1 line below "
            f"each VERTEX_SE2{report.summary()}"
        )
    table, mount = agree_on_mounting(scans.table(), report)
    if mount is None or not mount.any():
        mount = laser_offset
    else:
        refuse_second_offset(laser_offset, mount, report.file)
    table, repeated = _agree_on_repetition(table, report)
    return LogStream(
        scans=scans.stream(source, table, report, sick=False),
        stamps=table.stamps,
        odometry=None if repeated else move_to_scanner(table.robot, mount),
        reference=move_to_scanner(table.vertices, mount),
        name=name,
        format="g2o",
        skipped=report.skipped,
        remarks=report.remarks,
    )


def write_g2o(
    path: str | os.PathLike[str],
    poses: ArrayLike,
    increments: ArrayLike,
    *,
    pairs: ArrayLike | None = None,
    information: ArrayLike | None = None,
) -> None:
    """Write a pose graph: one ``VERTEX_SE2`` per pose, one ``EDGE_SE2`` per increment.

    Parameters
    ----------
    path : path-like
        The file, written whole or not at all.
    poses : array_like, shape (K, 3)
        Vertices 0 … K−1 in the world, rows (x [m], y [m], θ [rad]).
    increments : array_like, shape (E, 3)
        Edges: the pose of vertex j seen from vertex i, ``T_i_j``.
    pairs : array_like of int, shape (E, 2), optional
        The (i, j) of each edge; by default edge k goes from k to k + 1, and E = K − 1.
    information : array_like, shape (3, 3) or (E, 3, 3), optional
        Inverse covariance of all edges or of each, [1/m², 1/rad²]; identity by default.

    Raises
    ------
    InvalidPointsError
        If shapes do not fit together, or a number is not finite.
    WriteError
        If the file cannot be written.
    """
    vertices = as_poses(poses, "poses")
    edges = as_poses(increments, "increments")
    ends = _as_pairs(pairs, len(vertices), len(edges))
    upper = _upper_triangles(information, len(edges))
    with atomic_write(path) as file:
        for index, row in enumerate(vertices.tolist()):
            file.write(" ".join(["VERTEX_SE2", str(index), *map(repr, row)]) + "\n")
        for (i, j), row, weights in zip(ends.tolist(), edges.tolist(), upper.tolist(), strict=True):
            numbers = [repr(number) for number in (*row, *weights)]
            file.write(" ".join(["EDGE_SE2", str(i), str(j), *numbers]) + "\n")


def _parse_vertex(fields: Sequence[str]) -> Pose:
    expect_fields(fields, 5, "VERTEX_SE2")
    return pose(fields[2:5], "the vertex")


def _agree_on_repetition(table: PoseTable, report: DamageReport) -> tuple[PoseTable, bool]:
    """Whether the robot's poses merely repeat the vertices, and the lines that agree on it."""
    gaps = table.robot - table.vertices
    gaps[:, 2] = wrap(gaps[:, 2])
    repeated = is_few(beyond(gaps, REPEATED))
    if not repeated:
        return table, False
    reason = "the robot pose lies {} from the vertex, in other lines on it"
    return leave_out(table, beyond(gaps, SAME_PLACE), gaps, reason, report), True


def _as_pairs(pairs: ArrayLike | None, n_vertices: int, n_edges: int) -> IntArray:
    if pairs is None:
        if n_edges != max(n_vertices - 1, 0):
            raise InvalidPointsError(
                f"`increments` must have one row fewer than `poses`, got {n_edges} and "
                f"{n_vertices}; other edges need their `pairs`"
            )
        return np.column_stack([np.arange(n_edges), np.arange(1, n_edges + 1)])
    ends = np.asarray(pairs)
    if ends.shape != (n_edges, 2) or ends.dtype.kind not in "iu":
        raise InvalidPointsError(
            f"`pairs` must be integers of shape ({n_edges}, 2), one row per increment, "
            f"got {ends.dtype} of shape {ends.shape}"
        )
    if n_edges and (ends.min() < 0 or ends.max() >= n_vertices):
        raise InvalidPointsError(
            f"`pairs` must name vertices 0 to {n_vertices - 1}, got {ends.min()} to {ends.max()}"
        )
    return ends.astype(np.intp)


def _upper_triangles(information: ArrayLike | None, n_edges: int) -> FloatArray:
    matrices = np.eye(3) if information is None else as_floats(information, "information")
    if matrices.shape not in {(3, 3), (n_edges, 3, 3)} or not np.isfinite(matrices).all():
        raise InvalidPointsError(
            f"`information` must be finite, of shape (3, 3) or ({n_edges}, 3, 3), "
            f"got shape {matrices.shape}"
        )
    row, column = np.triu_indices(3)
    upper: FloatArray = np.broadcast_to(matrices, (n_edges, 3, 3))[:, row, column]
    return upper
