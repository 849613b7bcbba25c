"""A class is graded in two rounds, side by side, and each record is stored as it comes.

The first round gives each a share of its processor time. Whoever needs more, and whom the machine
kept from its work, comes again in the second one, when the results of all others are written.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

from labkit.grading.box.inside.reading import replace_surrogates
from labkit.grading.box.outside import Wall, open_wall
from labkit.grading.box.watch import MachineError
from labkit.grading.classroom.handins import Submission, read_files
from labkit.grading.classroom.store import Record, fingerprint, write_record
from labkit.grading.grade import TakesLong, grade_submission
from labkit.grading.questions import read_assignment
from labkit.support.errors import LabkitError
from labkit.support.extras import need
from labkit.support.progress import show_progress

PROCESSORS = os.cpu_count() or 1
JOBS = 2 * PROCESSORS + 4  # boxes at a time: some start, wait or take long
PATIENCE = 10.0  # [s] for a cluster to answer
NO_FILES = "nothing was handed in but an empty folder, or one of hidden files"


@dataclass(frozen=True, eq=False, kw_only=True)
class Rounds:
    """The grading of a class by an assignment, whose records it completes."""

    out: str  # the folder of results
    assignment: str  # its folder
    wall: Wall
    records: dict[str, Record]  # by student
    jobs: int = JOBS
    cluster: str | None = None  # the address of Dask's scheduler

    def grade(
        self, submissions: Sequence[Submission], *, is_last: bool = False
    ) -> tuple[dict[str, str], list[Submission]]:
        """Grade a round: why some have no record, and who comes again in the next one.

        Whatever goes wrong is one submission's own: the others are graded.
        """
        failures: dict[str, str] = {}
        postponed: list[Submission] = []
        jobs = min(self.jobs, PROCESSORS) if is_last else self.jobs
        with open_executor(jobs, self.cluster) as executor:
            futures = {}
            for submission in submissions:
                record = self.records.get(submission.student)
                arguments = (submission, self.assignment, self.wall, record)
                future = executor.submit(make_record, *arguments, in_full=is_last)
                futures[future] = submission
            for future in show_progress(as_completed(futures), "grading", total=len(futures)):
                student = futures[future].student
                error = future.exception()
                if isinstance(error, TakesLong | MachineError) and not is_last:
                    postponed.append(futures[future])
                elif error:
                    failures[student] = f"{type(error).__name__}: {error}"
                elif future.result() != self.records.get(student):
                    self.records[student] = future.result()
                    write_record(self.out, self.records[student])
        return failures, postponed


def make_record(
    submission: Submission,
    folder: str,
    wall: Wall,
    record: Record | None = None,
    *,
    in_full: bool = True,
) -> Record:
    """Read a submission, and grade it by the assignment in a folder.

    A `record` of it that still holds is kept. Raises `TakesLong` as `grade_submission` does.
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
    verdict, program = grade_submission(
        files, wall, assignment, submission.student, in_full=in_full
    )
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
