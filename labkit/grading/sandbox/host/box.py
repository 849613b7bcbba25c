"""A box as the grader holds it: one process for one submission, and who starts such processes."""

from __future__ import annotations

import signal
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from labkit.errors import LabkitError
from labkit.grading.contract import Limits
from labkit.grading.sandbox.host.channel import Channel


class SandboxError(LabkitError):
    """A mode of isolation that this machine does not offer, or that broke down."""


@dataclass(frozen=True, kw_only=True)
class Exit:
    """How a box ended: the signal that ended it (0: none), or a reason in words."""

    signal: int = 0
    reason: str = ""

    def __str__(self) -> str:
        """In a reader's words, as the end of "it ended: ...".

        Examples
        --------
        >>> str(Exit(signal=11))
        'the program crashed (SIGSEGV)'
        >>> str(Exit())
        'the program ended itself'
        """
        if self.reason:
            return self.reason
        if not self.signal:
            return "the program ended itself"
        try:
            name = signal.Signals(self.signal).name
        except ValueError:
            name = f"signal {self.signal}"
        if name == "SIGKILL":
            return "the program was killed (memory, or a signal of its own)"
        return f"the program crashed ({name})"


class Box(Protocol):
    """One running process that has its jail around it."""

    @property
    def channel(self) -> Channel:
        """Where frames go in and come out."""

    def stop(self, leaving: bool) -> Exit:
        """End it and say how it ended; one that is `leaving` gets a moment to do so itself."""


class Starter(Protocol):
    """Starts one box after the other."""

    def start(self, *, scipy: bool) -> Box:
        """A fresh box, in which scipy can be imported or not."""

    def close(self) -> None:
        """End all that it started."""


def order(mode: str, limits: Limits, **more: Any) -> dict[str, Any]:
    """What a box is told about itself."""
    return {"mode": mode, **asdict(limits), **more}
