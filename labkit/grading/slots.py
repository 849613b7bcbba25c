"""The sandbox of a worker: one a process, open as long as the process lives."""

from __future__ import annotations

import atexit
from concurrent.futures import BrokenExecutor, Executor

from labkit.errors import LabkitError
from labkit.grading.contract import Limits, Sandbox
from labkit.grading.isolation import open_sandbox

_OPEN: dict[tuple[str, Limits], Sandbox] = {}


def own_sandbox(mode: str, limits: Limits) -> Sandbox:
    """The sandbox of this process, opened once and closed when the process ends."""
    if (mode, limits) not in _OPEN:
        sandbox = open_sandbox(mode, limits)
        atexit.register(sandbox.close)
        _OPEN[mode, limits] = _OPEN[sandbox.mode, limits] = sandbox
    return _OPEN[mode, limits]


def open_sandboxes(executor: Executor, workers: int, mode: str, limits: Limits) -> str:
    """Have workers open their sandboxes, all at the same time, and name the mode.

    Raises
    ------
    SandboxError
        Where the mode does not work here.
    LabkitError
        Where a worker was lost before it had opened one.
    """
    opened = [executor.submit(_open, mode, limits) for _ in range(workers)]
    try:
        return opened[0].result()
    except BrokenExecutor:
        raise LabkitError(
            "a worker was lost before it graded anything; has the machine memory to spare? "
            "--jobs 1 needs the least"
        ) from None


def _open(mode: str, limits: Limits) -> str:
    return own_sandbox(mode, limits).mode
