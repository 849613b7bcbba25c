"""A whole class: some submissions at a time, each in a box of its own."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.box import Wall
from labkit.course.grading.contract import Limits
from labkit.course.grading.files import read_sources
from labkit.course.grading.grade import grade_submission
from labkit.course.grading.handins import Submission
from labkit.course.grading.store import Record, fingerprint
from labkit.errors import LabkitError
from labkit.extras import need

PATIENCE = 10.0  # [s] for a cluster to answer


def grade_one(
    submission: Submission, assignment: str, wall: Wall, limits: Limits, known: Record | None = None
) -> Record:
    """Read a submission, and grade it by the assignment in a folder unless `known` still holds."""
    asked = load_assignment(assignment)
    files, unread = read_sources(submission.files)
    mark = fingerprint(files, asked, limits, wall.mode)
    late = submission.late
    if late is None:  # nobody says: what was said before holds
        late = known.late if known else 0.0
    if known and known.fingerprint == mark:
        return replace(known, late=late)
    verdict = grade_submission(
        files, wall, limits, asked, submission.student, submission=submission.name, unread=unread
    )
    return Record(verdict=verdict, fingerprint=mark, code=code_of(files), late=late)


def code_of(files: Mapping[str, bytes]) -> str:
    """All code of a submission, for tools that look for copies; what cannot be read is left out."""
    found = []
    for name, content in files.items():
        text = content.decode("utf-8-sig", "replace")
        with contextlib.suppress(Exception):  # untrusted
            if ".ipynb" in name.lower():
                cells = [one for one in json.loads(text)["cells"] if one["cell_type"] == "code"]
                text = "\n\n".join("".join(cell["source"]) for cell in cells)
            found.append(text)
    return "\n\n".join(found).encode("utf-8", "replace").decode()


@contextlib.contextmanager
def open_executor(workers: int | None, cluster: str | None) -> Iterator[Executor]:
    """Threads of this process, each with a box at work; or the workers of a Dask cluster.

    Raises
    ------
    LabkitError
        Where Dask is not installed, or no worker is found at the address.
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
        client.wait_for_workers(1, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise LabkitError(
            f"no Dask worker answers at {cluster!r} ({error}); start `dask scheduler`, and "
            f"`dask worker {cluster}`"
        ) from None
    with client:
        yield client.get_executor(pure=False)
