"""``python -m labkit.course.authoring``: write the assignment and its notebook."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from labkit.course.assignment import FOLDER
from labkit.course.authoring.write import HANDED_OUT, write_assignment
from labkit.grading.questions import cases_beside, read_secret
from labkit.support.errors import LabkitError
from labkit.support.files import refuse_unwritable

PARSER = argparse.ArgumentParser(
    prog="python -m labkit.course.authoring",
    description="Compute the assignment's cases and answers, and write its files and its notebook.",
)
PARSER.add_argument(
    "--notebook",
    type=Path,
    help="the students' notebook, whose questions are written anew (default: "
    "notebooks/assignment.ipynb of the checkout)",
)
PARSER.add_argument(
    "--solutions",
    type=Path,
    help="write the instructor's notebook here, too: the source of an nbgrader assignment",
)
PARSER.add_argument(
    "--secret",
    type=Path,
    metavar="FILE",
    help="draw the hidden cases from the secret in FILE, which is made where there is none; "
    "all files go to FILE.cases, and the students' notebook stays as it is",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write what the options name; the exit status is 2 for a mistake of the caller."""
    options = PARSER.parse_args(arguments)
    folder, secret = FOLDER, b""
    if options.notebook is None and options.secret is None and HANDED_OUT.exists():
        options.notebook = HANDED_OUT
    notebooks = {options.notebook: False, options.solutions: True}
    notebooks.pop(None, None)
    try:
        for path in notebooks:
            refuse_unwritable(path)
        if options.secret is not None:
            os.umask(0o077)  # what is written is for its owner alone
            secret, folder = read_secret(options.secret), cases_beside(options.secret)
            folder.mkdir(exist_ok=True)
        written = write_assignment(folder, secret, notebooks)
    except LabkitError as error:
        sys.stderr.write(f"labkit.course.authoring: {error}\n")
        return 2
    sys.stdout.write("".join(f"wrote {path}\n" for path in written))
    return 0


if __name__ == "__main__":
    sys.exit(main())
