"""A whole class: one verdict each, some submissions at a time, each in a box of its own."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.box import Wall
from labkit.course.grading.contract import Limits
from labkit.course.grading.grade import grade_submission
from labkit.course.grading.handins import Submission
from labkit.course.grading.inside import reading
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.store import fingerprint
from labkit.errors import LabkitError
from labkit.extras import need

PATIENCE = 10.0  # [s] for a cluster to answer


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a class is graded.

    Attributes
    ----------
    wall : Wall
        What stands around the boxes.
    limits : Limits
        What a submission may use.
    assignment : str
        The folder of the assignment.
    """

    wall: Wall
    limits: Limits
    assignment: str


@dataclass(frozen=True, kw_only=True)
class Graded:
    """What came of one submission.

    Attributes
    ----------
    submission : Submission
    verdict : SubmissionVerdict or None
        None where the stored one still holds, and where it could not be graded.
    fingerprint : str
        What the verdict follows from.
    source : str
        All code that was handed in.
    failure : str
        Why it could not be graded: a fault of the grader's, never of the student's.
    """

    submission: Submission
    verdict: SubmissionVerdict | None = None
    fingerprint: str = ""
    source: str = ""
    failure: str = ""


def grade_one(submission: Submission, settings: Settings, known: str) -> Graded:
    """Read and grade one submission; `known` is what its stored verdict was graded from.

    Whatever goes wrong is this submission's own: it is named, and the others are graded.
    """
    try:
        assignment = load_assignment(settings.assignment)
        files, unread = submission.read()
        mark = fingerprint(files, assignment, settings.limits, settings.wall.mode)
        if mark == known:
            return Graded(submission=submission, fingerprint=mark)
        verdict = grade_submission(
            files,
            settings.wall,
            settings.limits,
            assignment,
            submission.student,
            submission=submission.name,
            unread=unread,
        )
        return Graded(
            submission=submission, verdict=verdict, fingerprint=mark, source=source_of(files)
        )
    except Exception as error:
        return Graded(submission=submission, failure=f"{type(error).__name__}: {error}")


def source_of(files: Mapping[str, bytes]) -> str:
    """All code of a submission, for tools that look for copies; what cannot be read is left out."""
    found = []
    for name, content in files.items():
        with contextlib.suppress(Exception):  # untrusted
            if name.lower().endswith(reading.NOTEBOOK):
                found += [cell.source for cell in reading.notebook_cells(name, content)]
            else:
                found.append(reading.decoded(content))
    return "\n\n".join(found)


def grade_class(
    submissions: Sequence[Submission],
    settings: Settings,
    executor: Executor,
    known: Mapping[str, str],
) -> Iterator[Graded]:
    """Grade submissions side by side; yield what comes of each in the order in which they end.

    Parameters
    ----------
    submissions : sequence of Submission
        What was handed in.
    settings : Settings
        Wall, limits and assignment.
    executor : Executor
        Where they run.
    known : mapping of str to str
        What stored verdicts were graded from, by student: those that still hold are kept.
    """
    futures = [
        executor.submit(grade_one, one, settings, known.get(one.student, "")) for one in submissions
    ]
    whose = dict(zip(futures, submissions, strict=True))
    for future in as_completed(futures):
        error = future.exception()  # a lost worker of a cluster
        yield (
            future.result()
            if error is None
            else Graded(submission=whose[future], failure=f"{type(error).__name__}: {error}")
        )


@contextlib.contextmanager
def open_executor(workers: int | None, cluster: str | None) -> Iterator[Executor]:
    """Threads of this process, each with a box at work; or the workers of a Dask cluster.

    Raises
    ------
    LabkitError
        Where Dask is not installed, the address does not answer, or no worker is there.
    """
    if cluster is None:
        jobs = workers or (os.cpu_count() or 1) + 2  # a box that starts leaves cores idle
        executor = ThreadPoolExecutor(jobs)
        try:
            yield executor
        finally:
            executor.shutdown(cancel_futures=True)
        return
    distributed = need("distributed", purpose="grading on a cluster", extra="cluster")
    try:
        client = distributed.Client(cluster, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise LabkitError(
            f"no Dask scheduler answers at {cluster!r} ({error}); start one with `dask scheduler`"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise LabkitError(
                f"the scheduler at {cluster} has no workers; start some: dask worker {cluster}"
            ) from None
        yield client.get_executor(pure=False)
