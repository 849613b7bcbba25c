"""``python -m labkit.course.authoring``: write the assignment and its notebook."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from tqdm import tqdm

from labkit.course.authoring.write import VARIANTS, write_assignment
from labkit.course.grading.assignment import FOLDER
from labkit.course.grading.assignment.files import cases_beside, read_secret
from labkit.course.grading.assignment.questions import Cases
from labkit.errors import LabkitError
from labkit.extras import need
from labkit.files import atomic_write, refuse_unwritable


def main(arguments: Sequence[str] | None = None) -> int:
    """Write what the options name; the exit status is 2 for a mistake of the caller."""
    options = _parser().parse_args(arguments)
    try:
        need("nbformat", purpose="writing the notebook", extra="authoring")
        from labkit.course.authoring.notebook import notebook_text  # noqa: PLC0415

        for path in (options.notebook, options.solutions):
            if path is not None:
                refuse_unwritable(path)
        if options.variants < 1:
            raise LabkitError(f"`--variants` must be at least 1, got {options.variants}")
        folder, secret = options.folder, b""
        if options.secret is not None:
            os.umask(0o077)  # what is written is for its owner alone
            secret = read_secret(options.secret, make=True)
            if folder is None:
                folder = cases_beside(options.secret)
                folder.mkdir(exist_ok=True)
        folder = folder or FOLDER
        if not folder.is_dir():
            raise LabkitError(f"there is no folder {folder}; make it first")
        written = write_assignment(folder, options.variants, _bar, secret=secret)
        for path, solutions in ((options.notebook, False), (options.solutions, True)):
            if path is not None:
                with atomic_write(path) as file:
                    file.write(notebook_text(solutions, stretch=options.stretch))
                written.append(path)
    except LabkitError as error:
        sys.stderr.write(f"labkit.course.authoring: {error}\n")
        return 2
    sys.stdout.write("".join(f"wrote {path}\n" for path in written))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m labkit.course.authoring",
        description="Compute the assignment's cases and answers, and write its notebook.",
    )
    parser.add_argument(
        "--folder",
        type=Path,
        help="where questions.json, visible.json and hidden/ go (default: labkit's own)",
    )
    parser.add_argument(
        "--variants",
        type=int,
        default=VARIANTS,
        help="sets of hidden cases that students are spread over (default: %(default)s)",
    )
    parser.add_argument("--notebook", type=Path, help="write the students' notebook here, too")
    parser.add_argument(
        "--solutions",
        type=Path,
        help="write the instructor's notebook here, too: the source of an nbgrader assignment",
    )
    parser.add_argument(
        "--stretch", action="store_true", help="end both notebooks with the stretch task"
    )
    parser.add_argument(
        "--secret",
        type=Path,
        metavar="FILE",
        help="draw the hidden cases from the secret in FILE, which is made where there is none; "
        "they go to FILE.cases, unless --folder says where",
    )
    return parser


def _bar(variants: Iterable[Cases]) -> Iterable[Cases]:
    bar: Iterable[Cases] = tqdm(variants, desc="variants", disable=None)
    return bar


if __name__ == "__main__":
    sys.exit(main())
