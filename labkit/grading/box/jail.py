"""What a process gives up before it runs a student's code: files, network, others, excess.

Every safe mode ends in the same two walls, an almost empty view of the file system and the
filter of `labkit.grading.box.bpf`; the modes differ in how the first one is built.
"""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import stat
from typing import Any

from labkit.grading.box import bpf, kernel

PRIVATE = "/tmp"
MAX_FILES = 256
OPEN_FILES = 32
NO_CORE = 1  # and 0 would let a program that collects core dumps have them


def confine(order: dict[str, Any]) -> None:
    """Close the jail around this process; there is no way back.

    Parameters
    ----------
    order : dict
        ``mode``; ``uid`` to change to, or None; ``folder``, the private one (modes without
        mounts); ``threads`` that may exist under this user; ``address_space`` [bytes] that
        Python and its libraries take; the `Limits` by name.

    Raises
    ------
    OSError
        If a wall cannot be built: then nothing may be run.
    """
    mode = order["mode"]
    if mode == "bubblewrap":
        empty_root(order["disk_bytes"], order["uid"])
    elif mode == "user":
        change_root(order["folder"], order["uid"])
    else:
        os.chdir(order["folder"])
    limit(order)
    if mode == "landlock":
        kernel.landlock(order["folder"])
    if order["uid"] is not None:
        os.setgroups([])
        os.setresgid(order["uid"], order["uid"], order["uid"])
        os.setresuid(order["uid"], order["uid"], order["uid"])
    if os.geteuid() == 0 or mode == "bubblewrap":
        kernel.drop_capabilities()
    kernel.prctl(kernel.PR_SET_PDEATHSIG, signal.SIGKILL, "die with the supervisor")
    kernel.seccomp(bpf.program(os.uname().machine, os.getpid(), mode != "landlock"))


def empty_root(size: int, uid: int | None) -> None:
    """Live in a small file system of one's own that holds nothing but /dev/null and /tmp."""
    kernel.unshare(kernel.NEW_MOUNTS | kernel.NEW_IPC)
    kernel.mount(None, b"/", None, kernel.RECURSIVE | kernel.PRIVATE, None)
    options = f"size={size},nr_inodes={MAX_FILES},mode=0755".encode()
    harmless = kernel.NO_SUID | kernel.NO_EXEC
    kernel.mount(b"tmpfs", PRIVATE.encode(), b"tmpfs", harmless | kernel.NO_DEVICES, options)
    os.chdir(PRIVATE)
    os.mkdir("dev")
    for name in ("null", "zero", "urandom"):
        with open(f"dev/{name}", "wb"):
            pass
        device = f"/dev/{name}".encode()
        kernel.mount(device, b"." + device, None, kernel.BIND, None)
    os.mkdir("tmp")
    if uid is not None:
        os.chown("tmp", uid, uid)
    kernel.pivot_root_here()
    os.chdir("/tmp")


def change_root(folder: str, uid: int) -> None:
    """Live in a folder that holds nothing but /dev/null and a /tmp of one's own."""
    os.chdir(folder)
    os.chmod(".", 0o755)
    os.mkdir("dev")
    with contextlib.suppress(OSError):  # some containers make no devices
        os.mknod("dev/null", stat.S_IFCHR, os.makedev(1, 3))
        os.chmod("dev/null", 0o666)
    os.mkdir("tmp")
    os.chown("tmp", uid, uid)
    os.chroot(".")
    os.chdir(PRIVATE)


def limit(order: dict[str, Any]) -> None:
    """Lower the limits that the kernel keeps for each process."""
    for what, most in {
        resource.RLIMIT_CPU: int(order["total_seconds"]) + 2,
        resource.RLIMIT_AS: order["address_space"] + order["memory"],
        resource.RLIMIT_FSIZE: order["file_bytes"],
        resource.RLIMIT_NPROC: order["threads"],
        resource.RLIMIT_NOFILE: OPEN_FILES,
        resource.RLIMIT_CORE: NO_CORE,
        resource.RLIMIT_MEMLOCK: 0,
        resource.RLIMIT_MSGQUEUE: 0,
    }.items():
        _, hard = resource.getrlimit(what)
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (least, least))
