"""Verdicts as a grader may give them."""

from labkit.grading.judge.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict


def case(id, credit, reason="", *, hidden=True):
    return CaseVerdict(id=id, hidden=hidden, passed=credit == 1.0, reason=reason)


def question(id, points, score, *cases, message="", mistake=None, title=""):
    return QuestionVerdict(
        question=id, title=title or id.title(), points=points, score=score, cases=cases,
        misconception=mistake, message=message,
    )  # fmt: skip


def submission(student, *questions, mode="bubblewrap", name="", **more):
    return SubmissionVerdict(
        student=student, submission=name or student, mode=mode, questions=questions,
        score=sum(one.score for one in questions), points=sum(one.points for one in questions),
        **{"notes": (), "seconds": 0.1, **more},
    )  # fmt: skip
