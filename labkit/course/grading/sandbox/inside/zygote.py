"""Has numpy imported once and forks one jailed process for each submission.

The zygote itself never sees a student's code: it hands a socket on to a child that closes
its jail first, and ends that child when the grader asks, or is gone, or when the child
fills its folder.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import shutil
import signal
import socket
import stat
from typing import Any

from labkit.course.grading.sandbox.inside import data, imports, syscall_filter, walls
from labkit.course.grading.sandbox.inside.worker import Worker

WATCH = 0.02  # s between two looks at a folder that nothing else limits
BOX_END = 3  # the one descriptor besides the standard ones that a child keeps
DISK_FULL = "it filled its folder"


def main(control_number: int) -> None:
    """Serve orders from the control socket, one after the other, until its other end closes."""
    shelf = imports.Shelf()
    for own_root in (True, False):  # now, and not anew in each child
        syscall_filter.program(os.uname().machine, 0, own_root)
    control = socket.socket(fileno=control_number)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the grader
    control.send(b"ready")
    while True:
        message, descriptors, _, _ = socket.recv_fds(control, 1 << 16, 2)
        if not message:
            os._exit(0)
        if message == data.ADD_SCIPY:
            shelf.add_scipy()
            control.send(b"ready")
            continue
        channel, life = descriptors
        order = json.loads(message)
        try:
            end = supervise(order, channel, life)
        except OSError as error:
            end = {"reason": str(error)}
        if order["folder"]:  # here, since the grader may be gone
            shutil.rmtree(order["folder"], ignore_errors=True)
        with contextlib.suppress(OSError):  # the grader may be gone
            os.write(life, json.dumps(end).encode())
        os.close(life)


def supervise(order: dict[str, Any], channel: int, life: int) -> dict[str, Any]:
    """Fork a child, watch it until it ends or is to end, and say how it ended."""
    child = fork_first_of_its_kind() if order["mode"] == "bubblewrap" else os.fork()
    if child == 0:
        work(order, channel)
    os.close(channel)
    handle = os.pidfd_open(child)
    watched = select.poll()
    watched.register(handle, select.POLLIN)
    watched.register(life, select.POLLIN)
    own_disk = order["mode"] == "bubblewrap"
    private = f"{order['folder']}{walls.PRIVATE_FOLDER if order['mode'] == 'user' else ''}"
    reason = ""
    while not (events := watched.poll(None if own_disk else WATCH * 1000)):
        if disk_use(private, child) > order["disk_bytes"]:
            reason = DISK_FULL
            break
    if all(descriptor != handle for descriptor, _ in events):
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    os.close(handle)
    return {"signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0, "reason": reason}


def fork_first_of_its_kind() -> int:
    """Fork a child that is the first process, and with its threads the last, of a namespace."""
    own = os.pidfd_open(os.getpid())
    walls.unshare(walls.NEW_PIDS)
    child = os.fork()
    if child:
        walls.return_to(own, walls.NEW_PIDS)
    os.close(own)
    return child


def work(order: dict[str, Any], channel: int) -> None:
    """In the child: close the jail, then serve the submission."""
    try:
        if channel != BOX_END:
            os.dup2(channel, BOX_END)
        os.closerange(BOX_END + 1, 4096)
        quiet = os.open("/dev/null", os.O_RDWR)
        for standard in (0, 1, 2):
            os.dup2(quiet, standard)
        os.close(quiet)
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            walls.confine(order)
        except Exception as error:
            os.write(BOX_END, data.pack({"fault": f"{type(error).__name__}: {error}"}))
            return
        if order["hide_scipy"]:
            imports.Shelf.hide_scipy()
        os.environ["HOME"] = os.environ["TMPDIR"] = os.getcwd()
        Worker(BOX_END, BOX_END, order).serve()
    finally:
        os._exit(0)


def disk_use(folder: str, child: int) -> int:
    """Bytes that a process holds on disk, removed files that it keeps open included."""
    files = 0
    total = 0
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            files += 1
            if files > walls.MAX_FILES:
                return 1 << 62
            total += entry.stat(follow_symlinks=False).st_blocks * 512
    with contextlib.suppress(OSError):  # the first thread may have left, and shows none then
        threads = os.listdir(f"/proc/{child}/task")
        seen = (removed(f"/proc/{child}/task/{thread}/fd") for thread in threads)
        total += max(seen, default=0)
    return total


def removed(descriptors: str) -> int:
    """Bytes on disk of the files that are open there and have no name any more."""
    total = 0
    with contextlib.suppress(OSError):
        for number in os.listdir(descriptors):
            with contextlib.suppress(OSError):
                held = os.stat(f"{descriptors}/{number}")
                if stat.S_ISREG(held.st_mode) and held.st_nlink == 0:
                    total += held.st_blocks * 512
    return total
