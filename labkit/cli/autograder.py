"""``labkit autograder``: the archive that Gradescope grades with."""

from __future__ import annotations

import argparse

from labkit.grading.assignment import FOLDER
from labkit.grading.exports import write_autograder

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
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write it."""
    write_autograder(args.out, args.assignment)
    print(f"{args.out}: upload it to Gradescope as the assignment's autograder")
    return 0
