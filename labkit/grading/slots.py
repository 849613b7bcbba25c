"""The sandbox of a worker: one a process, open as long as the process lives."""

from __future__ import annotations

import gc
from concurrent.futures import BrokenExecutor, Executor
from contextlib import suppress
from multiprocessing.util import Finalize
from threading import Thread

from labkit.errors import LabkitError
from labkit.grading.assignment import load_assignment
from labkit.grading.contract import Limits, Sandbox
from labkit.grading.sandbox.host import open_sandbox

_OPEN: dict[tuple[str, Limits], Sandbox] = {}


def own_sandbox(mode: str, limits: Limits) -> Sandbox:
    """The sandbox of this process, opened once and closed when the process ends."""
    if (mode, limits) not in _OPEN:
        sandbox = open_sandbox(mode, limits)
        Finalize(None, sandbox.close, exitpriority=0)  # a forked process runs no `atexit`
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
