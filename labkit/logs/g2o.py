"""Pose graphs of g2o with the laser lines of CARMEN, such as the MIT Killian Court run.

::

    VERTEX_SE2 id x y theta            (the pose of the ROBOTLASER1 line below it)

The vertices are the reference. A robot's pose that merely repeats its vertex is no odometry.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from labkit.logs.carmen import (
    PRINTED_PRECISION,
    USES,
    LaserLine,
    Pose,
    expect_one_mount,
    find_mount,
    largest_usual,
    parse_robotlaser,
)
from labkit.logs.lines import DamagedLine, expect_fields, parse_pose
from labkit.logs.log import Content
from labkit.logs.reader import Reader, Reading, Source
from labkit.scan import scanner_poses
from labkit.se2 import matrices_of, relative, to_xytheta

WORDS = frozenset({"VERTEX_SE2", "EDGE_SE2"})
USE = {"VERTEX_SE2": "reference", "ROBOTLASER1": "scans and wheels"}


class Node(NamedTuple):
    """A laser line, and the vertex above it."""

    line: LaserLine
    vertex: Pose


def read(source: Source) -> Reading:
    """Read the laser lines below vertices, as poses of the scanner."""
    words = Counter[str]()
    nodes = source.part(source.parse(Nodes(source, words).parse, source.lines()))
    if not nodes:
        return Reading()
    lines = [node.line for node in nodes]
    mount, _ = find_mount(lines)
    is_told = expect_one_mount(mount, source.options.offset, source.report.file)
    offset = mount if is_told else source.options.offset
    robot = np.array([line.robot for line in lines])
    vertices = np.array([node.vertex for node in nodes])
    gaps = np.abs(to_xytheta(relative(matrices_of(vertices), matrices_of(robot))))
    is_repeated = largest_usual(gaps.max(axis=1)) <= PRINTED_PRECISION
    return Reading(
        sweeps=[line.sweep for line in lines],
        odometry=None if is_repeated else scanner_poses(robot, offset),
        reference=scanner_poses(vertices, offset),
        offset=mount if is_told else None,
        contents=[
            Content(word, f"{count} lines", USE.get(word, "left aside"))
            for word, count in words.items()
        ],
    )


class Nodes:
    """The laser lines of a graph, each with the vertex above it; it counts first words."""

    def __init__(self, source: Source, words: Counter[str]) -> None:
        self.source = source
        self.words = words
        self.vertex: Pose | None = None

    def parse(self, number: int, text: str) -> Node | None:
        """Take the next line."""
        word = text[:16].split(maxsplit=1)[:1]
        self.words.update(word)
        if word == ["VERTEX_SE2"]:
            self.vertex = None
            fields = text.split()
            expect_fields(fields, 5, "VERTEX_SE2")
            self.vertex = parse_pose(fields[2:5], "the vertex")
        if word != ["ROBOTLASER1"]:
            return None
        if self.vertex is None:
            raise DamagedLine("a scan without a vertex, expected a VERTEX_SE2 above it")
        above, self.vertex = self.vertex, None
        return Node(parse_robotlaser(number, text.split(), self.source), above)


def _is_graph(source: Source) -> bool:
    return bool(source.words & WORDS)


READER = Reader(
    name="g2o", files="g2o with ROBOTLASER1", recognises=_is_graph, uses=USES, read=read
)
