"""The commands ``labkit grade`` and ``labkit autograder``."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from tqdm import tqdm

from labkit.arrays import check_count
from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.assignment.files import folder_of
from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.box import open_wall
from labkit.course.grading.classrun import Graded, Settings, grade_class, open_executor
from labkit.course.grading.contract import Limits
from labkit.course.grading.exports import gradebooks
from labkit.course.grading.exports.gradescope import (
    gradescope_results,
    read_metadata,
    write_autograder,
)
from labkit.course.grading.exports.pages import (
    page_name,
    templates,
    write_class_page,
    write_student_page,
)
from labkit.course.grading.handins import LAYOUTS, Submission, find_submissions, one_submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.marks import (
    make_marks,
    read_adjustments,
    read_roster,
)
from labkit.course.grading.store import VERDICTS, VerdictStore
from labkit.errors import InvalidParameterError, LabkitError
from labkit.files import atomic_write, refuse_unwritable

SHOWN = 5  # names in a message
PUBLIC = """\
the hidden cases are the public ones, which anybody can compute; draw your own with
`python -m labkit.course.authoring --secret FILE`, and grade with --secret FILE"""
DESCRIPTION = """\
Grade notebooks (.ipynb) and scripts (.py). SUBMISSIONS is a folder or zip archive: a bulk
download of Canvas, Moodle, Gradescope or nbgrader, or a file or folder for each student.

Students' code runs in isolation: no network, no other submission, no reference, limits on
time and memory. Each verdict is stored in OUT/verdicts.jsonl as it comes: run the same
command again after an interruption, or after new submissions, and it goes on. What you
change by hand stands in OUT/adjustments.csv, your students in OUT/roster.csv."""
AUTOGRADER = """\
Write the zip archive to upload as the autograder of a Gradescope programming assignment. It
holds the hidden cases: keep it from students. Base image: Ubuntu 24.04 or newer."""


def add_grade(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``grade`` to the command line."""
    parser = commands.add_parser(
        "grade",
        help="grade submissions in isolation",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("submissions", metavar="SUBMISSIONS", help="a folder or zip archive")
    parser.add_argument(
        "--layout", choices=LAYOUTS, default="", help="how the names are built (that which fits)"
    )
    parser.add_argument(
        "--student", metavar="NAME", help="all of SUBMISSIONS is the work of one student, NAME"
    )
    parser.add_argument(
        "--within", metavar="LAB", default="", help="which one of nbgrader's assignments"
    )
    _add_assignment(parser)
    parser.add_argument(
        "--again", nargs="+", default=[], metavar="STUDENT", help="grade these once more"
    )
    where = parser.add_argument_group("where the code runs")
    where.add_argument(
        "--no-isolation", action="store_true", help="NOT SAFE: only for code that you trust"
    )
    where.add_argument(
        "--seconds",
        type=float,
        default=Limits().seconds,
        metavar="S",
        help="of processor time, for a cell and for a question (%(default)s)",
    )
    where.add_argument("--jobs", type=int, metavar="N", help="how many at a time (cores + 2)")
    where.add_argument("--cluster", metavar="ADDRESS", help="grade on a running Dask cluster")
    out = parser.add_argument_group("output")
    out.add_argument("--out", metavar="FOLDER", default="grades", help="(%(default)s)")
    out.add_argument("--no-html", action="store_true", help="leave the pages out")
    out.add_argument("--canvas", metavar="GRADEBOOK", help="Canvas's gradebook, to be filled in")
    out.add_argument("--title", metavar="COLUMN", help="the assignment's column in it")
    out.add_argument("--moodle", metavar="WORKSHEET", help="Moodle's worksheet, likewise")
    out.add_argument(
        "--feedback", metavar="ZIP", help="the pages, named as Canvas or Moodle takes them"
    )
    out.add_argument(
        "--book", metavar="URL", default="", help="where the book's pages lie: links from feedback"
    )
    out.add_argument("--gradescope", metavar="FILE", help="results.json of one submission")
    out.add_argument("--metadata", metavar="FILE", help="Gradescope's, of one submission")
    parser.set_defaults(run=grade)


def add_autograder(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``autograder`` to the command line."""
    parser = commands.add_parser(
        "autograder",
        help="write Gradescope's autograder.zip",
        description=AUTOGRADER,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="FILE", nargs="?", default="autograder.zip")
    _add_assignment(parser)
    parser.add_argument(
        "--adjustments", metavar="FILE", help="adjustments.csv: its rules for lateness hold there"
    )
    parser.set_defaults(run=autograder)


def _add_assignment(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--assignment", metavar="FOLDER", default=str(FOLDER), help="questions (the lab's own)"
    )
    parser.add_argument(
        "--secret", metavar="FILE", help="hidden cases drawn from the course's secret in FILE"
    )


def autograder(args: argparse.Namespace) -> int:
    """Write Gradescope's archive."""
    assignment = _load(args)
    _warn(assignment, "autograder")
    with _for_owner_alone():
        write_autograder(args.file, args.assignment, args.adjustments)
    sys.stdout.write(
        f"{args.file}: upload it to Gradescope as the autograder of {assignment.title!r}\n"
    )
    return 0


def grade(args: argparse.Namespace) -> int:
    """Grade what has no verdict yet; status 1 where a submission could not be graded."""
    if args.jobs is not None:
        check_count(args.jobs, "jobs", at_least=1)
    limits = Limits(seconds=args.seconds)
    assignment = _load(args)
    late: dict[str, float] = {}
    if args.metadata:
        args.student, days = read_metadata(args.metadata)
        late = {args.student: days}
    submissions = _submissions(args)
    _check_outputs(args, len(submissions))
    _warn(assignment, "grade")
    wall = open_wall(_secret_paths(args, submissions), isolation=not args.no_isolation)
    if args.no_isolation:
        _say("no isolation: the code can read and write all that you can")
    settings = Settings(wall=wall, limits=limits, assignment=str(args.assignment))
    with _for_owner_alone(), VerdictStore(args.out) as store:
        names, missing = _people(args, submissions, store)
        read_adjustments(args.out, assignment, names)  # a slip in it ends the run before it begins
        if unknown := set(args.again) - {one.student for one in submissions}:
            raise InvalidParameterError(
                f"must name students ({_some(one.student for one in submissions)}), got "
                f"{_some(sorted(unknown))}",
                parameter="again",
            )
        failures = _grade(args, submissions, settings, store, late)
        marks = make_marks(store, read_adjustments(args.out, assignment, names), assignment)
        given = {mark.student for mark in marks}
        missing = {one: name for one, name in missing.items() if one not in given}
        _write(args, assignment, submissions, marks, failures, missing)
    found = len(submissions)
    sys.stdout.write(
        f"{found - len(failures)} of {found} submissions have a verdict (isolation: {wall.mode}); "
        f"see {args.out}\n"
    )
    for student, why in failures.items():
        _say(f"{student} was not graded: {why}")
    return 1 if failures else 0


def _load(args: argparse.Namespace) -> Assignment:
    if args.secret:
        args.assignment = str(folder_of(args.secret))
    return load_assignment(args.assignment)


def _warn(assignment: Assignment, command: str) -> None:
    if assignment.public:
        sys.stderr.write(f"labkit {command}: {PUBLIC}\n")


def _submissions(args: argparse.Namespace) -> list[Submission]:
    try:
        if args.student:
            return [one_submission(args.submissions, args.student)]
        found, remarks = find_submissions(
            args.submissions, layout=args.layout, within=args.within, left_out=[args.out]
        )
    except OSError as error:  # a folder on the way that may not be entered, a name too long
        raise LabkitError(f"{args.submissions}: cannot be read: {error.strerror}") from None
    for remark in remarks[:SHOWN]:
        _say(remark)
    return found


def _secret_paths(args: argparse.Namespace, submissions: Sequence[Submission]) -> list[str]:
    """Files that no box may read: the walls are tried with them."""
    handed_in = [str(file.path) for one in submissions[:1] for _, file in one.files[:1]]
    stored = [os.path.join(args.out, VERDICTS)]
    return [f"{args.assignment}/hidden", *handed_in, *filter(os.path.exists, stored)]


def _people(
    args: argparse.Namespace, submissions: Sequence[Submission], store: VerdictStore
) -> tuple[dict[str, str], dict[str, str]]:
    """All students and their names for a person, and those of the roster that are not found."""
    names = {student: store[student].submission for student in store.students}
    names |= {one.student: one.name for one in submissions}
    roster = [([student], name) for student, name in read_roster(args.out).items()]
    if args.canvas:
        roster += gradebooks.students_of(args.canvas, canvas=True)
    if args.moodle:
        roster += gradebooks.students_of(args.moodle, canvas=False)
    absent = [(known, name) for known, name in roster if not names.keys() & set(known)]
    names |= {one: name for known, name in absent for one in known}
    return names, {known[0]: name for known, name in absent}


def _grade(
    args: argparse.Namespace,
    submissions: Sequence[Submission],
    settings: Settings,
    store: VerdictStore,
    late: Mapping[str, float],
) -> dict[str, str]:
    """Grade what is to be graded, store each verdict, and say why where there is none."""
    known = {one: store.fingerprint(one) for one in store.students if one not in args.again}
    failures: dict[str, str] = {}
    lateness = dict(late)
    if args.moodle:
        lateness |= gradebooks.lateness_of(args.moodle)
    with open_executor(args.jobs, args.cluster) as executor:
        graded = grade_class(submissions, settings, executor, known)
        for one in tqdm(graded, total=len(submissions), unit="submission", disable=None):
            student = one.submission.student
            days = lateness.get(student, one.submission.late)
            if one.failure:
                failures[student] = one.failure
            elif one.verdict:
                _write_source(Path(args.out), one)
                store.put(one.verdict, one.fingerprint, days)
            store.set_late(student, days)
    for student in set(lateness) & set(store.students):
        store.set_late(student, lateness[student])
    return failures


def _write_source(out: Path, graded: Graded) -> None:
    """Keep the code that was run, for tools that look for copies."""
    name = Path(page_name(graded.submission.student)).stem
    (out / "code").mkdir(exist_ok=True)
    with atomic_write(out / "code" / f"{name}.py") as file:
        file.write(graded.source.encode("utf-8", "replace").decode())


def _check_outputs(args: argparse.Namespace, submissions: int) -> None:
    """Refuse what cannot be written or filled in, before the work begins."""
    scores = os.path.join(args.out, "scores.csv") if os.path.isdir(args.out) else None
    for path in (args.gradescope, args.feedback, scores):
        if path:
            refuse_unwritable(path)
    if not args.no_html:
        templates()  # or say what they need
    elif args.feedback:
        raise InvalidParameterError("needs the pages; leave --no-html out", parameter="feedback")
    if bool(args.canvas) != bool(args.title):
        raise InvalidParameterError(
            f"and --canvas must be given together, got {args.title or args.canvas!r} alone",
            parameter="title",
        )
    if args.canvas:
        gradebooks.check_canvas(args.canvas, args.title)
    if args.moodle:
        gradebooks.check_moodle(args.moodle)
    if args.gradescope and submissions != 1:
        raise InvalidParameterError(
            f"is for one submission, got {submissions}; name one --student", parameter="gradescope"
        )


def _write(  # noqa: PLR0917
    args: argparse.Namespace,
    assignment: Assignment,
    submissions: Sequence[Submission],
    marks: Sequence[SubmissionVerdict],
    failures: Mapping[str, str],
    missing: Mapping[str, str],
) -> None:
    """Write tables, pages and gradebooks."""
    out = Path(args.out)
    gradebooks.write_scores(marks, missing, out / "scores.csv")
    with atomic_write(out / "handed_out.py") as file:
        file.write("\n\n\n".join(question.stub for question in assignment.questions) + "\n")
    if missing:
        _say(f"{len(missing)} of the roster handed in nothing: {_some(missing)}")
    if args.gradescope:
        for one in (mark for mark in marks if mark.student == submissions[0].student):
            with atomic_write(args.gradescope) as file:
                file.write(gradescope_results(one))
    if args.canvas:
        unlisted = gradebooks.fill_canvas(marks, args.canvas, args.title, out / "canvas.csv")
        _tell(unlisted, args.canvas)
    if args.moodle:
        _tell(gradebooks.fill_moodle(marks, args.moodle, out / "moodle.csv"), args.moodle)
    unread = [mark for mark in marks if mark.unread]
    for mark in unread[:SHOWN]:
        _say(f"{mark.student}: {mark.unread[0]}")
    if len(unread) > SHOWN:
        _say(f"of {len(unread) - SHOWN} more not everything was read; their pages say what")
    if args.no_html:
        return
    (out / "students").mkdir(exist_ok=True)
    for mark in marks:
        write_student_page(mark, assignment, out / page_name(mark.student), args.book)
    write_class_page(
        marks,
        assignment,
        out / "index.html",
        failures=failures,
        missing=missing,
        book=args.book,
    )
    if args.feedback:
        pages = {mark.student: out / page_name(mark.student) for mark in marks}
        gradebooks.write_feedback(submissions, pages, args.feedback)


@contextlib.contextmanager
def _for_owner_alone() -> Iterator[None]:
    """Have files that are written meanwhile readable by their owner alone."""
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


def _tell(unlisted: Sequence[str], gradebook: str) -> None:
    if unlisted:
        _say(f"{gradebook} has no line for {len(unlisted)} of them: {_some(unlisted)}")


def _some(names: Iterator[str] | Sequence[str] | Mapping[str, str]) -> str:
    """A few names, and whether there are more."""
    listed = list(names)
    return ", ".join(listed[:SHOWN]) + (", ..." if len(listed) > SHOWN else "")


def _say(text: str) -> None:
    sys.stderr.write(f"labkit grade: {text}\n")
