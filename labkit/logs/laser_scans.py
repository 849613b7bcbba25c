"""The scans of a text log: collected in one reading, or read again when they are asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from labkit.logs.laser_lines import LaserLine, Pose, parse_laser_line
from labkit.logs.lines import DamageReport
from labkit.logs.log import ScanStream
from labkit.logs.no_return import Beams, NoReturns, RangeCounts, ScanSettings, settle
from labkit.logs.poses import PoseColumns, PoseTable
from labkit.logs.remarks import tell_places, tell_stamps
from labkit.logs.source import TextSource
from labkit.scan import Scan


class LaserScans:
    """What the first reading of a log keeps of its laser lines.

    That is their poses, times and a count of their ranges; and the ranges themselves where
    `settings` say so.
    """

    def __init__(self, settings: ScanSettings) -> None:
        self._settings = settings
        self._columns = PoseColumns()
        self._counts = RangeCounts()
        self._kept: dict[int, Beams] = {}

    def __len__(self) -> int:
        """How many lines were added."""
        return len(self._columns)

    def add(self, number: int, line: LaserLine, vertex: Pose = (0.0, 0.0, 0.0)) -> None:
        """Take one line."""
        self._columns.add(number, line, vertex)
        self._counts.add(line.beams)
        if self._settings.keep:
            self._kept[number] = line.beams

    def table(self) -> PoseTable:
        """The poses and times of all lines; no times where all of them are zero."""
        return self._columns.table().timed()

    def stream(
        self, source: TextSource, table: PoseTable, report: DamageReport, *, sick: bool
    ) -> ScanStream:
        """The scans of the lines in `table`; what is odd about them is told."""
        no_returns = settle(self._counts, self._settings, report, sick=sick)
        tell_stamps(report, table.stamps, table.numbers)
        tell_places(report, table.robot, table.numbers, "the robot's pose")
        kept = self._kept

        def scans() -> Iterator[Scan]:
            sweeps = (
                map(kept.__getitem__, table.numbers.tolist()) if kept else _sweeps(source, table)
            )
            for beams, stamp in zip(sweeps, table.stamps.tolist(), strict=True):
                yield _scan(beams, stamp, no_returns)

        return ScanStream(len(table.numbers), scans)


def _scan(beams: Beams, stamp: float, no_returns: NoReturns) -> Scan:
    return no_returns.scan(beams if beams.stamp == stamp else replace(beams, stamp=stamp))


def _sweeps(source: TextSource, table: PoseTable) -> Iterator[Beams]:
    """The sweeps of the lines in `table`, read from the file once more."""
    wanted = iter(table.numbers.tolist())
    following = next(wanted, None)
    for number, text in source.lines():
        if number == following:
            yield parse_laser_line(text.split()).beams
            following = next(wanted, None)
            if following is None:
                return
