"""Unprivileged users for root to run boxes as: one a slot, nobody's account, never shared."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
from pathlib import Path

from labkit.grading.sandbox.host.box import SandboxError

FIRST, COUNT = 64_000, 1_000


class SlotUser:
    """A user id that no other slot on this machine has while this object is open.

    The lock is an abstract socket: the kernel frees it whichever way the grader ends.
    """

    def __init__(self) -> None:
        for self.uid in range(FIRST, FIRST + COUNT):
            self.lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                self.lock.bind(f"\0labkit-grading-user-{self.uid}")
            except OSError:
                self.lock.close()
            else:
                return
        raise SandboxError(f"all {COUNT} user ids from {FIRST} on are in use by other graders")

    def close(self) -> None:
        """End whatever still runs as this user, and free the id."""
        for pid in processes_of(self.uid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.lock.close()


def processes_of(uid: int) -> list[int]:
    """The processes that run as a user, as far as /proc tells."""
    found = []
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if folder.name.isdigit() and folder.stat().st_uid == uid:
                found.append(int(folder.name))
    return found


def threads_of(uid: int) -> int:
    """How many threads run as a user: what RLIMIT_NPROC counts."""
    return sum(
        len(os.listdir(task))
        for task in (f"/proc/{pid}/task" for pid in processes_of(uid))
        if os.path.isdir(task)
    )
