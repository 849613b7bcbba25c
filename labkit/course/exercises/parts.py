"""The right part of a wrong answer: one of several results, a range, a row or a column."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from labkit.grading.judge.kinds import Unreadable, read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Answer, Case, Question

LONG = 5  # entries of a vector from which on a range of them says something


def right_part(question: Question, case: Case, outcome: Outcome) -> Iterator[str]:
    """Sentences that tell the wrong entries of a vector, mask, matrix or several results."""
    if outcome.status is not Status.RETURNED:
        return
    try:
        got, expected = (
            read(question.answer, value) for value in (outcome.value, case.expected[0])
        )
    except Unreadable:
        return
    is_long = question.answer is Answer.NUMBERS or expected.size >= LONG
    if got.shape != expected.shape or not is_long:
        return
    is_wrong = ~((np.abs(got - expected) <= case.tolerance) | (got == expected))
    is_wrong &= ~(np.isnan(got) & np.isnan(expected))
    if is_wrong.all() or not is_wrong.any():
        return
    if question.answer is Answer.MATRIX:
        yield from _wrong_lines(is_wrong)
    elif got.ndim > 1:
        return
    elif question.answer is Answer.NUMBERS:
        yield from _right_results(case, is_wrong)
    else:
        yield from _wrong_where(question, case, is_wrong)


def _right_results(case: Case, is_wrong: np.ndarray) -> Iterator[str]:
    if not isinstance(case.expected[0], tuple):
        return
    sizes = [np.asarray(part).size for part in case.expected[0]]
    parts = np.split(is_wrong, np.cumsum(sizes)[:-1])
    right_results = [str(place) for place, part in enumerate(parts, start=1) if not part.any()]
    if right_results:
        yield f"Result {join_words(right_results)} is right, the other is not."


def _wrong_lines(is_wrong: np.ndarray) -> Iterator[str]:
    """The row and the column of a matrix that hold all wrong entries."""
    for k in range(len(is_wrong)):
        in_row, in_column = is_wrong[k].sum(), is_wrong[:, k].sum()
        if in_row == is_wrong.sum():
            yield f"The wrong entries are in `[{k}, :]`; all others are right."
        elif in_column == is_wrong.sum():
            yield f"The wrong entries are in `[:, {k}]`; all others are right."
        elif in_row + in_column - is_wrong[k, k] == is_wrong.sum():
            yield f"The wrong entries are in `[{k}, :]` and `[:, {k}]`; all others are right."


def _wrong_where(question: Question, case: Case, is_wrong: np.ndarray) -> Iterator[str]:
    """The range of an argument in which all wrong entries lie, and no right one."""
    for name, value in zip(names_of(question), case.arguments, strict=False):
        if not isinstance(value, np.ndarray) or value.shape != is_wrong.shape:
            continue
        low, high = value[is_wrong].min(), value[is_wrong].max()
        inside = (value >= low) & (value <= high)
        if (inside == is_wrong).all():
            span = f"from {low:.4g} to {high:.4g}" if high > low else f"at {low:.4g}"
            yield f"The wrong entries are those with `{name}` {span}; all others are right."
            return


def names_of(question: Question) -> list[str]:
    """The names of a question's arguments."""
    arguments = question.signature.strip("()")
    return [name.strip() for name in arguments.split(",")]


def join_words(items: Sequence[str], conjunction: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`."""
    *others, last_item = items
    head = ", ".join(others)
    return f"{head} {conjunction} {last_item}" if head else last_item
