"""Where submissions are graded: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import forkserver
from multiprocessing.context import BaseContext

from labkit.errors import LabkitError
from labkit.grading.isolation import launch

PATIENCE = 10.0  # [s] for a cluster to answer
NEEDED = "labkit.grading.nursery"


def prepare() -> None:
    """Have Python started and labkit imported where workers will come from, without waiting."""
    if sys.platform == "linux":
        _import_nothing_from_here()
        forkserver.set_forkserver_preload([NEEDED])
        with _one_thread():
            forkserver.ensure_running()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Processes that are started meanwhile do linear algebra in one thread, without idle ones."""
    before = {name: os.environ.get(name) for name in launch.ONE_THREAD}
    os.environ |= launch.ONE_THREAD
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
    _import_nothing_from_here()
    pools: list[ProcessPoolExecutor] = []
    context = _context()

    def make() -> Iterator[Executor]:
        while True:
            pools.append(ProcessPoolExecutor(workers, context, initializer=_be_a_worker))
            yield pools[-1]
            pools[-1].shutdown(wait=False, cancel_futures=True)

    try:
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


def _import_nothing_from_here() -> None:
    """Keep processes that are started from now on from what lies in the grader's folder.

    That is often the folder of the submissions, and one of them may be called ``signal.py``.
    """
    os.environ["PYTHONSAFEPATH"] = "1"


def _be_a_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers itself; one thread is enough."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def cluster_executors(address: str) -> Iterator[tuple[Iterator[Executor], int]]:
    """The workers of a Dask cluster that runs already, and how many they are.

    Raises
    ------
    LabkitError
        Where Dask is not installed, the address does not answer, or no worker is there.
    """
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise LabkitError(
            "grading on a cluster needs Dask: pip install 'labkit[cluster]'"
        ) from None
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
