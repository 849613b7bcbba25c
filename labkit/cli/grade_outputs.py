"""The files that ``labkit grade`` writes from the stored verdicts."""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labkit.arrays import check_range
from labkit.course.grading.adjustments import Adjusted, Adjustments, read_groups, read_overrides
from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.contract import SourceCell
from labkit.course.grading.exports.gradebooks import (
    check_canvas,
    check_moodle,
    fill_canvas,
    fill_moodle,
    write_feedback,
    write_scores,
)
from labkit.course.grading.exports.reports import gradescope_results, write_junit
from labkit.course.grading.pages.statistics import ClassSummary
from labkit.course.grading.pages.write import (
    templates,
    write_class_page,
    write_pair_page,
    write_student_page,
)
from labkit.course.grading.sandbox.host import open_sandbox
from labkit.course.grading.similarity import Group, all_passages, groups_alike
from labkit.course.grading.store import VerdictStore
from labkit.course.grading.submissions import Submission
from labkit.errors import InvalidParameterError
from labkit.files import atomic_write, refuse_unwritable

UNREAD = 5  # submissions of which it is said what was not read
OF_A_GROUP, ALL_PAIRS = 10, 50  # pairs that are shown side by side


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what is written."""
    group = parser.add_argument_group("output")
    group.add_argument(
        "--out",
        metavar="FOLDER",
        default="grades",
        help="verdicts.jsonl, scores.csv, index.html, students/ (%(default)s)",
    )
    group.add_argument("--no-html", action="store_true", help="leave the pages out")
    group.add_argument("--gradescope", metavar="FILE", help="results.json of one submission")
    group.add_argument("--junit", metavar="FILE", help="JUnit XML")
    group.add_argument("--canvas", metavar="GRADEBOOK", help="Canvas's gradebook, to be filled in")
    group.add_argument("--title", metavar="COLUMN", help="the assignment's column in it")
    group.add_argument(
        "--overrides",
        metavar="FILE",
        help="points set by hand: student,question,points,comment",
    )
    group.add_argument(
        "--late-percent", type=float, default=0.0, metavar="P", help="off the score, for a day late"
    )
    group.add_argument(
        "--groups", metavar="FILE", help="one submission counts for a group: student,group"
    )
    group.add_argument(
        "--feedback",
        metavar="ZIP",
        help="the pages, named as Canvas or Moodle takes them",
    )
    group.add_argument(
        "--book", metavar="URL", default="", help="where the book's pages lie: links from feedback"
    )
    group.add_argument("--moodle", metavar="WORKSHEET", help="Moodle's grading worksheet, likewise")


def check_outputs(args: argparse.Namespace, submissions: int, assignment: Assignment) -> None:
    """Refuse what cannot be written or filled in, before the work begins."""
    scores = os.path.join(args.out, "scores.csv") if os.path.isdir(args.out) else None
    for path in (args.gradescope, args.junit, args.feedback, scores):
        if path:
            refuse_unwritable(path)
    if not args.no_html:
        templates()  # or say what they need
    elif args.feedback:
        raise InvalidParameterError("needs the pages; leave --no-html out", parameter="feedback")
    read_adjustments(args, assignment)
    check_range(args.late_percent, "late_percent", at_least=0.0, at_most=100.0)
    if bool(args.canvas) != bool(args.title):
        raise InvalidParameterError(
            f"and --canvas must be given together, got {args.title or args.canvas!r} alone",
            parameter="title",
        )
    if args.canvas:
        check_canvas(args.canvas, args.title)
    if args.moodle:
        check_moodle(args.moodle)
    if args.gradescope and submissions != 1:
        raise InvalidParameterError(
            f"is for one submission, got {submissions}; name one --student", parameter="gradescope"
        )


def read_adjustments(args: argparse.Namespace, assignment: Assignment) -> Adjustments:
    """What the options say of points set by hand, late days and groups."""
    return Adjustments(
        overrides=read_overrides(args.overrides, assignment) if args.overrides else {},
        per_day=args.late_percent,
        groups=read_groups(args.groups) if args.groups else {},
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class Results:
    """What is written: the stored verdicts on some submissions.

    Attributes
    ----------
    store : VerdictStore
    assignment : Assignment
    submissions : sequence of Submission
    failures : mapping of str to str
        Why a student has no verdict.
    mode : str
        The isolation.
    """

    store: VerdictStore
    assignment: Assignment
    submissions: Sequence[Submission]
    failures: Mapping[str, str]
    mode: str


def write_outputs(args: argparse.Namespace, results: Results) -> None:
    """Write tables, pages and gradebooks of the class from what is stored.

    One student's run leaves the others in the tables.
    """
    store = results.store
    found = {one.student for one in results.submissions}
    listed = store.students if args.student else sorted(found & set(store.students))
    adjustments = read_adjustments(args, results.assignment)
    graded = Adjusted(store, listed, adjustments)
    if idle := adjustments.idle(listed):
        print(f"labkit grade: nobody handed in for {', '.join(idle)}", file=sys.stderr)
    out = Path(args.out)
    write_scores(graded, out / "scores.csv")
    if args.junit:
        write_junit(graded, args.junit)
    if args.gradescope:
        with atomic_write(args.gradescope) as file:
            file.write("".join(gradescope_results(one) for one in graded if one.student in found))
    if args.canvas:
        _tell(fill_canvas(graded, args.canvas, args.title, out / "canvas.csv"), args.canvas)
    if args.moodle:
        _tell(fill_moodle(graded, args.moodle, out / "moodle.csv"), args.moodle)
    _tell_unread([(one.student, one.unread[0]) for one in graded if one.unread])
    if not args.no_html:
        _write_pages(args, results, graded)
    if args.feedback:
        pages = {student: out / page_name(student) for student in graded.students}
        write_feedback(results.submissions, pages, args.feedback)


def page_name(student: str) -> str:
    """The file of a student's page: no name leads out of the folder, no two are alike.

    >>> page_name("ada"), page_name("../Ada L")
    ('students/ada.html', 'students/Ada-L-9f6c9bbe.html')
    """
    plain = re.sub(r"[^a-z0-9_-]+", "-", student, flags=re.IGNORECASE).strip("-")[:60]
    if plain != student or student != student.lower():
        plain = f"{plain}-{hashlib.sha256(student.encode()).hexdigest()[:8]}"
    return f"students/{plain}.html"


def _write_pages(args: argparse.Namespace, results: Results, graded: Adjusted) -> None:
    assignment = results.assignment
    out = Path(args.out)
    (out / "students").mkdir(exist_ok=True)
    summary = ClassSummary()
    for verdict in graded:
        page = page_name(verdict.student)
        write_student_page(verdict, assignment, out / page, book=args.book)
        summary.add(verdict, page)
    kept = {*graded.students}
    marks = {
        student: found for student, found in results.store.passages().items() if student in kept
    }
    stubs = all_passages(question.stub for question in assignment.questions)
    groups = groups_alike(marks, stubs)
    pairs = _write_pairs(out, results, groups)
    write_class_page(
        summary,
        assignment,
        out / "index.html",
        groups=groups,
        failures=results.failures,
        pairs=pairs,
        book=args.book,
    )


def _write_pairs(
    out: Path, results: Results, groups: Sequence[Group]
) -> dict[tuple[str, str], str]:
    """Two beside each other, of each group the most alike; the page of each pair."""
    handed_in = {one.student: one for one in results.submissions}
    pairs = [
        (one, other)
        for group in groups
        for one, other, _ in group.pairs[:OF_A_GROUP]
        if {one, other} <= handed_in.keys()
    ][:ALL_PAIRS]
    if not pairs:
        return {}
    (out / "pairs").mkdir(exist_ok=True)
    assignment = results.assignment
    functions = {question.id: question.function for question in assignment.questions}
    pages: dict[tuple[str, str], str] = {}
    cells: dict[str, tuple[SourceCell, ...]] = {}
    with open_sandbox(results.mode) as sandbox:
        for two in pairs:
            for student in {*two} - cells.keys():
                files = handed_in[student].read(functions.values()).files
                cells[student] = sandbox.extract(files, functions).cells
            pages[two] = f"pairs/{len(pages) + 1}.html"
            write_pair_page(two, (cells[two[0]], cells[two[1]]), assignment, out / pages[two])
    return pages


def _tell_unread(unread: Sequence[tuple[str, str]]) -> None:
    """Say of some submissions what was not read, and why."""
    for student, why in unread[:UNREAD]:
        print(f"labkit grade: {student}: {why}", file=sys.stderr)
    if len(unread) > UNREAD:
        print(
            f"labkit grade: of {len(unread) - UNREAD} more not everything was read; "
            f"their pages say what",
            file=sys.stderr,
        )


def _tell(missing: Sequence[str], gradebook: str) -> None:
    if missing:
        shown = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        print(
            f"labkit grade: {gradebook} has no line for {len(missing)} of them: {shown}",
            file=sys.stderr,
        )
