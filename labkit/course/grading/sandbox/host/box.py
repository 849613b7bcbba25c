"""A box as the grader holds it: one process for one submission, and bytes to and from it.

Each read and write has a deadline, each frame a bound on its length.
"""

from __future__ import annotations

import contextlib
import os
import queue
import select
import signal
import socket
import subprocess
import threading
import time
from dataclasses import asdict, dataclass
from functools import partial
from typing import IO, Any, Protocol

from labkit.course.grading.contract import Limits
from labkit.course.grading.sandbox.inside import data
from labkit.errors import LabkitError

CHUNK = 1 << 18
PART = 1 << 16  # that much is set aside for each read, whatever comes
LEAVE = 0.2  # s that a closed pipe may take to end


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


class LateError(Exception):
    """The box did not answer, or did not listen, in time."""


class GoneError(Exception):
    """The box closed its end."""


class Channel(Protocol):
    """A stream of bytes both ways."""

    def write(self, frame: bytes, deadline: float) -> None:
        """Send all of it; `LateError` or `GoneError` if that cannot be."""

    def read(self, count: int, deadline: float) -> bytes:
        """Exactly `count` bytes; `LateError` or `GoneError` if they do not come."""

    def close(self) -> None:
        """Let go of it."""


def receive(channel: Channel, most: int, deadline: float) -> tuple[Any, int]:
    """Read one frame of at most `most` bytes, as `sandbox.inside.data.receive`."""
    return data.receive(partial(channel.read, deadline=deadline), most)


class SocketChannel:
    """One end of a socket pair."""

    def __init__(self, end: socket.socket) -> None:
        self.end = end
        self.end.setblocking(False)
        self.buffer = bytearray()
        self.arrival = select.poll()
        self.arrival.register(end, select.POLLIN)

    def write(self, frame: bytes, deadline: float) -> None:
        """Send all of it."""
        view = memoryview(frame)
        while view:
            try:
                view = view[self.end.send(view[:CHUNK]) :]
            except BlockingIOError:
                room = select.poll()
                room.register(self.end, select.POLLOUT)
                if not room.poll(_milliseconds(deadline)):
                    raise LateError from None
            except OSError:
                raise GoneError from None

    def read(self, count: int, deadline: float) -> bytes:
        """Exactly `count` bytes."""
        while len(self.buffer) < count:
            if not self.arrival.poll(_milliseconds(deadline)):
                raise LateError
            try:
                part = self.end.recv(PART)
            except BlockingIOError:
                continue
            except OSError:
                raise GoneError from None
            if not part:
                raise GoneError
            self.buffer += part
        return _taken(self.buffer, count)

    def close(self) -> None:
        """Let go of it."""
        self.end.close()


def _milliseconds(deadline: float) -> float:
    return max(0.0, deadline - time.monotonic()) * 1000


def _taken(buffer: bytearray, count: int) -> bytes:
    """The first `count` bytes, which leave the buffer."""
    taken = bytes(buffer[:count])
    del buffer[:count]
    return taken


class PipeChannel:
    """The standard input and output of a process; threads wait, as Windows knows no poll."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self.stdin: IO[bytes] = process.stdin
        self.stdout: IO[bytes] = process.stdout
        self.buffer = bytearray()
        self.arrived: queue.Queue[bytes] = queue.Queue(maxsize=8)
        self.ended = False
        self.listener = threading.Thread(target=self._listen, daemon=True)
        self.listener.start()

    def write(self, frame: bytes, deadline: float) -> None:
        """Send all of it."""
        writer = threading.Thread(target=self._speak, args=(frame,), daemon=True)
        writer.start()
        writer.join(max(0.0, deadline - time.monotonic()))
        if writer.is_alive():
            raise LateError

    def read(self, count: int, deadline: float) -> bytes:
        """Exactly `count` bytes."""
        while len(self.buffer) < count:
            try:
                part = self.arrived.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                raise LateError from None
            if not part:
                self.ended = True
                raise GoneError
            self.buffer += part
        return _taken(self.buffer, count)

    def close(self) -> None:
        """Let go of it, once the process has ended.

        A process that outlived its group may hold the other end and talk on, or be silent:
        then the thread that listens there is left to it.
        """
        with contextlib.suppress(OSError):
            self.stdin.close()
        until = time.monotonic() + LEAVE
        with contextlib.suppress(queue.Empty):
            while not self.ended and time.monotonic() < until:
                self.ended = not self.arrived.get(timeout=LEAVE)
        self.ended = True
        with contextlib.suppress(queue.Empty):
            while True:
                self.arrived.get_nowait()
        self.listener.join(LEAVE)
        if not self.listener.is_alive():
            self.stdout.close()

    def _speak(self, frame: bytes) -> None:
        view = memoryview(frame)
        with contextlib.suppress(OSError, ValueError):  # the reader will notice
            while view:
                view = view[os.write(self.stdin.fileno(), view) :]

    def _listen(self) -> None:
        part = b"-"
        while part and not self.ended:
            try:
                part = os.read(self.stdout.fileno(), CHUNK)
            except (OSError, ValueError):
                part = b""
            self.arrived.put(part)
