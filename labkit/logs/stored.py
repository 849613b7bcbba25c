"""Scans of a log in little memory: each is made of its ranges when it is asked for.

The points of a scan take twice the memory of its ranges, and a long log is gone through scan by
scan. So a scan lives as long as somebody holds it, and the last few live on for the next match.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from labkit.scan import Scan, is_return
from labkit.support.arrays import BoolArray, FloatArray, read_only

Band = tuple[float, float]
MILLIMETRES = 1000.0  # in a metre
LAST_SCANS = 8  # scans that live on although nobody holds them


@dataclass(frozen=True, eq=False, kw_only=True, slots=True)
class StoredScan:
    """A scan without its points.

    Attributes
    ----------
    packed : ndarray, shape (B,)
        Ranges of all beams as `pack` makes them.
    angles : ndarray, shape (B,)
        Directions of all beams, read-only, which scans of one scanner share.
    stamp, time_increment : float
        Time of the first beam, and from one beam to the next [s].
    band : tuple of two floats
        Ranges between the two make a point [m],
    codes : tuple of bands
        except those within one of these.
    """

    packed: NDArray[Any]
    angles: FloatArray
    stamp: float
    time_increment: float
    band: Band
    codes: tuple[Band, ...] = ()

    @property
    def ranges(self) -> FloatArray:
        """Ranges of all beams [m], as `Scan` keeps them."""
        if self.packed.dtype == np.uint16:
            return read_only(self.packed / MILLIMETRES)
        return read_only(self.packed.astype(np.float64))

    def measured_ranges(self) -> FloatArray:
        """Ranges that make a point, codes included."""
        ranges = self.ranges
        return ranges[is_return(ranges, *self.band)]

    def make(self) -> Scan:
        """The scan with its points."""
        low, high = self.band
        ranges = self.ranges
        scan = Scan.from_ranges(
            ranges,
            self.angles,
            stamp=self.stamp,
            time_increment=self.time_increment,
            range_min=low,
            range_max=high,
        )
        if not self.codes:
            return scan
        is_code = within(ranges[scan.beams], self.codes)
        return scan.select(~is_code) if is_code.any() else scan


def pack(ranges: FloatArray) -> NDArray[Any]:
    """Ranges [m] in the fewest bytes that tell them exactly.

    A text has whole millimetres mostly, and a bag numbers of single precision.
    """
    thousandths = np.rint(MILLIMETRES * ranges)
    with np.errstate(invalid="ignore"):
        counts = thousandths.astype(np.uint16)
    if np.array_equal(counts / MILLIMETRES, ranges):
        return counts
    single = ranges.astype(np.float32)
    return single if np.array_equal(single, ranges, equal_nan=True) else ranges


class MadeScans:
    """The scans that were made and that somebody still holds, and those asked for last."""

    def __init__(self) -> None:
        self._held = WeakValueDictionary[StoredScan, Scan]()
        self._last = deque[Scan](maxlen=LAST_SCANS)

    def scan_of(self, stored: StoredScan) -> Scan:
        """The scan that was made of `stored`, or a new one."""
        scan = self._held.get(stored)
        if scan is None:
            scan = self._held.setdefault(stored, stored.make())
        self._last.append(scan)
        return scan


class StoredScans(Sequence[Scan]):
    """A sequence of scans, each made when it is asked for; its slices share what was made."""

    def __init__(self, stored: Sequence[StoredScan | Scan], made: MadeScans | None = None) -> None:
        self._stored = tuple(stored)
        self._made = MadeScans() if made is None else made

    def __len__(self) -> int:
        return len(self._stored)

    def __repr__(self) -> str:
        return f"<{len(self)} scans>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Unpickled without the scans that were made: they are made anew there."""
        return StoredScans, (self._stored,)

    @property
    def stamps(self) -> FloatArray:
        """Times of the scans [s], shape (K,)."""
        return np.array([stored.stamp for stored in self._stored], dtype=np.float64)

    @overload
    def __getitem__(self, index: int) -> Scan: ...

    @overload
    def __getitem__(self, index: slice) -> StoredScans: ...

    def __getitem__(self, index: int | slice) -> Scan | StoredScans:
        if isinstance(index, slice):
            return StoredScans(self._stored[index], self._made)
        stored = self._stored[index]
        return stored if isinstance(stored, Scan) else self._made.scan_of(stored)


def within(ranges: FloatArray, bands: Sequence[Band]) -> BoolArray:
    """Mask of the ranges that lie in one of the bands."""
    low, high = np.reshape(bands, (-1, 2, 1)).swapaxes(0, 1)
    return np.asarray(((ranges >= low) & (ranges <= high)).any(axis=0))
