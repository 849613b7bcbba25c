"""A plain table: one line a student, one column a question."""

from __future__ import annotations

import os
from collections.abc import Iterable

from labkit.grading.exports.feedback import number
from labkit.grading.exports.gradebook import plain, write_gradebook
from labkit.grading.verdict import SubmissionVerdict


def write_scores(verdicts: Iterable[SubmissionVerdict], out: str | os.PathLike[str]) -> None:
    """Write ``student, submission, score, points, isolation`` and the score of each question."""
    rows: list[list[str]] = []
    questions: dict[str, None] = {}
    scores: list[dict[str, str]] = []
    for verdict in verdicts:
        rows.append(
            [
                plain(verdict.student),
                plain(verdict.submission),
                number(verdict.score),
                number(verdict.points),
                verdict.mode,
            ]
        )
        scores.append({one.question: number(one.score) for one in verdict.questions})
        questions |= dict.fromkeys(scores[-1])
    header = ["student", "submission", "score", "points", "isolation", *questions]
    body = [
        [*row, *(own.get(question, "") for question in questions)]
        for row, own in zip(rows, scores, strict=True)
    ]
    write_gradebook(out, [header, *body])
