"""Has numpy imported once and forks one jailed process for each submission.

The zygote itself never sees a student's code: it hands a socket on to a child that closes
its jail first. Between the two stands a supervisor that ends the child when the grader
asks, or is gone, or when the child fills its folder.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
import stat
from typing import Any

from labkit.grading.box import jail, kernel, library, wire
from labkit.grading.box.worker import Worker

WATCH = 0.02  # s between two looks at a folder that nothing else limits
DISK_FULL = "it filled its folder"


def main(control_number: int) -> None:
    """Serve orders from the control socket until its other end closes."""
    library.preload()
    control = socket.socket(fileno=control_number)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for a supervisor
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the grader
    control.send(b"ready")
    while True:
        message, descriptors, _, _ = socket.recv_fds(control, 1 << 16, 2)
        if not message:
            return
        if os.fork() == 0:
            try:
                control.close()
                supervise(json.loads(message), *descriptors)
            finally:
                os._exit(0)
        for descriptor in descriptors:
            os.close(descriptor)


def supervise(order: dict[str, Any], channel: int, life: int) -> None:
    """Fork the child, watch it, and report how it ended on `life`."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    reason = ""
    try:
        if order["mode"] == "bubblewrap":
            kernel.unshare(kernel.NEW_PIDS | kernel.NEW_MOUNTS | kernel.NEW_IPC)
        child = os.fork()
    except OSError as error:
        os.write(life, json.dumps({"fault": str(error)}).encode())
        return
    if child == 0:
        work(order, channel, life)
    os.close(channel)
    handle = os.pidfd_open(child)
    watched = select.poll()
    watched.register(handle, select.POLLIN)
    watched.register(life, select.POLLIN)
    own_disk = order["mode"] == "bubblewrap"
    while not (events := watched.poll(None if own_disk else WATCH * 1000)):
        if disk_use(order["folder"], child) > order["disk_bytes"]:
            reason = DISK_FULL
            break
    if all(descriptor != handle for descriptor, _ in events):
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    end = {"signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0, "reason": reason}
    with contextlib.suppress(OSError):  # the grader may be gone
        os.write(life, json.dumps(end).encode())


def work(order: dict[str, Any], channel: int, life: int) -> None:
    """In the child: close the jail, then serve the submission."""
    try:
        os.dup2(channel, 3) if channel != 3 else None
        os.closerange(4, 4096)
        quiet = os.open("/dev/null", os.O_RDWR)
        for standard in (0, 1, 2):
            os.dup2(quiet, standard)
        os.close(quiet)
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            jail.confine(order)
        except Exception as error:
            os.write(3, wire.pack({"fault": f"{type(error).__name__}: {error}"}))
            return
        Worker(3, 3, order).serve()
    finally:
        os._exit(0)


def disk_use(folder: str, child: int) -> int:
    """Bytes that a process holds on disk, removed files that it keeps open included."""
    files = 0
    total = 0
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            files += 1
            if files > jail.MAX_FILES:
                return 1 << 62
            total += entry.stat(follow_symlinks=False).st_blocks * 512
    with contextlib.suppress(OSError):
        for number in os.listdir(f"/proc/{child}/fd"):
            with contextlib.suppress(OSError):
                held = os.stat(f"/proc/{child}/fd/{number}")
                if stat.S_ISREG(held.st_mode) and held.st_nlink == 0:
                    total += held.st_blocks * 512
    return total
