"""A log: the scans of one run, and their poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from labkit.arrays import FloatArray
from labkit.errors import InvalidPointsError
from labkit.scan import Scan


@dataclass(frozen=True, kw_only=True)
class SkippedLine:
    """A line of a log that could not be used: where it stands and what is wrong with it.

    Attributes
    ----------
    file : str
        The file as the caller named it.
    line : int
        Its line number from 1; in a ROS bag, the number of the message.
    reason : str
        What was found and what was expected.
    """

    file: str
    line: int
    reason: str

    def __str__(self) -> str:
        """``FILE:LINE: reason``, the form in which editors jump to the place."""
        return f"{self.file}:{self.line}: {self.reason}"


class ScanStream:
    """Scans that are read from their file whenever they are gone through, never all at once.

    Parameters
    ----------
    count : int
        How many there are.
    read : callable
        Opens the file and yields them in the order of the file.
    """

    def __init__(self, count: int, read: Callable[[], Iterator[Scan]]) -> None:
        self._count = count
        self._read = read

    def __len__(self) -> int:
        """How many scans there are."""
        return self._count

    def __iter__(self) -> Iterator[Scan]:
        """Read the file again, from its beginning."""
        return self._read()


@dataclass(frozen=True, eq=False, kw_only=True)
class LogStream:
    """A log whose scans stay in the file: the poses and times of all, the scans one by one.

    Attributes
    ----------
    scans : ScanStream, length K
        What the scanner saw, each in its own frame; each loop over them reads the file anew.
    stamps : ndarray, shape (K,)
        The times of the scans [s]; NaN where the file has none.
    odometry, reference, name, format, skipped, remarks
        As in `Log`.
    """

    scans: ScanStream
    stamps: FloatArray
    odometry: FloatArray | None = None
    reference: FloatArray | None = None
    name: str
    format: str
    skipped: tuple[SkippedLine, ...] = ()
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        """How many scans the log has."""
        return len(self.scans)

    def head(self, count: int) -> LogStream:
        """The first scans, and the poses and times that belong to them."""
        scans = self.scans
        return replace(
            self,
            scans=ScanStream(min(count, len(scans)), lambda: islice(scans, count)),
            stamps=self.stamps[:count],
            odometry=None if self.odometry is None else self.odometry[:count],
            reference=None if self.reference is None else self.reference[:count],
        )

    def load(self) -> Log:
        """Read all scans into memory."""
        return Log(
            scans=tuple(self.scans),
            odometry=self.odometry,
            reference=self.reference,
            name=self.name,
            format=self.format,
            skipped=self.skipped,
            remarks=self.remarks,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Log:
    """K scans in the order of the file, and the poses of the scanner at each of them.

    Attributes
    ----------
    scans : tuple of Scan, length K
        What the scanner saw, each in its own frame.
    odometry : ndarray, shape (K, 3), or None
        The scanner's pose by raw wheel odometry, rows (x [m], y [m], θ [rad]) with θ in
        (−π, π]; None where the file has none.
    reference : ndarray, shape (K, 3), or None
        The scanner's pose by somebody's better estimate (an optimised pose graph, a
        corrected log), rows as above; None where the file has none.
    name : str
        The run's name: the file's, without its suffixes.
    format : str
        ``"carmen"``, ``"g2o"``, ``"ros"`` or ``"points"``.
    skipped : tuple of SkippedLine
        The damaged lines that were left out.
    remarks : tuple of str
        What is odd but no damage: codes taken for "no return", stamps that run backwards,
        an odometry that falls silent, places beyond 100 km, numbers that look like millimetres.

    Raises
    ------
    InvalidPointsError
        If `odometry` or `reference` does not have one row for each scan.
    """

    scans: tuple[Scan, ...]
    odometry: FloatArray | None = None
    reference: FloatArray | None = None
    name: str
    format: str
    skipped: tuple[SkippedLine, ...] = ()
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("odometry", "reference"):
            poses = getattr(self, field)
            if poses is not None and np.shape(poses) != (len(self.scans), 3):
                raise InvalidPointsError(
                    f"`{field}` must have shape ({len(self.scans)}, 3), one pose per scan, "
                    f"got {np.shape(poses)}"
                )

    def __len__(self) -> int:
        """How many scans the log has."""
        return len(self.scans)

    def head(self, count: int) -> Log:
        """The first scans, and the poses that belong to them."""
        return replace(
            self,
            scans=self.scans[:count],
            odometry=None if self.odometry is None else self.odometry[:count],
            reference=None if self.reference is None else self.reference[:count],
        )

    @property
    def stamps(self) -> FloatArray:
        """The times of the scans [s], shape (K,); NaN where the file has none."""
        return np.array([scan.stamp for scan in self.scans], dtype=np.float64)
