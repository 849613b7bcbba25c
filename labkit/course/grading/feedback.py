"""What a student is told of a verdict, in words, and as HTML with code and chapters marked."""

from __future__ import annotations

import re
from html import escape

from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict

PAGES = {
    "chapter 1": "notebooks/01_problem_and_se2.html",
    "chapter 2": "notebooks/02_alignment.html",
    "chapter 3": "notebooks/03_correspondences.html",
    "chapter 4": "notebooks/04_icp_loop.html",
    "chapter 5": "notebooks/05_odometry.html",
    "the errata": "book/errata.html",
}
_CHAPTER = re.compile(rf"({'|'.join(PAGES)}), “([^”]+)”")


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


def to_html(text: str, book: str = "") -> str:
    """Text as HTML: a student's own is escaped, whatever stands in it.

    Parameters
    ----------
    text : str
        As a verdict holds it.
    book : str
        Where the book's pages lie; without it no chapter is a link.

    Examples
    --------
    >>> to_html("`x` < 2; see chapter 1, “Rotation”.")
    '<code>x</code> &lt; 2; see chapter 1, “Rotation”.'
    >>> to_html("chapter 1, “Rotation”", "https://x.org")
    '<a href="https://x.org/notebooks/01_problem_and_se2.html#rotation">chapter 1, “Rotation”</a>'
    """
    html = escape(text)
    if book:
        html = _CHAPTER.sub(lambda found: _link(found, book), html)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html)


def _link(found: re.Match[str], book: str) -> str:
    section = re.sub(r"[^a-z0-9]+", "-", found[2].lower()).strip("-")
    page = f"{escape(book).rstrip('/')}/{PAGES[found[1]]}#{section}"
    return f'<a href="{page}">{found[0]}</a>'
