"""The modes of isolation, strongest first, and the choice among those that work here.

A mode that only claims to isolate is none: what the kernel refuses today a changed setting may
allow tomorrow. So every sandbox tries its walls from inside before the first submission: it tries
to read a file of the grader, to list the root, to open a socket, to start a process, to signal
the grader, to change a file's metadata, and to set a lock that another process can see.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sys
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self

from labkit.course.grading.contract import (
    Call,
    Extraction,
    Fault,
    Limits,
    Outcome,
    OutcomeStatus,
    SourceCell,
)
from labkit.course.grading.sandbox.host.box import Box, SandboxError, Starter
from labkit.course.grading.sandbox.host.session import Session, extract_in
from labkit.course.grading.sandbox.host.starters import ColdStarter, ForkServer
from labkit.course.grading.sandbox.inside.syscall_filter import MACHINES
from labkit.errors import InvalidParameterError

WALL_TEST = """
import os, socket

try:
    import fcntl
except ImportError:  # only where there is nothing to try
    fcntl = None

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


def lock(way):
    with open("/dev/null", "r+b") as shared:
        way(shared, fcntl.LOCK_EX | fcntl.LOCK_NB)


def holes(grader_file, grader):
    attempts = {
        "it can read the grader's files": lambda: open(grader_file).close(),
        "it can open a socket": lambda: socket.socket().close(),
        "it can start a process": fork,
        "it can signal the grader": lambda: os.kill(grader, 0),
        "it can change metadata": lambda: os.utime("."),
        "it can set record locks that others see": lambda: lock(fcntl.lockf),
        "it can set file locks that others see": lambda: lock(fcntl.flock),
        "it can see which processes live": lambda: os.getpgid(grader),
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


SAFE = ("bubblewrap", "landlock", "user")
NONE = "none"
MODES = (*SAFE, NONE)


class Sandbox:
    """Runs submissions one after the other in boxes of one mode; not thread-safe.

    Parameters
    ----------
    mode : str
        One of `MODES`; "none" limits but does not isolate.
    limits : Limits
        The same for each submission.

    Attributes
    ----------
    faults : list of Fault
        The shared cells that failed in the last run.

    Raises
    ------
    SandboxError
        If the mode does not work here, or does not isolate.
    """

    def __init__(self, mode: str, limits: Limits) -> None:
        self.mode = mode
        safe = mode != NONE
        self.limits = limits
        self.faults: list[Fault] = []
        self._fresh: Box | None = None  # has read the files of the submission to come
        self._starter: Starter = ForkServer(mode, limits) if safe else ColdStarter(limits)
        if safe:
            try:
                self._prove()
            except BaseException:
                self.close()
                raise

    def extract(self, files: Mapping[str, bytes], functions: Mapping[str, str]) -> Extraction:
        """Find the answers in a submission's files, in the process that `run` goes on with.

        Raises
        ------
        SandboxError
            If the sandbox itself broke down and could not be started again.
        """
        self._stop_fresh()
        box = self._starter.start(scipy=any(b"scipy" in held for held in files.values()))
        found, lives = extract_in(box, files, functions)
        self._fresh = box if lives else None
        return found

    def run(self, cells: Sequence[SourceCell], calls: Sequence[Call]) -> list[Outcome]:
        """Run the cells in a fresh process, then the calls: one outcome each, in their order.

        A hang, crash or flood costs the question whose cell or call did it; the others go
        on in another fresh process.

        Raises
        ------
        InvalidParameterError
            If two calls have the same id.
        SandboxError
            If the sandbox itself broke down and could not be started again.
        """
        ids = [call.id for call in calls]
        if len(set(ids)) != len(ids):
            twice = next(name for name in ids if ids.count(name) > 1)
            raise InvalidParameterError(
                f"must have different ids, got {twice!r} twice", parameter="calls"
            )
        session = Session(self._starter, self.limits, cells, self._fresh)
        self._fresh = None
        try:
            return session.run(calls)
        finally:
            self.faults = session.faults

    def close(self) -> None:
        """End what is still running; may be called twice."""
        self._stop_fresh()
        self._starter.close()

    def __enter__(self) -> Self:
        """The sandbox itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close."""
        self.close()

    def _stop_fresh(self) -> None:
        box, self._fresh = self._fresh, None
        if box:
            box.stop(leaving=False)

    def _prove(self) -> None:
        """Try the walls from inside before anybody's code is trusted to them."""
        cell = SourceCell(source=WALL_TEST, question=None, label="the wall test")
        arguments = (__file__, os.getpid())
        call = Call(id="wall", question="wall", function="holes", arguments=arguments)
        (outcome,) = self.run([cell], [call])
        if outcome.status is not OutcomeStatus.RETURNED or outcome.value != ():
            raise SandboxError(
                f"mode {self.mode} does not isolate here: {holes(outcome)}; choose another mode"
            )


def open_sandbox(mode: str = "auto", limits: Limits | None = None) -> Sandbox:
    """Open a sandbox that submissions can be run in.

    Parameters
    ----------
    mode : {"auto", "bubblewrap", "landlock", "user", "none"}
        "auto" is the strongest safe mode that works here, never "none".
    limits : Limits, optional
        The same for each submission; by default `Limits()`.

    Returns
    -------
    Sandbox
        To be closed, or used in a ``with`` statement; it names its mode.

    Raises
    ------
    InvalidParameterError
        If there is no such mode.
    SandboxError
        If the mode (or, with "auto", every safe one) does not work here: the message says
        why, and what to install.

    Examples
    --------
    >>> cell = SourceCell(source="def double(x): return 2 * x", question="q", label="cell 1")
    >>> call = Call(id="1", question="q", function="double", arguments=(21,))
    >>> with open_sandbox("none") as sandbox:
    ...     sandbox.run([cell], [call])[0].value
    42
    """
    limits = limits or Limits()
    if mode == "auto":
        for candidate in SAFE:
            with contextlib.suppress(SandboxError):
                if not obstacle(candidate):
                    return Sandbox(candidate, limits)
        raise SandboxError(
            "no safe mode of isolation works here:\n"
            + "\n".join(f"  {name}: {why}" for name, why in available_modes().items() if why)
            + "\nwith --no-isolation code runs with your own rights: only for code you trust"
        )
    if mode not in MODES:
        raise InvalidParameterError(
            f"must be one of auto, {', '.join(MODES)}, got {mode!r}", parameter="mode"
        )
    if mode != NONE and (why := obstacle(mode)):
        raise SandboxError(f"mode {mode} does not work here: {why}")
    return Sandbox(mode, limits)


@functools.cache
def _tried(mode: str) -> str:
    try:
        Sandbox(mode, Limits()).close()
    except SandboxError as error:
        return str(error).removeprefix(f"mode {mode} does not work here: ")
    return ""


def available_modes() -> dict[str, str]:
    """Each mode with "" if it works here, or why not and what to do; tried, not guessed."""
    return {mode: obstacle(mode) or (_tried(mode) if mode != NONE else "") for mode in MODES}


def obstacle(mode: str) -> str:
    """What is known to stand in the way of a mode before it is tried, or ""."""
    if mode == NONE:
        return ""
    if sys.platform != "linux":
        return f"it needs Linux, and this is {sys.platform}; a container or WSL 2 is one"
    machine = os.uname().machine
    if machine not in MACHINES:
        return f"it knows the system calls of {', '.join(MACHINES)}, not of {machine}"
    if mode == "user" and os.geteuid() != 0:
        return "only root can become another user; run the grader as root in a container"
    return ""
