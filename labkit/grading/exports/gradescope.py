"""Gradescope's ``results.json`` [1]_.

Each question is a test with its score; each of its hidden cases is one more, without
points, that only the instructors see.

References
----------
.. [1] Gradescope, "Autograder specifications: output format".
"""

from __future__ import annotations

import json
from typing import Any

from labkit.grading.exports.feedback import question_text
from labkit.grading.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict


def gradescope_results(verdict: SubmissionVerdict) -> str:
    r"""The file that Gradescope reads from ``/autograder/results``.

    Examples
    --------
    >>> verdict = SubmissionVerdict(student="ada", submission="ada.py", mode="user",
    ...     questions=(), score=0.0, points=0.0, notes=("one note",), seconds=0.01)
    >>> results = json.loads(gradescope_results(verdict))
    >>> results["tests"], results["output"]
    ([], 'one note\n\nGraded in isolation: user.')
    """
    tests: list[dict[str, Any]] = []
    for place, question in enumerate(verdict.questions, 1):
        tests.append(_question(f"{place}", question))
        hidden = [case for case in question.cases if case.hidden]
        tests += [_hidden_case(f"{place}.{n}", question, case) for n, case in enumerate(hidden, 1)]
    results = {
        "score": round(verdict.score, 6),
        "execution_time": round(verdict.seconds, 3),
        "output": "\n\n".join([*verdict.notes, f"Graded in isolation: {verdict.mode}."]),
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": tests,
    }
    return json.dumps(results, indent=1, ensure_ascii=True, allow_nan=False)


def _question(number: str, question: QuestionVerdict) -> dict[str, Any]:
    return {
        "number": number,
        "name": question.title,
        "score": round(question.score, 6),
        "max_score": question.points,
        "status": "passed" if question.passed else "failed",
        "output": question_text(question, hidden=False),
        "output_format": "text",
        "visibility": "visible",
        "tags": [question.question],
    }


def _hidden_case(number: str, question: QuestionVerdict, case: CaseVerdict) -> dict[str, Any]:
    return {
        "number": number,
        "name": f"{question.title}, hidden case {case.id}",
        "status": "passed" if case.passed else "failed",
        "output": case.reason,
        "output_format": "text",
        "visibility": "hidden",
        "tags": [question.question],
    }
