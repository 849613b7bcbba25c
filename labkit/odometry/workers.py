"""Work spread over the cores: its results in order, its memory bounded, no process left over.

Processes, for threads gain nothing here: numpy's calls on a few hundred points are too
short to run side by side under the interpreter's lock. Killian Court on two cores takes
2.3 s in one process, 4.9 s in two threads and 1.3 s in two processes.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import starmap
from typing import Any, TypeVar

from labkit.errors import LabkitError

R = TypeVar("R")

AHEAD = 2  # tasks a worker holds: the one in hand and the next, so that it never waits
MAX_WORKERS = 60  # as many as Windows can wait for


def available_cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_order(
    function: Callable[..., R], tasks: Iterable[tuple[Any, ...]], workers: int
) -> Generator[R, None, None]:
    """``function(*task)`` of each task, in the order of the tasks.

    The calling process does its share, so that it is of use while the workers start.
    Few tasks are under way at any time, however many there are.

    Parameters
    ----------
    function : callable
        A function of a module; it and the tasks are pickled.
    tasks : iterable of tuple
        Its arguments, drawn as they are needed.
    workers : int
        How many processes help the calling one; 0 for none.

    Yields
    ------
    object
        The results. Close the iterator early, and no more tasks are begun.

    Raises
    ------
    Exception
        Whatever `function` raises, here as in a worker.
    LabkitError
        If a worker cannot start, or dies.

    Examples
    --------
    >>> list(in_order(divmod, [(7, 2), (9, 4)], workers=0))
    [(3, 1), (2, 1)]
    """
    if workers == 0:
        yield from starmap(function, tasks)
        return
    with _pool(min(workers, MAX_WORKERS)) as pool:
        begun: deque[Future[R]] = deque()
        for task in tasks:
            if sum(not future.done() for future in begun) < AHEAD * workers:
                begun.append(_submit(pool, function, task))
            else:
                own: Future[R] = Future()
                own.set_result(function(*task))
                begun.append(own)
            while begun and begun[0].done():
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()


def start_method() -> str:
    """How workers start: as copies of this process where that is safe, else from nothing.

    A copy is there at once, while a new interpreter takes half a second to import numpy
    and scipy. But a copy inherits the locks that other threads hold and nobody will release;
    and only Linux's libraries bear being copied.
    """
    alone = sys.platform == "linux" and threading.active_count() == 1
    return "fork" if alone else "spawn"


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that are gone when the block is left, whichever way."""
    context = multiprocessing.get_context(start_method())
    try:
        pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_serve)
    except (ImportError, NotImplementedError, OSError) as error:
        raise _lost(error) from error
    try:
        yield pool
    except BrokenProcessPool as error:
        raise _lost(error) from error
    finally:
        pool.shutdown(cancel_futures=True)


def _submit(
    pool: ProcessPoolExecutor, function: Callable[..., R], task: tuple[Any, ...]
) -> Future[R]:
    """Hand over a task; a worker that is started by it never sees a Ctrl-C."""
    try:
        with _later_ctrl_c():
            return pool.submit(function, *task)
    except OSError as error:
        raise _lost(error) from error


@contextmanager
def _later_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C wait until the block is left; processes begun inside never receive it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # children inherit it
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _lost(error: Exception) -> LabkitError:
    return LabkitError(
        f"a process that shares the work did not start, or was ended ({error}); "
        f"do it in one process: jobs=1, or --jobs 1"
    )


def _serve() -> None:
    """Make a worker of this process: it leaves Ctrl-C to its parent, and dies with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where there is no mask to inherit
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
