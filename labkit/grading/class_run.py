"""A whole class: workers, one verdict each, and what is done when a worker is lost.

Every worker keeps one sandbox and grades one submission at a time. The verdicts come as
they are ready; which worker graded whom makes no difference to any of them.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, field, replace
from itertools import islice

from labkit.grading.assignment import FOLDER, load_assignment
from labkit.grading.contract import Limits
from labkit.grading.judging.grade import grade_submission
from labkit.grading.judging.verdict import FORMAT, SubmissionVerdict
from labkit.grading.store import VerdictStore
from labkit.grading.submissions import Submission
from labkit.grading.workers import own_sandbox

Files = dict[str, bytes]

RULES = 4  # raise it when the same files would get other points or messages than before
LOST_TWICE = "the process that graded it ended, twice; look at its code before you try --again"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What makes two verdicts on the same files comparable.

    Attributes
    ----------
    mode : str
        The isolation, by the name that `labkit.grading.sandbox.host` gives it.
    limits : Limits
        What a submission may use.
    assignment : str
        The folder of the assignment.
    questions : tuple of str
        The questions to grade; empty for all of them.
    """

    mode: str
    limits: Limits = field(default_factory=Limits)
    assignment: str = str(FOLDER)
    questions: tuple[str, ...] = ()

    @property
    def functions(self) -> list[str]:
        """The names of the functions that the assignment asks for."""
        return [one.function for one in load_assignment(self.assignment).questions]

    @property
    def digest(self) -> str:
        """A digest of the assignment, the isolation, the limits and the grader's own rules."""
        own = f"{RULES} {FORMAT}"
        return f"{load_assignment(self.assignment).digest} {self.mode} {self.limits!r} {own}"


@dataclass(frozen=True, kw_only=True)
class Graded:
    """What came of one submission: a verdict, or why there is none.

    Attributes
    ----------
    student : str
        Whose it is.
    verdict : SubmissionVerdict or None
        None where it could not be graded.
    fingerprint : str
        What the verdict follows from; see `fingerprint`.
    passages : tuple of int
        Marks of the code; see `labkit.grading.extraction.passages`.
    failure : str
        Why there is no verdict: a fault of the grader's, never of the student's.
    """

    student: str
    verdict: SubmissionVerdict | None = None
    fingerprint: str = ""
    passages: tuple[int, ...] = ()
    failure: str = ""


def fingerprint(files: Files, settings: Settings) -> str:
    """A digest of all that a verdict follows from: files, assignment, isolation, limits, rules."""
    digest = hashlib.sha256(settings.digest.encode())
    for name in sorted(files):
        digest.update(json.dumps([name, len(files[name])]).encode())
        digest.update(files[name])
    return digest.hexdigest()[:32]


def merge(old: SubmissionVerdict, new: SubmissionVerdict) -> SubmissionVerdict:
    """The old verdict with the questions of a partial, newer one in their places."""
    fresh = {verdict.question: verdict for verdict in new.questions}
    questions = tuple(fresh.get(verdict.question, verdict) for verdict in old.questions)
    score = round(sum(verdict.score for verdict in questions), 2)
    return replace(new, questions=questions, score=score, points=old.points)


def still_to_grade(
    submissions: Iterable[Submission],
    store: VerdictStore,
    settings: Settings,
    again: Collection[str] = (),
) -> list[Submission]:
    """Those without a stored verdict on the same files, and those that are asked for again."""
    return [
        one
        for one in submissions
        if one.student in again
        or one.student not in store
        or store.fingerprint(one.student)
        != fingerprint(one.read(settings.functions).files, settings)
    ]


def grade_class(
    submissions: Iterable[Submission],
    settings: Settings,
    executors: Iterator[Executor],
    *,
    workers: int,
    by_value: bool = False,
) -> Iterator[Graded]:
    """Grade submissions side by side.

    Parameters
    ----------
    submissions : iterable of Submission
        Taken from it no faster than they are graded.
    settings : Settings
        Isolation, limits and questions.
    executors : iterator of Executor
        Where they run; the next one is asked for when a lost worker broke the one before.
    workers : int
        How many run at a time.
    by_value : bool
        Read the files here and send them along, for workers that do not see them.

    Yields
    ------
    Graded
        In the order in which they end.

    Notes
    -----
    When a worker is lost, every submission under way is a suspect. Each is graded once
    more, alone: the guilty one loses its worker again and is reported, the others get
    their verdicts.
    """
    waiting, suspects = iter(submissions), list[Submission]()
    running: dict[Future[Graded], Submission] = {}
    executor = next(executors)
    while True:
        alone = bool(suspects) and not running
        if alone:
            turn = [suspects.pop()]
        else:
            turn = [] if suspects else list(islice(waiting, 2 * workers - len(running)))
        for one in turn:
            running[_submit(executor, _sent(one, settings) if by_value else one, settings)] = one
        if not running:
            return
        lost = []
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            one = running.pop(future)
            graded = _graded(future, one.student)
            if graded:
                yield graded
            else:
                lost.append(one)
        if lost:
            if alone:
                yield Graded(student=lost.pop().student, failure=LOST_TWICE)
            suspects += [*lost, *running.values()]
            running.clear()
            executor = next(executors)


Sent = tuple[str, str, bool, Files, tuple[str, ...]]
Task = Submission | Sent


def grade(task: Task, settings: Settings) -> Graded:
    """Grade one submission in the sandbox of this process: what a worker does."""
    sent = _sent(task, settings) if isinstance(task, Submission) else task
    student, name, late, files, unread = sent
    assignment = load_assignment(settings.assignment)
    sandbox = own_sandbox(settings.mode, settings.limits)
    start = time.perf_counter()
    found = sandbox.extract(files, {one.id: one.function for one in assignment.questions})
    verdict = grade_submission(
        found.cells,
        sandbox,
        assignment,
        student,
        submission=name,
        notes=found.notes,
        unread=(*unread, *found.unread),
        questions=settings.questions,
    )
    return Graded(
        student=student,
        verdict=replace(verdict, late=float(late), seconds=time.perf_counter() - start),
        fingerprint=fingerprint(files, settings),
        passages=found.passages,
    )


def _sent(one: Submission, settings: Settings) -> Sent:
    return one.student, one.name, one.late, *one.read(settings.functions)


def _submit(executor: Executor, task: Task, settings: Settings) -> Future[Graded]:
    """The future of a verdict, even from a pool that broke since its last answer."""
    try:
        return executor.submit(grade, task, settings)
    except BrokenExecutor as error:
        future: Future[Graded] = Future()
        future.set_exception(error)
        return future


def _graded(future: Future[Graded], student: str) -> Graded | None:
    """What a future brought; None where its worker is gone: of a process pool, or of Dask."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker":
        return None
    return Graded(student=student, failure=f"{type(error).__name__}: {error}")
