"""A class is graded side by side, and each record is stored as it comes.

Whom the machine kept from work comes again in a second round, with one box a processor.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import replace

from labkit.grading.box.inside.reading import replace_surrogates
from labkit.grading.box.outside import Wall, open_wall
from labkit.grading.box.watch import MachineError
from labkit.grading.classroom.handins import Submission, read_files
from labkit.grading.classroom.store import Record, fingerprint, write_record
from labkit.grading.grade import grade_submission
from labkit.grading.questions import read_assignment
from labkit.support.errors import LabkitError
from labkit.support.extras import need
from labkit.support.progress import show_progress

PROCESSORS = os.cpu_count() or 1
JOBS = 2 * PROCESSORS + 4  # boxes at a time: some start, wait or take long
PATIENCE = 10.0  # [s] for a cluster to answer
NO_FILES = "nothing was handed in but an empty folder, or one of hidden files"


def grade_class(
    submissions: Iterable[Submission],
    records: dict[str, Record],
    *,
    out: str,
    assignment: str,
    wall: Wall,
    jobs: int = JOBS,
    cluster: str | None = None,
) -> dict[str, str]:
    """Grade by the assignment in a folder, and complete the `records`; why some have none.

    Whatever goes wrong is one submission's own: the others are graded. A `cluster` is named by the
    address of Dask's scheduler.
    """
    failures: dict[str, str] = {}
    waiting = [*submissions]
    for places in (jobs, min(jobs, PROCESSORS)):
        with open_executor(places, cluster) as executor:
            futures = {
                executor.submit(
                    make_record, submission, assignment, wall, records.get(submission.student)
                ): submission
                for submission in waiting
            }
            waiting = []
            for future in show_progress(as_completed(futures), "grading", total=len(futures)):
                student = futures[future].student
                failures.pop(student, None)
                error = future.exception()
                if isinstance(error, MachineError):
                    waiting.append(futures[future])
                if error:
                    failures[student] = f"{type(error).__name__}: {error}"
                elif future.result() != records.get(student):
                    records[student] = future.result()
                    write_record(out, records[student])
        if not waiting:
            break
    return failures


def make_record(
    submission: Submission, folder: str, wall: Wall, record: Record | None = None
) -> Record:
    """Read a submission, and grade it by the assignment in a folder.

    A `record` of it that still holds is kept.
    """
    wall = wall if wall.mode else open_wall(wall.hidden, wall.seconds)  # each machine its own
    assignment = read_assignment(folder)
    files, unread = read_files(submission.files)
    if not submission.files:
        unread = (NO_FILES,)
    current = fingerprint(files, assignment, wall)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = record.late if record else 0.0
    if record and record.fingerprint == current:
        return replace(record, late=late)
    verdict, program = grade_submission(files, wall, assignment, submission.student)
    verdict = replace(verdict, submission=submission.name, unread=unread + verdict.unread)
    return Record(
        verdict=verdict,
        fingerprint=current,
        code=replace_surrogates("\n\n".join(program.scripts.values())),
        written=replace_surrogates(program.written),
        late=late,
        is_public=assignment.public,
    )


@contextlib.contextmanager
def open_executor(jobs: int, cluster: str | None) -> Iterator[Executor]:
    """Threads of this process, each with a box at work; or the workers of a Dask cluster."""
    if cluster is None:
        executor = ThreadPoolExecutor(jobs)
        try:
            yield executor
        finally:
            executor.shutdown(cancel_futures=True)
        return
    distributed = need("distributed", purpose="grading on a cluster", extra="cluster")
    try:
        client = distributed.Client(cluster, timeout=PATIENCE, set_as_default=False)
        client.wait_for_workers(1, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise LabkitError(
            f"no Dask worker answers at {cluster!r} ({error}); start `dask scheduler`, and "
            f"`dask worker {cluster}`"
        ) from None
    with client:
        yield client.get_executor(pure=False)
