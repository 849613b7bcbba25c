"""The walls tried from inside, each time a slot opens: a mode that only claims to isolate is none.

What the kernel refuses today a changed setting may allow tomorrow, so every slot runs this
before the first submission: it tries to read a file of the grader, to list the root, to
open a socket, to start a process, to signal the grader and to change a file's metadata.
"""

from __future__ import annotations

from labkit.grading.contract import Outcome

WALL_TEST = """
import os, socket

EXPECTED = {"dev", "tmp"}


def refused(attempt):
    try:
        attempt()
    except (OSError, PermissionError):
        return True
    return False


def fork():
    if os.fork() == 0:
        os._exit(0)


def holes(grader_file, grader):
    attempts = {
        "it can read the grader's files": lambda: open(grader_file).close(),
        "it can open a socket": lambda: socket.socket().close(),
        "it can start a process": fork,
        "it can signal the grader": lambda: os.kill(grader, 0),
        "it can change metadata": lambda: os.utime("."),
    }
    found = [hole for hole, attempt in attempts.items() if not refused(attempt)]
    try:
        if set(os.listdir("/")) - EXPECTED:
            found.append("it can list the root directory")
    except OSError:
        pass
    if os.environ.keys() - {"PATH", "HOME", "LANG", "PYTHONHASHSEED", "OMP_NUM_THREADS",
                            "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "LC_CTYPE", "PWD", "TMPDIR"}:
        found.append("it sees the grader's environment")
    with open("note", "w") as file:
        file.write("a private place to write")
    os.unlink("note")
    return found
"""


def holes(outcome: Outcome) -> str:
    """What the wall test found, in words; the test itself may have failed."""
    if isinstance(outcome.value, tuple) and outcome.value:
        return ", ".join(map(str, outcome.value))
    return outcome.message or str(outcome.status.value)
