"""Bytes to and from a box, with a deadline on each read and write and a bound on each length."""

from __future__ import annotations

import contextlib
import os
import queue
import select
import socket
import subprocess
import threading
import time
from typing import IO, Any, Protocol

from labkit.grading.sandbox.inside import data

CHUNK = 1 << 18
PART = 1 << 16  # that much is set aside for each read, whatever comes
LEAVE = 0.2  # s that a closed pipe may take to end


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
    """Read one frame of at most `most` bytes: its value, and its length in bytes.

    Raises
    ------
    labkit.grading.sandbox.inside.data.WireError
        If what arrives is no frame, or a longer one.
    """
    head = channel.read(data.HEAD.size, deadline)
    tree_length, raw_length = data.lengths(head, most)
    body = channel.read(tree_length + raw_length, deadline)
    return data.rebuild(body, tree_length), len(head) + len(body)


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
        taken = bytes(self.buffer[:count])
        del self.buffer[:count]
        return taken

    def close(self) -> None:
        """Let go of it."""
        self.end.close()


def _milliseconds(deadline: float) -> float:
    return max(0.0, deadline - time.monotonic()) * 1000


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
        taken = bytes(self.buffer[:count])
        del self.buffer[:count]
        return taken

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
