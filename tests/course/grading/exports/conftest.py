"""Verdicts to export: a good one, a bad one, and one with hostile texts."""

import pytest

from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict

HOSTILE = '=HYPERLINK("x")\x00\x1b[31m <script>alert(1)</script> ]]> \ud800 é'


def question(name, points, share, reason="", hidden_reason=""):
    cases = (
        CaseVerdict(id="1", hidden=False, credit=0.0 if reason else 1.0, reason=reason),
        CaseVerdict(id="2", hidden=True, credit=share, reason=hidden_reason),
    )
    return QuestionVerdict(
        question=name, title=name.title(), points=points, score=share * points, cases=cases,
        misconception=None, message="" if share == 1.0 else f"About {name}.",
    )  # fmt: skip


def submission(student, *questions, notes=()):
    return SubmissionVerdict(
        student=student, submission=f"{student}.ipynb", mode="landlock", questions=questions,
        score=sum(one.score for one in questions), points=sum(one.points for one in questions),
        notes=notes, seconds=0.1234,
    )  # fmt: skip


@pytest.fixture
def verdicts():
    return [
        submission("4711", question("gate", 2.0, 1.0), question("huber", 3.0, 1.0)),
        submission(
            "815",
            question("gate", 2.0, 0.25, "A wide gate: it returned a list.", "Off by one metre."),
            question("huber", 3.0, 0.0, "Not defined.", "Not defined."),
            notes=("`gate` is defined 2 times",),
        ),
        submission("=cmd|x", question("gate", 2.0, 0.0, HOSTILE, HOSTILE), notes=(HOSTILE,)),
    ]
