"""What an instructor wants to know of a class, gathered one verdict at a time."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from labkit.grading.judging.verdict import QuestionVerdict, SubmissionVerdict

BINS = 10


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
    """

    title: str
    points: float
    answered: int = 0
    full: int = 0
    none: int = 0
    shares: float = 0.0
    misconceptions: Counter[str] = field(default_factory=Counter)

    def add(self, verdict: QuestionVerdict) -> None:
        """Take one student's verdict in."""
        self.answered += 1
        self.full += verdict.passed
        self.none += verdict.score <= 0.0
        self.shares += verdict.score / verdict.points if verdict.points else 0.0
        if verdict.misconception:
            self.misconceptions[verdict.misconception] += 1

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


@dataclass(kw_only=True)
class ClassSummary:
    """A whole class.

    Attributes
    ----------
    rows : list of Row
        The students, in the order of adding.
    questions : dict of str to QuestionSummary
        By question, in the order of the assignment.
    """

    rows: list[Row] = field(default_factory=list)
    questions: dict[str, QuestionSummary] = field(default_factory=dict)

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
            )
        )
        for one in verdict.questions:
            known = QuestionSummary(title=one.title, points=one.points)
            self.questions.setdefault(one.question, known).add(one)

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
