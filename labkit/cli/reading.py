"""Reading the log of a command line: its options, its messages, and standard input."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from labkit.logs import Log, LogOptions, read_log
from labkit.support.progress import show_progress


def _beams(text: str) -> range:
    """Numbers of beams, as ``7`` or ``0-29``."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


ARGUMENTS: dict[str, dict[str, Any]] = {  # of the options of `LogOptions`
    "odometry": {"metavar": "FILE", "help": "wheel odometry of the robot: a table (TUM), a bag"},
    "scans": {"type": int, "metavar": "N", "help": "read N scans only (default all)"},
    "start": {"type": int, "metavar": "K", "help": "begin with scan K (default 0)"},
    "laser_offset": {
        "nargs": 3,
        "type": float,
        "metavar": ("X", "Y", "THETA"),
        "help": "the scanner's place on the robot, if the log does not say it [m, m, rad]",
    },
    "angles": {
        "nargs": 2,
        "type": float,
        "metavar": ("FIRST", "LAST"),
        "help": "directions of the first and the last beam, in place of the log's [rad]",
    },
    "range_min": {
        "type": float,
        "metavar": "X",
        "help": "ranges make points above this, in place of the log's [m]",
    },
    "range_max": {
        "type": float,
        "metavar": "X",
        "help": "ranges make points below this, likewise; inf for all [m]",
    },
    "range_unit": {"metavar": "UNIT", "help": "of the file's ranges: m, cm or mm"},
    "angle_unit": {"metavar": "UNIT", "help": "of the file's angles: rad or deg"},
    "blind_beams": {
        "nargs": "+",
        "type": _beams,
        "metavar": "BEAMS",
        "help": "beams that see the robot, from 0 on, as 0-29 180",
    },
    "mirrored": {
        "action": argparse.BooleanOptionalAction,
        "help": "the scanner hangs upside down, or counts its angles clockwise",
    },
    "time_increment": {
        "type": float,
        "metavar": "X",
        "help": "time from one beam to the next, in place of the log's [s]",
    },
    "no_return": {
        "nargs": "*",
        "type": float,
        "metavar": "X",
        "help": "ranges that mean nothing came back, or none (default: known codes) [m]",
    },
    "topic": {"help": "of the scans, in a bag with several"},
    "odometry_topic": {"metavar": "TOPIC", "help": "of the odometry, likewise"},
    "frame": {"help": "of the scanner, where one topic holds several"},
    "strict": {"action": "store_true", "help": "refuse a log with damaged lines"},
}
STANDARD_INPUT = "standard input"  # in messages
SHOWN_DAMAGE = 5  # damaged lines that are named one by one


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """Add the log, and an option for each field of `LogOptions`."""
    parser.add_argument("log", metavar="LOG", help="a log file, `-`, or `killian`")
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress, no summary")
    group = parser.add_argument_group("log")
    defaults = LogOptions()
    for name, arguments in ARGUMENTS.items():
        flag = f"--{name.replace('_', '-')}"
        group.add_argument(flag, default=getattr(defaults, name), **arguments)


def read(args: argparse.Namespace) -> Log:
    """Read the log; damage and oddities go to stderr."""
    given = {name: getattr(args, name) for name in ARGUMENTS}
    if args.blind_beams is not None:
        given["blind_beams"] = [number for beams in args.blind_beams for number in beams]
    options = LogOptions(**given)
    with _copy_standard_input(args.log) as file:
        if args.log == "-":
            options = replace(options, name=STANDARD_INPUT)
        log = read_log(file, options, progress=progress(args, "reading", "line"))
    for line in log.skipped[:SHOWN_DAMAGE]:
        print(f"skipped {line}", file=sys.stderr)
    if (rest := len(log.skipped) - SHOWN_DAMAGE) > 0:
        print(f"... and {rest} more damaged lines", file=sys.stderr)
    for remark in log.remarks:
        print(f"note: {remark}", file=sys.stderr)
    return log


def progress(
    args: argparse.Namespace, doing: str, unit: str
) -> Callable[[Iterable[Any]], Iterable[Any]]:
    """Progress in words, unless the command is to be quiet."""
    return iter if args.quiet else partial(show_progress, doing=doing, unit=unit)


@contextmanager
def _copy_standard_input(log: str) -> Iterator[str]:
    """The log's file: of standard input, ``-``, a copy that lasts for the time of reading."""
    if log != "-":
        yield log
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "stdin"
        with copy.open("wb") as file:
            shutil.copyfileobj(sys.stdin.buffer, file)
        yield str(copy)
