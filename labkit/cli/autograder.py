"""``labkit autograder``: the archive that Gradescope grades with."""

from __future__ import annotations

import argparse
import sys

from labkit.cli.grade import PUBLIC
from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.assignment.files import folder_of
from labkit.course.grading.exports.reports import write_autograder

DESCRIPTION = """\
Write the zip archive to upload as the autograder of a Gradescope programming assignment. It
holds the hidden cases: keep it from students. Base image: Ubuntu 24.04 or newer."""


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``autograder`` to the command line."""
    parser = commands.add_parser(
        "autograder",
        help="write Gradescope's autograder.zip",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("out", metavar="FILE", nargs="?", default="autograder.zip")
    parser.add_argument(
        "--assignment", metavar="FOLDER", default=str(FOLDER), help="questions (the lab's own)"
    )
    parser.add_argument(
        "--secret", metavar="FILE", help="hidden cases drawn from the course's secret in FILE"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write it."""
    folder = folder_of(args.secret) if args.secret else args.assignment
    write_autograder(args.out, folder)
    if load_assignment(folder).public:
        print(f"labkit autograder: {PUBLIC}", file=sys.stderr)
    print(f"{args.out}: upload it to Gradescope as the assignment's autograder")
    return 0
