"""Verdicts: one for each case, question and submission.

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
    """Verdict on one call of the student's function.

    `id` is the case within its question; of a `hidden` one the `reason` tells no number. `credit`
    is in [0, 1]; `reason` holds one or two sentences, or nothing where all is well, and
    `misconception` the id of the known mistake whose answer this was.
    """

    id: str
    hidden: bool
    credit: float
    reason: str
    misconception: str | None = None

    @property
    def passed(self) -> bool:
        """True if the case gave full credit."""
        return self.credit >= 1.0


@dataclass(frozen=True, kw_only=True)
class QuestionVerdict:
    """Verdict on one question.

    `misconception` is the id of the known mistake that explains all wrong answers, `message` what
    to tell the student of the whole. `replaced` names the functions of earlier questions that are
    wrong and that right ones stood in for when this question was graded once more: the score is
    the better of the two.
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
        """True if the question gave all its points."""
        return self.score >= self.points

    @property
    def cases_passed(self) -> int:
        """Number of cases with full credit."""
        return sum(case.passed for case in self.cases)


@dataclass(frozen=True, kw_only=True)
class SubmissionVerdict:
    """Verdict on one submission.

    `mode` is the isolation that it ran in. `notes` say what else the student should know,
    `unread` what was not read and why, `adjustments` what an instructor changed. `late` counts
    days. `seconds` is the only part that differs from run to run.

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
        """Remarks for the student on how the submission was read."""
        return self.adjustments + self.unread + self.notes

    @property
    def fields(self) -> dict[str, Any]:
        """Fields for JSON, in the order of the attributes; those below by ``default=vars``."""
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
            own = {name: _tuple(value) for name, value in fields.items()}
            if own.pop("format") != FORMAT:
                raise KeyError("another format")
            return cls(**own | {"questions": tuple(map(_question, fields["questions"]))})
        except (TypeError, KeyError, AttributeError) as error:
            raise LabkitError(
                f"this is no verdict of this labkit ({error}): {str(fields)[:60]!r}; "
                f"grade the submission again"
            ) from None


def _question(fields: dict[str, Any]) -> QuestionVerdict:
    cases = tuple(CaseVerdict(**case) for case in fields["cases"])
    return QuestionVerdict(**{name: _tuple(fields[name]) for name in fields} | {"cases": cases})


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
