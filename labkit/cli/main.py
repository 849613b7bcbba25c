"""Parsing, dispatch, and the messages for what goes wrong."""

from __future__ import annotations

import argparse
import io
import os
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

import labkit
from labkit.cli import demo, info, odometry
from labkit.course.assignment import FOLDER
from labkit.grading.command import add_autograder, add_grade
from labkit.support.errors import InvalidParameterError, LabkitError

BAD_INPUT, USAGE = 1, 2

EPILOG = """\
`labkit COMMAND --help` explains a command; `labkit demo` is a good one to begin with.
Exit status: 0 done; 1 the input cannot be used; 2 the command line is wrong. Other parameters are
set in Python, as by `labkit.odometry.OdometryParameters`."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # a code page without ² must not end a run
        sys.stdout.reconfigure(errors="replace")
    try:
        status = _run(build_parser().parse_args(arguments))
        sys.stdout.flush()  # here, since Python's exit reports no failure
        return status
    except BrokenPipeError:  # the reader (`| head`) has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at exit
        return 0


def _run(args: argparse.Namespace) -> int:
    """Run the command; a mistake becomes one line on stderr."""
    try:
        return int(args.run(args))
    except LabkitError as error:
        message, status = str(error), BAD_INPUT
        if isinstance(error, InvalidParameterError):
            status = USAGE
            if error.parameter in vars(args):
                message = f"{odometry.flag(error.parameter)} {error.problem}"
        print(f"labkit {args.command}: {message}", file=sys.stderr)
        return status


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the whole command line."""
    parser = argparse.ArgumentParser(
        prog="labkit",
        description=labkit.__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=_versions())
    commands = parser.add_subparsers(
        title="commands", dest="command", required=True, metavar="COMMAND"
    )
    demo.add(commands)
    info.add(commands)
    odometry.add(commands)
    add_grade(commands, FOLDER)
    add_autograder(commands, FOLDER)
    return parser


def _versions() -> str:
    """Versions for a bug report, on one line; no package is imported to learn its own."""
    parts = [f"Python {platform.python_version()}"]
    for package in ("numpy", "scipy", "numba"):
        try:
            parts.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            parts.append(f"without {package}")
    return f"labkit {labkit.__version__} ({', '.join(parts)})"
