"""A whole class: workers, one verdict each, and what is done when a worker is lost.

Workers are processes of this machine, or those of a Dask cluster. Every worker keeps one
sandbox, open as long as its process lives, and grades one submission at a time. The verdicts
come as they are ready; which worker graded whom makes no difference to any of them.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import islice
from multiprocessing import connection, forkserver, util
from multiprocessing.context import BaseContext
from threading import Thread

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Limits
from labkit.course.grading.judging.grade import grade_submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.sandbox.host import Sandbox, launch, open_sandbox
from labkit.course.grading.store import Settings, fingerprint
from labkit.course.grading.submissions import Submission
from labkit.errors import LabkitError
from labkit.extras import need

PATIENCE = 10.0  # [s] for a cluster to answer
LOST_TWICE = "the process that graded it ended, twice; look at its code before you try --again"


def available_cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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
        Marks of the code; see `labkit.course.grading.extraction.passages`.
    failure : str
        Why there is no verdict: a fault of the grader's, never of the student's.
    """

    student: str
    verdict: SubmissionVerdict | None = None
    fingerprint: str = ""
    passages: tuple[int, ...] = ()
    failure: str = ""


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


Sent = tuple[str, str, bool, dict[str, bytes], tuple[str, ...]]
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


def prepare() -> None:
    """Have Python started and labkit imported where workers will come from, without waiting.

    Raises
    ------
    LabkitError
        Where the folder for temporary files is too far down for a socket in it.
    """
    if sys.platform == "linux":
        forkserver.set_forkserver_preload([__name__])
        try:
            with _for_workers():
                forkserver.ensure_running()
        except OSError as error:
            if error.errno is not None:
                raise
            raise LabkitError(
                f"no worker can be started: {error}, got TMPDIR={tempfile.gettempdir()}; name a "
                f"folder of fewer than 70 letters: TMPDIR=/tmp labkit grade ..."
            ) from None


@contextmanager
def _for_workers() -> Iterator[None]:
    """The environment of processes that are started meanwhile.

    They import nothing from the grader's folder: it often is that of the submissions, and one
    of them may be called ``signal.py``. Linear algebra gets one thread, and no idle ones.
    """
    given = launch.ONE_THREAD | {"PYTHONSAFEPATH": "1"}
    before = {name: os.environ.get(name) for name in given}
    os.environ |= given
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def local_pools(workers: int) -> Iterator[Iterator[Executor]]:
    """Pools of processes on this machine, each made when the one before is broken.

    On leaving, by an interruption too, no worker and no sandbox of one is left behind.
    """
    pools: list[ProcessPoolExecutor] = []
    context = _context()

    def make() -> Iterator[Executor]:
        while True:
            pools.append(ProcessPoolExecutor(workers, context, initializer=_be_a_worker))
            yield pools[-1]
            pools[-1].shutdown(wait=False, cancel_futures=True)

    try:
        with _for_workers():
            yield make()
    except BaseException:
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        for pool in pools:
            pool.shutdown(cancel_futures=True)


def _context() -> BaseContext:
    """How processes are started: on Linux all of them from one that has imported labkit.

    It is none of the grader's own, which holds open files and threads that no worker shall have.
    """
    return multiprocessing.get_context("forkserver" if sys.platform == "linux" else "spawn")


def _be_a_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers itself, and end when it is killed."""
    gc.freeze()  # forks share these pages, and nobody need go through them again
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent:
        Thread(target=_end_after, args=(parent.sentinel,), daemon=True).start()


def _end_after(parent: int) -> None:
    """End this process when its parent is gone; its sandbox follows, and where it came from."""
    connection.wait([parent])
    shutil.rmtree(util.get_temp_dir(), ignore_errors=True)  # the parent's, where its sockets are
    os._exit(1)


@contextmanager
def cluster_executors(address: str) -> Iterator[tuple[Iterator[Executor], int]]:
    """The workers of a Dask cluster that runs already, and how many they are.

    Raises
    ------
    LabkitError
        Where Dask is not installed, the address does not answer, or no worker is there.
    """
    distributed = need("distributed", purpose="grading on a cluster", extra="cluster")
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise LabkitError(
            f"no Dask scheduler answers at {address!r} ({error}); start one with `dask scheduler`"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise LabkitError(
                f"the scheduler at {address} has no workers; start some: dask worker {address}"
            ) from None
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
        executor = client.get_executor(pure=False)

        def same() -> Iterator[Executor]:
            while True:
                yield executor

        yield same(), workers


_OPEN: dict[tuple[str, Limits], Sandbox] = {}


def own_sandbox(mode: str, limits: Limits) -> Sandbox:
    """The sandbox of this process, opened once and closed when the process ends."""
    if (mode, limits) not in _OPEN:
        sandbox = open_sandbox(mode, limits)
        util.Finalize(None, sandbox.close, exitpriority=0)  # a forked process runs no `atexit`
        _OPEN[mode, limits] = _OPEN[sandbox.mode, limits] = sandbox
    return _OPEN[mode, limits]


def open_sandboxes(
    executor: Executor, workers: int, mode: str, limits: Limits, assignment: str
) -> str:
    """Have workers open their sandboxes, all at the same time, and name the mode.

    They read the assignment meanwhile.

    Raises
    ------
    SandboxError
        Where the mode does not work here.
    LabkitError
        Where a worker was lost before it had opened one.
    """
    opened = [executor.submit(_open, mode, limits, assignment) for _ in range(workers)]
    try:
        return opened[0].result()
    except BrokenExecutor:
        raise LabkitError(
            "a worker was lost before it graded anything; has the machine memory to spare? "
            "--jobs 1 needs the least"
        ) from None


def _open(mode: str, limits: Limits, assignment: str) -> str:
    reading = Thread(target=_read, args=(assignment,))  # while the sandbox starts
    reading.start()
    try:
        return own_sandbox(mode, limits).mode
    finally:
        reading.join()
        gc.freeze()  # what is here now stays, and need not be gone through again


def _read(assignment: str) -> None:
    with suppress(LabkitError):  # which the grader met itself
        load_assignment(assignment)
