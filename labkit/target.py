"""A target scan prepared once and matched against as often as one likes."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, as_floats, by_column
from labkit.errors import InvalidPointsError
from labkit.neighbors import NearestNeighbors
from labkit.normals import estimate_normals
from labkit.scan import Scan, as_scan


class Target:
    """A scan with its search tree and, once a metric asks for them, its normals.

    Parameters
    ----------
    scan : Scan or array_like, shape (M, 2)
        Points in metres. A scan's own beam order makes for better normals.
    normals : array_like, shape (M, 2), optional
        Unit normals of the surface at the points, NaN where there is none; estimated from
        the points by default. Points of several scans bring those that each scan gave.

    Raises
    ------
    InvalidPointsError
        For a target without points, or normals of another shape.
    """

    def __init__(self, scan: Scan | ArrayLike, normals: ArrayLike | None = None) -> None:
        self.scan = as_scan(scan, "target", minimum=1)
        self._given_normals = None if normals is None else _as_normals(normals, len(self.scan))
        self.search = NearestNeighbors(self.scan, method="auto")
        self.points = self.search.target
        self.center = self.search.center
        self.to_center = np.zeros((3, 3))  # from a T, makes one that ends about the centre
        self.to_center[:2, 2] = self.center[:, 0]

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals, shape (M, 2); NaN where a point lies on no line."""
        given = self._given_normals
        return by_column(estimate_normals(self.scan) if given is None else given)

    @cached_property
    def on_line(self) -> BoolArray:
        """Which points lie on a line, shape (M,)."""
        return np.isfinite(self.normals[:, 0])

    @cached_property
    def surface(self) -> FloatArray:
        """Points about the centre [m] and unit normals, (x, y, nx, ny), shape (4, M).

        A missing normal is zero.
        """
        surface = np.zeros((4, len(self.points)))
        surface[:2] = self.search.columns
        np.copyto(surface[2:], self.normals.T, where=self.on_line)
        return surface


def _as_normals(normals: ArrayLike, count: int) -> FloatArray:
    given = as_floats(normals, "normals", hint="give an (M, 2) array of unit vectors")
    if given.shape != (count, 2):
        raise InvalidPointsError(
            f"`normals` must have shape ({count}, 2), one per point, got {given.shape}"
        )
    return given


def as_target(target: Target | Scan | ArrayLike) -> Target:
    """Return `target` if it is prepared already, else prepare it."""
    return target if isinstance(target, Target) else Target(target)
