"""What a student is told of a verdict, in words, and the pages packed to hand back."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from labkit.files import atomic_write
from labkit.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.grading.submissions.submission import Submission


def number(value: float) -> str:
    """A score as people write it.

    >>> number(3.0), number(2.5), number(1 / 3)
    ('3', '2.5', '0.33')
    """
    return f"{value:.2f}".rstrip("0").rstrip(".")


def score_text(verdict: SubmissionVerdict, maximum: float | None) -> str:
    """The score on a gradebook's scale; as it is where that names no `maximum`."""
    scale = 1.0 if maximum is None or not verdict.points else maximum / verdict.points
    return number(verdict.score * scale)


def question_text(question: QuestionVerdict, *, hidden: bool = True) -> str:
    """The message on a question and the reasons of its cases, one paragraph each.

    Parameters
    ----------
    question : QuestionVerdict
        The verdict.
    hidden : bool
        Whether the reasons of hidden cases are told too; they give no number away.
    """
    reasons = [
        case.reason for case in question.cases if case.reason and (hidden or not case.hidden)
    ]
    passed = f"{question.cases_passed} of {len(question.cases)} cases passed."
    return "\n\n".join(dict.fromkeys(part for part in (question.message, *reasons, passed) if part))


def summary_text(verdict: SubmissionVerdict) -> str:
    """A verdict in a few lines, for a gradebook's comment."""
    lines = [f"{number(verdict.score)} of {number(verdict.points)} points."]
    for question in verdict.questions:
        if not question.passed:
            score = f"{number(question.score)}/{number(question.points)}"
            lines.append(
                f"{question.title} ({score}): {question.message or _first(question.cases)}"
            )
    return "\n".join([*lines, *verdict.remarks])


def _first(cases: tuple[CaseVerdict, ...]) -> str:
    return next((case.reason for case in cases if case.reason), "")


def write_feedback(
    submissions: Iterable[Submission], pages: Mapping[str, Path], out: str | os.PathLike[str]
) -> None:
    """Pack the students' pages under the names by which Canvas and Moodle take files back.

    Parameters
    ----------
    submissions : iterable of Submission
        As they were found; one of no platform has its page under its own name.
    pages : mapping of str to Path
        The page of each student.
    out : path-like
        The zip archive, for Canvas's "Upload submissions" or Moodle's "Upload multiple
        feedback files in a zip".
    """
    with atomic_write(out, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zip:
        for one in submissions:
            if one.student in pages:
                zip.write(pages[one.student], one.feedback_name)
