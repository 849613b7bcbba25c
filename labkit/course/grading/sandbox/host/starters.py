"""Who starts boxes: in the safe modes a zygote that forks, in mode "none" a fresh Python each time.

The zygote has numpy imported and forks one jailed process a submission. A fresh Python is held
by limits and nothing else.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import time
from typing import Any

from labkit.course.grading.contract import Limits
from labkit.course.grading.sandbox.host import launch
from labkit.course.grading.sandbox.host.box import (
    Channel,
    Exit,
    GoneError,
    LateError,
    PipeChannel,
    SandboxError,
    SocketChannel,
    order,
    receive,
)
from labkit.course.grading.sandbox.host.launch import SlotUser, threads_of
from labkit.course.grading.sandbox.inside import data

START = 60.0  # s that a busy machine may take to import numpy and scipy
MOMENT = 1.0  # s that a process may take to end once it has said so
SMALL = 1 << 16
SPARE_THREADS = 64  # others of the same user may start some meanwhile
BOX_THREADS = 8  # bubblewrap, the zygote, the supervisor
FIRST_TO_GO = "1000"  # where memory runs out, a box ends and not the grader: forks inherit it
LIBRARIES = 1 << 30  # bytes of address space for Python and numpy, where /proc does not tell


class ForkBox:
    """One jailed process, and its supervisor's line to the grader."""

    def __init__(self, end: socket.socket, life: socket.socket, folder: str | None) -> None:
        self.channel: Channel = SocketChannel(end)
        self.life = life
        self.folder = folder

    def stop(self, leaving: bool) -> Exit:
        """Have the supervisor end it, and wait until it has."""
        end: dict[str, Any] = {}
        try:
            self.life.settimeout(MOMENT)
            if leaving:
                with contextlib.suppress(TimeoutError):
                    end = json.loads(self.life.recv(SMALL) or "{}")
            if not end:
                self.life.shutdown(socket.SHUT_WR)
                self.life.settimeout(START)
                end = json.loads(self.life.recv(SMALL) or "{}") | {"signal": 0}
        except (OSError, ValueError):
            end = {"reason": "the sandbox itself broke down"}
        finally:
            self.life.close()
            self.channel.close()
            if self.folder:
                shutil.rmtree(self.folder, ignore_errors=True)
        return Exit(signal=end.get("signal", 0), reason=end.get("reason", end.get("fault", "")))


class ForkServer:
    """Holds the zygote of one slot, and starts it again should it be lost."""

    def __init__(self, mode: str, limits: Limits) -> None:
        self.mode = mode
        self.limits = limits
        self.user = SlotUser() if os.geteuid() == 0 else None
        self.process: subprocess.Popen[bytes] | None = None
        self.control: socket.socket | None = None
        self.has_scipy = False
        try:
            self._launch()
        except BaseException:
            self.close()
            raise

    def start(self, *, scipy: bool) -> ForkBox:
        """Have the zygote fork a child, and wait until its jail is closed."""
        try:
            return self._fork(scipy)
        except OSError:  # the zygote is lost: once more, with a new one
            self._end()
            self._launch()
        try:
            return self._fork(scipy)
        except OSError as error:
            raise SandboxError(f"mode {self.mode} broke down: {error}") from None

    def close(self) -> None:
        """End the zygote and all that it forked."""
        self._end()
        if self.user:
            self.user.close()
            self.user = None

    def _fork(self, scipy: bool) -> ForkBox:
        assert self.control is not None
        if scipy and not self.has_scipy:
            self.control.send(data.ADD_SCIPY)
            self._await_ready()
            self.has_scipy = True
        folder = None if self.mode == "bubblewrap" else tempfile.mkdtemp(prefix="labkit-")
        if self.mode == "landlock" and self.user and folder:
            os.chown(folder, self.user.uid, self.user.uid)
        told = order(
            self.mode,
            self.limits,
            folder=folder,
            uid=self.user.uid if self.user else None,
            address_space=self.address_space,
            hide_scipy=self.has_scipy and not scipy,
        )
        told["threads"] += self._threads_besides()
        pairs = [socket.socketpair() for _ in range(2)]
        (ours, theirs), (life, their_life) = pairs
        ends = [theirs.fileno(), their_life.fileno()]
        box = ForkBox(ours, life, folder)
        try:
            with theirs, their_life:  # or `stop` would wait for an end that is held here
                socket.send_fds(self.control, [json.dumps(told).encode()], ends)
            first, _ = receive(box.channel, SMALL, time.monotonic() + START)
        except (OSError, GoneError, LateError, data.WireError):
            end = box.stop(leaving=False)
            raise OSError(f"no jail ({end})") from None
        if first != {"ready": True}:
            box.stop(leaving=True)
            raise SandboxError(f"mode {self.mode} does not work here: {first.get('fault')}")
        return box

    def _threads_besides(self) -> int:
        if self.mode == "bubblewrap":
            return BOX_THREADS
        return SPARE_THREADS + threads_of(os.getuid()) if self.user is None else 0

    def _launch(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.control = ours
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        passed = [theirs.fileno()]
        before: list[str] = []
        try:
            if self.mode == "bubblewrap":
                if self.user:
                    passed.append(launch.mapped_users(self.user.uid))
                before = launch.bubblewrap(passed[1] if self.user else None)
            self.process = subprocess.Popen(
                before + launch.command("zygote", str(passed[0])),
                env=launch.environment(),
                pass_fds=passed,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        finally:
            theirs.close()
            for descriptor in passed[1:]:
                os.close(descriptor)
        self._await_ready()
        self.has_scipy = False

    def _await_ready(self) -> None:
        assert self.control is not None
        assert self.process is not None
        self.control.settimeout(START)
        try:
            message, ancillary, _, _ = self.control.recvmsg(SMALL, socket.CMSG_SPACE(12))
        except TimeoutError:
            message, ancillary = b"", []
        if message != b"ready":
            self.process.kill()
            _, complaint = self.process.communicate()
            last = complaint.decode(errors="replace").strip().rpartition("\n")[2]
            raise SandboxError(f"mode {self.mode} does not work here: {last or 'no answer'}")
        pid = next(struct.unpack("3i", sender)[0] for _, _, sender in ancillary)
        self.address_space = LIBRARIES
        with contextlib.suppress(OSError), open(f"/proc/{pid}/statm", encoding="ascii") as file:
            self.address_space = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        with (
            contextlib.suppress(OSError),
            open(f"/proc/{pid}/oom_score_adj", "w", encoding="ascii") as file,
        ):
            file.write(FIRST_TO_GO)

    def _end(self) -> None:
        if self.control:
            self.control.close()  # the zygote's sign to leave
        if self.process:
            if self.process.poll() is None and not _ends(self.process.pid, MOMENT):
                self.process.kill()
            self.process.wait()
            if self.process.stderr:
                self.process.stderr.close()
        self.control = self.process = None


def _ends(child: int, seconds: float) -> bool:
    """Whether a child of this process ends within the time; known at once, without polling."""
    handle = os.pidfd_open(child)
    waiting = select.poll()
    waiting.register(handle, select.POLLIN)
    try:
        return bool(waiting.poll(seconds * 1000))
    finally:
        os.close(handle)


class ColdBox:
    """A running Python without a jail."""

    def __init__(self, limits: Limits) -> None:
        self.folder = tempfile.mkdtemp(prefix="labkit-")
        told = json.dumps(order("none", limits, address_space=LIBRARIES))
        self.process = subprocess.Popen(
            launch.command("worker", told),
            env=launch.environment() | {"HOME": self.folder},
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            start_new_session=True,
        )
        self.channel: Channel = PipeChannel(self.process)

    def stop(self, leaving: bool) -> Exit:
        """Kill it, its process group and its folder."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(MOMENT if leaving else 0)
        ended = self.process.poll()
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if os.name == "posix":
                os.killpg(self.process.pid, signal.SIGKILL)
            else:
                self.process.kill()
        self.process.wait()
        self.channel.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        return Exit(signal=-ended if ended is not None and ended < 0 else 0)


class ColdStarter:
    """Starts boxes of mode "none"."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits

    def start(self, *, scipy: bool) -> ColdBox:
        """A fresh process, that has numpy imported.

        Raises
        ------
        SandboxError
            If Python does not start.
        """
        box = ColdBox(self.limits)
        try:
            receive(box.channel, SMALL, time.monotonic() + START)
        except (LateError, GoneError, data.WireError):
            raise SandboxError(f"mode none does not work here: {box.stop(leaving=True)}") from None
        return box

    def close(self) -> None:
        """Nothing outlives its box."""
