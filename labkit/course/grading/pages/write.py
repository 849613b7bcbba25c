"""From verdicts to pages, each written whole or not at all."""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping, Sequence
from typing import Any

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.contract import SourceCell
from labkit.course.grading.feedback import number, to_html
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.pages.statistics import ClassSummary
from labkit.course.grading.similarity import Group, side_by_side
from labkit.extras import need
from labkit.files import atomic_write


def write_student_page(
    verdict: SubmissionVerdict,
    assignment: Assignment,
    out: str | os.PathLike[str],
    *,
    book: str = "",
) -> None:
    """Write the page that a student gets: score, and for each question what to look at.

    Parameters
    ----------
    verdict : SubmissionVerdict
        What is told.
    assignment : Assignment
        What was asked.
    out : path-like
        The page.
    book : str
        Where the book's pages lie; with it, chapters are links.

    Raises
    ------
    LabkitError
        Where it cannot be written, or jinja2 is not installed.
    """
    chapters = {question.id: question.chapter for question in assignment.questions}
    _write("student.html", out, book, verdict=verdict, title=assignment.title, chapters=chapters)


def write_class_page(
    summary: ClassSummary,
    assignment: Assignment,
    out: str | os.PathLike[str],
    *,
    groups: Sequence[Group] = (),
    failures: Mapping[str, str] | None = None,
    pairs: Mapping[tuple[str, str], str] | None = None,
    book: str = "",
) -> None:
    """Write the instructor's page: distribution, questions, mistakes, likenesses, students.

    Parameters
    ----------
    summary : ClassSummary
        All verdicts.
    assignment : Assignment
        What was asked.
    out : path-like
        The page.
    groups : sequence of Group
        Submissions that have much in common.
    failures : mapping of str to str
        Why a student has no verdict.
    pairs : mapping of (str, str) to str
        The page on which two students' work stands side by side.
    book : str
        Where the book's pages lie; with it, chapters are links.

    Raises
    ------
    LabkitError
        Where it cannot be written, or jinja2 is not installed.
    """
    mistakes = [
        (count, question.title, assignment.question(id).misconception(known).says)
        for id, question in summary.questions.items()
        for known, count in question.misconceptions.items()
    ]
    cases = (*assignment.variants[:1], assignment.visible)
    about = {
        (question, case.id): case.about
        for some in cases
        for question, listed in some.items()
        for case in listed
    }
    _write(
        "class.html",
        out,
        book,
        about=about,
        pairs=pairs or {},
        summary=summary,
        names={row.student: row.name for row in summary.rows},
        title=assignment.title,
        mistakes=sorted(mistakes, key=lambda row: (-row[0], row[1:])),
        groups=groups,
        failures=failures or {},
    )


def write_pair_page(
    students: tuple[str, str],
    cells: tuple[Sequence[SourceCell], Sequence[SourceCell]],
    assignment: Assignment,
    out: str | os.PathLike[str],
) -> None:
    """Write the page on which two submissions stand side by side.

    Parameters
    ----------
    students : (str, str)
        Whose they are.
    cells : pair of sequences of SourceCell
        What of each is graded.
    assignment : Assignment
        What was asked.
    out : path-like
        The page.
    """
    sides = side_by_side(*cells, assignment.questions)
    _write("pair.html", out, students=students, sides=sides, title=assignment.title)


def _write(template: str, out: str | os.PathLike[str], book: str = "", **content: Any) -> None:
    text = templates().get_template(template).render(book=book, **content)
    with atomic_write(out) as file:
        file.write(text)


@functools.cache
def templates() -> Any:
    """The templates; what a student wrote is escaped wherever it stands.

    Raises
    ------
    MissingExtraError
        Where jinja2 is not installed.
    """
    need_page = functools.partial(need, purpose="an HTML report", extra="grading")
    jinja2, markup = need_page("jinja2"), need_page("markupsafe").Markup
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("labkit.course.grading.pages"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    environment.filters["prose"] = jinja2.pass_context(
        lambda context, text: markup(to_html(text, context["book"]))
    )
    return environment
