"""Rules for an author's cases: the check tells what the grading will, and time is no matter.

Every known mistake, and every slip in the solution, that loses points fails a visible case: so who
reads "all visible cases pass" has the points. And the plainest loops take no more than a tenth of
the time that a call has.
"""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any

from labkit.course.authoring import plain_python
from labkit.course.authoring.entries import question
from labkit.course.authoring.slips import slips
from labkit.course.exercises.entries import Function, answers, definitions_of, sources_of
from labkit.grading.box.inside.limits import SECONDS
from labkit.grading.judge.compare import is_right
from labkit.grading.questions import Case
from labkit.support.errors import LabkitError

HEADROOM = 10.0
TIMES = 3  # a case is timed; the shortest counts


def refuse_unseen_mistakes(
    entry: question, visible: Sequence[Case], hidden: Sequence[Case]
) -> None:
    """Raise `LabkitError` where a wrong function passes all visible cases, and loses points."""
    for about, function in wrong_functions(entry):
        if passes(entry, function, visible) and not passes(entry, function, hidden):
            raise LabkitError(
                f"{entry.right.__name__}: {about} passes all visible cases and loses points; "
                f"add a visible case that it fails"
            )


def wrong_functions(entry: question) -> Iterator[tuple[str, Function]]:
    """The known mistakes, and the slips in the solution, with words for each."""
    for mistake in entry.known:
        for variant in entry.ways(mistake):
            yield f"the known mistake {mistake.id!r}", variant
    solution = sources_of(entry.right)
    for source in slips(solution):
        with suppress(SyntaxError):
            changed = set(source.splitlines()) - set(solution.splitlines())
            about = f"the slip {' '.join(line.strip() for line in changed)!r}"
            yield about, definitions_of(source, entry.right)[entry.right.__name__]


def passes(entry: question, function: Function, cases: Sequence[Case]) -> bool:
    """True if a function is right in all cases; what it raises is no answer."""
    for case in cases:
        try:
            results = answers([function], copy.deepcopy(case.arguments))
        except Exception:  # a slip can end in any
            return False
        if not results or not is_right(entry.asked_for, case, results[0]):
            return False
    return True


def refuse_slow_cases(entry: question, cases: Sequence[Case]) -> None:
    """Raise `LabkitError` where plain loops need more than a tenth of the time for a call."""
    plain: Function | None = getattr(plain_python, entry.right.__name__, None)
    if plain is None:
        return
    for case in cases:
        seconds = min(duration(plain, case) for _ in range(TIMES))
        if seconds > SECONDS / HEADROOM:
            raise LabkitError(
                f"{entry.right.__name__}, {case.about!r}: plain loops take {seconds:.2f} s of "
                f"{SECONDS:g}; ask for {HEADROOM:g} times less"
            )


def duration(function: Callable[..., Any], case: Case) -> float:
    """Seconds of processor time of a call."""
    arguments = copy.deepcopy(case.arguments)
    start = time.process_time()
    function(*arguments)
    return time.process_time() - start
