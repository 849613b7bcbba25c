"""What an instructor wants to know of a class, gathered one verdict at a time."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict

BINS = 10


@dataclass(kw_only=True)
class CaseSummary:
    """One case over the class.

    Attributes
    ----------
    hidden : bool
        Whether students may not see it.
    asked, passed : int
        How many got it, and got it right.
    scores : float
        The sum of the scores of all, as shares of the points.
    squares : float
        The sum of their squares.
    of_passed : float
        The sum of the scores of those who got it right.
    """

    hidden: bool
    asked: int = 0
    passed: int = 0
    scores: float = 0.0
    squares: float = 0.0
    of_passed: float = 0.0

    def add(self, verdict: CaseVerdict, score: float) -> None:
        """Take one student's verdict in, with the share of all points that the student has."""
        self.asked += 1
        self.passed += verdict.passed
        self.scores += score
        self.squares += score * score
        self.of_passed += score * verdict.passed

    @property
    def share(self) -> float:
        """The share of those asked who got it right."""
        return self.passed / self.asked if self.asked else 0.0

    @property
    def discrimination(self) -> float:
        """The correlation of getting it right with the score; NaN where one of them is constant.

        >>> case = CaseSummary(hidden=True)
        >>> for credit in (0.0, 1.0):
        ...     case.add(CaseVerdict(id="h", hidden=True, credit=credit, reason=""), credit / 2)
        >>> round(case.discrimination, 9)
        1.0
        """
        mean = self.scores / self.asked if self.asked else 0.0
        spread = self.share * (1.0 - self.share)
        spread *= self.squares / self.asked - mean * mean if self.asked else 0.0
        if spread <= 1e-12:
            return math.nan
        return (self.of_passed / self.asked - self.share * mean) / math.sqrt(spread)


@dataclass(kw_only=True)
class QuestionSummary:
    """One question over the class.

    Attributes
    ----------
    title : str
        For a person.
    points : float
        What it is worth.
    answered : int
        Verdicts on it.
    full, none : int
        How many got all its points, and no point at all.
    shares : float
        The sum of score / points.
    misconceptions : Counter of str
        How often each known mistake was recognised.
    cases : dict of str to CaseSummary
        By the case's id.
    """

    title: str
    points: float
    answered: int = 0
    full: int = 0
    none: int = 0
    shares: float = 0.0
    misconceptions: Counter[str] = field(default_factory=Counter)
    cases: dict[str, CaseSummary] = field(default_factory=dict)

    def add(self, verdict: QuestionVerdict, score: float) -> None:
        """Take one student's verdict in, with the share of all points that the student has."""
        for case in verdict.cases:
            self.cases.setdefault(case.id, CaseSummary(hidden=case.hidden)).add(case, score)
        self.answered += 1
        self.full += verdict.passed
        self.none += verdict.score <= 0.0
        self.shares += verdict.score / verdict.points if verdict.points else 0.0
        if verdict.misconception:
            self.misconceptions[verdict.misconception] += 1

    @property
    def some(self) -> int:
        """How many got some of its points."""
        return self.answered - self.full - self.none

    @property
    def mean_share(self) -> float:
        """The mean share of the points that the class earned, in [0, 1]."""
        return self.shares / self.answered if self.answered else 0.0


@dataclass(frozen=True, kw_only=True)
class Row:
    """One student in the class's table."""

    student: str
    name: str
    page: str
    score: float
    points: float
    mode: str
    late: float
    changes: tuple[str, ...]


@dataclass(kw_only=True)
class ClassSummary:
    """A whole class.

    Attributes
    ----------
    rows : list of Row
        The students, in the order of adding.
    questions : dict of str to QuestionSummary
        By question, in the order of the assignment.
    unread : dict of str to tuple of str
        What was not read of a submission, by student.
    """

    rows: list[Row] = field(default_factory=list)
    questions: dict[str, QuestionSummary] = field(default_factory=dict)
    unread: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def add(self, verdict: SubmissionVerdict, page: str) -> None:
        """Take a verdict in; `page` is where the student's own page stands."""
        self.rows.append(
            Row(
                student=verdict.student,
                name=verdict.submission,
                page=page,
                score=verdict.score,
                points=verdict.points,
                mode=verdict.mode,
                late=verdict.late,
                changes=verdict.adjustments,
            )
        )
        if verdict.unread:
            self.unread[verdict.student] = verdict.unread
        score = verdict.score / verdict.points if verdict.points else 0.0
        for one in verdict.questions:
            known = QuestionSummary(title=one.title, points=one.points)
            self.questions.setdefault(one.question, known).add(one, score)

    @property
    def points(self) -> float:
        """What the assignment is worth."""
        return max((row.points for row in self.rows), default=0.0)

    @property
    def scores(self) -> list[float]:
        """All scores."""
        return [row.score for row in self.rows]

    @property
    def median(self) -> float:
        """The middle score; 0 for an empty class."""
        return statistics.median(self.scores) if self.rows else 0.0

    @property
    def mean(self) -> float:
        """The mean score; 0 for an empty class."""
        return statistics.fmean(self.scores) if self.rows else 0.0

    @property
    def histogram(self) -> Sequence[int]:
        """How many scores fall into each tenth of the points; full marks into the last."""
        counts = [0] * BINS
        for row in self.rows:
            share = row.score / row.points if row.points else 0.0
            counts[min(BINS - 1, int(share * BINS + 1e-9))] += 1
        return counts

    @property
    def modes(self) -> Counter[str]:
        """How many were graded in each kind of isolation."""
        return Counter(row.mode for row in self.rows)
