"""A watch over a box: it ends an order by the processor time that it took, and never by the clock.

The clock runs on while the machine is busy or paused, while a disk does not answer, and while
the grader itself is stopped (Ctrl-Z). None of these is the fault of the code. So the clock counts
only as far as the watch saw the code do nothing, and then it ends what would wait for ever.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from labkit.grading.box.inside.limits import MAX_THREADS
from labkit.support.errors import LabkitError

LOOK = 0.25  # [s] between two looks at the time that a box has used
MAX_IDLE = 3.0  # [s], and a quarter of what is allowed: code that waits so long waits for ever
BUSY = 30.0  # times what is allowed; a machine that takes longer is too busy to say anything


class BoxError(Exception):
    """The box ended, took too long or sent what it must not; nothing more comes from it."""


class BoxTimeout(BoxError):
    """The code took too much time."""


class MachineError(LabkitError):
    """The machine kept a box from its work: no fault of what ran in it."""


class Usage(NamedTuple):
    """Use of the processor by a process so far, in seconds."""

    used: float  # by all of its threads
    waited: float = 0.0  # for a processor, while others had it
    is_at_disk: bool = False  # waits for a disk at this moment
    threads: int = 1


def read_usage(pid: int) -> Usage | None:
    """Usage of a process, by Linux; None where the system does not tell."""
    try:
        state, *fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        user, system, threads = (int(fields[place]) for place in (10, 11, 16))
        waited = 0
        if threads <= MAX_THREADS:  # to read more of them takes long
            for thread in Path(f"/proc/{pid}/task").glob("*/schedstat"):
                waited += int(thread.read_text().split()[1])
        used = (user + system) / os.sysconf("SC_CLK_TCK")
        return Usage(used, waited / 1e9, state == "D", threads)
    except (OSError, ValueError, IndexError):
        return None


class Watch:
    """The time that one order takes, look by look."""

    def __init__(self, allowed: float, usage: Usage | None, now: float) -> None:
        self.allowed = allowed  # [s] of processor time
        self.first = self.last = usage or Usage(0.0)
        self.looked = now
        self.watched = 0.0  # [s] by the clock, without those in which nobody looked
        self.idle = 0.0  # [s] of these in which the code neither worked nor could not

    def look(self, usage: Usage | None, now: float) -> None:
        """Raise `BoxTimeout` where the code took too long, `MachineError` where the machine did.

        Where the system does not tell the usage, the code counts as working all the time.
        """
        passed = min(now - self.looked, LOOK)  # for longer, the grader itself was stopped
        if usage is None:
            usage = self.last._replace(used=self.last.used + passed)
        worked = usage.used - self.last.used + usage.waited - self.last.waited
        self.looked, self.last = now, usage
        self.watched += passed
        if not usage.is_at_disk:
            self.idle += max(0.0, passed - worked)
        used = usage.used - self.first.used
        max_idle = max(MAX_IDLE + self.allowed / 4.0, self.watched / 2.0)
        if used > self.allowed or self.idle > max_idle:
            raise BoxTimeout("it took too long")
        if usage.threads > MAX_THREADS:
            raise BoxError("the program started too many threads")
        if self.watched > BUSY * self.allowed:
            raise MachineError(
                f"this machine was too busy: of {self.watched:.0f} s the code got the processor "
                f"for {used:.1f} s. Grade it again, with a smaller --jobs or on a quiet machine"
            )
