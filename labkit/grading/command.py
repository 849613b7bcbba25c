"""The commands ``labkit grade`` and ``labkit autograder``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from labkit.grading.box.inside.limits import SECONDS
from labkit.grading.box.inside.reading import is_source
from labkit.grading.box.outside import Wall, open_wall
from labkit.grading.classroom.gradescope import write_autograder
from labkit.grading.classroom.handins import LAYOUTS, find_submissions
from labkit.grading.classroom.marks import find_student, read_adjustments, read_roster
from labkit.grading.classroom.pages import templates
from labkit.grading.classroom.platforms import GRADEBOOKS
from labkit.grading.classroom.results import SHOWN, Results, some, written_files
from labkit.grading.classroom.rounds import JOBS, grade_class
from labkit.grading.classroom.store import VERDICTS, read_records
from labkit.grading.questions import (
    Assignment,
    cases_beside,
    read_assignment,
    refuse_outdated,
)
from labkit.support.arrays import check_count, check_range
from labkit.support.errors import LabkitError

PUBLIC = """\
these hidden cases ship with labkit, so anyone can compute them. Create your own with
`python -m labkit.course.authoring --secret FILE`, and grade with --secret FILE"""
DESCRIPTION = """\
Grade notebooks (.ipynb) and scripts (.py). SUBMISSIONS is a folder or zip archive: a bulk
download of Canvas, Moodle, Gradescope or nbgrader, or a file or folder for each student, which
has the student's name. Or it is one such file.

Students' code runs in isolation: no network, no other submission, no reference, limits on
time and memory. Each verdict is stored in OUT/verdicts as it comes: run the same command
again after an interruption, or after new submissions, and it goes on. OUT/reading.html shows
the code beside the marks, and takes points and comments. What you change by hand stands in
OUT/adjustments.csv, your students in OUT/roster.csv."""
AUTOGRADER = """\
Write the zip archive to upload as the autograder of a Gradescope programming assignment. It
holds the hidden cases: keep it from students. Base image: Ubuntu 24.04 or newer."""


def add_grade(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], assignment: Path
) -> None:
    """Add ``grade``, by the assignment in a folder, to the command line."""
    parser = _parser(commands, "grade", "grade submissions in isolation", DESCRIPTION)
    parser.set_defaults(run=grade, assignment=assignment)
    add = parser.add_argument
    add("submissions", metavar="SUBMISSIONS", help="a folder, zip archive, notebook or script")
    add("--layout", choices=LAYOUTS, default="", help="naming scheme of the files (detected)")
    again = "grade this student afresh; may be given several times"
    add("--again", action="append", metavar="STUDENT", default=[], help=again)
    add("--out", metavar="FOLDER", default="grades", help="output folder (%(default)s)")
    for name, platform in GRADEBOOKS.items():
        arguments = platform.arguments
        says = f"{platform.says} to be filled in"
        add(f"--{name}", nargs=len(arguments), metavar=arguments, help=says)
    add("--overwrite", action="store_true", help="replace grades and comments in the gradebook")
    add = parser.add_argument_group("where the code runs").add_argument
    add("--no-isolation", action="store_true", help="NOT SAFE: only for code that you trust")
    add("--seconds", type=float, default=SECONDS, help="of CPU per cell and call (%(default)s)")
    add("--jobs", type=int, metavar="N", default=JOBS, help="how many at a time (%(default)s)")
    add("--cluster", metavar="ADDRESS", help="grade on a running Dask cluster")


def add_autograder(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], assignment: Path
) -> None:
    """Add ``autograder``, by the assignment in a folder, to the command line."""
    parser = _parser(commands, "autograder", "write Gradescope's autograder.zip", AUTOGRADER)
    parser.set_defaults(run=autograder, assignment=assignment)
    parser.add_argument("file", metavar="FILE", nargs="?", default="autograder.zip")


def _parser(
    commands: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    does: str,
    description: str,
) -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = commands.add_parser(
        name, help=does, description=description, formatter_class=formatter
    )
    parser.add_argument("--secret", metavar="FILE", help="the secret of your own hidden cases")
    return parser


def autograder(args: argparse.Namespace) -> int:
    """Write Gradescope's archive."""
    _refuse_same([args.secret], [Path(args.file)], "FILE")
    assignment = _load(args)
    os.umask(0o077)  # what is written is for its owner alone
    write_autograder(args.file, args.assignment)
    sys.stdout.write(f"{args.file}: upload it to Gradescope as autograder of {assignment.title}\n")
    return 0


def grade(args: argparse.Namespace) -> int:
    """Grade what has no verdict yet; status 1 where a submission could not be graded."""
    check_count(args.jobs, "jobs", at_least=1)
    check_range(args.seconds, "seconds", above=0.0, at_most=600.0, unit="s")
    out = Path(args.out)
    named = {name: getattr(args, name) for name in GRADEBOOKS if getattr(args, name)}
    files = [arguments[0] for arguments in named.values()]
    _refuse_same([args.submissions, args.secret, *files], written_files(out), "--out")
    templates()  # or say what they need, before the work
    submissions, lost, remarks = find_submissions(args.submissions, layout=args.layout, out=out)
    for remark in remarks[:SHOWN]:
        _say(remark)
    if lost:
        _say(f"{len(lost)} files with code belong to no student, and are not graded: {some(lost)}")
    assignment = _load(args)
    books = {
        GRADEBOOKS[name].returned: GRADEBOOKS[name].read(*arguments)
        for name, arguments in named.items()
    }
    os.umask(0o077)
    records = read_records(out)
    if assignment.public and not all(record.is_public for record in records.values()):
        raise LabkitError(
            f"{out} holds marks by the cases of a secret: name it, --secret FILE, or choose "
            f"another --out for marks by the cases that anyone can compute"
        )
    people = {student: person for book in books.values() for student, person in book.people.items()}
    names = {student: record.verdict.submission for student, record in records.items()}
    names |= {submission.student: submission.name for submission in submissions}
    roster = read_roster(out, names, {id: person.name for id, person in people.items()})
    names |= roster.names
    for person in args.again:
        student = find_student(person, names, "--again: {} students")
        records.pop(roster.groups.get(student, student), None)
    adjustments = read_adjustments(out, assignment, names, roster)
    late = {student: person.late for student, person in people.items() if person.late is not None}
    late |= {
        group: late[student]
        for student, group in roster.groups.items()
        if student in late and group in roster.teams
    }
    submissions = [
        replace(submission, late=late.get(submission.student, submission.late))
        for submission in submissions
    ]
    paths = [file.path for submission in submissions for file in submission.files]
    closed = (Path(args.assignment, "hidden"), out / VERDICTS, *paths[:1])
    if args.cluster and not args.no_isolation:  # each worker tries its own
        wall = Wall("", tuple(map(os.path.realpath, closed)), args.seconds)
    else:
        wall = open_wall(closed, args.seconds, isolation=not args.no_isolation)

    failures = grade_class(
        submissions,
        records,
        out=args.out,
        assignment=str(args.assignment),
        wall=wall,
        jobs=args.jobs,
        cluster=args.cluster,
    )
    for student, reason in failures.items():
        _say(f"{student} was not graded: {reason}")
    results = Results(
        out=out,
        assignment=assignment,
        roster=roster,
        adjustments=adjustments,
        books=books,
        submissions=submissions,
        overwrite=args.overwrite,
        is_class=not is_source(args.submissions),
    )
    for remark in results.write(records, failures):
        _say(remark)
    students = [submission.student for submission in submissions]
    count = sum(
        id in records and records[id].verdict.is_graded for id in students if id not in failures
    )
    modes = sorted({record.verdict.mode for record in records.values()})
    sys.stdout.write(
        f"Graded {count} of {len(submissions)} submissions (isolation: "
        f"{', '.join(modes) or 'none needed'}). Results are in {out}\n"
    )
    return 1 if failures or lost else 0


def _refuse_same(read: Iterable[str | None], written: Iterable[Path], choice: str) -> None:
    """Refuse to write over a file that is read, under whatever name."""
    outputs = [path for path in written if path.is_file()]
    for source in filter(None, read):
        for path in outputs:
            if os.path.isfile(source) and os.path.samefile(source, path):
                raise LabkitError(
                    f"{source}: is to be read, and the results would be written over it, as "
                    f"{path}; choose another {choice}, or read a copy under another name"
                )


def _load(args: argparse.Namespace) -> Assignment:
    """Load the assignment that the options name; warn where its hidden cases are public."""
    folder = args.assignment
    if args.secret:
        args.assignment = cases_beside(args.secret)
    assignment = read_assignment(args.assignment)
    if args.secret:
        refuse_outdated(assignment, read_assignment(folder, hidden=False), args.secret)
    if assignment.public:
        _say(PUBLIC)
    return assignment


def _say(message: str) -> None:
    sys.stderr.write(f"labkit: {message}\n")
