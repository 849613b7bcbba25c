"""HTML pages: one for each student, one of the class, and one for reading. They need no network.

The page for reading shows a class's code beside its marks, one hand-in at a time, with fields for
points and comments. Its button saves ``points.csv``, which `marks` reads beside what is decided by
hand.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import re
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from labkit.grading.classroom.marks import BY_PAGE, HEADER, Adjustments, Decision, Roster, rule
from labkit.grading.classroom.store import Record, file_name
from labkit.grading.judge.verdict import SubmissionVerdict, short, to_html
from labkit.grading.questions import Assignment, Question
from labkit.support.extras import need
from labkit.support.files import atomic_write

SCRIPT = Path(__file__).with_name("templates") / "reading.js"


def write_pages(
    out: Path,
    marks: Sequence[SubmissionVerdict],
    assignment: Assignment,
    *,
    failures: Mapping[str, str],
    missing: Mapping[str, str],
) -> None:
    """Write a page for each student, and the instructor's ``index.html``.

    `failures` say why a student has no verdict, `missing` who handed in nothing, with the names
    for a person.
    """
    (out / "students").mkdir(exist_ok=True)
    for mark in marks:
        with atomic_write(out / "students" / f"{file_name(mark.student)}.html") as file:
            file.write(student_page(mark, assignment))
    graded = [mark for mark in marks if mark.is_graded]
    tenths = Counter(min(9, int(10.0 * mark.score / mark.points + 1e-9)) for mark in graded)
    scores = [mark.score for mark in graded] or [0.0]
    questions = [_summary(question, graded, assignment) for question in assignment.questions]
    page = (
        templates()
        .get_template("class.html")
        .render(
            assignment=assignment,
            failures=failures,
            histogram=[tenths[tenth] for tenth in range(10)],
            marks=marks,
            graded=graded,
            mean=statistics.fmean(scores),
            median=statistics.median(scores),
            missing=missing,
            modes=Counter(mark.mode for mark in graded if mark.mode),
            file_name=file_name,
            points=max((mark.points for mark in marks), default=0.0),
            mistakes=sorted(mistake for summary in questions for mistake in summary["mistakes"])[
                ::-1
            ],
            questions=questions,
        )
    )
    with atomic_write(out / "index.html") as file:
        file.write(page)


def student_page(mark: SubmissionVerdict, assignment: Assignment) -> str:
    """The page of a student, or of a group."""
    template = templates().get_template("student.html")
    return str(template.render(verdict=mark, assignment=assignment))


def _summary(
    question: Question, marks: Sequence[SubmissionVerdict], assignment: Assignment
) -> dict[str, Any]:
    """One question over the class: points, shares, and how often each case and mistake came.

    A student who is excused from it does not count.
    """
    verdicts = [
        verdict
        for mark in marks
        for verdict in mark.questions
        if verdict.question == question.id and verdict.points > 0.0
    ]
    full = sum(verdict.passed for verdict in verdicts)
    none = sum(verdict.score <= 0.0 for verdict in verdicts)
    mistakes = Counter(verdict.misconception for verdict in verdicts if verdict.misconception)
    # A relation is its own sentence.
    sentences = {mistake.id: mistake.says for mistake in question.misconceptions}
    attempts = Counter(case.id for verdict in verdicts for case in verdict.cases)
    passes = Counter(case.id for verdict in verdicts for case in verdict.cases if case.passed)
    about = {
        case.id: case.about + (" (hidden)" if case.hidden else "")
        for case in assignment.cases(question.id)
    }
    return {
        "asked": question,
        "counts": (full, len(verdicts) - full - none, none),
        "mean": statistics.fmean([verdict.score / verdict.points for verdict in verdicts] or [0.0]),
        "cases": [(about.get(id, id), passes[id] / count, count) for id, count in attempts.items()],
        "mistakes": [
            (count, question.title, sentences.get(id, id)) for id, count in mistakes.items()
        ],
    }


def write_reading(
    out: Path,
    records: Mapping[str, Record],
    adjustments: Adjustments,
    assignment: Assignment,
    roster: Roster,
) -> None:
    """Write ``reading.html`` with all hand-ins."""
    script = SCRIPT.read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = (
        templates()
        .get_template("reading.html")
        .render(
            assignment=assignment,
            columns=",".join(HEADER),
            digest=digest,
            file=BY_PAGE,
            hand_ins=[
                _hand_in(record, adjustments, assignment, roster)
                for _, record in sorted(records.items())
            ],
            script=script,
        )
    )
    with atomic_write(out / "reading.html") as file:
        file.write(page)


def _hand_in(
    record: Record, adjustments: Adjustments, assignment: Assignment, roster: Roster
) -> dict[str, Any]:
    """A hand-in as the page shows it."""
    verdict = record.verdict
    lines = record.code.splitlines()
    places = {}  # of the last definition of each function, by its name
    for number, line in enumerate(lines):
        if definition := re.match(r"\s*def\s+(\w+)|(\w+)\s*=", line):
            places[definition[1] or definition[2]] = number

    def field(item: str, title: str, maximum: float) -> dict[str, Any]:
        decision = adjustments.get((verdict.student, item), Decision(None))
        return {
            "item": item,
            "title": title,
            "maximum": maximum,
            "decision": decision,
            "is_by_hand": decision != Decision(None) and not decision.is_by_page,
        }

    questions = [
        {
            **field(question.question, question.title, question.points),
            "verdict": question,
            "line": places.get(assignment.question(question.question).function),
        }
        for question in verdict.questions
    ]
    worth = rule(adjustments, "written")
    others = [field("written", "Written answers", worth)] if worth else []
    others += [field("bonus", "Bonus", 0.0), field("all", "The whole assignment", 0.0)]
    people = [roster.names[id] for id in roster.members(verdict.student) if id in roster.names]
    return {
        "student": verdict.student,
        "name": ", ".join(people) or verdict.submission,
        "verdict": verdict,
        "lines": lines,
        "written": record.written,
        "questions": questions,
        "others": others,
    }


@functools.cache
def templates() -> Any:
    """The templates; what a student wrote is escaped wherever it stands."""
    jinja2 = need("jinja2", purpose="an HTML page", extra="grading")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("labkit.grading.classroom"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = short
    environment.filters["prose"] = lambda text: jinja2.utils.markupsafe.Markup(to_html(text))
    return environment
