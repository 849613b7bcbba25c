"""Options of a command that reads a log, the reading itself, and what it has to tell."""

from __future__ import annotations

import argparse
import os
import sys

from tqdm import tqdm

from labkit.cli.options import number_or_off
from labkit.logs import Log, LogStream, ReadLimits, read_log, stream_log

SHOWN_DAMAGE = 5  # damaged lines that are named one by one
LONG = 32 << 20  # bytes of a file, read as a stream: in memory it would be ten times that
PACKED = (".gz", ".zip")  # a tenth of what they hold


def add_log_options(parser: argparse.ArgumentParser) -> None:
    """Add what `labkit.logs.read_log` takes."""
    group = parser.add_argument_group("log")
    group.add_argument(
        "--laser-offset",
        nargs=3,
        type=float,
        default=(0.0, 0.0, 0.0),
        metavar=("X", "Y", "THETA"),
        help="the scanner's place on the robot, where the log does not say it [m, m, rad]",
    )
    group.add_argument(
        "--no-return",
        nargs="+",
        type=number_or_off,
        metavar="X",
        help="ranges that mean nothing came back [m], or `off` (default: told by the log)",
    )
    group.add_argument("--topic", help="of the scans, in a bag with several")
    group.add_argument("--odometry-topic", metavar="TOPIC", help="of the odometry, likewise")
    group.add_argument("--strict", action="store_true", help="refuse a log with damaged lines")
    limits = ReadLimits()
    group.add_argument(
        "--max-bytes", type=int, metavar="N", help="refuse a file with more, unpacked"
    )
    group.add_argument(
        "--max-line-bytes",
        type=int,
        default=limits.max_line_bytes,
        metavar="N",
        help="take a longer line for damaged (default %(default)s)",
    )


def open_log(args: argparse.Namespace) -> Log | LogStream:
    """Read the log, a long one as a stream; what is wrong or odd about it goes to stderr."""
    length = os.path.getsize(args.log) if os.path.isfile(args.log) else 0
    stream = length * (10 if args.log.lower().endswith(PACKED) else 1) > LONG
    default = (64 << 30) if stream else ReadLimits().max_bytes
    limits = ReadLimits(
        max_bytes=default if args.max_bytes is None else args.max_bytes,
        max_line_bytes=args.max_line_bytes,
    )
    no_return = args.no_return
    if no_return is not None:
        no_return = [code for code in no_return if code != float("inf")]
    with tqdm(
        desc="reading", unit="B", unit_scale=True, disable=None if stream else True, leave=False
    ) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        log = (stream_log if stream else read_log)(
            args.log,
            strict=args.strict,
            no_return=no_return,
            laser_offset=args.laser_offset,
            topic=args.topic,
            odometry_topic=args.odometry_topic,
            limits=limits,
            progress=progress,
        )
    _tell(log)
    return log


def _tell(log: Log | LogStream) -> None:
    for line in log.skipped[:SHOWN_DAMAGE]:
        print(f"skipped {line}", file=sys.stderr)
    if len(log.skipped) > SHOWN_DAMAGE:
        rest = len(log.skipped) - SHOWN_DAMAGE
        print(f"... and {rest} more damaged lines", file=sys.stderr)
    for remark in log.remarks:
        print(f"note: {remark}", file=sys.stderr)
