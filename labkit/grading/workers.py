"""Where submissions are graded: processes of this machine, or the workers of a Dask cluster.

Each worker has one sandbox, open as long as its process lives.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import connection, forkserver, util
from multiprocessing.context import BaseContext
from threading import Thread

from labkit.errors import LabkitError
from labkit.extras import need
from labkit.grading.assignment import load_assignment
from labkit.grading.contract import Limits, Sandbox
from labkit.grading.sandbox.host import launch, open_sandbox

PATIENCE = 10.0  # [s] for a cluster to answer
NEEDED = "labkit.grading.class_run"  # what workers are forked with


def prepare() -> None:
    """Have Python started and labkit imported where workers will come from, without waiting.

    Raises
    ------
    LabkitError
        Where the folder for temporary files is too far down for a socket in it.
    """
    if sys.platform == "linux":
        forkserver.set_forkserver_preload([NEEDED])
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
