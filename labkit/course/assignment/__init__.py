"""The assignment of this course: its files, and where they are."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

from labkit.grading.box.inside.data import Value, from_json
from labkit.grading.questions import Assignment, read_assignment

FOLDER = Path(__file__).parent
PLAIN_ANSWERS = "plain_answers.json"  # by question, visible case and the words of a stage

PlainAnswers = dict[str, dict[str, dict[str, tuple[Value, ...]]]]


def load_assignment(*, hidden: bool = True) -> Assignment:
    """Read the course's assignment; the notebooks of students have no `hidden` cases.

    >>> load_assignment(hidden=False).question("huber_weights").signature
    '(residuals, delta)'
    """
    return read_assignment(FOLDER, hidden=hidden)


@cache
def load_plain_answers() -> PlainAnswers:
    """The right answers to the visible cases with arguments in their plainest form.

    >>> sorted(load_plain_answers()["icp_step"]["v1"])[0]
    '`T` the identity'
    """
    questions = json.loads((FOLDER / PLAIN_ANSWERS).read_text("utf-8"))
    return {
        question: {
            case: {words: tuple(map(from_json, values)) for words, values in stages.items()}
            for case, stages in cases.items()
        }
        for question, cases in questions.items()
    }
