"""All limits of a submission, in one place: sizes in bytes, letters and counts, and its time."""

from __future__ import annotations

# Files that are handed in
MAX_TOGETHER = 96 << 20  # bytes of all files of one student
MAX_FILE = 64 << 20  # bytes of a notebook with its pictures
MAX_SOURCE = 2 << 20  # letters of code in all files
MAX_WRITTEN = 100_000  # letters of Markdown
MAX_CELLS = 1000  # of code in all files
MAX_DEPTH = 2  # archives in archives
# What the box takes
MEMORY = 1536 << 20  # bytes
DISK_BYTES = 64 << 20
FILE_BYTES = 16 << 20  # of one file
MAX_THREADS = 256
# What the box says
MAX_PROGRAM = 1 << 27  # bytes of what was read, which are code and no answer
MAX_LINE = 1 << 18  # bytes of any other message
MAX_BYTES = 1 << 16  # of an answer
NODE_BYTES = 24  # that a value takes beside its content
MAX_NESTING = 12
MAX_MESSAGE = 480  # letters
MAX_NOTES = 20

SECONDS = 3.0  # [s] of processor time, for a cell and for a call
START = 120.0  # [s] until a box must be ready, on a machine at its limit
READING = 10.0  # [s] for the files
MORE = 0.5  # [s] added for the cells and for each call, as the grader waits for them


class Time:
    """Processor time of one submission [s]: what is left of it, and what each step may take.

    All of it follows from the time for a call.
    """

    def __init__(self, call: float = SECONDS) -> None:
        self.call = call  # of a function, and of a cell
        self.left = 60.0 * call
        self.experiments = 2.0 * call  # left for all statements that define nothing
        self.importing = 3.0 * call  # for an import: some packages are large
        self.cells = 10.0 * call + MORE  # for all together, as the grader waits for them
        self.patient_call = 5.0 * call  # of a function that is right in all visible cases

    @property
    def is_over(self) -> bool:
        """True if nothing is left."""
        return self.left <= 0.0

    def charge_box(self, used: float) -> None:
        """Take off what a box used; its start costs, too, so that none is started for ever."""
        self.left -= used + 0.5 * self.call

    def experiment(self) -> float:
        """For a statement that defines nothing; 0 where all of them took far too long."""
        if self.experiments <= -2.0 * self.call:
            return 0.0
        return max(min(self.call / 2.0, self.experiments), self.call / 10.0)


def waiting_time(call: float) -> float:
    """The time that the grader waits for the answer of a call [s]."""
    return 1.5 * call + MORE
