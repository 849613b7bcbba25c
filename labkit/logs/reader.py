"""A format of logs: how it is recognised, which options it can use, and how it is read.

One file holds one format, as a `Reader`; `labkit.logs.read_log.READERS` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from labkit.logs.columns import Column, is_list, read_header, split_row
from labkit.logs.lines import DamageReport, is_number, read_lines
from labkit.logs.log import Content
from labkit.logs.options import LogOptions
from labkit.logs.scanner import Scanner
from labkit.logs.stored import StoredScan
from labkit.scan import Scan
from labkit.support.arrays import FloatArray
from labkit.support.errors import LabkitError, LogError

HEAD_LINES = 1000  # lines that tell the format
FIRST_BYTES = 16  # of a file, that tell a binary format
ROWS_OF_HEAD = 50  # rows of a table that tell what it holds, and whether they end in a comma
FOREIGN = {  # beginnings of files that others write, and the way out
    "header:": "is it printed by `rostopic echo`? labkit reads its tables (`-p`), and bags",
    "version https://git-lfs": "it stands for a file of Git LFS, which `git lfs pull` fetches",
    "{": "is it JSON? write a scan a line, each an object with `ranges`",
    "[{": "is it JSON? write a scan a line, each an object with `ranges`",
    "[[": "is it a list of lists? write each of them in a row of its own",
    "[": "does a list go on in the next line? write each scan in a row of its own",
}
Row = TypeVar("Row")
Progress = Callable[[Iterable[Any]], Iterable[Any]]


class Sweep(NamedTuple):
    """One sweep of a log."""

    line: int  # in the file, or the number of the message
    scan: StoredScan | Scan  # ranges outside the declared band make no point
    frame: str = ""  # of the scanner, where the file names it


class Table(NamedTuple):
    """The first rows of a table."""

    columns: list[Column]  # none without titles
    begin: int  # number of lines above the rows
    rows: list[list[str]]
    line: int = 0  # of the first of them

    @property
    def has_unknown_titles(self) -> bool:
        """True if titles stand above values; readers of known titles come first."""
        return len(self.columns) > 1 and any(any(map(is_value, row)) for row in self.rows)


def is_value(field: str) -> bool:
    """Recognise a number or a list of them."""
    return is_number(field) or is_list(field)


def holds_values(row: Sequence[str]) -> bool:
    """Recognise a row without words; fields may be empty."""
    return all(is_value(field) for field in row if field)


class Source:
    """A file whose format is asked for: its first bytes, its first lines, and all of them.

    What a file holds is looked at when it is first asked for.
    """

    def __init__(
        self, report: DamageReport, options: LogOptions, progress: Progress = iter
    ) -> None:
        self.report = report
        self.options = options
        self.progress = progress
        self.path = Path(report.path)
        self.scanner = Scanner(options, report)

    @cached_property
    def first_bytes(self) -> bytes:
        """The first bytes as they stand in the file; none of a directory, or of no file."""
        try:
            with open(self.path, "rb") as file:
                return file.read(FIRST_BYTES)
        except (OSError, ValueError):  # no file, or no name of one: the reader of lines says so
            return b""

    @cached_property
    def _lines(self) -> Iterator[tuple[int, str]]:
        return iter(self.progress(read_lines(self.report)))

    @cached_property
    def _numbered_head(self) -> list[tuple[int, str]]:
        return list(islice(self._lines, HEAD_LINES))

    @cached_property
    def head(self) -> list[str]:
        """The first lines, unpacked."""
        return [text for _, text in self._numbered_head]

    @cached_property
    def words(self) -> set[str]:
        """The first words of the first lines."""
        return {word for text in self.head for word in text[:16].split(maxsplit=1)[:1]}

    @cached_property
    def first_line(self) -> str:
        """The first line that is not blank."""
        return next((line.strip() for line in self.head if line.strip()), "")

    @cached_property
    def foreign(self) -> str:
        """The beginning of a file that is no table, or none."""
        line = self.first_line
        found = next((beginning for beginning in FOREIGN if line.startswith(beginning)), "")
        return "" if found and holds_values(split_row(line)) else found

    @cached_property
    def table(self) -> Table:
        """The first lines as rows of a table."""
        if self.foreign:
            return Table([], 0, [])
        columns, begin = read_header(self.head)
        rows = ((line, split_row(text)) for line, text in self._numbered_head[begin:])
        first = list(islice((row for row in rows if row[1]), ROWS_OF_HEAD))
        return Table(columns, begin, [row for _, row in first], first[0][0] if first else 0)

    def lines(self, begin: int = 0) -> Iterator[tuple[int, str]]:
        """All lines from an index of the head on, with their numbers; once."""
        return chain(self._numbered_head[begin:], self._lines)

    def parse(
        self, parse_row: Callable[[int, Any], Row | None], rows: Iterable[tuple[int, Any]]
    ) -> Iterator[Row]:
        """All that a function makes of numbered rows; damage that it raises goes into the report.

        A row of which it makes nothing is passed over.
        """
        for number, row in rows:
            try:
                parsed = parse_row(number, row)
            except LogError:  # of the file as a whole
                raise
            except LabkitError as damage:
                self.report.skip(number, damage)
            else:
                if parsed is not None:
                    yield parsed

    def part(self, rows: Iterable[Row]) -> list[Row]:
        """The scans, or what holds them, of the part that is asked for; no more is read."""
        return list(islice(rows, *self.options.part))

    def sweeps(self, sweeps: Iterable[Sweep]) -> list[Sweep]:
        """The part's sweeps of one scanner: that of the caller's frame, or of the first sweep."""
        return self.part(self._of_one_frame(sweeps))

    def _of_one_frame(self, sweeps: Iterable[Sweep]) -> Iterator[Sweep]:
        chosen = self.options.frame
        for sweep in sweeps:
            chosen = sweep.frame if chosen is None else chosen
            if sweep.frame == chosen:
                yield sweep
            else:
                self.report.count(
                    f"of the frame {sweep.frame!r} are left out: those of {chosen!r} are read; "
                    f"`frame` (`--frame`) chooses"
                )


@dataclass(eq=False, kw_only=True)
class Reading:
    """Sweeps, poses and contents that a reader found in a file.

    Attributes
    ----------
    sweeps : list of Sweep
        Of the part that was asked for.
    odometry, reference : ndarray, shape (K, 3), or None
        Poses of the scanner at the sweeps, where the format tells them so.
    track : ndarray, shape (M, 4), or None
        The robot's wheel odometry on its own clock: rows (t [s], x [m], y [m], θ [rad]).
    offset : ndarray, shape (3,), or None
        The scanner's place on the robot, where the format tells it.
    clock_is_named : bool
        Whether the file names the unit of its stamps.
    contents : list of Content
        The parts of the file, and what they are read as.
    """

    sweeps: list[Sweep] = field(default_factory=list)
    odometry: FloatArray | None = None
    reference: FloatArray | None = None
    track: FloatArray | None = None
    offset: FloatArray | None = None
    clock_is_named: bool = False
    contents: list[Content] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Reader:
    """One format.

    Attributes
    ----------
    name : str
        As in `Log.format`.
    files : str
        Phrase for the format's files, in a message that lists all formats.
    recognises : function of a Source
        True if the file is of this format, where no reader before this one recognised it.
    uses : tuple of str
        Options of `LogOptions` that not every format can use, and this one can.
    read : function of a Source
        Reads the file; damage goes into the source's report, and nothing raises but `LogError`.
    read_wheels : function of a Source, or None
        Reads the wheels of a file beside the log: rows (t [s], x [m], y [m], θ [rad]). Without
        it, a file is read as a table of poses.
    """

    name: str
    files: str
    recognises: Callable[[Source], bool]
    uses: tuple[str, ...] = ()
    read: Callable[[Source], Reading]
    read_wheels: Callable[[Source], FloatArray] | None = None
