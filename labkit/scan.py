"""A 2D LiDAR scan: its points, the beams they came from, and its time (section 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import BoolArray, FloatArray, IntArray, as_floats, as_points, read_only
from labkit.errors import InvalidPointsError

LONGEST_RANGE = 1e5  # [m]: what a scanner says lies farther is its way to say "nothing"


@dataclass(frozen=True, eq=False, kw_only=True)
class Scan:
    """One sweep of a planar scanner, in the scanner's own frame (x ahead, y left).

    Attributes
    ----------
    points : ndarray, shape (N, 2)
        The returns in metres, in beam order where the scan has beams; checked when it is made.
    beams : ndarray of int, shape (N,), or None
        The beam that each point came from; None for points without a scan order.
    ranges, angles : ndarray, shape (B,), or None
        All B beams as measured [m] and their directions [rad], no-returns included.
    stamp : float
        Time in seconds; NaN where the file has none.

    Notes
    -----
    The arrays are the scan's own and read-only: several targets, matches and maps may share
    one scan.
    """

    points: FloatArray
    beams: IntArray | None = None
    ranges: FloatArray | None = None
    angles: FloatArray | None = None
    stamp: float = math.nan

    def __post_init__(self) -> None:
        points = as_points(self.points, "points", minimum=0)
        object.__setattr__(self, "points", read_only(points))
        if self.beams is not None:
            object.__setattr__(self, "beams", read_only(_as_beams(self.beams, len(points))))
        for name in ("ranges", "angles"):
            values = getattr(self, name)
            if values is not None and values.flags.writeable:
                object.__setattr__(self, name, read_only(as_floats(values, name)))

    @classmethod
    def from_ranges(
        cls,
        ranges: ArrayLike,
        angles: ArrayLike,
        *,
        stamp: float = math.nan,
        range_min: float = 0.0,
        range_max: float = math.inf,
    ) -> Scan:
        """Points r·(cos α, sin α) of the beams with ``range_min < r < range_max``.

        A range that is NaN, not strictly inside the band, or beyond 100 km (some drivers
        write the largest number there is) is a no-return, as is one that is masked: it makes
        no point. A scan in which no beam returned is legal and has no points.

        Examples
        --------
        >>> Scan.from_ranges([1.0, np.inf], [0.0, 0.1]).points.tolist()
        [[1.0, 0.0]]
        """
        if np.ma.isMaskedArray(ranges):
            ranges = np.ma.filled(ranges.astype(float), np.nan)
        r = as_floats(ranges, "ranges")
        alpha = as_floats(angles, "angles")
        if r.ndim != 1 or r.shape != alpha.shape:
            raise InvalidPointsError(
                f"`ranges` and `angles` must have one shape (B,), got {r.shape} and {alpha.shape}"
            )
        if not np.isfinite(alpha).all():
            index = int(np.flatnonzero(~np.isfinite(alpha))[0])
            raise InvalidPointsError(f"`angles` must be finite, got {alpha[index]} at beam {index}")
        beams = np.flatnonzero((r > range_min) & (r < min(range_max, LONGEST_RANGE)))
        direction = np.column_stack([np.cos(alpha[beams]), np.sin(alpha[beams])])
        points = r[beams, None] * direction
        return cls(points=points, beams=beams, ranges=r, angles=alpha, stamp=stamp)

    @classmethod
    def from_points(cls, points: ArrayLike, *, stamp: float = math.nan) -> Scan:
        """A scan of bare points, shape (N, 2) [m], in no particular order; it copies them."""
        return cls(points=as_points(points, "points"), stamp=stamp)

    def __len__(self) -> int:
        """How many points the scan has."""
        return len(self.points)

    def select(self, kept: BoolArray | IntArray) -> Scan:
        """The same scan with the points named by a mask or by indices, beams included."""
        beams = None if self.beams is None else self.beams[kept]
        return replace(self, points=self.points[kept], beams=beams)


def _as_beams(beams: IntArray, count: int) -> IntArray:
    checked = np.array(beams)
    if checked.shape != (count,) or not (count == 0 or np.issubdtype(checked.dtype, np.integer)):
        raise InvalidPointsError(
            f"`beams` must be {count} whole numbers, one per point, got shape {checked.shape} "
            f"of {checked.dtype}"
        )
    return checked.astype(np.intp, copy=False)


def as_scan(scan: Scan | ArrayLike, name: str = "points", minimum: int = 0) -> Scan:
    """Return `scan` if it is one, else a scan of its points without an order.

    Messages begin with `name`. A scan must have at least `minimum` points, bare points one.
    """
    if not isinstance(scan, Scan):
        return Scan(points=as_points(scan, name))
    if len(scan) < minimum:
        as_points(scan.points, name, minimum)  # says so
    return scan
