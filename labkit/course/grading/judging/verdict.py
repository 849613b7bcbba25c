"""What a grading ends in: one verdict for each case, question and submission.

Plain frozen data that goes to JSON and back without loss, so that a verdict can be stored
as soon as it is known and every report and export reads the same thing. All texts are for
the student: none holds a hidden input, an expected value or a traceback.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from labkit.errors import LabkitError

FORMAT = 2


@dataclass(frozen=True, kw_only=True)
class CaseVerdict:
    """How one call of the student's function went.

    Attributes
    ----------
    id : str
        The case within its question.
    hidden : bool
        Whether the student may not see the case; its `reason` then tells no number of it.
    credit : float
        In [0, 1].
    reason : str
        One or two sentences for the student; empty where all is well.
    misconception : str or None
        The known mistake whose answer this was, by its id.
    """

    id: str
    hidden: bool
    credit: float
    reason: str
    misconception: str | None = None

    @property
    def passed(self) -> bool:
        """Whether the case gave full credit."""
        return self.credit >= 1.0


@dataclass(frozen=True, kw_only=True)
class QuestionVerdict:
    """How one question went.

    Attributes
    ----------
    question, title : str
        Its id, and its name for a person.
    points, score : float
        What it is worth, and what was earned, in [0, points].
    cases : tuple of CaseVerdict
        In the order of the assignment.
    misconception : str or None
        The known mistake that explains all wrong answers, by its id.
    message : str
        What to tell the student about the question as a whole.
    replaced : tuple of str
        Functions of earlier questions that are wrong, and that the right ones stood in for
        when this question was graded once more: the score is the better of the two.
    """

    question: str
    title: str
    points: float
    score: float
    cases: tuple[CaseVerdict, ...]
    misconception: str | None
    message: str
    replaced: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the question gave all its points."""
        return self.score >= self.points

    @property
    def cases_passed(self) -> int:
        """How many cases gave full credit."""
        return sum(case.passed for case in self.cases)


@dataclass(frozen=True, kw_only=True)
class SubmissionVerdict:
    """How one submission went.

    Attributes
    ----------
    student, submission : str
        Who handed it in, and its name for a person.
    mode : str
        The isolation that it ran in, by the sandbox's name of it.
    questions : tuple of QuestionVerdict
        In the order of the assignment.
    score, points : float
        The sums over the questions.
    notes : tuple of str
        What else the student should know: cells that were skipped, how they were read.
    unread : tuple of str
        What of the submission was not read, and why; the instructor is told it, too.
    late : float
        Days; 1 where the platform says so and no more.
    adjustments : tuple of str
        What an instructor changed; see `labkit.course.grading.adjustments`.
    seconds : float
        Wall time of the grading; the only part that differs from run to run.

    Examples
    --------
    >>> import json
    >>> verdict = SubmissionVerdict(
    ...     student="ada", submission="ada.py", mode="none", questions=(),
    ...     score=0.0, points=0.0, notes=("no answer found",), seconds=0.01)
    >>> text = json.dumps(verdict.fields, default=vars)
    >>> SubmissionVerdict.from_fields(json.loads(text)) == verdict
    True
    """

    student: str
    submission: str
    mode: str
    questions: tuple[QuestionVerdict, ...]
    score: float
    points: float
    notes: tuple[str, ...]
    seconds: float
    unread: tuple[str, ...] = ()
    late: float = 0.0
    adjustments: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """All that the student should know of how the submission was read."""
        return self.adjustments + self.unread + self.notes

    @property
    def fields(self) -> dict[str, Any]:
        """What JSON needs of it, in the order of the attributes; below by ``default=vars``."""
        return {"format": FORMAT, **vars(self)}

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> SubmissionVerdict:
        """Build it from `fields` as they came back from JSON.

        Raises
        ------
        LabkitError
            For what is no verdict, or one of another version.
        """
        try:
            version = fields["format"]
            if version == FORMAT:
                own = {name: value for name, value in fields.items() if name != "format"}
                questions = tuple(map(_question, own["questions"]))
                texts = {name: tuple(own[name]) for name in ("notes", "unread", "adjustments")}
                return cls(**own | texts | {"questions": questions})
        except (TypeError, KeyError, AttributeError) as error:
            raise _no_verdict(error, fields) from None
        raise LabkitError(
            f"the verdict has format {version!r}, this labkit reads {FORMAT}; "
            f"grade the submission again"
        )


def _no_verdict(error: Exception, what: object) -> LabkitError:
    return LabkitError(
        f"this is no stored verdict ({error}): {str(what)[:60]!r}; grade the submission again"
    )


def _question(fields: dict[str, Any]) -> QuestionVerdict:
    cases = tuple(CaseVerdict(**case) for case in fields.pop("cases"))
    return QuestionVerdict(cases=cases, **fields | {"replaced": tuple(fields["replaced"])})
