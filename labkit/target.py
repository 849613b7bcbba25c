"""A target scan, prepared once and used for many matches."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.neighbors import NearestNeighbors
from labkit.normals import SPARSE, fit_lines, line_noise, line_width
from labkit.parameters import IcpParameters
from labkit.scan import Scan, as_scan, as_selection, scan_of_checked
from labkit.support.arrays import BoolArray, FloatArray, IntArray, as_normals, read_only

NO_NORMALS = read_only(np.empty((0, 2)))


class Target:
    """A scan with its grid and its normals, each computed when it is first needed.

    Parameters
    ----------
    scan : Scan or array_like, shape (M, 2)
        Points in metres. A scan's own beam order gives better normals.
    normals : array_like, shape (M, 2), optional
        Unit normals of the surface at the points, NaN where there is none; estimated from
        the points by default. For points of several scans, pass the normals of each scan.

    Raises
    ------
    InvalidPointsError
        For a target without points, or normals of another shape.
    """

    def __init__(self, scan: Scan | ArrayLike, normals: ArrayLike | None = None) -> None:
        self.scan = as_scan(scan, "target", minimum=1)
        self._given = None
        self._is_part = False
        if normals is not None:
            self._given = read_only(as_normals(normals, "normals", len(self.scan), gaps=True))

    def __reduce__(self) -> tuple[Any, ...]:
        """Prepare the target anew where it is unpickled: its arrays are read-only there, too."""
        if self._is_part:
            noise = self.noise if self.dense else math.nan
            return target_on_lines, (self.points, self._given, self._width, noise)
        return Target, (self.scan, self._given)

    def __repr__(self) -> str:
        return f"<Target of {len(self.scan)} points>"

    @property
    def points(self) -> FloatArray:
        """The points [m] that a match measures to, shape (M, 2); see `labkit.normals`.

        They are the scan's own, but where those are denser than their noise, on lines through them.
        """
        return self._lines[1] if self.dense else self.scan.points

    @property
    def dense(self) -> bool:
        """True if the points were moved, since they are denser than their noise."""
        return self._width[2]

    @property
    def line_width(self) -> float:
        """Radius [m] of the neighbourhoods through which the lines of dense points run."""
        return self._width[0]

    @cached_property
    def search(self) -> NearestNeighbors:
        """The nearest-neighbour search among the points."""
        return NearestNeighbors(self.points) if self.dense else self._measured

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals, shape (M, 2); NaN where a point lies on no line."""
        return self._lines[0] if self._given is None else self._given

    @cached_property
    def noise(self) -> float:
        """Standard deviation [m] of a range, by which the points scatter about their lines.

        NaN where no point lies on a line, or all do exactly.
        """
        return line_noise(self.scan.points, self._lines[1], self._lines[0])

    @cached_property
    def _measured(self) -> NearestNeighbors:
        """The nearest-neighbour search among the points as they were measured."""
        return NearestNeighbors(self.scan)

    @cached_property
    def _width(self) -> tuple[float, float, bool]:
        return line_width(self._measured.grid)

    @cached_property
    def _lines(self) -> tuple[FloatArray, FloatArray]:
        normals, points = fit_lines(self.scan, self._measured.grid, *self._width)
        return read_only(normals), read_only(points)

    def select(self, kept: BoolArray | IntArray) -> Target:
        """The target with some of its points, by a mask (M,) or rows, which stay on their lines."""
        kept = as_selection(kept, len(self.points))
        noise = self.noise if self.dense else math.nan  # sparse points show it themselves
        return target_on_lines(self.points[kept], self.normals[kept], self._width, noise)

    def normals_for(self, parameters: IcpParameters) -> FloatArray:
        """The normals that the loop needs: those of all points, or none under point-to-point."""
        return self.normals if parameters.metric == "point_to_line" else NO_NORMALS


def target_on_lines(
    points: FloatArray,
    normals: FloatArray,
    width: tuple[float, float, bool] = SPARSE,
    noise: float = math.nan,
) -> Target:
    """A target of points (M, 2) that lie on their lines already: however dense, they stay.

    So do those of a map: a line through several scans shows how these lie, not their noise. A part
    of a dense target keeps its `width` and `noise`. The arrays, of targets, are checked by now.
    """
    part = Target(scan_of_checked(read_only(points)))
    part._given = read_only(normals)
    part._is_part = True
    part._width = width
    if part.dense:
        part._lines = part._given, points
        part.noise = noise
    return part


def as_target(target: Target | Scan | ArrayLike) -> Target:
    """Return `target` if it is prepared already, else prepare it."""
    return target if isinstance(target, Target) else Target(target)
