"""The page for reading: a class's code beside its marks, with fields for points and comments.

It is one file, shows one hand-in at a time and needs no network. Its button saves ``points.csv``,
which `labkit.grading.classroom.marks` reads beside what is decided by hand.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from labkit.grading.classroom.marks import BY_PAGE, HEADER, Adjustments, Decision, Roster, rule
from labkit.grading.classroom.pages import templates
from labkit.grading.classroom.store import Record
from labkit.grading.questions import Assignment
from labkit.support.files import atomic_write

SCRIPT = Path(__file__).with_name("templates") / "reading.js"


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
    saved = out / BY_PAGE
    page = (
        templates()
        .get_template("reading.html")
        .render(
            assignment=assignment,
            columns=",".join(HEADER),
            digest=digest,
            draft=hashlib.sha256(saved.read_bytes() if saved.exists() else b"").hexdigest()[:16],
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

    def field(item: str, title: str, maximum: float, machine: float | None) -> dict[str, Any]:
        decision = adjustments.get((verdict.student, item), Decision(None))
        return {
            "item": item,
            "title": title,
            "maximum": maximum,
            "machine": machine,
            "decision": decision,
            "is_by_hand": decision != Decision(None) and not decision.is_by_page,
        }

    questions = [
        {
            **field(question.question, question.title, question.points, question.score),
            "verdict": question,
            "line": places.get(assignment.question(question.question).function),
        }
        for question in verdict.questions
    ]
    worth = rule(adjustments, "written")
    others = [field("written", "Written answers", worth, None)] if worth else []
    others += [field("bonus", "Bonus", 0.0, None), field("all", "The whole assignment", 0.0, None)]
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
