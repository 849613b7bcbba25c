"""Parsing, dispatch, and what a person sees when something is wrong."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Sequence
from typing import Any

from labkit.cli import demo, evaluate, match, odometry, report
from labkit.cli.versions import ShowVersions
from labkit.course.grading.command import add_autograder, add_grade
from labkit.engine import is_available
from labkit.errors import InvalidParameterError, LabkitError

BAD_INPUT, USAGE, INTERRUPTED = 1, 2, 130
MATCHING = ("demo", "odometry", "match")
BY_THE_TEXTBOOK = "numba is not installed, so the textbook matches, slower; pip install numba"

DESCRIPTION = """\
ICP-based motion estimation from 2D LiDAR scans.

  labkit demo                                the lesson's experiment, with its known truth
  labkit odometry killian                    the motion of a real robot over 1.9 km
  labkit match target.csv source.csv         the transform between two scans
  labkit evaluate run.tum --reference r.tum  how good a trajectory is
  labkit report my_report.ipynb              a report as HTML and PDF
  labkit grade submissions/                  verdicts on what a class handed in"""

EPILOG = """\
Exit status: 0 done; 1 the input cannot be used, or the scans cannot be matched; 2 the
command line is wrong. `labkit COMMAND --help` explains each command."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    sys.stdout = sys.stdout or io.StringIO()  # none where it is closed, as by `>&-`
    sys.stderr = sys.stderr or io.StringIO()
    if isinstance(sys.stdout, io.TextIOWrapper):  # a code page without ² must not end a run
        sys.stdout.reconfigure(errors="replace")
    status = 0
    try:
        try:
            status = _run(build_parser().parse_args(arguments))
        finally:
            sys.stdout.flush()  # not at Python's exit, where no failure can be told
    except BrokenPipeError:  # the reader (`| head`) has seen enough
        _drop_output()
    except OSError as error:
        if error.filename is not None:  # of no stream: a defect, which its traceback tells best
            raise
        _drop_output()
        print(
            f"labkit: the output cannot be written: {error.strerror}; send it elsewhere",
            file=sys.stderr,
        )
        return BAD_INPUT
    return status


def _run(args: argparse.Namespace) -> int:
    """Run the command; a mistake is told in one line."""
    if args.command in MATCHING and not is_available():
        print(f"labkit {args.command}: {BY_THE_TEXTBOOK}", file=sys.stderr)
    try:
        status: int = args.run(args)
    except InvalidParameterError as error:
        print(f"labkit {args.command}: {_as_option(error, args)}", file=sys.stderr)
        return USAGE
    except LabkitError as error:
        print(f"labkit {args.command}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(file=sys.stderr)
        print(f"labkit {args.command}: interrupted; no file is left half-written", file=sys.stderr)
        return INTERRUPTED
    return status


def _as_option(error: InvalidParameterError, args: argparse.Namespace) -> str:
    """The message, with an option of the command line under the name that it has there."""
    if error.parameter in vars(args):
        return f"--{error.parameter.replace('_', '-')} {error.problem}"
    return str(error)


def _drop_output() -> None:
    """Send what is still to be written to stdout nowhere, lest it fail once more at the end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class Parser(argparse.ArgumentParser):
    """A parser, like those of its commands, that takes -1e-3 and -1. for numbers.

    Before Python 3.14, argparse takes them for options that it does not know. This is how
    3.14 tells a negative number; no option of ours begins with a digit.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._negative_number_matcher = re.compile(r"-\.?\d")


def build_parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    parser: argparse.ArgumentParser = Parser(
        prog="labkit",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=ShowVersions)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in (
        *(one.add_command for one in (demo, odometry, match, evaluate, report)),
        add_grade,
        add_autograder,
    ):
        add(commands)
    return parser
