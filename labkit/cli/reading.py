"""Reading the log of a command line: its options, its messages, and standard input."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
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
    "odometry": {"metavar": "FILE"},
    "scans": {"type": int, "metavar": "N"},
    "start": {"type": int, "metavar": "K"},
    "laser_offset": {"nargs": 3, "type": float, "metavar": ("X", "Y", "THETA")},
    "angles": {"nargs": 2, "type": float, "metavar": ("FIRST", "LAST")},
    "range_min": {"type": float, "metavar": "X"},
    "range_max": {"type": float, "metavar": "X"},
    "range_unit": {"metavar": "UNIT"},
    "angle_unit": {"metavar": "UNIT"},
    "blind_beams": {"nargs": "+", "type": _beams, "metavar": "BEAMS"},
    "mirrored": {"action": argparse.BooleanOptionalAction},
    "time_increment": {"type": float, "metavar": "X"},
    "no_return": {"nargs": "*", "type": float, "metavar": "X"},
    "topic": {},
    "odometry_topic": {"metavar": "TOPIC"},
    "frame": {},
    "strict": {"action": "store_true"},
}
STANDARD_INPUT = "standard input"  # in messages
SHOWN_DAMAGE = 5  # damaged lines that are named one by one


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """Add the log, and an option for each field of `LogOptions`."""
    parser.add_argument("log", metavar="LOG", help="a log file, `-`, or `killian`")
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress, no summary")
    group = parser.add_argument_group("log")
    options = {field.name: field for field in fields(LogOptions)}
    for name, arguments in ARGUMENTS.items():
        field = options[name]
        group.add_argument(
            f"--{name.replace('_', '-')}",
            default=field.default,
            help=field.metadata["help"],
            **arguments,
        )


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
