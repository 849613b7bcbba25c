"""HTML pages: one for each student, one for the instructor. They need no network."""

from __future__ import annotations

import functools
import hashlib
import os
import re
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.feedback import number, to_html
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.extras import need
from labkit.files import atomic_write

BINS = 10


@dataclass(kw_only=True)
class QuestionSummary:
    """One question over the class.

    Attributes
    ----------
    title : str
        For a person.
    points : float
        What it is worth.
    shares : list of float
        The share of its points that each student earned.
    mistakes : Counter of str
        How often each known mistake was recognised.
    right, asked : Counter of str
        How many got a case right, and how many got it at all, by the case's id.
    """

    title: str
    points: float
    shares: list[float] = field(default_factory=list)
    mistakes: Counter[str] = field(default_factory=Counter)
    right: Counter[str] = field(default_factory=Counter)
    asked: Counter[str] = field(default_factory=Counter)

    def add(self, verdict: QuestionVerdict) -> None:
        """Take one student's verdict in."""
        self.shares.append(verdict.score / verdict.points if verdict.points else 0.0)
        self.mistakes.update([verdict.misconception] if verdict.misconception else [])
        for case in verdict.cases:
            self.asked[case.id] += 1
            self.right[case.id] += case.passed

    @property
    def counts(self) -> dict[str, int]:
        """How many have all its points, some, and none."""
        full = sum(share >= 1.0 for share in self.shares)
        none = sum(share <= 0.0 for share in self.shares)
        return {"full": full, "some": len(self.shares) - full - none, "none": none}

    @property
    def mean(self) -> float:
        """The mean share of its points; 0 where nobody was asked."""
        return statistics.fmean(self.shares) if self.shares else 0.0


def page_name(student: str) -> str:
    """The file of a student's page: no name leads out of the folder, no two are alike.

    >>> page_name("ada"), page_name("../Ada L")
    ('students/ada.html', 'students/Ada-L+9f6c9bbe.html')
    """
    plain = re.sub(r"[^a-z0-9_-]+", "-", student, flags=re.IGNORECASE).strip("-")[:60]
    if plain != student or student != student.lower():
        plain += f"+{hashlib.sha256(student.encode()).hexdigest()[:8]}"  # no plain name has a +
    return f"students/{plain}.html"


def write_student_page(
    verdict: SubmissionVerdict, assignment: Assignment, out: str | os.PathLike[str], book: str = ""
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
    """
    chapters = {question.id: question.chapter for question in assignment.questions}
    _write("student.html", out, book, verdict=verdict, title=assignment.title, chapters=chapters)


def write_class_page(
    marks: Sequence[SubmissionVerdict],
    assignment: Assignment,
    out: Path,
    *,
    failures: Mapping[str, str],
    missing: Mapping[str, str],
    book: str = "",
) -> None:
    """Write the instructor's page: who is missing, distribution, questions, mistakes, students.

    Parameters
    ----------
    marks : sequence of SubmissionVerdict
        All marks.
    assignment : Assignment
        What was asked.
    out : path-like
        The page.
    failures : mapping of str to str
        Why a student has no verdict.
    missing : mapping of str to str
        Who handed in nothing, and their names for a person.
    book : str
        Where the book's pages lie; with it, chapters are links.
    """
    questions = {
        one.id: QuestionSummary(title=one.title, points=one.points) for one in assignment.questions
    }
    histogram = [0] * BINS
    for verdict in marks:
        share = verdict.score / verdict.points if verdict.points else 0.0
        histogram[min(BINS - 1, int(share * BINS + 1e-9))] += 1
        for one in verdict.questions:
            questions[one.question].add(one)
    mistakes = [
        (count, question.title, assignment.question(id).misconception(known).says)
        for id, question in questions.items()
        for known, count in question.mistakes.items()
    ]
    cases = (*assignment.variants[:1], assignment.visible)
    scores = [verdict.score for verdict in marks] or [0.0]
    _write(
        "class.html",
        out,
        book,
        title=assignment.title,
        about={
            (question, case.id): case.about + (" (hidden)" if case.hidden else "")
            for some in cases
            for question, listed in some.items()
            for case in listed
        },
        failures=failures,
        histogram=histogram,
        marks=marks,
        mean=statistics.fmean(scores),
        median=statistics.median(scores),
        missing=missing,
        mistakes=sorted(mistakes, key=lambda row: (-row[0], row[1:])),
        modes=Counter(verdict.mode for verdict in marks if verdict.mode),
        page_name=page_name,
        points=max((verdict.points for verdict in marks), default=0.0),
        questions=questions,
    )


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
        loader=jinja2.PackageLoader("labkit.course.grading.exports"),
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
